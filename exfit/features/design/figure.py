"""A designed test: the reference, and the response that it is planned to have, with limits."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exfit.features.design.designed_test import DesignedTest
from exfit.output.figures.style import LIMIT, MEASURED, SIMULATED, stacked, tidy
from exfit.signals import label_of


def designed_test(design: DesignedTest) -> Figure:
    """Return the reference, vt and efd of a designed test over time."""
    title = f"{design.name}: the designed test, limits dashed"
    figure, (above, middle, below) = stacked(6.6, 3, title)
    run, limits = design.run, design.limits
    above.plot(run.time, run.inputs["vref"], color=MEASURED, linewidth=1.4)
    above.set_ylabel("reference vref\nfrom its start (pu)")
    _limits(above, (-limits.of_vref, limits.of_vref))
    middle.plot(run.time, run.outputs["vt"], color=SIMULATED, linewidth=1.4)
    middle.set_ylabel(label_of("vt"))
    _limits(middle, (design.vt0 - limits.vt, design.vt0 + limits.vt))
    below.plot(run.time, run.outputs["efd"], color=SIMULATED, linewidth=1.4)
    below.set_ylabel(label_of("efd"))
    _limits(below, [limits.given[name] for name in ("efd", "efd_min") if name in limits.given])
    for axes in (above, middle, below):
        if axes is not below:
            axes.sharex(below)
        axes.tick_params(labelbottom=axes is below)
        tidy(axes)
    below.set_xlabel("time (s)")
    return figure


def _limits(axes: Axes, levels: Sequence[float]) -> None:
    for level in levels:
        axes.axhline(level, color=LIMIT, linewidth=1.0, linestyle="--")
