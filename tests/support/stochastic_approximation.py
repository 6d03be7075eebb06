"""Stochastic approximation for many records at once: SPSA, Robbins-Monro, its Gauss-Newton form.

The first two step down the logarithm of the cost, whose slopes have one size near and far. No step
moves a parameter by more than ``LARGEST``. Gains fall as a / (k + A)^p, with A a tenth of the
iterations.

Source: Robbins & Monro 1951; Spall 1998 (SPSA and its gains); Ljung 1999, section 11.4 (recursive
Gauss-Newton).
"""

from collections.abc import Sequence

import numpy as np
from related_work import SEED, Estimate, Method, Residuals, errors_of, samples

DECAY, PERTURBATION_DECAY = 0.602, 0.101  # Spall's
SHARE_BEFORE = 0.1  # of the iterations: A
LARGEST = 0.2  # of a scaled parameter, in one step
PORTION = 0.1  # of the samples, drawn anew for each step


def gains(size: float, count: int, decay: float) -> np.ndarray:
    """Return gains (count,), the first one of a given size."""
    before = SHARE_BEFORE * count
    return size * ((1.0 + before) / (1.0 + before + np.arange(count))) ** decay


def within(points: np.ndarray, steps: np.ndarray, record: Residuals) -> np.ndarray:
    """Return points (K, N) after steps, cut to their largest size and to the bounds."""
    cut = np.clip(np.nan_to_num(steps), -LARGEST, LARGEST)
    return np.clip(points + cut, *record.bounds)


def estimates(points: np.ndarray, simulations: int) -> list[Estimate]:
    """Return the estimates at points (K, N)."""
    return [Estimate(point, simulations) for point in points]


def log_costs(records: Sequence[Residuals], points: np.ndarray) -> np.ndarray:
    """Return the logarithm of the cost (K,) at points (K, N), inf where there is none."""
    with np.errstate(all="ignore"):
        return np.log(0.5 * np.sum(errors_of(records, points) ** 2, axis=1))


def spsa(simulations: int, gain: float, perturbation: float, decay: float = DECAY) -> Method:
    """Return simultaneous perturbation: three simulations of the whole record for each step.

    Two give the slope along a random direction, the third blocks a step that makes the cost larger.
    """

    def method(records: Sequence[Residuals], starts: np.ndarray) -> list[Estimate]:
        rng, points, count = np.random.default_rng(SEED), starts, simulations // 3
        sizes = gains(perturbation, count, decay - DECAY + PERTURBATION_DECAY)
        costs = log_costs(records, points)
        for a, c in zip(gains(gain, count, decay), sizes, strict=True):
            sides = c * rng.choice([-1.0, 1.0], points.shape)
            up, down = np.clip([points + sides, points - sides], *records[0].bounds)
            rise, fall = np.split(log_costs([*records, *records], np.concatenate([up, down])), 2)
            moved = np.where(up == down, np.inf, up - down)
            with np.errstate(all="ignore"):
                trials = within(points, -a * (rise - fall)[:, None] / moved, records[0])
            costs_there = log_costs(records, trials)
            better = costs_there < costs
            points, costs = (
                np.where(better[:, None], trials, points),
                np.minimum(costs, costs_there),
            )
        return estimates(points, 3 * count)

    return method


def some_samples(
    records: Sequence[Residuals], points: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return errors (K, m) and derivatives (K, m, N) of samples drawn at random."""
    measured = np.array([samples(record) for record in records])
    errors = np.array(records[0].residuals([*points])) + measured[0] - measured
    slopes = np.array(records[0].jacobians([*points]))
    chosen = rng.choice(errors.shape[1], int(PORTION * errors.shape[1]), replace=False)
    return errors[:, chosen], slopes[:, chosen]


def robbins_monro(simulations: int, gain: float) -> Method:
    """Return steps down the exact slope of some samples' log cost, drawn anew each time."""

    def method(records: Sequence[Residuals], starts: np.ndarray) -> list[Estimate]:
        rng, points = np.random.default_rng(SEED), starts
        for a in gains(gain, simulations, DECAY):
            errors, slopes = some_samples(records, points, rng)
            gradients = np.einsum("kmn,km->kn", slopes, errors)
            costs = 0.5 * np.sum(errors**2, axis=1)
            points = within(points, -a * gradients / costs[:, None], records[0])
        return estimates(points, simulations)

    return method


def recursive_gauss_newton(simulations: int, first: float = 1.0) -> Method:
    """Return Robbins-Monro with the mean of the slopes' products as its metric."""

    def method(records: Sequence[Residuals], starts: np.ndarray) -> list[Estimate]:
        rng, points = np.random.default_rng(SEED), starts
        metric = np.zeros((*starts.shape, starts.shape[1]))
        for a in gains(first, simulations, 1.0):
            errors, slopes = map(np.nan_to_num, some_samples(records, points, rng))
            gradients = np.einsum("kmn,km->kn", slopes, errors)
            metric += max(a, SHARE_BEFORE) * (np.einsum("kmn,kmp->knp", slopes, slopes) - metric)
            steps = np.linalg.pinv(metric, rcond=1e-9, hermitian=True) @ gradients[:, :, None]
            points = within(points, -a * steps[:, :, 0], records[0])
        return estimates(points, simulations)

    return method
