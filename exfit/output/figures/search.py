"""How a fit came about, and how well its records determine the parameters."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exfit.dsp.sampling import envelope
from exfit.output.figures.style import (
    COLORS,
    GREEN,
    LIMIT,
    MEASURED,
    MILLI,
    SIMULATED,
    START,
    STYLES,
    logarithmic,
    new_figure,
    panels,
    short,
    stacked,
    tidy,
    zero_line,
)
from exfit.output.iterations import COST, DAMPINGS, GRADIENT
from exfit.signals import label_of
from exfit.util.arrays import Array
from exfit.util.vocabulary import HISTORY_PHASES, PHASES

if TYPE_CHECKING:
    from exfit.fitting.uncertainty import UncertaintyAnalysis
    from exfit.results.comparisons import IterationResponses
    from exfit.results.model import FitResult, Minima
    from exfit.workflows.profiles import Profiles

LONGEST = 30  # letters of a parameter
BETWEEN = [phase for phase in HISTORY_PHASES if phase not in PHASES]
COLOURS: Mapping[str, str] = {
    **dict(zip(PHASES, cycle((START, SIMULATED, GREEN)), strict=False)),
    **dict(zip(BETWEEN, cycle(COLORS[3:]), strict=False)),
}
MOST_BESIDE = 2  # phases whose words stand beside each other
WAYS = {
    "strategy": ("the case's start", "D"),
    "linear": ("by way of the linear phase", "o"),
    "direct": ("other starts", "^"),
}  # what a descent began with: its label and its mark
FADING = LinearSegmentedColormap.from_list("fading", ["#b9d2ee", START, "#5b2a86", SIMULATED])
BAR_OF_ITERATIONS = 0.025  # width of the colour bar, of that of the axes
MOST_TICKS = 12  # of that colour bar
EARLY = 0.5  # power of the place: most of the way is made in the first iterations
PERCENT = 1e-2
OTHER_MINIMA = COLORS[4]
SUBDIVIDED = 8  # parts of a profile between two points
COLOUR_MAP, SHADES = "RdBu_r", 40  # of correlations
BAR = 0.05  # width of the colour bar, of that of the map
ERROR = "simulated\n- measured\n(1e-3 pu)"


def convergence(result: "FitResult") -> Figure:
    """Return cost, gradient and damping over the iterations."""
    title = f"{result.name}: {result.strategy}; {result.message}"
    figure, axes = stacked(6.5 + _legend_height(result), 3, title, sharex=True)
    rows = (
        ("cost", f"{COST} (pu²)", "o"),
        ("gradient_norm", GRADIENT, "o"),
        ("damping", DAMPINGS.replace(" (", "\n("), "s"),
    )
    for ax, (name, label, marker) in zip(axes, rows, strict=True):
        values = [float(getattr(line, name)) for line in result.history]
        # an undamped step and a vanished gradient have no place on a logarithmic axis
        _by_phase(ax, result, [v if v > 0.0 else float("nan") for v in values], marker)
        if any(value > 0.0 for value in values):
            logarithmic(ax)
        tidy(ax, label)
    axes[-1].set_xlabel("iteration")
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    _explain_phases(figure)
    return figure


def _legend_height(result: "FitResult") -> float:
    """Return the height of the words for the phases, inches."""
    count = len({line.phase for line in result.history})
    return 0.5 if count <= MOST_BESIDE else 0.25 * count


def _explain_phases(figure: Figure) -> None:
    handles, words = figure.axes[0].get_legend_handles_labels()
    columns = len(words) if len(words) <= MOST_BESIDE else 1
    figure.legend(handles, words, loc="outside lower right", ncols=columns, frameon=False)


def _by_phase(axes: Axes, result: "FitResult", values: Sequence[float], marker: str) -> None:
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


def trajectories(result: "FitResult") -> Figure:
    """Return every free parameter over the iterations, between its bounds."""
    names = list(result.parameters)
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    height = 0.5 + 2.0 * rows + _legend_height(result)
    figure = new_figure(height, f"{result.name}: the parameters after each iteration")
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
    if len({line.phase for line in result.history}) > 1:
        _explain_phases(figure)
    return figure


def waterfall(search: "Minima", title: str) -> Figure:
    """Return the costs that all descents led to, in rising order, with those they began at.

    Those ends are refuted whose minimum, the one at or next below them, is.
    """
    figure = new_figure(4.2, f"{title}: where {search.starts} runs ended")
    axes = panels(figure, 1)[0, 0]
    ended = np.flatnonzero(np.isfinite(search.end_costs))
    order = ended[np.argsort(search.end_costs[ended], kind="stable")]
    ranks, ends = np.arange(1, len(order) + 1), search.end_costs[order]
    axes.plot(ranks, search.start_costs[order], "_", color=MEASURED, markersize=7, label="start")
    axes.step(ranks, ends, where="mid", color=MEASURED, linewidth=0.8)
    ways = np.array(search.ways or ("direct",) * search.starts)[order]
    minima = sorted(search.minima, key=lambda minimum: minimum.cost)
    places = np.searchsorted([minimum.cost for minimum in minima], ends, side="right") - 1
    refuted = np.array([bool(minima[max(k, 0)].refuted) for k in places], dtype=np.bool_)
    for way, (label, marker) in WAYS.items():
        for verdict, color in ((False, GREEN), (True, SIMULATED)):
            own = (ways == way) & (refuted == verdict)
            text = f"{label}, rejected" if verdict else label
            if own.any():
                axes.plot(ranks[own], ends[own], marker, color=color, markersize=5, label=text)
    logarithmic(axes)
    axes.set_xlabel("run, by the cost at its end")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower right", ncols=4, frameon=False, fontsize=8)
    lowest = f"{search.minima[0].starts} of {search.starts} runs converged to the lowest minimum"
    axes.set_title(lowest, fontsize=9, loc="right")
    tidy(axes, "cost f (pu²)")
    return figure


def iterations(result: "FitResult") -> Figure:
    """Return the record and the response after each iteration, with the error, record by record.

    The colour shows the iteration, from the start in pale blue to the fit in red. Where a fit kept
    no responses the figure is empty but for its title.
    """
    recorded = [
        (comparison, comparison.iteration_responses)
        for comparison in result.comparisons
        if comparison.iteration_responses is not None
    ]
    count = len(recorded)
    figure = new_figure(
        1.0 + 4.4 * max(count, 1), f"{result.name}: the response after each iteration"
    )
    if not recorded:
        return figure
    widths, heights = [1.0, BAR_OF_ITERATIONS], [3.0, 1.2] * count
    grid = figure.add_gridspec(2 * count, 2, width_ratios=widths, height_ratios=heights)
    for k, (comparison, responses) in enumerate(recorded):
        upper = figure.add_subplot(grid[2 * k, 0])
        lower = figure.add_subplot(grid[2 * k + 1, 0], sharex=upper)
        upper.tick_params(labelbottom=False)
        _after_each(upper, lower, responses)
        if count > 1:
            upper.set_title(f"{comparison.name}: {comparison.record}", fontsize=9, loc="left")
    lower.set_xlabel("time (s)")
    numbers = sorted({number for _, responses in recorded for number in responses.numbers})
    if len(numbers) > 1:  # a single one needs no bar
        bar, last = figure.add_subplot(grid[:, 1]), len(numbers) - 1
        shades, extent = np.array(_colours(numbers))[:, np.newaxis, :], (0.0, 1.0, -0.5, last + 0.5)
        bar.imshow(shades, aspect="auto", extent=extent, origin="lower")
        every = -(-len(numbers) // MOST_TICKS)
        # the fit is always named: what would be right beside it gives way
        ticks = [k for k in range(0, last, every) if 2 * (last - k) >= every] + [last]
        bar.set_xticks([])
        bar.set_yticks(ticks, [str(numbers[k]) for k in ticks])
        bar.tick_params(length=0)
        bar.set_ylabel("iteration")
    return figure


def _colours(numbers: Sequence[int]) -> list[tuple[float, float, float, float]]:
    """Return a colour for each iteration, by its place among them."""
    places = np.linspace(0.0, 1.0, max(len(numbers), 2)) ** EARLY
    return [FADING(place) for place in places[: len(numbers)]]


def _after_each(upper: Axes, lower: Axes, responses: "IterationResponses") -> None:
    """Draw the responses after some iterations, and their errors."""
    time, measured, last = responses.time, responses.measured, len(responses.numbers) - 1
    upper.plot(time, measured, ".", color=MEASURED, markersize=3, label="measured")
    zero_line(lower)
    labels = {0: "start" if responses.numbers[0] == 0 else f"iteration {responses.numbers[0]}"}
    labels[last] = f"iteration {responses.numbers[last]}" if last else labels[0]
    colours = _colours(responses.numbers)
    for k, (samples, colour) in enumerate(zip(responses.samples, colours, strict=True)):
        width = 1.6 if k in labels else 1.0
        upper.plot(time, samples, "-", color=colour, linewidth=width, label=labels.get(k))
        lower.plot(time, MILLI * (samples - measured), color=colour, linewidth=0.8)
    upper.legend(loc="best", frameon=False)
    tidy(upper, label_of(responses.signal))
    tidy(lower, ERROR)


def sensitivity(analysis: "UncertaintyAnalysis", title: str) -> Figure:
    """Draw the change of each signal over time for 1 % more of each parameter.

    What belongs to a record is left out.
    """
    responses = analysis.sensitivity
    labels = {effect.parameter: effect.label for effect in analysis.effects}
    title = f"{title}: effect of each parameter on the response"
    figure, column = stacked(1.2 + 3.0 * len(responses), len(responses), title)
    for axes, response in zip(column, responses, strict=True):
        for place, (name, change) in enumerate(response.moved.items()):
            axes.plot(
                *envelope(response.time, PERCENT * MILLI * change),
                STYLES[place // len(COLORS) % len(STYLES)],
                color=COLORS[place % len(COLORS)],
                linewidth=1.3,
                label=labels.get(name, name),
            )
        zero_line(axes)
        tidy(axes, f"change of {response.label}\nfor +1 % (1e-3 pu)")
    column[-1].set_xlabel("time (s)")
    handles, texts = column[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside right upper", frameon=False)
    return figure


def correlation(analysis: "UncertaintyAnalysis", title: str) -> Figure:
    """Return the correlations of the estimates as a map; what has none is left blank."""
    names, values = analysis.confidence.names, analysis.confidence.correlation.matrix
    side = max(4.2, 1.6 + 0.62 * len(names))
    title = f"{title}: correlation of the parameters"
    figure = new_figure(side, title, side + 0.8)
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
    return figure


def smooth(at: Array, rise: Array) -> tuple[Array, Array]:
    """Return a profile with points in between: the root of the rise is nearly linear."""
    places = np.arange(len(at), dtype=np.float64)
    between = np.linspace(0.0, places[-1], SUBDIVIDED * (len(at) - 1) + 1)
    roots = np.sqrt(rise) if len(at) > 1 else np.zeros(len(at))
    return np.interp(between, places, at), np.interp(between, places, roots) ** 2


def profiles(profiled: "Profiles") -> Figure:
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
        f"{profiled.name}: cost along each parameter, the others fitted"
        f"{f'; no interval: {why}' if why else ''}",
        fontsize=11,
    )
    return figure
