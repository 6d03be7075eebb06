"""What a record tells of the parameters."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exfit.analysis.profiles import Profiles
from exfit.dsp.decimation import envelope
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.output.plots.style import COLORS, LIMIT, MILLI, SIMULATED, START, STYLES, WIDTH, tidy

Array = NDArray[np.float64]
PERCENT = 1e-2


def sensitivity(known: UncertaintyAnalysis, title: str) -> Figure:
    """Return by how much 1 % more of each parameter moves each signal over time.

    What belongs to a record is left out.
    """
    courses = known.sensitivity
    figure = Figure(figsize=(WIDTH, 1.2 + 3.0 * len(courses)), layout="constrained")
    panels = figure.subplots(len(courses), 1, squeeze=False)[:, 0]
    for axes, course in zip(panels, courses, strict=True):
        for place, (name, moved) in enumerate(course.moved.items()):
            axes.plot(
                *envelope(course.time, PERCENT * MILLI * moved),
                STYLES[place // len(COLORS) % len(STYLES)],
                color=COLORS[place % len(COLORS)],
                linewidth=1.3,
                label=name,
            )
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_ylabel(f"change of {course.label}\nfor +1 % (1e-3 pu)")
        tidy(axes)
    panels[-1].set_xlabel("time (s)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
    figure.suptitle(f"{title}: what each parameter does to the response", fontsize=11)
    return figure


def correlation(known: UncertaintyAnalysis, title: str) -> Figure:
    """Return the correlations of the estimates as a map; what has none is left blank."""
    names, values = known.confidence.names, known.confidence.correlation.matrix
    side = max(4.2, 1.6 + 0.62 * len(names))
    figure = Figure(figsize=(side + 1.2, side), layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.set_xticks(range(len(names)), names, rotation=45, ha="right")
    axes.set_yticks(range(len(names)), names)
    for row, line in enumerate(values):
        for column, value in enumerate(line):
            if np.isfinite(value):
                color = "white" if abs(value) > 0.7 else "black"
                axes.text(
                    column, row, f"{value:.2f}", ha="center", va="center", color=color, fontsize=8
                )
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    figure.colorbar(image, ax=axes, label="correlation of the estimates", shrink=0.8)
    figure.suptitle(f"{title}: which parameters move together", fontsize=11)
    return figure


def profiles(found: Profiles) -> Figure:
    """Return the profile of each parameter: the rise of the cost in units of that at the limit."""
    columns = min(3, len(found.profiles))
    rows = -(-len(found.profiles) // columns)
    figure = Figure(figsize=(WIDTH, 1.1 + 2.4 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, one in zip(grid.flat, found.profiles, strict=False):
        rise = (one.costs - found.cost) / one.rise
        axes.plot(one.at, rise, "o-", color=SIMULATED, linewidth=1.3, markersize=3)
        axes.axhline(1.0, color=LIMIT, linewidth=1.0, linestyle=":")
        for limit in (one.low, one.high):
            if limit is not None:
                axes.axvline(limit, color=LIMIT, linewidth=1.0)
        axes.plot([one.value], [0.0], "s", color=START, markersize=5)
        axes.set_xlabel(f"{one.name} ({one.unit})" if one.unit else one.name)
        axes.set_ylim(-0.05, 1.5)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        tidy(axes)
    for k, axes in enumerate(grid.flat):
        axes.set_visible(k < len(found.profiles))
    figure.supylabel("rise of the cost / rise at the 95 % limit", fontsize=10)
    figure.suptitle(f"{found.name}: the cost along each parameter, the others fitted", fontsize=11)
    return figure
