"""Overlays as pictures of a few hundred bytes: thousands of them lie in one page."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.decimation import kept_rows
from exfit.features.fleet.summary import SummaryCurve

Array = NDArray[np.float64]
Point = tuple[int, int]

WIDTH, HEIGHT = 240, 64  # units of a picture, two to a pixel
MARGIN = 2  # above and below the lines
BINS = 20  # of a line, each with its least and greatest value


@dataclass(frozen=True)
class Thumbnail:
    """An overlay: the d of the paths of measured and simulated samples, and what it is of."""

    label: str
    measured: str
    simulated: str


def picture(curve: SummaryCurve, label: str) -> Thumbnail:
    """Return a signal beside its simulation as paths of whole numbers, two to a pixel."""
    lines = (curve.measured, curve.simulated)
    rows = kept_rows(lines, BINS)
    time = curve.time[rows]
    samples = [line[rows] for line in lines]
    finite = np.concatenate([line[np.isfinite(line)] for line in (*samples, np.zeros(0))])
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    begin, end = (float(time.min()), float(time.max())) if len(time) else (0.0, 1.0)
    across = (time - begin) / ((end - begin) or 1.0) * WIDTH
    paths = [
        _path(
            across, HEIGHT - MARGIN - (line - low) / ((high - low) or 1.0) * (HEIGHT - 2 * MARGIN)
        )
        for line in samples
    ]
    return Thumbnail(label, *paths)


def _path(x: Array, y: Array) -> str:
    """Return the path of a line: its gaps are gaps, and points on a straight line are left out."""
    return "".join(
        _stroke([(round(a), round(b)) for a, b, _ in points])
        for drawn, points in groupby(
            zip(x.tolist(), y.tolist(), np.isfinite(y).tolist(), strict=True), lambda p: p[2]
        )
        if drawn
    )


def _stroke(points: Sequence[Point]) -> str:
    corners = [*_corners(points)]
    steps = [f"{b[0] - a[0]} {b[1] - a[1]}" for a, b in pairwise(corners)]
    return f"M{corners[0][0]} {corners[0][1]}" + (f"l{' '.join(steps)}" if steps else "h0")


def _corners(points: Sequence[Point]) -> Iterator[Point]:
    """Yield the points at which a line bends."""
    last = points[0]
    yield last
    for point, after in pairwise(points[1:]):
        ax, ay = point[0] - last[0], point[1] - last[1]
        bx, by = after[0] - point[0], after[1] - point[1]
        if ax * by != ay * bx or ax * bx + ay * by < 0:
            yield point
            last = point
    if len(points) > 1:
        yield points[-1]
