"""Responses on one axis, with their differences below."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.dsp.sampling import envelope
from exfit.features.compare.curves import RECORD
from exfit.output.figures.style import (
    COLORS,
    MEASURED,
    MILLI,
    SIMULATED,
    START,
    STYLES,
    stacked,
    tidy,
    zero_line,
)
from exfit.signals import label_of

if TYPE_CHECKING:
    from exfit.features.compare.agreement import Agreement
    from exfit.features.compare.curves import Difference


OF_TWO = ((START, "-"), (SIMULATED, "--"))
WIDTHS = (2.6, 2.2, 1.8, 1.4)  # points: curves that coincide are seen around each other
TAKEN = (COLORS[0], START, SIMULATED)  # the first of the colours is a blue, too


def agreement(compared: "Agreement") -> Figure:
    """Return the signals of responses, with a record where there is one, and the differences.

    Of many responses only the differences from the reference are drawn: the record, or the first.
    """
    signals = compared.signals
    responses = [curve for curve in compared.curves if not curve.measured]
    others = [color for color in COLORS if color not in TAKEN]
    lines = OF_TWO + tuple((color, STYLES[k % len(STYLES)]) for k, color in enumerate(others))
    two = len(responses) <= len(OF_TWO)
    looks: dict[str, dict[str, Any]] = {}
    for k, curve in enumerate(responses):  # of many the later are the narrower
        color, style = lines[k % len(lines)]
        width = WIDTHS[-1] if two else WIDTHS[min(k, len(WIDTHS) - 1)]
        looks[curve.name] = {"color": color, "linestyle": style, "linewidth": width}
    height, ratios = 1.0 + 4.2 * len(signals), [3.0, 1.3] * len(signals)
    figure, axes = stacked(height, len(ratios), sharex=True, height_ratios=ratios)
    for k, signal in enumerate(signals):
        _curves(axes[2 * k], compared, signal, looks)
        drawn = compared.differences if two else compared.from_reference
        _differences(axes[2 * k + 1], [each for each in drawn if each.signal == signal], looks)
    axes[-1].set_xlabel("time (s)")
    titles = []
    for curve in compared.curves:
        moved = f", shifted by {curve.shift:.4g} s" if curve.shift else ""
        titles.append(f"{curve.name}: {Path(curve.path.parent.name, curve.path.name)}{moved}")
    figure.suptitle("\n".join(titles), fontsize=10)
    return figure


def _curves(
    axes: Axes, compared: "Agreement", signal: str, looks: dict[str, dict[str, Any]]
) -> None:
    """Draw a signal of all that have it, the record below the lines."""
    time = compared.time
    own = {each.second: each for each in compared.from_reference if each.signal == signal}
    for curve in sorted(compared.curves, key=lambda curve: curve.name in looks):
        if signal not in curve.signals:
            continue
        inside = (curve.time >= time[0]) & (curve.time <= time[-1])
        points = envelope(curve.time[inside], curve.signals[signal][inside])
        if curve.name in looks:
            f = f", f = {own[curve.name].f:.2e} pu²" if curve.name in own else ""
            axes.plot(*points, label=f"{curve.name}{f}", **looks[curve.name])
        else:
            axes.plot(*points, ".", color=MEASURED, markersize=3, label=curve.name)
    axes.legend(loc="best", frameon=False)
    between = [each for each in compared.between if each.signal == signal]
    if len(between) == 1:
        value, at = between[0].largest
        text = f"{_name(between[0])}: rms {between[0].rms:.3g} pu, largest {value:.3g} pu"
        axes.set_title(f"{text} at {at:.4g} s", fontsize=9, loc="right")
    tidy(axes, label_of(signal))


def _differences(
    axes: Axes, differences: "list[Difference]", looks: dict[str, dict[str, Any]]
) -> None:
    zero_line(axes)
    of_records = any(difference.first == RECORD for difference in differences)
    for difference in differences:
        between = (of_records and difference.first != RECORD) or len(differences) == 1
        axes.plot(
            *envelope(difference.time, MILLI * difference.error),
            color="black" if between else looks[difference.second]["color"],
            linewidth=1.1 if between else 0.6,
            label=_name(difference),
        )
    several = len(differences) > 1
    label = "difference" if several else _name(differences[0])
    if several:
        axes.legend(loc="best", frameon=False, ncols=len(differences), fontsize=8)
    tidy(axes, f"{label}\n(1e-3 pu)")


def _name(difference: "Difference") -> str:
    return f"{difference.second} - {difference.first}"
