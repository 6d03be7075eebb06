"""The figures of tests at rest: a saturation curve, and V-curves."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.features.programme.result import GovernorCurve, SaturationResult, VCurve
from exfit.output.figures.style import (
    COLORS,
    GREEN,
    LIMIT,
    SIMULATED,
    START,
    stacked,
    tidy,
    zero_line,
)
from exfit.util.arrays import Array

BRANCHES = ((1.0, "rising", "^", START), (-1.0, "falling", "v", GREEN))
MARGIN = 0.025  # of an axis, beside what it holds
MARKERS = {"ifd": "o", "efd": "s"}
FIELD_NAMES = {"ifd": "field current ifd", "efd": "field voltage efd"}
ROOM = 0.06  # of an axis, beyond what it holds


def saturation(result: SaturationResult, title: str) -> Figure:
    """Return terminal voltage over field current, and how far the points are beside the curve."""
    figure, (above, below) = stacked(
        8.2, 2, f"{title}: open-circuit saturation, {result.form}", height_ratios=[3.0, 1.2]
    )
    fitted, no_interval = result.curve, result.verdict.in_place_of_interval
    base = fitted.ifd_base.value
    low, high, mean = (base * ifd for ifd in (fitted.low, fitted.high, fitted.ifd))
    measured = (fitted.vt <= result.highest) | (1.2 not in fitted.extrapolated)
    label = f"air-gap line, {base:.4g} {result.unit} per pu"
    line = base * (fitted.vt + fitted.offset.value)
    above.plot(line, fitted.vt, "--", color=LIMIT, linewidth=1.1, label=label)
    if not no_interval:
        above.fill_betweenx(
            fitted.vt, low, high, color=SIMULATED, alpha=0.18, linewidth=0.0, label="95 % band"
        )
    beyond = fitted.vt >= fitted.vt[measured][-1]
    parts = [(measured, "-", "curve"), (beyond, ":", "extrapolated")]
    for part, style, label in parts[: 1 if measured.all() else 2]:
        above.plot(mean[part], fitted.vt[part], style, color=SIMULATED, linewidth=1.4, label=label)
    _points(above, result, result.ifd, result.vt)
    for level, value in ((1.0, fitted.S10), (1.2, fitted.S12)):
        begin = base * (level + fitted.offset.value)
        end = begin + base * level * value.value
        above.plot([begin, end], [level, level], "|-", color="black", linewidth=0.9, markersize=9)
        limits = " ... ".join("?" if end is None else f"{end:.3g}" for end in value.interval)
        above.annotate(
            f"S({level:.1f}) = {value.value:.3g} ({no_interval or limits})",
            (begin, level),
            xytext=(-8.0, 0.0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=9,
        )
    farthest = max(float(np.interp(1.2, fitted.vt, mean)), float(result.ifd.max()))
    above.set_xlim(-MARGIN * farthest, (1.0 + 2.0 * MARGIN) * farthest)
    above.set_ylim(-MARGIN, fitted.vt[-1] * (1.0 + 2.0 * MARGIN))
    name = "exciter field current" if result.exciter else "field current ifd"
    above.set_xlabel(f"{name} ({result.unit})")
    above.legend(loc="lower right", frameon=False)
    tidy(above, "terminal voltage vt (pu)")
    fitted = result.curve
    loop = fitted.hysteresis
    half = 0.0 if loop is None else 0.5 * loop.value
    _points(below, result, result.vt, 100.0 * (result.residuals + half * result.direction))
    zero_line(below)
    if loop is not None:
        for direction, _, _, color in BRANCHES:
            below.axhline(100.0 * half * direction, color=color, linewidth=0.9, linestyle="--")
    below.set_xlabel("terminal voltage vt (pu)")
    below.set_xlim(-MARGIN, fitted.vt[-1] * (1.0 + 2.0 * MARGIN))
    text = "" if loop is None else f"hysteresis {100.0 * loop.value:.2g} %, "
    below.set_title(f"{text}rms {100.0 * fitted.rms:.2g} %", fontsize=9, loc="right")
    tidy(below, "ifd beside the\nmean curve (% of base)")
    return figure


def _points(axes: Axes, result: SaturationResult, x: Array, y: Array) -> None:
    for direction, name, marker, color in BRANCHES:
        branch = result.direction == direction
        if branch.any():
            axes.plot(x[branch], y[branch], marker, color=color, markersize=5, label=name)


def v_curve(result: VCurve, title: str) -> Figure:
    """Return the V-curves of all powers, and how far the points are beside the model's field."""
    figure, (above, below) = stacked(
        8.2, 2, f"{title}: V-curves, {result.machine}", height_ratios=[3.0, 1.2]
    )
    reading = next(iter(result.readings.values()))
    marker, it = MARKERS[reading.signal], result.it
    unity = []  # field and stator current where the power factor is one
    for k, level in enumerate(result.levels):
        rows, color = list(level.points), COLORS[k % len(COLORS)]
        label = f"P = {level.p:.2f} pu"
        above.plot(level.ifd, level.it, color=color, linewidth=1.4)
        above.plot(reading.measured[rows], it[rows], marker, color=color, markersize=5, label=label)
        if level.q[0] <= 0.0 <= level.q[-1]:
            unity.append([np.interp(0.0, level.q, signal) for signal in (level.ifd, level.it)])
    line = np.reshape(unity, (-1, 2)).T
    above.plot(*line, "--", color=LIMIT, linewidth=1.1, label="power factor 1")
    above.plot([], [], marker, color="black", markersize=5, label="measured")
    above.plot([], [], color="black", linewidth=1.4, label="simulated")
    scale = "" if reading.unit == "pu" else f"; 1 pu is {reading.base:.4g} {reading.unit}"
    above.set_xlabel(f"{FIELD_NAMES[reading.signal]} (pu{scale})")
    above.set_ylim(0.0, (1.0 + ROOM) * max(float(level.it.max()) for level in result.levels))
    above.legend(frameon=False, loc="lower right")
    tidy(above, "stator current it (pu)")
    words = []
    for signal, reading in result.readings.items():
        rms, limit = 100.0 * reading.rms, 100.0 * reading.limit
        words.append(f"{signal} {rms:.2g} % rms, limit {limit:.2g} %")
        for k, level in enumerate(result.levels):
            rows, color = list(level.points), COLORS[k % len(COLORS)]
            differences = 100.0 * reading.residuals[rows]
            below.plot(result.q[rows], differences, MARKERS[signal], color=color, markersize=5)
        for at in (-limit, limit):
            below.axhline(at, color=LIMIT, linewidth=0.9, linestyle=":")
    zero_line(below)
    below.set_xlabel("reactive power q (pu)")
    below.set_title(", ".join(words), fontsize=9, loc="right")
    tidy(below, f"{', '.join(result.readings)}: simulated\nless measured (% of 1 pu)")
    below.margins(x=ROOM)
    return figure


def governor(result: GovernorCurve, title: str) -> Figure:
    """Return gate or power over power or speed, and how far it is beside the governor's model."""
    reading = result.reading
    figure, (above, below) = stacked(
        8.2,
        2,
        f"{title}: {result.governor}, {reading.signal} over {result.over}",
        height_ratios=[3.0, 1.2],
    )
    order = np.argsort(result.x, kind="stable")
    above.plot(result.x, reading.measured, ".", color=START, markersize=4, label="measured")
    style = {"color": SIMULATED, "markersize": 2}
    line = "-" if result.over == "p" else "."  # what follows a lag is no line over the speed
    above.plot(result.x[order], reading.simulated[order], line, label="simulated", **style)
    above.legend(frameon=False)
    tidy(above, f"{reading.signal} (pu)")
    below.plot(result.x, 100.0 * reading.residuals, ".", color=SIMULATED, markersize=3)
    zero_line(below)
    below.set_xlabel(f"{result.over} (pu)")
    tidy(below, "simulated less\nmeasured (%)")
    return figure
