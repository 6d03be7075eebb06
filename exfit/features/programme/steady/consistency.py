"""Whether the parts of the result of a test at rest that is read fit together."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from exfit.features.programme.steady.saturation_result import SaturationResult
from exfit.features.programme.steady.v_curve_result import VCurve

Array = NDArray[np.float64]


def contradictions_at_rest(result: SaturationResult | VCurve) -> Iterator[str]:
    """Yield what of the result of a test at rest contradicts the rest of it."""
    if isinstance(result, SaturationResult):
        yield from _of_saturation(result)
    else:
        yield from _of_points_on_load(result)


def _of_saturation(result: SaturationResult) -> Iterator[str]:
    if result.form not in [curve.form for curve in result.curves]:
        yield f"curves: none of form {result.form}"
    if not _alike((result.vt, result.ifd, result.direction)) or not result.vt.size:
        yield "vt, ifd, direction: not one value for each point"
    if any(not 0 <= point < len(result.vt) for point in result.left_out):
        yield "left_out: not a point of the test"
    for curve in result.curves:
        if not _alike((curve.vt, curve.ifd, curve.low, curve.high)) or not curve.vt.size:
            yield f"curves: {curve.form}: not one value for each point"
        if not curve.ifd_base.value > 0.0:
            yield f"curves: {curve.form}: ifd_base {curve.ifd_base.value:g} is not above 0"


def _of_points_on_load(result: VCurve) -> Iterator[str]:
    readings = [
        samples
        for reading in result.readings.values()
        for samples in (reading.measured, reading.simulated)
    ]
    if not _alike((result.p, result.q, result.vt, *readings)) or not result.p.size:
        yield "p, q, vt, readings: not one value for each point"
    for level in result.levels:
        if not _alike((level.q, level.vt, level.it, level.ifd)):
            yield f"levels: {level.p:g} pu: not one value for each point of its curve"
        if any(not 0 <= point < len(result.p) for point in level.points):
            yield f"levels: {level.p:g} pu: not a point of the test"


def _alike(rows: Iterable[Array]) -> bool:
    shapes = {row.shape for row in rows}
    return len(shapes) == 1 and len(shapes.pop()) == 1
