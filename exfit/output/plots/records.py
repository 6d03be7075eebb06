"""What a recorder's file holds, as a figure."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exfit.dsp.decimation import PIXELS, envelope
from exfit.output.plots.style import LIMIT, SIMULATED, START, WIDTH, tidy
from exfit.records.channel_inspection import InspectedChannel
from exfit.records.inspection import Inspection
from exfit.records.steps import RecordedStep

Array = NDArray[np.float64]

MOST_PANELS = 10  # of one figure that are still readable
FEWEST = 50  # bins of a stretch between two gaps
SMALL = 8  # points
RINGED = 200  # spikes
NAMED = 4  # channels that are not drawn
SHADE = "#d7dbe0"


def inspection(found: Inspection, title: str) -> Figure:
    """Return each channel in a panel of its own: steps marked, gaps shaded, spikes ringed.

    Of many channels those with a signal come first, then those that show a step; the rest are
    named.
    """
    shows = {name for step in found.steps for name in step.sizes}
    order = sorted(
        found.channels, key=lambda one: (one.signal is None, one.name not in shows, one.constant)
    )
    shown = order[:MOST_PANELS]
    left_out = [one.name for one in order[MOST_PANELS:]]
    figure = Figure(figsize=(WIDTH, 1.2 + 1.5 * len(shown)), layout="constrained")
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axes, one in zip(panels, shown, strict=True):
        _channel(axes, found, one)
    _steps(panels[0], found.steps)
    panels[-1].set_xlabel("time (s)" + _rest(left_out))
    figure.align_ylabels()
    figure.suptitle(title, fontsize=11)
    return figure


def _channel(axes: Axes, found: Inspection, one: InspectedChannel) -> None:
    time, column = found.time, found.samples[one.name]
    for gap in found.sampling.gaps:
        axes.axvspan(gap.start, gap.end, color=SHADE, linewidth=0.0)
    broken = np.searchsorted(time, [gap.end for gap in found.sampling.gaps])
    bins = max(PIXELS // (len(broken) + 1), FEWEST)
    for t, y in zip(np.split(time, broken), np.split(column, broken), strict=True):
        axes.plot(*envelope(t, y, bins), color=START, linewidth=0.9)
    for first, last in one.stuck:
        axes.axvspan(first, last, color=LIMIT, alpha=0.25, linewidth=0.0)
    at = np.array(one.spikes_at[:RINGED])
    if len(at):
        places = np.searchsorted(time, at)
        axes.plot(at, column[places], "o", color=SIMULATED, fillstyle="none", markersize=7)
    for step in found.steps:
        seen = one.name in step.sizes or one.name in step.seen_in
        axes.axvline(step.at, color=SIMULATED, linewidth=1.0, linestyle="-" if seen else ":")
    signal = f"\n{one.signal}" if one.signal and one.signal != one.name else ""
    axes.set_ylabel(f"{_short(one.name)}{signal}\n({one.unit or 'unit?'})", fontsize=SMALL)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=SMALL)
    tidy(axes)


def _steps(axes: Axes, steps: Sequence[RecordedStep]) -> None:
    """Write the instants of the steps above the panels."""
    for step in steps:
        axes.annotate(
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


def _short(name: str) -> str:
    return name if len(name) <= 20 else name[:19] + "…"


def _rest(names: Sequence[str]) -> str:
    """Return the names of what is not drawn, as many as fit."""
    if not names:
        return ""
    text = ", ".join(map(_short, names[:NAMED]))
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"\nnot drawn: {text}{more}"
