"""Why a fit is not as good as its records allow: each cause has a small function that sees it.

A recogniser gets the `Evidence` of a fit and yields a `Suspicion` for each thing that may be wrong:
the cause, with its place and its figures, what to do about it, and how likely the record is with
it. Some look at the residuals; others fit the record once more with one thing left open. Where the
residuals are noise nothing of that is done. The `Pace` of the evidence ends it where its time is
over.
"""

from collections.abc import Mapping, Sequence
from math import isfinite

from exfit.case.case import Case
from exfit.registry import parts
from exfit.results.cause import Cause
from exfit.verdict.causes.evidence import (
    Evidence,
    FittedRecord,
    OutOfTime,
    Pace,
    Recogniser,
    Suspicion,
    largest_likelihood,
)
from exfit.verdict.causes.levels import unsteady_record, wrong_levels, wrong_voltage

__all__ = ["Evidence", "FittedRecord", "Pace", "Recogniser", "Suspicion", "causes_of"]

ALWAYS: Mapping[str, Recogniser] = {
    "level of vt": wrong_voltage,
    "rest before the step": unsteady_record,
    "levels at rest": wrong_levels,
}
FAR_LESS_LIKELY = 50.0  # log-likelihood below the likeliest: a cause is not worth a line


def causes_of(evidence: Evidence, matched: bool) -> tuple[Cause, ...]:
    """List likely faults of a fit, its test or its record, the likeliest first.

    ``matched``: a minimum whose residuals are noise, of which only what is at rest is looked at.
    Where an interruption or its pace ends the search for them, they are those found by then.
    """
    nothing_to_explain = matched or evidence.interrupted
    if nothing_to_explain:
        recognisers = {**ALWAYS, **_of_events("CAUSES_AT_REST", evidence.case)}
    else:
        recognisers = {**recognisers_of(evidence.case)}
    pace, found = evidence.pace, dict[Recogniser, list[Suspicion]]()
    try:
        for done, recognise in enumerate(recognisers.values()):
            found[recognise] = []
            pace.counts(done, len(recognisers), evidence.cost)
            for suspicion in recognise(evidence):
                found[recognise].append(suspicion)
    except (KeyboardInterrupt, OutOfTime) as ending:
        left = (*recognisers,)[max(len(found) - 1, 0) :]
        pace.stopped(left, isinstance(ending, KeyboardInterrupt))
    suspicions = sorted(_credible(evidence, found), key=lambda each: -each.likelihood)
    if not nothing_to_explain:
        from exfit.verdict.causes.exciters import with_model

        suspicions = likely(with_model(evidence, suspicions))
    if not pace.untried:
        pace.ended()
    causes = {suspicion.cause.sentence: suspicion.cause for suspicion in reversed(suspicions)}
    return tuple(reversed(causes.values()))


def recognisers_of(case: Case) -> Mapping[str, Recogniser]:
    """List what looks for the causes of a misfit in turn, the recorder's last."""
    from exfit.verdict.causes.recognisers import AFTER_TRIALS, BY_TRIAL, WITHOUT_TRIAL

    at_rest = _of_events("CAUSES_AT_REST", case)
    of_events = _of_events("CAUSES_OF_EVENTS", case)
    return {**WITHOUT_TRIAL, **at_rest, **of_events, **BY_TRIAL, **AFTER_TRIALS}


def _of_events(plug: str, case: Case) -> Mapping[str, Recogniser]:
    """Load what features add for the case of a grid event; other cases spare the import."""
    found = parts(plug) if case.kind.finds_rest else {}
    return {words: part.load() for words, part in found.items()}


def _credible(
    evidence: Evidence, found: Mapping[Recogniser, Sequence[Suspicion]]
) -> list[Suspicion]:
    """List all suspicions; averages in a grid event only if they explain more than all others."""
    if not evidence.case.kind.finds_rest:
        return [each for own in found.values() for each in own]
    from exfit.verdict.causes.recorder import averaging

    others = [each for recognise, own in found.items() if recognise != averaging for each in own]
    most = largest_likelihood(others)
    averages = [each for each in found.get(averaging, ()) if each.likelihood > most]
    return [*others, *averages]


def likely(suspicions: Sequence[Suspicion]) -> list[Suspicion]:
    """Return suspicions without those that the first makes unlikely; the second stays."""
    compared = [each for each in suspicions if isfinite(each.likelihood)]
    left_out = [
        each for each in compared[2:] if each.likelihood < compared[0].likelihood - FAR_LESS_LIKELY
    ]
    return [each for each in suspicions if each not in left_out]
