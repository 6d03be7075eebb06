"""What a fit comes to, by one rule."""

from exfit.analysis.causes import Evidence, causes_of
from exfit.inference.wording import listed
from exfit.results.verdict import (
    GOOD,
    MATCHES,
    NO_MATCH,
    NOT_CONVERGED,
    Verdict,
    VerdictWords,
)

MOST_CAUSES = 5  # that a reader is given


def verdict_of(evidence: Evidence) -> Verdict:
    """Return what a fit comes to, why, and the likeliest causes."""
    words, reason = _judged(evidence)
    return Verdict(words, reason, causes_of(evidence)[:MOST_CAUSES])


def _judged(evidence: Evidence) -> tuple[VerdictWords, str]:
    if not evidence.solution.success:
        return NOT_CONVERGED, evidence.solution.message
    missed = [match.name for match in evidence.comparisons if not match.judged.describes]
    if missed:
        return NO_MATCH, f"the response matches {listed(missed)} no better than a constant would"
    undetermined = evidence.undetermined
    if undetermined:
        return MATCHES, f"{listed(undetermined)} not determined"
    return GOOD, ""
