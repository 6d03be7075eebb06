"""Find the steps of a reference that was not recorded, in the response to them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from exfit.dsp.noise import noise, spread
from exfit.dsp.sampling import present_samples
from exfit.util.arrays import Array, median, median_step

SAMPLES_AT_REST = 10  # before a step: fewer do not determine the level it starts from
MEDIAN_SAMPLES = 7  # of a running median: three may be spikes
EXCHANGES = (
    (0, 5), (0, 3), (1, 6), (2, 4), (0, 1), (3, 5), (2, 6),
    (2, 3), (3, 6), (4, 5), (1, 4), (1, 3), (3, 4),
)  # fmt: skip
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

# of the onset: the rise from rest is compared with step responses of chains of lags
LAGS_IN_CHAIN = (1, 2, 3, 4)  # whose step responses are the shapes that a rise may have
LAGS = np.geomspace(0.02, 8.0, 14)  # each, of the time that the rise takes
SHORTEST_LAG = 0.02  # of a sample: with it the rise is a jump
TRIED_INSTANTS = 120
TRIED_TOGETHER = 40  # of these: their shapes stay in the cache of the processor
SOUGHT_BEFORE = 1.5  # times the rise: how long before its first sample the response may set out
COMPARED_RISE, LESS_OF_IT = 0.5, 0.5  # of the first move, and of that, until a shape fits
LEAST_RISE = 6.0  # times the noise: less of a rise shows no shape
FEWEST_RISING = 3  # samples: fewer show no shape either
HARDLY_MOVED = 0.2  # of the compared rise: until there the response may rest
COMPARED_REST = 4.3  # times the rise; a whole number would end at a sample, or by rounding not
FEWEST_RESTING = 20  # samples of the rest that is compared
MOST_SAMPLES = 200  # of rest and rise; of more, neighbours are averaged
FITTED_VALUES = 4  # level, size, instant and lag
CHI_SQUARE = 3.84  # of one degree of freedom: exceeded by chance in 5 of 100
FIT_QUANTILE = 1.0  # standard deviations of chi-square: a misfit beyond is one of the shape
SHAPE_ERROR = 0.15  # of the rise: by so much no shape is that of the response
SLOW_ERROR = 0.03  # of the whole rise: its first part, which fits, may be that of what is filtered
CLOCK_ERROR = 0.25  # of a sample
NOISELESS = 1e-9  # of the rise: the least noise, as numbers are rounded


class MovesFromStartError(ValueError):
    """A response without a rest before it moves."""


class ReturnsError(ValueError):
    """A response that leaves its rest and returns to it."""


class Onset(NamedTuple):
    """The interval (s) that holds the instant at which a response sets out, at 95 %."""

    earliest: float
    latest: float

    @property
    def at(self) -> float:
        """The middle of the interval, s."""
        return 0.5 * (self.earliest + self.latest)

    @property
    def error(self) -> float:
        """Half the interval, s."""
        return 0.5 * (self.latest - self.earliest)


@dataclass(frozen=True)
class DetectedStep:
    """A step of the reference as one signal shows it.

    ``at`` is its instant (s), which lies within ``error`` (s) of it at 95 %, ``size`` the change of
    the signal that lasts, with its sign, and ``level`` where it stood before, both in its unit. A
    response moves quickly ``until`` an instant (s). Where it moves ``from_start``, its first
    sample, the step was made there or before; a signal that ``jumps`` between levels is no
    response.
    """

    at: float
    error: float
    size: float
    level: float
    until: float = -inf
    from_start: bool = False
    jumps: bool = False


def find_step(time: Array, samples: Array) -> DetectedStep:
    """Find the first step of a reference in its response (M,), which is at rest before it.

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


def first_step(time: Array, samples: Array) -> DetectedStep | None:
    """Find the first step as `find_step` does, in the samples (M,) that are not missing (nan).

    It is None where there is none.
    """
    try:
        return find_step(*present_samples(time, samples))
    except ValueError:
        return None


def find_steps(time: Array, samples: Array, shaped: bool = True) -> tuple[DetectedStep, ...]:
    """Find all steps of a reference in its response (M,), of which ``find_step`` finds the first.

    Where they are not ``shaped`` their instants are not sought by the shape of the rise: the errors
    are those of any shape, in a third of the time.

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
            step, rest = _step(t, y, shaped)
            steps.append(step)
        except ReturnsError as fault:
            pulse, rest = _pulse(t, y, shaped)
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
        raise ValueError(f"no step stands out: at rest the signal moves as much, by {size}")
    return distinct


def _distinct(time: Array, smooth: Array, steps: Sequence[DetectedStep]) -> Iterator[DetectedStep]:
    """Select the steps that are larger than what the response does elsewhere at rest."""
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
    """Find the largest move in ``lag`` samples of a response at rest (M,), 0 of few samples.

    A rest too short to show it shows less; a random walk goes with the root of the time.
    """
    shown = min(lag, len(rest) // 2)
    if shown == 0:
        return 0.0
    return float(np.max(np.abs(rest[shown:] - rest[:-shown])) * np.sqrt(lag / shown))


def departure(time: Array, samples: Array) -> Onset:
    """Find when a response (M,) leaves its rest, whether it stays away or returns.

    Raises ValueError like ``find_step``, but for what leaves no lasting change.
    """
    rest = _left_rest(time, samples)
    return _onset(time, samples, rest, len(samples) - 1)


class _LeftRest(NamedTuple):
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
    if len(samples) < 2 * SAMPLES_AT_REST:
        raise ValueError(
            f"{len(samples)} samples: a step is detected in at least {2 * SAMPLES_AT_REST}"
        )
    scatter, smooth = noise(samples), running_median(samples)
    change = float(np.ptp(smooth))
    if change <= LEAST_CHANGE * scatter:
        raise ValueError(
            f"no step stands out: the largest change is {change:.3g}, the noise {scatter:.3g}"
        )
    far = max(DEPARTURE[0] * change, DEPARTURE[1] * scatter)
    way = np.abs(smooth - median(samples[:SAMPLES_AT_REST]))
    gone = int(np.argmax(way > far))
    if gone < SAMPLES_AT_REST:
        raise _early(time)
    near = np.flatnonzero(way[:gone] <= DEPARTURE_BEGUN * far)
    left = int(near[-1]) if len(near) else 0
    level = float(median(samples[max(left - REST_TIMES * (gone - left), 0) : left + 1]))
    return _LeftRest(smooth, scatter, level, far, left, gone)


def _step(time: Array, samples: Array, shaped: bool = True) -> tuple[DetectedStep, int]:
    """Find the first step, and the place where the response to it has settled."""
    rest = _left_rest(time, samples)
    moves_until, start, end = _settled(rest)
    size = float(median(samples[start : end + 1])) - rest.level
    if abs(size) < rest.far:
        begin = f"what begins at {time[rest.left]:g} s"
        raise ReturnsError(f"no step: {begin} leaves no lasting change")
    sets_out = _onset(time, samples, rest, max(start, rest.gone), shaped)
    until = float(time[moves_until])
    return DetectedStep(sets_out.at, sets_out.error, size, rest.level, until), start


def _pulse(time: Array, samples: Array, shaped: bool) -> tuple[list[DetectedStep], int]:
    """Find the two steps of a response that returns, and the place where it has settled.

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
        back, _ = _step(t, y, shaped)
        sets_out = _onset(time, samples, rest, peak, shaped)
    except ValueError:
        return [], settled
    stands = top.left >= STANDS_FOR * (top.gone - top.left)
    if not stands or back.at - sets_out.at < SHORTEST_PULSE:
        return [], settled
    size, until = back.level - rest.level, float(time[reached])
    return [DetectedStep(sets_out.at, sets_out.error, size, rest.level, until), back], settled


def _onset(time: Array, samples: Array, rest: _LeftRest, last: int, shaped: bool = True) -> Onset:
    """Find when a response sets out, by its samples up to the ``last``.

    Raises ValueError where too few of them are before.
    """
    far_off = np.abs(samples - rest.smooth) > SPIKE_LIMIT_OF_RESPONSE * rest.scatter
    clean = np.where(far_off, rest.smooth, samples)
    peak = _first_peak(np.abs(rest.smooth[: last + 1] - rest.level), rest.gone)
    # what is slower than noise from sample to sample moves an instant as well
    at_rest = float(spread(clean[max(rest.left - LONGEST_REST, 0) : rest.left + 1]))
    found = onset if shaped else _onset_of_any_shape
    sets_out = found(time, clean, rest.level, peak, max(rest.scatter, at_rest))
    if sets_out.at < time[SAMPLES_AT_REST - 1]:
        raise _early(time)
    return sets_out


def _first_peak(way: Array, gone: int) -> int:
    """Find where a way from rest is longest before it becomes much shorter."""
    longest = np.maximum.accumulate(way[gone:])
    passed = np.flatnonzero(way[gone:] < (1.0 - PEAK_PASSED) * longest)
    return gone + int(np.argmax(way[gone : gone + int(passed[0])] if len(passed) else way[gone:]))


def _early(time: Array) -> MovesFromStartError:
    return MovesFromStartError(
        f"it moves from the very beginning, {time[0]:g} s: no rest before a step"
    )


def running_median(samples: Array) -> Array:
    """Running median (M,) of samples, mirrored at the ends.

    Source: Devillard 1998 (thirteen exchanges leave the median of seven in the middle).
    """
    padded = np.pad(samples, MEDIAN_SAMPLES // 2, mode="reflect")
    shifted = [padded[k : k + len(samples)] for k in range(MEDIAN_SAMPLES)]
    for a, b in EXCHANGES:
        lower, upper = shifted[a], shifted[b]
        shifted[a], shifted[b] = np.minimum(lower, upper), np.maximum(lower, upper)
    return shifted[MEDIAN_SAMPLES // 2]


def block_medians(time: Array, samples: Array, block: int) -> tuple[Array, Array]:
    """Mean instants and medians of whole blocks of so many samples (M,)."""
    if block == 1:
        return time, samples
    whole = len(time) // block * block
    return (
        np.mean(time[:whole].reshape(-1, block), axis=1),
        np.median(samples[:whole].reshape(-1, block), axis=1),
    )


def _settled(rest: _LeftRest) -> tuple[int, int, int]:
    """Find the end of its quick moves, and the first and last place of the rest after them."""
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


# ---- the onset


def onset(time: Array, samples: Array, level: float, peak: int, scatter: float) -> Onset:
    """Find the interval in which a response (M,) sets out from its rest.

    The rise is compared with the step responses of chains of one to four equal lags, from a jump
    to a power of time, up to half of the ``peak`` of the first move, and up to less where no shape
    fits within the ``scatter`` of the noise. The interval holds the instants whose best shape
    exceeds the best of all by no more than chi-square does at 95 %, and what such a shape errs by.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite, without spikes.
        level: where they rest.
        peak: the sample at which the first move ends.
        scatter: the standard deviation of the noise.
    """
    whole = 0.0
    for rest_end, end in _rises(np.abs(samples[: peak + 1] - level), scatter):
        rise = float(time[end] - time[rest_end])
        whole = max(whole, rise)
        first = int(np.searchsorted(time, time[rest_end] - COMPARED_REST * rise))
        window = slice(max(min(first, rest_end - FEWEST_RESTING), 0), end + 1)
        block = -(-(window.stop - window.start) // MOST_SAMPLES)
        t, y = _block_means(time[window], block), _block_means(samples[window], block)
        lowest = max(float(time[rest_end] - SOUGHT_BEFORE * rise), t[0])
        instants = np.linspace(lowest, t[-1], TRIED_INSTANTS, endpoint=False)
        costs = _costs(t, y, instants)
        least, freedom = float(np.min(costs)), max(len(y) - FITTED_VALUES, 1)
        left, known = least / freedom, max(scatter / sqrt(block), NOISELESS * float(np.ptp(y))) ** 2
        interval = interval_below(instants, costs, least + CHI_SQUARE * max(known, left))
        margin = SHAPE_ERROR * rise + SLOW_ERROR * whole + CLOCK_ERROR * median_step(t)
        result = Onset(interval.earliest - margin, interval.latest + margin)
        if left <= known * (1.0 + FIT_QUANTILE * sqrt(2.0 / freedom)):
            break
    return result


def _onset_of_any_shape(
    time: Array, samples: Array, level: float, peak: int, scatter: float
) -> Onset:
    """Find the interval in which `onset` seeks that of a response (M,), whatever its shape."""
    rest_end, end = next(_rises(np.abs(samples[: peak + 1] - level), scatter))
    earliest = time[rest_end] - SOUGHT_BEFORE * (time[end] - time[rest_end])
    return Onset(max(float(earliest), float(time[0])), float(time[end]))


def _rises(way: Array, scatter: float) -> Iterator[tuple[int, int]]:
    """Give the beginning and the end of less and less of a rise, by the ``way`` (M,) from rest."""
    size = float(np.max(way))
    far = max(COMPARED_RISE * size, min(LEAST_RISE * scatter, size))
    while True:
        end = max(int(np.argmax(way >= far)), 1)
        near = np.flatnonzero(way[:end] <= max(HARDLY_MOVED * far, scatter))
        rest_end = int(near[-1]) if len(near) else 0
        yield rest_end, end
        far *= LESS_OF_IT
        if far < LEAST_RISE * scatter or end - rest_end < FEWEST_RISING:
            return


def _block_means(samples: Array, block: int) -> Array:
    """Means of whole blocks of samples, counted from the end."""
    if block == 1:
        return samples
    return np.asarray(np.mean(samples[len(samples) % block :].reshape(-1, block), axis=1))


def interval_below(instants: Array, costs: Array, limit: float) -> Onset:
    """Find the first and last instant at which costs (N,) cross a limit, in lines between them.

    Where they are below it at an end, that is the end.
    """
    inside = np.flatnonzero(costs <= limit)
    first, last = int(inside[0]), int(inside[-1])

    def crossing(within: int, beyond: int) -> float:
        if not 0 <= beyond < len(costs):
            return float(instants[within])
        share = (limit - costs[within]) / (costs[beyond] - costs[within])
        return float(instants[within] + share * (instants[beyond] - instants[within]))

    return Onset(crossing(first, first - 1), crossing(last, last + 1))


def _costs(time: Array, samples: Array, instants: Array) -> Array:
    """Least sums of squares (N,) that any shape from each instant on leaves.

    Level and size are eliminated (Golub and Pereyra 1973).
    """
    lags = np.maximum(LAGS * float(time[-1] - instants[0]), SHORTEST_LAG * median_step(time))
    y = samples - np.mean(samples)
    y -= np.mean(y)  # of a small move on a large level
    beside = np.column_stack([y, np.ones(len(y))])
    costs = np.full(len(instants), y @ y)
    for begin in range(0, len(instants), TRIED_TOGETHER):
        tried = slice(begin, begin + TRIED_TOGETHER)
        moved = int(np.searchsorted(time, instants[begin], side="right"))  # before, shapes are 0
        since = np.maximum(time[moved:] - instants[tried, None], 0.0)
        ago = (since[:, None, :] / lags[:, None]).reshape(-1, len(time) - moved)
        # of a chain of n equal lags: 1 - exp(-x) (1 + x + ... + x^(n-1) / (n-1)!)
        term = np.exp(-ago)
        shape = 1.0 - term
        gains = np.zeros(len(ago))
        for order in LAGS_IN_CHAIN:
            if order > 1:
                term *= ago
                term /= order - 1
                shape -= term
            along, total = (shape @ beside[moved:]).T
            size = np.einsum("nm,nm->n", shape, shape) - total**2 / len(time)  # without the mean
            np.divide(along**2, size, out=along, where=size > 0.0)
            np.maximum(gains, along, out=gains, where=size > 0.0)
        costs[tried] -= np.max(gains.reshape(-1, len(lags)), axis=1)
    return costs
