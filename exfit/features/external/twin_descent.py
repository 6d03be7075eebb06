"""A descent whose residuals another program gives, and its twin their derivatives.

Where two steps with these fail in a row, or program and twin differ visibly at the end, difference
quotients of the program's runs, side by side, show by how much they are wrong; all later
derivatives of the twin are corrected by that.

Source: the correction is that of manifold mapping, Echeverria & Hemker 2005.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.estimate import half_square
from exfit.features.external.responders import QUOTIENT_STEP
from exfit.fitting.descents import Announce, following
from exfit.fitting.residuals import Residuals

Array = NDArray[np.float64]

FAILED_STEPS = 2  # in a row, after which the derivatives of the twin are doubted
VISIBLE_GAIN = 1e-3  # of the cost: what a step must promise to be missed
DISTINCT = 0.3  # of the residuals: by how much program and twin may differ
NEGLIGIBLE_DIFFERENCE = 1e-4  # of what the record moves
MOST_CORRECTIONS = 5


class TwinDoubtedError(Exception):
    """Steps by the derivatives of the twin failed, though they promised a visible gain."""


class ProgramFunctions:
    """Residuals of the program, with the derivatives of its twin and their correction.

    Raises TwinDoubtedError after FAILED_STEPS finite trials in a row that promised a gain and had
    none, once at each best point. ``quotients`` counts the corrections.
    """

    def __init__(self, residuals: Residuals) -> None:
        self.residuals_of = residuals
        self.quotients = 0
        self.best = residuals.start
        self._correction: Array | None = None
        self._linear: tuple[Array, Array, Array] | None = None  # where, residuals, Jacobian
        self._lowest, self._corrected_cost, self._failed = inf, inf, 0

    @property
    def is_corrected(self) -> bool:
        """Whether the correction was taken at the best point, or at one that is hardly worse."""
        return self._lowest > (1.0 - VISIBLE_GAIN) * self._corrected_cost

    def residuals(self, theta: Array) -> Array:
        """Return the residuals (M,) at a point (N,), infinite where the run failed."""
        residuals = self.residuals_of(theta)
        cost = half_square(residuals)
        if cost < self._lowest:
            self.best, self._lowest, self._failed = theta.copy(), cost, 0
        elif np.isfinite(cost) and self._promise(theta) > VISIBLE_GAIN:
            self._failed += 1
            if self._failed >= FAILED_STEPS and not self.is_corrected:
                raise TwinDoubtedError
        return residuals

    def _promise(self, theta: Array) -> float:
        """Share of the cost by which a step to a point (N,) lowers the linear model's."""
        if self._linear is None:
            return 0.0
        here, residuals, jacobian = self._linear
        cost = half_square(residuals)
        step = residuals + jacobian @ (theta - here)
        return (cost - half_square(step)) / cost if cost > 0.0 else 0.0

    def jacobian(self, theta: Array) -> Array:
        """Return the Jacobian (M, N) of the twin, corrected."""
        exact = self.residuals_of.exact(theta)
        jacobian = exact if self._correction is None else exact + self._correction
        self._linear = theta.copy(), self.residuals_of(theta), jacobian
        return jacobian

    def correct(self) -> None:
        """Take the correction from quotients at the best point; a run that failed gives none."""
        best, (low, high) = self.best, self.residuals_of.bounds
        aims = np.where(best + QUOTIENT_STEP <= high, best + QUOTIENT_STEP, best - QUOTIENT_STEP)
        ends = np.maximum(aims, low)
        points = [np.where(np.arange(len(best)) == k, ends, best) for k in range(len(best))]
        here, *others = self.residuals_of.of_many([best, *points])
        exact = self.residuals_of.exact(best)
        self._correction = np.zeros_like(exact)
        for k, (step, residuals) in enumerate(zip(ends - best, others, strict=True)):
            if step and np.isfinite(residuals).all():
                self._correction[:, k] = (residuals - here) / step - exact[:, k]
        self._corrected_cost, self._failed = self._lowest, 0
        self.quotients += 1

    def is_final(self, end: estimate.Result) -> bool:
        """Tell whether an end needs no correction: it has one, or program and twin agree."""
        if end.stop is estimate.Stop.INTERRUPTED or self.quotients >= MOST_CORRECTIONS:
            return True
        return self.is_corrected or not self.is_distinct()

    def is_distinct(self) -> bool:
        """Tell whether program and twin differ visibly at the best point.

        Only then the derivatives of the twin can lead to another end than those of the program.
        """
        channels, count = self.residuals_of.channels, self.residuals_of.count
        own = self.residuals_of(self.best)[:count]
        twin = twin_of(self.residuals_of)(self.best)[:count]
        moves = [channel.weight * (channel.record - channel.record[0]) for channel in channels]
        least = max(DISTINCT * _rms(own), NEGLIGIBLE_DIFFERENCE * _rms(np.concatenate(moves)))
        return _rms(own - twin) > least


def _interrupt(_: estimate.SolverIteration) -> None:
    """End a search at its start, as an interruption does."""
    raise KeyboardInterrupt


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def twin_of(residuals: Residuals) -> Residuals:
    """Return the residuals of the twin alone."""
    experiments = [
        replace(experiment, simulator=experiment.simulator.with_responder(None))
        for experiment in residuals.experiments
    ]
    return replace(residuals, experiments=experiments, counter=None)


def descent_by_twin(
    residuals: Residuals,
    descent: Callable[[estimate.Functions], estimate.Descent],
    announce: Announce,
) -> estimate.Result:
    """Return the end of a descent from the start by the derivatives of the twin, corrected."""
    functions, start = ProgramFunctions(residuals), residuals.start
    lines: list[estimate.SolverIteration] = []

    def run(start: Array, watch: Announce) -> estimate.Result:
        before = lines[-1] if lines else None

        def join(line: estimate.SolverIteration) -> None:
            lines.append(following(before, line) if before else line)
            watch(lines[-1])

        search = descent(estimate.OneByOne(functions.residuals, functions.jacobian))
        end = search.run(start, join)
        nfev, njev = (before.nfev, before.njev) if before else (0, 0)
        return replace(end, history=tuple(lines), nfev=nfev + end.nfev, njev=njev + end.njev)

    while True:
        with suppress(TwinDoubtedError):
            end = run(start, announce)
            if functions.is_final(end):
                return end
        try:
            functions.correct()
        except KeyboardInterrupt:
            return run(functions.best, _interrupt)
        start = functions.best
