"""The figures of tests at rest: a saturation curve, and V-curves."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.features.programme.steady.saturation_result import Array, MeasuredValue, SaturationResult
from exfit.features.programme.steady.v_curve_result import FieldReading, PowerLevel, VCurve
from exfit.show.figures.style import (
    COLORS,
    GREEN,
    LIMIT,
    SIMULATED,
    START,
    new_figure,
    panels,
    tidy,
)

LEVELS = (("S(1.0)", 1.0), ("S(1.2)", 1.2))  # pu
BRANCHES = ((1.0, "rising", "^", START), (-1.0, "falling", "v", GREEN))
MARGIN = 0.025  # of an axis, beside what it holds


def saturation(result: SaturationResult, title: str) -> Figure:
    """Return terminal voltage over field current, and how far the points are beside the curve."""
    figure = new_figure(8.2)
    above, below = panels(figure, 2, height_ratios=[3.0, 1.2])[:, 0]
    _curve(above, result)
    _beside(below, result)
    figure.suptitle(f"{title}: open-circuit saturation, {result.form}", fontsize=11)
    return figure


def _curve(axes: Axes, result: SaturationResult) -> None:
    fitted, no_interval = result.curve, result.verdict.in_place_of_interval
    base = fitted.ifd_base.value
    low, high, mean = (base * ifd for ifd in (fitted.low, fitted.high, fitted.ifd))
    measured = (fitted.vt <= result.highest) | (1.2 not in fitted.extrapolated)
    axes.plot(
        base * (fitted.vt + fitted.offset.value),
        fitted.vt,
        "--",
        color=LIMIT,
        linewidth=1.1,
        label=f"air-gap line, {base:.4g} {result.unit} per pu",
    )
    if not no_interval:
        axes.fill_betweenx(
            fitted.vt, low, high, color=SIMULATED, alpha=0.18, linewidth=0.0, label="95 % band"
        )
    axes.plot(mean[measured], fitted.vt[measured], color=SIMULATED, linewidth=1.4, label="curve")
    if not measured.all():
        beyond = fitted.vt >= fitted.vt[measured][-1]
        axes.plot(
            mean[beyond], fitted.vt[beyond], ":", color=SIMULATED, linewidth=1.4,
            label="extrapolated",
        )  # fmt: skip
    _points(axes, result, result.ifd, result.vt)
    for (name, level), value in zip(LEVELS, (fitted.S10, fitted.S12), strict=True):
        line = base * (level + fitted.offset.value)
        end = line + base * level * value.value
        axes.plot([line, end], [level, level], "|-", color="black", linewidth=0.9, markersize=9)
        axes.annotate(
            f"{name} = {value.value:.3g} ({no_interval or _interval(value)})",
            (line, level),
            xytext=(-8.0, 0.0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=9,
        )
    farthest = max(float(np.interp(1.2, fitted.vt, mean)), float(result.ifd.max()))
    axes.set_xlim(-MARGIN * farthest, (1.0 + 2.0 * MARGIN) * farthest)
    axes.set_ylim(-MARGIN, fitted.vt[-1] * (1.0 + 2.0 * MARGIN))
    name = "exciter field current" if result.exciter else "field current ifd"
    axes.set_xlabel(f"{name} ({result.unit})")
    axes.set_ylabel("terminal voltage vt (pu)")
    axes.legend(loc="lower right", frameon=False)
    tidy(axes)


def _interval(value: MeasuredValue) -> str:
    return " ... ".join("?" if end is None else f"{end:.3g}" for end in value.interval)


def _points(axes: Axes, result: SaturationResult, x: Array, y: Array) -> None:
    for direction, name, marker, color in BRANCHES:
        branch = result.direction == direction
        if branch.any():
            axes.plot(x[branch], y[branch], marker, color=color, markersize=5, label=name)


def _beside(axes: Axes, result: SaturationResult) -> None:
    """Draw how far the points are beside the mean curve, and the loop that fits them."""
    fitted = result.curve
    loop = fitted.hysteresis
    half = 0.0 if loop is None else 0.5 * loop.value
    _points(axes, result, result.vt, 100.0 * (result.residuals + half * result.direction))
    axes.axhline(0.0, color="black", linewidth=0.6)
    if loop is not None:
        for direction, _, _, color in BRANCHES:
            axes.axhline(100.0 * half * direction, color=color, linewidth=0.9, linestyle="--")
    axes.set_xlabel("terminal voltage vt (pu)")
    axes.set_ylabel("ifd beside the\nmean curve (% of base)")
    axes.set_xlim(-MARGIN, fitted.vt[-1] * (1.0 + 2.0 * MARGIN))
    text = "" if loop is None else f"hysteresis {100.0 * loop.value:.2g} %, "
    axes.set_title(f"{text}rms {100.0 * fitted.rms:.2g} %", fontsize=9, loc="right")
    tidy(axes)


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
