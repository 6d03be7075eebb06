"""Typical values in place of the unit's own."""

from collections.abc import Iterator

from exfit.results.typical_values import DEVIATION, first_of, moved_parameters
from exfit.results.verdict import Cause
from exfit.verdict.causes.evidence import Evidence
from exfit.verdict.causes.suspicion import LAST, Suspicion


def typical_values(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the typical values that the parameters of the unit rest on."""
    names = [*evidence.typical_values]
    if not names:
        return
    first = evidence.typical_values[names[0]]
    moved = moved_parameters(first, evidence.values)
    cause = Cause(
        f"{first_of(names)} {'is' if len(names) == 1 else 'are'} typical: if {names[0]} "
        f"({first.value:g}) were {100.0 * DEVIATION:g} % off, that would move {moved}",
        "give the unit's own values, and say under sources where they come from",
    )
    yield Suspicion(cause, LAST)
