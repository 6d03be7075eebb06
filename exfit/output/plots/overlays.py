"""Measured against simulated."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.dsp.decimation import envelope
from exfit.output.plots.style import (
    LIMIT,
    MEASURED,
    MILLI,
    SIMULATED,
    START,
    new_figure,
    panels,
    tidy,
)
from exfit.results.comparisons import REFERENCE, Comparison, Overlay
from exfit.signals import label_of


def overlay(comparison: Comparison, title: str, label: str = "") -> Figure:
    """Return measured and simulated signals on one axis each, with their difference below.

    ``label`` names the simulated ones, by default fitted or simulated.
    """
    count = len(comparison.overlays)
    figure = new_figure(1.0 + 4.2 * count)
    axes = panels(figure, 2 * count, sharex=True, height_ratios=[3.0, 1.0] * count)
    for k, (signal, overlaid) in enumerate(comparison.overlays.items()):
        _signal(axes[2 * k, 0], comparison, signal, overlaid, label)
        _error(axes[2 * k + 1, 0], comparison, overlaid)
    axes[-1, 0].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=11)
    return figure


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
    label = label or ("fitted" if overlaid.start is not None else "simulated")
    axes.plot(*envelope(time, overlaid.simulated), "-", color=SIMULATED, linewidth=1.4, label=label)
    axes.set_ylabel(label_of(signal))
    axes.legend(loc="best", frameon=False)
    match = comparison.channels[signal]
    text = f"rmse {match.rmse:.3g} pu, fit {match.fit_percent:.2f} %"
    axes.set_title(text, fontsize=9, loc="right")
    tidy(axes)


def _error(axes: Axes, comparison: Comparison, overlaid: Overlay) -> None:
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.plot(*envelope(comparison.time, MILLI * overlaid.error), color=SIMULATED, linewidth=0.7)
    axes.set_ylabel("simulated\n- measured\n(1e-3 pu)")
    tidy(axes)
