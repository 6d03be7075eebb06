"""Channels that are not what the case takes them for: base, polarity, offset, start, clipping."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.filtering import Filtering
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.nuisances import Nuisance
from exfit.fitting.residuals import Residuals
from exfit.plants import VT0
from exfit.results.comparisons import Overlay
from exfit.results.verdict import Cause
from exfit.verdict.causes.evidence import Evidence, FittedRecord, Suspicion
from exfit.verdict.causes.lines import offset_found
from exfit.verdict.causes.trials import Opened, Trial, always, tried, with_experiment, with_opened

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_CHANGE = 0.02  # of vt's scale: no base is wrong by less
LEAST_ERROR_OF_BASE = 1e-3  # of another channel: less is no base, and no instrument's error
LARGEST_FACTOR = 3.0  # of a scale, about what the levels at rest say
FARTHEST_VOLTAGE = 0.2  # pu: how far vt0 may be from the case's
FEWEST_CLIPPED = 5  # samples at one extreme value: white noise has one, rounded noise a few
CLIPPED_RATIO = 4.0  # times as many as have the next value: rounded noise has fewer at its extreme
FARTHEST_OFFSET = 1.0  # pu
TESTED_AT = 0.02  # pu: how far from rated voltage units are tested, for the most part
CHECK_BASE = "check its base, unit and, of phases, connection"
LEAVE_VT0_OUT = "leave vt0 out: it is then the mean of the record before the step"
RARE = 5.0  # log-likelihood: vt has a wrong base less often than other things are wrong


def wrong_scale(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the scale of channels: base, unit, connection or polarity."""
    for number, experiment in enumerate(evidence.residuals.experiments):
        for channel in experiment.channels:
            if not is_found(experiment, channel, "scale"):
                yield from _other_scale(evidence, number, channel)


def _other_scale(evidence: Evidence, number: int, channel: Channel) -> Iterator[Suspicion]:
    record, signal = evidence.records[number], channel.signal
    levels = levels_at_rest(record, signal)
    factor = 1.0 if signal == "vt" or levels is None else factor_between(levels)
    start = channel.scale * factor
    low, high = sorted((start / LARGEST_FACTOR, start * LARGEST_FACTOR))
    opened = [Opened(Nuisance("cause.scale", "scale", signal=signal), start, low, high)]
    if signal == "vt" and record.given_vt0 is None and levels is not None:
        opened.append(_voltage(evidence, number))
    place, starts = f"{signal}{evidence.name_of(number)}", ""
    if levels is not None:
        starts = f": it starts from {levels[0]:.4g} pu"
        if abs(factor_between(levels) - 1.0) > LEAST_CHANGE:
            starts += f", the response from {levels[1]:.4g} pu"

    def cause(trial: Trial) -> Cause | None:
        scale = trial.values["cause.scale"] / channel.scale
        if scale < 0.0:
            return Cause(
                f"{place} is inverted{starts}",
                "check the polarity; scale: -1 turns it",
            )
        if not is_wrong_base(signal, scale):
            return None
        if len(opened) > 1 and not nearer_to_rated(levels, trial):
            return None
        return Cause(
            f"the base of {place}{starts}; times {scale:.4g} it would match",
            CHECK_BASE,
        )

    def prior(trial: Trial) -> float:
        if len(opened) == 1 or levels is None:
            return 0.0
        before, after = ((vt - 1.0) / TESTED_AT for vt in (levels[0], trial.values["cause.vt0"]))
        return 0.5 * (before**2 - after**2) - RARE

    residuals = with_opened(evidence.residuals, number, opened)
    yield from tried(evidence, residuals, len(opened), cause, prior)


def is_wrong_base(signal: str, factor: float) -> bool:
    """Test whether a factor may be that of a wrong base: one that is hardly more than 1 is none."""
    return abs(factor - 1.0) >= (LEAST_CHANGE if signal == "vt" else LEAST_ERROR_OF_BASE)


def factor_between(levels: tuple[float, float]) -> float:
    """Ratio of the simulated level to the measured one; 1 where one of them is zero."""
    measured, simulated = levels
    return simulated / measured if measured and simulated else 1.0


def nearer_to_rated(levels: tuple[float, float] | None, trial: Trial) -> bool:
    """Test whether another base brings vt before the step nearer to 1 pu, as units are tested."""
    return levels is not None and abs(trial.values["cause.vt0"] - 1.0) < abs(levels[0] - 1.0)


def _voltage(evidence: Evidence, number: int) -> Opened:
    """Leave the voltage before the first step open."""
    vt0 = evidence.residuals.experiments[number].own.get(VT0, 1.0)
    return Opened(Nuisance("cause.vt0", "vt0"), vt0, vt0 - FARTHEST_VOLTAGE, vt0 + FARTHEST_VOLTAGE)


def wrong_offset(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the channels beside vt that an offset would match."""
    for number, experiment in enumerate(evidence.residuals.experiments):
        for channel in experiment.channels:
            if channel.signal == "vt" or is_found(experiment, channel, "offset"):
                continue
            levels = levels_at_rest(evidence.records[number], channel.signal)
            start = channel.offset + (0.0 if levels is None else levels[1] - levels[0])
            opened = Opened(
                Nuisance("cause.offset", "offset", signal=channel.signal),
                start,
                start - FARTHEST_OFFSET,
                start + FARTHEST_OFFSET,
            )
            place = f"{channel.signal}{evidence.name_of(number)}"

            def cause(trial: Trial, channel: Channel = channel, place: str = place) -> Cause:
                offset = trial.values["cause.offset"] - channel.offset
                return Cause(
                    f"an offset of {place}: {offset:+.3g} pu more would match",
                    check_zero(channel, offset),
                )

            residuals = with_opened(evidence.residuals, number, [opened])
            yield from tried(evidence, residuals, 1, cause)


def check_zero(channel: Channel, more: float = 0.0) -> str:
    """Word the remedy for the offset of a channel, which ``more`` of it would match."""
    line = offset_found(channel.signal, channel.offset + more, FARTHEST_OFFSET)
    return f"check the zero of the recorder, or let the fit find it: {line}"


def is_found(experiment: Experiment, channel: Channel, kind: str) -> bool:
    """Test whether a fit finds this about a channel already."""
    return any(
        nuisance.kind == kind and nuisance.signal == channel.signal
        for nuisance in experiment.nuisances
    )


def levels_at_rest(record: FittedRecord, signal: str) -> tuple[float, float] | None:
    """Levels of a signal before the first step, measured and simulated; None if unseen."""
    overlay: Overlay | None = record.comparison.overlays.get(signal)
    if overlay is None or record.steady_until is None:
        return None
    before = (record.comparison.time < record.steady_until) & np.isfinite(overlay.error)
    if not before.any():
        return None
    return float(np.mean(overlay.measured[before])), float(np.mean(overlay.simulated[before]))


def wrong_start(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield a voltage before the first step that is not that of the record."""
    for number, record in enumerate(evidence.records):
        experiment = evidence.residuals.experiments[number]
        given = record.given_vt0
        if given is None or VT0 not in experiment.own or "vt" not in record.comparison.overlays:
            continue

        def cause(trial: Trial, given: float = given, number: int = number) -> Cause:
            return Cause(
                f"vt0 is {given:.5g} pu, but the record{evidence.name_of(number)} starts from "
                f"{trial.values['cause.vt0']:.5g} pu",
                LEAVE_VT0_OUT,
            )

        residuals = with_opened(evidence.residuals, number, [_voltage(evidence, number)])
        yield from tried(evidence, residuals, 1, cause)


def clipped_channel(evidence: Evidence) -> Iterator[Suspicion]:
    """Yield the channels whose record stays at its highest or lowest value while it would go on."""
    for number, experiment in enumerate(evidence.residuals.experiments):
        time = evidence.records[number].setup.record.time
        for k, channel in enumerate(experiment.channels):
            flat = clipped_samples(channel.measured, channel.kept)
            if flat is None:
                continue
            value = float(channel.measured[flat][0])
            first, last = time[flat][0], time[flat][-1]
            cause = Cause(
                f"{channel.signal}{evidence.name_of(number)} is clipped: flat at {value:.4g} pu, "
                f"{first:.4g} ... {last:.4g} s",
                f"leave that part out: mask: [[{first:.4g}, {last:.4g}]]; widen the range of the "
                "recorder",
            )
            residuals = _without(evidence, number, k, flat, time)
            yield from tried(evidence, residuals, 1, always(cause))


def clipped_samples(measured: Array, kept: Mask) -> Mask | None:
    """Mask of the samples (M,) that stay at an extreme value; None where it is not clipped."""
    values, counts = np.unique(measured[kept], return_counts=True)
    if len(values) < FEWEST_CLIPPED:
        return None
    for end, next_one in ((-1, -2), (0, 1)):
        if counts[end] >= max(FEWEST_CLIPPED, CLIPPED_RATIO * counts[next_one]):
            return np.asarray(kept & (measured == values[end]))
    return None


def _without(evidence: Evidence, number: int, place: int, left_out: Mask, time: Array) -> Residuals:
    """Return residuals without some samples of a channel; they keep the weight of all."""
    experiment = evidence.residuals.experiments[number]
    channel = experiment.channels[place]
    kept = channel.kept & ~left_out
    own = channel.filtering
    filtering = Filtering(time, kept) if own is None else replace(own, kept=kept)
    channels = [*experiment.channels]
    channels[place] = replace(channel, filtering=filtering)
    return with_experiment(
        evidence.residuals, number, replace(experiment, channels=tuple(channels))
    )
