"""The features of a noisy step response, with the error that the noise leaves them.

A maximum of noisy samples is too high, and the last of them outside a band too late. So the record
is smoothed: what differs from a simulated response, a small and slow function, by a penalised
spline. What is left is noise, whose way through to the features is drawn at random.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot
from random import Random
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.features import TIMES, Features, features_after, figures_of
from exfit.util.sorting import distinct, median

Array = NDArray[np.float64]

SEED = 421  # any: what matters is that a run can be repeated
DRAWS = 200  # of the noise: enough for the deviation to 5 %
SEGMENTS = 40  # of the spline, over the root of the time: a response is fast first, then slow
DEGREE = 3
MOST_SMOOTHED = 4000  # samples: of more, means of neighbours are smoothed
MOST_READ = 2000  # points of a curve that features are read off
SMOOTHNESS = np.logspace(-6.0, 8.0, 43)  # of the penalty, beside the squares of the samples
COST_OF_FREEDOM = 1.0  # by generalised cross-validation, against smoothing too little
FEWEST_SMOOTHED = 20  # samples
NORMAL_95 = 1.96  # standard deviations
SAMPLING_ERROR = 0.05  # of the time between samples
MOST_WITHOUT = 0.05  # of the draws may lack a feature that is stated
NOT_SEEN = "the noise does not show it"


class _Spline(NamedTuple):
    """A smoothing in coordinates in which samples are independent.

    ``basis`` (K, N) leads from coordinates (N,) to a curve, ``shrunk`` (N,) is the share of each
    that is kept, ``at`` (N,) are the coordinates of the samples, ``noise`` is the standard
    deviation of each.
    """

    basis: Array
    shrunk: Array
    at: Array
    noise: float


@dataclass(frozen=True, eq=False)
class RecordedResponse:
    """A record (M,) of a response beside a simulated one, from a step until the next one, s."""

    time: Array
    measured: Array
    simulated: Array
    step_at: float
    until: float

    @cached_property
    def after(self) -> NDArray[np.bool_]:
        """Which samples are those of the response."""
        return (self.time >= self.step_at) & (self.time <= self.until)

    @cached_property
    def before(self) -> NDArray[np.bool_]:
        """Which samples show where it starts."""
        return self.time < self.step_at


def recorded_features(response: RecordedResponse) -> Features | None:
    """Return the features of the record, each with its error at 95 %, or the reason for none.

    Source: Eilers & Marx 1996 (penalised splines); Hjort & Glad 1995 (a smooth correction of a
    parametric start); Davison & Hinkley 1997, section 5.2 (the basic bootstrap interval).
    """
    t = response.time[response.after] - response.step_at
    if len(t) < FEWEST_SMOOTHED:
        return _as_sampled(response)
    read = distinct(np.linspace(0, len(t) - 1, min(len(t), MOST_READ)).astype(int))
    error = response.measured[response.after] - response.simulated[response.after]
    spline = _smoothing(t, error, t[read])
    guide = response.simulated[response.after][read]
    initial, initial_error = _level_before(response, guide, spline)

    smooth = spline.shrunk * spline.at
    own = features_after(t[read], guide + spline.basis @ smooth, initial)
    if own is None:
        return None
    spread = spline.noise * np.sqrt(spline.shrunk)
    normal = _normal(DRAWS, len(smooth) + 1)
    drawn, levels = smooth + spread * normal[:, 1:], initial + initial_error * normal[:, 0]
    between_samples = SAMPLING_ERROR * float(median(np.diff(t)))
    curves = figures_of(t[read], guide + drawn @ spline.basis.T, levels)
    return _with_errors(own, curves, between_samples)


def _normal(count: int, size: int) -> Array:
    """Return vectors (count, size) of the normal law, always the same ones: those of Random.gauss.

    Source: Box & Muller 1958. numpy.random takes longer to import than all of this.
    """
    pairs = -(-count * size // 2)
    words = np.frombuffer(Random(SEED).randbytes(16 * pairs), "<u4").reshape(pairs, 2, 2)
    uniform = ((words[..., 0] >> 5) * 2.0**26 + (words[..., 1] >> 6)) / 2.0**53
    angle, radius = 2.0 * np.pi * uniform[:, 0], np.sqrt(-2.0 * np.log(1.0 - uniform[:, 1]))
    both = np.column_stack([np.cos(angle) * radius, np.sin(angle) * radius])
    return both.ravel()[: count * size].reshape(count, size)


def _as_sampled(response: RecordedResponse) -> Features | None:
    """Return the features of a record that is too short to be smoothed."""
    t = response.time[response.after] - response.step_at
    y = response.measured[response.after]
    if len(t) < 2:
        return None
    before = response.measured[response.before]
    return features_after(t, y, float(np.mean(before)) if len(before) else float(y[0]))


def _level_before(response: RecordedResponse, guide: Array, spline: _Spline) -> tuple[float, float]:
    """Return the level before the step, and its standard error."""
    before = response.measured[response.before]
    if len(before):
        scatter = float(np.std(before, ddof=1)) if len(before) > 1 else 0.0
        return float(np.mean(before)), scatter / np.sqrt(len(before))
    first = float(guide[0] + spline.basis[0] @ (spline.shrunk * spline.at))
    return first, spline.noise * float(np.linalg.norm(spline.basis[0] * spline.shrunk))


def _smoothing(t: Array, error: Array, read: Array) -> _Spline:
    """Return the smoothing of errors (M,) at t (M,), as smooth as cross-validation asks for."""
    size = -(-len(t) // MOST_SMOOTHED)
    t, error = (_block_means(values, size) for values in (t, error))
    rows = _rows(t, t[-1])
    gram = rows.T @ rows
    gram += 1e-9 * np.trace(gram) / len(gram) * np.eye(len(gram))
    penalty = np.diff(np.eye(len(gram)), 2, axis=0)
    inverse = np.linalg.inv(np.linalg.cholesky(gram))
    inner = penalty @ inverse.T
    sizes, vectors = np.linalg.eigh(inner.T @ inner)
    along = inverse.T @ vectors
    at = along.T @ (rows.T @ error)
    count = len(error)
    shares = 1.0 / (1.0 + SMOOTHNESS[:, None] * np.maximum(sizes, 0.0))
    left = float(error @ error) - np.sum(shares * (2.0 - shares) * at**2, axis=1)
    left = np.maximum(left, np.finfo(float).eps * float(error @ error))
    freedom = np.sum(shares, axis=1)
    score = left / np.maximum(count - COST_OF_FREEDOM * freedom, 1.0) ** 2
    best = int(np.argmin(score))
    noise = float(np.sqrt(left[best] / max(count - freedom[best], 1.0)))
    return _Spline(_rows(read, t[-1]) @ along, shares[best], at, noise)


def _block_means(values: Array, size: int) -> Array:
    """Return the means of blocks of so many neighbours; an incomplete last block is left out."""
    count = len(values) // size
    return np.asarray(values[: count * size].reshape(count, size).mean(axis=1))


def _rows(t: Array, last: float) -> Array:
    """Return the cubic splines (M, K) at times (M,), evenly over the root of the time."""
    place = SEGMENTS * np.sqrt(np.clip(t / last, 0.0, 1.0))
    segment = np.minimum(place.astype(int), SEGMENTS - 1)
    u = place - segment
    pieces = (
        (1.0 - u) ** 3,
        3.0 * u**3 - 6.0 * u**2 + 4.0,
        -3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0,
        u**3,
    )
    rows = np.zeros((len(t), SEGMENTS + DEGREE))
    for k, piece in enumerate(pieces):
        rows[np.arange(len(t)), segment + k] = piece / 6.0
    return rows


def _with_errors(own: Features, drawn: Mapping[str, Array], between_samples: float) -> Features:
    """Return features with their errors, by those of the responses that may be the true one.

    ``between_samples`` (s) is how well an instant between two samples is known without noise.
    """
    times, errors, why = dict[str, float | None](), dict[str, float](), dict[str, str]()
    for name, draws in drawn.items():
        value = getattr(own, name)
        if value is None:
            continue
        seen = np.isfinite(draws)
        half = NORMAL_95 * float(np.std(draws[seen])) if seen.any() else 0.0
        if name in TIMES:
            half = hypot(half, between_samples)
        if name in TIMES and (np.mean(~seen) > MOST_WITHOUT or half > value):
            times[name], why[name] = None, NOT_SEEN
        else:
            errors[name] = half
    return replace(own, **times, errors=errors, why=why)  # type: ignore[arg-type]
