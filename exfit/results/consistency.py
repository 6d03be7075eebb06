"""Whether the parts of a result that is read fit together: lengths of samples, names."""

from collections.abc import Iterator

from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.comparisons import Comparison
from exfit.results.description import Behaviour
from exfit.results.model import FitResult


def contradictions(result: FitResult) -> Iterator[str]:
    """Yield what of a result contradicts the rest of it, each with its place."""
    if not result.comparisons:
        yield "records: empty"
    for match in (*result.comparisons, *result.validation):
        yield from (f"records: {match.name}: {text}" for text in _of_comparison(match))
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


def _of_search(result: FitResult) -> Iterator[str]:
    points = [line.values for line in result.history]
    if result.minima is not None:
        points += [minimum.values for minimum in result.minima.minima]
    if any(values.keys() != result.parameters.keys() for values in points):
        yield "history: its parameters are not those of the fit"


def _of_comparison(match: Comparison) -> Iterator[str]:
    if not match.channels:
        yield "channels: empty"
    for signal, overlay in match.overlays.items():
        lines = [overlay.measured, overlay.simulated, overlay.start]
        if signal not in match.channels:
            yield f"overlays: {signal} is none of its channels"
        if any(line is not None and line.shape != match.time.shape for line in lines):
            yield f"overlays: {signal}: not one sample for each instant"
    responses = match.iteration_responses
    if responses is not None:
        shape = (len(responses.numbers), len(responses.time))
        if responses.samples.shape != shape or responses.measured.shape != shape[1:]:
            yield "iteration_responses: not one sample for each instant"


def _of_uncertainty(uncertainty: UncertaintyAnalysis) -> Iterator[str]:
    confidence = uncertainty.confidence
    count = len(confidence.names)
    if confidence.correlation.matrix.shape != (count, count):
        yield "confidence.correlation: not one row and column for each parameter"
    for channel in uncertainty.sensitivity:
        if any(line.shape != channel.time.shape for line in channel.moved.values()):
            yield f"sensitivity: {channel.label}: not one sample for each instant"


def _of_behaviour(behaviour: Behaviour) -> Iterator[str]:
    views = [of_tests.view for of_tests in behaviour.small_signal if of_tests.view is not None]
    for bode in (bode for view in views for bode in (view.closed, view.open)):
        if bode is not None and bode.response.shape != bode.frequency.shape:
            yield "small_signal: not one response for each frequency"
