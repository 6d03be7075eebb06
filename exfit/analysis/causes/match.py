"""Responses that do not follow their record."""

from collections.abc import Iterator

from exfit.analysis.causes.evidence import Evidence
from exfit.fitting.residuals import noise_of
from exfit.results.verdict import Cause

MISFIT = 2.0  # times the noise: three quarters of the squared error are not noise then


def worse_than_constant(evidence: Evidence) -> Iterator[Cause]:
    """Yield that a constant would match as well."""
    for record in evidence.records:
        if not record.comparison.fit_percent > 0.0:
            yield Cause(
                "the response matches the record no better than a constant would",
                "check the step's sign, size and instant, and the units of the record",
            )


def other_way(evidence: Evidence) -> Iterator[Cause]:
    """Yield that the response goes the other way than the record."""
    for record in evidence.records:
        measured = record.comparison.features.measured
        simulated = record.comparison.features.simulated
        if measured is None or simulated is None:
            continue
        way = measured.final_value - measured.initial_value
        if way * (simulated.final_value - simulated.initial_value) < 0.0:
            yield Cause(
                f"the record moves by {way:+.3g} pu, the response the other way",
                "check the sign of the step, and the polarity of vt",
            )


def unexplained_error(evidence: Evidence) -> Iterator[Cause]:
    """Yield the channels that the fit misses by more than their noise, which none gave.

    A given noise is compared with the residuals where the intervals are made.
    """
    if evidence.uncertainty is None:
        return
    noises = evidence.uncertainty.confidence.noise
    for channel, noise in zip(evidence.residuals.channels, noises, strict=True):
        times = noise.estimated / (channel.weight * noise_of(channel))
        if channel.noise is None and times > MISFIT:
            yield Cause(
                f"the error of {noise.label} is {times:.2g} times the scatter of its record from "
                "sample to sample",
                "the step, the model or the record differs from the case, and the intervals do "
                "not include that error",
            )
