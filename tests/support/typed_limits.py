"""Six units on open circuit, typed with their limits, for DOP853 restarted at each corner."""

from typing import ClassVar

import numpy as np
from scipy.integrate import solve_ivp
from typed_units import AC1A, AC8B, Unit

BLIND, NEAR, STILL = 1e-9, 1e-9, 1e-6  # s behind a corner, pu from it, pu/s away from a limit
TIGHT = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13}


class LimitedAC1A(AC1A):
    LIMITS: ClassVar = {
        4: ("VAMIN", "VAMAX"),
        5: (0.0, np.inf),
    }  # states held at limits, by their places

    def slopes(self, x, vref):
        p, va, ve = self.p, x[4], max(x[5], 1e-12)
        ifd = self.terminals(*x[:2])[1]
        vfe, inner = self.demand(ve, ifd), super().slopes([*x[:5], ve, x[6]], vref)
        inner[5] = (min(max(va, p["VRMIN"]), p["VRMAX"]) - vfe) / p["TE"]
        return inner

    def corners(self, x, vref):
        p, ifd = self.p, self.terminals(*x[:2])[1]
        load = p["KC"] * ifd
        arcs = (x[5] - load * 4.0 / np.sqrt(3.0), x[5] - load / 0.75, x[5] - load)
        return (x[4] - p["VRMIN"], x[4] - p["VRMAX"], *arcs, ifd)

    def output(self, x):
        return self.efd(max(x[5], 1e-12), self.terminals(*x[:2])[1])


class LimitedAC8B(AC8B):
    LIMITS: ClassVar = {5: ("VRMIN", "VRMAX"), 6: ("VEMIN", np.inf)}

    def slopes(self, x, vref):
        ve = max(x[6], 1e-12)
        return super().slopes([*x[:6], ve], vref)

    def corners(self, x, vref):
        load = self.p["KC"] * self.terminals(*x[:2])[1]
        return (x[6] - load * 4.0 / np.sqrt(3.0), x[6] - load / 0.75, x[6] - load)

    def output(self, x):
        return self.efd(max(x[6], 1e-12), self.terminals(*x[:2])[1])


class DC1A(Unit):
    LIMITS: ClassVar = {4: ("VRMIN", "VRMAX"), 5: (0.0, np.inf)}

    def demand(self, efd, ifd=0.0):
        return super().demand(efd, 0.0)

    def rest(self, vt):
        p, efd = {"KD": 0.0} | self.p, self.terminals(vt, vt)[1]
        self.p = p
        vr = self.demand(efd)
        error = vr / p["KA"]
        return [vt, vt, vt, error, vr, efd, efd], vt + error

    def slopes(self, x, vref):
        p, (eqp, psi, vc, lead, vr, efd, lagged) = self.p, x
        vt, ifd = self.terminals(eqp, psi)
        e = vref - vc - p["KF"] * (efd - lagged) / p["TF"]
        vl = lead + p["TC"] / p["TB"] * (e - lead)
        return [
            *self.fluxes(eqp, psi, efd, ifd),
            (vt - vc) / p["TR"],
            (e - lead) / p["TB"],
            (p["KA"] * vl - vr) / p["TA"],
            (vr - self.demand(efd)) / p["TE"],
            (efd - lagged) / p["TF"],
        ]

    def corners(self, x, vref):
        return ()

    def output(self, x):
        return x[5]


class SEXS(Unit):
    LIMITS: ClassVar = {3: ("EMIN", "EMAX")}

    def rest(self, vt):
        efd = self.terminals(vt, vt)[1]
        return [vt, vt, efd / self.p["K"], efd], vt + efd / self.p["K"]

    def slopes(self, x, vref):
        p, (eqp, psi, lead, efd) = self.p, x
        vt, ifd = self.terminals(eqp, psi)
        e = vref - vt
        vl = lead + p["TATB"] * (e - lead)
        slopes = (e - lead) / p["TB"], (p["K"] * vl - efd) / p["TE"]
        return [*self.fluxes(eqp, psi, efd, ifd), *slopes]

    def corners(self, x, vref):
        return ()

    def output(self, x):
        return x[3]


class Static(Unit):
    """What ST1A and EXST1 share: a clipped error, leads, a lag, a ceiling that follows VT."""

    def signals(self, x, vref):
        p, (eqp, psi, vc, *_leads, va, lagged) = self.p, x
        vt, ifd = self.terminals(eqp, psi)
        before = self.before(va, ifd)
        fed = p["KF"] / p["TF"] * (before - lagged)
        limits = self.ceilings(vt, ifd)
        return vt, ifd, before, fed, vref - vc - fed, limits

    def slopes(self, x, vref):
        p, (eqp, psi, vc, *leads, va, lagged) = self.p, x
        vt, ifd, before, _, e, limits = self.signals(x, vref)
        vl, moved = min(max(e, p["VIMIN"]), p["VIMAX"]), []
        for lead, (tc, tb) in zip(leads, self.LEADS, strict=True):
            moved.append((vl - lead) / p[tb])
            vl = lead + p[tc] / p[tb] * (vl - lead)
        efd = min(max(before, limits[0]), limits[1])
        slopes = (p["KA"] * vl - va) / p["TA"], (before - lagged) / p["TF"]
        return [*self.fluxes(eqp, psi, efd, ifd), (vt - vc) / p["TR"], *moved, *slopes]

    def rest(self, vt):
        ifd = self.terminals(vt, vt)[1]
        va = ifd + max(self.p.get("KLR", 0.0) * (ifd - self.p.get("ILR", 0.0)), 0.0)
        error = va / self.p["KA"]
        return [vt, vt, vt, *[error] * len(self.LEADS), va, ifd], vt + error

    def corners(self, x, vref):
        p = self.p
        _, ifd, before, _, e, limits = self.signals(x, vref)
        own = (before - limits[0], before - limits[1], e - p["VIMIN"], e - p["VIMAX"])
        return (*own, ifd - p.get("ILR", -1.0))

    def output(self, x):
        _, _, before, _, _, limits = self.signals(x, 0.0)
        return min(max(before, limits[0]), limits[1])


class ST1A(Static):
    LIMITS: ClassVar = {5: ("VAMIN", "VAMAX")}
    LEADS = (("TC", "TB"), ("TC1", "TB1"))

    def before(self, va, ifd):
        return va - max(self.p["KLR"] * (ifd - self.p["ILR"]), 0.0)

    def ceilings(self, vt, ifd):
        return vt * self.p["VRMIN"], vt * self.p["VRMAX"] - self.p["KC"] * ifd


class EXST1(Static):
    LIMITS: ClassVar = {}
    LEADS = (("TC", "TB"),)

    def before(self, va, ifd):
        return va

    def ceilings(self, vt, ifd):
        loaded = self.p["KC"] * ifd
        return vt * self.p["VRMIN"] - loaded, vt * self.p["VRMAX"] - loaded


TYPED = {
    "AC1A": LimitedAC1A, "AC8B": LimitedAC8B, "DC1A": DC1A, "SEXS": SEXS, "ST1A": ST1A,
    "EXST1": EXST1,
}  # fmt: skip


class Corner:
    """A function that ends a stretch where it crosses zero."""

    terminal = True

    def __init__(self, value, direction=0.0):
        self.value, self.direction = value, direction
        self.blind_until, self.sign = -np.inf, 1.0

    def __call__(self, t, x):
        return self.sign if t < self.blind_until else self.value(t, x)


def integrated_with_limits(unit, vt0, changes, times):
    """Return vt and efd (M, 2) at the times, and how often a corner was met."""
    x, vref = unit.rest(vt0)
    x, held, met = np.array(x), {}, 0
    limits = {
        place: [unit.p[bound] if isinstance(bound, str) else bound for bound in bounds]
        for place, bounds in unit.LIMITS.items()
    }
    rows, t = [], float(times[0])
    for end in [*sorted({change.at for change in changes if change.at > t}), float(times[-1])]:
        level = vref + sum(change.step for change in changes if change.at <= t)

        def motion(_, x, level=level):
            slopes = np.array(unit.slopes(x, level))
            slopes[list(held)] = 0.0
            return slopes

        def free_slope(t, x, place, level=level):
            return unit.slopes(x, level)[place]

        while t < end - BLIND:
            for place, (low, high) in limits.items():
                if place not in held and (x[place] >= high - NEAR or x[place] <= low + NEAR):
                    side = 1.0 if x[place] >= high - NEAR else -1.0
                    if side * free_slope(t, x, place) > STILL:
                        held[place] = side
                        x[place] = high if side > 0.0 else low
                elif place in held and held[place] * free_slope(t, x, place) <= STILL:
                    del held[place]
            watched = []
            for place, (low, high) in limits.items():
                if place in held:
                    inward = lambda t, x, place=place: free_slope(t, x, place)  # noqa: E731
                    watched.append(Corner(inward, -held[place]))
                    continue
                if np.isfinite(high):
                    watched.append(Corner(lambda t, x, k=place, b=high: x[k] - b, 1.0))
                watched.append(Corner(lambda t, x, k=place, b=low: x[k] - b, -1.0))
            for k, _ in enumerate(unit.corners(x, level)):
                watched.append(Corner(lambda t, x, k=k, at=level: unit.corners(x, at)[k]))
            for corner in watched:
                value = corner.value(t, x)
                if abs(value) < NEAR:
                    ahead = corner.value(t + BLIND, x + 10.0 * BLIND * motion(t, x))
                    corner.blind_until, corner.sign = t + BLIND, np.sign(ahead) or 1.0
            inside = times[(times > t) & (times <= end) | (times == t) & (not rows)]
            solved = solve_ivp(
                motion, (t, end), x, t_eval=np.unique([*inside, end]), events=watched, **TIGHT
            )
            rows += [
                (unit.terminals(*y[:2])[0], unit.output(y))
                for at, y in zip(solved.t, np.transpose(solved.y), strict=True)
                if at in inside
            ]
            if solved.status == 1:
                (t, x), met = (
                    next(
                        (at[0], y[0].copy())
                        for at, y in zip(solved.t_events, solved.y_events, strict=True)
                        if len(at)
                    ),
                    met + 1,
                )
            else:
                t, x = end, solved.y[:, -1]
        t = end
    return np.array(rows), met
