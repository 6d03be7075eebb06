"""Signals over time: measured beside simulated, of one fit or of several, and what a file holds."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exfit.dsp.sampling import PIXELS, envelope
from exfit.output.figures.style import (
    COLORS,
    LIMIT,
    MEASURED,
    MILLI,
    SIMULATED,
    START,
    STYLES,
    logarithmic,
    new_figure,
    short,
    stacked,
    tidy,
    zero_line,
)
from exfit.results.comparisons import REFERENCE, Comparison
from exfit.signals import label_of, unit_of_signal
from exfit.util.arrays import Array
from exfit.util.text import percentage

if TYPE_CHECKING:
    from exfit.records.channel_inspection import InspectedChannel
    from exfit.records.inspection import Inspection
    from exfit.runs.fits import FitSeries
    from exfit.simulation.simulator import Response


FAINT = 0.4  # opacity of what is not compared
LONGEST = 40  # letters of a record's name
LIMITED = 0.15  # opacity of when a limiter acts
MOST_SIGNALS = 12  # signals and states, that are still readable
VOLTAGES = ("vref", "vt")  # drawn on one axis
DRAWN_OTHERWISE = ("dw",)  # as speed
MOST_CHANNELS = 10  # of one figure that are still readable
FEWEST_BINS = 50  # of a segment between two gaps
SMALL = 8  # points, the size of letters
MOST_SPIKES_RINGED = 200
MOST_NAMES = 4  # of channels that are not drawn
GAP = "#d7dbe0"
MOST_CASES = 8  # in one figure
CASE_HEIGHT = 3.8  # inches
WIDEST, NARROWEST = 2.6, 1.0  # points: curves that coincide are seen around each other
ERROR = "simulated\n- measured\n(1e-3 pu)"


def overlay(comparison: Comparison, title: str, label: str = "") -> Figure:
    """Return measured and simulated signals on one axis each, with their difference below.

    Above them are the recorded signals that drove the simulation, if any did in place of a plant.
    ``label`` names the simulated ones, by default fitted or simulated.
    """
    driving = {} if comparison.played is None else comparison.played.driving
    count, above = len(comparison.overlays), len(driving)
    height, ratios = 1.0 + 4.2 * count + 1.5 * above, [1.5] * above + [3.0, 1.0] * count
    figure, axes = stacked(height, len(ratios), title, sharex=True, height_ratios=ratios)
    for own, (name, signal) in zip(axes[:above], driving.items(), strict=True):
        own.plot(*envelope(comparison.time, signal.samples), "-", color=START, linewidth=1.1)
        departs = signal.excursion and f"; deviation {signal.excursion.text(signal.unit)}"
        own.set_title(f"recorded {name}, played in{departs or ''}", fontsize=9, loc="right")
        tidy(own, f"{name} ({signal.unit})")
    for k, name in enumerate(comparison.overlays):
        upper, lower = axes[above + 2 * k], axes[above + 2 * k + 1]
        _signal(upper, lower, comparison, name, label)
    _limiters([*axes[above::2]], comparison)
    axes[-1].set_xlabel("time (s)")
    return figure


def overlays(comparisons: Sequence[Comparison], title: str) -> Figure:
    """Return the signal that judges each of several records, measured and simulated.

    Below it is their difference; the other signals are in the figure of each record.
    """
    height, ratios = 1.0 + 3.4 * len(comparisons), [3.0, 1.0] * len(comparisons)
    figure, axes = stacked(height, len(ratios), title, height_ratios=ratios)
    for comparison, signal, error in zip(comparisons, axes[::2], axes[1::2], strict=True):
        _signal(signal, error, comparison, comparison.judged_by, "")
        signal.set_title(short(comparison.name, LONGEST), fontsize=10, loc="left")
        error.set_xlim(signal.get_xlim())
        _limiters([signal], comparison)
    axes[-1].set_xlabel("time (s)")
    return figure


def _signal(axes: Axes, below: Axes, comparison: Comparison, signal: str, label: str) -> None:
    """Draw a signal, and its error below; faintly what is not compared."""
    time, samples = comparison.time, comparison.overlays[signal]
    lines: list[tuple[Array | None, str, dict[str, Any]]] = [
        (samples.reference, "-", {"color": LIMIT, "linewidth": 0.9, "label": REFERENCE}),
        (samples.measured, ".", {"color": MEASURED, "markersize": 3, "label": "measured"}),
        (samples.start, "--", {"color": START, "linewidth": 1.2, "label": "start values"}),
    ]
    for line, style, look in lines:
        if line is not None:
            axes.plot(*envelope(time, line), style, **look)
    if comparison.played is not None and signal in comparison.played.left_out:
        faint = comparison.played.left_out[signal]
        axes.plot(time, faint.measured, ".", color=MEASURED, markersize=3, alpha=FAINT)
        look = {"color": SIMULATED, "linewidth": 1.0, "alpha": FAINT, "label": "not compared"}
        axes.plot(time, faint.simulated, "-", **look)
    label = label or ("fitted" if samples.start is not None else "simulated")
    axes.plot(*envelope(time, samples.simulated), "-", color=SIMULATED, linewidth=1.4, label=label)
    axes.legend(loc="best", frameon=False)
    match = comparison.channels[signal]
    text = f"rmse {match.rmse:.3g} pu, fit {percentage(match.fit_percent)} %"
    axes.set_title(text, fontsize=9, loc="right", y=1.0)
    tidy(axes, label_of(signal))
    zero_line(below)
    below.plot(*envelope(time, MILLI * samples.error), color=SIMULATED, linewidth=0.7)
    tidy(below, ERROR)


def _limiters(panels_of_signals: Sequence[Axes], comparison: Comparison) -> None:
    """Shade when a limiter acts, with its name in the first panel."""
    for action in comparison.limiters:
        for axes in panels_of_signals:
            for start, end in action.spans:
                axes.axvspan(start, end, color=LIMIT, alpha=LIMITED, linewidth=0.0)
        place, corner = (action.spans[0][0], 0.02), ("data", "axes fraction")
        text = f" {action.name} acts"
        panels_of_signals[0].annotate(text, place, xycoords=corner, fontsize=SMALL)


def response(simulated: "Response", title: str) -> Figure:
    """Return every signal of a simulation over time; vref and vt share an axis."""
    names = [name for name in simulated.signals if name not in (*VOLTAGES, *DRAWN_OTHERWISE)]
    ranges = {name: np.ptp(simulated.signals[name]) for name in names}
    changing = [name for name in names if ranges[name] > 0.0][:MOST_SIGNALS]
    columns = 2 if len(changing) > 2 else 1
    rows = -(-len(changing) // columns)
    figure = new_figure(2.6 + 1.6 * rows, title)
    grid = figure.add_gridspec(1 + rows, columns, height_ratios=[1.6, *[1.0] * rows])
    first = figure.add_subplot(grid[0, :])
    _voltages(first, simulated)
    for k, name in enumerate(changing):
        place = grid[1 + k // columns, k % columns]
        axes = figure.add_subplot(place, sharex=first)
        axes.plot(simulated.time, simulated.signals[name], color=START, linewidth=1.1)
        axes.tick_params(labelbottom=k + columns >= len(changing))
        tidy(axes, f"{name} ({unit_of_signal(name)})")
    # one column lies on the same axis as the panels below it, two do not
    first.tick_params(labelbottom=columns > 1 or not changing)
    still = ", ".join(name for name in names if ranges[name] == 0.0)
    rest = f"   (unused or at rest: {still})" if still else ""
    figure.supxlabel(f"time (s){rest}", fontsize=10)
    return figure


def _voltages(axes: Axes, simulated: "Response") -> None:
    """Draw the reference and the voltage that follows it."""
    names = [name for name in VOLTAGES if name in simulated.signals]
    for name in names:
        color = SIMULATED if name == "vt" else MEASURED
        axes.plot(simulated.time, simulated.signals[name], color=color, linewidth=1.3, label=name)
    axes.legend(loc="best", frameon=False)
    tidy(axes, f"{', '.join(names)} (pu)")


def overview(title: str, simulated: "Response") -> Figure:
    """Draw the voltages of a model with its typical data."""
    signals = [name for name in ("vt", "efd") if name in simulated.signals]
    figure, rows = stacked(0.6 + 2.2 * len(signals), len(signals))
    for axes, name in zip(rows, signals, strict=True):
        axes.sharex(rows[-1])
        axes.tick_params(labelbottom=axes is rows[-1])
        axes.plot(simulated.time, simulated.signals[name], color=SIMULATED, linewidth=1.4)
        tidy(axes, label_of(name))
    rows[-1].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=12)
    return figure


def inspection(inspected: "Inspection", title: str) -> Figure:
    """Return each channel in a panel of its own: steps marked, gaps shaded, spikes ringed.

    Of many channels those with a signal come first, then those that show a step; the rest are
    named.
    """
    drawn, others = inspected.foremost[:MOST_CHANNELS], inspected.foremost[MOST_CHANNELS:]
    figure, column = stacked(1.2 + 1.5 * len(drawn), len(drawn), title, sharex=True)
    for axes, channel in zip(column, drawn, strict=True):
        _channel(axes, inspected, channel)
    for step in inspected.steps:
        column[0].annotate(
            f"{step.at:.4g} s",
            (step.at, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
            color=SIMULATED,
            fontsize=SMALL,
        )
    missing = ""
    if others:
        more = len(others) - MOST_NAMES
        names = ", ".join(short(channel.name) for channel in others[:MOST_NAMES])
        missing = f"\nnot drawn: {names}{f' and {more} more' if more > 0 else ''}"
    column[-1].set_xlabel(f"time (s){missing}")
    return figure


def _channel(axes: Axes, inspected: "Inspection", channel: "InspectedChannel") -> None:
    """Draw the samples of a channel between the gaps of the clock, and what was seen in it."""
    time, samples = inspected.time, inspected.samples[channel.name]
    for gap in inspected.sampling.gaps:
        axes.axvspan(gap.start, gap.end, color=GAP, linewidth=0.0)
    ends = np.searchsorted(time, [gap.end for gap in inspected.sampling.gaps])
    bins = max(PIXELS // (len(ends) + 1), FEWEST_BINS)
    for t, y in zip(np.split(time, ends), np.split(samples, ends), strict=True):
        axes.plot(*envelope(t, y, bins), color=START, linewidth=0.9)
    for first, last in channel.stuck:
        axes.axvspan(first, last, color=LIMIT, alpha=0.25, linewidth=0.0)
    spikes = np.array(channel.spikes_at[:MOST_SPIKES_RINGED])
    if len(spikes):
        values = samples[np.searchsorted(time, spikes)]
        axes.plot(spikes, values, "o", color=SIMULATED, fillstyle="none", markersize=7)
    for step in inspected.steps:
        detected = channel.name in step.sizes or channel.name in step.seen_in
        axes.axvline(step.at, color=SIMULATED, linewidth=1.0, linestyle="-" if detected else ":")
    signal = f"\n{channel.signal}" if channel.signal not in (None, "", channel.name) else ""
    unit = channel.unit or "unit?"
    axes.set_ylabel(f"{short(channel.name)}{signal}\n({unit})", fontsize=SMALL)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=SMALL)
    tidy(axes)


def fit_series(series: "FitSeries") -> Figure:
    """Return for each case the responses of its fits beside the record, their errors and costs.

    Of many cases the first are drawn; the others are named. A cross ends the costs of a fit that
    does not hold.
    """
    cases = series.by_case
    drawn = [*cases.items()][:MOST_CASES]
    figure = new_figure(0.6 + CASE_HEIGHT * len(drawn))
    grid = figure.add_gridspec(
        2 * len(drawn), 2, width_ratios=[2.2, 1.0], height_ratios=[2.6, 1.0] * len(drawn)
    )
    for k, (name, runs) in enumerate(drawn):
        upper = figure.add_subplot(grid[2 * k, 0])
        errors = figure.add_subplot(grid[2 * k + 1, 0], sharex=upper)
        costs = figure.add_subplot(grid[2 * k : 2 * k + 2, 1])
        upper.tick_params(labelbottom=False)
        upper.set_title(f"{name}: {runs[0].result.model}", fontsize=10, loc="left")
        responses_beside(upper, errors, {r.result.strategy: r.result.comparison for r in runs})
        for place, run in enumerate(runs):
            look = _look(place, len(runs))
            values = [line.cost if line.cost > 0.0 else float("nan") for line in run.result.history]
            costs.plot(values, label=run.result.strategy, **look)
            marker, size = "o" if run.result.holds else "X", 3 + 2 * look["linewidth"]
            end = {"color": look["color"], "markersize": size, "clip_on": False}
            costs.plot(len(values) - 1, values[-1], marker, **end)
        logarithmic(costs)
        costs.set_title("f (pu²) over the iterations", fontsize=9, loc="left")
        costs.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        tidy(costs)
    left_out = [*cases][MOST_CASES:]
    if left_out:
        figure.supxlabel(f"not drawn: {', '.join(left_out)}", fontsize=SMALL)
    return figure


def responses_beside(upper: Axes, errors: Axes, comparisons: Mapping[str, Comparison]) -> None:
    """Draw the judged signal of a record, and what each response leaves of it, by its name."""
    first = next(iter(comparisons.values()))
    signal = first.judged_by
    measured = envelope(first.time, first.overlays[signal].measured)
    upper.plot(*measured, ".", color=MEASURED, markersize=4, label="measured")
    zero_line(errors)
    for k, (name, match) in enumerate(comparisons.items()):
        line, look = match.overlays[signal], _look(k, len(comparisons))
        label = f"{name}, rmse {match.rmse:.2e} pu"
        upper.plot(*envelope(match.time, line.simulated), label=label, **look)
        errors.plot(*envelope(match.time, MILLI * line.error), **{**look, "linewidth": 0.8})
    upper.legend(loc="best", frameon=False, fontsize=SMALL)
    errors.set_ylabel("error\n(1e-3 pu)", fontsize=SMALL)
    errors.set_xlabel("time (s)")
    tidy(upper, label_of(signal))
    tidy(errors)


def _look(place: int, count: int) -> dict[str, Any]:
    """Choose the line of a fit: the later, the narrower."""
    share = place / max(count - 1, 1)
    return {
        "color": COLORS[place % len(COLORS)],
        "linestyle": STYLES[place % len(STYLES)],
        "linewidth": WIDEST + share * (NARROWEST - WIDEST) if count > 1 else 1.4,
    }
