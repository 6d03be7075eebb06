"""A fit beside an earlier one of the same unit: what moved, and by more than is accepted."""

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from exfit.dsp.features import features
from exfit.inference.confidence import Interval, holds
from exfit.results.comparisons import Comparison, JudgedCriterion, StepFeatures
from exfit.results.criteria import SignalToJudge, judged_signals
from exfit.results.model import FitResult
from exfit.util.arrays import Array


class MovedParameter(NamedTuple):
    """A parameter of two fits with its 95 % intervals, None where a fit has none of it.

    It ``moved`` where each value lies beyond the interval of the other fit.
    """

    name: str
    unit: str
    values: tuple[float, float]
    intervals: tuple[Interval | None, Interval | None]
    outcome: Literal["moved", "within an interval", "no interval"]


class Revalidation(NamedTuple):
    """The parameters of an old and a new fit, and the responses of both to the same records.

    ``criteria`` are those of the new case, or of the old one where that gives none; what they call
    recorded is the old response.
    """

    parameters: tuple[MovedParameter, ...]
    criteria: tuple[JudgedCriterion, ...]
    source: str


def revalidation(old: FitResult, new: FitResult) -> Revalidation:
    """Compare a fit with an earlier one: its parameters, and its responses by the criteria."""
    criteria = new.criteria if new.criteria.given else old.criteria
    earlier = {match.name: match for match in (*old.comparisons, *old.validation)}
    judged = [
        each
        for match in (*new.comparisons, *new.validation)
        if match.name in earlier
        for each in judged_signals(
            match.name, criteria, match.judging, dict(_signals(earlier[match.name], match))
        )
    ]
    return Revalidation(tuple(_parameters(old, new)), tuple(judged), criteria.source)


def _parameters(old: FitResult, new: FitResult) -> Iterator[MovedParameter]:
    values = old.values, new.values
    for name in dict.fromkeys((*old.parameters, *new.parameters)):
        own = old.parameters.get(name), new.parameters.get(name)
        known = next(each for each in own if each is not None)
        if known.of_record or not all(name in each for each in values):
            continue
        first, second = (each[name] for each in values)
        intervals = tuple(None if each is None else each.interval for each in own)
        within = [
            None if interval is None else holds(interval, value)
            for interval, value in zip(intervals, (second, first), strict=True)
        ]
        outcome: Literal["moved", "within an interval", "no interval"] = "no interval"
        if any(within):
            outcome = "within an interval"
        elif None not in within:
            outcome = "moved"
        both = intervals[0], intervals[1]
        yield MovedParameter(name, known.unit, (first, second), both, outcome)


def _signals(old: Comparison, new: Comparison) -> Iterator[tuple[str, SignalToJudge]]:
    """Yield the signals that both responses have, at the times of the old one."""
    for signal, overlay in old.overlays.items():
        if signal not in new.overlays:
            continue
        later = new.overlays[signal].simulated
        if not np.array_equal(old.time, new.time):
            later = np.interp(old.time, new.time, later, np.nan, np.nan)

        def after(
            end: float | None, first: Array = overlay.simulated, last: Array = later
        ) -> StepFeatures:
            return _after(old, first, last, end)

        event = None if old.event is None else old.event.at
        step = old.event is not None and old.event.of_vref
        yield signal, SignalToJudge(old.time, overlay.simulated, later, event, step, after)


def _after(old: Comparison, first: Array, last: Array, end: float | None) -> StepFeatures:
    if old.event is None:
        return StepFeatures(None, None)
    window = old.event.at, old.event.until_within(end)
    kept = np.isfinite(first) & np.isfinite(last)
    read = (features(old.time[kept], samples[kept], *window) for samples in (first, last))
    return StepFeatures(*read)
