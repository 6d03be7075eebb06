"""Detect the steps of a reference that was not recorded in the response to them."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from exfit.dsp.noise import noise
from exfit.util.sorting import median

Array = NDArray[np.float64]

SAMPLES_AT_REST = 10  # before a step: fewer do not determine the level it starts from
MEDIAN_SAMPLES = 7  # of a running median: three may be spikes
LEAST_CHANGE = 8.0  # times the noise: the whole change; white noise alone reaches 5
DEPARTURE = (0.1, 5.0)  # of the whole change and times the noise: farther from its level, it moves
DEPARTURE_BEGUN = 0.2  # of a departure: nearer to its level than this it has hardly begun
REST_TIMES = 12  # times what the departure takes: at rest, it does not move for so long
LEAST_SPEED = (0.2, 4.0)  # of the step's own speed and times the noise: slower is no step
FITTED_RISE = (0.25, 20.0, 0.6)  # of the step, times the noise, but no more of it: what is fitted
FITTED_REST = 8.0  # times the later part of that rise: how much is fitted, rest and rise
SPIKE_LIMIT_OF_RESPONSE = 6.0  # times the noise: the running median replaces what lies farther off
TRIED_INSTANTS = 60  # at which the fit may start
TRIED_LAGS = (0.1, 0.2, 0.4, 0.8)  # of the later part of the rise
LAG_BOUNDS = (0.05, 1.5)  # of the same: the shortest and longest lag
FITTED_PARAMETERS = 4  # level, steepness, instant and lag


@dataclass(frozen=True)
class DetectedStep:
    """A step of the reference as the response shows it.

    ``at`` is its instant (s), ``size`` the change of the response that lasts, with its sign, and
    ``level`` where the response stood before, both in its unit. ``spread`` is the standard error
    (s) that noise leaves in ``at``; it is fitted to the first ``rise`` (s) of the response.
    """

    at: float
    size: float
    level: float
    spread: float
    rise: float


def find_step(time: Array, samples: Array) -> DetectedStep:
    """Return the first step of a reference from its response (M,), which is at rest before it.

    A voltage follows a step of its reference late and smoothly: up to a quarter of the step (more
    where noise is large) it is taken for a line through two equal lags, and ``at`` is where that
    sets out. What shape it has instead moves ``at`` by up to a tenth of the time that this takes,
    beside ``spread``. A step is detected if it is at least a tenth of all that changes in the
    record; a later one that is slower than a fifth of it passes for its settling. Without a rest
    after it, ``size`` is taken from the end of the record. Spikes and slow drift do no harm.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite.

    Raises:
        ValueError: nothing stands out of the noise or lasts, the record is at rest for fewer than
            ten samples before it moves, or it has fewer than twenty samples.
    """
    return _step(time, samples)[0]


def find_steps(time: Array, samples: Array) -> tuple[DetectedStep, ...]:
    """Return all steps of a reference from its response (M,), the first as ``find_step`` does.

    The next one is looked for where the response to the one before has settled; what is slower than
    a fifth of that one passes for its settling. Raises ValueError like ``find_step``.
    """
    step, rest = _step(time, samples)
    steps = [step]
    while True:
        time, samples = time[rest:], samples[rest:]
        try:
            step, rest = _step(time, samples)
        except ValueError:
            return tuple(steps)
        steps.append(step)


def _step(time: Array, samples: Array) -> tuple[DetectedStep, int]:
    """Return the first step, and where the response to it has settled."""
    if len(samples) < 2 * SAMPLES_AT_REST:
        raise ValueError(
            f"{len(samples)} samples: a step is detected in at least {2 * SAMPLES_AT_REST}"
        )
    scatter, smooth = noise(samples), _running_median(samples)
    departure = _departure(smooth, scatter)
    left, gone = _crossing(time, np.abs(smooth - median(samples[:SAMPLES_AT_REST])), departure)
    level = float(median(samples[max(left - REST_TIMES * (gone - left), 0) : left + 1]))
    start, end = _settled(smooth, left, gone, scatter)
    size = float(median(samples[start : end + 1])) - level
    if abs(size) < departure:
        raise ValueError(f"no step: what begins at {time[left]:g} s leaves no lasting change")
    far = min(max(FITTED_RISE[0] * abs(size), FITTED_RISE[1] * scatter), FITTED_RISE[2] * abs(size))
    left, gone = _crossing(time, (smooth - level) * np.sign(size), far)
    clean = np.where(np.abs(samples - smooth) <= SPIKE_LIMIT_OF_RESPONSE * scatter, samples, smooth)
    at, spread = _fitted(time, clean, left, gone)
    if at < time[SAMPLES_AT_REST - 1]:
        raise _early(time)
    return DetectedStep(at, size, level, spread, float(time[gone] - time[left])), start


def _early(time: Array) -> ValueError:
    return ValueError(f"it moves from the very beginning, {time[0]:g} s: no rest before a step")


def _departure(smooth: Array, scatter: float) -> float:
    """Return how far from its level the response moves; raises ValueError where it does not."""
    change = float(np.ptp(smooth))
    if change <= LEAST_CHANGE * scatter:
        raise ValueError(
            f"no step stands out: the largest change is {change:.3g}, the noise {scatter:.3g}"
        )
    return max(DEPARTURE[0] * change, DEPARTURE[1] * scatter)


def _running_median(samples: Array) -> Array:
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


def _settled(smooth: Array, left: int, gone: int, scatter: float) -> tuple[int, int]:
    """Return the first and last place of what follows the step, as long as nothing else moves."""
    lag = gone - left
    patience = REST_TIMES * lag
    speed = np.abs(smooth[lag:] - smooth[:-lag])
    quick = max(LEAST_SPEED[0] * np.max(speed[left : gone + patience]), LEAST_SPEED[1] * scatter)
    moves = np.flatnonzero(speed[left:] > quick) + left
    pauses = np.flatnonzero(np.diff(moves) > patience)
    end = int(moves[pauses[0] + 1]) if len(pauses) else len(smooth) - 1
    return max(end - patience, gone), end


def _fitted(time: Array, samples: Array, left: int, gone: int) -> tuple[float, float]:
    """Return the instant at which a line through two equal lags sets out, and its standard error.

    It is fitted to the rise, which ends at ``gone``, and the rest before it.
    Level and steepness of the line are eliminated (Golub and Pereyra 1973).
    """
    from scipy.optimize import least_squares

    rise = float(time[gone] - time[left])
    first = min(
        int(np.searchsorted(time, time[gone] - FITTED_REST * rise)), max(left - SAMPLES_AT_REST, 0)
    )
    origin = time[left]  # differences lose digits where the clock began long ago
    t, y = time[first : gone + 1] - origin, samples[first : gone + 1]
    y = y / np.ptp(y)

    def misfit(guess: Array) -> Array:
        return _misfit(t, y, guess[0], guess[1])

    instants = np.linspace(t[0], t[-1], TRIED_INSTANTS, endpoint=False)
    starts = [np.array([at, lag * rise]) for at in instants for lag in TRIED_LAGS]
    best = min(starts, key=lambda guess: float(np.sum(misfit(guess) ** 2)))
    low, high = (lag * rise for lag in LAG_BOUNDS)
    fit = least_squares(misfit, best, bounds=([t[0], low], [t[-1], high]), x_scale=rise)
    slopes = np.asarray(fit.jac)
    variance = 2.0 * fit.cost / max(len(t) - FITTED_PARAMETERS, 1)
    covariance = variance * np.linalg.pinv(slopes.T @ slopes)
    # where the whole rise lies between two samples, its place is no worse known than it is long
    return float(fit.x[0] + origin), min(float(np.sqrt(covariance[0, 0])), rise)


def _misfit(time: Array, samples: Array, at: float, lag: float) -> Array:
    """Return what the best line through two equal lags from ``at`` on leaves of the samples."""
    ago = np.maximum(time - at, 0.0) / lag
    shape = ago - 2.0 + (ago + 2.0) * np.exp(-ago)
    shape = shape - np.mean(shape)
    centred = samples - np.mean(samples)
    size = shape @ shape
    return np.asarray(centred - shape * (shape @ centred / size) if size > 0.0 else centred)
