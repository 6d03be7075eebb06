"""Limiters on load as one would type them from their diagrams, run from switching to switching.

Every choice (a limit, a gate, a timer, a latch) stays as it was made until an event of the
integrator ends it, so that all that is integrated is smooth.
"""

from functools import lru_cache, partial
from itertools import pairwise
from math import inf

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from typed_on_load import Typed

NEAR = 1e-9  # pu or s by which a choice is wrong when it is made anew
MOST_EVENTS = 400
FREE, WAITS, FOLLOWS = "free", "waits", "follows"  # what the integral of a PID does
AHEAD = 1e-5  # s, over which a drift is taken
SIDES = ("high", 1.0), ("low", -1.0)


class Choices:
    """The choices of a run, and the margins by which they hold.

    A timer is the instant since which it runs, a latch what it was set to last. ``events`` are the
    instant, the name and what was chosen.
    """

    def __init__(self):
        self.now, self.begun = 0.0, False
        self.made, self.margins = {}, {}
        self.since, self.runs = {}, {}
        self.latched, self.wanted = {}, {}
        self.fast, self.drifts, self.next_mode = {}, {}, {}  # of PIDs
        self.events = []

    def above(self, name, a, b=0.0):
        made = self.made.setdefault(name, a > b)
        self.margins[name] = a - b if made else b - a
        return made

    def within(self, name, y, low, high):
        if self.above(f"{name} high", y, high):
            return high
        return low if self.above(f"{name} low", low, y) else y

    def lower(self, name, a, b):
        """Return the smaller of two signals; the choice is whether that is the second."""
        return b if self.above(name, a, b) else a

    def higher(self, name, a, b):
        return b if self.above(name, b, a) else a

    def stopped(self, name, x, rate, low, high):
        """Return the slope of a state that stops at its limits."""
        for (side, sign), limit in zip(SIDES, (high, low), strict=True):
            beyond, push = sign * (x - limit), sign * rate
            key = f"{name} {side}"
            stuck = self.made.setdefault(key, beyond > -NEAR and push > 0.0)
            self.margins[key] = push if stuck else -beyond
            rate = 0.0 if stuck else rate
        return rate

    def pid(self, name, fast, x, rate, low, high):
        """Return the output of an integral and what is beside it, and the slope of the integral.

        That waits while it would push the output further beyond a limit, and follows a limit that
        the output would pass as it moves, and leave as it waits.
        """
        y, slope = fast + x, rate
        self.fast[name] = fast
        drift = self.drifts.get(name, 0.0)
        for (side, sign), limit in zip(SIDES, (high, low), strict=True):
            key = f"{name} {side}"
            beyond, push, away = sign * (y - limit), sign * rate, sign * drift
            mode = self.made.setdefault(key, WAITS if min(beyond, push) > 0.0 else FREE)
            margin = {FREE: -min(beyond, push), WAITS: min(beyond, push)}
            self.margins[key] = margin[mode] if mode in margin else min(-away, away + push)
            self.next_mode[key] = FREE
            if push > 0.0 and (beyond > 4.0 * NEAR or (beyond > -4.0 * NEAR and away > 0.0)):
                self.next_mode[key] = WAITS
            elif push > 0.0 and beyond > -4.0 * NEAR and away + push >= 0.0:
                self.next_mode[key] = FOLLOWS
            if mode != FREE:
                return limit, 0.0 if mode == WAITS else -drift
        return self.within(f"{name} output", y, low, high), slope

    def lead_lag(self, name, u, x, TC, TB, low, high):
        """Return output and slope of (1 + sTC)/(1 + sTB); its state follows the limited output."""
        if TC == 0.0:
            return x, self.stopped(name, x, (u - x) / TB, low, high)
        y = self.within(name, x + TC / TB * (u - x), low, high)
        return y, (y - x) / TC

    def timer(self, name, runs):
        """Return for how long something has been so; at the start, since long ago."""
        self.runs[name] = runs
        since = self.since.get(name)
        return 0.0 if since is None else self.now - since

    def latch(self, name, sets, resets, start=False):
        latched = self.latched.setdefault(name, start)
        self.wanted[name] = sets or (latched and not resets)
        return latched

    def settle(self, t, evaluate, passed=None):
        """Make the choice that an event has passed anew, and all that do not hold, until all do."""
        for _ in range(60):
            self.margins = {}
            evaluate()
            self.made = {name: self.made[name] for name in self.margins}
            if passed is not None:
                self._change(t, passed)
            elif not self._one_changed(t):
                self.begun = True
                return
            passed = None
        raise AssertionError(f"no choice holds at {t:.6g} s: {self.events[-6:]}")

    def _one_changed(self, t):
        for name, runs in self.runs.items():
            if runs != (self.since.get(name) is not None):
                self.since[name] = None if not runs else t if self.begun else -inf
                return True
        for name, wanted in self.wanted.items():
            if wanted != self.latched[name]:
                self.latched[name] = wanted
                self.events.append((t, name, wanted))
                return True
        wrong = [name for name, margin in self.margins.items() if margin < -2.0 * NEAR]
        if wrong:
            self._change(t, wrong[0])
        return bool(wrong)

    def _change(self, t, name):
        made = self.made[name]
        self.made[name] = self.next_mode.get(name, not made)
        self.events.append((t, name, self.made[name]))

    def times(self, name):
        """Return when something was chosen, or given up, and which."""
        return [(t, made) for t, each, made in self.events if each == name]


# --- limiters: slopes and outputs, and the states at which they wait ------------------------------


def inverse_time(c, i, t, iref, p, time, at_once=False):
    """Return the slopes of timer and reference, and whether the timer is full."""
    ratio = i / p["ITFPU"]
    inverse = p["K2"] * (ratio ** p["C2"] - 1.0)
    inverse = c.within("inverse time", inverse, p["VINVMIN"], p["VINVMAX"])
    fixed = p["FIXEDRU"] if c.above("pick-up", ratio, 1.0) else p["FIXEDRD"]
    d_t = c.stopped("timer", t, inverse + fixed - p["KFB"] * t, p["TMIN"], p["TMAX"])
    # the timer may stop where it is full
    full = c.above("full", t, time - 2.0 * NEAR)
    current = p["K1"] * (ratio ** p["C1"] - 1.0)
    if c.above("empty", time * (1.0 - p["KZRU"]), t):
        rate = current if p["SW1"] else p["KRU"]
    elif full or at_once:
        rate = current if p["SW1"] else p["KRD"]
    else:
        rate = 0.0
    return d_t, c.stopped("reference", iref, rate, p["ILIM"], p["IINST"]), full


def regulator(c, side, e, x, p):
    """Return output and slopes of a PID and two lead-lags."""
    integral, washed, x2, x1 = x
    d_washed = (e - washed) / p[f"TD{side}"]
    fast = p[f"KP{side}"] * e + p[f"KD{side}"] * d_washed
    limits = [(p[f"V{side}MIN{k}"], p[f"V{side}MAX{k}"]) for k in (3, 2, 1)]
    y, d_integral = c.pid(f"PID {side}", fast, integral, p[f"KI{side}"] * e, *limits[0])
    y, d_2 = c.lead_lag(f"last but one {side}", y, x2, p[f"TC2{side}"], p[f"TB2{side}"], *limits[1])
    y, d_1 = c.lead_lag(f"last {side}", y, x1, p[f"TC1{side}"], p[f"TB1{side}"], *limits[2])
    return y, [d_integral, d_washed, d_2, d_1]


def regulator_start(side, e, p):
    """Return where it waits: the integral at the limit that its input pushes it to."""
    low, high = p[f"V{side}MIN3"], p[f"V{side}MAX3"]
    integral = 0.0 if p[f"KI{side}"] == 0.0 else high if e > 0.0 else low
    y = np.clip(p[f"KP{side}"] * e + integral, low, high)
    y2 = np.clip(y, p[f"V{side}MIN2"], p[f"V{side}MAX2"])
    return [integral, e, y2, np.clip(y2, p[f"V{side}MIN1"], p[f"V{side}MAX1"])]


def oel2c(c, x, u, p):
    i, t, iref, behind = x[:4]
    iact = p["KACT"] * i
    d_t, d_iref, full = inverse_time(c, i, t, iref, p, p["TFCL"])
    over = c.timer("over", c.above("above the reference", iact, iref))
    below = c.timer("below", c.above("below the reference", iref, iact + p["ITHOFF"]))
    on = full or p["TEN"] == 0.0 or c.above("TEN", over, p["TEN"])
    back = c.above("reference back", iref, p["IINST"] - 2.0 * NEAR)
    off = c.above("TOFF", below, p["TOFF"]) and back
    active = c.latch("active", on, off, p["TEN"] == 0.0)
    e = behind - iact + (0.0 if active else p["IRESET"])
    voel, slopes = regulator(c, "OEL", e, x[4:], p)
    d_i = (p["KSCALE"] * u["ifd"] - i) / p["TROEL"]
    return [d_i, d_t, d_iref, (iref - behind) / p["TAOEL"], *slopes], {"oel": voel}


def oel2c_start(u, p):
    i = p["KSCALE"] * u["ifd"]
    e = p["IINST"] - p["KACT"] * i + (0.0 if p["TEN"] == 0.0 else p["IRESET"])
    return [i, p["TMIN"], p["IINST"], p["IINST"], *regulator_start("OEL", e, p)]


def oel3c(c, x, u, p):
    i, v = x
    e = p["KOEL"] * (p["ITFPU"] ** p["K1"] - i ** p["K1"])
    rate = c.stopped("integral", v, e / p["TOEL"], p["VOELMIN1"], p["VOELMAX1"])
    y = v + p["KPOEL"] * e if c.above("time over", 0.0, v) else v
    voel = c.within("output", y, p["VOELMIN2"], p["VOELMAX2"])
    return [(p["KSCALE"] * u["ifd"] - i) / p["TF"], rate], {"oel": voel}


def oel3c_start(u, p):
    return [p["KSCALE"] * u["ifd"], p["VOELMAX1"]]


def oel5c(c, x, u, p):
    i, seen, t, integral = x
    d_seen = (i - seen) / p["TBOEL"]
    ic = seen + p["TCOEL"] * d_seen
    count = i ** p["K1"] - p["IFDPU"] - p["KIFDT"] * t
    d_t = c.stopped("timer", t, count / p["TOEL"], 0.0, p["VOELMAX1"])
    full, empty = c.above("full", t, p["IFDLIM"]), c.above("empty", 2.0 * NEAR, t)
    latched = c.latch("latch", full, empty)
    high = c.timer("high", c.above("IFDPULEV", i, p["IFDPULEV"]))
    soon = c.above("TIFDLEV", high, p["TIFDLEV"])
    e = (p["IFDREF2"] if latched else p["IFDREF1"]) - p["K"] * ic
    v, d_v = c.pid("PI", p["KPOEL"] * e, integral, p["KIOEL"] * e, p["VOELMIN"], p["VOELMAX"])
    d_i = (p["KSCALE1"] * u["ifd"] - i) / p["TF1"]
    return [d_i, d_seen, d_t, d_v], {"oel": v if latched or soon else p["IBIAS"]}


def oel5c_start(u, p):
    i = p["KSCALE1"] * u["ifd"]
    return [i, i, 0.0, p["VOELMAX"]]


def uel1(c, x, u, p):
    it = complex(u["P"], -u["Q"]) / u["vt"]
    vuc = c.lower("VUCMAX", abs(p["KUC"] * u["vt"] - 1j * it), p["VUCMAX"])
    e = vuc - c.lower("VURMAX", p["KUR"] * u["vt"], p["VURMAX"])
    y, d_v = c.pid("PI", p["KUL"] * e, x[0], p["KUI"] * e, p["VUIMIN"], p["VUIMAX"])
    y1, d_1 = c.lead_lag("first", y, x[1], p["TU1"], p["TU2"], -inf, inf)
    y3, d_3 = c.lead_lag("second", y1, x[2], p["TU3"], p["TU4"], -inf, inf)
    return [d_v, d_1, d_3], {"uel": c.within("output", y3, p["VULMIN"], p["VULMAX"])}


def uel1_start(u, p):
    it = complex(u["P"], -u["Q"]) / u["vt"]
    e = abs(p["KUC"] * u["vt"] - 1j * it) - p["KUR"] * u["vt"]
    v = p["VUIMIN"] if p["KUI"] else 0.0
    y = np.clip(p["KUL"] * e + v, p["VUIMIN"], p["VUIMAX"])
    return [v, y, y]


def bias(c, v, p):
    if c.above("voltage above 1", v, 1.0):
        return v
    return 1.0 if c.above("voltage above VBIAS", v, p["VBIAS"]) else v / p["VBIAS"]


def least_reactive(c, active, p):
    """Return Q on the line through the points, whose ends go on straight."""
    count = next(k for k in range(1, 11) if k == 10 or p[f"P{k + 1}"] <= p[f"P{k}"])
    k = 0
    while k + 1 < count and c.above(f"beyond point {k + 1}", active, p[f"P{k + 1}"]):
        k += 1
    (P, Q), (P_end, Q_end) = ((p[f"P{n}"], p[f"Q{n}"]) for n in (k, k + 1))
    return Q + (Q_end - Q) * (active - P) / (P_end - P)


def reduction(u, p):
    a = u["vt"] ** 2 / p["XQ"] + u["Q"]
    return a / np.sqrt(a * a + u["P"] ** 2)


def uel2c(c, x, u, p):
    v, active, qref, qm, k, integral, x1, x3 = x
    f = bias(c, v, p)
    d_k = c.stopped("kadj", k, (reduction(u, p) - k) / p["TADJ"], 0.1, 1.0)
    e = (k if p["SW1"] == 2.0 else p["KFIX"]) * (qref - qm)
    y, d_v = c.pid("PI", p["KUL"] * e, integral, p["KUI"] * e, p["VUIMIN"], p["VUIMAX"])
    y1, d_1 = c.lead_lag("first", y, x1, p["TU1"], p["TU2"], p["VUELMIN2"], p["VUELMAX2"])
    y3, d_3 = c.lead_lag("second", y1, x3, p["TU3"], p["TU4"], p["VUELMIN1"], p["VUELMAX1"])
    return [
        (u["vt"] - v) / p["TUV"],
        (u["P"] / f ** p["K1"] - active) / p["TUP"],
        (least_reactive(c, active, p) * f ** p["K2"] - qref) / p["TQREF"],
        (u["Q"] - qm) / p["TUQ"],
        *(d_k, d_v, d_1, d_3),
    ], {"uel": y3}


def uel2c_start(u, p):
    c = Choices()
    f, k = bias(c, u["vt"], p), reduction(u, p)
    active = u["P"] / f ** p["K1"]
    qref = least_reactive(c, active, p) * f ** p["K2"]
    e = (k if p["SW1"] == 2.0 else p["KFIX"]) * (qref - u["Q"])
    v = p["VUIMIN"] if p["KUI"] else 0.0
    y = np.clip(p["KUL"] * e + v, p["VUIMIN"], p["VUIMAX"])
    y1 = np.clip(y, p["VUELMIN2"], p["VUELMAX2"])
    return [u["vt"], active, qref, u["Q"], k, v, y1, np.clip(y1, p["VUELMIN1"], p["VUELMAX1"])]


def scl1c(c, x, u, p):
    i, late, iq, oex, uex = x
    it = np.hypot(u["P"], u["Q"]) / u["vt"]
    error = i ** p["K"] - p["ISCLLIM"]
    delayed = c.above("TINV", late, p["ISCLLIM"])
    if not p["SW2"]:
        delayed = c.above("TDSCL", c.timer("delay", c.above("current", error)), p["TDSCL"])
    outputs, slopes = {}, []
    for side, sign, state in (("oel", 1.0, oex), ("uel", -1.0, uex)):
        own = "OEX" if side == "oel" else "UEX"
        if p["SW1"] == 1.0:
            reactive = sign * np.sign(iq) * abs(iq) ** p["K"] - p["IQMIN"]
            e = c.lower(f"{side} by the current", reactive, error)
        else:
            acts = c.above(f"{side} by its power", sign * u["Q"], p["VSCLDB"]) and delayed
            e = error if acts else c.lower(f"{side} waits", error, 0.0)
        fast, rate = p[f"KP{own}"] * e, p[f"KI{own}"] * e
        y, slope = c.pid(side, fast, state, rate, p["VSCLMIN"], p["VSCLMAX"])
        outputs[side] = -sign * c.higher(f"{side} acts", 0.0, y)
        slopes.append(slope)
    lags = [(it - i) / p["TIT"], (it - late) / p["TINV"], (u["Q"] / u["vt"] - iq) / p["TQSCL"]]
    return [*lags, *slopes], outputs


def scl1c_start(u, p):
    it = np.hypot(u["P"], u["Q"]) / u["vt"]
    return [it, it, u["Q"] / u["vt"], p["VSCLMIN"], p["VSCLMIN"]]


def scl2c(c, x, u, p):
    i, v, t, iref, ipref, ref = x[:6]
    ip, iq = u["P"] / u["vt"], u["Q"] / u["vt"]
    depressed = c.above("VTRESET", p["VTRESET"], v)
    d_t, d_iref, full = inverse_time(c, i, t, iref, p, p["TSCL"], depressed)
    slopes = [
        (np.hypot(ip, iq) - i) / p["TITSCL"],
        (u["vt"] - v) / p["TVTSCL"],
        *(d_t, d_iref, (p["KPREF"] * ip - ipref) / p["TIPOEL"]),
        (np.sqrt(iref**2 - ipref**2) - ref) / p["TAOEL"],
    ]
    outputs = {}
    for side, own in (("OEL", x[6:12]), ("UEL", x[12:])):
        iact = np.hypot(own[0], own[1])
        limit = c.lower("IINSTUEL", ref, p["IINSTUEL"]) if side == "UEL" else ref
        whole = min(p["IINST"], p["IINSTUEL"]) if side == "UEL" else p["IINST"]
        over = c.timer(f"over {side}", c.above(f"above the reference {side}", iact, limit))
        below = c.above(f"below the reference {side}", limit, iact + p["ITHOFF"])
        below = c.timer(f"below {side}", below)
        ten = p[f"TEN{side}"]
        on = full or ten == 0.0 or c.above(f"TEN {side}", over, ten)
        back = c.above(f"reference back {side}", iref, whole - 2.0 * NEAR)
        off = c.above(f"TOFF {side}", below, p["TOFF"]) and back
        if side == "OEL":
            on = ten == 0.0 or (on and c.above("VTMIN", v, p["VTMIN"]))
            off = off or depressed
        active = c.latch(f"active {side}", on, off, ten == 0.0)
        reset = 0.0 if active else p["IRESET"]
        if side == "OEL":
            e = c.higher("IQMINOEL", limit + reset - iact, p["IQMINOEL"] - own[1])
            e = c.higher("voltage", e, p["VTMIN"] - v)
        else:
            e = c.lower("IQMAXUEL", iact - limit - reset, p["IQMAXUEL"] - own[1])
        outputs[side.lower()], of_regulator = regulator(c, side, e, own[2:], p)
        d_p = (p[f"KIP{side}"] * ip - own[0]) / p[f"TIP{side}"]
        d_q = (p[f"KIQ{side}"] * iq - own[1]) / p[f"TIQ{side}"]
        slopes += [d_p, d_q, *of_regulator]
    return slopes, outputs


def scl2c_start(u, p):
    ip, iq = u["P"] / u["vt"], u["Q"] / u["vt"]
    ref = np.sqrt(p["IINST"] ** 2 - (p["KPREF"] * ip) ** 2)
    x = [np.hypot(ip, iq), u["vt"], p["TMIN"], p["IINST"], p["KPREF"] * ip, ref]
    for side in ("OEL", "UEL"):
        own = p[f"KIP{side}"] * ip, p[f"KIQ{side}"] * iq
        reset = 0.0 if p[f"TEN{side}"] == 0.0 else p["IRESET"]
        if side == "OEL":
            e = max(ref + reset - np.hypot(*own), p["IQMINOEL"] - own[1], p["VTMIN"] - u["vt"])
        else:
            e = np.hypot(*own) - min(ref, p["IINSTUEL"]) - reset
            e = min(e, p["IQMAXUEL"] - own[1])
        x += [*own, *regulator_start(side, e, p)]
    return x


LIMITERS = {
    "OEL2C": (oel2c, oel2c_start),
    "OEL3C": (oel3c, oel3c_start),
    "OEL5C": (oel5c, oel5c_start),
    "UEL1": (uel1, uel1_start),
    "UEL2C": (uel2c, uel2c_start),
    "SCL1C": (scl1c, scl1c_start),
    "SCL2C": (scl2c, scl2c_start),
}


# --- a GENROU unit with ST1C, KA/(1 + sTA) behind the lag TR, and one limiter ---------------------


class LimitedUnit:
    """The unit; states are six of the machine, the measured voltage, VA, and the limiter's."""

    def __init__(self, limiter, place, vt0, exciter, machine, network, data):
        self.limiter, self.start_of_limiter = LIMITERS[limiter]
        self.place, self.vt0, self.exciter, self.of_limiter = place, vt0, exciter, data
        self.machine, self.network = Typed("GENROU", machine, network), network
        n = network
        self.E = abs(vt0 - (n["R"] + 1j * n["X"]) * complex(n["P"], -n["Q"]) / vt0)
        self.line = self.E, n["R"], n["X"]

    def seen(self, x, efd=0.0):
        """Return what a limiter sees."""
        vd, vq, i_d, i_q = self.machine.stator(x[:6], *self.line)
        ifd = self.machine.slopes(x[:6], efd, self.network["P"], *self.line)[1]
        vt = np.hypot(vd, vq)
        return {"ifd": ifd, "vt": vt, "P": vd * i_d + vq * i_q, "Q": vq * i_d - vd * i_q}

    def motion(self, c, x, vref):
        """Return the slopes and efd."""
        p, u = self.exciter, self.seen(x)
        vc, va = x[6:8]
        moved, out = self.limiter(c, x[8:], u, self.of_limiter)
        e = vref - vc
        if self.place == "summing":
            e += sum(out.values())
        if self.place == "takeover":
            e = self.gated(c, e, out)
        d_va = c.stopped("VA", va, (p["KA"] * e - va) / p["TA"], p["VAMIN"], p["VAMAX"])
        efd = self.gated(c, va, out) if self.place == "takeover-output" else va
        fluxes, _ = self.machine.slopes(x[:6], efd, self.network["P"], *self.line)
        return [*fluxes, (u["vt"] - vc) / p["TR"], d_va, *moved], efd

    @staticmethod
    def gated(c, signal, out):
        if "uel" in out:
            signal = c.higher("UEL takes over", signal, out["uel"])
        return c.lower("OEL takes over", signal, out["oel"]) if "oel" in out else signal

    def rest(self):
        """Return the states and the reference at rest, by a root search; the limiter waits."""
        p, n = self.exciter, self.network

        def unknown(z):
            x, efd = z[:6], z[6]
            moved, _ = self.machine.slopes(x, efd, n["P"], *self.line)
            return [*moved, self.seen(x)["vt"] - self.vt0]

        guess = [1.0, 0.9, 0.3, 0.5, 0.8, 0.0, 1.6]
        z, _, found, text = fsolve(unknown, guess, full_output=True, xtol=1e-13)
        assert found == 1, text
        limiter = self.start_of_limiter(self.seen(z[:6]), self.of_limiter)
        return np.array([*z[:6], self.vt0, z[6], *limiter]), self.vt0 + z[6] / p["KA"]

    def efd(self, times, steps):
        """Return efd (M,) at the times (s) and the choices; steps are instants and sizes."""
        c, (x, vref) = Choices(), self.rest()
        edges = [times[0], *(at for at, _ in steps), times[-1]]
        found = {}
        for number, (begin, end) in enumerate(pairwise(edges)):
            vref += steps[number - 1][1] if number else 0.0
            x = self.between(c, x, vref, (begin, end), times, found)
        return np.array([found[t] for t in times]), c

    def evaluated(self, c, t, x, vref, drifts=False):
        """Return the slopes and efd, with the drifts of PIDs where they are used."""
        c.now, c.drifts = t, {}
        moved, efd = self.motion(c, x, vref)
        if not drifts and FOLLOWS not in c.made.values():
            return moved, efd
        moved, sides = np.array(moved), []
        for ahead in (AHEAD, -AHEAD):
            self.motion(c, x + ahead * moved, vref)
            sides.append(dict(c.fast))
        c.drifts = {name: (sides[0][name] - sides[1][name]) / (2.0 * AHEAD) for name in c.fast}
        return self.motion(c, x, vref)

    def between(self, c, x, vref, span, times, found):
        """Run from one step to the next; write efd at the times in between into ``found``."""
        (begin, end), passed = span, None
        for _ in range(MOST_EVENTS):
            c.settle(begin, partial(self.evaluated, c, begin, x, vref, drifts=True), passed)
            names = list(c.margins)
            slacks = [NEAR + max(0.0, -margin) for margin in c.margins.values()]

            @lru_cache(maxsize=4)
            def margins(t, state, names=names):
                self.evaluated(c, t, np.frombuffer(state), vref)
                return [c.margins[name] for name in names]

            def event(k, margins=margins, slacks=slacks):
                def holds(time, states, margins=margins, slacks=slacks):
                    return margins(time, states.tobytes())[k] + slacks[k]

                holds.terminal, holds.direction = True, -1
                return holds

            solved = solve_ivp(
                lambda t, y: self.evaluated(c, t, y, vref)[0],
                (begin, end),
                x,
                "DOP853",
                np.unique([*times[(times >= begin) & (times <= end)], end]),
                events=[event(k) for k in range(len(names))],
                rtol=1e-10,
                atol=1e-12,
                max_step=0.05,
            )
            assert solved.success, solved.message
            for t, y in zip(solved.t, np.transpose(solved.y), strict=True):
                found[t] = self.evaluated(c, t, y, vref)[1]
            if solved.status == 0:
                return solved.y[:, -1]
            k = next(k for k, hits in enumerate(solved.t_events) if len(hits))
            begin, x, passed = solved.t_events[k][0], solved.y_events[k][0], names[k]
        raise AssertionError(f"more than {MOST_EVENTS} events: {c.events[-6:]}")
