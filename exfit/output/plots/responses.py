"""Simulated responses without a record."""

import numpy as np
from matplotlib.figure import Figure

from exfit.output.plots.style import MEASURED, SIMULATED, START, WIDTH, tidy
from exfit.signals import label_of, unit_of_signal
from exfit.simulation.simulator import Response

WANTED_STATES = 12  # panels of states that are still readable
SHOWN_OTHERWISE = ("dw",)  # as speed


def response(simulated: Response, title: str) -> Figure:
    """Return every signal of a simulation over time; vref and vt share an axis."""
    together = [name for name in ("vref", "vt") if name in simulated.signals]
    others = [name for name in simulated.signals if name not in (*together, *SHOWN_OTHERWISE)]
    names = [name for name in others if np.ptp(simulated.signals[name]) > 0.0][:WANTED_STATES]
    still = [name for name in others if np.ptp(simulated.signals[name]) == 0.0]
    columns = 2 if len(names) > 2 else 1
    rows = 1 + -(-len(names) // columns)
    figure = Figure(figsize=(WIDTH, 2.6 + 1.6 * (rows - 1)), layout="constrained")
    grid = figure.add_gridspec(rows, columns, height_ratios=[1.6, *[1.0] * (rows - 1)])
    first = figure.add_subplot(grid[0, :])
    time = simulated.time
    for name in together:
        color = SIMULATED if name == "vt" else MEASURED
        first.plot(time, simulated.signals[name], color=color, linewidth=1.3, label=name)
    first.set_ylabel(f"{', '.join(together)} (pu)")
    first.legend(loc="best", frameon=False)
    tidy(first)
    for k, name in enumerate(names):
        ax = figure.add_subplot(grid[1 + k // columns, k % columns], sharex=first)
        ax.plot(time, simulated.signals[name], color=START, linewidth=1.1)
        ax.set_ylabel(f"{name} ({unit_of_signal(name)})")
        ax.tick_params(labelbottom=k + columns >= len(names))
        tidy(ax)
    # one column lies on the same axis as the panels below it, two do not
    first.tick_params(labelbottom=columns > 1 or not names)
    figure.align_ylabels()
    rest = f"   (unused or at rest: {', '.join(still)})" if still else ""
    figure.supxlabel(f"time (s){rest}", fontsize=10)
    figure.suptitle(title, fontsize=11)
    return figure


def overview(title: str, drawing: str, simulated: Response) -> Figure:
    """Return a model on one page: its drawing, and what it does with its typical data."""
    lines = drawing.count("\n") + 1
    shown = [name for name in ("vt", "efd") if name in simulated.signals]
    text_height, height = 0.5 + 0.165 * lines, 2.2 * len(shown)
    figure = Figure(figsize=(WIDTH, text_height + height), layout="constrained")
    ratios = [text_height, *[2.2] * len(shown)]
    panels = figure.subplots(len(ratios), 1, height_ratios=ratios, squeeze=False)[:, 0]
    panels[0].axis("off")
    panels[0].text(
        0.0, 1.0, drawing, family="monospace", fontsize=8.5, va="top", transform=panels[0].transAxes
    )
    for axes, name in zip(panels[1:], shown, strict=True):
        axes.sharex(panels[-1])
        axes.tick_params(labelbottom=axes is panels[-1])
        axes.plot(simulated.time, simulated.signals[name], color=SIMULATED, linewidth=1.4)
        axes.set_ylabel(label_of(name))
        tidy(axes)
    panels[-1].set_xlabel("time (s)")
    figure.suptitle(title, fontsize=12)
    return figure
