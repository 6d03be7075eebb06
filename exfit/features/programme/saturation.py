"""An open-circuit saturation test: the air-gap line, the saturation above it, the loop.

The points are matched by ifd = base (vt + vt S(vt)) + offset + direction * loop / 2, whose base is
the field current of 1 pu on the air-gap line. The offset stands for what remanence leaves: the
air-gap line is moved through zero (cf. IEC 60034-4, correction of the no-load curve; IEEE Std 115,
open-circuit saturation). The mean of both branches is the machine's curve, as its model has one: S
is that of the models, so that a machine with these numbers has this curve.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exfit.errors import ExfitError
from exfit.estimate import OneByOne, ProfileEnd, half_square, least_squares, profiles
from exfit.features.programme.result import (
    FittedCurve,
    MeasuredValue,
    SaturationForm,
    SaturationResult,
)
from exfit.inference.confidence import LEVEL, Interval
from exfit.inference.quantiles import student_quantile
from exfit.models.blocks import exponential_se
from exfit.models.machines.machine import curve, power_curve
from exfit.util.arrays import Array
from exfit.util.text import listed

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
EVEN_CURRENT = 1e-9  # of its mean: a field current that differs by less is one


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
    start = search.of(fit.x)
    if not np.isfinite(search.residuals(start)).all():
        raise ExfitError("saturation: no curve lies near the points: check ifd, vt and its base")
    least = least_squares(
        search.residuals, start, search.jacobian, search.bounds, method="lm-then-dgn"
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


WITHOUT_CURRENT = 0.01  # of the largest field current: a point of remanence
TURN = 0.01  # pu: a smaller fall of the voltage is no falling branch
FEWEST_POINTS = 6  # with field current: one more than the parameters of one branch, and one
PLAUSIBLE = (0.3, 2.0)  # pu, of the highest voltage
AT_LEVEL = 5e-3  # pu: as far below a level as a point may be that was taken at it
SAMPLES_OF_CURVE = 121
COPPER = 234.5  # degrees C below zero, where its resistance would vanish (IEEE Std 115)
AIR_GAP_END = 0.6  # pu: below it hardly any machine saturates
FEWEST_LOW_POINTS = 3  # for an air-gap line that they show rather than the form of the curve
FAR_FROM_CURVE = 3.0  # rms: hardly one of 20 points lies so far beside it by chance
FEWEST_POINTS_FOR_OUTLIER = 8


class FieldWinding(NamedTuple):
    """The field winding: its resistance at a temperature, and its temperature when hot."""

    resistance: float | None = None
    temperature: float | None = None
    hot: float | None = None

    @property
    def rise(self) -> float:
        """The factor from the resistance at its temperature to the hot one, of copper."""
        if self.temperature is None or self.hot is None:
            return 1.0
        return (COPPER + self.hot) / (COPPER + self.temperature)


UNKNOWN_WINDING = FieldWinding()


def saturation_curve(
    vt: ArrayLike,
    ifd: ArrayLike,
    form: SaturationForm = "quadratic",
    *,
    unit: str = "A",
    efd: ArrayLike | None = None,
    efd_unit: str = "V",
    winding: FieldWinding = UNKNOWN_WINDING,
    exciter: bool = False,
) -> SaturationResult:
    """Fit the curve of an open-circuit saturation test.

    Args:
        vt: (M,), pu, in the order in which the points were taken.
        ifd: (M,), in any ``unit``; of a brushless unit that of the ``exciter``.
        form: of the curve that is used; all three are fitted.
        unit: of ifd.
        efd: (M,) in ``efd_unit``, where it was measured, for the base of efd.
        efd_unit: of efd.
        winding: the resistance of the field winding in place of efd, and its temperature.
        exciter: whether ifd is the field current of a brushless exciter.

    Raises:
        ExfitError: too few points, or points that cannot be a saturation curve.
    """
    vt, ifd = np.array(vt, np.float64), np.array(ifd, np.float64)
    efd = None if efd is None else np.array(efd, np.float64)
    check_points(vt, ifd, efd)
    direction = directions(vt)
    dead = ifd <= WITHOUT_CURRENT * ifd.max()
    points = CurvePoints(vt[~dead], ifd[~dead], direction[~dead])
    least = FEWEST_POINTS - 1 + points.branches
    if len(points.vt) < least:
        what = f"{len(points.vt)} points on two branches; at least {least} are needed"
        raise ExfitError(f"saturation: {what}")
    fits = sorted((fitted(name, points) for name in EXCESS), key=lambda fit: fit.rms)
    curves = [_curve_of(fit, fits[0]) for fit in fits]
    curves = [_beside_others(curve, curves, float(points.vt.max())) for curve in curves]
    resistance = _hot_resistance(ifd, efd, winding)
    base = next(curve.ifd_base for curve in curves if curve.form == form)
    result = SaturationResult(
        form=form,
        curves=tuple(curves),
        unit=unit,
        exciter=exciter,
        left_out=tuple(np.flatnonzero(dead).tolist()),
        residual=float(vt[dead].mean()) if dead.any() else None,
        efd_base=None if resistance is None or exciter else _product(base, resistance),
        resistance=resistance,
        efd_unit=efd_unit,
        notes=(),
        vt=vt,
        ifd=ifd,
        direction=direction,
    )
    notes = [*_notes(result)]
    if efd is not None and resistance is None:
        notes.append("efd does not rise with ifd: it has no base, and the winding no resistance")
    return replace(result, notes=tuple(notes)).as_judged()


def check_points(vt: Array, ifd: Array, efd: Array | None) -> None:
    """Raise ExfitError for points that cannot be a saturation curve."""
    if efd is not None and efd.shape != ifd.shape:
        raise ExfitError(f"saturation: {len(efd)} field voltages, but {len(ifd)} field currents")
    if len(vt) != len(ifd):
        raise ExfitError(f"saturation: {len(vt)} voltages, but {len(ifd)} field currents")
    if not (np.isfinite(vt).all() and np.isfinite(ifd).all()):
        raise ExfitError("saturation: a point is not a finite number")
    for k in np.flatnonzero((ifd < 0.0) | (vt < 0.0))[:1]:
        raise ExfitError(f"saturation: point {k + 1}: vt {vt[k]:g}, ifd {ifd[k]:g}: below 0")
    with_current = ifd > WITHOUT_CURRENT * ifd.max(initial=0.0)
    count = int(np.sum(with_current))
    if count < FEWEST_POINTS:
        what = "points with field current"
        raise ExfitError(f"saturation: {count} {what}; at least {FEWEST_POINTS} are needed")
    low, high = PLAUSIBLE
    if not low <= vt.max() <= high:
        text = f"the highest voltage is {vt.max():.4g} pu, outside {low:g} ... {high:g}"
        raise ExfitError(f"saturation: {text}: are unit and base of vt right?")
    for k in np.flatnonzero(with_current & (vt == 0.0))[:1]:
        raise ExfitError(f"saturation: point {k + 1}: vt is 0 at ifd {ifd[k]:g}")


def directions(vt: Array) -> Array:
    """Find the direction (M,) in which each point was reached: voltage rising, 1, or falling, -1.

    The voltage turns where it goes back from its extreme by more than TURN.
    """
    direction = np.zeros(len(vt))
    going, extreme = 0.0, vt[0]
    for k, voltage in enumerate(vt):
        change = voltage - extreme
        if abs(change) > TURN and change * going <= 0.0:
            going = float(np.sign(change))
        if going == 0.0:
            continue
        direction[k] = going
        extreme = voltage if change * going >= 0.0 else extreme
    direction[direction == 0.0] = direction[direction != 0.0][0] if direction.any() else 1.0
    return direction


def _curve_of(fit: FormFit, best: FormFit) -> FittedCurve:
    """Return a form's fit as a result: offsets and band are per unit."""
    values, per_unit = fit.values(), 1.0 / float(fit.x[BASE])
    grid = np.linspace(0.0, max(1.2, float(fit.points.vt.max())), SAMPLES_OF_CURVE)
    mean, half = per_unit * fit.mean(grid, fit.x), per_unit * fit.band(grid)
    line = grid + per_unit * float(fit.x[OFFSET]) - half[0]  # no saturation is below none
    loop = values[HALF_LOOP].times(2.0 * per_unit) if fit.points.branches > 1 else None
    # as for an interval: a form is none of the curve's by more than the best one's cost may rise
    variance = 2.0 * best.rise / float(best.x[BASE]) ** 2 / len(best.points.vt)
    return FittedCurve(
        form=fit.form,
        ifd_base=values[BASE],
        S10=values[AT_10],
        S12=values[AT_12],
        offset=values[OFFSET].times(per_unit),
        hysteresis=loop,
        rms=fit.rms,
        refuted=bool(fit.rms**2 - best.rms**2 > variance),
        extrapolated=(),
        vt=grid,
        ifd=mean,
        low=np.maximum(mean - half, np.minimum(line, mean)),
        high=mean + half,
    )


def _beside_others(
    curve: FittedCurve, curves: Sequence[FittedCurve], highest: float
) -> FittedCurve:
    """Widen the intervals of a curve by the uncertainty of its form; ``curves`` by their match.

    The intervals of a form that the points reject include the values of the best one; those of the
    saturation beyond the highest point include those of all forms that are not rejected.
    """
    fitting = [other for other in curves if not other.refuted]
    rivals = curves[:1] if curve.refuted else []
    beyond = {1.0: highest < 1.0 - AT_LEVEL, 1.2: highest < 1.2 - AT_LEVEL}
    return replace(
        curve,
        ifd_base=_widened(curve.ifd_base, [other.ifd_base for other in rivals]),
        S10=_widened(curve.S10, [other.S10 for other in (fitting if beyond[1.0] else rivals)]),
        S12=_widened(curve.S12, [other.S12 for other in (fitting if beyond[1.2] else rivals)]),
        extrapolated=tuple(level for level, is_beyond in beyond.items() if is_beyond),
    )


def _widened(own: MeasuredValue, others: Sequence[MeasuredValue]) -> MeasuredValue:
    low, high = own.interval
    values = [own.value, *(other.value for other in others)]
    low = None if low is None else min(low, *values)
    return replace(own, interval=(low, None if high is None else max(high, *values)))


def _hot_resistance(ifd: Array, efd: Array | None, winding: FieldWinding) -> MeasuredValue | None:
    """Return the resistance of the hot field winding, given or as the slope of efd over ifd.

    The line need not pass through zero: brushes have a voltage drop. None where the points leave
    its sign open.
    """
    if winding.resistance is not None:
        resistance = winding.resistance * winding.rise
        return MeasuredValue(resistance, None, (resistance, resistance), "given, not measured here")
    if efd is None:
        return None
    x, y = ifd - np.mean(ifd), efd - np.mean(efd)
    power = float(x @ x)
    if power <= len(x) * (EVEN_CURRENT * float(np.mean(ifd))) ** 2:
        return None
    slope, dof = float(x @ y) / power, len(x) - 2
    error = float(np.linalg.norm(y - slope * x)) / sqrt(dof * power)
    half = student_quantile(dof, 0.975) * error
    if slope <= half:
        return None
    return MeasuredValue(slope, error, (slope - half, slope + half)).times(winding.rise)


def _product(base: MeasuredValue, resistance: MeasuredValue) -> MeasuredValue:
    """Return the field voltage of a field current, with the relative errors of both."""
    value, ends = base.value * resistance.value, list[float | None]()
    for sign, *sides in zip((-1.0, 1.0), base.interval, resistance.interval, strict=True):
        pairs = zip(sides, (base, resistance), strict=True)
        shares = [end / factor.value - 1.0 for end, factor in pairs if end is not None]
        share = float(np.copysign(np.linalg.norm(shares), sign))
        ends.append(value * (1.0 + share) if len(shares) == len(sides) else None)
    return MeasuredValue(value, None, (ends[0], ends[1]), resistance.why)


def _notes(result: SaturationResult) -> Iterator[str]:
    if result.exciter:
        yield (
            "ifd is the field current of a brushless exciter: the curve is that of exciter and "
            "machine together, and gives the machine neither S10 and S12 nor a base of ifd"
        )
    used, best = result.curve, result.curves[0]
    vt = np.delete(result.vt, result.left_out)
    if used.hysteresis is None:
        going = "rising" if np.delete(result.direction, result.left_out)[0] > 0.0 else "falling"
        yield (
            f"hysteresis cannot be seen: all points were taken with {going} voltage; the values "
            "are those of this branch, shifted through zero"
        )
    low = int(np.sum(vt < AIR_GAP_END))
    if low < FEWEST_LOW_POINTS:
        yield (
            f"{low or 'no'} point{'' if low == 1 else 's'} below {AIR_GAP_END:g} pu (the lowest is "
            f"{vt.min():.3g} pu): the air-gap line depends on the form of the curve"
        )
    yield from _of_range(used, result.highest)
    others = [curve.form for curve in result.curves if curve is not used and not curve.refuted]
    if used.refuted:
        yield (
            f"the points are not on a curve of form {used.form} (rms {used.rms:.2g} pu); "
            f"{best.form} (rms {best.rms:.2g} pu) has S(1.0) {best.S10.value:.3g}, S(1.2) "
            f"{best.S12.value:.3g} and a base of {best.ifd_base.value:.4g} {result.unit}, which "
            "the intervals include"
        )
    elif others:
        yield f"the points do not distinguish {used.form} from {listed(others)}"
    if len(vt) >= FEWEST_POINTS_FOR_OUTLIER:
        residuals = result.residuals
        farthest = int(np.nanargmax(np.abs(residuals)))
        if abs(residuals[farthest]) > FAR_FROM_CURVE * result.curve.rms:
            yield (
                f"point {farthest + 1} ({result.vt[farthest]:.3g} pu, {result.ifd[farthest]:.4g} "
                f"{result.unit}) lies {abs(residuals[farthest]):.2g} pu of field current off the "
                "curve: check the reading"
            )


def _of_range(curve: FittedCurve, highest: float) -> Iterator[str]:
    for level, value in ((1.0, curve.S10), (1.2, curve.S12)):
        name, end = f"S({level:.1f})", f"the highest point is at {highest:.3g} pu"
        if not value.determined:
            yield f"{name} is not determined: {end}"
        elif level in curve.extrapolated:
            yield (
                f"{name} is extrapolated: {end}; the interval includes its value by each form that "
                "the points do not reject"
            )
    if not curve.ifd_base.determined:
        yield "the air-gap line is not determined by the points"
