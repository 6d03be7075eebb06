"""Whether the parts of a result that is read fit together: lengths of samples, names."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.comparisons import Comparison, IterationResponses
from exfit.results.description import Behaviour
from exfit.results.model import FitResult
from exfit.results.played_records import PlayedRecord
from exfit.results.validation_result import Reported, ValidationResult

Array = NDArray[np.float64]


def contradictions(result: FitResult) -> Iterator[str]:
    """Yield the contradictions within a result, each with its place."""
    if not result.comparisons:
        yield "records: empty"
    for place, match in _comparisons(result):
        yield from (f"{place}: {match.name}: {text}" for text in _of_comparison(match))
    yield from _of_search(result)
    if any(
        not {*typical.matters_to} <= typical.shifts.keys() <= result.parameters.keys()
        for typical in result.typical_values.values()
    ):
        yield "typical_values: what they move are not the parameters of the fit"
    if result.knowledge is not None:
        yield from (f"knowledge: {text}" for text in _of_uncertainty(result.knowledge))
    if result.behaviour is not None:
        yield from (f"behaviour: {text}" for text in _of_behaviour(result.behaviour))


def validation_contradictions(result: ValidationResult) -> Iterator[str]:
    """Yield the contradictions within a validation, each with its place."""
    if not result.matches:
        yield "validation: empty"
    for place, match in _comparisons(result):
        yield from (f"{place}: {match.name}: {text}" for text in _of_comparison(match))
    if result.behaviour is not None:
        yield from (f"behaviour: {text}" for text in _of_behaviour(result.behaviour))


def _comparisons(result: Reported) -> Iterator[tuple[str, Comparison]]:
    """Yield all comparisons with a record that a result holds, each with its place."""
    yield from (("records", match) for match in (*result.comparisons, *result.validation))
    for end in result.phase_ends if isinstance(result, FitResult) else ():
        yield from ((f"phase_ends: {end.phase}", match) for match in end.comparisons)
    if result.as_found is not None:
        yield from (("as_found", match) for match in result.as_found.comparisons)


def _of_search(result: FitResult) -> Iterator[str]:
    points = [line.values for line in result.history]
    if result.minima is not None:
        points += [minimum.values for minimum in result.minima.minima]
    if any(values.keys() != result.parameters.keys() for values in points):
        yield "history: its parameters are not those of the fit"


def _of_comparison(match: Comparison) -> Iterator[str]:
    if not match.channels:
        yield "channels: empty"
    if not _increases(match.time):
        yield "time: does not increase"
    for signal, overlay in match.overlays.items():
        lines = [overlay.measured, overlay.simulated, overlay.start]
        if signal not in match.channels:
            yield f"overlays: {signal} is none of its channels"
        if any(line is not None and line.shape != match.time.shape for line in lines):
            yield f"overlays: {signal}: not one sample for each instant"
    if match.played is not None:
        yield from _of_played(match.played, match)
    if match.iteration_responses is not None:
        yield from _of_responses(match.iteration_responses)


def _of_responses(responses: IterationResponses) -> Iterator[str]:
    shape = (len(responses.numbers), len(responses.time))
    if responses.samples.shape != shape or responses.measured.shape != shape[1:]:
        yield "iteration_responses: not one sample for each instant"
    if not _increases(responses.time):
        yield "iteration_responses: time: does not increase"


def _of_played(played: PlayedRecord, match: Comparison) -> Iterator[str]:
    for signal, driving in played.driving.items():
        if driving.samples.shape != match.time.shape:
            yield f"played: {signal}: not one sample for each instant"
    for signal, left_out in played.left_out.items():
        if not left_out.measured.shape == left_out.simulated.shape == match.time.shape:
            yield f"played: left_out: {signal}: not one sample for each instant"
    if not played.errors.keys() <= match.channels.keys():
        yield "played: its errors are not those of the channels"


def _of_uncertainty(uncertainty: UncertaintyAnalysis) -> Iterator[str]:
    confidence = uncertainty.confidence
    count = len(confidence.names)
    if confidence.correlation.matrix.shape != (count, count):
        yield "confidence.correlation: not one row and column for each parameter"
    for channel in uncertainty.sensitivity:
        if any(line.shape != channel.time.shape for line in channel.moved.values()):
            yield f"sensitivity: {channel.label}: not one sample for each instant"
        if not _increases(channel.time):
            yield f"sensitivity: {channel.label}: time: does not increase"


def _of_behaviour(behaviour: Behaviour) -> Iterator[str]:
    views = [of_tests.view for of_tests in behaviour.small_signal if of_tests.view is not None]
    for bode in (bode for view in views for bode in (view.closed, view.open)):
        if bode is not None and bode.response.shape != bode.frequency.shape:
            yield "small_signal: not one response for each frequency"


def _increases(time: Array) -> bool:
    return time.ndim == 1 and bool(np.all(time[1:] > time[:-1]))
