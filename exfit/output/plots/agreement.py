"""Two responses on one axis, with their differences below."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.analysis.comparison import Agreement, Curve, Difference
from exfit.dsp.decimation import envelope
from exfit.output.plots.style import MEASURED, MILLI, SIMULATED, START, WIDTH, tidy
from exfit.signals import label_of

LINES = {"A": (START, "-"), "B": (SIMULATED, "--")}


def agreement(found: Agreement) -> Figure:
    """Return the signals of two responses, with a record where there is one, and the differences.

    Of a record the differences from it are drawn too.
    """
    signals = [one.signal for one in found.between]
    count = len(signals)
    figure = Figure(figsize=(WIDTH, 1.0 + 4.2 * count), layout="constrained")
    axes = figure.subplots(
        2 * count, 1, sharex=True, height_ratios=[3.0, 1.3] * count, squeeze=False
    )[:, 0]
    for k, signal in enumerate(signals):
        own = [one for one in found.differences if one.signal == signal]
        _curves(axes[2 * k], found.curves, signal, own[0])
        _differences(axes[2 * k + 1], own)
    axes[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    names = [f"{one.name}: {one.path.parent.name}/{one.path.name}" for one in found.curves]
    figure.suptitle("\n".join(names), fontsize=10)
    return figure


def _curves(axes: Axes, curves: tuple[Curve, ...], signal: str, between: Difference) -> None:
    begin, end = between.time[0], between.time[-1]
    for one in sorted(curves, key=lambda one: one.name in LINES):  # the record below the lines
        if signal not in one.signals:
            continue
        inside = (one.time >= begin) & (one.time <= end)
        time, samples = one.time[inside], one.signals[signal][inside]
        if one.name in LINES:
            color, style = LINES[one.name]
            axes.plot(*envelope(time, samples), style, color=color, linewidth=1.4, label=one.name)
        else:
            axes.plot(*envelope(time, samples), ".", color=MEASURED, markersize=3, label=one.name)
    axes.set_ylabel(label_of(signal))
    axes.legend(loc="best", frameon=False)
    value, at = between.largest
    text = f"B - A: rms {between.rms:.3g} pu, largest {value:.3g} pu at {at:.4g} s"
    axes.set_title(text, fontsize=9, loc="right")
    tidy(axes)


def _differences(axes: Axes, own: list[Difference]) -> None:
    axes.axhline(0.0, color="black", linewidth=0.6)
    for one in own:
        color = LINES[one.second][0] if one.first == "record" else "black"
        width = 0.6 if one.first == "record" else 1.1
        label = f"{one.second} - {one.first}"
        axes.plot(*envelope(one.time, MILLI * one.error), color=color, linewidth=width, label=label)
    axes.set_ylabel("difference\n(1e-3 pu)" if len(own) > 1 else "B - A\n(1e-3 pu)")
    if len(own) > 1:
        axes.legend(loc="best", frameon=False, ncols=len(own), fontsize=8)
    tidy(axes)
