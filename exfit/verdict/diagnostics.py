"""What a reader of a fit must know beside its numbers."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.bounds import bounds_of
from exfit.case.case import Case
from exfit.case.schema import BumpTest, ReferenceTable
from exfit.dsp.jumps import scatter
from exfit.fitting.experiment import Channel
from exfit.fitting.global_search import AT_TOLERANCE
from exfit.fitting.recorded.references import is_table
from exfit.fitting.residuals import Residuals
from exfit.fitting.setup import ExperimentSetup
from exfit.inference.wording import listed
from exfit.models.blocks import SHORTEST
from exfit.plants import BREAKER, GOVERNOR, NETWORK, REFERENCES, SPEED, acts_without_load
from exfit.results.comparisons import Comparison
from exfit.results.intervals.typical_values import typical_values_used
from exfit.simulation.inputs import Inputs
from exfit.simulation.limit_hits import limiter_actions
from exfit.simulation.simulator import Response, Simulator
from exfit.verdict.causes.rest import INVISIBLE, other_levels, unsteady_signals
from exfit.verdict.causes.run_quality import (
    LARGEST_STEP_ERROR,
    step_error_notes,
    switching_notes,
    unstable_rest_notes,
    voltage_notes,
)

Array = NDArray[np.float64]

COARSE = 0.2  # of the error of the fit: what halving the step may move
GOVERNOR_ACTS = 0.2  # s after a load rejection: until then the mechanical power stays
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
    """Yield how far from a minimum a search ended that a tolerance of the case ended."""
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
    """Yield how well a recorded reference is known: the size of the test is as uncertain."""
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
    """Return how far (standard errors) a search that a tolerance ended may lie from a minimum.

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
    """Yield how many samples of each channel of a record were taken for outliers."""
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
    """Yield which free parameters are held, and which the bounds let leave their data sheets."""
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


def unphysical_notes(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    """Yield the values that lie outside the range of their data sheet."""
    for name, row in case.rows().items():
        if not row.is_physical(values[name]):
            text = f"{name} = {values[name]:.4g} is not physical"
            yield f"{text}: its data sheet's range is {row.physical_range}"


def typical_notes(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    """Yield which of the values that act are typical: marked as such, or left out of the case."""
    used = typical_values_used(case)
    typical = {name: value for name, value in used.items() if values[name] == value}
    for part in case.parts.all:
        names = [symbol for symbol in part.symbols if part.prefix + symbol in typical]
        if names and part.kind != "network":
            listed = ", ".join(f"{symbol} {typical[part.prefix + symbol]:g}" for symbol in names)
            yield f"typical values taken for {part.name}: {listed}"
    for name in idle_models(case):
        yield f"{name} does not act: the breaker is open"


def diagram_notes(case: Case) -> Iterator[str]:
    """Yield what is not settled about the diagrams of the models of a case."""
    parts = case.parts
    limiters = (limiter.model for limiter in parts.limiters)
    for model in (parts.exciter, parts.stabiliser, parts.governor, *limiters):
        if model is not None and model.doubt:
            yield f"{model.name} {model.doubt}"


def idle_models(case: Case) -> list[str]:
    """Return the models of a case that do nothing without load, where no test has one."""
    if case.on_load or case.kind.plays_back:
        return []
    added = [case.parts.stabiliser, case.parts.governor]
    added += [at.model for at in case.parts.limiters if not acts_without_load(at)]
    return [model.name for model in added if model is not None]


def speed_notes(inputs: Inputs, parameters: Mapping[str, float]) -> Iterator[str]:
    """Yield how long a simulated speed holds for which a breaker has opened under power."""
    opened = [step.at for step in inputs.steps if step.signal == BREAKER]
    power = parameters.get(f"{NETWORK}P", 0.0)
    governed = any(name.startswith(GOVERNOR) for name in parameters)
    if not opened or power == 0.0 or SPEED in inputs.recorded or governed:
        return
    until = opened[0] + GOVERNOR_ACTS
    if inputs.end > until:
        yield (
            f"from {opened[0]:.6g} s on the speed, and vt with it, is that of constant mechanical "
            f"power, {power:g} pu, which holds for some {GOVERNOR_ACTS:g} s: record the speed, or "
            f"end the window at {until:.4g} s"
        )


def simulation_notes(
    case: Case, simulator: Simulator, values: Mapping[str, float], response: Response
) -> Iterator[str]:
    """Yield what a reader of a simulated response must know: its values, and whether it holds.

    ``values`` are those of the case, and of what the test has of its own.
    """
    yield from typical_notes(case, values)
    yield from unphysical_notes(case, values)
    yield from speed_notes(simulator.inputs, values)
    yield from (action.sentence for action in limiter_actions(simulator, values))
    yield from unstable_rest_notes(simulator, values)
    yield from step_error_notes(case, simulator, values, response.signals)
    yield from voltage_notes(case, response.time, response.signals.get("vt"))
    delta = response.signals.get("delta")
    if delta is not None and np.max(np.abs(delta)) > np.pi:
        at = float(response.time[np.argmax(np.abs(delta) > np.pi)])
        yield f"the machine falls out of step at {at:.3g} s: delta passes half a turn"


def rest_notes(setup: ExperimentSetup, comparison: Comparison) -> Iterator[str]:
    """Yield where the steady part of a record contradicts the case, and what is left out of it."""
    yield from switching_notes(setup)
    test = setup.test
    if test.steady is not None and test.begin is None:
        causes = unsteady_signals(setup.record, test.steady, setup.channels)
        yield from (cause.sentence for cause in causes)
        yield from (cause.sentence for cause in other_levels(comparison, test.steady))
