"""Limits of the numbers of a saturation test, in sentences."""

from collections.abc import Iterator

import numpy as np

from exfit.features.programme.steady.saturation_result import FittedCurve, SaturationResult
from exfit.inference.wording import listed

AIR_GAP_END = 0.6  # pu: below it hardly any machine saturates
FEWEST_LOW_POINTS = 3  # for an air-gap line that they show rather than the form of the curve
FAR_FROM_CURVE = 3.0  # rms: hardly one of 20 points lies so far beside it by chance
FEWEST_POINTS_FOR_OUTLIER = 8


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
