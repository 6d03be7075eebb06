"""How well a record determines the parameters."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exfit.dsp.sampling import envelope
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.show.figures.style import (
    COLORS,
    LIMIT,
    MILLI,
    SIMULATED,
    START,
    STYLES,
    new_figure,
    panels,
    tidy,
)
from exfit.workflows.profiles import Profiles

Array = NDArray[np.float64]
PERCENT = 1e-2
OTHER_MINIMA = COLORS[4]
SUBDIVIDED = 8  # parts of a profile between two points
COLOUR_MAP, SHADES = "RdBu_r", 40  # of correlations
BAR = 0.05  # width of the colour bar, of that of the map


def sensitivity(analysis: UncertaintyAnalysis, title: str) -> Figure:
    """Draw the change of each signal over time for 1 % more of each parameter.

    What belongs to a record is left out.
    """
    responses = analysis.sensitivity
    labels = {effect.parameter: effect.label for effect in analysis.effects}
    figure = new_figure(1.2 + 3.0 * len(responses))
    column = panels(figure, len(responses))[:, 0]
    for axes, response in zip(column, responses, strict=True):
        for place, (name, change) in enumerate(response.moved.items()):
            axes.plot(
                *envelope(response.time, PERCENT * MILLI * change),
                STYLES[place // len(COLORS) % len(STYLES)],
                color=COLORS[place % len(COLORS)],
                linewidth=1.3,
                label=labels.get(name, name),
            )
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_ylabel(f"change of {response.label}\nfor +1 % (1e-3 pu)")
        tidy(axes)
    column[-1].set_xlabel("time (s)")
    handles, texts = column[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside right upper", frameon=False)
    figure.suptitle(f"{title}: what each parameter does to the response", fontsize=11)
    return figure


def correlation(analysis: UncertaintyAnalysis, title: str) -> Figure:
    """Return the correlations of the estimates as a map; what has none is left blank."""
    names, values = analysis.confidence.names, analysis.confidence.correlation.matrix
    side = max(4.2, 1.6 + 0.62 * len(names))
    figure = new_figure(side, side + 0.8)
    axes, bar = panels(figure, 1, 2, width_ratios=[1.0, BAR])[0]
    axes.imshow(values, cmap=COLOUR_MAP, vmin=-1.0, vmax=1.0, aspect="auto")
    places = range(len(names))
    axes.set_xticks(places, names, rotation=45, ha="right", rotation_mode="anchor")
    axes.set_yticks(places, names)
    for row, line in enumerate(values):
        for column, value in enumerate(line):
            if np.isfinite(value):
                color = "white" if abs(value) > 0.7 else "black"
                axes.text(
                    column, row, f"{value:.2f}", ha="center", va="center", color=color, fontsize=8
                ).set_in_layout(False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    shades = np.linspace(-1.0, 1.0, SHADES)[:, np.newaxis]
    bar.imshow(shades, cmap=COLOUR_MAP, aspect="auto", extent=(0.0, 1.0, -1.0, 1.0), origin="lower")
    bar.set_xticks([])
    bar.set_ylabel("correlation of the estimates")
    figure.suptitle(f"{title}: which parameters move together", fontsize=11)
    return figure


def smooth(at: Array, rise: Array) -> tuple[Array, Array]:
    """Return a profile with points in between: the root of the rise is nearly linear."""
    places = np.arange(len(at), dtype=np.float64)
    between = np.linspace(0.0, places[-1], SUBDIVIDED * (len(at) - 1) + 1)
    roots = np.sqrt(rise) if len(at) > 1 else np.zeros(len(at))
    return np.interp(between, places, at), np.interp(between, places, roots) ** 2


def profiles(profiled: Profiles) -> Figure:
    """Return the profile of each parameter: the rise of the cost in units of that at the limit."""
    columns = min(3, len(profiled.profiles))
    rows = -(-len(profiled.profiles) // columns)
    figure = new_figure(1.1 + 2.4 * rows)
    grid = figure.add_gridspec(rows, columns)
    axes = None
    for k, profile in enumerate(profiled.profiles):
        axes = figure.add_subplot(grid[divmod(k, columns)], sharey=axes)
        axes.tick_params(labelleft=k % columns == 0)
        branches = [(profile.at, profile.costs, SIMULATED)]
        branches += [(*branch, OTHER_MINIMA) for branch in profile.others]
        for at, costs, color in branches:
            rise = np.maximum(costs - profiled.cost, 0.0) / profile.rise
            axes.plot(at, rise, "o", color=color, markersize=3)
            axes.plot(*smooth(at, rise), color=color, linewidth=1.3)
        if not profiled.verdict.misfit:
            axes.axhline(1.0, color=LIMIT, linewidth=1.0, linestyle=":")
        for limit in (profile.low, profile.high):
            if limit is not None:
                axes.axvline(limit, color=LIMIT, linewidth=1.0)
        axes.plot([profile.value], [0.0], "s", color=START, markersize=5)
        axes.set_xlabel(f"{profile.name} ({profile.unit})" if profile.unit else profile.name)
        axes.set_ylim(-0.05, 1.5)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        tidy(axes)
    figure.supylabel("rise of the cost / rise at the 95 % limit", fontsize=10)
    why = profiled.verdict.misfit
    figure.suptitle(
        f"{profiled.name}: the cost along each parameter, the others fitted"
        f"{f'; no interval: {why}' if why else ''}",
        fontsize=11,
    )
    return figure
