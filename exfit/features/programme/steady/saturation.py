"""An open-circuit saturation test: the air-gap line, the saturation above it, the loop.

The points are matched by ifd = base (vt + vt S(vt)) + offset + direction * loop / 2, whose base is
the field current of 1 pu on the air-gap line. The offset stands for what remanence leaves: the
air-gap line is moved through zero (cf. IEC 60034-4, correction of the no-load curve; IEEE Std 115,
open-circuit saturation). The mean of both branches is the machine's curve, as its model has one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exfit.errors import ExfitError
from exfit.features.programme.steady.saturation_forms import (
    AT_10,
    AT_12,
    BASE,
    EXCESS,
    HALF_LOOP,
    OFFSET,
    CurvePoints,
    FormFit,
    fitted,
)
from exfit.features.programme.steady.saturation_result import (
    Array,
    FittedCurve,
    MeasuredValue,
    SaturationForm,
    SaturationResult,
)
from exfit.inference.quantiles import student_quantile
from exfit.inference.wording import listed

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
    curves = [curve_of(fit, refutes(fits[0], fit)) for fit in fits]
    curves = [beside_others(curve, curves, float(points.vt.max())) for curve in curves]
    resistance = hot_resistance(ifd, efd, winding)
    base = next(curve.ifd_base for curve in curves if curve.form == form)
    result = SaturationResult(
        form=form,
        curves=tuple(curves),
        unit=unit,
        exciter=exciter,
        left_out=tuple(np.flatnonzero(dead).tolist()),
        residual=float(vt[dead].mean()) if dead.any() else None,
        efd_base=None if resistance is None or exciter else product(base, resistance),
        resistance=resistance,
        efd_unit=efd_unit,
        notes=(),
        vt=vt,
        ifd=ifd,
        direction=direction,
    )
    return replace(result, notes=tuple(notes(result))).as_judged()


def check_points(vt: Array, ifd: Array, efd: Array | None) -> None:
    """Raise ExfitError for points that cannot be a saturation curve."""
    if efd is not None and efd.shape != ifd.shape:
        raise ExfitError(f"saturation: {len(efd)} field voltages, but {len(ifd)} field currents")
    if len(vt) != len(ifd):
        raise ExfitError(f"saturation: {len(vt)} voltages, but {len(ifd)} field currents")
    if not (np.isfinite(vt).all() and np.isfinite(ifd).all()):
        raise ExfitError("saturation: a point is not a finite number")
    if np.any(ifd < 0.0) or np.any(vt < 0.0):
        k = int(np.flatnonzero((ifd < 0.0) | (vt < 0.0))[0])
        raise ExfitError(f"saturation: point {k + 1}: vt {vt[k]:g}, ifd {ifd[k]:g}: below 0")
    count = int(np.sum(ifd > WITHOUT_CURRENT * ifd.max())) if len(ifd) else 0
    if count < FEWEST_POINTS:
        what = "points with field current"
        raise ExfitError(f"saturation: {count} {what}; at least {FEWEST_POINTS} are needed")
    low, high = PLAUSIBLE
    if not low <= vt.max() <= high:
        text = f"the highest voltage is {vt.max():.4g} pu, outside {low:g} ... {high:g}"
        raise ExfitError(f"saturation: {text}: are unit and base of vt right?")
    dead = (ifd > WITHOUT_CURRENT * ifd.max()) & (vt == 0.0)
    if dead.any():
        k = int(np.flatnonzero(dead)[0])
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


def refutes(best: FormFit, other: FormFit) -> bool:
    """Find that one form fits so much better that the other is none of the curve's.

    As for an interval: by more than its cost may rise.
    """
    variance = 2.0 * best.rise / float(best.x[BASE]) ** 2 / len(best.points.vt)
    return bool(other.rms**2 - best.rms**2 > variance)


def curve_of(fit: FormFit, refuted: bool) -> FittedCurve:
    """Return a form's fit as a result: offsets and band are per unit."""
    values, per_unit = fit.values(), 1.0 / float(fit.x[BASE])
    grid = np.linspace(0.0, max(1.2, float(fit.points.vt.max())), SAMPLES_OF_CURVE)
    mean, half = per_unit * fit.mean(grid), per_unit * fit.band(grid)
    line = grid + per_unit * float(fit.x[OFFSET]) - half[0]  # no saturation is below none
    loop = values[HALF_LOOP].times(2.0 * per_unit) if fit.points.branches > 1 else None
    return FittedCurve(
        form=fit.form,
        ifd_base=values[BASE],
        S10=values[AT_10],
        S12=values[AT_12],
        offset=values[OFFSET].times(per_unit),
        hysteresis=loop,
        rms=fit.rms,
        refuted=refuted,
        extrapolated=(),
        vt=grid,
        ifd=mean,
        low=np.maximum(mean - half, np.minimum(line, mean)),
        high=mean + half,
    )


def beside_others(curve: FittedCurve, curves: Sequence[FittedCurve], highest: float) -> FittedCurve:
    """Return a curve that is no surer than the points are of their form, the best match first.

    The intervals of a form that the points refute hold what the best one has; those of the
    saturation beyond the highest point what all have that the points do not refute.
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
    """Return a value whose interval holds the values of others."""
    low, high = own.interval
    values = [other.value for other in others]
    return replace(
        own,
        interval=(
            None if low is None else min(low, *values, own.value),
            None if high is None else max(high, *values, own.value),
        ),
    )


def hot_resistance(ifd: Array, efd: Array | None, winding: FieldWinding) -> MeasuredValue | None:
    """Return the resistance of the hot field winding, given or as the slope of efd over ifd.

    The line need not pass through zero: brushes take a voltage of their own.
    """
    if winding.resistance is not None:
        resistance = winding.resistance * winding.rise
        return MeasuredValue(resistance, None, (resistance, resistance), "given, not measured here")
    if efd is None:
        return None
    matrix = np.column_stack([ifd, np.ones_like(ifd)])
    line, *_ = np.linalg.lstsq(matrix, efd, rcond=None)
    dof = len(ifd) - 2
    variance = float(np.sum((efd - matrix @ line) ** 2)) / dof
    error = float(np.sqrt(variance * np.linalg.inv(matrix.T @ matrix)[0, 0]))
    half = student_quantile(dof, 0.975) * error
    slope = float(line[0])
    return MeasuredValue(slope, error, (slope - half, slope + half)).times(winding.rise)


def product(base: MeasuredValue, resistance: MeasuredValue) -> MeasuredValue:
    """Return the field voltage of a field current, with the relative errors of both."""
    ends = (_end_of_product(base, resistance, 0), _end_of_product(base, resistance, 1))
    return MeasuredValue(base.value * resistance.value, None, ends, resistance.why)


def _end_of_product(base: MeasuredValue, resistance: MeasuredValue, side: int) -> float | None:
    ends = [(factor.interval[side], factor.value) for factor in (base, resistance)]
    shares = [end / value - 1.0 for end, value in ends if end is not None]
    if len(shares) < len(ends):
        return None
    share = float(np.copysign(np.linalg.norm(shares), side - 0.5))
    return base.value * resistance.value * (1.0 + share)


def notes(result: SaturationResult) -> Iterator[str]:
    """Yield the sentences of a test."""
    if result.exciter:
        yield (
            "ifd is the field current of a brushless exciter: the curve is that of exciter and "
            "machine together, and gives the machine neither S10 and S12 nor a base of ifd"
        )
    yield from _of_hysteresis(result)
    yield from _of_line(result)
    yield from _of_range(result.curve, result.highest)
    yield from _of_forms(result)
    yield from _of_point(result)


def _of_hysteresis(result: SaturationResult) -> Iterator[str]:
    if result.curve.hysteresis is None:
        going = "rising" if np.delete(result.direction, result.left_out)[0] > 0.0 else "falling"
        yield (
            f"hysteresis cannot be seen: all points were taken with {going} voltage; the numbers "
            "are those of this branch, moved through zero"
        )


def _of_line(result: SaturationResult) -> Iterator[str]:
    vt = np.delete(result.vt, result.left_out)
    low = int(np.sum(vt < AIR_GAP_END))
    if low < FEWEST_LOW_POINTS:
        yield (
            f"{low or 'no'} point{'' if low == 1 else 's'} below {AIR_GAP_END:g} pu (the lowest is "
            f"{vt.min():.3g} pu): the air-gap line depends on the form of the curve"
        )


def _of_range(curve: FittedCurve, highest: float) -> Iterator[str]:
    for level, value in ((1.0, curve.S10), (1.2, curve.S12)):
        name, end = f"S({level:.1f})", f"the highest point is at {highest:.3g} pu"
        if not value.determined:
            yield f"{name} is not determined: {end}"
        elif level in curve.extrapolated:
            yield (
                f"{name} is extrapolated: {end}; the interval holds what all forms have there that "
                "the points do not refute"
            )
    if not curve.ifd_base.determined:
        yield "the air-gap line is not determined by the points"


def _of_forms(result: SaturationResult) -> Iterator[str]:
    used, best = result.curve, result.curves[0]
    if used.refuted:
        yield (
            f"the points are not on a curve of form {used.form} (rms {used.rms:.2g} pu); "
            f"{best.form} (rms {best.rms:.2g} pu) has S(1.0) {best.S10.value:.3g}, S(1.2) "
            f"{best.S12.value:.3g} and a base of {best.ifd_base.value:.4g} {result.unit}, which "
            "the intervals hold"
        )
        return
    others = [curve.form for curve in result.curves if curve is not used and not curve.refuted]
    if others:
        yield f"the points do not distinguish {used.form} from {listed(others)}"


def _of_point(result: SaturationResult) -> Iterator[str]:
    residuals = result.residuals
    count = int(np.sum(np.isfinite(residuals)))
    if count < FEWEST_POINTS_FOR_OUTLIER:
        return
    farthest = int(np.nanargmax(np.abs(residuals)))
    if abs(residuals[farthest]) > FAR_FROM_CURVE * result.curve.rms:
        yield (
            f"point {farthest + 1} ({result.vt[farthest]:.3g} pu, {result.ifd[farthest]:.4g} "
            f"{result.unit}) lies {abs(residuals[farthest]):.2g} pu of field current beside the "
            "curve: a misreading?"
        )
