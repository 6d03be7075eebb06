"""The steps of a test, as all channels of a record together show them."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.noise import UNIFORM_SPREAD
from exfit.dsp.quality import mains_frequency, noise_of
from exfit.dsp.sampling import present_samples
from exfit.dsp.step_detection import SAMPLES_AT_REST, DetectedStep, find_step, find_steps

Array = NDArray[np.float64]

COARSE_SAMPLES = 20_000  # in which the steps of a longer record are first looked for
COARSE_AROUND_STEP = 50  # of these, before and after a step, from which its instant is then taken
SAME_STEP = 0.25  # s: channels may show one step this far apart, beside their standard errors
INSTANT_WITHIN = 0.25  # s: how far the instant may be from where a record shows the step
SAME_STEP_ERRORS = 3.0  # these standard errors
# of a rise: its shape may move the instant by up to a tenth, equally likely each way
SHAPE_ERROR = 0.1 * 3.0**-0.5
MOST_LEVELS = 12  # of a signal that switches
END_SHARE = 0.1  # of a record or of the time between two steps: its end, where levels are taken
MARGIN_SHARE = 0.005  # of the time between two steps, left out at its end
LASTING_CHANGE = 3.0  # times the noise: a smaller change of level is none
CHANGE_FROM_START = 8.0  # times the noise: a smaller change since the first sample is none


@dataclass(frozen=True)
class LevelChange:
    """A step of one channel: its instant and standard error (s), its size and level before it.

    Where the channel moves from its first sample on, the step was made there or before it; where it
    jumps between levels, it is no response.
    """

    at: float
    error: float
    size: float
    level: float
    from_start: bool = False
    jumps: bool = False


@dataclass(frozen=True)
class ChannelSteps:
    """The steps of one channel; ``remark`` says why it shows none."""

    changes: tuple[LevelChange, ...] = ()
    remark: str = ""


@dataclass(frozen=True)
class RecordedStep:
    """A step of the test, with its instant from all channels that show it, ``seen_in``.

    ``sizes`` are the lasting changes of level by channel.
    """

    at: float
    error: float
    seen_in: tuple[str, ...]
    sizes: Mapping[str, float]
    from_start: bool


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
        return ChannelSteps(remark=str(fault))
    return ChannelSteps(tuple(_refined(t, y, step, block) for step in steps))


def steps_of_signals(
    time: Array, signals: Mapping[str, Array], references: Collection[str] = ()
) -> tuple[dict[str, ChannelSteps], tuple[RecordedStep, ...]]:
    """Return the steps of each signal (M,), and those of the test; these without lasting sizes.

    Where no signal rests before a step, it is one that the record begins with.
    """
    own = {name: steps_of_channel(time, y, name in references) for name, y in signals.items()}
    if not any(channel.changes for channel in own.values()):
        starting = changes_from_start(time, signals)
        own |= {name: ChannelSteps((change,)) for name, change in starting.items()}
    return own, combined_steps({name: channel.changes for name, channel in own.items()})


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
    change = LevelChange(coarse.at, _error(coarse), coarse.size, coarse.level)
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
    return replace(change, at=fine.at, error=_error(fine)) if same else change


def _error(step: DetectedStep) -> float:
    """Return the standard error of an instant, from the noise and from the shape of the rise."""
    return float(np.hypot(step.spread, SHAPE_ERROR * step.rise))


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
            error=float(time[k + 1] - time[k]) * UNIFORM_SPREAD,
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

    What several channels show at one time is one step; two steps of one channel are two.
    """
    in_time = sorted(
        ((change.at, name, change) for name, own in changes.items() for change in own),
        key=lambda entry: entry[:2],
    )
    groups: list[dict[str, LevelChange]] = []
    for _, name, change in in_time:
        if groups and name not in groups[-1] and _close(change, groups[-1].values()):
            groups[-1][name] = change
        else:
            groups.append({name: change})
    return tuple(_combined(group) for group in groups)


def _close(change: LevelChange, others: Iterable[LevelChange]) -> bool:
    """Return whether a channel may show the step that one of the others shows."""
    return any(
        change.at - other.at <= SAME_STEP + SAME_STEP_ERRORS * (change.error + other.error)
        for other in others
    )


def _combined(group: Mapping[str, LevelChange]) -> RecordedStep:
    """Return the step that channels show, its instant their mean, weighted by standard errors.

    Where they scatter more than these errors explain, the error of the mean grows as much (Birge
    1932). A recorded reference alone gives the instant: it does not respond, it jumps.
    """
    changes = [change for change in group.values() if change.jumps] or [*group.values()]
    instants = np.array([change.at for change in changes])
    # an error of nothing at all is one that the clock cannot show
    errors = np.maximum([change.error for change in changes], 1e-9 + 1e-12 * np.abs(instants))
    weights = errors**-2.0
    mean = float(weights @ instants / np.sum(weights))
    error = float(np.sum(weights) ** -0.5)
    if len(instants) > 1:
        excess = weights @ (instants - mean) ** 2 / (len(instants) - 1)
        error *= max(1.0, float(np.sqrt(excess)))
    sizes = {name: change.size for name, change in group.items()}
    from_start = all(change.from_start for change in group.values())
    return RecordedStep(mean, error, tuple(group), sizes, from_start)


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
