"""One form of a saturation curve, fitted to points: its numbers, their intervals, its band.

The equations are those of the models, so that a machine with these numbers has this curve.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from exfit.estimate import OneByOne, ProfileEnd, half_square, least_squares, profiles
from exfit.features.programme.results_at_rest import Array, MeasuredValue, SaturationForm
from exfit.inference.confidence import LEVEL, Interval
from exfit.inference.quantiles import student_quantile
from exfit.models.blocks import exponential_se
from exfit.models.machines.machine import curve, power_curve

EXCESS: Mapping[SaturationForm, Callable[[Array, float, float], Array]] = {
    "quadratic": lambda vt, S10, S12: np.asarray(curve(vt, SimpleNamespace(S10=S10, S12=S12))),
    "exponential": lambda vt, S10, S12: np.asarray(
        power_curve(vt, SimpleNamespace(S10=S10, S12=S12))
    ),
    "exponential-se": lambda vt, S10, S12: np.asarray(exponential_se(vt, 1.0, S10, 1.2, S12).vx),
}

STARTS = tuple(
    (S10, ratio * S10)
    for S10 in (0.005, 0.02, 0.05, 0.1, 0.2, 0.4)
    for ratio in (1.5, 2.0, 3.0, 4.0, 6.0, 10.0)
)
BASE, AT_10, AT_12, OFFSET, HALF_LOOP = range(5)  # the parameters of a curve
LEAST_S = {AT_10: 1e-12, AT_12: 1e-6}  # pu: none
MOST_S = 20.0  # pu
SHARES = (1e-6, 1.0 / 1.2)  # of S10 in S12: a quadratic curve from zero has the largest
BASES = (0.1, 10.0)  # of the steepest point's current per voltage
MOST_OFFSET = 1.0  # pu
REMANENCE = 0.015  # pu of field current: standard deviation of what it moves a curve by
REWEIGHTED = 2  # times: what is left to a third is below a thousandth of a standard error
PROFILE_POINTS = 2  # to the end of an interval: no figure is drawn of them
LEAST_ERROR = 1e-6  # pu: no instrument reads so well
DIFFERENCE = 1e-5  # pu, of S and of a voltage


class CurvePoints(NamedTuple):
    """Points of a curve: vt (M,) pu, ifd (M,), direction (M,) 1 or -1."""

    vt: Array
    ifd: Array
    direction: Array

    @property
    def branches(self) -> int:
        """Number of branches: 1, or 2 with hysteresis to be seen."""
        return len(np.unique(self.direction))


@dataclass(frozen=True, eq=False)
class FormFit:
    """A form at its best match: the parameters x (N,) base, S10, S12, offset and half the loop.

    The base, and the offsets, are in the unit of the points. Errors of a voltage and of a field
    current count alike, in pu: an error of a voltage shows by the slope of the curve, so a point
    has the ``weight`` (M,) that the slope leaves to it ("effective variance"). ``prior`` is the
    weight of the offset itself, of which is known that remanence is small.

    Source: Orear 1982, Least squares when both variables have uncertainties.
    """

    form: SaturationForm
    points: CurvePoints
    x: Array
    weight: Array
    prior: float = 0.0

    def errors(self, x: Array) -> Array:
        """Return the weighted errors (M,) of the points."""
        simulated = self.mean(self.points.vt, x) + self._loop @ x[HALF_LOOP:]
        return np.asarray(self.weight * (simulated - self.points.ifd))

    def residuals(self, x: Array) -> Array:
        """Residuals (M + 1,): the errors, and the offset by its prior."""
        return np.append(self.errors(x), self.prior * x[OFFSET])

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives (M + 1, N) of the residuals."""
        slopes = np.hstack([self.slopes_of_mean(self.points.vt, x), self._loop])
        of_prior = self.prior * (np.arange(len(x)) == OFFSET)
        return np.vstack([self.weight[:, None] * slopes, of_prior])

    def slopes_of_mean(self, vt: Array, x: Array) -> Array:
        """Return the derivatives (K, 4) of the mean curve by base, S10, S12 and offset."""
        step = min(DIFFERENCE, 1e-3 * x[AT_10], 1e-3 * (x[AT_12] - x[AT_10]))
        columns = [self._without_offset(vt, x)]
        for index in (AT_10, AT_12):
            above, below = x.copy(), x.copy()
            above[index] += step
            below[index] -= step
            columns.append((self.mean(vt, above) - self.mean(vt, below)) / (2.0 * step))
        return np.column_stack([*columns, np.ones_like(vt)])

    def _without_offset(self, vt: Array, x: Array) -> Array:
        """Return the field current (K,) in pu that a voltage needs: the line and what is above."""
        with np.errstate(all="ignore"):
            return vt + EXCESS[self.form](vt, np.float64(x[AT_10]), np.float64(x[AT_12]))

    def mean(self, vt: Array, x: Array) -> Array:
        """Return the mean of the branches (K,) in the unit of the points."""
        return np.asarray(x[BASE] * self._without_offset(vt, x) + x[OFFSET])

    @cached_property
    def _loop(self) -> Array:
        """The column (M, 1) of half the loop, or none (M, 0)."""
        return self.points.direction[:, None][:, : self.points.branches - 1]

    @property
    def dof(self) -> int:
        """The degrees of freedom that the points leave."""
        return len(self.points.vt) - len(self.x)

    @cached_property
    def variance(self) -> float:
        """The variance of a weighted error, at least that of a reading's last digit."""
        squares = 2.0 * half_square(self.errors(self.x))
        return max(squares / self.dof, (LEAST_ERROR * float(self.x[BASE])) ** 2)

    @property
    def quantile(self) -> float:
        """Half of an interval in standard errors."""
        return student_quantile(self.dof, 0.5 * (1.0 + LEVEL))

    @property
    def rise(self) -> float:
        """The rise of the cost from its minimum to the end of an interval."""
        return 0.5 * self.quantile**2 * self.variance

    @property
    def rms(self) -> float:
        """The root mean square of the unweighted errors, pu of the base."""
        errors = self.errors(self.x) / self.weight / self.x[BASE]
        return float(np.sqrt(np.mean(errors**2)))

    @cached_property
    def covariance(self) -> Array:
        """The covariance (N, N) of the parameters, by linear theory."""
        J = self.jacobian(self.x)
        return np.asarray(self.variance * np.linalg.pinv(J.T @ J))

    def band(self, vt: Array) -> Array:
        """Return half the width (K,) of the 95 % band about the mean curve."""
        slopes = self.slopes_of_mean(vt, self.x)
        variance = np.einsum("ki,ij,kj->k", slopes, self.covariance[:4, :4], slopes)
        return np.asarray(self.quantile * np.sqrt(np.maximum(variance, 0.0)))

    def values(self) -> tuple[MeasuredValue, ...]:
        """Return the parameters with their intervals.

        Those of base, S10 and S12 are from the profiles of the cost; in the others it is quadratic.
        """
        errors = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        half = self.quantile * errors
        ends: list[Interval] = [
            (float(x - h), float(x + h)) for x, h in zip(self.x, half, strict=True)
        ]
        for kept, indices in ((AT_10, (AT_10,)), (AT_12, (BASE, AT_12))):
            search = SearchVariables(self, kept)
            rises = dict.fromkeys(indices, self.rise)
            found = profiles(
                OneByOne(search.residuals, search.jacobian), search.of(self.x), rises,
                search.bounds, points=PROFILE_POINTS, workers=1,
            )  # fmt: skip
            for index, profile in zip(indices, found, strict=True):
                nothing = index != BASE and profile.ends[0] is ProfileEnd.BOUND
                ends[index] = 0.0 if nothing else profile.low, profile.high
        return tuple(
            MeasuredValue(float(x), float(error), interval)
            for x, error, interval in zip(self.x, errors, ends, strict=True)
        )


class SearchVariables(NamedTuple):
    """The variables of a search: one of S10 and S12 is ``kept``, the other's place has S10 / S12.

    So the bounds of a box keep S(1.2) above S(1.0), by as much as a curve has it that is quadratic
    from zero on.
    """

    fit: FormFit
    kept: int

    def of(self, x: Array) -> Array:
        """Return the variables (N,) of parameters (N,)."""
        u = x.copy()
        u[AT_10 + AT_12 - self.kept] = x[AT_10] / x[AT_12]
        # a share that lies on its bound comes back a rounding beyond it
        return np.clip(u, *self.bounds)

    def parameters(self, u: Array) -> Array:
        """Return the parameters (N,)."""
        x = u.copy()
        if self.kept == AT_12:
            x[AT_10] = u[AT_10] * u[AT_12]
        else:
            x[AT_12] = u[AT_10] / u[AT_12]
        return x

    def residuals(self, u: Array) -> Array:
        """Return the residuals of the fit."""
        return self.fit.residuals(self.parameters(u))

    def jacobian(self, u: Array) -> Array:
        """Return their derivatives by the variables."""
        J = self.fit.jacobian(self.parameters(u))
        by_10, by_12 = J[:, AT_10].copy(), J[:, AT_12].copy()
        if self.kept == AT_12:
            J[:, AT_10], J[:, AT_12] = by_10 * u[AT_12], by_10 * u[AT_10] + by_12
        else:
            share = u[AT_12]
            J[:, AT_10], J[:, AT_12] = by_10 + by_12 / share, -by_12 * u[AT_10] / share**2
        return J

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The bounds (N,), far from what any machine has."""
        points, count = self.fit.points, len(self.fit.x)
        steepest = float(np.min(points.ifd / points.vt))
        low = np.full(count, -MOST_OFFSET * steepest)
        high = -low
        low[:OFFSET] = BASES[0] * steepest, SHARES[0], SHARES[0]
        high[:OFFSET] = BASES[1] * steepest, SHARES[1], SHARES[1]
        low[self.kept], high[self.kept] = LEAST_S[self.kept], MOST_S
        return low, high


def fitted(form: SaturationForm, points: CurvePoints) -> FormFit:
    """Return a form at its best match to points, more than the parameters that it has."""
    fit = at_minimum(start_of(form, points))
    for _ in range(REWEIGHTED):
        base = float(fit.x[BASE])
        above, below = (fit.mean(points.vt + step, fit.x) for step in (DIFFERENCE, -DIFFERENCE))
        slope = (above - below) / (2.0 * DIFFERENCE * fit.x[BASE])  # in those of the air-gap line
        weight = np.sqrt(2.0 / (1.0 + slope**2))
        prior = float(np.sqrt(fit.variance)) / (REMANENCE * base)
        fit = at_minimum(replace(fit, weight=weight, prior=prior))
    return fit


def at_minimum(fit: FormFit) -> FormFit:
    """Return the fit with the parameters that match best."""
    search = SearchVariables(fit, AT_12)
    least = least_squares(
        search.residuals, search.of(fit.x), search.jacobian, search.bounds, method="lm-then-dgn"
    )
    return replace(fit, x=search.parameters(least.x))


def start_of(form: SaturationForm, points: CurvePoints) -> FormFit:
    """Return the best of a few pairs of S(1.0) and S(1.2): all else is linear."""
    vt, ones = points.vt, np.ones_like(points.vt)
    loop = points.direction[:, None][:, : points.branches - 1]
    fits = []
    for S10, S12 in STARTS:
        matrix = np.column_stack([vt + EXCESS[form](vt, S10, S12), ones, loop])
        (base, *offsets), *_ = np.linalg.lstsq(matrix, points.ifd, rcond=None)
        fit = FormFit(form, points, np.array([base, S10, S12, *offsets]), ones)
        search = SearchVariables(fit, AT_12)
        fits.append(replace(fit, x=search.parameters(np.clip(search.of(fit.x), *search.bounds))))
    return min(fits, key=lambda fit: half_square(fit.residuals(fit.x)))
