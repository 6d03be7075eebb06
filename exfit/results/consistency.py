"""Whether the parts of a result that is read fit together: lengths of samples, names."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.comparisons import Comparison, PlayedRecord
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported, ValidationResult
from exfit.util.arrays import Array

UNEVEN = "not one sample for each time"


def contradictions(result: FitResult) -> Iterator[str]:
    """Yield the contradictions within a result, each with its place."""
    if not result.comparisons:
        yield "records: empty"
    for end in result.phase_ends:
        yield from _of_comparisons(f"phase_ends: {end.phase}", end.comparisons)
    yield from _of_both(result)
    every = {*result.parameters, *result.refined}
    if any(values.keys() != every for values in _points(result)):
        yield "history: its parameters are not those of the fit"
    given = {} if result.knowledge is None else result.knowledge.given_errors
    if any(not error.shifts.keys() <= result.parameters.keys() for error in given.values()):
        yield "knowledge: given_errors: what they move are not the parameters of the fit"
    if result.knowledge is not None:
        known = result.knowledge.confidence.parameters.keys()
        asked = {n for n, each in result.parameters.items() if each.given_error is None}
        if not asked <= known <= result.parameters.keys():
            yield "knowledge: confidence: its parameters are not those of the fit"
        yield from (f"knowledge: {text}" for text in _of_knowledge(result.knowledge))


def _points(result: FitResult) -> Iterator[Mapping[str, float]]:
    yield from (line.values for line in result.history)
    if result.minima is not None:
        yield from (minimum.values for minimum in result.minima.minima)


def _of_knowledge(knowledge: UncertaintyAnalysis) -> Iterator[str]:
    count = len(knowledge.confidence.names)
    if knowledge.confidence.correlation.matrix.shape != (count, count):
        yield "confidence.correlation: not one row and column for each parameter"
    if len({(*effect.rms,) for effect in knowledge.effects}) > 1:
        yield "sensitivities: rms: not of the same signals for each parameter"
    for channel in knowledge.sensitivity:
        if any(line.shape != channel.time.shape for line in channel.moved.values()):
            yield f"sensitivity: {channel.label}: {UNEVEN}"
        if not _increases(channel.time):
            yield f"sensitivity: {channel.label}: time: does not increase"


def validation_contradictions(result: ValidationResult) -> Iterator[str]:
    """Yield the contradictions within a validation, each with its place."""
    if not result.matches:
        yield "validation: empty"
    yield from _of_both(result)


def _of_both(result: Reported) -> Iterator[str]:
    yield from _of_comparisons("records", (*result.comparisons, *result.validation))
    if result.as_found is not None:
        yield from _of_comparisons("as_found", result.as_found.comparisons)
    for of_tests in () if result.behaviour is None else result.behaviour.small_signal:
        for bode in () if of_tests.view is None else (of_tests.view.closed, of_tests.view.open):
            if bode is not None and bode.response.shape != bode.frequency.shape:
                yield "behaviour: small_signal: not one response for each frequency"


def _of_comparisons(place: str, matches: Iterable[Comparison]) -> Iterator[str]:
    for match in matches:
        yield from (f"{place}: {match.name}: {text}" for text in _of_comparison(match))


def _of_comparison(match: Comparison) -> Iterator[str]:
    if not match.channels:
        yield "channels: empty"
    if not _increases(match.time):
        yield "time: does not increase"
    for signal, overlay in match.overlays.items():
        lines = [overlay.measured, overlay.simulated, overlay.start, overlay.reference]
        if signal not in match.channels:
            yield f"overlays: {signal} is none of its channels"
        if any(line is not None and line.shape != match.time.shape for line in lines):
            yield f"overlays: {signal}: {UNEVEN}"
    if match.played is not None:
        yield from (f"played: {text}" for text in _of_played(match.played, match))
    responses = match.iteration_responses
    if responses is not None:
        shape = (len(responses.numbers), len(responses.time))
        if responses.samples.shape != shape or responses.measured.shape != shape[1:]:
            yield f"iteration_responses: {UNEVEN}"
        if not _increases(responses.time):
            yield "iteration_responses: time: does not increase"


def _of_played(played: PlayedRecord, match: Comparison) -> Iterator[str]:
    for signal, driving in played.driving.items():
        if driving.samples.shape != match.time.shape:
            yield f"{signal}: {UNEVEN}"
    for signal, left_out in played.left_out.items():
        if not left_out.measured.shape == left_out.simulated.shape == match.time.shape:
            yield f"left_out: {signal}: {UNEVEN}"
    if not played.errors.keys() <= match.channels.keys():
        yield "its errors are not those of the channels"


def _increases(time: Array) -> bool:
    return time.ndim == 1 and bool(np.all(time[1:] > time[:-1]))
