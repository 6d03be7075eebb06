"""The steps of a record: what its channels show together, when, by how much, within what error."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from exfit.dsp.quality import mains_frequency, noise_of, present_median
from exfit.dsp.sampling import present_samples
from exfit.dsp.step_detection import (
    SAMPLES_AT_REST,
    DetectedStep,
    MovesFromStartError,
    Onset,
    block_medians,
    departure,
    find_step,
    find_steps,
)
from exfit.util.arrays import Array

COARSE_SAMPLES = 20_000  # in which the steps of a longer record are first looked for
COARSE_AROUND_STEP = 50  # of these, before and after a step, from which its instant is then taken
SAME_STEP = 0.25  # s: channels may show one step this far apart, beside their errors
SAME_STEP_ERRORS = 1.5  # times these errors
INSTANT_WITHIN = 0.25  # s: how far the instant may be from where a record shows the step
SIZE_WITHIN = 0.5  # of the size that a record shows: how far the size may be from it
MOST_SHAPED = 100  # channels whose instants are sought by the shape of a rise, the clearest ones
MOST_LEVELS = 12  # of a signal that switches
SURELY = 2.0  # times the error of an instant: it does not lie beyond
REST_BEFORE = 2.0  # s: so long a rest before a step is looked at for what sets out with it
END_SHARE = 0.1  # of a record or of the time between two steps: its end, where levels are taken
MARGIN_SHARE = 0.005  # of the time between two steps, left out at its end
LASTING_CHANGE = 3.0  # times the noise: a smaller change of level is none
CHANGE_FROM_START = 8.0  # times the noise: a smaller change since the first sample is none


@dataclass(frozen=True)
class ChannelSteps:
    """The steps of one channel; ``remark`` says why it shows none.

    ``frequency`` (Hz) is that of a waveform, and ``noise`` that of a channel that is none and does
    not switch between levels. It may show that it ``moves_from_start``, and whether it is a signal
    that ``responds`` to steps.
    """

    changes: tuple[DetectedStep, ...] = ()
    remark: str = ""
    moves_from_start: bool = False
    responds: bool = False
    frequency: float | None = None
    noise: float = 0.0


@dataclass(frozen=True)
class RecordedStep:
    """A step of the test, with its instant from the channels that show it, ``seen_in``.

    The instant (s) lies within ``error`` of ``at`` at 95 %. ``sizes`` are the lasting changes of
    level by channel. The step is ``recorded`` where a channel jumps.
    """

    at: float
    error: float
    seen_in: tuple[str, ...]
    sizes: Mapping[str, float]
    from_start: bool
    recorded: bool = False


@dataclass(frozen=True)
class StepsOfRecord:
    """The steps of a record in order of time, and those of each channel by its name."""

    steps: tuple[RecordedStep, ...]
    channels: Mapping[str, ChannelSteps]


def steps_of_record(
    time: Array,
    signals: Mapping[str, Array],
    references: Collection[str] = (),
    recognised: Collection[str] = (),
) -> StepsOfRecord:
    """Find the steps that the signals (M,) of a record show, with their sizes.

    A signal that jumps between levels shows steps where it is one of the ``references``. If a
    ``recognised`` channel shows a step, the others have no say in when it was: a frequency wanders
    by itself. Where no signal rests before a step, it is one that the record begins with.

    Args:
        time: (M,), s, increasing.
        signals: by name, (M,) each, nan where a sample is missing.
        references: names of recorded references.
        recognised: names of signals of a test.
    """
    own = _steps_of_channels(time, signals, references, recognised)
    if not _some_step(own):
        own = {name: _from_start(time, signals[name], channel) for name, channel in own.items()}
    heard = {name: channel for name, channel in own.items() if name in recognised}
    if not _some_step(heard):
        heard = own
    combined = combined_steps({name: channel.changes for name, channel in heard.items()})
    responding = {name: signals[name] for name, channel in heard.items() if channel.responds}
    moving = ((name, y) for name, y in signals.items() if own[name].frequency is None)
    noises = {name: channel.noise for name, channel in own.items()}
    steps = with_sizes([*_sharpened(time, responding, combined)], moving, noises, time)
    for name, channel in own.items():
        changes = []
        for change in channel.changes:  # the size that lasts, where it does
            step = min(steps, key=lambda step: abs(step.at - change.at))
            changes.append(replace(change, size=step.sizes.get(name, change.size)))
        own[name] = replace(channel, changes=tuple(changes))
    return StepsOfRecord(steps, own)


def _steps_of_channels(
    time: Array,
    signals: Mapping[str, Array],
    references: Collection[str],
    recognised: Collection[str],
) -> dict[str, ChannelSteps]:
    """Find the steps of each signal, with instants by shapes of those alone that are clearest."""

    def rank(name: str) -> tuple[bool, float]:
        sizes = (abs(change.size) / (own[name].noise or inf) for change in own[name].changes)
        return name in recognised, max(sizes, default=0.0)

    few = len(signals) <= MOST_SHAPED
    own = {name: _steps_of_channel(time, y, name in references, few) for name, y in signals.items()}
    if not few:
        showing = sorted((name for name in own if own[name].changes), key=rank, reverse=True)
        for name in showing[:MOST_SHAPED]:
            own[name] = _steps_of_channel(time, signals[name], name in references)
    return own


def _some_step(channels: Mapping[str, ChannelSteps]) -> bool:
    return any(channel.changes for channel in channels.values())


def bounds_of_instant(at: float, time: Array) -> tuple[float, float]:
    """Bounds (s) of the instant of a step that a record shows at ``at``, within its time (M,)."""
    return max(float(time[0]), at - INSTANT_WITHIN), min(float(time[-1]), at + INSTANT_WITHIN)


def bounds_about(value: float, share: float = SIZE_WITHIN) -> tuple[float, float]:
    """Bounds of a size or level that a record shows, by a share of it on each side."""
    low, high = sorted(((1.0 - share) * value, (1.0 + share) * value))
    return low, high


# ---- one channel


def _steps_of_channel(
    time: Array, samples: Array, reference: bool, shaped: bool = True
) -> ChannelSteps:
    t, y = present_samples(time, samples)
    if not len(y):
        return ChannelSteps(remark="every sample is missing")
    if np.min(y) == np.max(y):
        return ChannelSteps(remark="never changes")
    frequency = mains_frequency(t, y)
    if frequency:
        return ChannelSteps(remark=f"a waveform of {frequency:.4g} Hz", frequency=frequency)
    jumps = np.flatnonzero(np.diff(y))
    levels = np.diff([-1, *jumps, len(y) - 1])  # how many samples each has
    if len(jumps) < MOST_LEVELS and np.min(levels) >= SAMPLES_AT_REST:  # as a recorded reference
        if not reference:
            return ChannelSteps(remark="switches between a few levels")
        changes = tuple(
            DetectedStep(
                at=float(t[k] + t[k + 1]) / 2.0,
                error=float(t[k + 1] - t[k]) / 2.0,
                size=float(y[k + 1] - y[k]),
                level=float(y[k]),
                jumps=True,
            )
            for k in jumps
        )
        return ChannelSteps(changes)
    noise, block = noise_of(y), -(-len(y) // COARSE_SAMPLES)
    try:
        steps = find_steps(*block_medians(t, y, block), shaped)
    except ValueError as fault:
        early = isinstance(fault, MovesFromStartError)
        return ChannelSteps(remark=str(fault), moves_from_start=early, responds=True, noise=noise)
    changes = tuple(_refined(t, y, step, block) for step in steps)
    return ChannelSteps(changes, responds=True, noise=noise)


def _refined(time: Array, samples: Array, coarse: DetectedStep, block: int) -> DetectedStep:
    """Take the instant of a step from smaller blocks, or single samples, around it."""
    if block == 1:
        return coarse
    middle, reach = int(np.searchsorted(time, coarse.at)), COARSE_AROUND_STEP * block
    near = slice(max(middle - reach, 0), middle + reach)
    smaller_block = -(-2 * reach // COARSE_SAMPLES)
    try:
        fine = find_step(*block_medians(time[near], samples[near], smaller_block))
    except ValueError:
        return coarse
    same = abs(fine.at - coarse.at) <= 0.5 * (time[near][-1] - time[near][0])
    return replace(coarse, at=fine.at, error=fine.error) if same else coarse


def _from_start(time: Array, samples: Array, channel: ChannelSteps) -> ChannelSteps:
    """Give a channel that moves from its first sample on, and then settles, this as its step."""
    y = samples[np.isfinite(samples)]
    wave = channel.moves_from_start and mains_frequency(time, samples)
    if not channel.moves_from_start or wave or len(y) < 2 * SAMPLES_AT_REST:
        return channel
    end = y[-max(round(END_SHARE * len(y)), SAMPLES_AT_REST) :]
    size = float(np.median(end) - y[0])
    settled = np.ptp(end) < END_SHARE * abs(size)
    if not settled or abs(size) <= CHANGE_FROM_START * channel.noise:
        return channel
    error = float(time[1] - time[0])
    change = DetectedStep(float(time[0]), error, size, float(y[0]), from_start=True)
    return ChannelSteps((change,), noise=channel.noise)


# ---- the channels together


def combined_steps(changes: Mapping[str, Sequence[DetectedStep]]) -> tuple[RecordedStep, ...]:
    """Combine the steps of channels, by name, into those of the test.

    What several channels show at one time is one step; two steps of one channel are two, unless it
    only returns while the others still move by the first.
    """
    in_time = sorted(
        ((change.at, name, change) for name, own in changes.items() for change in own),
        key=lambda entry: entry[:2],
    )
    groups: list[dict[str, DetectedStep]] = []
    for _, name, change in in_time:
        group = groups[-1] if groups else {}
        close = any(
            change.at - other.at <= SAME_STEP + SAME_STEP_ERRORS * (change.error + other.error)
            for other in group.values()
        )
        if name not in group and close:
            group[name] = change
        elif not (groups and _returns(name, change, group)):
            groups.append({name: change})
    return tuple(_combined(group) for group in groups)


def _combined(group: Mapping[str, DetectedStep]) -> RecordedStep:
    """Combine what channels show of one step.

    No channel moves before the step, but some are late. A recorded reference alone gives the
    instant: it does not respond, it jumps.
    """
    changes = [change for change in group.values() if change.jumps] or [*group.values()]
    interval = _first_of(
        [Onset(change.at - change.error, change.at + change.error) for change in changes]
    )
    return RecordedStep(
        interval.at,
        interval.error,
        tuple(group),
        {name: change.size for name, change in group.items()},
        from_start=all(change.from_start for change in group.values()),
        recorded=any(change.jumps for change in group.values()),
    )


def _returns(name: str, change: DetectedStep, group: Mapping[str, DetectedStep]) -> bool:
    """Check whether a channel only returns from its first move, as a field voltage does."""
    first = group.get(name)
    if first is None or change.jumps or change.size * first.size > 0.0:
        return False
    still_moving = any(change.at < other.until for key, other in group.items() if key != name)
    return still_moving and abs(change.size) <= abs(first.size)


def _first_of(intervals: Sequence[Onset]) -> Onset:
    """Choose the shortest interval, unless another channel has certainly set out before."""
    shortest = min(intervals, key=lambda interval: interval.error)
    first = min(intervals, key=lambda interval: interval.at + SURELY * interval.error)
    return first if first.at + SURELY * first.error < shortest.earliest else shortest


def _sharpened(
    time: Array, signals: Mapping[str, Array], steps: Sequence[RecordedStep]
) -> Iterator[RecordedStep]:
    """Sharpen the instants of steps by those channels as well that set out and then return."""
    before = float(time[0])
    for step in steps:
        begin = max(0.5 * (before + step.at), step.at - REST_BEFORE)
        near = slice(*np.searchsorted(time, [begin, step.at + step.error + SAME_STEP]))
        before = step.at
        known = Onset(step.at - step.error, step.at + step.error)
        onsets = [known]
        for name in [] if step.from_start or step.recorded else signals.keys() - step.seen_in:
            t, y = present_samples(time[near], signals[name][near])
            try:
                onset = departure(*block_medians(t, y, -(-len(t) // COARSE_SAMPLES) or 1))
            except ValueError:
                continue
            # what sets out long before wanders by itself, as a temperature
            if onset.latest > known.earliest - SAME_STEP:
                onsets.append(onset)
        interval = _first_of(onsets)
        yield replace(step, at=interval.at, error=interval.error)


# ---- sizes


def with_sizes(
    steps: Sequence[RecordedStep],
    signals: Iterable[tuple[str, Array]],
    noises: Mapping[str, float],
    time: Array,
) -> tuple[RecordedStep, ...]:
    """Give steps the lasting change of each signal (M,), where it stands out of its noise.

    It is the difference of the levels at the ends of the intervals before and after the step.
    """
    edges = [float(time[0]), *(step.at for step in steps), float(time[-1])]
    sizes: list[dict[str, float]] = [{} for _ in steps]
    for name, samples in signals if steps else ():
        for k, step in enumerate(steps):
            if k == 0 and step.from_start:
                before = float(samples[0])
            else:
                before = _end_level(time, samples, edges[k], step.at, 1.0 if k == 0 else END_SHARE)
            change = _end_level(time, samples, edges[k + 1], edges[k + 2], END_SHARE) - before
            if abs(change) > LASTING_CHANGE * noises.get(name, 0.0):
                sizes[k][name] = change
    return tuple(replace(step, sizes=own) for step, own in zip(steps, sizes, strict=True))


def _end_level(time: Array, samples: Array, start: float, end: float, share: float) -> float:
    """Level of a signal in the last share of an interval, nan without samples there.

    The samples nearest to the end are left out: a step may come a little before it is seen.
    """
    length = end - start
    first, last = np.searchsorted(time, [end - share * length, end - MARGIN_SHARE * length])
    return present_median(samples[first : max(last, first + 1)])
