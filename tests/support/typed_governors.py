"""Governors, and units with them, as one would type them for one study, for another integrator.

A governor's ``slopes(x, dw, fs, pref)`` have the speed less 1 and what is added to it where it is
measured; ``rest(pm)`` gives the states and the reference. Limits are those of a study that stays
away from them, but for a rate.
"""

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from typed_on_load import Typed


class TGOV1:
    gate = 0

    def __init__(self, p):
        self.p = p

    def rest(self, pm):
        return [pm, pm], self.p["R"] * pm

    def power(self, x, dw):
        p = self.p
        return x[1] + p["T2"] / p["T3"] * (x[0] - x[1]) - p["Dt"] * dw

    def slopes(self, x, dw, fs, pref):
        p = self.p
        valve = ((pref - dw - fs) / p["R"] - x[0]) / p["T1"]
        return [valve, (x[0] - x[1]) / p["T3"]]


class IEEEG1:
    gate = 0
    passes = (("K1", "T4"), ("K3", "T5"), ("K5", "T6"))

    def __init__(self, p):
        self.p = p

    def rest(self, pm):
        return [pm] * 4, pm

    def power(self, x, dw):
        return sum(self.p[share] * y for (share, _), y in zip(self.passes, x[1:], strict=True))

    def slopes(self, x, dw, fs, pref):
        p = self.p
        rate = (pref - p["K"] * (dw + fs) - x[0]) / p["T3"]
        before = x[:-1]
        times = [p[name] for _, name in self.passes]
        return [
            np.clip(rate, p["UC"], p["UO"]),
            *((u - y) / T for u, y, T in zip(before, x[1:], times, strict=True)),
        ]


class GAST:
    gate = 0

    def __init__(self, p):
        self.p = p

    def rest(self, pm):
        return [pm, pm], pm

    def power(self, x, dw):
        return x[1] - self.p["Dturb"] * dw

    def slopes(self, x, dw, fs, pref):
        p = self.p
        return [(pref - (dw + fs) / p["R"] - x[0]) / p["T1"], (x[0] - x[1]) / p["T2"]]


class HYGOV:
    """By the gate's demand c: r Tr dc/dt + R c + ... is one equation of the dashpot."""

    gate = 2

    def __init__(self, p):
        self.p = p

    def rest(self, pm):
        opening = pm / self.p["At"] + self.p["qNL"]
        return [0.0, opening, opening, opening], self.p["R"] * opening

    def head(self, x):
        return (x[3] / x[2]) ** 2

    def power(self, x, dw):
        p, h = self.p, self.head(x)
        return p["At"] * h * (x[3] - p["qNL"]) - p["Dturb"] * x[2] * dw

    def slopes(self, x, dw, fs, pref):
        p, (e, c, g, _) = self.p, x
        de = (pref - dw - fs - p["R"] * c - e) / p["Tf"]
        dc = np.clip((e + p["Tr"] * de) / (p["r"] * p["Tr"]), -p["VELM"], p["VELM"])
        return [de, dc, (c - g) / p["Tg"], (1.0 - self.head(x)) / p["TW"]]


def lcfb1(x, dw, power, start, p):
    """Return what a load controller adds to the reference, and the slopes of its two states."""
    sensed, integral = x
    error = p["Pbf"] * (start - sensed) - p["Fbf"] * p["Fb"] * dw
    error = np.sign(error) * max(abs(error) - p["db"], 0.0)
    error = min(max(error, -p["emax"]), p["emax"])
    total = p["Kp"] * error + integral
    rate = p["Ki"] * error
    if abs(integral) >= p["Irmax"] and rate * integral > 0.0:
        rate = 0.0
    return min(max(total, -p["Irmax"]), p["Irmax"]), [(power - sensed) / p["Tpelec"], rate]


GOVERNORS = {kind.__name__: kind for kind in (TGOV1, IEEEG1, GAST, HYGOV)}
TYPICAL = {
    "TGOV1": {"R": 0.05, "T1": 0.4, "T2": 2.5, "T3": 8.0, "Dt": 0.3},
    "IEEEG1": {"K": 22.0, "T3": 0.15, "UO": 0.1, "UC": -0.15, "T4": 0.3, "K1": 0.25,
               "T5": 7.0, "K3": 0.35, "T6": 0.5, "K5": 0.4},
    "GAST": {"R": 0.05, "T1": 0.4, "T2": 0.2, "Dturb": 0.2},
    "HYGOV": {"R": 0.05, "r": 0.4, "Tr": 6.0, "Tf": 0.05, "Tg": 0.3, "VELM": 0.15, "TW": 1.2,
              "At": 1.15, "Dturb": 0.4, "qNL": 0.06},
}  # fmt: skip


def integrated(slopes, x0, times, breaks=(), step=0.1):
    """Return the states (n, M) at some times, integrated anew behind each break."""
    ends = [float(times[0]), *(at for at in sorted({*breaks}) if times[0] < at < times[-1])]
    ends.append(float(times[-1]))
    x, columns = np.asarray(x0, dtype=float), []
    for begin, end in pairwise(ends):
        last = end == ends[-1]
        inside = times[(times >= begin) & ((times < end) | last)]
        wanted = np.unique(np.append(inside, end))
        found = solve_ivp(
            slopes, (begin, end), x, "DOP853", wanted, rtol=1e-10, atol=1e-12, max_step=step
        )
        assert found.success
        x = found.y[:, -1]
        columns.append(found.y[:, : len(inside)])
    return np.hstack(columns)


class TypedUnit:
    """A machine, an exciter K / (1 + sTE) and a governor behind R + jX to a source E.

    The states are those of the machine with delta and dw, efd, and the governor's. A load alone is
    a source of 0: R + jX are then the load.
    """

    def __init__(self, machine, data, exciter, governor, values):
        self.machine, self.exciter = Typed(machine, data, {"f0": 60.0}), exciter
        self.governor = GOVERNORS[governor](values)

    def start(self, vt, E, R, X, P=None):
        """Return the states at rest, vref and pref; without a source P is that of the load."""
        m = self.machine

        def off(y):
            x, (efd, Pm) = [*y[:5], 0.0], y[5:]
            d, ifd = m.slopes(x, efd, Pm, E, R, X)
            along_q = y[2] if m.salient else d[2]
            at = y[4] if P is None else self.powers(x, E, R, X)[0] - P
            return [efd - ifd, d[1], along_q, d[3], d[5], at, m.vt(x, E, R, X) - vt]

        y = fsolve(off, [vt, vt, -0.3, -0.3, 0.5, 1.5, 0.5], xtol=1e-12)
        assert np.max(np.abs(off(y))) < 1e-10
        states, pref = self.governor.rest(y[6])
        return [*y[:5], 0.0, y[5], *states], vt + y[5] / self.exciter["K"], pref

    def powers(self, x, E, R, X):
        v_d, v_q, i_d, i_q = self.machine.stator(x, E, R, X)
        return v_d * i_d + v_q * i_q, v_q * i_d - v_d * i_q

    def slopes(self, x, vref, pref, fs, E, R, X, turned=0.0):
        """Return the slopes; the source is ``turned`` by an angle, rad."""
        g, e = self.governor, self.exciter
        seen = [*x[:4], x[4] - turned, x[5]]
        vt = self.machine.vt(seen, E, R, X)
        moved, _ = self.machine.slopes(seen, x[6], g.power(x[7:], x[5]), E, R, X)
        if E == 0.0:
            moved[4] = 0.0
        field = (e["K"] * (vref - vt) - x[6]) / e["TE"]
        return [*moved, field, *g.slopes(x[7:], x[5], fs, pref)]

    def signals(self, x, E, R, X, turned=0.0):
        """Return vt, p, q, efd, speed and the gate."""
        seen = [*x[:4], x[4] - turned, x[5]]
        p, q = self.powers(seen, E, R, X)
        vt = self.machine.vt(seen, E, R, X)
        return {"vt": vt, "p": p, "q": q, "efd": x[6], "speed": 1.0 + x[5],
                "gate": x[7 + self.governor.gate]}  # fmt: skip
