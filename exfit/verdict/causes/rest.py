"""Records that are not at rest before their step, or rest elsewhere than the model."""

from collections.abc import Iterator, Sequence

import numpy as np

from exfit.dsp.quality import drift_at_rest
from exfit.fitting.experiment import Channel
from exfit.records.record import Record
from exfit.results.comparisons import Comparison
from exfit.results.verdict import Cause
from exfit.signals import unit_of_signal
from exfit.verdict.causes.evidence import Evidence
from exfit.verdict.causes.suspicion import CERTAIN, LAST, Suspicion

FAR_FROM_BASE = 0.05  # of another signal: its base or the machine's data are others
FAR_FROM_RATED = 0.3  # pu: sqrt(3) too much or too little lies beyond
LEAST_LEVEL = 0.1  # pu: below it a deviation is not relative to the level
INVISIBLE = 1e-7  # pu: no recorder shows it
TURNING = ("angle",)  # at rest, too, evenly


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
    """Yield the signals that drift while the case calls the unit steady."""
    for record in evidence.records:
        if record.steady_until is not None:
            setup = record.setup
            for cause in unsteady_signals(setup.record, record.steady_until, setup.channels):
                yield Suspicion(cause, LAST)


def wrong_levels(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the signals that start elsewhere than their record."""
    for record in evidence.records:
        if record.steady_until is not None:
            for cause in other_levels(record.comparison, record.steady_until):
                yield Suspicion(cause, LAST)


def other_levels(
    comparison: Comparison, steady: float, far: float = FAR_FROM_BASE
) -> Iterator[Cause]:
    """Yield the signals of a comparison that start elsewhere than their record, ``far`` off."""
    for signal, overlay in comparison.overlays.items():
        before = (comparison.time < steady) & np.isfinite(overlay.error)
        if signal == "vt" or not before.any():
            continue
        measured = float(np.mean(overlay.measured[before]))
        simulated = float(np.mean(overlay.simulated[before]))
        if abs(measured - simulated) > far * max(abs(simulated), LEAST_LEVEL):
            yield Cause(
                f"{signal} starts from {simulated:.4g} pu, its record from {measured:.4g} pu",
                "check its base, and the data and the power that the case gives the machine",
            )


def unsteady_signals(
    record: Record, steady: float, channels: Sequence[Channel] = ()
) -> Iterator[Cause]:
    """Yield the signals of a record that drift before the instant ``steady`` (s)."""
    smooth = {
        channel.signal: channel.filtering.smooth_over for channel in channels if channel.filtering
    }
    before = record.time < steady
    for signal, samples in record.signals.items():
        if signal in TURNING:
            continue
        at_rest = samples[before & np.isfinite(samples)]
        # averages over a window scatter little from each to the next: one of each window counts
        at_rest = at_rest[:: smooth.get(signal, 1)]
        drift = abs(drift_at_rest(at_rest))
        if drift > INVISIBLE:
            yield Cause(
                f"{signal} moves by {drift:.2g} {unit_of_signal(signal)} before {steady:g} s, "
                "where the record should be at rest",
                "the values that the fit starts from are uncertain",
            )
