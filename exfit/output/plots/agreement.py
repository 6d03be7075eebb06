"""Two responses on one axis, with their differences below."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.analysis.comparison import Agreement, Curve, Difference
from exfit.dsp.decimation import envelope
from exfit.output.plots.style import MEASURED, MILLI, SIMULATED, START, WIDTH, tidy
from exfit.signals import label_of

LINES = {"A": (START, "-"), "B": (SIMULATED, "--")}


def agreement(compared: Agreement) -> Figure:
    """Return the signals of two responses, with a record where there is one, and the differences.

    The differences from a record are drawn too.
    """
    signals = [difference.signal for difference in compared.between]
    count = len(signals)
    figure = Figure(figsize=(WIDTH, 1.0 + 4.2 * count), layout="constrained")
    axes = figure.subplots(
        2 * count, 1, sharex=True, height_ratios=[3.0, 1.3] * count, squeeze=False
    )[:, 0]
    for k, (signal, between) in enumerate(zip(signals, compared.between, strict=True)):
        _curves(axes[2 * k], compared.curves, between)
        own = [each for each in compared.differences if each.signal == signal]
        _differences(axes[2 * k + 1], own)
    axes[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    names = [
        f"{curve.name}: {curve.path.parent.name}/{curve.path.name}" for curve in compared.curves
    ]
    figure.suptitle("\n".join(names), fontsize=10)
    return figure


def _curves(axes: Axes, curves: tuple[Curve, ...], between: Difference) -> None:
    begin, end = between.time[0], between.time[-1]
    # the record is drawn below the lines
    for curve in sorted(curves, key=lambda curve: curve.name in LINES):
        if between.signal not in curve.signals:
            continue
        inside = (curve.time >= begin) & (curve.time <= end)
        points = envelope(curve.time[inside], curve.signals[between.signal][inside])
        if curve.name in LINES:
            color, style = LINES[curve.name]
            axes.plot(*points, style, color=color, linewidth=1.4, label=curve.name)
        else:
            axes.plot(*points, ".", color=MEASURED, markersize=3, label=curve.name)
    axes.set_ylabel(label_of(between.signal))
    axes.legend(loc="best", frameon=False)
    value, at = between.largest
    text = f"B - A: rms {between.rms:.3g} pu, largest {value:.3g} pu at {at:.4g} s"
    axes.set_title(text, fontsize=9, loc="right")
    tidy(axes)


def _differences(axes: Axes, differences: list[Difference]) -> None:
    axes.axhline(0.0, color="black", linewidth=0.6)
    for difference in differences:
        of_record = difference.first == "record"
        axes.plot(
            *envelope(difference.time, MILLI * difference.error),
            color=LINES[difference.second][0] if of_record else "black",
            linewidth=0.6 if of_record else 1.1,
            label=f"{difference.second} - {difference.first}",
        )
    several = len(differences) > 1
    axes.set_ylabel("difference\n(1e-3 pu)" if several else "B - A\n(1e-3 pu)")
    if several:
        axes.legend(loc="best", frameon=False, ncols=len(differences), fontsize=8)
    tidy(axes)
