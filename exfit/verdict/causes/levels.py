"""Levels before the step that are not as the case says, and records that do not rest there."""

from collections.abc import Iterator

from exfit.plants import VT0
from exfit.verdict.causes.evidence import CERTAIN, LAST, Evidence, Suspicion
from exfit.verdict.run_quality import levels_at_rest, other_levels, unsteady_signals

FAR_FROM_RATED = 0.3  # pu: sqrt(3) too much or too little lies beyond


def wrong_voltage(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield a voltage that no machine is tested at, yet some might rest with."""
    for number, record, experiment in evidence.tests if evidence.case.kind.per_unit else ():
        measured = record.comparison.features.measured
        level = 1.0 if measured is None else measured.initial_value
        if abs(level - 1.0) > FAR_FROM_RATED:
            from exfit.verdict.causes.channels import other_level

            text = f"vt starts from {level:.4g} pu"
            yield Suspicion(other_level(evidence, number, experiment, "vt", level, text), CERTAIN)


def unsteady_record(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect signals that drift while the case calls the unit steady."""
    for number, record, experiment in evidence.tests:
        if record.steady_until is None:
            continue
        finds_level = VT0 in experiment.own and not evidence.case.kind.finds_rest
        setup = record.setup
        for cause in unsteady_signals(setup.record, record.steady_until, setup.channels):
            changes = {evidence.place(number, "test.vt0"): "{start: auto}"}
            changes = changes if finds_level and cause.word == "vt" else {}
            yield Suspicion(cause._replace(word="rest", changes=changes), LAST)


def wrong_levels(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect signals that start elsewhere than their record."""
    for number, record, experiment in evidence.tests:
        if record.steady_until is None:
            continue
        match = record.comparison
        for cause in other_levels(match.time, match.overlays, record.steady_until):
            from exfit.verdict.causes.channels import other_level

            overlay = match.overlays.get(cause.word)
            levels = levels_at_rest(match.time, overlay, record.steady_until)
            measured, simulated = levels or (1.0, 1.0)
            ratio = measured / simulated if measured and simulated else 1.0
            remedy = other_level(evidence, number, experiment, cause.word, ratio, cause.cause)
            yield Suspicion(remedy._replace(remedy=cause.remedy), LAST)
