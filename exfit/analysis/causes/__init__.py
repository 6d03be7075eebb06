"""Why a fit is not as good as its records allow: each cause has a small function that sees it.

A recogniser gets the `Evidence` of a fit and yields a `Suspicion` for each thing that may be wrong:
the cause, with its place and its figures, what to do about it, and how likely the record is with
it. Some look at the residuals; others fit the record once more with one thing left open. Where the
residuals are noise nothing of that is done.
"""

from collections.abc import Iterator, Sequence
from math import inf, isfinite

from exfit.analysis.causes.channels import (
    clipped_channel,
    wrong_offset,
    wrong_scale,
    wrong_start,
)
from exfit.analysis.causes.event_record import wrong_event
from exfit.analysis.causes.event_unit import other_unit_in_event
from exfit.analysis.causes.evidence import Evidence, FittedRecord
from exfit.analysis.causes.recorder import averaging, drift, other_clock, ripple, spiky_channel
from exfit.analysis.causes.rest import unsteady_record, wrong_levels, wrong_voltage
from exfit.analysis.causes.steps import further_step, wrong_instant, wrong_sign, wrong_size
from exfit.analysis.causes.suspicion import Recogniser, Suspicion
from exfit.analysis.causes.typical import typical_values
from exfit.analysis.causes.unit import (
    fixed_values,
    machine_data,
    narrow_bound,
    not_ended,
    with_model,
    wrong_limit,
)
from exfit.results.verdict import Cause

__all__ = ["Evidence", "FittedRecord", "Recogniser", "Suspicion", "causes_of"]

ALWAYS: tuple[Recogniser, ...] = (
    wrong_voltage,
    wrong_event,
    unsteady_record,
    wrong_levels,
    typical_values,
)
FROM_RESIDUALS: tuple[Recogniser, ...] = (
    not_ended,
    other_clock,
    spiky_channel,
    ripple,
    drift,
)
BY_TRIAL: tuple[Recogniser, ...] = (
    wrong_voltage,
    wrong_event,
    unsteady_record,
    typical_values,
    other_unit_in_event,
    wrong_sign,
    wrong_size,
    wrong_instant,
    wrong_scale,
    wrong_offset,
    wrong_start,
    clipped_channel,
    narrow_bound,
    machine_data,
    fixed_values,
    wrong_limit,
    further_step,
)
OF_RECORDER: tuple[Recogniser, ...] = (averaging,)
FAR_LESS_LIKELY = 50.0  # log-likelihood below the likeliest: a cause is not worth a line


def causes_of(evidence: Evidence, matched: bool) -> tuple[Cause, ...]:
    """Return what may be wrong with a fit, its test or its record, the likeliest first.

    ``matched``: a minimum whose residuals are noise, of which only what is at rest is looked at. An
    interruption ends the trials with what was found by then.
    """
    nothing_to_explain = matched or evidence.interrupted
    recognisers = ALWAYS if nothing_to_explain else (*FROM_RESIDUALS, *BY_TRIAL)
    suspicions = [*_suspicions(evidence, recognisers)]
    if not nothing_to_explain:
        suspicions += _of_recorder(evidence, suspicions)
    suspicions = sorted(suspicions, key=lambda each: -each.likelihood)
    if not nothing_to_explain:
        suspicions = likely(with_model(evidence, suspicions))
    return tuple(dict.fromkeys(suspicion.cause for suspicion in suspicions))


def _of_recorder(evidence: Evidence, others: Sequence[Suspicion]) -> list[Suspicion]:
    """Return what the recorder may do, in a grid event only what explains more than all others.

    One device measures what drives the unit and what is compared, over the same windows.
    """
    suspicions = [*_suspicions(evidence, OF_RECORDER)]
    if not evidence.case.kind.finds_rest:
        return suspicions
    most = max((each.likelihood for each in others if isfinite(each.likelihood)), default=-inf)
    return [each for each in suspicions if each.likelihood > most]


def likely(suspicions: Sequence[Suspicion]) -> list[Suspicion]:
    """Return suspicions without those that the first makes unlikely; the second stays."""
    compared = [each for each in suspicions if isfinite(each.likelihood)]
    left_out = [
        each for each in compared[2:] if each.likelihood < compared[0].likelihood - FAR_LESS_LIKELY
    ]
    return [each for each in suspicions if each not in left_out]


def _suspicions(evidence: Evidence, recognisers: tuple[Recogniser, ...]) -> Iterator[Suspicion]:
    try:
        for recognise in recognisers:
            yield from recognise(evidence)
    except KeyboardInterrupt:
        return
