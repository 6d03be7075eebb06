"""The progress of a search: its iterations, its starts."""

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exfit.results.model import FitResult, Minima
from exfit.show.figures.style import (
    GREEN,
    LIMIT,
    MEASURED,
    SIMULATED,
    START,
    logarithmic,
    new_figure,
    panels,
    short,
    tidy,
)
from exfit.util.strategies import FROM_FURTHER_STARTS, HISTORY_PHASES, PHASES, WEIGHTED_BY_NOISE

LONGEST = 30  # letters of a parameter
COLOURS: Mapping[str, str] = {
    **dict(zip(PHASES, cycle((START, SIMULATED, GREEN)), strict=False)),
    FROM_FURTHER_STARTS: LIMIT,
    WEIGHTED_BY_NOISE: LIMIT,
}

WAYS = {
    "strategy": ("the case's start", "D"),
    "linear": ("by way of the linear phase", "o"),
    "direct": ("other starts", "^"),
}  # what a descent began with: its label and its mark


def convergence(result: FitResult) -> Figure:
    """Return cost, gradient and damping over the iterations."""
    figure = new_figure(7.0)
    axes = panels(figure, 3, sharex=True)[:, 0]
    rows = (
        ("cost", "cost f (pu²)", "o"),
        ("gradient_norm", "norm of the gradient", "o"),
        ("damping", "damping ν, or\nstep length λ", "s"),
    )
    for ax, (name, label, marker) in zip(axes, rows, strict=True):
        values = [float(getattr(line, name)) for line in result.history]
        # an undamped step and a vanished gradient have no place on a logarithmic axis
        _by_phase(ax, result, [v if v > 0.0 else float("nan") for v in values], marker)
        if any(value > 0.0 for value in values):
            logarithmic(ax)
        ax.set_ylabel(label)
        tidy(ax)
    axes[0].legend(loc="upper right", frameon=False)
    axes[-1].set_xlabel("iteration")
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.suptitle(f"{result.name}: {result.strategy}; {result.message}", fontsize=11)
    return figure


def _by_phase(axes: Axes, result: FitResult, values: Sequence[float], marker: str) -> None:
    numbers = [line.number for line in result.history]
    axes.plot(numbers, values, "-", color=MEASURED, linewidth=0.8)
    for phase in dict.fromkeys(line.phase for line in result.history):
        places = [k for k, line in enumerate(result.history) if line.phase == phase]
        axes.plot(
            [numbers[k] for k in places],
            [values[k] for k in places],
            marker,
            color=COLOURS[phase],
            markersize=4,
            clip_on=False,
            label=HISTORY_PHASES[phase],
        )


def trajectories(result: FitResult) -> Figure:
    """Return every free parameter over the iterations, between its bounds."""
    names = list(result.parameters)
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure = new_figure(1.0 + 2.0 * rows)
    grid = figure.add_gridspec(rows, columns)
    ax = None
    for k, name in enumerate(names):
        ax = figure.add_subplot(grid[divmod(k, columns)], sharex=ax)
        parameter = result.parameters[name]
        values = [line.values[name] for line in result.history]
        _by_phase(ax, result, values, "o")
        for limit in (parameter.min, parameter.max):
            if min(values) <= limit <= max(values):
                ax.axhline(limit, color=LIMIT, linewidth=1.0, linestyle=":")
        unit = f" {parameter.unit}" if parameter.unit else ""
        bound = f" (on its {parameter.at_bound})" if parameter.at_bound else ""
        value = parameter.rounded(parameter.value)
        ax.set_title(f"{short(name, LONGEST)} = {value}{unit}{bound}", fontsize=9)
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        tidy(ax)
        lowest = k + columns >= len(names)
        ax.tick_params(labelbottom=lowest)
        ax.set_xlabel("iteration" if lowest else "")
    phases = dict.fromkeys(line.phase for line in result.history)
    if len(phases) > 1:
        handles = figure.axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower right", ncols=len(phases), frameon=False)
    figure.suptitle(f"{result.name}: the parameters after each iteration", fontsize=11)
    return figure


def waterfall(search: Minima, title: str) -> Figure:
    """Return the costs that all descents led to, in rising order, with those they began at."""
    figure = new_figure(4.2)
    axes = panels(figure, 1)[0, 0]
    ended = np.flatnonzero(np.isfinite(search.end_costs))
    order = ended[np.argsort(search.end_costs[ended], kind="stable")]
    ranks, ends = np.arange(1, len(order) + 1), search.end_costs[order]
    axes.plot(ranks, search.start_costs[order], "_", color=MEASURED, markersize=7, label="start")
    axes.step(ranks, ends, where="mid", color=MEASURED, linewidth=0.8)
    ways = np.array(search.ways or ("direct",) * search.starts)[order]
    refuted = refuted_ends(search, ends)
    for way, (label, marker) in WAYS.items():
        for verdict, color in ((False, GREEN), (True, SIMULATED)):
            own = (ways == way) & (refuted == verdict)
            text = f"{label}, refuted" if verdict else label
            if own.any():
                axes.plot(ranks[own], ends[own], marker, color=color, markersize=5, label=text)
    logarithmic(axes)
    axes.set_xlabel("descent, by the cost that it led to")
    axes.set_ylabel("cost f (pu²)")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower right", ncols=4, frameon=False, fontsize=8)
    best = search.minima[0].starts
    axes.set_title(
        f"{best} of {search.starts} descents led to the lowest minimum", fontsize=9, loc="right"
    )
    tidy(axes)
    figure.suptitle(f"{title}: where {search.starts} descents ended", fontsize=11)
    return figure


def refuted_ends(search: Minima, ends: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the ends that the records refute: those of the minima at or next below them."""
    minima = sorted(search.minima, key=lambda minimum: minimum.cost)
    places = np.searchsorted([minimum.cost for minimum in minima], ends, side="right") - 1
    return np.array([bool(minima[max(place, 0)].refuted) for place in places], dtype=np.bool_)
