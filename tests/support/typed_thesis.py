"""The thesis typed a second time, in NumPy alone: its two systems and its methods of chapter 3.

No line of exfit is used. Simulations are those that exfit documents: classical Runge-Kutta of order
four with a fixed step, limits that do not wind up hold the derivative and clamp the state after
each step, and a step is divided where a time constant is shorter than it. A set of values without
a response, as one with a negative time constant, has infinite residuals.
"""

from itertools import product
from math import ceil, isfinite, sqrt

import numpy as np

STEP = 2e-3  # s
BUMP = 0.05  # pu, of the reference of the AC1A, at
AT = 1.0  # s
# the machine and the fixed data of the AC1A's cases
TPD0, TPPD0, XD, XPD, XPPD, XL, S10, S12 = 6.0, 0.035, 1.8, 0.3, 0.25, 0.2, 0.12, 0.4
KE, LIMIT = 1.0, 14.5  # of VA and VR, on both sides
SHORTEST = 1e-4  # s: a block with a shorter lag is bypassed


def first_order(k, a, times):
    """Return the response of k/(s + a) to a unit step at 0 s, at times that are whole steps."""

    def slope(v):
        return k - a * v

    rows, v = [0.0], 0.0
    for _ in range(round(times[-1] / STEP)):
        k1 = slope(v)
        k2 = slope(v + STEP / 2 * k1)
        k3 = slope(v + STEP / 2 * k2)
        k4 = slope(v + STEP * k3)
        v += STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        rows.append(v)
    return np.array(rows)[np.rint(times / STEP).astype(int)]


def parabola(lower, upper):
    """Return A and B of B (x - A)^2 through two points (x, y)."""
    (x1, y1), (x2, y2) = lower, upper
    root = sqrt(y1 / y2)
    knee = (x1 - root * x2) / (1.0 - root)
    return knee, y2 / (x2 - knee) ** 2


EXCITER_KNEE, EXCITER_GAIN = parabola((3.14, 3.14 * 0.03), (4.18, 4.18 * 0.10))
MACHINE_KNEE, MACHINE_GAIN = parabola((1.0, 1.0 * S10), (1.2, 1.2 * S12))
OF_EQP = (XPPD - XL) / (XPD - XL)
COUPLING = (XD - XPD) * (XPD - XPPD) / (XPD - XL) ** 2


def machine(eqp, psi):
    """Return vt and ifd on open circuit."""
    flux = OF_EQP * eqp + (1.0 - OF_EQP) * psi
    above = max(flux - MACHINE_KNEE, 0.0)
    return flux, eqp + COUPLING * (eqp - psi) + MACHINE_GAIN * above * above


def rectified(ve, load):
    """Return VE FEX(load / VE), IEEE Std 421.5-2005, annex D."""
    if load <= 0.0 or ve <= 0.0:
        return ve
    loading = load / ve
    if loading <= sqrt(3.0) / 4.0:
        return ve * (1.0 - loading / sqrt(3.0))
    if loading < 0.75:
        return ve * sqrt(0.75 - loading * loading)
    return ve * sqrt(3.0) * max(1.0 - loading, 0.0)


def supplied(efd, load):
    """Return the VE behind which a rectifier gives efd."""
    ve = efd + load / sqrt(3.0)
    if load <= 0.0:
        return efd
    if load <= sqrt(3.0) / 4.0 * ve:
        return ve
    ve = sqrt((efd * efd + load * load) / 0.75)
    return ve if load < 0.75 * ve else efd / sqrt(3.0) + load


def demand(ve, ifd, KD):
    """Return VFE."""
    above = max(ve - EXCITER_KNEE, 0.0)
    return KE * ve + EXCITER_GAIN * above * above + KD * ifd


def held(slope, x, low, high):
    """Return a slope, 0 where it would push x beyond a limit."""
    return 0.0 if (x >= high and slope > 0.0) or (x <= low and slope < 0.0) else slope


def ac1a(KA, KF, TE, TF, TA, KC, KD, times):
    """Return vt of the AC1A on open circuit, from rest at 1 pu, at times that are whole steps.

    Raises ArithmeticError where there is no response.
    """
    if min(TE, TF, TA) < SHORTEST:
        raise ArithmeticError("a time constant below 0, or one that bypasses its block")
    _, ifd = machine(1.0, 1.0)
    ve = supplied(ifd, KC * ifd)
    vfe = demand(ve, ifd, KD)
    if not (abs(vfe) <= LIMIT and ve > 0.0):
        raise ArithmeticError("no state of rest")
    vref = 1.0 + vfe / KA
    parts = ceil(STEP / min(TE, TF, TA, TPPD0) - 1e-9)
    h = STEP / parts

    def slopes(eqp, psi, va, ve, vf, vref):
        vt, ifd = machine(eqp, psi)
        vfe = demand(ve, ifd, KD)
        washed = (vfe - vf) / TF
        vr = min(max(va, -LIMIT), LIMIT)
        return (
            (rectified(max(ve, 0.0), KC * ifd) - ifd) / TPD0,
            (eqp - psi) / TPPD0,
            held((KA * (vref - vt - KF * washed) - va) / TA, va, -LIMIT, LIMIT),
            held((vr - vfe) / TE, ve, 0.0, np.inf),
            washed,
        )

    x = (1.0, 1.0, vfe, ve, vfe)
    rows = [1.0]
    for number in range(round(times[-1] / STEP)):
        level = vref + (BUMP if number >= round(AT / STEP) else 0.0)
        for _ in range(parts):
            k1 = slopes(*x, level)
            k2 = slopes(*[a + h / 2 * b for a, b in zip(x, k1, strict=True)], level)
            k3 = slopes(*[a + h / 2 * b for a, b in zip(x, k2, strict=True)], level)
            k4 = slopes(*[a + h * b for a, b in zip(x, k3, strict=True)], level)
            eqp, psi, va, ve, vf = (
                a + h / 6 * (b + 2 * c + 2 * d + e)
                for a, b, c, d, e in zip(x, k1, k2, k3, k4, strict=True)
            )
            x = (eqp, psi, min(max(va, -LIMIT), LIMIT), max(ve, 0.0), vf)
        rows.append(machine(x[0], x[1])[0])
        if not isfinite(rows[-1]):
            raise ArithmeticError("the response does not stay finite")
    return np.array(rows)[np.rint(times / STEP).astype(int)]


def residuals_of(response, times, measured):
    """Return R(p) of a response(*p, times), infinite where there is none."""

    def residuals(p):
        try:
            errors = response(*map(float, p), times) - measured
        except ArithmeticError:
            return np.full(len(times), np.inf)
        return errors if np.isfinite(errors).all() else np.full(len(times), np.inf)

    return residuals


def cost(residuals):
    """Return f = R'R / 2."""
    return residuals @ residuals / 2 if np.isfinite(residuals).all() else np.inf


def differences(fun, x, steps, low, high):
    """Return R' by equation 3.9; next to a bound the points stay inside."""
    columns = []
    for k, h in enumerate(steps):
        up, down = x.copy(), x.copy()
        up[k], down[k] = min(x[k] + h, high[k]), max(x[k] - h, low[k])
        columns.append((fun(up) - fun(down)) / (up[k] - down[k]))
    return np.column_stack(columns)


def best_step(J, R, nu, below, above):
    """Return the d that minimises |J d + R|^2 + nu |d|^2 over below <= d <= above.

    Without bounds that is equation 3.5, or 3.15. Within them every set of active bounds is tried.
    """
    count = J.shape[1]
    A = np.vstack([J, np.sqrt(nu) * np.eye(count)])
    b = np.append(R, np.zeros(count))
    d = np.linalg.lstsq(A, -b, rcond=None)[0]
    if (d >= below).all() and (d <= above).all():
        return d
    q, r = np.linalg.qr(A)
    b, best, least = q.T @ b, None, np.inf
    for sides in product((0, -1, 1), repeat=count):
        sides = np.array(sides)
        d = np.where(sides < 0, below, np.where(sides > 0, above, 0.0))
        free = sides == 0
        if not np.isfinite(d).all():
            continue
        if free.any():
            d[free] = np.linalg.lstsq(r[:, free], -(b + r @ d), rcond=None)[0]
        inside = (d >= below).all() and (d <= above).all()
        rest = np.linalg.norm(r @ d + b)
        if inside and rest < least:
            best, least = d, rest
    return best


class Typed:
    """A search: R(x), the steps h(x) of its differences, and the bounds of x (N,)."""

    def __init__(self, fun, steps, low, high):
        self.fun, self.steps, self.low, self.high = fun, steps, low, high

    def dgn(self, x, count, alpha=1e-4):
        """Section 3.4: x after each iteration, and how many trials were rejected."""
        return self._search(x, count, lambda *point: self._armijo(*point, nu=0.0, alpha=alpha))

    def lm_armijo(self, x, count, alpha=1e-4):
        """Section 3.5 with Armijo's rule of 3.4; nu is the norm of g."""
        return self._search(x, count, lambda *point: self._armijo(*point, nu=None, alpha=alpha))

    def lm_ratio(self, x, count, least=1e-3, up=2.0, down=0.5):
        """Section 3.5 with the ratio of achieved to promised decrease, -g's/2 (Kelley 1999)."""
        kept = {}

        def accepted(x, R, J, g, size):
            nu, ratio, rejected = kept.get("nu", size), -1.0, -1
            while ratio < 0.0:
                s = best_step(J, R, nu, self.low - x, self.high - x)
                ratio = (cost(R) - cost(self.fun(x + s))) / (-(g @ s) / 2)
                nu = max(up * nu, least) if ratio < 0.25 else nu
                rejected += 1
            lowered = down * nu if down * nu >= least else 0.0
            kept["nu"] = lowered if ratio > 0.75 else nu
            return x + s, rejected

        return self._search(x, count, accepted)

    def _search(self, x, count, accepted):
        rows = [(x, 0)]
        for _ in range(count):
            R = self.fun(x)
            J = differences(self.fun, x, self.steps(x), self.low, self.high)
            g = J.T @ R
            outward = ((x <= self.low) & (g > 0.0)) | ((x >= self.high) & (g < 0.0))
            x, rejected = accepted(x, R, J, g, np.linalg.norm(g[~outward]))
            rows.append((x, rejected))
        return rows

    def _armijo(self, x, R, J, g, size, nu, alpha):
        """Halve lambda until f(x + lambda d) <= f(x) + alpha lambda g'd."""
        d = best_step(J, R, size if nu is None else nu, self.low - x, self.high - x)
        step, halvings = 1.0, 0
        while cost(self.fun(x + step * d)) > cost(R) + alpha * step * (g @ d):
            step, halvings = step / 2, halvings + 1
        return x + step * d, halvings
