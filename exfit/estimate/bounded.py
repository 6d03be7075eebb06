"""Linear least squares within bounds."""

from math import inf

import numpy as np

from exfit.estimate.arrays import EPS, UNSEEN, Array, Mask, norm


def bounded_minimum(A: Array, b: Array, low: Array, high: Array, unseen: float = UNSEEN) -> Array:
    """Return y (N,), of small norm, that minimises |A y + b| over low <= y <= high; 0 lies within.

    A (M, N), b (M,); ``unseen``: the error of A, as a share of its largest singular value, below
    which a direction does not exist.

    An active set: every variable starts free unless the slope holds it on a bound; one that meets a
    bound is fixed there, and let go where the slope pulls it back.

    Source: Stark & Parker 1995, bounded-variable least squares; Lawson & Hanson 1974, ch. 23.
    """
    y, slope = np.zeros_like(low), A.T @ b
    fixed = (low == high) | ((low == 0.0) & (slope > 0.0)) | ((high == 0.0) & (slope < 0.0))
    tolerance = 10.0 * EPS * norm(A.ravel()) * norm(b)
    for _ in range(10 * len(y)):
        goal = free_minimum(A, b, y, fixed, unseen)
        blocked = (goal < low) | (goal > high)
        if blocked.any():
            y, hit = first_bound(y, goal, low, high, blocked)
            fixed = fixed | hit
            continue
        y, slope = goal, A.T @ (A @ goal + b)
        pull = np.where(fixed & (low < high), np.where(y == low, -slope, slope), 0.0)
        strongest = int(np.argmax(pull))
        if pull[strongest] <= tolerance:
            break
        fixed[strongest] = False
    return y


def free_minimum(A: Array, b: Array, y: Array, fixed: Mask, unseen: float) -> Array:
    """Return y with its free variables where |A y + b| is least, bounds or not."""
    goal = y.copy()
    rest = -(b + A[:, fixed] @ y[fixed])
    goal[~fixed] = np.linalg.lstsq(A[:, ~fixed], rest, rcond=unseen)[0]
    return goal


def first_bound(
    y: Array, goal: Array, low: Array, high: Array, blocked: Mask
) -> tuple[Array, Mask]:
    """Go from y towards the goal until a variable meets its bound; return where, and which."""
    bound = np.where(goal < low, low, high)
    share = np.full(len(y), inf)
    share[blocked] = (bound - y)[blocked] / (goal - y)[blocked]
    hit = share <= share.min()
    between = np.minimum(np.maximum(y + share.min() * (goal - y), low), high)
    return np.where(hit, bound, between), hit
