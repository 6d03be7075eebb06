"""Detect the steps of a reference that was not recorded in the response to them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from exfit.dsp.noise import noise, spread
from exfit.dsp.onset import Onset, onset
from exfit.util.sorting import median

Array = NDArray[np.float64]

SAMPLES_AT_REST = 10  # before a step: fewer do not determine the level it starts from
MEDIAN_SAMPLES = 7  # of a running median: three may be spikes
LEAST_CHANGE = 8.0  # times the noise: the whole change; white noise alone reaches 5
DEPARTURE = (0.1, 5.0)  # of the whole change and times the noise: farther from its level, it moves
DEPARTURE_BEGUN = 0.2  # of a departure: nearer to its level than this it has hardly begun
REST_TIMES = 12  # times what the departure takes: at rest, it does not move for so long
LEAST_SPEED = (0.2, 4.0)  # of the step's own speed and times the noise: slower is no step
REACHED = 0.8  # of a first move: the step takes until then
TIMES_OF_STEP = 3.0  # what it takes: then the response is near its rest
WANDER = 2.5  # times what it moves at rest in the time of a step: less is no step
LONGEST_REST = 500  # samples before a step, in which its scatter is looked at
PEAK_PASSED = 0.3  # of a first move: where so much of it is lost, its peak is passed
PULSE_REACHED = 0.9  # of its first move: there a pulse stands
STANDS_FOR = 6.0  # times what its return takes to begin: so long a pulse stands at least
SHORTEST_PULSE = 1.0  # s: a field voltage stands at its limit for less, and then returns
MOST_RETURNS = 3  # moves that leave no lasting change, beside pulses: with more a channel wanders
SPIKE_LIMIT_OF_RESPONSE = 6.0  # times the noise: the running median replaces what lies farther off


class MovesFromStartError(ValueError):
    """A response without a rest before it moves."""


class ReturnsError(ValueError):
    """A response that leaves its rest and returns to it."""


@dataclass(frozen=True)
class DetectedStep:
    """A step of the reference as the response shows it.

    ``at`` is its instant (s), which lies within ``error`` (s) of it at 95 %, ``size`` the change of
    the response that lasts, with its sign, and ``level`` where the response stood before, both in
    its unit. The response moves quickly ``until`` an instant (s).
    """

    at: float
    error: float
    size: float
    level: float
    until: float


def find_step(time: Array, samples: Array) -> DetectedStep:
    """Return the first step of a reference from its response (M,), which is at rest before it.

    A voltage follows a step of its reference late and smoothly, a field voltage at once: `onset`
    gives when the response sets out, whatever its shape. A step is detected if it is at least a
    tenth of all that changes in the record; a later one that is slower than a fifth of it passes
    for its settling. Without a rest after it, ``size`` is taken from the end of the record. Spikes
    and slow drift do no harm.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite.

    Raises:
        ValueError: nothing stands out of the noise or lasts, the record is at rest for fewer than
            ten samples before it moves, or it has fewer than twenty samples.
    """
    return _step(time, samples)[0]


def find_steps(time: Array, samples: Array) -> tuple[DetectedStep, ...]:
    """Return all steps of a reference from its response (M,), which ``find_step`` returns first.

    The next one is looked for where the response to the one before has settled; what is slower than
    a fifth of that one passes for its settling. A pulse, which stands for a while and then returns,
    is two steps. None is a move of which the response does 40 % elsewhere at rest as well, in the
    same time.

    Raises ValueError like ``find_step``, and where nothing stands out of what it does at rest.
    """
    steps, first, returns = list[DetectedStep](), 0, list[ReturnsError]()
    while True:
        t, y = time[first:], samples[first:]
        try:
            step, rest = _step(t, y)
            steps.append(step)
        except ReturnsError as fault:
            pulse, rest = _pulse(t, y)
            steps += pulse
            returns += [] if pulse else [fault]
            if len(returns) > MOST_RETURNS:
                break
        except ValueError:
            if not (steps or returns):
                raise
            break
        first += rest
    if not steps:
        raise returns[0]
    distinct = tuple(_distinct(time, running_median(samples), steps))
    if not distinct:
        size = f"{abs(steps[0].size):.2g} at {steps[0].at:.4g} s"
        raise ValueError(f"no step stands out: at rest it moves as much as by {size}")
    return distinct


def _distinct(time: Array, smooth: Array, steps: Sequence[DetectedStep]) -> Iterator[DetectedStep]:
    """Yield the steps that are larger than what the response does elsewhere at rest."""
    ends = [*(int(np.searchsorted(time, step.at)) for step in steps), len(time) - 1]
    moves, lasts = [], []
    for step, begin, end in zip(steps, ends, ends[1:], strict=False):
        way = np.abs(smooth[begin : end + 1] - step.level)
        gone = min(int(np.argmax(way >= REACHED * abs(step.size))), len(way) - 1)
        peak = _first_peak(way, gone)
        moves.append(float(way[peak]))
        lasts.append(max(int(np.argmax(way >= REACHED * way[peak])), 1))
    rested = [0, *(int(b + TIMES_OF_STEP * lag) for b, lag in zip(ends, lasts, strict=False))]
    rests = [smooth[begin:end] for begin, end in zip(rested, ends, strict=True)]
    for step, move, lag in zip(steps, moves, lasts, strict=True):
        if move > WANDER * max(_wander(rest, lag) for rest in rests):
            yield step


def _wander(rest: Array, lag: int) -> float:
    """Return the largest move (in ``lag`` samples) of a response at rest (M,), 0 of few samples.

    A rest too short to show it shows less; a random walk goes with the root of the time.
    """
    shown = min(lag, len(rest) // 2)
    if shown == 0:
        return 0.0
    return float(np.max(np.abs(rest[shown:] - rest[:-shown])) * np.sqrt(lag / shown))


def departure(time: Array, samples: Array) -> Onset:
    """Return when a response (M,) leaves its rest, whether it stays away or returns.

    Raises ValueError like ``find_step``, but for what leaves no lasting change.
    """
    rest = _left_rest(time, samples)
    return _onset(time, samples, rest, len(samples) - 1)


@dataclass(frozen=True, eq=False)
class _LeftRest:
    """A response that leaves its rest: smoothed (M,), its noise, ``level`` and how far it goes.

    It is last near the level at the sample ``left``, and first beyond ``far`` at ``gone``.
    """

    smooth: Array
    scatter: float
    level: float
    far: float
    left: int
    gone: int


def _left_rest(time: Array, samples: Array) -> _LeftRest:
    """Return where a response leaves its rest; raises ValueError where it does not."""
    if len(samples) < 2 * SAMPLES_AT_REST:
        raise ValueError(
            f"{len(samples)} samples: a step is detected in at least {2 * SAMPLES_AT_REST}"
        )
    scatter, smooth = noise(samples), running_median(samples)
    far = _departure(smooth, scatter)
    left, gone = _crossing(time, np.abs(smooth - median(samples[:SAMPLES_AT_REST])), far)
    level = float(median(samples[max(left - REST_TIMES * (gone - left), 0) : left + 1]))
    return _LeftRest(smooth, scatter, level, far, left, gone)


def _step(time: Array, samples: Array) -> tuple[DetectedStep, int]:
    """Return the first step, and where the response to it has settled."""
    rest = _left_rest(time, samples)
    moves_until, start, end = _settled(rest)
    size = float(median(samples[start : end + 1])) - rest.level
    if abs(size) < rest.far:
        begin = f"what begins at {time[rest.left]:g} s"
        raise ReturnsError(f"no step: {begin} leaves no lasting change")
    sets_out = _onset(time, samples, rest, max(start, rest.gone))
    until = float(time[moves_until])
    return DetectedStep(sets_out.at, sets_out.error, size, rest.level, until), start


def _pulse(time: Array, samples: Array) -> tuple[list[DetectedStep], int]:
    """Return the two steps of a response that returns, and where it has settled.

    There is none where it does not stand between them for as long as ``STANDS_FOR`` and
    ``SHORTEST_PULSE`` say.
    """
    rest = _left_rest(time, samples)
    _, settled, end = _settled(rest)
    way = np.abs(rest.smooth[: settled + 1] - rest.level)
    peak = _first_peak(way, min(rest.gone, settled))
    reached = int(np.argmax(way >= PULSE_REACHED * way[peak]))
    t, y = time[reached : end + 1], samples[reached : end + 1]
    try:
        top = _left_rest(t, y)
        back, _ = _step(t, y)
        sets_out = _onset(time, samples, rest, peak)
    except ValueError:
        return [], settled
    stands = top.left >= STANDS_FOR * (top.gone - top.left)
    if not stands or back.at - sets_out.at < SHORTEST_PULSE:
        return [], settled
    size, until = back.level - rest.level, float(time[reached])
    return [DetectedStep(sets_out.at, sets_out.error, size, rest.level, until), back], settled


def _onset(time: Array, samples: Array, rest: _LeftRest, last: int) -> Onset:
    """Return when a response sets out, by its samples up to the ``last``.

    Raises ValueError where too few of them are before.
    """
    far_off = np.abs(samples - rest.smooth) > SPIKE_LIMIT_OF_RESPONSE * rest.scatter
    clean = np.where(far_off, rest.smooth, samples)
    peak = _first_peak(np.abs(rest.smooth[: last + 1] - rest.level), rest.gone)
    # what is slower than noise from sample to sample moves an instant as well
    at_rest = float(spread(clean[max(rest.left - LONGEST_REST, 0) : rest.left + 1]))
    sets_out = onset(time, clean, rest.level, peak, max(rest.scatter, at_rest))
    if sets_out.at < time[SAMPLES_AT_REST - 1]:
        raise _early(time)
    return sets_out


def _first_peak(way: Array, gone: int) -> int:
    """Return where a way from rest is longest before it becomes much shorter."""
    longest = np.maximum.accumulate(way[gone:])
    passed = np.flatnonzero(way[gone:] < (1.0 - PEAK_PASSED) * longest)
    return gone + int(np.argmax(way[gone : gone + int(passed[0])] if len(passed) else way[gone:]))


def _early(time: Array) -> MovesFromStartError:
    return MovesFromStartError(
        f"it moves from the very beginning, {time[0]:g} s: no rest before a step"
    )


def _departure(smooth: Array, scatter: float) -> float:
    """Return how far from its level the response moves; raises ValueError where it does not."""
    change = float(np.ptp(smooth))
    if change <= LEAST_CHANGE * scatter:
        raise ValueError(
            f"no step stands out: the largest change is {change:.3g}, the noise {scatter:.3g}"
        )
    return max(DEPARTURE[0] * change, DEPARTURE[1] * scatter)


def running_median(samples: Array) -> Array:
    """Return the running median (M,), mirrored at the ends."""
    padded = np.pad(samples, MEDIAN_SAMPLES // 2, mode="reflect")
    return np.asarray(median(sliding_window_view(padded, MEDIAN_SAMPLES), axis=-1))


def _crossing(time: Array, way: Array, far: float) -> tuple[int, int]:
    """Return where a way from rest is last near it, and where it is first farther than ``far``.

    Raises a ValueError where it is so from the beginning.
    """
    gone = int(np.argmax(way > far))
    if gone < SAMPLES_AT_REST:
        raise _early(time)
    near = np.flatnonzero(way[:gone] <= DEPARTURE_BEGUN * far)
    return (int(near[-1]) if len(near) else 0), gone


def _settled(rest: _LeftRest) -> tuple[int, int, int]:
    """Return until where the response moves quickly, and the first and last place of its rest."""
    smooth, left, gone = rest.smooth, rest.left, rest.gone
    lag = gone - left
    patience = REST_TIMES * lag
    speed = np.abs(smooth[lag:] - smooth[:-lag])
    quick = max(
        LEAST_SPEED[0] * np.max(speed[left : gone + patience]), LEAST_SPEED[1] * rest.scatter
    )
    moves = np.flatnonzero(speed[left:] > quick) + left
    pauses = np.flatnonzero(np.diff(moves) > patience)
    end = int(moves[pauses[0] + 1]) if len(pauses) else len(smooth) - 1
    until = int(moves[pauses[0]] if len(pauses) else moves[-1]) + lag if len(moves) else gone
    return min(until, end), max(end - patience, gone), end
