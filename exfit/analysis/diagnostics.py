"""What a reader of a fit must know beside its numbers."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.case import Case
from exfit.fitting.build import system_of
from exfit.fitting.experiment import Channel
from exfit.fitting.residuals import Residuals, noise_of
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.records.record import Record
from exfit.results.model import Comparison
from exfit.simulation.simulator import parameters_used

Array = NDArray[np.float64]

COARSE = 0.2  # of the error of the fit: what halving the step may move
INVISIBLE = 1e-7  # pu: no recorder shows it
FAR = 0.01  # of vt0: beyond the noise of a record
FAR_FROM_BASE = 0.05  # of another signal: its base or the machine's data are others
FAR_FROM_RATED = 0.3  # pu: sqrt(3) too much or too little lies beyond
UNSTEADY = 6.0  # standard errors between both halves of what is called steady
MUCH_WORSE = 3.0  # than the fit
MISFIT = 2.0  # times the noise: three quarters of the squared error are not noise then


def notes(
    case: Case, residuals: Residuals, found: estimate.Result, compared: Sequence[Comparison]
) -> Iterator[str]:
    """Yield the notes on what a fit found; ``compared`` has sub-steps enough for its response."""
    values = residuals.values(found.x)
    yield from typical_notes(case)
    for one, match in zip(residuals.experiments, compared, strict=True):
        simulator, at = one.with_inputs(values), one.parameters(values)
        for signal, moved in simulator.step_errors(at, one.signals).items():
            error = match.overlays[signal].error
            rmse = float(np.sqrt(np.nanmean(error**2)))
            if moved > max(COARSE * rmse, INVISIBLE):
                yield (
                    f"halving the step of {case.simulation.step:g} s moves {signal} by "
                    f"{moved:.1e} pu, its error is {rmse:.1e} pu: give a smaller simulation.step"
                )
        taken = simulator.substeps(at)
        if match.substeps > 2 * taken:
            step = case.simulation.step * taken / match.substeps
            yield (
                f"the response asks for {match.substeps} sub-steps on its way, {taken} were "
                f"taken: give simulation.step = {step:.2g}"
            )


def match_notes(fitted: Comparison, vt0: float | None) -> Iterator[str]:
    """Yield where the response does not describe the record."""
    if not fitted.fit_percent > 0.0:
        yield (
            "the response matches the record no better than a constant would: "
            "check the step's sign, size and instant, and the units of the record"
        )
    measured, simulated = fitted.measured, fitted.simulated
    if measured is not None and simulated is not None:
        way = measured.final_value - measured.initial_value
        if way * (simulated.final_value - simulated.initial_value) < 0.0:
            yield f"the record moves by {way:+.3g} pu, the response the other way"
        if vt0 is not None and abs(measured.initial_value - vt0) > FAR * abs(vt0):
            yield f"vt0 is {vt0:g} pu, but the record starts from {measured.initial_value:.4g} pu"


def misfit_notes(residuals: Residuals, known: UncertaintyAnalysis) -> Iterator[str]:
    """Yield the channels that the fit misses by more than their noise, which none gave.

    A given noise is compared with the residuals where the intervals are made.
    """
    for channel, seen in zip(residuals.channels, known.confidence.noise, strict=True):
        times = seen.estimated / (channel.weight * noise_of(channel))
        if channel.noise is None and times > MISFIT:
            yield (
                f"the error of {seen.label} is {times:.2g} times what its record scatters from "
                "sample to sample: the step, the model or the record is not as the case says, and "
                "the intervals do not hold that error"
            )


def outlier_notes(name: str, channels: Sequence[Channel]) -> Iterator[str]:
    """Yield how many samples of each channel of a record were taken for outliers."""
    for channel in channels:
        seen = np.isfinite(channel.measured)
        beyond = int(np.count_nonzero(seen & ~channel.kept))
        if beyond:
            yield (
                f"{beyond} of {np.count_nonzero(seen)} samples of {channel.signal} of {name} are "
                "left out as outliers"
            )


def validation_notes(fitted: Sequence[Comparison], tried: Sequence[Comparison]) -> Iterator[str]:
    """Yield on which records the response does not hold."""
    worst = max(one.rmse for one in fitted)
    for one in tried:
        if one.rmse > MUCH_WORSE * worst:
            yield (
                f"on {one.name} the error is {one.rmse / worst:.1f} times that of the fit: "
                "the fitted record leaves open what matters there"
            )


def voltage_notes(fitted: Comparison) -> Iterator[str]:
    """Yield a voltage that no machine is tested at, yet some might rest with."""
    measured = fitted.measured
    if measured is not None and abs(measured.initial_value - 1.0) > FAR_FROM_RATED:
        yield (
            f"vt starts from {measured.initial_value:.4g} pu: check its unit, its base and, of "
            "phases, their connection"
        )


def level_notes(fitted: Comparison, steady: float) -> Iterator[str]:
    """Yield the signals that start elsewhere than their record."""
    for signal, overlay in fitted.overlays.items():
        before = (fitted.time < steady) & np.isfinite(overlay.error)
        if signal == "vt" or not before.any():
            continue
        measured = float(np.mean(overlay.measured[before]))
        simulated = float(np.mean(overlay.simulated[before]))
        if abs(measured - simulated) > FAR_FROM_BASE * max(abs(simulated), 0.1):
            yield (
                f"{signal} starts from {simulated:.4g} pu, its record from {measured:.4g} pu: "
                "check its base, and the data and the power that the case gives the machine"
            )


def unsteady_notes(
    record: Record, steady: float, channels: Sequence[Channel] = ()
) -> Iterator[str]:
    """Yield the signals that drift while the case calls the unit steady."""
    smooth = {one.signal: one.filtering.smooth_over for one in channels if one.filtering}
    before = record.time < steady
    for signal, samples in record.signals.items():
        still = samples[before & np.isfinite(samples)]
        # averages over a window scatter little from each to the next: one of each window counts
        still = still[:: smooth.get(signal, 1)]
        half = len(still) // 2
        if half < 4:
            continue
        # noise from neighbours: a drift does not pass for it
        noise = float(np.std(np.diff(still))) / np.sqrt(2.0)
        apart = abs(float(still[:half].mean() - still[half:].mean()))
        if apart > max(UNSTEADY * noise * np.sqrt(2.0 / half), INVISIBLE):
            yield (
                f"{signal} moves by {apart:.2g} pu before {steady:g} s, where the record should be "
                "at rest: what the fit starts from is not sure"
            )


def typical_notes(case: Case) -> Iterator[str]:
    """Yield which values were taken from the data sheet, because the case does not give them."""
    views = (case, *(case.seen_from(one) for one in case.recordings))
    used = {name for view in views for name in parameters_used(system_of(view))}
    values, typical = case.values(), case.typical()
    for part in [part for part in case.parts.all if part.kind != "network"]:
        names = [part.prefix + row.symbol for row in part.sheet]
        taken = [name for name in names if name in typical and name in used]
        if taken:
            listed = ", ".join(
                f"{name.removeprefix(part.prefix)} {values[name]:g}" for name in taken
            )
            yield f"typical values taken for {part.name}: {listed}"
    if case.parts.stabiliser is not None and not case.on_load:
        yield f"{case.parts.stabiliser.name} does not act: the breaker is open"
