"""An open-circuit saturation test: the points, the air-gap line and the curve with its band."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.features.programme.saturation_result import Array, MeasuredValue, SaturationResult
from exfit.show.figures.style import GREEN, LIMIT, SIMULATED, START, new_figure, panels, tidy

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
