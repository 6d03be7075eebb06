"""What a reader of a fit must know beside its numbers."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.bounds import search_bounds
from exfit.case.case import Case
from exfit.case.schema import BumpTest, ReferenceTable
from exfit.dsp.reference_moves import scatter
from exfit.fitting.experiment import Channel
from exfit.fitting.references import is_table
from exfit.fitting.residuals import Residuals, noise_of
from exfit.fitting.setup import ExperimentSetup
from exfit.fitting.system import system_of
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.inference.wording import listed
from exfit.models.blocks import SHORTEST
from exfit.plants import REFERENCES
from exfit.records.record import Record
from exfit.results.comparisons import Comparison
from exfit.simulation.kernels import parameters_used

Array = NDArray[np.float64]

COARSE = 0.2  # of the error of the fit: what halving the step may move
INVISIBLE = 1e-7  # pu: no recorder shows it
FAR_FROM_START = 0.01  # of vt0: beyond the noise of a record
FAR_FROM_BASE = 0.05  # of another signal: its base or the machine's data are others
FAR_FROM_RATED = 0.3  # pu: sqrt(3) too much or too little lies beyond
UNSTEADY = 6.0  # standard errors between both halves of what is called steady
NEAR_MINIMUM = 0.1  # standard errors: what errors and intervals in two digits do not show
MISFIT = 2.0  # times the noise: three quarters of the squared error are not noise then


def notes(
    case: Case, residuals: Residuals, solution: estimate.Result, compared: Sequence[Comparison]
) -> Iterator[str]:
    """Yield the notes on what a fit found; ``compared`` has sub-steps enough for its response."""
    values = residuals.values(solution.x)
    yield from typical_notes(case)
    yield from search_range_notes(case)
    yield from unphysical_notes(case, values)
    for experiment, comparison in zip(residuals.experiments, compared, strict=True):
        simulator, at = experiment.with_inputs(values), experiment.parameters(values)
        for signal, change in simulator.step_errors(at, experiment.signals).items():
            error = comparison.overlays[signal].error
            rmse = float(np.sqrt(np.nanmean(error**2)))
            if change > max(COARSE * rmse, INVISIBLE):
                yield (
                    f"halving the step of {case.simulation.step:g} s moves {signal} by "
                    f"{change:.1e} pu, its error is {rmse:.1e} pu: reduce simulation.step"
                )
        used = simulator.substeps(at)
        if comparison.substeps > 2 * used:
            step = case.simulation.step * used / comparison.substeps
            yield (
                f"the response needs {comparison.substeps} sub-steps along its way, {used} were "
                f"taken: set simulation.step to {step:.2g}"
            )


def tolerance_notes(residuals: Residuals, solution: estimate.Result) -> Iterator[str]:
    """Yield how far from a minimum a search ended that a tolerance of the case ended.

    No parameter lies farther from the minimum of the linear model than z of its standard errors,
    where z^2 is twice the decrease that the model promises, in variances of the residuals.
    """
    if solution.stop not in (estimate.Stop.MATCH, estimate.Stop.FLAT):
        return
    ended = "the search ended at a tolerance of the case, not at a minimum"
    freedom = max(1, residuals.samples - len(solution.x))
    variance = max(2.0 * solution.cost / freedom, np.finfo(float).tiny)
    distance = float(np.sqrt(2.0 * max(solution.promise, 0.0) / variance))
    if distance <= NEAR_MINIMUM:
        yield f"{ended}, but within {NEAR_MINIMUM:g} standard errors of it"
    else:
        yield (
            f"{ended}: parameters may be {distance:.2g} standard errors away from it, "
            "and the errors and intervals assume that they are there"
        )


def match_notes(fitted: Comparison, vt0: float | None) -> Iterator[str]:
    """Yield where the response does not describe the record."""
    if not fitted.fit_percent > 0.0:
        yield (
            "the response matches the record no better than a constant would: "
            "check the step's sign, size and instant, and the units of the record"
        )
    measured, simulated = fitted.features.measured, fitted.features.simulated
    if measured is not None and simulated is not None:
        way = measured.final_value - measured.initial_value
        if way * (simulated.final_value - simulated.initial_value) < 0.0:
            yield f"the record moves by {way:+.3g} pu, the response the other way"
        if vt0 is not None and abs(measured.initial_value - vt0) > FAR_FROM_START * abs(vt0):
            yield f"vt0 is {vt0:g} pu, but the record starts from {measured.initial_value:.4g} pu"


def misfit_notes(residuals: Residuals, uncertainty: UncertaintyAnalysis) -> Iterator[str]:
    """Yield the channels that the fit misses by more than their noise, which none gave.

    A given noise is compared with the residuals where the intervals are made.
    """
    for channel, noise in zip(residuals.channels, uncertainty.confidence.noise, strict=True):
        times = noise.estimated / (channel.weight * noise_of(channel))
        if channel.noise is None and times > MISFIT:
            yield (
                f"the error of {noise.label} is {times:.2g} times the scatter of its record from "
                "sample to sample: the step, the model or the record differs from the case, and "
                "the intervals do not include that error"
            )


def reference_notes(test: BumpTest, setup: ExperimentSetup) -> Iterator[str]:
    """Yield how well a recorded reference is known: the size of the test is as uncertain."""
    for signal in REFERENCES:
        record = setup.references.get(signal, setup.record)
        given = test.reference(signal)
        if isinstance(given, tuple | ReferenceTable) or is_table(record):
            continue
        samples = record.signals[signal]
        at_rest = np.count_nonzero(record.time < (setup.test.steady or np.inf))
        error = scatter(samples) / np.sqrt(at_rest)
        if error > 0.0:
            share = 100.0 * error / np.ptp(samples)
            yield (
                f"{signal} was recorded with noise of {scatter(samples):.1e} pu: its mean at rest "
                f"leaves the size of its change uncertain by {share:.1g} %, and the intervals do "
                "not include that error"
            )


def outlier_notes(name: str, channels: Sequence[Channel]) -> Iterator[str]:
    """Yield how many samples of each channel of a record were taken for outliers."""
    for channel in channels:
        measured = np.isfinite(channel.measured)
        beyond = int(np.count_nonzero(measured & ~channel.kept))
        if beyond:
            samples = np.count_nonzero(measured)
            verb = "is" if beyond == 1 else "are"
            yield (
                f"{beyond} of {samples} samples of {channel.signal} of {name} {verb} left out as "
                "outliers"
            )


def voltage_notes(fitted: Comparison) -> Iterator[str]:
    """Yield a voltage that no machine is tested at, yet some might rest with."""
    measured = fitted.features.measured
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
    smooth = {
        channel.signal: channel.filtering.smooth_over for channel in channels if channel.filtering
    }
    before = record.time < steady
    for signal, samples in record.signals.items():
        at_rest = samples[before & np.isfinite(samples)]
        # averages over a window scatter little from each to the next: one of each window counts
        at_rest = at_rest[:: smooth.get(signal, 1)]
        half = len(at_rest) // 2
        if half < 4:
            continue
        # noise from neighbours: a drift does not pass for it
        noise = float(np.std(np.diff(at_rest))) / np.sqrt(2.0)
        drift = abs(float(at_rest[:half].mean() - at_rest[half:].mean()))
        if drift > max(UNSTEADY * noise * np.sqrt(2.0 / half), INVISIBLE):
            yield (
                f"{signal} moves by {drift:.2g} pu before {steady:g} s, where the record should be "
                "at rest: the values that the fit starts from are uncertain"
            )


def search_range_notes(case: Case) -> Iterator[str]:
    """Yield which free parameters are held, and which the bounds let leave their data sheets."""
    for name in case.held():
        yield (
            f"{name} = 0: its lag or lead is bypassed, so that {name} is held at 0 and not fitted; "
            f"to fit it, start from at least {SHORTEST:g} s"
        )
    rows = case.rows()
    beyond = [
        name
        for name, free in case.free().items()
        if name in rows
        and not all(map(rows[name].is_physical, search_bounds(free.min, free.max, rows[name])))
    ]
    if beyond:
        yield (
            f"{listed(beyond)} may leave the range of the data sheet, where values are not "
            "physical: there is no bound, or one beyond it"
        )


def unphysical_notes(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    """Yield the values that lie outside the range of their data sheet."""
    for name, row in case.rows().items():
        if not row.is_physical(values[name]):
            text = f"{name} = {values[name]:.4g} is not physical"
            yield f"{text}: its data sheet's range is {row.physical_range}"


def typical_notes(case: Case) -> Iterator[str]:
    """Yield which values were taken from the data sheet, because the case does not give them."""
    typical = _typical_values(case)
    for part in case.parts.all:
        names = [symbol for symbol in part.symbols if part.prefix + symbol in typical]
        if names and part.kind != "network":
            listed = ", ".join(f"{symbol} {typical[part.prefix + symbol]:g}" for symbol in names)
            yield f"typical values taken for {part.name}: {listed}"
    if case.parts.stabiliser is not None and not case.on_load:
        yield f"{case.parts.stabiliser.name} does not act: the breaker is open"


def _typical_values(case: Case) -> dict[str, float]:
    """Return the typical values that a response of any of the records depends on."""
    views = (case, *(case.seen_from(recording) for recording in case.recordings))
    used = {name for view in views for name in parameters_used(system_of(view))}
    values = case.values()
    return {name: values[name] for name in case.typical() if name in used}
