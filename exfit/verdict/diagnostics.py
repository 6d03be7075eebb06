"""What a reader of a fit must know beside its numbers."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.case import Case
from exfit.case.parts import bounds_of
from exfit.case.schema import BumpTest, ReferenceTable
from exfit.dsp.jumps import scatter
from exfit.fitting.experiment import Channel, ExperimentSetup
from exfit.fitting.global_search import AT_TOLERANCE
from exfit.fitting.recorded_steps import is_table
from exfit.fitting.residuals import Residuals
from exfit.models.blocks import SHORTEST
from exfit.plants import REFERENCES
from exfit.results.comparisons import Comparison
from exfit.util.text import listed
from exfit.verdict.run_quality import (
    INVISIBLE,
    LARGEST_STEP_ERROR,
    typical_notes,
    unphysical_notes,
    unstable_rest_notes,
    voltage_notes,
)

Array = NDArray[np.float64]

COARSE = 0.2  # of the error of the fit: what halving the step may move
NEAR_MINIMUM = 0.1  # standard errors: what errors and intervals in two digits do not show


def notes(
    case: Case, residuals: Residuals, solution: estimate.Result, compared: Sequence[Comparison]
) -> Iterator[str]:
    """Yield the notes on what a fit found; ``compared`` has sub-steps enough for its response."""
    values = residuals.values(solution.x)
    yield from typical_notes(case, values)
    yield from search_range_notes(case)
    yield from unphysical_notes(case, values)
    for experiment, comparison in zip(residuals.experiments, compared, strict=True):
        simulator, at = experiment.with_inputs(values), experiment.parameters(values)
        yield from unstable_rest_notes(simulator, at)
        vt = comparison.overlays.get("vt")
        yield from voltage_notes(case, comparison.time, None if vt is None else vt.simulated)
        for signal, change in simulator.step_errors(at, experiment.signals).items():
            error = comparison.overlays[signal].error
            rmse = float(np.sqrt(np.nanmean(error**2)))
            if change > min(max(COARSE * rmse, INVISIBLE), LARGEST_STEP_ERROR):
                yield (
                    f"halving the step of {case.simulation.step:g} s moves {signal} by "
                    f"{change:.1e} pu, its error is {rmse:.1e} pu: reduce simulation.step"
                )
        used = simulator.substeps(at)
        if comparison.substeps > 2 * used:
            step = case.simulation.step * used / comparison.substeps
            yield (
                f"the response needs {comparison.substeps} sub-steps along its way, {used} were "
                f"taken: set simulation.step to {step:.2g}"
            )


def tolerance_notes(residuals: Residuals, solution: estimate.Result) -> Iterator[str]:
    """Note the distance from a minimum of a search that a tolerance of the case ended."""
    if solution.stop not in AT_TOLERANCE:
        return
    ended = "the search ended at a tolerance of the case, not at a minimum"
    distance = distance_from_minimum(residuals, solution)
    if distance <= NEAR_MINIMUM:
        yield f"{ended}, but within {NEAR_MINIMUM:g} standard errors of it"
    else:
        yield (
            f"{ended}: parameters may be {distance:.2g} standard errors away from it, "
            "and the errors and intervals assume that they are there"
        )


def reference_notes(test: BumpTest, setup: ExperimentSetup) -> Iterator[str]:
    """Note the noise of a recorded reference: the size of the test is as uncertain."""
    for signal in REFERENCES:
        record = setup.references.get(signal, setup.record)
        given = test.reference(signal)
        if isinstance(given, tuple | ReferenceTable) or is_table(record):
            continue
        samples = record.signals[signal]
        at_rest = np.count_nonzero(record.time < (setup.test.steady or np.inf))
        error = scatter(samples) / np.sqrt(at_rest)
        if error > 0.0:
            share = 100.0 * error / np.ptp(samples)
            yield (
                f"{signal} was recorded with noise of {scatter(samples):.1e} pu: its mean at rest "
                f"leaves the size of its change uncertain by {share:.1g} %, and the intervals do "
                "not include that error"
            )


def distance_from_minimum(residuals: Residuals, solution: estimate.Result) -> float:
    """Estimate the distance (standard errors) of an ended search from a minimum.

    No parameter lies farther from the minimum of the linear model than z of its standard errors,
    where z^2 is twice the decrease that the model promises, in variances of the residuals. It is 0
    for a search that ended by itself.
    """
    if solution.stop not in AT_TOLERANCE:
        return 0.0
    freedom = max(1, residuals.samples - len(solution.x))
    variance = max(2.0 * solution.cost / freedom, np.finfo(float).tiny)
    return float(np.sqrt(2.0 * max(solution.promise, 0.0) / variance))


def outlier_notes(name: str, channels: Sequence[Channel]) -> Iterator[str]:
    """Note the count of samples of each channel of a record that were taken for outliers."""
    for channel in channels:
        measured = np.isfinite(channel.measured)
        beyond = int(np.count_nonzero(measured & ~channel.kept))
        if beyond:
            samples = np.count_nonzero(measured)
            verb = "is" if beyond == 1 else "are"
            yield (
                f"{beyond} of {samples} samples of {channel.signal} of {name} {verb} left out as "
                "outliers"
            )


def search_range_notes(case: Case) -> Iterator[str]:
    """Note free parameters that are held, and those whose bounds leave their data sheets."""
    for name in case.held():
        yield (
            f"{name} = 0: its lag or lead is bypassed, so that {name} is held at 0 and not fitted; "
            f"to fit it, start from at least {SHORTEST:g} s"
        )
    rows = case.rows()
    beyond = [
        name
        for name, free in case.free().items()
        if name in rows and not all(map(rows[name].is_physical, bounds_of(free, rows[name])))
    ]
    if beyond:
        yield (
            f"{listed(beyond)} may leave the range of the data sheet, where values are not "
            "physical: there is no bound, or one beyond it"
        )


def diagram_notes(case: Case) -> Iterator[str]:
    """Note open questions about the diagrams of the models of a case."""
    parts = case.parts
    limiters = (limiter.model for limiter in parts.limiters)
    for model in (parts.exciter, parts.stabiliser, parts.governor, *limiters):
        if model is not None and model.doubt:
            yield f"{model.name} {model.doubt}"
