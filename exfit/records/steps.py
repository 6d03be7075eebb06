"""The steps of a test, as all channels of a record together show them."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.onset import Onset
from exfit.dsp.quality import mains_frequency, noise_of
from exfit.dsp.sampling import present_samples
from exfit.dsp.step_detection import (
    SAMPLES_AT_REST,
    DetectedStep,
    MovesFromStartError,
    departure,
    find_step,
    find_steps,
)

Array = NDArray[np.float64]

COARSE_SAMPLES = 20_000  # in which the steps of a longer record are first looked for
COARSE_AROUND_STEP = 50  # of these, before and after a step, from which its instant is then taken
SAME_STEP = 0.25  # s: channels may show one step this far apart, beside their errors
INSTANT_WITHIN = 0.25  # s: how far the instant may be from where a record shows the step
SAME_STEP_ERRORS = 1.5  # times these errors
MOST_LEVELS = 12  # of a signal that switches
SURELY = 2.0  # times the error of an instant: it does not lie beyond
REST_BEFORE = 2.0  # s: so long a rest before a step is looked at for what sets out with it
END_SHARE = 0.1  # of a record or of the time between two steps: its end, where levels are taken
MARGIN_SHARE = 0.005  # of the time between two steps, left out at its end
LASTING_CHANGE = 3.0  # times the noise: a smaller change of level is none
CHANGE_FROM_START = 8.0  # times the noise: a smaller change since the first sample is none


@dataclass(frozen=True)
class LevelChange:
    """A step of one channel: its instant (s), which lies within ``error`` at 95 %, size and level.

    Where the channel moves from its first sample on, the step was made there or before it; where it
    jumps between levels, it is no response. The channel moves quickly ``until`` an instant (s).
    """

    at: float
    error: float
    size: float
    level: float
    until: float = -inf
    from_start: bool = False
    jumps: bool = False


@dataclass(frozen=True)
class ChannelSteps:
    """The steps of one channel; ``remark`` says why it shows none.

    It may show that it ``moves_from_start``, and whether it is a signal that ``responds`` to steps.
    """

    changes: tuple[LevelChange, ...] = ()
    remark: str = ""
    moves_from_start: bool = False
    responds: bool = False


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


def steps_of_channel(time: Array, samples: Array, reference: bool) -> ChannelSteps:
    """Return the steps of a channel (M,); one that switches counts as a ``reference`` only."""
    t, y = present_samples(time, samples)
    if not len(y):
        return ChannelSteps(remark="every sample is missing")
    if np.min(y) == np.max(y):
        return ChannelSteps(remark="never changes")
    frequency = mains_frequency(t, y)
    if frequency:
        return ChannelSteps(remark=f"a waveform of {frequency:.4g} Hz")
    if switches(y):
        if reference:
            return ChannelSteps(tuple(_jumps(t, y)))
        return ChannelSteps(remark="switches between a few levels")
    block = -(-len(y) // COARSE_SAMPLES)
    try:
        steps = find_steps(*_block_medians(t, y, block))
    except ValueError as fault:
        early = isinstance(fault, MovesFromStartError)
        return ChannelSteps(remark=str(fault), moves_from_start=early, responds=True)
    return ChannelSteps(tuple(_refined(t, y, step, block) for step in steps), responds=True)


def steps_of_signals(
    time: Array,
    signals: Mapping[str, Array],
    references: Collection[str] = (),
    recognised: Collection[str] = (),
) -> tuple[dict[str, ChannelSteps], tuple[RecordedStep, ...]]:
    """Return the steps of each signal (M,), and those of the test; these without lasting sizes.

    Where no signal rests before a step, it is one that the record begins with. If a ``recognised``
    channel shows a step, the others have no say in when it was: a frequency wanders by itself.
    """
    own = {name: steps_of_channel(time, y, name in references) for name, y in signals.items()}
    if not any(channel.changes for channel in own.values()):
        early = [name for name, channel in own.items() if channel.moves_from_start]
        starting = changes_from_start(time, {name: signals[name] for name in early})
        own |= {name: ChannelSteps((change,)) for name, change in starting.items()}
    heard = _heard(own, recognised)
    steps = combined_steps({name: channel.changes for name, channel in heard.items()})
    responding = {name: signals[name] for name, channel in heard.items() if channel.responds}
    return own, tuple(_sharpened(time, responding, steps))


def _heard(
    own: Mapping[str, ChannelSteps], recognised: Collection[str]
) -> Mapping[str, ChannelSteps]:
    """Return the recognised channels; all where none of them shows a step."""
    heard = {name: channel for name, channel in own.items() if name in recognised}
    return heard if any(channel.changes for channel in heard.values()) else own


def _sharpened(
    time: Array, signals: Mapping[str, Array], steps: Sequence[RecordedStep]
) -> Iterator[RecordedStep]:
    """Yield the steps with instants from those channels as well that set out and then return."""
    before = float(time[0])
    for step in steps:
        begin = max(0.5 * (before + step.at), step.at - REST_BEFORE)
        near = slice(*np.searchsorted(time, [begin, step.at + step.error + SAME_STEP]))
        before = step.at
        others = [] if step.from_start or step.recorded else signals.keys() - step.seen_in
        departures = [
            _departure(*present_samples(time[near], signals[name][near])) for name in others
        ]
        known = Onset(step.at - step.error, step.at + step.error)
        # what sets out long before wanders by itself, as a temperature
        own = [each for each in departures if each and each.latest > known.earliest - SAME_STEP]
        interval = _first_of([known, *own])
        yield replace(step, at=interval.at, error=interval.error)


def _departure(time: Array, samples: Array) -> Onset | None:
    """Return when a channel sets out, None where it does not."""
    try:
        return departure(*_block_medians(time, samples, -(-len(time) // COARSE_SAMPLES) or 1))
    except ValueError:
        return None


def _block_medians(time: Array, samples: Array, block: int) -> tuple[Array, Array]:
    """Return the medians of whole blocks of samples, and their mean instants."""
    if block == 1:
        return time, samples
    whole = len(time) // block * block
    return (
        np.mean(time[:whole].reshape(-1, block), axis=1),
        np.median(samples[:whole].reshape(-1, block), axis=1),
    )


def _refined(time: Array, samples: Array, coarse: DetectedStep, block: int) -> LevelChange:
    """Return a step with its instant from smaller blocks, or single samples, around it."""
    change = LevelChange(coarse.at, coarse.error, coarse.size, coarse.level, coarse.until)
    if block == 1:
        return change
    middle, reach = int(np.searchsorted(time, coarse.at)), COARSE_AROUND_STEP * block
    near = slice(max(middle - reach, 0), middle + reach)
    smaller_block = -(-2 * reach // COARSE_SAMPLES)
    try:
        fine = find_step(*_block_medians(time[near], samples[near], smaller_block))
    except ValueError:
        return change
    same = abs(fine.at - coarse.at) <= 0.5 * (time[near][-1] - time[near][0])
    return replace(change, at=fine.at, error=fine.error) if same else change


def switches(samples: Array) -> bool:
    """Return whether a channel jumps between a few levels, as a recorded reference does."""
    jumps = np.flatnonzero(np.diff(samples)) + 1
    ends = np.concatenate([[0], jumps, [len(samples)]])
    return 0 < len(jumps) < MOST_LEVELS and bool(np.min(np.diff(ends)) >= SAMPLES_AT_REST)


def _jumps(time: Array, samples: Array) -> Iterator[LevelChange]:
    """Yield the steps of a channel that jumps, each between two samples."""
    for k in np.flatnonzero(np.diff(samples)):
        yield LevelChange(
            at=float(time[k] + time[k + 1]) / 2.0,
            error=float(time[k + 1] - time[k]) / 2.0,
            size=float(samples[k + 1] - samples[k]),
            level=float(samples[k]),
            jumps=True,
        )


def changes_from_start(time: Array, signals: Mapping[str, Array]) -> dict[str, LevelChange]:
    """Return the changes of channels that move from their first sample on and then settle."""
    changes = {}
    for name, samples in signals.items():
        y = samples[np.isfinite(samples)]
        if len(y) < 2 * SAMPLES_AT_REST or mains_frequency(time, samples):
            continue
        end = y[-max(round(END_SHARE * len(y)), SAMPLES_AT_REST) :]
        size = float(np.median(end) - y[0])
        settled = np.ptp(end) < END_SHARE * abs(size)
        if settled and abs(size) > CHANGE_FROM_START * noise_of(y):
            error = float(time[1] - time[0])
            changes[name] = LevelChange(float(time[0]), error, size, float(y[0]), from_start=True)
    return changes


def combined_steps(changes: Mapping[str, Sequence[LevelChange]]) -> tuple[RecordedStep, ...]:
    """Return the steps of the test, given those of its channels.

    What several channels show at one time is one step; two steps of one channel are two, unless it
    only returns while the others still move by the first.
    """
    in_time = sorted(
        ((change.at, name, change) for name, own in changes.items() for change in own),
        key=lambda entry: entry[:2],
    )
    groups: list[dict[str, LevelChange]] = []
    for _, name, change in in_time:
        if groups and name not in groups[-1] and _close(change, groups[-1].values()):
            groups[-1][name] = change
        elif not (groups and _returns(name, change, groups[-1])):
            groups.append({name: change})
    return tuple(_combined(group) for group in groups)


def _close(change: LevelChange, others: Iterable[LevelChange]) -> bool:
    """Return whether a channel may show the step that one of the others shows."""
    return any(
        change.at - other.at <= SAME_STEP + SAME_STEP_ERRORS * (change.error + other.error)
        for other in others
    )


def _returns(name: str, change: LevelChange, group: Mapping[str, LevelChange]) -> bool:
    """Return whether a channel only returns from its first move, as a field voltage does."""
    first = group.get(name)
    if first is None or change.jumps or change.size * first.size > 0.0:
        return False
    still_moving = any(change.at < other.until for key, other in group.items() if key != name)
    return still_moving and abs(change.size) <= abs(first.size)


def _combined(group: Mapping[str, LevelChange]) -> RecordedStep:
    """Return the step that channels show.

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


def _first_of(intervals: Sequence[Onset]) -> Onset:
    """Return the interval of a step, given those of its channels.

    The shortest counts, unless another channel has certainly set out before.
    """
    shortest = min(intervals, key=lambda interval: interval.error)
    first = min(intervals, key=lambda interval: interval.at + SURELY * interval.error)
    return first if first.at + SURELY * first.error < shortest.earliest else shortest


def with_sizes(
    steps: Sequence[RecordedStep],
    signals: Mapping[str, Array],
    noises: Mapping[str, float],
    time: Array,
) -> tuple[RecordedStep, ...]:
    """Return the steps with the lasting change of each signal (M,).

    It is the difference of the levels at the ends of the intervals before and after the step.
    """
    edges = [float(time[0]), *(step.at for step in steps), float(time[-1])]
    sized = []
    for k, step in enumerate(steps):
        changes = {
            name: _end_level(time, samples, edges[k + 1], edges[k + 2], END_SHARE)
            - _level_before(time, samples, step, edges[k], k == 0)
            for name, samples in signals.items()
        }
        sizes = {
            name: change
            for name, change in changes.items()
            if abs(change) > LASTING_CHANGE * noises.get(name, 0.0)
        }
        sized.append(replace(step, sizes=sizes))
    return tuple(sized)


def _level_before(
    time: Array, samples: Array, step: RecordedStep, start: float, first: bool
) -> float:
    """Return the level of a signal before a step, since the step before it at ``start``."""
    if first and step.from_start:
        return float(samples[0])
    return _end_level(time, samples, start, step.at, 1.0 if first else END_SHARE)


def _end_level(time: Array, samples: Array, start: float, end: float, share: float) -> float:
    """Return the level of a signal in the last share of an interval, nan without samples there.

    The samples nearest to the end are left out: a step may come a little before it is seen.
    """
    length = end - start
    first, last = np.searchsorted(time, [end - share * length, end - MARGIN_SHARE * length])
    inside = samples[first : max(last, first + 1)]
    present = inside[np.isfinite(inside)]
    return float(np.median(present)) if len(present) else float("nan")
