"""Whether the responses of a fit match their records, by the limits of a report."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite

import numpy as np

from exfit.dsp.features import LABELS, TIMES, Features
from exfit.results.comparisons import Comparison
from exfit.results.validation_result import Reported
from exfit.util.vocabulary import Criteria

NAMES = {name: (label, unit) for label, name, unit in LABELS}
NOT_REACHED = "the simulated response does not show it"


@dataclass(frozen=True)
class JudgedCriterion:
    """A criterion on one record: the difference beside its limit, both in ``unit``.

    ``met`` is None where the noise of the record leaves it open, which ``why`` says.
    """

    record: str
    fitted: bool
    label: str
    difference: float | None
    limit: float
    unit: str
    met: bool | None
    why: str = ""


@dataclass(frozen=True)
class CriteriaVerdict:
    """All criteria of a report, and their result."""

    criteria: tuple[JudgedCriterion, ...]

    @property
    def failed(self) -> tuple[JudgedCriterion, ...]:
        """Those that are not met."""
        return tuple(criterion for criterion in self.criteria if criterion.met is False)

    @property
    def passed(self) -> bool | None:
        """Whether none is missed; None where the noise leaves one open, or there is none at all."""
        if self.failed:
            return False
        is_open = any(criterion.met is None for criterion in self.criteria)
        return None if is_open or not self.criteria else True

    @property
    def sentence(self) -> str:
        """The result of the criteria, in a sentence."""
        count = len(self.criteria)
        met = sum(criterion.met is True for criterion in self.criteria)
        if not count:
            return "no record could be judged by the criteria"
        if self.failed:
            missed = [
                f"{each.label} of {each.record}: "
                + ("is not reached" if each.difference is None else f"{each.difference:+.2g}")
                + f", the limit is {each.limit:.2g} {each.unit}"
                for each in self.failed
            ]
            return f"{len(missed)} of {count} criteria are not met: {'; '.join(missed)}"
        if met < count:
            return f"{met} of {count} criteria are met, noise of the records leaves the others open"
        return f"all {count} criteria are met"


def judged_by_criteria(result: Reported) -> CriteriaVerdict:
    """Judge the responses of a fit, and of its validations, by the criteria."""
    return CriteriaVerdict(
        (
            *(each for match in result.comparisons for each in _judged(match, True, result)),
            *(each for match in result.validation for each in _judged(match, False, result)),
        )
    )


def _judged(match: Comparison, fitted: bool, result: Reported) -> Iterator[JudgedCriterion]:
    """Yield the criteria that a record can be judged by."""
    criteria = result.criteria
    measured, simulated = match.features.measured, match.features.simulated
    changes = {signal: _change(match, signal, measured) for signal in match.judging}
    for signal, change in changes.items():
        if change > 0.0:
            rmse = 100.0 * match.channels[signal].rmse / change
            label, unit = f"rms of the difference, {signal}", "% of the change"
            within = bool(rmse <= criteria.rmse)
            yield JudgedCriterion(match.name, fitted, label, rmse, criteria.rmse, unit, within)
    change = changes[match.judging[0]]
    if measured is None or simulated is None or not change > 0.0:
        return
    for name in ("final_value", "overshoot_percent", *TIMES):
        limit = _limit(name, measured, change, criteria)
        if limit is None:
            continue
        (label, unit), response = NAMES[name], getattr(simulated, name)
        difference: float | None = None
        met: bool | None = False
        why, half = NOT_REACHED, measured.errors.get(name, 0.0)
        if response is not None and isfinite(response):
            difference = response - getattr(measured, name)
            met, why = bool(abs(difference) <= limit), ""
            if half > limit:
                met, why = None, f"by noise the recorded one is uncertain by ±{half:.2g} {unit}"
        yield JudgedCriterion(match.name, fitted, label, difference, limit, unit, met, why)


def _change(match: Comparison, signal: str, measured: Features | None) -> float:
    """Change of a signal in its record, pu: the step, else its range."""
    if measured is not None and signal == "vt":
        return abs(measured.final_value - measured.initial_value)
    samples = match.overlays.get(signal)
    if samples is None or not np.isfinite(samples.measured).any():
        return 0.0
    return float(np.nanmax(samples.measured) - np.nanmin(samples.measured))


def _limit(name: str, measured: Features, change: float, criteria: Criteria) -> float | None:
    """Return the limit on a feature in its unit; None where the record does not show it."""
    value = getattr(measured, name)
    if value is None or not isfinite(value):
        return None
    if name == "final_value":
        return 0.01 * criteria.final_value * change
    if name == "overshoot_percent":
        return criteria.overshoot
    if name == "peak_time" and measured.overshoot_percent <= criteria.overshoot:
        return None
    return max(0.01 * float(getattr(criteria, name) * value), criteria.time)
