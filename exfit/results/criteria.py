"""Acceptance criteria: how far a simulated response is from its record, by their limits."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from exfit.dsp.features import Features
from exfit.results.comparisons import Comparison, JudgedCriterion, Outcome, StepFeatures
from exfit.signals import unit_of_signal
from exfit.util.arrays import Array
from exfit.util.vocabulary import QUANTITIES, Criteria, Criterion

if TYPE_CHECKING:
    from exfit.results.validation_result import Reported

NOT_REACHED = "the simulated response does not show it"
SILENT = "there is no response"
OF_SAMPLES: Mapping[str, Callable[[Array], float]] = {
    "rms": lambda error: float(np.sqrt(np.mean(error**2))),
    "largest": lambda error: float(error[np.argmax(np.abs(error))]),
    "mean": lambda error: float(np.mean(error)),
    "mean_absolute": lambda error: float(np.mean(np.abs(error))),
}
# fields of features, and why a record does not show them
OF_STEP: Mapping[str, tuple[str, str]] = {
    "final_value": ("final_value", ""),
    "rise_time": ("rise_time", "it does not rise from 10 to 90 % of its change"),
    "overshoot": ("overshoot_percent", ""),
    "peak_time": ("peak_time", "it does not overshoot"),
    "settling_time": ("settling_time", "it does not settle"),
    "delay": ("delay", "it does not reach 10 % of its change"),
    "damping_ratio": ("damping_ratio", "it does not swing about its final value"),
}
OF_ANY_EVENT = ("damping_ratio",)


@dataclass(frozen=True, eq=False)
class SignalToJudge:
    """A signal (M,) recorded and simulated at ``time`` (s), nan where it is not compared.

    ``event`` (s) is that of its disturbance, None without one, which may be a ``step`` of the
    reference; ``after`` returns the features of both after it, up to so many seconds after it, by
    default until the next one.
    """

    time: Array
    recorded: Array
    simulated: Array
    event: float | None
    step: bool
    after: Callable[..., StepFeatures]


@dataclass(frozen=True)
class CriteriaVerdict:
    """All criteria of a report, and their result."""

    criteria: tuple[JudgedCriterion, ...]

    @property
    def failed(self) -> tuple[JudgedCriterion, ...]:
        """Those that are not met."""
        return tuple(each for each in self.criteria if each.outcome == "not met")

    @property
    def passed(self) -> bool | None:
        """Whether none is missed; None where the noise leaves one open, or none was judged."""
        outcomes = {each.outcome for each in self.criteria}
        if "not met" in outcomes:
            return False
        return None if "open" in outcomes or "met" not in outcomes else True

    @property
    def sentence(self) -> str:
        """The result of the criteria, in a sentence."""
        judged = [each for each in self.criteria if each.outcome != "not judged"]
        count, met = len(judged), sum(each.outcome == "met" for each in judged)
        if not count:
            return "no record could be judged by the criteria"
        others = len(self.criteria) - count
        rest = f"; {others} could not be judged" if others else ""
        if self.failed:
            missed = "; ".join(each.sentence for each in self.failed)
            return f"{len(self.failed)} of {count} criteria are not met: {missed}{rest}"
        if met < count:
            text = f"{met} of {count} criteria are met, noise of the records leaves the others open"
            return text + rest
        return f"all {count} criteria are met{rest}"


def judged_by_criteria(result: "Reported") -> CriteriaVerdict:
    """Collect the criteria of all records of a result, and those that no record has a signal of."""
    matches = (*result.comparisons, *result.validation)
    compared = {signal for match in matches for signal in match.channels}
    return CriteriaVerdict(
        (
            *(each for match in matches for each in match.criteria),
            *(
                JudgedCriterion(each.name, "rms", each.judged_by, outcome="not met", why=SILENT)
                for each in matches
                if not each.overlays
            ),
            *(
                JudgedCriterion("", row.quantity, signal, outcome="not judged", why=why)
                for row in result.criteria.rows
                for signal in row.signals
                if signal not in compared
                for why in [f"no record compares {signal}"]
            ),
        )
    )


def with_criteria(
    match: Comparison, criteria: Criteria, signals: Mapping[str, SignalToJudge]
) -> Comparison:
    """Return a comparison judged by criteria, which decide whether it is accepted if given.

    It is not, either, where none of those given could be judged: nothing speaks for it then. What
    a record does not show is not listed of the usual ones.
    """
    judged = tuple(judged_signals(match.name, criteria, match.judging, signals))
    if not criteria.given:
        shown = (each for each in judged if each.outcome != "not judged")
        return replace(match, criteria=tuple(shown))
    match = replace(match, criteria=judged)
    reasons = [each.sentence for each in judged if each.outcome == "not met"]
    if all(each.outcome == "not judged" for each in judged):
        reasons = [f"no criterion can be judged on {match.name}"]
    return replace(match, accepted=not reasons, reason="; ".join(reasons))


def judged_signals(
    record: str, criteria: Criteria, judging: Iterable[str], signals: Mapping[str, SignalToJudge]
) -> Iterator[JudgedCriterion]:
    """Yield each criterion on each signal of a record that it holds for."""
    judging = tuple(judging)
    for row in criteria.rows:
        for signal in row.signals or judging:
            if signal in signals:
                within = [
                    each.limit
                    for each in criteria.rows
                    if each.quantity == "overshoot" and signal in (each.signals or judging)
                ]
                insignificant = max((limit for limit in within if limit is not None), default=0.0)
                yield _judged(record, row, signal, signals[signal], insignificant)


def _judged(
    record: str, row: Criterion, signal: str, curves: SignalToJudge, insignificant: float
) -> JudgedCriterion:
    """Judge a signal by a criterion; an overshoot (%) up to some size is ``insignificant``."""
    unit = QUANTITIES[row.quantity].unit or unit_of_signal(signal)
    judged = JudgedCriterion(record, row.quantity, signal, row.begin, row.end, unit=unit)
    if row.quantity in OF_SAMPLES:
        return _of_samples(judged, row, curves)
    name, _ = OF_STEP[row.quantity]
    shown = curves.event is not None and (curves.step or row.quantity in OF_ANY_EVENT)
    recorded, simulated = curves.after(row.end) if shown else (None, None)
    why = _why_not_shown(row.quantity, recorded, shown, insignificant)
    if recorded is None or why:
        return replace(judged, outcome="not judged", why=why)
    value, half = getattr(recorded, name), recorded.errors.get(name, 0.0)
    limit = _limit(row, value if row.quantity != "final_value" else _change(curves, recorded))
    response = None if simulated is None else getattr(simulated, name)
    reached = response is not None and isfinite(response)
    difference = response - value if reached else None
    judged = replace(judged, recorded=value, limit=limit, difference=difference)
    if half > limit:
        text = f"by noise the recorded one is uncertain by ±{half:.2g} {unit}"
        return replace(judged, outcome="open", why=text)
    if difference is None:
        return replace(judged, outcome="not met", why=NOT_REACHED)
    return replace(judged, outcome=_within(difference, limit))


def _why_not_shown(
    quantity: str, recorded: Features | None, shown: bool, insignificant: float
) -> str:
    """Say why a record does not show a quantity, "" if it does."""
    name, why = OF_STEP[quantity]
    if recorded is None:
        return f"the record shows no {'change' if shown else 'step'}"
    if getattr(recorded, name) is None:
        return recorded.why.get(name) or f"the record does not show it: {why}"
    if quantity == "peak_time" and recorded.overshoot_percent <= insignificant:
        return f"an overshoot of {recorded.overshoot_percent:.2g} % is within its own limit"
    return ""


def _of_samples(judged: JudgedCriterion, row: Criterion, curves: SignalToJudge) -> JudgedCriterion:
    inside = np.isfinite(curves.simulated - curves.recorded)
    if row.begin is not None or row.end is not None:
        if curves.event is None:
            return replace(judged, outcome="not judged", why="the record shows no event")
        since = curves.time - curves.event
        if row.begin is not None:
            inside &= since >= row.begin
        if row.end is not None:
            inside &= since <= row.end
    if not inside.any():
        return replace(judged, outcome="not judged", why="no sample is compared there")
    step = curves.after(None).measured if curves.step and judged.signal == "vt" else None
    change = _change(curves, step)
    if row.limit is None and not change > 0.0:
        return replace(judged, outcome="not judged", why="nothing moves in the record")
    difference = OF_SAMPLES[row.quantity]((curves.simulated - curves.recorded)[inside])
    limit = _limit(row, change)
    return replace(judged, difference=difference, limit=limit, outcome=_within(difference, limit))


def _within(difference: float, limit: float) -> Outcome:
    return "met" if abs(difference) <= limit else "not met"


def _limit(row: Criterion, base: float) -> float:
    """Return the limit of a criterion in its unit, the larger of its two."""
    return max(row.limit or 0.0, 0.01 * (row.percent or 0.0) * abs(base))


def _change(curves: SignalToJudge, step: Features | None) -> float:
    """Change of a signal in its record: the step of vt, else its range."""
    if step is not None:
        return abs(step.final_value - step.initial_value)
    if not np.isfinite(curves.recorded).any():
        return 0.0
    return float(np.nanmax(curves.recorded) - np.nanmin(curves.recorded))
