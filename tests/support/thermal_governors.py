"""Governors of steam, gas and diesel units a second time: transfer functions and equations."""

import numpy as np

POWER = 0.7  # pu at the start
FOLLOWS = 0.01  # s, in which an idle temperature control follows the command


def lag(s, T):
    return 1.0 / (1.0 + s * T)


def pade(s, T):
    z = s * T
    return (12.0 - 6.0 * z + z * z) / (12.0 + 6.0 * z + z * z)


def points(p):
    return [p[f"GV{k}"] for k in range(1, 7)], [p[f"PGV{k}"] for k in range(1, 7)]


# --- transfer functions, as the diagrams print them: Pm per dw, p and pref ------------------------


def tgov3(s, p):
    pressures, flows = points(p)
    steam = POWER / (p["K1"] + p["K2"] + p["K3"])
    k = next(k for k in range(1, 6) if flows[k] > steam)
    slope = (flows[k] - flows[k - 1]) / (pressures[k] - pressures[k - 1])
    behind = (p["K2"] + p["K3"] * lag(s, p["T6"])) * lag(s, p["T5"] / slope)
    forward = lag(s, p["T3"]) * lag(s, p["T4"]) * (p["K1"] + behind)
    lead = (1.0 + s * p["T2"]) * lag(s, p["T1"])
    return [-p["K"] * lead * forward, 0.0, forward]


def degov1(s, p):
    box = (1.0 + s * p["T3"]) / (1.0 + s * p["T1"] + s * s * p["T1"] * p["T2"])
    actuator = p["K"] / s * (1.0 + s * p["T4"]) * lag(s, p["T5"]) * lag(s, p["T6"])
    open_loop = box * actuator
    throttle = open_loop / (1.0 + (1.0 - p["M"]) * p["DROOP"] * open_loop)
    forward = throttle * pade(s, p["TD"])
    return [POWER - forward, -p["M"] * p["DROOP"] * lag(s, p["TE"]) * forward, forward]


def fuel(s, p):
    """Pm per fuel command, and per dw where that stays."""
    wf = (POWER - p["AF2"]) / p["BF2"]
    command = ((p["C"] / p["A"] + p["KF"]) * wf - p["K6"]) / p["K3"]
    valve = p["A"] / (p["C"] + s * p["B"]) * lag(s, p["TAUF"])
    burnt = valve / (1.0 + p["KF"] * valve) * pade(s, p["ECR"])
    forward = p["K3"] * pade(s, p["T"]) * burnt * lag(s, p["TCD"]) * p["BF2"]
    return forward, forward * command - p["CF2"] + POWER


def gast2a(s, p):
    forward, of_speed = fuel(s, p)
    forward *= p["W"] * (1.0 + s * p["X"]) / (p["Z"] + s * p["Y"])
    return [of_speed - forward, 0.0, forward]


def gastwd(s, p):
    forward, of_speed = fuel(s, p)
    forward *= p["KP"] + p["KI"] / s + s * p["KD"] * lag(s, FOLLOWS)
    return [of_speed - forward, -p["KDROOP"] * lag(s, p["TD"]) * forward, forward]


def wesgov(s, p):
    forward = (p["KP"] + 1.0 / (s * p["TI"])) * lag(s, p["DTC"] / 2.0)
    forward *= lag(s, p["T1"]) * lag(s, p["T2"])
    late = pade(s, max(p["DTP"] - p["DTC"], 0.0) / 2.0) * lag(s, p["TPE"])
    return [-forward, -p["DROOP"] * late * forward, forward]


FUNCTIONS = {
    "TGOV3": tgov3,
    "DEGOV1": degov1,
    "GAST2A": gast2a,
    "GASTWD": gastwd,
    "WESGOV": wesgov,
}
# what makes every block act, with delays that are no faster than the rest
TURBINE = {"AF1": 0.1, "BF1": 0.1, "TR": 1.0, "TC": 1.03, "TAUT": 1.0, "T5": 0.1, "KF": 0.1}
TURBINE |= {"T": 0.2, "ECR": 0.2, "ETD": 0.3}
LIVELY = {
    "TGOV3": {"T1": 1.0, "T2": 0.5, "GV6": 1.2, "PGV6": 1.1, "PRMAX": 2.0},
    "DEGOV1": {"TD": 0.3},
    "GAST2A": TURBINE | {"W": 100.0},
    "GASTWD": TURBINE | {"KP": 4.0, "KD": 0.01},
    "WESGOV": {"DTP": 0.3},
}
# the state that a limit stops
STATES = {
    "TGOV3": {"PMAX": "VALVE", "PMIN": "VALVE", "PRMAX": "PR"},
    "DEGOV1": {"TMAX": "INTEG", "TMIN": "INTEG"},
    "GAST2A": {"MAX": "TEMP", "MIN": "TEMP"},
    "GASTWD": {"MAX": "TEMP", "MIN": "TEMP"},
}


# --- equations: slopes and Pm of states, speed, power and reference -------------------------------


def felt(w, p):
    return max(w - p["DBH"], 0.0) if w > 0.0 else min(w - p["DBL"], 0.0)


def held(x, rate, low, high):
    """Stop a rate at a limit that its state has reached."""
    return min(rate, 0.0) if x >= high else max(rate, 0.0) if x <= low else rate


def late(u, x, v, T):
    """A delay with its states, and their slopes."""
    return u - v, v / T, (12.0 * (u - x) - 6.0 * v) / T


def typed_tgov3(x, w, pe, ref, p):
    slow, opened, bowl, pressure, crossed = x
    steam = np.clip(opened, p["PMIN"], p["PMAX"])
    signal = p["K"] * felt(w, p)
    asked = ref - signal * p["T2"] / p["T1"] - slow * (1.0 - p["T2"] / p["T1"])
    opening = np.clip((asked - steam) / p["T3"], p["UC"], p["UO"])
    flow = np.interp(pressure, *points(p))
    return [
        (signal - slow) / p["T1"],
        held(opened, opening, p["PMIN"], p["PMAX"]),
        (steam - bowl) / p["T4"],
        held(pressure, (bowl - flow) / p["T5"], -np.inf, p["PRMAX"]),
        (flow - crossed) / p["T6"],
    ], p["K1"] * bowl + p["K2"] * flow + p["K3"] * crossed


def typed_degov1(x, w, pe, ref, p):
    box, moving, integral, slow, behind, measured, torque, turning = x
    kept = np.clip(integral, p["TMIN"], p["TMAX"])
    throttle = np.clip(behind, p["TMIN"], p["TMAX"])
    error = ref - felt(w, p) - p["DROOP"] * throttle  # M = 0
    share = p["T4"] / p["T5"]
    out, *slopes = late(throttle, torque, turning, p["TD"])
    return [
        moving,
        ((error - box) / p["T1"] - moving) / p["T2"],
        held(integral, p["K"] * (box + p["T3"] * moving), p["TMIN"], p["TMAX"]),
        (kept - slow) / p["T5"],
        (share * kept + (1.0 - share) * slow - behind) / p["T6"],
        (pe - measured) / p["TE"],
        *slopes,
    ], out * (1.0 + w)


def typed_turbine(x, command, w, p):
    (demand, turn, valve, wf, burnt, turn2, gas, exhaust, turn3, shield, couple, temp, gate) = x
    error = p["TC"] - couple
    least = temp + p["T5"] / p["TAUT"] * error
    asked = command
    if error < 0.0 or gate > 0.5:
        asked = min(command, least)
        temp_slope = held(temp, error / p["TAUT"], p["MIN"], p["MAX"])
    else:
        temp_slope = (np.clip(command, p["MIN"], p["MAX"]) - temp) / FOLLOWS
    opens = 1.0 - gate if error < 0.0 else -gate if least >= command else 0.0
    fed = p["K3"] * np.clip(asked, p["MIN"], p["MAX"]) * (1.0 + w)
    given, *of_demand = late(fed, demand, turn, p["T"])
    fire, *of_fire = late(wf, burnt, turn2, p["ECR"])
    gone, *of_exhaust = late(fire, exhaust, turn3, p["ETD"])
    hot = p["TR"] - p["AF1"] * (1.0 - gone) - p["BF1"] * w
    return [
        *of_demand,
        (p["A"] * (given + p["K6"] - p["KF"] * wf) - p["C"] * valve) / p["B"],
        (valve - wf) / p["TAUF"],
        *of_fire,
        (fire - gas) / p["TCD"],
        *of_exhaust,
        (p["K5"] * hot - shield) / p["T3"],
        (p["K4"] * hot + shield - couple) / p["T4"],
        temp_slope,
        opens / FOLLOWS,
    ], (p["AF2"] + p["BF2"] * gas - p["CF2"] * w) * (1.0 + w)


def typed_gast2a(x, w, pe, ref, p):
    gov, *of_turbine = x
    slope = (ref - felt(w, p) - p["Z"] * gov) / p["Y"]
    slopes, power = typed_turbine(of_turbine, p["W"] * (gov + p["X"] * slope), w, p)
    return [slope, *slopes], power


def typed_gastwd(x, w, pe, ref, p):
    droop, integral, slow, *of_turbine = x
    error = ref - felt(w, p) - droop
    steep = (error - slow) / FOLLOWS
    command = p["KP"] * error + integral + p["KD"] * steep
    rate = p["KI"] * error
    if (command >= p["MAX"] and rate > 0.0) or (command <= p["MIN"] and rate < 0.0):
        rate = 0.0
    command = np.clip(command, p["MIN"], p["MAX"])
    slopes, power = typed_turbine(of_turbine, command, w, p)
    return [(p["KDROOP"] * pe - droop) / p["TD"], rate, steep, *slopes], power


def typed_wesgov(x, w, pe, ref, p):
    measured, behind, turning, integral, command, valve, power = x
    sampled, *slopes = late(measured, behind, turning, (p["DTP"] - p["DTC"]) / 2.0)
    error = ref - felt(w, p) - p["DROOP"] * sampled
    change = 2.0 * (p["KP"] * error + integral - command)
    return [
        (pe - measured) / p["TPE"],
        *slopes,
        error / p["TI"],
        np.clip(change, -p["ALIM"], p["ALIM"]) / p["DTC"],
        (command - valve) / p["T1"],
        (valve - power) / p["T2"],
    ], power


HOT = {
    "AF1": 0.5,
    "TC": 0.9935,
    "TAUT": 0.05,
    "T3": 1.0,
    "T4": 0.5,
    "MAX": 0.95,
    "MIN": 0.6,
    "BF1": 0.01,
}
TYPED = {
    "TGOV3": (typed_tgov3, 0.05, {"UO": 0.3, "UC": -0.5, "PMAX": 0.9, "PMIN": 0.5, "PRMAX": 0.4}),
    "DEGOV1": (typed_degov1, 0.05, {"K": 10.0, "TMAX": 0.77, "TMIN": 0.5}),
    "GAST2A": (typed_gast2a, -0.02, HOT),
    "GASTWD": (typed_gastwd, -0.08, HOT | {"TC": 0.9929}),
    "WESGOV": (typed_wesgov, 0.02, {"ALIM": 0.02}),
}
