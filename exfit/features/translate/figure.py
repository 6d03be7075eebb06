"""The responses of a fitted exciter and of another model to the same steps."""

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.dsp.sampling import envelope
from exfit.output.figures.style import SIMULATED, START, new_figure, panels, tidy, zero_line
from exfit.signals import label_of

if TYPE_CHECKING:
    from exfit.features.translate.result import StepComparison, Translation

PERCENT = 100.0


def translation(result: "Translation", title: str) -> Figure:
    """Return vt and efd of both models for each step, and the error of vt in percent of the step.

    Each plant has a column.
    """
    plants = list(dict.fromkeys(step.plant for step in result.steps))
    figure = new_figure(8.5, title)
    grid = panels(figure, 3, len(plants), sharex=True, height_ratios=[2.0, 1.6, 1.2])
    for column, plant in enumerate(plants):
        steps = [step for step in result.steps if step.plant == plant]
        for axes, signal in zip(grid[:2, column], ("vt", "efd"), strict=True):
            for step in steps:
                source = envelope(result.time, step.source[signal])
                target = envelope(result.time, step.target[signal])
                axes.plot(*source, "-", color=START, linewidth=1.4)
                axes.plot(*target, "--", color=SIMULATED, linewidth=1.4)
            tidy(axes, label_of(signal))
        _errors(grid[2, column], result, steps)
        grid[0, column].set_title(plant, fontsize=10)
    below = grid[1, 0]
    below.legend(below.lines[:2], [result.source, result.target], loc="upper right", frameon=False)
    return figure


def _errors(axes: Axes, result: "Translation", steps: "list[StepComparison]") -> None:
    zero_line(axes)
    for step in steps:
        error = PERCENT * (step.target["vt"] - step.source["vt"]) / abs(step.step)
        axes.plot(*envelope(result.time, error), linewidth=1.1, label=f"{PERCENT * step.step:+g} %")
    axes.set_xlabel("time (s)")
    axes.legend(loc="best", frameon=False, fontsize=8, ncols=3)
    tidy(axes, "error of vt\n(% of the step)")
