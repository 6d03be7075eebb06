"""V-curves: stator current over field current for each power, measured and by the model.

The field draws them so: the current is least where the power factor is one, on either side of it
the machine is under- or overexcited.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.features.programme.v_curve_result import FieldReading, PowerLevel, VCurve
from exfit.show.figures.style import COLORS, LIMIT, new_figure, panels, tidy

MARKERS = {"ifd": "o", "efd": "s"}
ROOM = 0.06  # of an axis, beyond what it holds


def v_curve(result: VCurve, title: str) -> Figure:
    """Return the V-curves of all powers, and how far the points are beside the model's field."""
    figure = new_figure(8.2)
    above, below = panels(figure, 2, height_ratios=[3.0, 1.2])[:, 0]
    _curves(above, result)
    _residuals(below, result)
    figure.suptitle(f"{title}: V-curves, {result.machine}", fontsize=11)
    return figure


def _curves(axes: Axes, result: VCurve) -> None:
    reading = next(iter(result.readings.values()))
    it = result.it
    for level, color in zip(result.levels, _colors(result), strict=True):
        rows = list(level.points)
        marker = MARKERS[reading.signal]
        axes.plot(level.ifd, level.it, color=color, linewidth=1.4)
        axes.plot(
            reading.measured[rows], it[rows], marker, color=color, markersize=5,
            label=f"P = {level.p:.2f} pu",
        )  # fmt: skip
    axes.plot(*_unity(result), "--", color=LIMIT, linewidth=1.1, label="power factor 1")
    axes.plot([], [], marker, color="black", markersize=5, label="measured")
    axes.plot([], [], color="black", linewidth=1.4, label="simulated")
    axes.set_xlabel(_label(reading))
    axes.set_ylabel("stator current it (pu)")
    axes.set_ylim(0.0, (1.0 + ROOM) * max(float(level.it.max()) for level in result.levels))
    axes.legend(frameon=False, loc="lower right")
    tidy(axes)


def _colors(result: VCurve) -> list[str]:
    return [COLORS[k % len(COLORS)] for k in range(len(result.levels))]


def _unity(result: VCurve) -> tuple[list[float], list[float]]:
    """Return field and stator current of each power where the power factor is one."""
    levels = [level for level in result.levels if level.q[0] <= 0.0 <= level.q[-1]]
    return [_at_unity(level, level.ifd) for level in levels], [
        _at_unity(level, level.it) for level in levels
    ]


def _at_unity(level: PowerLevel, signal: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> float:
    return float(np.interp(0.0, level.q, signal))


def _label(reading: FieldReading) -> str:
    name = {"ifd": "field current ifd", "efd": "field voltage efd"}[reading.signal]
    scale = "" if reading.unit == "pu" else f"; 1 pu is {reading.base:.4g} {reading.unit}"
    return f"{name} (pu{scale})"


def _residuals(axes: Axes, result: VCurve) -> None:
    """Draw by how much the model differs from each point, over its reactive power."""
    for reading in result.readings.values():
        for level, color in zip(result.levels, _colors(result), strict=True):
            rows = list(level.points)
            differences = 100.0 * reading.residuals[rows]
            marker = MARKERS[reading.signal]
            axes.plot(result.q[rows], differences, marker, color=color, markersize=5)
        for sign in (-1.0, 1.0):
            axes.axhline(100.0 * sign * reading.limit, color=LIMIT, linewidth=0.9, linestyle=":")
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel("reactive power q (pu)")
    signals = ", ".join(result.readings)
    axes.set_ylabel(f"{signals}: simulated\nless measured (% of 1 pu)")
    rms = ", ".join(
        f"{reading.signal} {100.0 * reading.rms:.2g} % rms, limit {100.0 * reading.limit:.2g} %"
        for reading in result.readings.values()
    )
    axes.set_title(rms, fontsize=9, loc="right")
    tidy(axes)
    axes.margins(x=ROOM)
