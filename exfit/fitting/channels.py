"""The channels of a record as they are compared: masked, cleaned, filtered, weighted."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import (
    ChannelSection,
    Filter,
    MedianSection,
    PhasesSection,
    RecordFile,
)
from exfit.dsp.filtering import Filtering, MovingAverage
from exfit.errors import RecordError
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.recordings import column_of
from exfit.records.record import Record
from exfit.util.sorting import median

if TYPE_CHECKING:
    from exfit.dsp.filtering import Filtering, LowPass, Median


Mask = NDArray[np.bool_]
Section = ChannelSection | PhasesSection

LEAST_WINDOWS = 10  # of a running median in a record: a wider one hides the response
FEWEST_SAMPLES = 3  # of a channel: fewer do not show its noise
WHITE_NOISE_SEED = 0
INDEPENDENT = 2.0  # times the length over which filtered noise is correlated


class NoiseShape(NamedTuple):
    """White noise as it comes out of a channel: its ``gain``, and its correlation.

    Of samples that are ``apart`` by so many, each is independent of the one before.
    """

    gain: float
    apart: int


def without_masked(
    record: Record, mask: Iterable[tuple[float, float]], driving: Sequence[str]
) -> Record:
    """Return a record with nan in the intervals (s) of a mask; what drives stays as it is.

    Raises RecordError where a signal that drives has a gap.
    """
    masked = np.zeros(len(record.time), dtype=bool)
    for first, last in mask:
        masked |= (record.time >= first) & (record.time <= last)
    signals = dict(record.signals)
    for signal, samples in record.signals.items():
        if signal not in driving:
            signals[signal] = np.where(masked, np.nan, samples)
        elif np.isnan(samples).any():
            at = record.time[np.isnan(samples)][0]
            raise RecordError(
                f"{record.source}: {signal}: drives the simulation, but has a gap at {at:g} s"
            )
    return replace(record, signals=signals)


def with_filter(record: Record, filter: Filter | None) -> Record:
    """Return a record whose signals have all passed a filter, gaps in them as they were.

    Raises RecordError where it cannot be filtered.
    """
    if filter is None:
        return record
    from exfit.dsp.filtering import Filtering

    signals = {}
    for signal, samples in record.signals.items():
        there = np.isfinite(samples)
        try:
            own = Filtering(record.time, there, _filter(filter))
        except ValueError as fault:
            raise RecordError(f"{record.source}: {signal}: filter: {fault}") from fault
        signals[signal] = np.full(len(samples), np.nan)
        signals[signal][there] = own.apply(samples)
    return replace(record, signals=signals)


def filtered_end(file: RecordFile, record: Record) -> tuple[tuple[float, float], ...]:
    """Return the end of a record (s) over which the filter of all its channels reaches, if any.

    There a filter lacks what follows, and a unit that it drives by then moves otherwise.
    """
    if file.filter is None:
        return ()
    end = float(record.time[-1])
    if isinstance(file.filter, MedianSection):
        reach = file.filter.median // 2 * float(median(np.diff(record.time)))
    else:
        reach = 1.0 / file.filter.lowpass
    return ((end - reach, end),)


def channel_of(case: Case, file: RecordFile, record: Record, signal: str) -> Channel:
    """Return a channel of a record, with what is done to it before it is compared.

    Raises RecordError where too little of it is left, or where it cannot be filtered.
    """
    section, samples = file.channels[signal], record.signals[signal]
    kept = _kept(record, signal, section)
    filtering = _filtering(record, signal, section, kept)
    weight, noise = section.weight, section.noise
    if noise is not None:
        weight = finest_noise(case, noise) / noise
    if not isinstance(section, ChannelSection):
        return Channel(signal, samples, weight, filtering, noise)
    column = column_of(section)
    return Channel(signal, samples, weight, filtering, noise, column.scale, column.offset)


def _kept(record: Record, signal: str, section: Section) -> Mask:
    """Mask of the samples of a channel to compare: numbers, and no outliers."""
    from exfit.dsp.filtering import outliers

    samples = record.signals[signal]
    kept = np.isfinite(samples)
    if section.outliers is not None:
        try:
            kept[kept] = ~outliers(record.time[kept], samples[kept], section.outliers)
        except ValueError as fault:
            raise RecordError(f"{record.source}: {signal}: outliers: {fault}") from fault
    if np.count_nonzero(kept) < FEWEST_SAMPLES:
        raise RecordError(f"{record.source}: {signal}: fewer than {FEWEST_SAMPLES} samples left")
    return kept


def _filtering(record: Record, signal: str, section: Section, kept: Mask) -> "Filtering | None":
    """Filter and averages of a channel's samples, None where there is neither."""
    from exfit.dsp.filtering import Filtering, MovingAverage

    widest = len(kept) // LEAST_WINDOWS
    if isinstance(section.filter, MedianSection) and section.filter.median > widest:
        samples = f"{section.filter.median} samples; at most {widest}, a tenth of the record"
        raise RecordError(f"{record.source}: {signal}: filter: median: {samples}")
    window = record.averaged.get(signal, section.averaged) or None
    if section.filter is None and window is None and kept.all():
        return None
    average = None if window is None else MovingAverage(window)
    try:
        return Filtering(record.time, kept, _filter(section.filter), average)
    except ValueError as fault:
        what = "filter" if window is None else "filter or average"
        raise RecordError(f"{record.source}: {signal}: {what}: {fault}") from fault


def filtering_of(
    place: str, time: NDArray[np.float64], filter: Filter | None
) -> "Filtering | None":
    """Return the filter of a recorded signal (M,) that drives a simulation, None without one."""
    from exfit.dsp.filtering import Filtering

    if filter is None:
        return None
    try:
        return Filtering(time, np.ones(len(time), dtype=bool), _filter(filter))
    except ValueError as fault:
        raise RecordError(f"{place}: filter: {fault}") from fault


def _filter(section: Filter | None) -> "LowPass | Median | None":
    from exfit.dsp.filtering import LowPass, Median

    if section is None:
        return None
    if isinstance(section, MedianSection):
        return Median(section.median)
    return LowPass(section.lowpass)


def finest_noise(case: Case, own: float) -> float:
    """Return the least noise that a case gives for a fitted channel, its ``own`` where none has."""
    channels = [
        entry for recording in case.recordings for entry in recording.record.channels.values()
    ]
    return min((entry.noise for entry in channels if entry.noise is not None), default=own)


def noise_shape(channel: Channel) -> NoiseShape:
    """Shape of white noise after the averages of a channel's record and its filter."""
    from exfit.inference.noise import effective_samples

    filtering = channel.filtering
    if filtering is None:
        return NoiseShape(1.0, 1)
    if filtering.filter is None:
        return NoiseShape(1.0, filtering.smooth_over)
    white = np.random.default_rng(WHITE_NOISE_SEED).standard_normal(len(channel.measured))
    filtered = channel.filtered(white)
    correlated = INDEPENDENT * len(filtered) / effective_samples(filtered)
    apart = max(round(correlated), filtering.smooth_over)
    return NoiseShape(float(np.std(filtered)), apart)


Array = NDArray[np.float64]


def finds_instant(experiment: Experiment) -> bool:
    """Tell whether a fit finds an instant of a test, which makes up for a delay."""
    return any(nuisance.kind in ("at", "shift", "delay") for nuisance in experiment.nuisances)


def with_averages(experiment: Experiment, window: float, late: float = 0.0) -> Experiment:
    """Return an experiment whose record holds averages over a window (s), and is ``late`` (s)."""
    simulator = experiment.simulator
    channels = tuple(_averaging(each, simulator.times, window) for each in experiment.channels)
    delayed = simulator.with_inputs(simulator.inputs.steps, simulator.delay + late)
    return replace(experiment, channels=channels, simulator=delayed)


def _averaging(channel: Channel, time: Array, window: float) -> Channel:
    filter = None if channel.filtering is None else channel.filtering.filter
    return replace(channel, filtering=Filtering(time, channel.kept, filter, MovingAverage(window)))
