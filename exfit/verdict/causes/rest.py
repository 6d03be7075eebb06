"""Records that are not at rest before their step, or rest elsewhere than the model."""

from collections.abc import Iterator

from exfit.results.verdict import Cause
from exfit.verdict.causes.evidence import CERTAIN, LAST, Evidence, Suspicion
from exfit.verdict.run_quality import other_levels, unsteady_signals

FAR_FROM_RATED = 0.3  # pu: sqrt(3) too much or too little lies beyond


def wrong_voltage(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield a voltage that no machine is tested at, yet some might rest with."""
    if not evidence.case.kind.per_unit:
        return
    for record in evidence.records:
        measured = record.comparison.features.measured
        if measured is not None and abs(measured.initial_value - 1.0) > FAR_FROM_RATED:
            cause = Cause(
                f"vt starts from {measured.initial_value:.4g} pu",
                "check its unit, its base and, of phases, their connection",
            )
            yield Suspicion(cause, CERTAIN)


def unsteady_record(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect signals that drift while the case calls the unit steady."""
    for record in evidence.records:
        if record.steady_until is not None:
            setup = record.setup
            for cause in unsteady_signals(setup.record, record.steady_until, setup.channels):
                yield Suspicion(cause, LAST)


def wrong_levels(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect signals that start elsewhere than their record."""
    for record in evidence.records:
        if record.steady_until is not None:
            for cause in other_levels(record.comparison, record.steady_until):
                yield Suspicion(cause, LAST)
