"""A load rejection as one would type it for one study: flux linkages, another integrator.

psi'd and psi'q of the field-like windings, psi1d and psi2q of the dampers, with the signs of
textbooks (psi_q = -E'd): vd = -psi''q + X'' iq, vq = psi''d - X'' id. The start is found by a root
search, so that no formula of a machine at rest is used.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve


@dataclass(frozen=True)
class Load:
    """What a machine gives until its breaker opens, per unit."""

    P: float
    Q: float
    vt: float = 1.0


@dataclass(frozen=True)
class Lag:
    """An exciter of one lag: TE defd/dt = K (vref - vt) - efd."""

    K: float
    TE: float


def quadratic_curve(x, s10, s12):
    """Return B (x - A)^2 through S10 at 1 and 1.2 S12 at 1.2."""
    if s10 == s12 == 0.0:
        return 0.0
    q = np.sqrt(s10 / (1.2 * s12))
    knee = (1.0 - 1.2 * q) / (1.0 - q)
    return 1.2 * s12 * (max(x - knee, 0.0) / (1.2 - knee)) ** 2


def power_curve(x, s10, s12):
    return 0.0 if s10 == 0.0 else s10 * x ** (1.0 + np.log(s12 / s10) / np.log(1.2))


class TypedMachine:
    """A machine by its name and data; ``x`` are psi'd, psi1d, psi'q, psi2q."""

    def __init__(self, name, data):
        self.name, self.m = name, data
        self.power = name in ("GENROE", "GENSAE")
        self.one_axis, self.round = name == "ONE_AXIS", name.startswith("GENRO")

    def _curve(self, x):
        form = power_curve if self.power else quadratic_curve
        return form(x, self.m["S10"], self.m["S12"])

    def behind(self, x):
        """Return the flux linkages behind the reactances, and these: psi_d, psi_q, x_d, x_q."""
        m = self.m
        if self.one_axis:
            return x[0], 0.0, m["Xpd"], m["Xq"]
        share = (m["Xppd"] - m["Xl"]) / (m["Xpd"] - m["Xl"])
        psi_d = share * x[0] + (1.0 - share) * x[1]
        if not self.round:
            return psi_d, x[3], m["Xppd"], m["Xppd"]
        share = (m["Xppd"] - m["Xl"]) / (m["Xpq"] - m["Xl"])
        return psi_d, share * x[2] + (1.0 - share) * x[3], m["Xppd"], m["Xppd"]

    def voltages(self, x, i_d, i_q):
        psi_d, psi_q, xd, xq = self.behind(x)
        return -psi_q + xq * i_q, psi_d - xd * i_d

    def saturation(self, x):
        """Return what saturation takes of the field current, and of its image along psi_q."""
        psi_d, psi_q, _, _ = self.behind(x)
        if self.name in ("GENSAL", "ONE_AXIS"):
            return self._curve(x[0]), 0.0
        size = np.hypot(psi_d, psi_q)
        relative = self._curve(size) / size
        smaller = (self.m["Xq"] - self.m["Xl"]) / (self.m["Xd"] - self.m["Xl"])
        return relative * psi_d, relative * psi_q * smaller

    def ifd(self, x, i_d):
        m = self.m
        sat, _ = self.saturation(x)
        if self.one_axis:
            return x[0] + (m["Xd"] - m["Xpd"]) * i_d + sat
        inner = m["Xpd"] - m["Xl"]
        damper = (m["Xpd"] - m["Xppd"]) / inner**2 * (x[0] - x[1] - inner * i_d)
        return x[0] + (m["Xd"] - m["Xpd"]) * (i_d + damper) + sat

    def slopes(self, x, efd, i_d, i_q):
        m = self.m
        _, sat = self.saturation(x)
        field = (efd - self.ifd(x, i_d)) / m["Tpd0"]
        if self.one_axis:
            return [field, 0.0, 0.0, 0.0]
        damper = (x[0] - x[1] - (m["Xpd"] - m["Xl"]) * i_d) / m["Tppd0"]
        if not self.round:
            return [field, damper, 0.0, (-(m["Xq"] - m["Xppd"]) * i_q - x[3] - sat) / m["Tppq0"]]
        inner = m["Xpq"] - m["Xl"]
        current = (m["Xpq"] - m["Xppd"]) / inner**2 * (x[2] - x[3] - inner * i_q)
        second = x[2] + (m["Xq"] - m["Xpq"]) * (i_q + current) + sat
        return [field, damper, -second / m["Tpq0"], (x[2] - x[3] - inner * i_q) / m["Tppq0"]]

    def start(self, load):
        """Return the flux linkages, efd, id and iq at rest on a load."""
        it, phi = np.hypot(load.P, load.Q) / load.vt, np.arctan2(load.Q, load.P)

        def current(delta):
            return it * np.sin(delta + phi), it * np.cos(delta + phi)

        def unknown(z):
            x, efd, delta = z[:4], z[4], z[5]
            moved = np.array(self.slopes(x, efd, *current(delta)))
            still = [k for k in range(4) if (self.one_axis and k) or (not self.round and k == 2)]
            moved[still] = x[still]
            v_d, v_q = self.voltages(x, *current(delta))
            return [*moved, v_d - load.vt * np.sin(delta), v_q - load.vt * np.cos(delta)]

        z, _, found, text = fsolve(
            unknown, [1.0, 1.0, -0.1, -0.1, 1.5, 0.3], xtol=1e-13, full_output=True
        )
        assert found == 1, text
        return z[:4], z[4], *current(z[5])


class TypedTypeJ(TypedMachine):
    """GENTPJ by its specification; ``x`` are E'q, E''q, -E'd, -E''d."""

    follows_speed = False  # the voltage behind X''

    def __init__(self, name, data):
        super().__init__(name, data)
        self.round, self.q_share = True, data["Xq"] / data["Xd"]

    def factors(self, x, i_d, i_q, speed=1.0):
        """Return 1 + Sd and 1 + Sq: S is at the air-gap voltage that it itself leaves."""
        m, speed = self.m, speed if self.follows_speed else 1.0
        d, q, *_ = self.behind(x)

        def off(s):
            v_d = -speed * q + (m["Xppq"] - m["Xl"]) / (1.0 + s * self.q_share) * i_q
            v_q = speed * d - (m["Xppd"] - m["Xl"]) / (1.0 + s) * i_d
            at = np.hypot(v_d, v_q) / speed + m.get("Kis", 0.0) * np.hypot(i_d, i_q)
            return self._curve(at) / at - s

        s = brentq(off, -1e-3, 20.0, xtol=1e-15)
        return 1.0 + s, 1.0 + s * self.q_share

    def behind(self, x):
        return x[1], x[3], None, None

    def voltages(self, x, i_d, i_q, speed=1.0):
        m, (of_d, of_q) = self.m, self.factors(x, i_d, i_q, speed)
        x_d, x_q = (
            (m[name] - m["Xl"]) / by + m["Xl"] for name, by in (("Xppd", of_d), ("Xppq", of_q))
        )
        d, q, *_ = self.behind(x)
        speed = speed if self.follows_speed else 1.0
        return -speed * q + x_q * i_q, speed * d - x_d * i_d

    def ifd(self, x, i_d, i_q=0.0, speed=1.0):
        m = self.m
        first = x[1] + (x[0] - x[1]) * (m["Xd"] - m["Xppd"]) / (m["Xpd"] - m["Xppd"])
        return self.factors(x, i_d, i_q)[0] * first

    def slopes(self, x, efd, i_d, i_q, speed=1.0):
        m, (of_d, of_q) = self.m, self.factors(x, i_d, i_q)
        first = x[3] + (x[2] - x[3]) * (m["Xq"] - m["Xppq"]) / (m["Xpq"] - m["Xppq"])
        return [
            (efd - self.ifd(x, i_d, i_q)) / m["Tpd0"],
            (of_d * (x[0] - x[1]) - (m["Xpd"] - m["Xppd"]) * i_d) / m["Tppd0"],
            -of_q * first / m["Tpq0"],
            (of_q * (x[2] - x[3]) - (m["Xpq"] - m["Xppq"]) * i_q) / m["Tppq0"],
        ]


class TypedTypeC(TypedTypeJ):
    """GENQEC, GENQEJ: an unsaturated machine with X - Xl, times and efd divided by 1 + S.

    ``x`` are psi'd, psi1d, psi'q, psi2q.
    """

    follows_speed = True

    def __init__(self, name, data):
        super().__init__(name, data)
        self.q_share = 1.0

    def behind(self, x):
        m = self.m
        d, q = ((m[f"Xpp{at}"] - m["Xl"]) / (m[f"Xp{at}"] - m["Xl"]) for at in "dq")
        return d * x[0] + (1.0 - d) * x[1], q * x[2] + (1.0 - q) * x[3], None, None

    def damper(self, at, first, second, i, by):
        """Return the current of the first winding of an axis, and what drives the second."""
        x, xp, xpp = ((self.m[f"X{of}{at}"] - self.m["Xl"]) / by for of in ("", "p", "pp"))
        driving = first - second - xp * i
        return first + (x - xp) * (i + (xp - xpp) / xp**2 * driving), driving

    def ifd(self, x, i_d, i_q=0.0, speed=1.0):
        by, _ = self.factors(x, i_d, i_q, speed)
        return by * self.damper("d", *x[:2], i_d, by)[0] / (1.0 - self.m.get("Kw", 0.0) * i_d)

    def slopes(self, x, efd, i_d, i_q, speed=1.0):
        m, (by, _) = self.m, self.factors(x, i_d, i_q, speed)
        _, along_d = self.damper("d", *x[:2], i_d, by)
        current, along_q = self.damper("q", *x[2:], i_q, by)
        return [
            (efd - self.ifd(x, i_d, i_q, speed)) / m["Tpd0"],
            along_d / (m["Tppd0"] / by),
            -current / (m["Tpq0"] / by),
            along_q / (m["Tppq0"] / by),
        ]


def typed_machine(name, data):
    """Return a machine by its name."""
    kinds = {"GENTPJ": TypedTypeJ, "GENQEC": TypedTypeC, "GENQEJ": TypedTypeC}
    return kinds.get(name, TypedMachine)(name, data)


def rejection(name, data, load, time, exciter=None, after=None):
    """Return vt, ifd, efd and speed at ``time`` (M,) in s from the opening of the breaker on.

    The field voltage is constant, or that of an ``exciter``; ``after`` (t) may give its change.
    """
    machine = typed_machine(name, data)
    x, efd0, _, _ = machine.start(load)
    vref = load.vt + (0.0 if exciter is None else efd0 / exciter.K)

    def vt(y):
        return (1.0 + y[4]) * np.hypot(*machine.behind(y[:4])[:2])

    def slopes(t, y):
        change = 0.0 if after is None else after(t)
        swing = (load.P - data["D"] * y[4]) / (1.0 + y[4]) / (2.0 * data["H"])
        lag = 0.0 if exciter is None else (exciter.K * (vref - vt(y)) - y[5]) / exciter.TE
        return [*machine.slopes(y[:4], y[5] + change, 0.0, 0.0), swing, lag]

    solved = solve_ivp(
        slopes, (0.0, time[-1]), [*x, 0.0, efd0], "DOP853", time, rtol=1e-11, atol=1e-13
    )
    assert solved.success
    return {
        "vt": np.array([vt(y) for y in solved.y.T]),
        "ifd": np.array([machine.ifd(y[:4], 0.0) for y in solved.y.T]),
        "efd": solved.y[5] + np.array([0.0 if after is None else after(t) for t in time]),
        "speed": 1.0 + solved.y[4],
    }


def recorded_rejection(name, data, load, opens, time, noise=0.0, seed=0):
    """Return vt, ifd, efd and speed (M,) as a recorder shows a rejection at ``opens`` (s)."""
    after = time > opens
    signals = rejection(name, data, load, np.concatenate([[0.0], time[after] - opens]))
    _, efd, _, _ = typed_machine(name, data).start(load)
    at_rest = {"vt": load.vt, "ifd": efd, "efd": efd, "speed": 1.0}
    rng, shown = np.random.default_rng(seed), {}
    for signal, samples in signals.items():
        clean = np.full(len(time), at_rest[signal])
        clean[after] = samples[1:]
        shown[signal] = clean + noise * rng.standard_normal(len(time))
    return shown
