"""What a reader of a fit must know beside its numbers, and what is wrong before it."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import inf, sqrt

import numpy as np

from exfit import estimate
from exfit.case.case import Case
from exfit.case.parts import bounds_of
from exfit.case.schema import BumpTest, Recording, ReferenceTable, start_value
from exfit.dsp.jumps import scatter
from exfit.dsp.quality import noise_of
from exfit.dsp.sampling import present_samples
from exfit.fitting.experiment import Channel, ExperimentSetup
from exfit.fitting.nuisances import prefix_from
from exfit.fitting.residuals import Residuals
from exfit.models.blocks import SHORTEST
from exfit.models.machines.machine import unusual_reactances
from exfit.plants import MACHINE, REFERENCES
from exfit.registry import parts
from exfit.results.cause import Cause
from exfit.results.compare_with_record import overlays_of
from exfit.results.comparisons import Comparison, Overlay
from exfit.signals import POSITIVE_AT_REST
from exfit.util.arrays import Array, Mask
from exfit.util.text import listed, show
from exfit.verdict.run_quality import (
    FAR_FROM_BASE,
    INVISIBLE,
    LARGEST_STEP_ERROR,
    other_levels,
    state_of_rest_notes,
    step_remedy,
    typical_notes,
    unphysical_notes,
    unsteady_signals,
    voltage_notes,
)

Values = Mapping[str, float]

COARSE = 0.2  # of the error of the fit: what halving the step may move
NEAR_MINIMUM = 0.1  # standard errors: what errors and intervals in two digits do not show
CERTAIN = 8.0  # standard errors of a mean at rest: its sign is certain
AGAINST = -0.5  # of the product of both sizes: moves that go against each other, as a whole
FAR_FROM_FREE_MACHINE = 0.25  # of a level at rest: what data of the machine may still explain


def notes(
    case: Case, residuals: Residuals, solution: estimate.Result, compared: Sequence[Comparison]
) -> Iterator[str]:
    """Yield the notes on what a fit found; ``compared`` has sub-steps enough for its response."""
    values = residuals.values(solution.x)
    yield from typical_notes(case, values)
    yield from search_range_notes(case)
    yield from unphysical_notes(case, values)
    for experiment, comparison in zip(residuals.experiments, compared, strict=True):
        simulator, at = experiment.at(values)
        yield from state_of_rest_notes(simulator, at)
        vt = comparison.overlays.get("vt")
        yield from voltage_notes(case, comparison.time, None if vt is None else vt.simulated)
        for signal, change in simulator.step_errors(at, experiment.signals).items():
            rmse = comparison.overlays[signal].rmse
            if change > min(max(COARSE * rmse, INVISIBLE), LARGEST_STEP_ERROR):
                yield (
                    f"halving the step of {simulator.step:g} s changes {signal} by "
                    f"{change:.1e} pu, its error is {rmse:.1e} pu: {step_remedy(simulator)}"
                )
        used = simulator.substeps(at)
        if comparison.substeps > 2 * used:
            step = simulator.step * used / comparison.substeps
            yield (
                f"the response needs {comparison.substeps} sub-steps, {used} were taken: "
                f"set simulation.step to {step:.2g}"
            )


def tolerance_notes(residuals: Residuals, solution: estimate.Result) -> Iterator[str]:
    """Note the distance from a minimum of a search that a tolerance of the case ended."""
    if solution.stop not in estimate.AT_TOLERANCE:
        return
    ended = "the search ended at a tolerance of the case, not at a minimum"
    distance = distance_from_minimum(residuals, solution)
    if distance <= NEAR_MINIMUM:
        yield f"{ended}, but within {NEAR_MINIMUM:g} standard errors of it"
    else:
        yield (
            f"{ended}: parameters may be {distance:.2g} standard errors away from it, "
            "which errors and intervals do not include"
        )


def reference_notes(test: BumpTest, setup: ExperimentSetup) -> Iterator[str]:
    """Note the noise of a recorded reference: the size of the test is as uncertain."""
    for signal in REFERENCES:
        record = setup.references.get(signal, setup.record)
        given = test.reference(signal)
        if isinstance(given, tuple | ReferenceTable):
            continue
        from exfit.fitting.recorded_steps import is_table

        if is_table(record):
            continue
        samples = record.signals[signal]
        at_rest = np.count_nonzero(record.time < (setup.test.steady or np.inf))
        error = scatter(samples) / np.sqrt(at_rest)
        if error > 0.0:
            share = 100.0 * error / np.ptp(samples)
            yield (
                f"{signal} was recorded with noise of {scatter(samples):.1e} pu: the size "
                f"of its change is uncertain by {share:.1g} %, which the intervals do not include"
            )


def distance_from_minimum(residuals: Residuals, solution: estimate.Result) -> float:
    """Estimate the distance (standard errors) of an ended search from a minimum.

    No parameter lies farther from the minimum of the linear model than z of its standard errors,
    where z^2 is twice the decrease that the model promises, in variances of the residuals. It is 0
    for a search that ended by itself.
    """
    if solution.stop not in estimate.AT_TOLERANCE:
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
            f"{listed(beyond)} may leave the range of the data sheet, beyond which values are not "
            "physical: set bounds within it"
        )


def diagram_notes(case: Case) -> Iterator[str]:
    """Note open questions about the diagrams of the models of a case."""
    parts = case.parts
    limiters = (limiter.model for limiter in parts.limiters)
    for model in (parts.exciter, parts.stabiliser, parts.governor, *limiters):
        if model is not None and model.doubt:
            yield f"{model.name} {model.doubt}"


def machine_warnings(case: Case) -> Iterator[str]:
    """Warn of reactances that no machine has."""
    values = {
        name.removeprefix(MACHINE): value
        for name, value in case.values().items()
        if name.startswith(MACHINE)
    }
    for symbol, text in unusual_reactances(values):
        yield f"{MACHINE}{symbol}: {text}, as in no machine"


def case_warnings(case: Case) -> Iterator[str]:
    """Warn of data of no machine, steps of no test, records that validate nothing."""
    from exfit.records.contradictions import LARGEST_STEP, size_in_words

    yield from machine_warnings(case)
    for recording in (*case.recordings, *case.validations):
        per_unit = case.seen_from(recording).kind.per_unit
        for k, event in enumerate(recording.test.events("vref") if per_unit else ()):
            size = start_value(event.step)
            if size is not None and abs(size) > LARGEST_STEP:
                yield f"{prefix_from(recording.name)}test.vref[{k}].step: {size_in_words(size)}"
    for fitted, validation in product(case.recordings, case.validations):
        (begin, end), (first, last) = (
            each.record.window or (-inf, inf) for each in (fitted, validation)
        )
        begin, end = max(begin, first), min(end, last)
        if fitted.record.file != validation.record.file or not begin < end:
            continue
        common = f"{show(begin)} ... {show(end)} s"
        if begin == -inf:
            common = "all" if end == inf else f"the part before {show(end)} s"
        elif end == inf:
            common = f"the part after {show(begin)} s"
        yield (
            f"validate {validation.name}: {common} of {validation.record.file} is fitted as well: "
            "give both a window, [start, end] in s, without overlap"
        )


def causes_before_fit(case: Case, recording: Recording) -> Iterator[Cause]:
    """Ask features for faults of a record that drives a unit, which is read for that.

    Raises RecordError where it cannot be read.
    """
    if case.seen_from(recording).kind.finds_rest:
        for part in parts("CAUSES_BEFORE_FIT").values():
            yield from part.load()(case, recording)


def event_warnings(case: Case) -> Iterator[str]:
    """Warn of faults in the records of grid events that are fitted; they are read for that.

    Raises RecordError where one cannot be read.
    """
    for recording in case.recordings:
        place = f"{recording.name}: " if len(case.recordings) > 1 else ""
        for cause in causes_before_fit(case, recording):
            yield f"{place}{cause.cause}: {cause.remedy}"


def record_warnings(case: Case, setups: Sequence[ExperimentSetup], values: Values) -> Iterator[str]:
    """Warn of records that differ from the response to the start values.

    The setups have sub-steps enough for that. A level at rest does not depend on the exciter: where
    it is another, the base, the polarity or the data of the machine are.
    """
    free_machine = any(name.startswith(MACHINE) for name in case.free())
    for recording, setup in zip(case.recordings, setups, strict=True):
        if case.seen_from(recording).kind.finds_rest:
            continue  # the record of an event has causes of its own
        place = f"{setup.name}: " if len(setups) > 1 else ""
        steady = setup.test.steady if setup.test.begin is None else None
        beside = [] if steady is None else _beside_response(setup, values, steady, free_machine)
        for text in (*beside, *_ripples(recording, setup)):
            yield place + text


def _beside_response(
    setup: ExperimentSetup, values: Values, steady: float, free_machine: bool
) -> Iterator[str]:
    """Warn of channels that rest or move unlike the response, or are not at rest."""
    time = setup.record.time
    given = {
        signal: overlay
        for signal, overlay in overlays_of(setup, values).items()
        if not any(each.rescales(signal) for each in setup.experiment.nuisances)  # left to the fit
    }
    before = time < steady
    against = {name: text for name, y in given.items() if (text := _against(name, y, before))}
    # where vt goes the other way, the step has the other sign, and all follow it
    yield from [against["vt"]] if "vt" in against else against.values()
    sound = {name: y for name, y in given.items() if name not in against}
    far = FAR_FROM_FREE_MACHINE if free_machine else FAR_FROM_BASE
    for cause in (
        *other_levels(time, sound, steady, far),
        *unsteady_signals(setup.record, steady, setup.channels),
    ):
        yield f"{cause.cause}: {cause.remedy}"


def _against(signal: str, overlay: Overlay, before: Mask) -> str:
    """Warn of a channel that is negative at rest or moves against the response; else ""."""
    known = np.isfinite(overlay.error)
    before, after = before & known, ~before & known
    if not (before.any() and after.any()):
        return ""
    rest, start = (float(np.mean(y[before])) for y in (overlay.measured, overlay.simulated))
    error = CERTAIN * noise_of(overlay.measured[known]) / sqrt(np.count_nonzero(before))
    if signal in POSITIVE_AT_REST and rest < -error and start > 0.0:
        return (
            f"{signal} rests at {rest:.4g} pu, the response at {start:.4g} pu: if the channel is "
            "inverted, scale: -1 turns it"
        )
    moves, simulated = overlay.measured[after] - rest, overlay.simulated[after] - start
    sizes = sqrt(float(moves @ moves) * float(simulated @ simulated))
    if float(moves @ simulated) >= AGAINST * sizes:
        return ""
    what = "step" if signal == "vt" else "channel: scale: -1 and an offset turn it"
    return (
        f"{signal} moves against the response, by up to {_farthest(moves):+.3g} pu where that "
        f"moves by {_farthest(simulated):+.3g} pu: check the sign of the {what}"
    )


def _farthest(moves: Array) -> float:
    return float(moves[np.argmax(np.abs(moves))])


def _ripples(recording: Recording, setup: ExperimentSetup) -> Iterator[str]:
    """Yield the lines of channels at rest that the case does nothing about."""
    from exfit.dsp.lines import ripple_at_rest

    time, instants = setup.record.time, setup.test.instants
    if not instants:
        return
    middle = 0.5 * (instants[-1] + float(time[-1]))
    rests = [(float(time[0]), instants[0]), (middle, float(time[-1]))]
    for channel in setup.channels:
        section = recording.record.channels.get(channel.signal)
        if section is None or section.filter or section.averaged or section.sine:
            continue
        ripple = ripple_at_rest(*present_samples(time, channel.measured), rests)
        if ripple is not None:
            yield f"{channel.signal}: {ripple.in_words}: {ripple.remedy}"
