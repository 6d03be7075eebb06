"""Two units on open circuit as one would type them for one study, for another integrator."""

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from exfit.plants import MACHINE


def two_points(x, E1, SE1, E2, SE2):
    """Return B (x - A)^2 above the knee."""
    if SE1 == SE2 == 0.0:
        return 0.0
    q = np.sqrt(E1 * SE1 / (E2 * SE2))
    knee = (E1 - q * E2) / (1.0 - q)
    return E2 * SE2 * (max(x - knee, 0.0) / (E2 - knee)) ** 2


def fex(IN):
    """Return the rectifier's factor, exact constants."""
    if IN <= 0.0:
        return 1.0
    if np.sqrt(3.0) / 4.0 >= IN:
        return 1.0 - IN / np.sqrt(3.0)
    return np.sqrt(0.75 - IN * IN) if IN < 0.75 else np.sqrt(3.0) * max(1.0 - IN, 0.0)


class Unit:
    """An exciter and its machine as one would type them for one study, with no limit."""

    def __init__(self, values, machine):
        self.p = {k.removeprefix(MACHINE): v for k, v in values.items() if MACHINE not in k}
        self.m = {k.removeprefix(MACHINE): v for k, v in values.items() if MACHINE in k}
        self.genrou = machine == "GENROU"

    def terminals(self, eqp, psi):
        m = self.m
        if not self.genrou:
            return eqp, eqp + two_points(eqp, 1.0, m["S10"], 1.2, m["S12"])
        g1 = (m["Xppd"] - m["Xl"]) / (m["Xpd"] - m["Xl"])
        g2 = (m["Xpd"] - m["Xppd"]) / (m["Xpd"] - m["Xl"]) ** 2
        flux = eqp * g1 + psi * (1.0 - g1)
        added = two_points(flux, 1.0, m["S10"], 1.2, m["S12"])
        return flux, eqp + (m["Xd"] - m["Xpd"]) * g2 * (eqp - psi) + added

    def demand(self, ve, ifd):
        p = self.p
        vx = two_points(ve, p["E2"], p["SE2"], p["E1"], p["SE1"])  # E2 < E1 in these data
        return p["KE"] * ve + vx + p["KD"] * ifd

    def supply(self, efd):
        """Return the VE of a rest, by bisection."""
        low, high = 0.0, 100.0
        for _ in range(200):
            ve = (low + high) / 2
            low, high = (ve, high) if self.efd(ve, efd) < efd else (low, ve)
        return (low + high) / 2

    def efd(self, ve, ifd):
        return ve * fex(self.p["KC"] * ifd / ve)

    def fluxes(self, eqp, psi, efd, ifd):
        m = self.m
        dpsi = (eqp - psi) / m["Tppd0"] if self.genrou else 0.0
        return (efd - ifd) / m["Tpd0"], dpsi


class AC1A(Unit):
    def rest(self, vt):
        ifd = self.terminals(vt, vt)[1]
        ve = self.supply(ifd)
        vfe = self.demand(ve, ifd)
        error = vfe / self.p["KA"]
        return [vt, vt, vt, error, vfe, ve, vfe / self.p["TF"] * self.p["KF"]], vt + error

    def slopes(self, x, vref):
        p, (eqp, psi, vc, lead, va, ve, fed) = self.p, x
        vt, ifd = self.terminals(eqp, psi)
        vfe = self.demand(ve, ifd)
        vf = p["KF"] / p["TF"] * vfe - fed  # the washout by its other realisation
        e = vref - vc - vf
        vl = lead + p["TC"] / p["TB"] * (e - lead)
        return [
            *self.fluxes(eqp, psi, self.efd(ve, ifd), ifd),
            (vt - vc) / p["TR"],
            (e - lead) / p["TB"],
            (p["KA"] * vl - va) / p["TA"],
            (va - vfe) / p["TE"],
            vf / p["TF"],
        ]


class AC8B(Unit):
    def rest(self, vt):
        ifd = self.terminals(vt, vt)[1]
        ve = self.supply(ifd)
        vfe = self.demand(ve, ifd)
        return [vt, vt, vt, vfe / self.p["KA"], 0.0, vfe, ve], vt

    def slopes(self, x, vref):
        p, (eqp, psi, vc, integral, washed, vr, ve) = self.p, x
        vt, ifd = self.terminals(eqp, psi)
        e = vref - vc
        steep = p["KDR"] / p["TDR"] * (e - washed)
        pid = p["KPR"] * e + integral + steep
        return [
            *self.fluxes(eqp, psi, self.efd(ve, ifd), ifd),
            (vt - vc) / p["TR"],
            p["KIR"] * e,
            (e - washed) / p["TDR"],
            (p["KA"] * pid - vr) / p["TA"],
            (vr - self.demand(ve, ifd)) / p["TE"],
        ]


def integrated(unit, vt0, changes, times, method):
    """Return vt and efd at the times, restarted at every corner of the reference."""
    x, vref = unit.rest(vt0)
    corners = {at for change in changes for at in (change.at, change.at + change.ramp)}
    edges, found = [times[0], *sorted(corners), times[-1]], []
    for number, (start, end) in enumerate(pairwise(edges)):
        # complete ones, and those that rise from the start of this stretch to its end
        done = [change for change in changes if change.at + change.ramp <= start]
        rising = [change for change in changes if change.at <= start < change.at + change.ramp]
        level = vref + sum(change.step for change in done)

        def reference(t, level=level, rising=rising):
            return level + sum(change.step * (t - change.at) / change.ramp for change in rising)

        inside = times[(times > start) & (times <= end) | (times == start) & (number == 0)]
        solved = solve_ivp(
            lambda t, x, reference=reference: unit.slopes(x, reference(t)),
            (start, end),
            x,
            method=method,
            rtol=1e-10,
            atol=1e-12,
            t_eval=np.unique([*inside, end]),
        )
        found += list(solved.y.T[: len(inside)])
        x = solved.y[:, -1]
    terminals = [unit.terminals(*x[:2]) for x in found]
    ve = -2 if isinstance(unit, AC1A) else -1
    efd = [unit.efd(x[ve], ifd) for x, (_, ifd) in zip(found, terminals, strict=True)]
    return np.array([terminal[0] for terminal in terminals]), np.array(efd)
