"""The methods by name: one search alone, or several one after the other."""

from collections.abc import Callable
from math import sqrt

from exfit.estimate.answer import Stop
from exfit.estimate.gauss_newton import FullStep
from exfit.estimate.linear import LinearModel
from exfit.estimate.requests import Steps
from exfit.estimate.run import Outcome, SearchRun
from exfit.estimate.search import Search
from exfit.estimate.searches import Searches

Strategy = Callable[[SearchRun, LinearModel, float | None], Steps[Outcome]]


def alone(search: Callable[[Searches], Search]) -> Strategy:
    """Return the strategy that is one method from start to end."""
    return lambda run, start, _: run.descend(search(run.searches), start)


def lm_then_dgn(run: SearchRun, start: LinearModel, _: float | None) -> Steps[Outcome]:
    """Let lm find the valley and dgn follow it; where a kink stops that, lm goes on."""
    lm, dgn = run.searches.lm, run.searches.dgn
    outcome = yield from relay(run, start, lm.handing_over(), dgn)
    if outcome.stop is not Stop.STALLED:
        return outcome
    return (yield from run.descend(lm, outcome.linear))


def robust(run: SearchRun, start: LinearModel, _: float | None) -> Steps[Outcome]:
    """Go on with lm where gn quits."""
    return relay(run, start, FullStep(), run.searches.lm)


def relay(run: SearchRun, start: LinearModel, first: Search, second: Search) -> Steps[Outcome]:
    """Go on with the second search where the first ends short of a minimum."""
    outcome = yield from run.descend(first, start)
    if outcome.converged or outcome.stop is Stop.JACOBIAN:
        return outcome
    return (yield from run.descend(second, outcome.linear))


def auto(run: SearchRun, start: LinearModel, good_enough: float | None) -> Steps[Outcome]:
    """Try dgn; where that is not good enough, lm and dgn from the same start."""
    first = yield from run.descend(run.searches.dgn, start)
    if matches(first, good_enough):
        return first
    second = yield from lm_then_dgn(run, start, good_enough)
    return second if second.linear.point.cost <= first.linear.point.cost else first


def matches(outcome: Outcome, good_enough: float | None) -> bool:
    """Return whether the residuals are small enough; without a limit, whether it converged."""
    if good_enough is None:
        return outcome.converged
    point = outcome.linear.point
    return sqrt(2.0 * point.cost / len(point.residuals)) <= good_enough


STRATEGIES: dict[str, Strategy] = {
    "gn": alone(lambda searches: searches.gn),
    "dgn": alone(lambda searches: searches.dgn),
    "lm": alone(lambda searches: searches.lm),
    "lm-then-dgn": lm_then_dgn,
    "auto": auto,
    "robust": robust,
}
