"""Single descents from a point, and what several of them are as one."""

from collections.abc import Callable
from dataclasses import replace

from exfit.errors import SimulationError
from exfit.estimate import STATUS, Descent, OneByOne, Result, SolverIteration, Stop
from exfit.estimate.solver import NotFinite
from exfit.fitting.residuals import Residuals
from exfit.util.arrays import Array

Announce = Callable[[SolverIteration], None]


def stopped(end: Result, stop: Stop) -> Result:
    """Return an end for another reason, which is no convergence."""
    return end._replace(stop=stop, status=STATUS[stop], message=stop.value, success=False)


def following(last: SolverIteration, line: SolverIteration) -> SolverIteration:
    """Return a line of a descent as it stands behind those of an earlier one."""
    return line._replace(
        number=last.number + 1 + line.number,
        nfev=last.nfev + line.nfev,
        njev=last.njev + line.njev,
    )


def descent_near(residuals: Residuals, theta: Array, tolerance: float = Descent.xtol) -> Result:
    """Run one descent from scaled parameters theta (N,), without announcements.

    It ends where the step falls below a ``tolerance``. Raises KeyboardInterrupt at an interruption.
    """
    functions, units = OneByOne(residuals, residuals.exact), residuals.units
    descent = Descent(functions=functions, bounds=residuals.bounds, x_scale=units, xtol=tolerance)
    end = descent.run(theta)
    if end.stop is Stop.INTERRUPTED:
        raise KeyboardInterrupt
    return end


def short_descent(
    residuals: Residuals,
    theta: Array,
    most_iterations: int,
    watch: Announce = lambda _: None,
    tolerance: float | None = None,
    matches: Callable[[Array], bool] | None = None,
) -> Result | None:
    """Run one descent of few iterations in each phase, from scaled parameters theta (N,).

    It may end early: by a ``tolerance`` of the step and of the gradient, in the units of the
    search, or where the residuals match. None where there is no response.
    """
    descent = Descent(
        functions=OneByOne(residuals, residuals.exact),
        bounds=residuals.bounds,
        method="lm-then-dgn",
        max_iterations=most_iterations,
        x_scale=residuals.units,
        matches=matches,
    )
    if tolerance is not None:
        descent = replace(descent, gtol=tolerance, xtol=tolerance)
    try:
        return descent.run(theta, watch)
    except (SimulationError, NotFinite):
        return None
