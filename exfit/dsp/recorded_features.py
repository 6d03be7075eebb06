"""The features of a noisy step response, with the error that the noise leaves them.

A maximum of noisy samples is too high, and the last of them outside a band too late. So the record
is smoothed: what differs from a simulated response, a small and slow function, by a penalised
spline. A line of the spectrum that stands out of the rest, as of a ripple, is left out. What is
left is noise, whose way through to the features is drawn at random, with that through the fit which
the simulated response is from.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot
from random import Random
from typing import NamedTuple

import numpy as np

from exfit.dsp.features import (
    MAY_BE_MISSING,
    TIMES,
    Features,
    RemovedLine,
    features,
    features_after,
    figures_of,
)
from exfit.dsp.lines import cosine_and_sine, largest_line
from exfit.dsp.noise import noise
from exfit.util.arrays import Array, Mask, Places, distinct, median_step

SEED = 421  # any: what matters is that a run can be repeated
DRAWS = 200  # of the noise: enough for the deviation to 5 %
SEGMENTS = 40  # of the spline, over the root of the time: a response is fast first, then slow
DEGREE = 3
MOST_SMOOTHED = 4000  # samples: of more, means of neighbours are smoothed
MOST_READ = 2000  # points of a curve that features are read off
# of the penalty, beside the squares of the samples; where more were allowed, cross-validation would
# often miss a slow departure, and 90 of 100 intervals of 95 % hold the truth
SMOOTHNESS = np.logspace(-6.0, 3.0, 28)
COST_OF_FREEDOM = 1.0  # by generalised cross-validation, against smoothing too little
FEWEST_SMOOTHED = 20  # samples
NORMAL_95 = 1.96  # standard deviations
SAMPLING_ERROR = 0.05  # of the time between samples
MOST_WITHOUT = 0.05  # of the draws may lack a feature that is stated
MIDDLE = (0.025, 0.975)  # of the draws in their order
MOST_APART = 0.5  # of the error: a middle of the draws with a wider gap is of two kinds
LEFT_IS_NOISE = 1.5  # times what differs from sample to sample: beside a line, no more is left
LINE_BY_CHANCE = 0.01  # probability that white noise has a line as large: a likelier one stays
NOT_SEEN = "the noise does not show it"
EITHER = "by the noise several times are possible"


class _Smoothing(NamedTuple):
    """A smoothing in coordinates in which samples are independent.

    ``basis`` (K, N) leads from coordinates (N,) to a curve, ``shrunk`` (N,) is the share of each
    that is kept, ``at`` (N,) are the coordinates of the samples, ``noise`` is the standard
    deviation of each. ``score`` is that of the cross-validation, ``left`` (M,) the errors without
    their smooth part.
    """

    basis: Array
    shrunk: Array
    at: Array
    noise: float
    score: float
    left: Array


class FoundByRecord(NamedTuple):
    """How the response beside a record depends on the N values that were found by this record.

    ``curve`` (M, N) are the derivatives of the response, ``samples`` (M, N) those of the errors
    that a fit makes small, simulated less measured, with a line that it removed; ``step_at`` (N,)
    are those of the instant of the step.
    """

    curve: Array
    samples: Array
    step_at: Array


@dataclass(frozen=True, eq=False)
class RecordedResponse:
    """A record (M,) of a response beside a simulated one, from a step until the next one, s.

    ``found`` is what of the simulated response was found by the record: it follows the noise.
    """

    time: Array
    measured: Array
    simulated: Array
    step_at: float
    until: float
    found: FoundByRecord | None = None

    @cached_property
    def after(self) -> Mask:
        """Which samples are those of the response."""
        return (self.time >= self.step_at) & (self.time <= self.until)

    @cached_property
    def before(self) -> Mask:
        """Which samples show where it starts."""
        return self.time < self.step_at


def recorded_features(response: RecordedResponse) -> Features | None:
    """Return the features of the record, each with its error at 95 %, or the reason for none.

    Source: Eilers & Marx 1996 (penalised splines); Hjort & Glad 1995 (a smooth correction of a
    parametric start); Davison & Hinkley 1997, section 5.2 (the basic bootstrap interval).
    """
    t = response.time[response.after] - response.step_at
    if len(t) < FEWEST_SMOOTHED:
        return features(response.time, response.measured, response.step_at, response.until)
    read = distinct(np.linspace(0, len(t) - 1, min(len(t), MOST_READ)).astype(int))
    smoothing, lines = _smoothing(response, np.flatnonzero(response.after)[read])
    guide = response.simulated[response.after][read]
    before = response.simulated[response.before]
    guides = np.concatenate([guide, [np.mean(before) if len(before) else guide[0], 0.0]])

    smooth = smoothing.shrunk * smoothing.at
    *curve, initial, late = guides + smoothing.basis @ smooth
    own = features_after(t[read], np.array(curve), initial)
    if own is None:
        return None
    normal = _whitened(_normal(DRAWS, len(smooth)))
    drawn = smooth + smoothing.noise * np.sqrt(smoothing.shrunk) * normal
    curves = guides + drawn @ smoothing.basis.T
    figures = figures_of(t[read], curves[:, :-2], curves[:, -2])
    for name in ("peak_time", "settling_time", "delay"):  # since the step, wherever that is
        figures[name] = figures[name] - (curves[:, -1] - late)
    between_samples = SAMPLING_ERROR * median_step(t)
    return replace(_with_errors(own, figures, between_samples), without=lines)


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


def _whitened(normal: Array) -> Array:
    """Return vectors (count, size) with a mean of zero and a covariance of one, exactly.

    What is linear in them has its own deviation then, and not that of so many draws.
    """
    centred = np.asarray(normal - normal.mean(axis=0), dtype=np.float64)
    if len(normal) <= normal.shape[1]:
        return centred
    factor = np.linalg.cholesky(centred.T @ centred / len(normal))
    return np.asarray(np.linalg.solve(factor, centred.T).T)


def _smoothing(
    response: RecordedResponse, read: Places
) -> tuple[_Smoothing, tuple[RemovedLine, ...]]:
    """Return the smoothing of a record, without the line that stands out of it, and that line.

    Its curve corrects the simulated response at the places ``read`` (K,), then its level before the
    step and the instant of the step.
    """
    inside = response.before | response.after
    size = -(-int(np.count_nonzero(inside)) // MOST_SMOOTHED)
    none = np.zeros((len(response.time), 0))
    found = response.found or FoundByRecord(none, none, np.zeros(0))
    time, error, samples = (
        _block_means(values[inside], size)
        for values in (response.time, response.measured - response.simulated, found.samples)
    )
    ahead = response.time[inside][::size][: len(time)] < response.step_at
    has_level = bool(ahead.any())
    # the level before the step is one by itself, whatever the response does after it
    levels = ahead[:, None].astype(float)[:, :has_level]
    start = found.curve[response.before if has_level else read[:1]].mean(axis=0)
    curve = np.vstack([found.curve[read], start, found.step_at])
    on_level = np.zeros((len(curve), levels.shape[1]))
    on_level[-2] = 1.0

    last = float(response.time[read[-1]]) - response.step_at
    rows = _rows(time - response.step_at, last) * ~ahead[:, None]
    read_rows = np.zeros((len(curve), rows.shape[1]))
    read_rows[:-2] = _rows(response.time[read] - response.step_at, last)
    read_rows[-2] = 0.0 if has_level else read_rows[0]

    free, of_curve = np.hstack([samples, levels]), np.hstack([curve, on_level])
    best = plain = _smoothed(error, free, rows, of_curve, read_rows)
    lines = tuple[RemovedLine, ...]()
    for left in (error, plain.left):
        try:
            line = largest_line(time, left, np.ones(len(time), bool), free)
        except ValueError:  # the clock shows none
            break
        pair = cosine_and_sine(line.frequency, time - line.about)
        turned = (time - line.about) * (pair @ [line.sine, -line.cosine])
        with_line = np.column_stack([free, pair, turned])
        no_part = np.zeros((len(curve), 3))
        other = _smoothed(error, with_line, rows, np.hstack([of_curve, no_part]), read_rows)
        by_chance = 0.5 * len(time) * float(np.sqrt(other.score / plain.score)) ** len(time)
        # what is left scatters from sample to sample as it does altogether
        is_noise = float(np.std(other.left)) < LEFT_IS_NOISE * noise(other.left)
        if by_chance < LINE_BY_CHANCE and is_noise and other.score < best.score:
            best, lines = other, (RemovedLine(line.frequency, line.amplitude),)
    return best, lines


def _smoothed(
    error: Array, free: Array, rows: Array, of_curve: Array, read_rows: Array
) -> _Smoothing:
    """Return the smoothing of errors (M,), as smooth as cross-validation asks for.

    ``free`` (M, N) is what is found without a penalty, ``rows`` (M, S) are the splines;
    ``of_curve`` (K, N) and ``read_rows`` (K, S) are the same on the curve.
    """
    sizes = np.maximum(np.linalg.norm(free, axis=0), np.finfo(float).tiny)
    left_vectors, singular, right = np.linalg.svd(free / sizes, full_matrices=False)
    seen = singular > len(error) * np.finfo(float).eps
    outer = left_vectors[:, seen]
    back = right[seen].T / singular[seen] / sizes[:, None]
    shared = outer.T @ rows
    own = rows - outer @ shared

    gram = own.T @ own
    gram += 1e-9 * np.trace(gram) / len(gram) * np.eye(len(gram))
    penalty = np.diff(np.eye(len(gram)), 2, axis=0)
    inverse = np.linalg.inv(np.linalg.cholesky(gram))
    inner = penalty @ inverse.T
    stiffness, vectors = np.linalg.eigh(inner.T @ inner)
    along = inverse.T @ vectors
    outer_at, at = outer.T @ error, along.T @ (own.T @ error)
    rest = error - outer @ outer_at
    count = len(error)
    shares = 1.0 / (1.0 + SMOOTHNESS[:, None] * np.maximum(stiffness, 0.0))
    left = float(rest @ rest) - np.sum(shares * (2.0 - shares) * at**2, axis=1)
    left = np.maximum(left, np.finfo(float).eps * float(error @ error))
    freedom = np.sum(shares, axis=1) + len(outer_at)
    score = left / np.maximum(count - COST_OF_FREEDOM * freedom, 1.0) ** 2
    best = int(np.argmin(score))
    noise = float(np.sqrt(left[best] / max(count - freedom[best], 1.0)))
    curve = of_curve @ back
    return _Smoothing(
        basis=np.hstack([curve, (read_rows - curve @ shared) @ along]),
        shrunk=np.concatenate([np.ones(len(outer_at)), shares[best]]),
        at=np.concatenate([outer_at, at]),
        noise=noise,
        score=float(score[best]),
        left=rest - own @ (along @ (shares[best] * at)),
    )


def _block_means(values: Array, size: int) -> Array:
    """Return the means of blocks of so many neighbours; an incomplete last block is left out."""
    count = len(values) // size
    blocks = values[: count * size].reshape(count, size, *values.shape[1:])
    return np.asarray(blocks.mean(axis=1))


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
        seen = draws[np.isfinite(draws)]
        half = NORMAL_95 * float(np.sqrt(np.mean((seen - value) ** 2))) if len(seen) else 0.0
        hidden = ""
        if name in MAY_BE_MISSING:
            low, high = (round(share * len(seen)) for share in MIDDLE)
            middle = np.sort(seen)[low:high]  # with a wide gap it is of two kinds
            if len(middle) > 1 and float(np.max(np.diff(middle))) > MOST_APART * half:
                hidden = EITHER
            half = hypot(half, between_samples) if name in TIMES else half
            if len(seen) < (1.0 - MOST_WITHOUT) * len(draws) or half > value:
                hidden = NOT_SEEN
        if hidden:
            times[name], why[name] = None, hidden
        else:
            errors[name] = half
    return replace(own, **times, errors=errors, why=why)  # type: ignore[arg-type]
