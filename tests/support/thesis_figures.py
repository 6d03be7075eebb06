"""The figures of the thesis, drawn of exfit's fits; the title of each axis names its figure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

import exfit
from exfit.output.figures.style import COLORS, MEASURED, SIMULATED, START, logarithmic, tidy
from exfit.results.comparisons import Comparison

Array = NDArray[np.float64]

WIDTH, HEIGHT = 9.0, 2.6  # inches, of a row
SMALL = 8.5  # points


@dataclass(frozen=True, eq=False)
class Curve:
    """A response (M,) at ``time`` (M,), and what the legend calls it."""

    label: str
    time: Array
    samples: Array
    colour: str = SIMULATED
    style: str = "-"


@dataclass(frozen=True, eq=False)
class Panel:
    """An axis: the record and what is drawn over it, from ``begin`` to ``end`` in s."""

    title: str
    measured: Curve
    curves: Sequence[Curve]
    begin: float = 0.5
    end: float = 5.0


def measured_of(match: Comparison) -> Curve:
    """Return the record of a comparison."""
    return Curve("measured", match.time, match.overlays["vt"].measured, MEASURED)


def simulated_of(match: Comparison, label: str = "simulated") -> Curve:
    """Return the response of a comparison."""
    return Curve(label, match.time, match.overlays["vt"].simulated)


def fit_panel(title: str, result: exfit.FitResult) -> Panel:
    """Return the fitted response beside the record."""
    match = result.comparison
    return Panel(f"{title}, f = {result.cost:.2e}", measured_of(match), [simulated_of(match)])


def start_panel(title: str, result: exfit.FitResult) -> Panel:
    """Return the response to the start values beside the record."""
    match = result.comparison
    start = match.overlays["vt"].start
    assert start is not None
    curve = Curve("start values", match.time, start, START)
    return Panel(f"{title}, f = {result.start_cost:.2e}", measured_of(match), [curve])


def responses(panels: Sequence[Panel], columns: int = 2) -> Figure:
    """Return all panels, with one legend."""
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(WIDTH, 0.4 + HEIGHT * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=False):
        draw(axes, panel)
    for axes in grid.flat[len(panels) :]:
        axes.set_visible(False)
    for axes in grid[:, 0]:
        axes.set_ylabel("vt (pu)", fontsize=SMALL)
    handles: dict[str, object] = {}
    for axes in grid.flat[: len(panels)]:
        handles |= {line.get_label(): line for line in axes.lines}
    figure.legend(
        handles.values(), handles, loc="outside lower right", ncols=len(handles), frameon=False
    )
    return figure


def draw(axes: Axes, panel: Panel) -> None:
    """Draw a record and the curves over it."""
    record = panel.measured
    shown = (record.time >= panel.begin) & (record.time <= panel.end)
    axes.plot(
        record.time[shown], record.samples[shown], ".", color=MEASURED, ms=3, label=record.label
    )
    for curve in panel.curves:
        shown = (curve.time >= panel.begin) & (curve.time <= panel.end)
        axes.plot(
            curve.time[shown],
            curve.samples[shown],
            curve.style,
            color=curve.colour,
            linewidth=1.2,
            label=curve.label,
        )
    axes.set_title(panel.title, fontsize=SMALL, loc="left")
    axes.set_xlabel("time (s)", fontsize=SMALL)
    axes.tick_params(labelsize=SMALL)
    tidy(axes)


def costs_and_steps(fits: Mapping[str, exfit.FitResult]) -> Figure:
    """Return f and the step size over the iterations of some fits, one column for each."""
    figure = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    grid = figure.subplots(2, len(fits), squeeze=False, sharex="col", sharey="row")
    for (upper, lower), (title, result) in zip(grid.T, fits.items(), strict=True):
        numbers = [line.number for line in result.history]
        upper.plot(numbers, [line.cost for line in result.history], "o-", color=START, ms=3)
        steps = [line.step_norm if line.step_norm > 0.0 else np.nan for line in result.history]
        lower.plot(numbers, steps, "o-", color=SIMULATED, ms=3)
        upper.set_title(title, fontsize=SMALL, loc="left")
        lower.set_xlabel("iteration", fontsize=SMALL)
        lower.xaxis.set_major_locator(MaxNLocator(integer=True))
        for axes in (upper, lower):
            logarithmic(axes)
            axes.tick_params(labelsize=SMALL)
            tidy(axes)
    grid[0, 0].set_ylabel("cost f (pu²)", fontsize=SMALL)
    grid[1, 0].set_ylabel("step size", fontsize=SMALL)
    return figure


def trajectories(title: str, result: exfit.FitResult) -> Figure:
    """Return each parameter over the iterations, relative to its start."""
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    axes = figure.subplots()
    numbers = [line.number for line in result.history]
    for (name, parameter), colour in zip(result.parameters.items(), COLORS, strict=False):
        values = [line.values[name] / parameter.start for line in result.history]
        axes.plot(numbers, values, "o-", color=colour, linewidth=1.2, ms=3, label=name)
    axes.set_xlabel("iteration")
    axes.set_ylabel("value : start value")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_title(title, fontsize=SMALL, loc="left")
    tidy(axes)
    figure.legend(loc="outside right upper", frameon=False)
    return figure


def jacobian(panel: Panel, time: Array, ours: Array, theirs: Array) -> Figure:
    """Return a response, and dv/dk and dv/da (M, 2): of exfit, and as the thesis prints them."""
    figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw(left, panel)
    left.set_ylabel("v", fontsize=SMALL)
    left.legend(frameon=False, fontsize=SMALL)
    for k, (label, colour) in enumerate((("dv/dk", START), ("dv/da", SIMULATED))):
        right.plot(time, ours[:, k], color=colour, linewidth=1.2, label=f"{label}, exfit")
        right.plot(time, theirs[:, k], "o", color=colour, ms=3, label=f"{label}, thesis")
    right.set_title("the Jacobian of 3.3", fontsize=SMALL, loc="left")
    right.set_xlabel("time (s)", fontsize=SMALL)
    right.tick_params(labelsize=SMALL)
    right.legend(frameon=False, fontsize=SMALL)
    tidy(right)
    return figure
