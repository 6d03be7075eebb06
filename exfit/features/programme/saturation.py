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
from exfit.features.programme.results_at_rest import (
    Array,
    FittedCurve,
    MeasuredValue,
    SaturationForm,
    SaturationResult,
)
from exfit.features.programme.saturation_forms import (
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
from exfit.inference.quantiles import student_quantile
from exfit.util.text import listed

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
    return replace(result, notes=tuple(_notes(result))).as_judged()


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
    values = [own.value, *(other.value for other in others)]
    low = None if low is None else min(low, *values)
    return replace(own, interval=(low, None if high is None else max(high, *values)))


def _hot_resistance(ifd: Array, efd: Array | None, winding: FieldWinding) -> MeasuredValue | None:
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
    """Yield what limits the numbers of a test, in sentences."""
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
            f"hysteresis cannot be seen: all points were taken with {going} voltage; the numbers "
            "are those of this branch, moved through zero"
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
            "the intervals hold"
        )
    elif others:
        yield f"the points do not distinguish {used.form} from {listed(others)}"
    if len(vt) >= FEWEST_POINTS_FOR_OUTLIER:
        yield from _outlier(result)


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


def _outlier(result: SaturationResult) -> Iterator[str]:
    residuals = result.residuals
    farthest = int(np.nanargmax(np.abs(residuals)))
    if abs(residuals[farthest]) > FAR_FROM_CURVE * result.curve.rms:
        yield (
            f"point {farthest + 1} ({result.vt[farthest]:.3g} pu, {result.ifd[farthest]:.4g} "
            f"{result.unit}) lies {abs(residuals[farthest]):.2g} pu of field current beside the "
            "curve: a misreading?"
        )
