"""The channels of a record as they are compared: masked, cleaned, filtered, weighted."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import (
    ChannelSection,
    Filter,
    MedianSection,
    RecordFile,
)
from exfit.errors import RecordError
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.recordings import column_of
from exfit.records.record import Record
from exfit.util.arrays import Array, median_step

if TYPE_CHECKING:
    from exfit.dsp.filtering import Filtering


LEAST_WINDOWS = 10  # of a running median in a record: a wider one hides the response
FEWEST_SAMPLES = 3  # of a channel: fewer do not show its noise


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
    signals = {}
    for signal, samples in record.signals.items():
        there = np.isfinite(samples)
        own = filtering_of(f"{record.source}: {signal}", record.time, there, filter)
        signals[signal] = np.full(len(samples), np.nan)
        signals[signal][there] = samples[there] if own is None else own.apply(samples)
    return replace(record, signals=signals)


def filtered_end(file: RecordFile, record: Record) -> tuple[tuple[float, float], ...]:
    """Return the end of a record (s) over which the filter of all its channels reaches, if any.

    There a filter lacks what follows, and a unit that it drives by then moves otherwise.
    """
    if file.filter is None:
        return ()
    end = float(record.time[-1])
    if isinstance(file.filter, MedianSection):
        reach = file.filter.median // 2 * median_step(record.time)
    else:
        reach = 1.0 / file.filter.lowpass
    return ((end - reach, end),)


def channel_of(case: Case, file: RecordFile, record: Record, signal: str) -> Channel:
    """Return a channel of a record, with what is done to it before it is compared.

    Raises RecordError where too little of it is left, or where it cannot be filtered.
    """
    section, samples = file.channels[signal], record.signals[signal]
    place = f"{record.source}: {signal}"
    kept = np.isfinite(samples)
    if section.outliers is not None:
        from exfit.dsp.filtering import outliers

        try:
            kept[kept] = ~outliers(record.time[kept], samples[kept], section.outliers)
        except ValueError as fault:
            raise RecordError(f"{place}: outliers: {fault}") from fault
    if np.count_nonzero(kept) < FEWEST_SAMPLES:
        raise RecordError(f"{place}: fewer than {FEWEST_SAMPLES} samples left")
    widest = len(kept) // LEAST_WINDOWS
    if isinstance(section.filter, MedianSection) and section.filter.median > widest:
        width = f"{section.filter.median} samples; at most {widest}, a tenth of the record"
        raise RecordError(f"{place}: filter: median: {width}")
    window = record.averaged.get(signal, section.averaged) or None
    filtering = filtering_of(place, record.time, kept, section.filter, window)
    weight, noise = section.weight, section.noise
    if noise is not None:  # the finest of all fitted channels weighs 1
        fitted = [each for own in case.recordings for each in own.record.channels.values()]
        finest = min((each.noise for each in fitted if each.noise is not None), default=noise)
        weight = finest / noise
    if not isinstance(section, ChannelSection):
        return Channel(signal, samples, weight, filtering, noise)
    column = column_of(section)
    return Channel(signal, samples, weight, filtering, noise, column.scale, column.offset)


def filtering_of(
    place: str,
    time: Array,
    kept: NDArray[np.bool_],
    filter: Filter | None,
    window: float | None = None,
) -> "Filtering | None":
    """Return the filter of a recorded signal (M,) and the average over its window (s).

    None where there is neither, and all samples are kept. ``place`` is where a RecordError finds
    the signal.
    """
    if filter is None and window is None and kept.all():
        return None
    from exfit.dsp.filtering import Filtering, LowPass, Median, MovingAverage

    own: LowPass | Median | None = None
    if filter is not None:
        own = (
            Median(filter.median) if isinstance(filter, MedianSection) else LowPass(filter.lowpass)
        )
    try:
        return Filtering(time, kept, own, None if window is None else MovingAverage(window))
    except ValueError as fault:
        what = "filter" if window is None else "filter or average"
        raise RecordError(f"{place}: {what}: {fault}") from fault


def finds_instant(experiment: Experiment) -> bool:
    """Tell whether a fit finds an instant of a test, which makes up for a delay."""
    return any(nuisance.kind in ("at", "shift", "delay") for nuisance in experiment.nuisances)


def with_averages(experiment: Experiment, window: float, late: float = 0.0) -> Experiment:
    """Return an experiment whose record holds averages over a window (s), and is ``late`` (s)."""
    from exfit.dsp.filtering import Filtering, MovingAverage

    simulator, channels, average = experiment.simulator, [], MovingAverage(window)
    for channel in experiment.channels:
        filter = None if channel.filtering is None else channel.filtering.filter
        filtering = Filtering(simulator.times, channel.kept, filter, average)
        channels.append(replace(channel, filtering=filtering))
    delayed = simulator.with_inputs(simulator.inputs.steps, simulator.delay + late)
    return replace(experiment, channels=tuple(channels), simulator=delayed)
