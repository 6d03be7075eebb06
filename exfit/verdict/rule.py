"""The verdict on a fit, by one rule, which docs/verdict.md states."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from exfit.estimate import Stop
from exfit.inference.confidence import closed
from exfit.results.cause import Cause
from exfit.results.comparisons import Overlay
from exfit.results.influences import RecorderAverages
from exfit.results.verdict import (
    GOOD,
    MATCHES,
    MISSES,
    NEGLIGIBLE,
    NO_MATCH,
    NOT_CONVERGED,
    ResidualTests,
    Verdict,
    VerdictWords,
)
from exfit.util.text import digits, listed
from exfit.verdict.causes import Evidence, causes_of
from exfit.verdict.diagnostics import NEAR_MINIMUM, distance_from_minimum
from exfit.verdict.residual_tests import residual_tests

if TYPE_CHECKING:
    from exfit.verdict.score_tests import Contradiction, Refuted

MOST_OTHERS = 4  # that explain a record as well as what is named
MOST_CAUSES = 5  # that a reader is given
VALUES = "values of the case"
UNTESTED = f"interrupted before the {VALUES} were tested"
OTHER_WAY = -0.3  # correlation of response and record: below it no noise and no lag explains it


def verdict_of(evidence: Evidence) -> Verdict:
    """Judge a fit: the verdict, its reason, and the likeliest causes.

    An interruption in what follows the tests of its residuals leaves the verdict as it is.
    """
    try:
        tests = residual_tests(evidence)
    except KeyboardInterrupt:
        tests, evidence = (), replace(evidence, interrupted=True)
        evidence.pace.stopped((), interrupted=True)
    words, reason = _judged(evidence, tests)
    matched = words in (GOOD, MATCHES) and all(test.are_noise for test in tests)
    averages = evidence.averages
    good_but_for_averages = words == GOOD or (averages is not None and reason == averages.reason)
    noise_is_carried = any(test.carried > NEGLIGIBLE for test in tests)
    contradicted: list[Contradiction | RecorderAverages | Refuted] = [*_refuted(evidence)]
    try:
        if good_but_for_averages and not noise_is_carried:
            from exfit.verdict.score_tests import contradictions

            contradicted += contradictions(evidence)
    except KeyboardInterrupt:
        words, reason = MATCHES, UNTESTED
        evidence.pace.stopped((VALUES,), interrupted=True)
    contradicted += _shown(averages, matched, reason)
    either = (*_either(evidence),)
    contradicted.sort(key=lambda each: -each.likelihood)
    if contradicted and good_but_for_averages:
        words, reason = MATCHES, contradicted[0].reason
    of_values = tuple(each.cause for each in contradicted)
    causes = causes_of(evidence, matched)
    # beside a misfit a value may have moved to make up for what is wrong
    causes = (*of_values, *either, *causes) if matched else (*causes, *of_values, *either)
    if words == MATCHES:
        causes = (*causes, *_undetermined(evidence))
    return Verdict(words, reason, causes[:MOST_CAUSES], tests)


def _either(evidence: Evidence) -> Iterator[Cause]:
    """Name given values that were fitted where others explain the record as well."""
    refined = evidence.refined
    found = [(listed(step.names), (*step.others, *step.rivals)) for step in refined.steps]
    if refined.given:
        rivals = dict.fromkeys(chain.from_iterable(step.rivals for step in refined.steps))
        found = [("values of the case", (*rivals,))]
    for names, others in found:
        if others:
            more = len(others) - MOST_OTHERS
            listing = ", or ".join([*others[:MOST_OTHERS], *([f"{more} more"] if more > 0 else [])])
            words = f"not as given: {names}, now fitted, or as likely {listing}"
            yield Cause(words, "measure what you can: the record does not tell which")


def _refuted(evidence: Evidence) -> "Sequence[Refuted]":
    """List the given values that the record contradicts; most fits need not load the test."""
    if not evidence.refined.steps:
        return ()
    from exfit.verdict.score_tests import refuted

    return (*refuted(evidence),)


def _shown(
    averages: RecorderAverages | None, matched: bool, reason: str
) -> tuple[RecorderAverages, ...]:
    """Averages that the record shows, unless a trial is to name them."""
    if averages is None or not averages.shown:
        return ()
    return (averages,) if matched or averages.reason in reason else ()


def verdict_alone(evidence: Evidence) -> Verdict:
    """Judge a fit by its residuals alone, without causes."""
    tests = residual_tests(evidence)
    return Verdict(*_judged(evidence, tests), residuals=tests)


def _judged(evidence: Evidence, tests: Sequence[ResidualTests]) -> tuple[VerdictWords, str]:
    solution = evidence.solution
    if evidence.interrupted:
        return NOT_CONVERGED, "interrupted: the values are the best so far"
    no_match = next(_no_match(evidence, tests), None)
    if no_match is not None:
        return NO_MATCH, no_match
    seen = [test for test in tests if test.are_seen]
    if not solution.success and not (seen and solution.stop is Stop.STALLED):
        return NOT_CONVERGED, solution.message
    if seen:
        most = max(seen, key=lambda test: test.share)
        signal = _label(most.record, most.signal, evidence) or most.signal
        share, times = digits(100.0 * most.share), digits(most.times)
        return MISSES, f"{signal} is off by {share} % of its range (rmse {times} x noise)"
    doubts = [*_doubts(evidence, tests)]
    if doubts:
        return MATCHES, "; ".join(doubts)
    return GOOD, "the residuals are noise, and every parameter is determined"


def _no_match(evidence: Evidence, tests: Sequence[ResidualTests]) -> Iterator[str]:
    """Word signals that a constant matches as well: the judged one, and others that are seen."""
    seen = {(test.record, test.signal) for test in tests if test.are_seen}
    for _, _, comparison in evidence.records:
        judged = comparison.judged_by
        signals = [judged, *(signal for signal in comparison.channels if signal != judged)]
        for signal in signals:
            counts = signal == judged or (comparison.name, signal) in seen
            if not counts or comparison.channels[signal].describes:
                continue
            where = _label(comparison.name, signal, evidence)
            if correlation(comparison.overlays[signal]) < OTHER_WAY:
                yield f"the response goes the other way{f' ({where})' if where else ''}"
            else:
                what = where or "the record"
                yield f"the response matches {what} no better than a constant would"


def correlation(overlay: Overlay) -> float:
    """Return the correlation of a response with its record; 0 where one of them does not move."""
    compared = np.isfinite(overlay.error)
    measured, simulated = overlay.measured[compared], overlay.simulated[compared]
    measured, simulated = measured - np.mean(measured), simulated - np.mean(simulated)
    size = float(np.linalg.norm(measured) * np.linalg.norm(simulated))
    return float(measured @ simulated) / size if size else 0.0


def _label(record: str, signal: str, evidence: Evidence) -> str:
    """Name a signal, and its record of several; "" where there is no other."""
    several = len(evidence.records) > 1
    if not several and len(evidence.residuals.channels) == 1:
        return ""
    return f"{signal} of {record}" if several else signal


def _doubts(evidence: Evidence, tests: Sequence[ResidualTests]) -> Iterator[str]:
    undetermined = evidence.undetermined
    if undetermined:
        verb = "is" if len(undetermined) == 1 else "are"
        yield f"{len(undetermined)} of {len(evidence.own)} parameters {verb} not determined"
    elif evidence.without_profile:
        yield "intervals are missing where linear theory does not apply"
    yield from _vague(evidence)
    for match in evidence.validation:
        if not match.accepted:
            yield f"{match.name} is not accepted"
    if evidence.averages is not None and evidence.averages.matters:
        yield evidence.averages.reason
    yield from _not_noise(tests, evidence)
    if distance_from_minimum(evidence.residuals, evidence.solution) > NEAR_MINIMUM:
        yield "the search ended before a minimum"


def _vague(evidence: Evidence) -> Iterator[str]:
    """Name the least known of the parameters that are not known as a setting is."""
    vague = evidence.vague
    if vague:
        known = evidence.uncertainty.confidence.parameters if evidence.uncertainty else {}
        widths = {
            name: (ends[1] - ends[0]) / (abs(evidence.values[name]) or 1.0)
            for name in vague
            if closed(ends := known[name].interval)
        }
        least = max(widths, key=lambda name: widths[name])
        verb = "is" if len(vague) == 1 else "are"
        count = (
            f"{len(vague)} of {len(evidence.own)} parameters {verb} known no better than to 20 %"
        )
        yield f"{count}: {least} {vague[least]}"


def _not_noise(tests: Sequence[ResidualTests], evidence: Evidence) -> Iterator[str]:
    coloured = [test for test in tests if not test.are_white]
    larger = [test for test in tests if test.are_white and not test.are_noise]
    for chosen, doubt in (
        (coloured, "are not noise"),
        (larger, "exceed the scatter of the record"),
    ):
        if chosen:
            signals = [_label(test.record, test.signal, evidence) or test.signal for test in chosen]
            yield f"the residuals of {listed(signals)} {doubt}"


def _undetermined(evidence: Evidence) -> Iterator[Cause]:
    """Name averages that may matter, and the parameters that are not determined, with remedies."""
    averages = evidence.averages
    if averages is not None and averages.matters and not averages.shown:
        yield averages.cause
    names = evidence.undetermined
    if len(names) == 1:
        remedy = "fix it if it is known, or plan a test that shows it (`exfit identify`)"
        yield Cause(f"{names[0]} is not determined", remedy)
    elif names:
        remedy = "fix those that are known, or plan a test that shows them (`exfit identify`)"
        yield Cause(f"{listed(names)} are not determined", remedy)
    if evidence.without_profile:
        cause = (
            f"linear theory does not hold over the intervals of {listed(evidence.without_profile)}"
        )
        yield Cause(cause, "fit with the default search, or use `exfit profile`")
