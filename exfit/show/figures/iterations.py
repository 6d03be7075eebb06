"""How a fit came about: the response after each iteration, from the start to the fit."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from exfit.results.comparisons import IterationResponses
from exfit.results.model import FitResult
from exfit.show.figures.style import MEASURED, MILLI, SIMULATED, START, new_figure, tidy
from exfit.signals import label_of

FADING = LinearSegmentedColormap.from_list("fading", ["#b9d2ee", START, "#5b2a86", SIMULATED])
BAR = 0.025  # width of the colour bar, of that of the axes
MOST_TICKS = 12  # of the colour bar
EARLY = 0.5  # power of the place: most of the way is made in the first iterations


def iterations(result: FitResult) -> Figure:
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
    figure = new_figure(1.0 + 4.4 * max(count, 1))
    figure.suptitle(f"{result.name}: the response after each iteration", fontsize=11)
    if not recorded:
        return figure
    grid = figure.add_gridspec(
        2 * count, 2, width_ratios=[1.0, BAR], height_ratios=[3.0, 1.2] * count
    )
    for k, (comparison, responses) in enumerate(recorded):
        upper = figure.add_subplot(grid[2 * k, 0])
        lower = figure.add_subplot(grid[2 * k + 1, 0], sharex=upper)
        upper.tick_params(labelbottom=False)
        _responses(upper, responses)
        _errors(lower, responses)
        if count > 1:
            upper.set_title(f"{comparison.name}: {comparison.record}", fontsize=9, loc="left")
    lower.set_xlabel("time (s)")
    numbers = sorted({number for _, responses in recorded for number in responses.numbers})
    if len(numbers) > 1:  # a single one needs no bar
        _colour_bar(figure.add_subplot(grid[:, 1]), numbers)
    return figure


def _colours(numbers: Sequence[int]) -> list[tuple[float, float, float, float]]:
    """Return a colour for each iteration, by its place among them."""
    places = np.linspace(0.0, 1.0, max(len(numbers), 2)) ** EARLY
    return [FADING(place) for place in places[: len(numbers)]]


def _responses(axes: Axes, responses: IterationResponses) -> None:
    time, measured = responses.time, responses.measured
    axes.plot(time, measured, ".", color=MEASURED, markersize=3, label="measured")
    last = len(responses.numbers) - 1
    labels = {0: "start" if responses.numbers[0] == 0 else f"iteration {responses.numbers[0]}"}
    labels[last] = f"iteration {responses.numbers[last]}" if last else labels[0]
    colours = _colours(responses.numbers)
    for k, (samples, colour) in enumerate(zip(responses.samples, colours, strict=True)):
        width = 1.6 if k in labels else 1.0
        axes.plot(time, samples, "-", color=colour, linewidth=width, label=labels.get(k))
    axes.set_ylabel(label_of(responses.signal))
    axes.legend(loc="best", frameon=False)
    tidy(axes)


def _errors(axes: Axes, responses: IterationResponses) -> None:
    axes.axhline(0.0, color="black", linewidth=0.6)
    for samples, colour in zip(responses.samples, _colours(responses.numbers), strict=True):
        error = MILLI * (samples - responses.measured)
        axes.plot(responses.time, error, color=colour, linewidth=0.8)
    axes.set_ylabel("simulated\n- measured\n(1e-3 pu)")
    tidy(axes)


def _colour_bar(axes: Axes, numbers: Sequence[int]) -> None:
    """Say which colour is which iteration."""
    count = len(numbers)
    axes.imshow(
        np.array(_colours(numbers))[:, np.newaxis, :],
        aspect="auto",
        extent=(0.0, 1.0, -0.5, count - 0.5),
        origin="lower",
    )
    every = -(-count // MOST_TICKS)
    # the fit is always named: what would be right beside it gives way
    ticks = [k for k in range(0, count - 1, every) if 2 * (count - 1 - k) >= every]
    ticks.append(count - 1)
    axes.set_xticks([])
    axes.set_yticks(ticks, [str(numbers[k]) for k in ticks])
    axes.tick_params(length=0)
    axes.set_ylabel("iteration")
