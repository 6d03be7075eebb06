"""How a fit came about: the response after each iteration, from the start to the fit."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, LinearSegmentedColormap
from matplotlib.figure import Figure

from exfit.output.plots.style import MEASURED, MILLI, SIMULATED, START, WIDTH, tidy
from exfit.results.comparisons import IterationResponses
from exfit.results.model import FitResult
from exfit.signals import label_of

FADING = LinearSegmentedColormap.from_list("fading", ["#b9d2ee", START, "#5b2a86", SIMULATED])
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
    figure = Figure(figsize=(WIDTH, 1.0 + 4.4 * max(count, 1)), layout="constrained")
    figure.suptitle(f"{result.name}: the response after each iteration", fontsize=11)
    if not recorded:
        return figure
    axes = figure.subplots(2 * count, 1, height_ratios=[3.0, 1.2] * count, squeeze=False)[:, 0]
    for k, (comparison, responses) in enumerate(recorded):
        upper, lower = axes[2 * k], axes[2 * k + 1]
        lower.sharex(upper)
        upper.tick_params(labelbottom=False)
        _responses(upper, responses)
        _errors(lower, responses)
        if count > 1:
            upper.set_title(f"{comparison.name}: {comparison.record}", fontsize=9, loc="left")
    axes[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    numbers = sorted({number for _, responses in recorded for number in responses.numbers})
    _colour_bar(figure, list(axes), numbers)
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


def _colour_bar(figure: Figure, axes: list[Axes], numbers: Sequence[int]) -> None:
    """Say which colour is which iteration; a single one needs no bar."""
    if len(numbers) < 2:
        return
    norm = BoundaryNorm(np.arange(len(numbers) + 1) - 0.5, len(numbers))
    steps = LinearSegmentedColormap.from_list("steps", _colours(numbers), N=len(numbers))
    every = -(-len(numbers) // MOST_TICKS)
    # the fit is always named: what would be right beside it gives way
    ticks = [k for k in range(0, len(numbers) - 1, every) if 2 * (len(numbers) - 1 - k) >= every]
    ticks.append(len(numbers) - 1)
    bar = figure.colorbar(
        ScalarMappable(norm, steps), ax=axes, ticks=ticks, label="iteration", aspect=40
    )
    bar.ax.set_yticklabels([str(numbers[k]) for k in ticks])
    bar.ax.tick_params(which="both", length=0)
