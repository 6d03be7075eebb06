"""How well a record determines the parameters."""

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


def sensitivity(analysis: UncertaintyAnalysis, title: str) -> Figure:
    """Return by how much 1 % more of each parameter moves each signal over time.

    What belongs to a record is left out.
    """
    responses = analysis.sensitivity
    figure = Figure(figsize=(WIDTH, 1.2 + 3.0 * len(responses)), layout="constrained")
    panels = figure.subplots(len(responses), 1, squeeze=False)[:, 0]
    for axes, response in zip(panels, responses, strict=True):
        for place, (name, change) in enumerate(response.moved.items()):
            axes.plot(
                *envelope(response.time, PERCENT * MILLI * change),
                STYLES[place // len(COLORS) % len(STYLES)],
                color=COLORS[place % len(COLORS)],
                linewidth=1.3,
                label=name,
            )
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_ylabel(f"change of {response.label}\nfor +1 % (1e-3 pu)")
        tidy(axes)
    panels[-1].set_xlabel("time (s)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
    figure.suptitle(f"{title}: what each parameter does to the response", fontsize=11)
    return figure


def correlation(analysis: UncertaintyAnalysis, title: str) -> Figure:
    """Return the correlations of the estimates as a map; what has none is left blank."""
    names, values = analysis.confidence.names, analysis.confidence.correlation.matrix
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


def profiles(profiled: Profiles) -> Figure:
    """Return the profile of each parameter: the rise of the cost in units of that at the limit."""
    columns = min(3, len(profiled.profiles))
    rows = -(-len(profiled.profiles) // columns)
    figure = Figure(figsize=(WIDTH, 1.1 + 2.4 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, profile in zip(grid.flat, profiled.profiles, strict=False):
        rise = (profile.costs - profiled.cost) / profile.rise
        axes.plot(profile.at, rise, "o-", color=SIMULATED, linewidth=1.3, markersize=3)
        axes.axhline(1.0, color=LIMIT, linewidth=1.0, linestyle=":")
        for limit in (profile.low, profile.high):
            if limit is not None:
                axes.axvline(limit, color=LIMIT, linewidth=1.0)
        axes.plot([profile.value], [0.0], "s", color=START, markersize=5)
        axes.set_xlabel(f"{profile.name} ({profile.unit})" if profile.unit else profile.name)
        axes.set_ylim(-0.05, 1.5)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        tidy(axes)
    for k, axes in enumerate(grid.flat):
        axes.set_visible(k < len(profiled.profiles))
    figure.supylabel("rise of the cost / rise at the 95 % limit", fontsize=10)
    figure.suptitle(
        f"{profiled.name}: the cost along each parameter, the others fitted", fontsize=11
    )
    return figure
