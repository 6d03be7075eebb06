"""Nonlinear least squares within bounds: one descent, by the method and tolerances chosen."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, Literal

from numpy.typing import ArrayLike

from exfit.estimate.answer import Result, SolverIteration
from exfit.estimate.lockstep import finish
from exfit.estimate.problem import (
    RELATIVE_STEP,
    Array,
    Differences,
    EvaluationLimit,
    Functions,
    OneByOne,
    Problem,
    Steps,
    checked,
)
from exfit.estimate.run import MOST_ITERATIONS, STRATEGIES, Rules, SearchRun
from exfit.estimate.searches import BENDING, USUAL, Searches
from exfit.util.strategies import DEFAULT_STRATEGY


@dataclass(frozen=True, kw_only=True)
class Descent:
    """What is made small, within which bounds, by which method and how far.

    `least_squares` says what the settings mean; ``differences`` takes the Jacobian from residuals.
    """

    functions: Functions
    bounds: tuple[ArrayLike, ArrayLike] = (-inf, inf)
    method: str = DEFAULT_STRATEGY
    differences: Differences | None = None
    most_evaluations: int | None = None
    max_iterations: int | Mapping[str, int] = MOST_ITERATIONS
    gtol: float = 1e-8
    gtol_absolute: float | None = None
    ftol: float = 1e-10
    xtol: float = 1e-10
    x_scale: ArrayLike | None = None
    jacobian_error: float | None = None
    good_enough: float | None = None
    matches: Callable[[Array], bool] | None = None
    searches: Searches = USUAL

    def begin(
        self, x0: ArrayLike, callback: Callable[[SolverIteration], object] | None = None
    ) -> Steps[Result]:
        """Return the search from x0 (N,), to be advanced by `lockstep`.

        Raises ValueError as `least_squares` does.
        """
        start, box = checked(x0, self.bounds, self.x_scale)
        if self.method not in STRATEGIES:
            raise ValueError(f"method: {self.method!r} is none of {', '.join(STRATEGIES)}")
        scaled = self.x_scale is not None
        problem = Problem(
            self.functions,
            self.differences,
            box,
            scaled,
            self.jacobian_error,
            self.most_evaluations,
        )
        rules = Rules(
            self.max_iterations, self.gtol, self.ftol, self.xtol, self.gtol_absolute, self.matches
        )
        return self._search(SearchRun(problem, rules, self.searches, callback), start)

    def run(
        self, x0: ArrayLike, callback: Callable[[SolverIteration], object] | None = None
    ) -> Result:
        """Search from x0 (N,) alone and return the result."""
        return finish(self.begin(x0, callback))

    def _search(self, run: SearchRun, start: Array) -> Steps[Result]:
        try:
            linear = yield from run.begin(start)
            outcome = yield from STRATEGIES[self.method](run, linear, self.good_enough)
            outcome = yield from run.best_of(outcome)
        except EvaluationLimit:
            outcome = yield from run.exhausted()
        except KeyboardInterrupt:
            outcome = run.interrupted()
        return run.result(outcome)


def least_squares(
    fun: Callable[..., ArrayLike],
    x0: ArrayLike,
    jac: Differences | Callable[..., ArrayLike] = "2-point",
    bounds: tuple[ArrayLike, ArrayLike] = (-inf, inf),
    method: str = "auto",
    *,
    ftol: float = 1e-15,
    xtol: float = 1e-10,
    gtol: float = 1e-10,
    x_scale: ArrayLike | Literal["jac"] | None = None,
    max_nfev: int | None = None,
    args: Sequence[Any] = (),
    kwargs: Mapping[str, Any] | None = None,
    callback: Callable[[SolverIteration], object] | None = None,
    max_iterations: int | Mapping[str, int] = MOST_ITERATIONS,
    gtol_absolute: float | None = None,
    jacobian_error: float | None = None,
    good_enough: float | None = None,
    matches: Callable[[Array], bool] | None = None,
    searches: Searches = BENDING,
) -> Result:
    """Minimise f(x) = 1/2 sum(fun(x)^2) within bounds, from x0 (N,).

    ``fun(x, *args, **kwargs)`` gives the residuals (M,), jac of the same arguments their
    derivatives (M, N); "2-point" and "3-point" take differences, inside the bounds, and count them
    in nfev. A trial that is not finite, or whose fun raises ArithmeticError, is rejected. fun is
    never called outside the bounds.

    ``method`` is a name of `exfit.util.strategies.STRATEGIES`, where each is explained.

    x_scale      what counts as one unit of each variable; None or "jac" takes it from the columns
                 of J. Use 1 for logarithms
    max_nfev     how often fun may be called, for differences too; the Jacobian at the end may take
                 N calls more
    callback     gets every SolverIteration; StopIteration ends the search with the best point
                 seen, as KeyboardInterrupt does wherever it is raised
    jacobian_error  of jac, as a share of its largest singular value: directions that J sees by
                 less are left alone. None: that of rounding, or of the differences taken here
    good_enough  root mean square of residuals that counts as a match (auto); None: convergence
    matches      whether residuals (M,) are so small that the search may end
    searches     the settings of gn, dgn and lm

    It stops when (GRADIENT) the projected gradient is below gtol times its norm at x0 and the full
    step promises less than ftol f(x) (the gradient alone hardly sees badly determined directions)
    or, with x_scale, f(x) is below gtol^2 f(x0); (FLOOR) an iteration neither promised nor brought
    ftol f(x); (STEP) the full step is below xtol; (KINK) no trial is better and the full step
    promises less than a thousandth of f(x), as at a minimum where the derivative jumps; (CREEPING)
    ten iterations, each with rejected trials, gained less than a millionth of f(x), and the full
    step promises less than a thousandth; (MATCH) the residuals match; (FLAT), with gtol_absolute,
    the gradient is below gtol times its norm at x0 plus gtol_absolute, whatever the full step
    promises; or after max_iterations, in each phase anew (a number, or one for each phase). Where
    the residuals depend no longer on a variable that they depended on at x0 that is no success
    (LOST), unless x_scale is given.

    Raises ValueError for bounds that cross, x0 outside them or residuals not finite there.
    """
    if not callable(jac) and jac not in RELATIVE_STEP:
        raise ValueError(f"jac: {jac!r} is neither callable nor one of {', '.join(RELATIVE_STEP)}")
    if max_nfev is not None and max_nfev < 1:
        raise ValueError(f"max_nfev: {max_nfev} is less than 1")
    more = kwargs or {}
    descent = Descent(
        functions=OneByOne(
            lambda x: fun(x, *args, **more),
            (lambda x: jac(x, *args, **more)) if callable(jac) else None,
        ),
        bounds=bounds,
        method=method,
        differences=None if callable(jac) else jac,
        most_evaluations=max_nfev,
        max_iterations=max_iterations,
        gtol=gtol,
        gtol_absolute=gtol_absolute,
        ftol=ftol,
        xtol=xtol,
        x_scale=None if isinstance(x_scale, str) and x_scale == "jac" else x_scale,
        jacobian_error=jacobian_error,
        good_enough=good_enough,
        matches=matches,
        searches=searches,
    )
    return descent.run(x0, callback)
