"""Fits of several cases with several strategies: overlays, errors and costs."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exfit.dsp.sampling import envelope
from exfit.results.comparisons import Comparison
from exfit.show.figures.style import COLORS, MEASURED, MILLI, STYLES, logarithmic, new_figure, tidy
from exfit.signals import label_of

if TYPE_CHECKING:
    from exfit.runs.fits import FitRun, FitSeries


MOST_CASES = 8  # in one figure
CASE_HEIGHT = 3.8  # inches
WIDEST, NARROWEST = 2.6, 1.0  # points: curves that coincide are seen around each other
SMALL = 8  # points, the size of letters


def fit_series(series: "FitSeries") -> Figure:
    """Return for each case the responses of its fits beside the record, their errors and costs.

    Of many cases the first are drawn; the others are named.
    """
    cases = series.by_case
    drawn = [*cases.items()][:MOST_CASES]
    figure = new_figure(0.6 + CASE_HEIGHT * len(drawn))
    grid = figure.add_gridspec(
        2 * len(drawn), 2, width_ratios=[2.2, 1.0], height_ratios=[2.6, 1.0] * len(drawn)
    )
    for k, (name, runs) in enumerate(drawn):
        overlay = figure.add_subplot(grid[2 * k, 0])
        errors = figure.add_subplot(grid[2 * k + 1, 0], sharex=overlay)
        costs = figure.add_subplot(grid[2 * k : 2 * k + 2, 1])
        overlay.tick_params(labelbottom=False)
        overlay.set_title(f"{name}: {runs[0].result.model}", fontsize=10, loc="left")
        of_strategies = {run.result.strategy: run.result.comparison for run in runs}
        responses_beside(overlay, errors, of_strategies)
        _costs(costs, runs)
    left_out = [*cases][MOST_CASES:]
    if left_out:
        figure.supxlabel(f"not drawn: {', '.join(left_out)}", fontsize=SMALL)
    return figure


def responses_beside(overlay: Axes, errors: Axes, comparisons: Mapping[str, Comparison]) -> None:
    """Draw the judged signal of a record, and what each response leaves of it, by its name."""
    first = next(iter(comparisons.values()))
    signal = first.judged_by
    measured = first.overlays[signal].measured
    overlay.plot(
        *envelope(first.time, measured), ".", color=MEASURED, markersize=4, label="measured"
    )
    errors.axhline(0.0, color="black", linewidth=0.6)
    for k, (name, match) in enumerate(comparisons.items()):
        line = match.overlays[signal]
        look = _look(k, len(comparisons))
        label = f"{name}, rmse {match.rmse:.2e} pu"
        overlay.plot(*envelope(match.time, line.simulated), label=label, **look)
        errors.plot(*envelope(match.time, MILLI * line.error), **{**look, "linewidth": 0.8})
    overlay.set_ylabel(label_of(signal))
    overlay.legend(loc="best", frameon=False, fontsize=SMALL)
    errors.set_ylabel("error\n(1e-3 pu)", fontsize=SMALL)
    errors.set_xlabel("time (s)")
    tidy(overlay)
    tidy(errors)


def _costs(axes: Axes, runs: "Sequence[FitRun]") -> None:
    """Draw the cost over the iterations of each fit; a cross ends one that does not hold."""
    for k, run in enumerate(runs):
        look = _look(k, len(runs))
        costs = [line.cost if line.cost > 0.0 else float("nan") for line in run.result.history]
        axes.plot(costs, label=run.result.strategy, **look)
        marker = "o" if run.result.holds else "X"
        axes.plot(
            len(costs) - 1,
            costs[-1],
            marker,
            color=look["color"],
            markersize=3 + 2 * look["linewidth"],
            clip_on=False,
        )
    logarithmic(axes)
    axes.set_title("f (pu²) over the iterations", fontsize=9, loc="left")
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    tidy(axes)


def _look(place: int, count: int) -> dict[str, Any]:
    """Choose the line of a fit: the later, the narrower."""
    share = place / max(count - 1, 1)
    return {
        "color": COLORS[place % len(COLORS)],
        "linestyle": STYLES[place % len(STYLES)],
        "linewidth": WIDEST + share * (NARROWEST - WIDEST) if count > 1 else 1.4,
    }
