"""Instants of steps that a fit finds: between which samples they lie, and what decides it.

A signal that jumps with a step shows only which sample comes before it and which behind. The cost
then has minima of its own between each two samples, beside either, which no descent leaves.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.estimate.lockstep import finish_all
from exfit.fitting.experiment import Experiment
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import SideBySide
from exfit.results.intervals.profile_hull import FoundMinimum
from exfit.signals import SIGNALS

Array = NDArray[np.float64]

INTERVALS = 3  # between samples on either side, in which an instant is tried
BESIDE_SAMPLE = 0.5  # steps of the simulation: where descents begin, as a jump takes one step
MOST_ITERATIONS = 30  # of a descent there: it begins next to its end
DECIDING = 0.8  # of what the record shows of an instant: samples that show so much decide it
MOST_DECIDING = 2  # samples


class FreeInstant(NamedTuple):
    """An instant of a step, by its place among the free parameters, in a test with a jump."""

    place: int
    name: str
    test: int
    experiment: Experiment

    @property
    def samples(self) -> Array:
        """The instants of the samples (M,) that are compared in a channel that jumps, in s."""
        channels = [c for c in self.experiment.channels if SIGNALS[c.signal].jumps]
        times: Array = self.experiment.simulator.times[np.any([c.kept for c in channels], axis=0)]
        return times


def free_instants(problem: FitProblem) -> Iterator[FreeInstant]:
    """Yield the instants that are free where a channel jumps with the step."""
    places = {parameter.name: k for k, parameter in enumerate(problem.residuals.free)}
    for test, experiment in enumerate(problem.residuals.experiments):
        if any(SIGNALS[signal].jumps for signal in experiment.signals):
            for nuisance in experiment.nuisances:
                if nuisance.kind == "at" and nuisance.name in places:
                    yield FreeInstant(places[nuisance.name], nuisance.name, test, experiment)


def minima_between_samples(problem: FitProblem, x: Array) -> list[FoundMinimum]:
    """Return the minima (N,) near a solution x (N,), two of each interval between samples."""
    functions, (low, high) = SideBySide(problem.compressed), problem.compressed.bounds
    descents = []
    for instant in free_instants(problem):
        parameter, k = problem.residuals.free[instant.place], instant.place
        for first, last in intervals_near(instant.samples, parameter.value(float(x[k]))):
            within_low, within_high = low.copy(), high.copy()
            within_low[k] = max(low[k], parameter.scaled(first))
            within_high[k] = min(high[k], parameter.scaled(last))
            if within_low[k] >= within_high[k]:
                continue
            descent = estimate.Descent(
                functions=functions,
                bounds=(within_low, within_high),
                method="lm-then-dgn",
                max_iterations=MOST_ITERATIONS,
                x_scale=problem.residuals.units,
            )
            beside = BESIDE_SAMPLE * instant.experiment.simulator.step
            for value in (first + beside, last - beside):
                start = x.copy()
                start[k] = np.clip(parameter.scaled(value), within_low[k], within_high[k])
                descents.append(descent.begin(start))
    minima: dict[int, FoundMinimum] = {}
    finish_all(descents, None, lambda k, end: minima.update({k: FoundMinimum(end.x, end.cost)}))
    return [minima[k] for k in sorted(minima)]


def intervals_near(samples: Array, instant: float) -> Iterator[tuple[float, float]]:
    """Yield the intervals between samples (M,) about an instant, its own among them."""
    own = int(np.searchsorted(samples, instant, side="right")) - 1
    for k in range(own - INTERVALS, own + INTERVALS + 1):
        if 0 <= k < len(samples) - 1:
            gap = samples[k + 1] - samples[k]
            # a sample at the very instant counts as before or behind the step by rounding alone
            yield float(samples[k] + 1e-3 * gap), float(samples[k + 1] - 1e-3 * gap)


def decided_by_few_samples(problem: FitProblem, x: Array) -> dict[str, str]:
    """Name instants that one or two samples decide, each with the reason for no interval."""
    instants = [*free_instants(problem)]
    if not instants:
        return {}
    residuals = problem.residuals
    slopes = residuals.errors(x)[1]
    reasons = {}
    for instant in instants:
        others = np.delete(slopes, instant.place, axis=1)
        own = slopes[:, instant.place]
        shown = (own - others @ np.linalg.lstsq(others, own)[0]) ** 2
        largest = np.argsort(shown)[::-1][:MOST_DECIDING]
        shares = np.cumsum(shown[largest]) / max(float(np.sum(shown)), np.finfo(float).tiny)
        count = int(np.searchsorted(shares, DECIDING)) + 1
        if count <= MOST_DECIDING:
            parameter = residuals.free[instant.place]
            value = parameter.value(float(x[instant.place]))
            k = int(np.searchsorted(instant.samples, value, side="right"))
            around = instant.samples[max(k - 1, 0) : k + 1]
            samples = "one sample decides" if count == 1 else "two samples decide"
            between = " and ".join(f"{at:.6g}" for at in around)
            reasons[instant.name] = f"has no interval: {samples} it, between those at {between} s"
    return reasons
