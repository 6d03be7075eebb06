"""Measured against simulated."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exfit.dsp.sampling import envelope
from exfit.results.comparisons import REFERENCE, Comparison, DrivingSignal, LeftOut, Overlay
from exfit.show.figures.style import (
    LIMIT,
    MEASURED,
    MILLI,
    SIMULATED,
    START,
    new_figure,
    panels,
    short,
    tidy,
)
from exfit.signals import label_of
from exfit.util.text import percentage

Array = NDArray[np.float64]

FAINT = 0.4  # opacity of what is not compared
LONGEST = 40  # letters of a record's name
SHADE = 0.15  # of when a limiter acts


def overlay(comparison: Comparison, title: str, label: str = "") -> Figure:
    """Return measured and simulated signals on one axis each, with their difference below.

    Above them are the recorded signals that drove the simulation, if any did in place of a plant.
    ``label`` names the simulated ones, by default fitted or simulated.
    """
    played = comparison.played
    driving = () if played is None else tuple(played.driving.items())
    count, above = len(comparison.overlays), len(driving)
    figure = new_figure(1.0 + 4.2 * count + 1.5 * above)
    ratios = [1.5] * above + [3.0, 1.0] * count
    axes = panels(figure, above + 2 * count, sharex=True, height_ratios=ratios)[:, 0]
    for own, (name, signal) in zip(axes[:above], driving, strict=True):
        _driving(own, comparison.time, name, signal)
    for k, (name, overlaid) in enumerate(comparison.overlays.items()):
        _signal(axes[above + 2 * k], comparison, name, overlaid, label)
        _error(axes[above + 2 * k + 1], comparison, overlaid)
    _limiters(list(axes[above::2]), comparison)
    axes[-1].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=11)
    return figure


def overlays(comparisons: Sequence[Comparison], title: str) -> Figure:
    """Return the signal that judges each of several records, measured and simulated.

    Below it is their difference; the other signals are in the figure of each record.
    """
    figure = new_figure(1.0 + 3.4 * len(comparisons))
    axes = panels(figure, 2 * len(comparisons), height_ratios=[3.0, 1.0] * len(comparisons))[:, 0]
    for comparison, signal, error in zip(comparisons, axes[::2], axes[1::2], strict=True):
        overlaid = comparison.overlays[comparison.judged_by]
        _signal(signal, comparison, comparison.judged_by, overlaid, "")
        signal.set_title(short(comparison.name, LONGEST), fontsize=10, loc="left")
        _error(error, comparison, overlaid)
        error.set_xlim(signal.get_xlim())
        _limiters([signal], comparison)
    axes[-1].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=11)
    return figure


def _limiters(panels_of_signals: Sequence[Axes], comparison: Comparison) -> None:
    """Shade when a limiter acts, with its name in the first panel."""
    for action in comparison.limiters:
        for k, axes in enumerate(panels_of_signals):
            for start, end in action.spans:
                axes.axvspan(start, end, color=LIMIT, alpha=SHADE, linewidth=0.0)
            if k == 0:
                first = action.spans[0][0]
                axes.annotate(
                    f" {action.name} acts",
                    (first, 0.02),
                    xycoords=("data", "axes fraction"),
                    fontsize=8,
                )


def _driving(axes: Axes, time: Array, name: str, signal: DrivingSignal) -> None:
    """Draw a recorded signal that drove the simulation."""
    axes.plot(*envelope(time, signal.samples), "-", color=START, linewidth=1.1)
    axes.set_ylabel(f"{name} ({signal.unit})")
    departure = signal.excursion
    departs = "" if departure is None else f"; from rest by {departure.text(signal.unit)}"
    axes.set_title(f"recorded {name}, played in{departs}", fontsize=9, loc="right")
    tidy(axes)


def _signal(axes: Axes, comparison: Comparison, signal: str, overlaid: Overlay, label: str) -> None:
    time = comparison.time
    if overlaid.reference is not None:
        axes.plot(
            *envelope(time, overlaid.reference), "-", color=LIMIT, linewidth=0.9, label=REFERENCE
        )
    axes.plot(
        *envelope(time, overlaid.measured), ".", color=MEASURED, markersize=3, label="measured"
    )
    if overlaid.start is not None:
        axes.plot(
            *envelope(time, overlaid.start), "--", color=START, linewidth=1.2, label="start values"
        )
    if comparison.played is not None and signal in comparison.played.left_out:
        _left_out(axes, time, comparison.played.left_out[signal])
    label = label or ("fitted" if overlaid.start is not None else "simulated")
    axes.plot(*envelope(time, overlaid.simulated), "-", color=SIMULATED, linewidth=1.4, label=label)
    axes.set_ylabel(label_of(signal))
    axes.legend(loc="best", frameon=False)
    match = comparison.channels[signal]
    text = f"rmse {match.rmse:.3g} pu, fit {percentage(match.fit_percent)} %"
    axes.set_title(text, fontsize=9, loc="right")
    tidy(axes)


def _left_out(axes: Axes, time: Array, signal: LeftOut) -> None:
    """Draw faintly what is not compared."""
    axes.plot(time, signal.measured, ".", color=MEASURED, markersize=3, alpha=FAINT)
    axes.plot(
        time,
        signal.simulated,
        "-",
        color=SIMULATED,
        linewidth=1.0,
        alpha=FAINT,
        label="not compared",
    )


def _error(axes: Axes, comparison: Comparison, overlaid: Overlay) -> None:
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.plot(*envelope(comparison.time, MILLI * overlaid.error), color=SIMULATED, linewidth=0.7)
    axes.set_ylabel("simulated\n- measured\n(1e-3 pu)")
    tidy(axes)
