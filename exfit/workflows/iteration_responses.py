"""How a fit came about: the response after each of its iterations."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exfit.fitting.experiment import ExperimentSetup, compared
from exfit.fitting.residuals import UNREACHABLE, Residuals
from exfit.results.comparisons import Comparison, IterationResponses, judged_of
from exfit.results.model import Iteration

Array = NDArray[np.float64]
Values = Mapping[str, float]

MOST_RESPONSES = 40  # colours that an eye still distinguishes, and columns of a table
MOST_SAMPLES = 20_000  # of a record, 20 s at 1 kHz: a table of 9 MB, written within a second


@dataclass(frozen=True, eq=False)
class LiveResponse:
    """A signal of a record and the response to the values of now, (M,) each, per unit.

    ``time`` (M,) is in s. What is left out of the comparison is not among them.
    """

    signal: str
    time: Array
    measured: Array
    simulated: Array


def live_response(
    setup: ExperimentSetup, residuals: Residuals, theta: Array
) -> LiveResponse | None:
    """Return the judged signal of the first setup at scaled parameters theta (N,).

    It costs a simulation. None where there is no response, and where the record has more than
    MOST_SAMPLES.
    """
    if len(setup.record.time) > MOST_SAMPLES:
        return None
    signals = setup.experiment.signals
    place = signals.index(judged_of(signals))
    channel, begin = setup.channels[place], sum(setup.experiment.sizes[:place])
    end = begin + setup.experiment.sizes[place]
    try:
        values = residuals.values(theta)
        errors, _ = setup.experiment.errors(values)
    except UNREACHABLE:
        return None
    measured = channel.filtered(setup.experiment.measured(channel, values))
    simulated = measured + errors[begin:end] / channel.weight
    return LiveResponse(channel.signal, setup.record.time[channel.kept], measured, simulated)


def chosen(count: int) -> list[int]:
    """Choose evenly some of so many iterations, the first and last among them."""
    kept = np.linspace(0, count - 1, min(count, MOST_RESPONSES))
    return [int(k) for k in np.rint(kept)]


def with_iteration_responses(
    comparison: Comparison,
    setup: ExperimentSetup,
    residuals: Residuals,
    history: Sequence[Iteration],
) -> Comparison:
    """Return the comparison of a setup with the responses of the iterations that led to it.

    Iterations without a finite response are left out. A record of more than MOST_SAMPLES has none.
    """
    if not history or len(comparison.time) > MOST_SAMPLES:
        return comparison
    signal = comparison.judged_by
    lines = [history[k] for k in chosen(len(history))]
    responses = iteration_responses(setup, residuals, signal, [line.values for line in lines])
    numbered = [(lines[k].number, response) for k, response in responses]
    if not numbered:
        return comparison
    responses_kept = IterationResponses(
        signal=signal,
        numbers=tuple(number for number, _ in numbered),
        time=comparison.time,
        measured=comparison.overlays[signal].measured,
        samples=np.stack([response for _, response in numbered]),
    )
    return replace(comparison, iteration_responses=responses_kept)


def iteration_responses(
    setup: ExperimentSetup, residuals: Residuals, signal: str, iterations: Sequence[Values]
) -> Iterator[tuple[int, Array]]:
    """Yield the place of each iteration that has a finite response to its values, and it (M,)."""
    place = setup.experiment.signals.index(signal)
    channel = setup.channels[place]
    complete = {k: completed(residuals, values) for k, values in enumerate(iterations)}
    sets = {k: values for k, values in complete.items() if values is not None}
    samples, _ = setup.experiment.samples_of_many([*sets.values()])
    for k, own in zip(sets, samples, strict=True):
        response = compared(channel, own[:, place])
        if np.isfinite(response[channel.kept]).all():
            yield k, response


def completed(residuals: Residuals, values: Values) -> Values | None:
    """Return every value by name, given those of an iteration; None where a tie has none."""
    try:
        return residuals.completed(values)
    except UNREACHABLE:
        return None


def skipped_response_notes(comparisons: Sequence[Comparison]) -> list[str]:
    """Say of which records the iterations are not kept for their size."""
    return [
        f"{comparison.record}: {len(comparison.time)} samples: the response after each "
        f"iteration is kept of records up to {MOST_SAMPLES}"
        for comparison in comparisons
        if len(comparison.time) > MOST_SAMPLES
    ]
