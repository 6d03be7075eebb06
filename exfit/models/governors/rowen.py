"""Gas turbines by Rowen, whose exhaust temperature limits the fuel: GAST2A and GASTWD."""

from exfit.models.blocks import Signal, clip, lag, larger, limited, pid, smaller, where
from exfit.models.governor_parts import BAND, banded, delayed, governor, in_use, outside_band
from exfit.models.sheet import DIVIDING_TIME, LONG_TIME, SHORT_TIME, TIME, WITHIN_10, limits, sheet

TURBINE = """
                                        MAX
speed command, temperature ─►[least]─►[clip]─►(x)─►[K3]─►[exp(-sT)]─► demand
                                        MIN    ▲
1 + dw ────────────────────────────────────────┘

demand + K6 ─►(+)─►[  A   ]─►[    1    ]─┬─► wf ─►[exp(-sECR)]─► burnt
             -▲    [C + sB]  [1 + sTAUF] │
              └────────[KF]◄─────────────┘

burnt ─┬─►[    1   ]─►[AF2 + BF2 x - CF2 dw]─►(x)─► Pm
       │  [1 + sTCD]                           ▲
       │                              1 + dw ──┘
       └─►[exp(-sETD)]─►[TR - AF1 (1 - x) - BF1 dw]─►[K4 +   K5   ]─► shield
                                                     [    1 + sT3 ]

TC ────────────────►(+)─►[1 + sT5]─► temperature
                   -▲    [ sTAUT ]
shield ─►[   1   ]──┘
         [1 + sT4]

The control of the temperature begins where its error falls below 0, and ends
where it asks for more than the speed command. Until it begins, its integral
follows that command within 10 ms; in OPAL-RT's library and InterPSS it is at
MAX, and set to the command at that moment. MAX and MIN clip the command. The
three delays are Padé approximants of order two, as in OPAL-RT's library:
their phase errs by 0.07 degrees at 1/T rad/s. The fuel is multiplied by the
speed as there and in PowerWorld 24; in InterPSS it is not."""

STEP = 0.01  # s, in which the idle temperature control follows the speed command
TURBINE_STATES = "DEMAND DDEMAND VALVE WF COMB DCOMB GAS EXH DEXH SHIELD COUPLE TEMP GATE"
HEAD = "ETD TCD Trate T MAX MIN ECR K3 A B C TAUF KF K5 K4 T3 T4 TAUT T5"
CONS = f"{HEAD} AF1 BF1 AF2 BF2 CF2 TR K6 TC"
DOUBT = (
    "its delays are Padé approximants of order two; how the temperature control takes over, "
    "and how limits act"
)


def turbine(command: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the fuel system and the turbine into d and return Pm."""
    low, high, faster = in_use(s.MIN0, p.MIN), in_use(s.MAX0, p.MAX), 1.0 + u.dw
    error = p.TC - s.COUPLE
    temperature = s.TEMP + p.T5 / p.TAUT * error
    acts = (s.GATE > 0.5) | (error < 0.0)
    least = where(acts, smaller(command, temperature), command)
    kept = clip(command, low, high)
    d.TEMP = where(acts, limited(error / p.TAUT, s.TEMP, low, high).slope, (kept - s.TEMP) / STEP)
    ends = where((temperature >= command) & (error >= 0.0), -s.GATE / STEP, 0.0)
    d.GATE = where(error < 0.0, (1.0 - s.GATE) / STEP, ends)
    fuel = p.K3 * clip(least, low, high) * faster
    demand, d.DEMAND, d.DDEMAND = delayed(fuel, s.DEMAND, s.DDEMAND, p.T)
    d.VALVE = (p.A * (demand + p.K6 - p.KF * s.WF) - p.C * s.VALVE) / p.B
    d.WF = (s.VALVE - s.WF) / p.TAUF
    burnt, d.COMB, d.DCOMB = delayed(s.WF, s.COMB, s.DCOMB, p.ECR)
    gas, d.GAS = lag(burnt, s.GAS, 1.0, p.TCD)
    exhaust, d.EXH, d.DEXH = delayed(burnt, s.EXH, s.DEXH, p.ETD)
    f1 = p.TR - p.AF1 * (1.0 - exhaust) - p.BF1 * u.dw
    shield, d.SHIELD = lag(f1, s.SHIELD, p.K5, p.T3)
    _, d.COUPLE = lag(p.K4 * f1 + shield, s.COUPLE, 1.0, p.T4)
    return (p.AF2 + p.BF2 * gas - p.CF2 * u.dw) * faster


def turbine_rest(pm: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return the command."""
    wf = (pm - p.AF2) / p.BF2
    x.DEMAND = (p.C / p.A + p.KF) * wf - p.K6
    x.VALVE = x.WF = x.COMB = x.GAS = x.EXH = wf
    x.DDEMAND = x.DCOMB = x.DEXH = x.GATE = 0.0
    f1 = p.TR - p.AF1 * (1.0 - wf)
    x.SHIELD, x.COUPLE = p.K5 * f1, (p.K4 + p.K5) * f1
    x.TEMP = x.DEMAND / p.K3
    x.MAX0, x.MIN0 = larger(p.MAX, x.TEMP), smaller(p.MIN, x.TEMP)
    return x.TEMP


ROWEN = sheet(
    ("ETD", 0.04, *SHORT_TIME, "exhaust delay"),
    ("TCD", 0.2, *TIME, "turbine lag"),
    ("T", 0.031, *SHORT_TIME, "fuel control delay"),
    *limits("MAX", 1.5, -0.13, "the fuel command", WITHIN_10),
    ("ECR", 0.01, *SHORT_TIME, "combustor delay"),
    ("K3", 0.9, "1", (0.001, 10.0), "share of the fuel under control"),
    ("A", 1.0, "1", (0.001, 1000.0), "valve positioner gain"),
    ("B", 1.0, *DIVIDING_TIME, "valve positioner time constant"),
    ("C", 1.0, "1", (0.0, 1000.0), "valve positioner feedback"),
    ("TAUF", 0.5, *DIVIDING_TIME, "fuel system time constant"),
    ("KF", 0.0, "1", (0.0, 100.0), "fuel system feedback"),
    ("K5", 0.2, "1", (0.0, 1000.0), "share behind the radiation shield"),
    ("K4", 0.8, "1", (0.0, 1000.0), "share beside the radiation shield"),
    ("T3", 15.0, *DIVIDING_TIME, "radiation shield lag"),
    ("T4", 2.5, *DIVIDING_TIME, "thermocouple lag"),
    ("TAUT", 300.0, "s", (0.001, 100000.0), "temperature control time constant"),
    ("T5", 0.031, *LONG_TIME, "temperature control lead"),
    ("AF1", 700.0, "degrees", (0.0, 10000.0), "temperature by the fuel"),
    ("BF1", 550.0, "degrees", (-10000.0, 10000.0), "temperature by the speed"),
    ("AF2", -0.64, "pu", (-10.0, 10.0), "torque without fuel"),
    ("BF2", 1.36, "pu", (0.001, 10.0), "torque by the fuel"),
    ("CF2", 1.0, "pu", (-10.0, 10.0), "torque by the speed"),
    ("TR", 750.0, "degrees", (0.0, 10000.0), "rated exhaust temperature"),
    ("K6", 0.25, "pu", (-10.0, 10.0), "least fuel"),
    ("TC", 900.0, "degrees", (0.0, 10000.0), "limit of the exhaust temperature"),
    *BAND,
)


def gast2a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    error = u.pref - outside_band(u.dw, p)
    d.GOV = (error - p.Z * s.GOV) / p.Y
    return turbine(p.W * (s.GOV + p.X * d.GOV), s, u, p, d)


def gast2a_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.GOV = turbine_rest(pm, p, x) / p.W
    return p.Z * x.GOV


GAST2A = governor(
    gast2a,
    gast2a_rest,
    sheet(
        ("W", 25.0, "1", (0.01, 1000.0), "governor gain, 1 over the droop"),
        ("X", 0.0, *TIME, "governor lead"),
        ("Y", 0.05, *DIVIDING_TIME, "governor time constant"),
        ("Z", 1.0, "1", (0.0, 1.0), "1: droop, 0: isochronous"),
        *ROWEN,
    ),
    f"GOV {TURBINE_STATES}",
    text=f"""GAST2A: gas turbine governor with the exhaust temperature (PSS/E).

pref ─►(+)─►[W(1 + sX)]─► speed command
     -▲    [ Z + sY   ]
dw ───┘
{TURBINE}

pref is a speed, Z over W times the fuel command at rest. Typical data are
those of OPAL-RT's library.""",
    aliases="GAST2AD",
    setpoints="MAX0 MIN0",
    records=banded("GAST2A", f"W X Y Z {CONS}", ignored="Trate"),
    doubt=DOUBT,
)


def gastwd(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    droop, d.DROOP = lag(u.p, s.DROOP, p.KDROOP, p.TD)
    error = u.pref - outside_band(u.dw, p) - droop
    low, high = in_use(s.MIN0, p.MIN), in_use(s.MAX0, p.MAX)
    command, d.INTEG, d.DERIV = pid(error, s.INTEG, s.DERIV, p.KP, p.KI, p.KD, STEP, low, high)
    return turbine(command, s, u, p, d)


def gastwd_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.INTEG, x.DERIV, x.DROOP = turbine_rest(pm, p, x), 0.0, p.KDROOP * u.p
    return x.DROOP


GASTWD = governor(
    gastwd,
    gastwd_rest,
    sheet(
        ("KDROOP", 0.05, "pu", (0.0, 10.0), "permanent droop"),
        ("KP", 2.0, "1", (0.0, 1000.0), "proportional gain"),
        ("KI", 1.0, "1/s", (0.001, 1000.0), "integral gain"),
        ("KD", 0.0, "s", (0.0, 1000.0), "derivative gain"),
        ("TD", 0.1, *TIME, "power transducer lag"),
        *ROWEN,
    ),
    f"DROOP INTEG DERIV {TURBINE_STATES}",
    text=f"""GASTWD: gas turbine governor by Woodward with the exhaust temperature (PSS/E).

pref ─►(+)─►[KP + KI/s + sKD]─► speed command
     -▲ ▲-
dw ───┘ └─[KDROOP ]◄── p
          [1 + sTD]
{TURBINE}

pref is a speed, KDROOP times the power at rest. The derivative has a lag of
10 ms; the integral waits while the command is beyond MAX or MIN. Typical data
are those of GAST2A, those of the PID of a case of InterPSS.""",
    aliases="GASTWDD",
    setpoints="MAX0 MIN0",
    records=banded("GASTWD", f"KDROOP KP KI KD {CONS} TD", ignored="Trate"),
    doubt=DOUBT,
)
