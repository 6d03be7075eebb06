"""Methods of related work beside least squares: records, what a method comes to, and its row.

A method is a function of records and starts, as many of each, that returns estimates. It may look
at a record, never at the truth. All runs are on the coarse grid of the search.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from coverage_cases import HARD_CASES, covariance_of, exact, noisy, truth_of
from linearised import autoregressive
from places import CONFIGS

from exfit.case.load import load_case
from exfit.estimate import Descent, Functions, spread
from exfit.estimate.solver import NotFinite
from exfit.fitting.further_starts import coarse_form, linear_form
from exfit.fitting.parameters import UNIT
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import LIKELIHOOD_RATIO, fitted

STARTS, DRAWS, SEED = 64, 200, 2026
LINEAR_ITERATIONS = 40  # those of the search's linear phase
HEADS = (
    "method", "record", "simulations", "cost", "highest", "reach the lowest", "bias", "largest",
    "spread", "largest",
)  # fmt: skip


class Estimate(NamedTuple):
    """Scaled parameters (N,), nan where a method failed, and how many simulations they took."""

    point: np.ndarray
    simulations: int


Method = Callable[[Sequence[Residuals], np.ndarray], list[Estimate]]


@dataclass(frozen=True, eq=False)
class Subject:
    """A record to fit, and the hard case whose truth and noise further records are drawn with."""

    name: str
    hard: str
    residuals: Residuals

    @cached_property
    def truth(self) -> np.ndarray:
        """The scaled parameters (N,) that records are drawn with."""
        return truth_of(self.hard, noisy(self.hard, np.random.default_rng(SEED))[2])

    @cached_property
    def exact(self) -> np.ndarray:
        """The response (M,) to the truth."""
        return samples(self.residuals) + self.residuals(self.truth)

    @cached_property
    def standard_errors(self) -> np.ndarray:
        """Those of least squares (N,), by linear theory with the true covariance of the noise."""
        slopes = self.residuals.exact(self.truth)
        channel = exact(self.hard)[1][0].experiment.channels[0]
        inverse = np.linalg.inv(slopes.T @ slopes)
        middle = covariance_of(self.hard, channel, slopes)
        return np.sqrt(np.diag(inverse @ middle @ inverse))

    def drawn(self, count: int) -> list[Residuals]:
        """Return the residuals of so many records, each with noise of its own."""
        rng, hard = np.random.default_rng(SEED), HARD_CASES[self.hard]
        noise = hard.noise["vt"] * autoregressive(rng, hard.phi, (count, len(self.exact)))
        return [with_samples(self.residuals, self.exact + own) for own in noise]


def subject(name: str) -> Subject:
    """Return ``ac1a_up``, the sample record, or a hard case with one record of its own."""
    if name == "ac1a_up":
        _, problem = fitted(load_case(CONFIGS / "ac1a_typical.yaml"))
        return Subject(name, "ac1a_kd", coarse_form(problem.residuals))
    problem = noisy(name, np.random.default_rng(SEED))[2]
    return Subject(name, name, coarse_form(problem.residuals))


def samples(residuals: Residuals) -> np.ndarray:
    """Return the record (M,) that residuals compare with."""
    return residuals.experiments[0].channels[0].measured


def with_samples(residuals: Residuals, measured: np.ndarray) -> Residuals:
    """Return residuals of the same test with another record (M,)."""
    (experiment,) = residuals.experiments
    (channel,) = experiment.channels
    changed = (replace(channel, measured=measured),)
    return replace(residuals, experiments=[replace(experiment, channels=changed)])


def errors_of(records: Sequence[Residuals], points: np.ndarray) -> np.ndarray:
    """Return the errors (K, M) of K records of one test, each at a point of its own, in one go."""
    measured = np.array([samples(record) for record in records])
    return np.array(records[0].residuals([*points])) + measured[0] - measured


def descent(
    functions: Functions, start: np.ndarray, bounds, method="lm-then-dgn", iterations=200
) -> Estimate:
    """Return where a descent ends; nan where there is no response at its start."""
    leg = Descent(
        functions=functions,
        bounds=bounds,
        method=method,
        max_iterations=iterations,
        ftol=1e-8,
        x_scale=UNIT,
    )
    try:
        end = leg.run(start)
    except NotFinite:
        return Estimate(np.full(len(start), np.nan), 1)
    return Estimate(end.x, end.nfev + end.njev)


def local(record: Residuals, start: np.ndarray) -> Estimate:
    """Return the descent on a record from a start."""
    return descent(record, start, record.bounds)


def matched(record: Residuals, start: np.ndarray) -> Estimate:
    """Return where the small-signal response of the model matches a record, from a start."""
    return descent(linear_form(record), start, record.bounds, "lm", LINEAR_ITERATIONS)


def each(estimate: Callable[[Residuals, np.ndarray], Estimate]) -> Method:
    """Return the method that takes one record after the other."""
    return lambda records, starts: [
        estimate(record, start) for record, start in zip(records, starts, strict=True)
    ]


def descended(records: Sequence[Residuals], begun: Sequence[Estimate]) -> list[Estimate]:
    """Return where descents from estimates end, with the simulations of both."""
    ends = []
    for record, first in zip(records, begun, strict=True):
        end = local(record, first.point) if np.isfinite(first.point).all() else first
        ends.append(end._replace(simulations=first.simulations + end.simulations))
    return ends


class Figures(NamedTuple):
    """What a method comes to: costs in those of the least one, errors in standard errors."""

    simulations: float
    costs: np.ndarray
    reached: int
    bias: np.ndarray
    spread: np.ndarray


def lowest_cost(of: Subject) -> float:
    """Return the least cost of the record: of descents from the truth and by the linear form."""
    start = of.residuals.start
    ends = [local(of.residuals, point) for point in (of.truth, start)]
    ends.append(local(of.residuals, matched(of.residuals, start).point))
    return float(np.nanmin(of.residuals.costs([end.point for end in ends])))


def figures(of: Subject, ends: Sequence[Estimate], of_draws: Sequence[Estimate]) -> Figures:
    """Return what estimates are worth: of the record from many starts, and of drawn records.

    A cost that the record does not tell from the least one has reached it. An estimate that failed
    counts as the start of the case.
    """
    points = np.array([end.point for end in ends])
    costs = of.residuals.costs(points) / lowest_cost(of)
    freedom = of.residuals.count - len(of.truth)
    found = np.array([end.point for end in of_draws])
    found = np.where(np.isfinite(found), found, of.residuals.start)
    errors = (found - of.truth) / of.standard_errors
    return Figures(
        simulations=float(np.median([end.simulations for end in ends])),
        costs=np.where(np.isfinite(costs), costs, np.inf),
        reached=int(np.sum(costs <= 1.0 + LIKELIHOOD_RATIO / freedom)),
        bias=np.mean(errors, axis=0),
        spread=np.std(errors, axis=0),
    )


def outcomes(
    of: Subject, methods: dict[str, Method], starts: int, draws: int, then_descent: bool
) -> Iterator[tuple[str, Figures]]:
    """Yield what each method comes to from starts within the bounds, and on drawn records.

    On these it begins at the start of the case. ``then_descent`` adds what descents from its
    estimates come to.
    """
    points = spread(of.residuals.bounds, starts, seed=SEED)
    records, drawn = [of.residuals] * starts, of.drawn(draws)
    begin = np.tile(of.residuals.start, (draws, 1))
    for title, method in methods.items():
        ends, of_draws = method(records, points), method(drawn, begin)
        yield title, figures(of, ends, of_draws)
        if then_descent:
            better = figures(of, descended(records, ends), descended(drawn, of_draws))
            yield f"{title}, then descent", better


def cells(own: Figures) -> Iterator[str]:
    """Yield the figures of a row."""
    yield f"{own.simulations:.0f}"
    yield f"{np.median(own.costs):.4g}"
    yield f"{np.max(own.costs):.4g}"
    yield f"{own.reached} of {len(own.costs)}"
    for errors in (np.abs(own.bias), own.spread):
        yield f"{np.median(errors):.2f}"
        yield f"{np.max(errors):.2f}"


class Scope(NamedTuple):
    """How much of a study is asked for."""

    starts: int
    draws: int
    records: tuple[str, ...]


def asked() -> Scope:
    """Return what the arguments STARTS, DRAWS and records ask for."""
    counts = [int(text) for text in sys.argv[1:3]]
    names = (*sys.argv[3:],) or ("ac1a_up", "coloured")
    return Scope(*counts, *(STARTS, DRAWS)[len(counts) :], names)


def show_heads() -> None:
    """Print the heads of the table."""
    print("| " + " | ".join(HEADS) + " |\n" + "|---" * len(HEADS) + "|")


def show_rows(
    of: Subject, methods: dict[str, Method], scope: Scope, then_descent: bool = False
) -> None:
    """Print a row for each method, and one of the descents from its estimates."""
    for title, own in outcomes(of, methods, scope.starts, scope.draws, then_descent):
        print("| " + " | ".join((title, of.name, *cells(own))) + " |", flush=True)


def show(methods: dict[str, Method], then_descent: bool = False) -> None:
    """Print the table of some methods as the arguments ask for it."""
    scope = asked()
    show_heads()
    for name in scope.records:
        show_rows(subject(name), methods, scope, then_descent)
