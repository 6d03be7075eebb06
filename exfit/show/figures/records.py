"""What a recorder's file holds, as a figure."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exfit.dsp.sampling import PIXELS, envelope
from exfit.show.figures.style import LIMIT, SIMULATED, START, new_figure, panels, short, tidy

if TYPE_CHECKING:
    from exfit.records.channel_inspection import InspectedChannel
    from exfit.records.inspection import Inspection
    from exfit.records.steps import RecordedStep


Array = NDArray[np.float64]

MOST_PANELS = 10  # of one figure that are still readable
FEWEST_BINS = 50  # of a segment between two gaps
SMALL = 8  # points, the size of letters
MOST_SPIKES_RINGED = 200
MOST_NAMES = 4  # of channels that are not drawn
SHADE = "#d7dbe0"


def inspection(inspected: "Inspection", title: str) -> Figure:
    """Return each channel in a panel of its own: steps marked, gaps shaded, spikes ringed.

    Of many channels those with a signal come first, then those that show a step; the rest are
    named.
    """
    ordered = inspected.foremost
    drawn = ordered[:MOST_PANELS]
    left_out = [channel.name for channel in ordered[MOST_PANELS:]]
    figure = new_figure(1.2 + 1.5 * len(drawn))
    column = panels(figure, len(drawn), sharex=True)[:, 0]
    for axes, channel in zip(column, drawn, strict=True):
        _channel(axes, inspected, channel)
    _instants(column[0], inspected.steps)
    column[-1].set_xlabel("time (s)" + _not_drawn(left_out))
    figure.suptitle(title, fontsize=11)
    return figure


def _channel(axes: Axes, inspected: "Inspection", channel: "InspectedChannel") -> None:
    """Draw a channel with what was detected in it."""
    _samples(axes, inspected, channel.name)
    for first, last in channel.stuck:
        axes.axvspan(first, last, color=LIMIT, alpha=0.25, linewidth=0.0)
    spikes = np.array(channel.spikes_at[:MOST_SPIKES_RINGED])
    if len(spikes):
        values = inspected.samples[channel.name][np.searchsorted(inspected.time, spikes)]
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


def _samples(axes: Axes, inspected: "Inspection", name: str) -> None:
    """Draw the samples of a channel, with the gaps of the clock shaded."""
    time, gaps = inspected.time, inspected.sampling.gaps
    for gap in gaps:
        axes.axvspan(gap.start, gap.end, color=SHADE, linewidth=0.0)
    ends = np.searchsorted(time, [gap.end for gap in gaps])
    bins = max(PIXELS // (len(ends) + 1), FEWEST_BINS)
    for t, y in zip(np.split(time, ends), np.split(inspected.samples[name], ends), strict=True):
        axes.plot(*envelope(t, y, bins), color=START, linewidth=0.9)


def _instants(axes: Axes, steps: "Sequence[RecordedStep]") -> None:
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


def _not_drawn(names: Sequence[str]) -> str:
    """Return the names of what is not drawn, as many as fit."""
    if not names:
        return ""
    text = ", ".join(map(short, names[:MOST_NAMES]))
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"\nnot drawn: {text}{more}"
