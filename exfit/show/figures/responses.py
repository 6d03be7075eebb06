"""Simulated responses without a record."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.show.figures.style import MEASURED, SIMULATED, START, new_figure, panels, tidy
from exfit.signals import label_of, unit_of_signal
from exfit.simulation.simulator import Response

MOST_PANELS = 12  # of signals and states, that are still readable
VOLTAGES = ("vref", "vt")  # drawn on one axis
DRAWN_OTHERWISE = ("dw",)  # as speed


def response(simulated: Response, title: str) -> Figure:
    """Return every signal of a simulation over time; vref and vt share an axis."""
    changing, at_rest = _others(simulated)
    columns = 2 if len(changing) > 2 else 1
    rows = -(-len(changing) // columns)
    figure = new_figure(2.6 + 1.6 * rows)
    grid = figure.add_gridspec(1 + rows, columns, height_ratios=[1.6, *[1.0] * rows])
    first = figure.add_subplot(grid[0, :])
    _voltages(first, simulated)
    for k, name in enumerate(changing):
        place = grid[1 + k // columns, k % columns]
        axes = figure.add_subplot(place, sharex=first)
        axes.plot(simulated.time, simulated.signals[name], color=START, linewidth=1.1)
        axes.set_ylabel(f"{name} ({unit_of_signal(name)})")
        axes.tick_params(labelbottom=k + columns >= len(changing))
        tidy(axes)
    # one column lies on the same axis as the panels below it, two do not
    first.tick_params(labelbottom=columns > 1 or not changing)
    rest = f"   (unused or at rest: {', '.join(at_rest)})" if at_rest else ""
    figure.supxlabel(f"time (s){rest}", fontsize=10)
    figure.suptitle(title, fontsize=11)
    return figure


def _others(simulated: Response) -> tuple[list[str], list[str]]:
    """Return the other signals that change, each to have a panel, and those at rest."""
    names = [name for name in simulated.signals if name not in (*VOLTAGES, *DRAWN_OTHERWISE)]
    ranges = {name: np.ptp(simulated.signals[name]) for name in names}
    changing = [name for name in names if ranges[name] > 0.0]
    return changing[:MOST_PANELS], [name for name in names if ranges[name] == 0.0]


def _voltages(axes: Axes, simulated: Response) -> None:
    """Draw the reference and the voltage that follows it."""
    names = [name for name in VOLTAGES if name in simulated.signals]
    for name in names:
        color = SIMULATED if name == "vt" else MEASURED
        axes.plot(simulated.time, simulated.signals[name], color=color, linewidth=1.3, label=name)
    axes.set_ylabel(f"{', '.join(names)} (pu)")
    axes.legend(loc="best", frameon=False)
    tidy(axes)


def overview(title: str, simulated: Response) -> Figure:
    """Draw the voltages of a model with its typical data."""
    signals = [name for name in ("vt", "efd") if name in simulated.signals]
    figure = new_figure(0.6 + 2.2 * len(signals))
    rows = panels(figure, len(signals))[:, 0]
    for axes, name in zip(rows, signals, strict=True):
        axes.sharex(rows[-1])
        axes.tick_params(labelbottom=axes is rows[-1])
        axes.plot(simulated.time, simulated.signals[name], color=SIMULATED, linewidth=1.4)
        axes.set_ylabel(label_of(name))
        tidy(axes)
    rows[-1].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=12)
    return figure
