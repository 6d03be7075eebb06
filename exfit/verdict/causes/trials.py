"""One thing more left open, by a fit or in the linear model: what would match the record."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from exfit import estimate
from exfit.errors import SimulationError
from exfit.fitting.compression import compressed
from exfit.fitting.descents import short_descent
from exfit.fitting.experiment import Experiment
from exfit.fitting.nuisances import Nuisance
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.results.cause import Cause
from exfit.util.arrays import Array, Mask
from exfit.verdict.causes.evidence import Evidence, Suspicion, Trial, suspected

MOST_ITERATIONS = 25  # of each phase: to compare causes, not to print digits
AT_NOISE = 1.2  # times the cost of the noise: a descent that ends so low needs no other
TOLERANCE = 1e-3  # of a step and of the gradient, in the units of the search
DEPENDENT = 1e-9  # of the longest column: a column that is shorter without the others is none


class Opened(NamedTuple):
    """Something about a record that a trial leaves open: where it starts, and how far it may go."""

    nuisance: Nuisance
    start: float
    low: float
    high: float

    @classmethod
    def around(cls, nuisance: Nuisance, start: float, farthest: float) -> "Opened":
        """Leave open what may be so far off."""
        return cls(nuisance, start, start - farthest, start + farthest)

    @classmethod
    def within(cls, nuisance: Nuisance, start: float, factor: float) -> "Opened":
        """Leave open what may be wrong by a factor."""
        return cls(nuisance, start, *sorted((start / factor, start * factor)))


def with_experiment(residuals: Residuals, number: int, experiment: Experiment) -> Residuals:
    """Return residuals with another experiment in one place."""
    experiments = [*residuals.experiments]
    experiments[number] = experiment
    return replace(residuals, experiments=experiments, counter=None)


def with_opened(residuals: Residuals, number: int, opened: Sequence[Opened]) -> Residuals:
    """Return residuals that leave more open about the record of one experiment.

    What is found of it already is found between these bounds instead.
    """
    experiment = residuals.experiments[number]
    places = {replace(each.nuisance, name="") for each in opened}
    again = {own.name for own in experiment.nuisances if replace(own, name="") in places}
    kept = (own for own in experiment.nuisances if own.name not in again)
    nuisances = (*kept, *(each.nuisance for each in opened))
    free = [
        FreeParameter(each.nuisance.name, each.start, each.low, each.high, logarithmic=False)
        for each in opened
    ]
    changed = with_experiment(residuals, number, replace(experiment, nuisances=nuisances))
    return replace(changed, free=[*(f for f in residuals.free if f.name not in again), *free])


def refitted(evidence: Evidence, residuals: Residuals) -> Trial | None:
    """Return the better end of two descents, from the case's start and from the solution.

    None where neither has a response. Raises KeyboardInterrupt at an interruption, OutOfTime when
    the time for causes is over.
    """
    own = {
        free.name: x for free, x in zip(evidence.residuals.free, evidence.solution.x, strict=True)
    }
    whole, residuals = residuals, compressed(residuals)
    start, (low, high) = residuals.start, residuals.bounds
    solution = np.array(
        [own.get(free.name, x) for free, x in zip(residuals.free, start, strict=True)]
    )
    ends = list[estimate.Result]()

    def watch(line: estimate.SolverIteration) -> None:
        evidence.pace.goes_on(line.cost)

    for point in (start, np.clip(solution, low, high)):
        if ends and ends[0].cost <= AT_NOISE * evidence.noise_cost:
            break
        evidence.pace.goes_on()
        end = short_descent(residuals, point, MOST_ITERATIONS, watch, TOLERANCE)
        if end is not None and end.stop is estimate.Stop.INTERRUPTED:
            raise KeyboardInterrupt
        if end is not None and np.isfinite(end.cost):
            ends.append(end)
    if not ends:
        return None
    best = min(ends, key=lambda end: end.cost)
    return Trial(best.cost, residuals.values(best.x), whole, best.x)


def tried(
    evidence: Evidence, residuals: Residuals, cause: Cause, numbers: int = 0
) -> Iterator[Suspicion]:
    """Suspect a cause, if the record is matched better by other residuals."""
    if trial := refitted(evidence, residuals):
        yield from suspected(evidence, trial, numbers, cause)


class Explained(NamedTuple):
    """Cost that remains when columns are added to a linear model, and their coefficients."""

    cost: float
    coefficients: Array


class LinearFit(NamedTuple):
    """The weighted errors (M,) of a fit, and an orthonormal basis (M, K) of what it can move."""

    errors: Array
    basis: Array

    def beyond(self, columns: Array) -> Array:
        """Part of columns (M, ...) that is out of reach of the parameters."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns), dtype=np.float64)

    def with_columns(self, columns: Array) -> Explained:
        """Fit columns (M, C) too, beside the parameters."""
        own, errors = self.beyond(columns), self.beyond(self.errors)
        coefficients, *_ = np.linalg.lstsq(own, errors, rcond=DEPENDENT)
        left = errors - own @ coefficients
        return Explained(0.5 * float(left @ left), np.asarray(-coefficients, dtype=np.float64))


def linear_fit(evidence: Evidence) -> LinearFit | None:
    """Return the linear model at the solution off its bounds, None without finite derivatives."""
    try:
        errors, slopes = evidence.residuals.errors(evidence.solution.x)
    except SimulationError:
        return None
    if not np.isfinite(slopes).all():
        return None
    return linear_model(errors, slopes[:, moving(evidence)])


def moving(evidence: Evidence) -> Mask:
    """Mask of the free parameters that are not on a bound."""
    low, high = evidence.residuals.bounds
    return (evidence.solution.x > low) & (evidence.solution.x < high)


def linear_model(errors: Array, slopes: Array) -> LinearFit:
    """Return the linear model of errors (M,) by their derivatives (M, N)."""
    basis, triangle = np.linalg.qr(slopes)
    sizes = np.abs(np.diag(triangle))
    return LinearFit(errors, basis[:, sizes > DEPENDENT * np.max(sizes, initial=0.0)])
