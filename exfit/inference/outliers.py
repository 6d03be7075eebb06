"""Which of several estimates of what should be alike differ from the others: a random-effects rule.

Each estimate y_i with its standard error s_i is taken for a draw from N(mu, s_i² + tau²): the units
differ among themselves by tau, and each is known to within its own error. An estimate is compared
with what the others say of it (Viechtbauer & Cheung 2010, studentised deleted residuals), where tau
is found by moments (DerSimonian & Kacker 2007, two steps) and the degrees of freedom are those that
are left to tau (Satterthwaite 1946). Several outliers, which would hide each other, are taken out
one after the other; the last that differs decides (Rosner 1983).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.util.arrays import Array

LEVEL = 0.05  # probability that any of the estimates is called an outlier where there is none
FEWEST = 4  # estimates: of fewer, nothing says by how much they usually differ
SHARE = 5  # of the estimates one may be an outlier, and one in any case
NORMAL_MEDIAN = 0.6745  # median absolute deviation of a normal law, over its standard deviation
ROUNDING = 1e-6  # of an estimate: a smaller error is taken for this one


class Estimates(NamedTuple):
    """Estimates (N,) of what should be alike, with the standard error of each to either side."""

    values: Array
    errors_below: Array
    errors_above: Array

    def without(self, place: int) -> "Estimates":
        """Return all but one."""
        return Estimates(*(np.delete(column, place) for column in self))


class Deviations(NamedTuple):
    """Deviation of each estimate (N,) from what the others say of it.

    ``centre`` and ``spread`` are mean and standard deviation of the units without the outliers;
    ``deviation`` is in standard deviations of such a difference, ``probability`` that of any of the
    estimates to deviate as much by chance.
    """

    centre: float
    spread: float
    deviation: Array
    probability: Array
    outlier: NDArray[np.bool_]


class _Deleted(NamedTuple):
    """The deleted residuals (N,) of estimates: studentised, with their degrees of freedom."""

    residual: Array
    dof: Array


def deviations(estimates: Estimates) -> Deviations:
    """Deviations of FEWEST estimates or more from the others, and the outliers.

    Where all are alike but for a spread that is normal, the probability that any is called an
    outlier is LEVEL at most.
    """
    count = len(estimates.values)
    steps = max(1, count // SHARE)
    left, places = estimates, np.arange(count)
    removed: list[int] = []
    outliers = 0
    for step in range(1, steps + 1):
        probability = _probability(_deleted(left), steps)
        extreme = int(np.argmin(probability))
        removed.append(int(places[extreme]))
        outliers = step if probability[extreme] < LEVEL else outliers
        left, places = left.without(extreme), np.delete(places, extreme)
    return _beside_the_others(estimates, np.array(removed[:outliers], dtype=int), steps)


def _beside_the_others(estimates: Estimates, removed: NDArray[np.int_], steps: int) -> Deviations:
    """Deviation of each estimate from those that were not removed."""
    count = len(estimates.values)
    kept = np.setdiff1d(np.arange(count), removed)
    residual, probability = np.zeros(count), np.ones(count)
    among = Estimates(*(column[kept] for column in estimates))
    own = _deleted(among)
    residual[kept], probability[kept] = own.residual, _probability(own, steps)
    for place in removed:
        beside = Estimates(
            *(np.append(rest, column[place]) for rest, column in zip(among, estimates, strict=True))
        )
        every = _deleted(beside)
        residual[place] = every.residual[-1]
        probability[place] = _probability(every, steps)[-1]
    centre, variance = _centre_and_variance(among)
    outlier = np.zeros(count, dtype=bool)
    outlier[removed] = probability[removed] < LEVEL
    return Deviations(centre, float(np.sqrt(variance)), residual, probability, outlier)


def _probability(deleted: _Deleted, steps: int) -> Array:
    """Return the probability (N,) of so large a residual in any of so many steps (Bonferroni)."""
    from scipy.special import stdtr

    tail = 2.0 * stdtr(deleted.dof, -np.abs(deleted.residual))
    return np.minimum(tail * len(deleted.dof) * steps, 1.0)


def _deleted(estimates: Estimates) -> _Deleted:
    """Return the deleted residual of each estimate, from sums over all others.

    With the weights w of all, Q of the others has the expectation
    sum w v - sum w² v / sum w + tau² (sum w - sum w² / sum w), v = s², and the variance
    2 tr (P V)², of which the degrees of freedom of the whole variance follow.
    """
    shifted = estimates.values - float(np.mean(estimates.values))
    own = _mean_variance(estimates)
    weight = _weights(shifted, own)

    def others(column: Array) -> Array:
        return np.sum(column) - column

    w1, w2, w3 = (others(weight**power) for power in (1, 2, 3))
    wv, wwv, wwwv = (others(weight**power * own) for power in (1, 2, 3))
    wwvv, wwwvv = (others(weight**power * own**2) for power in (2, 3))
    centre = others(weight * shifted) / w1
    q = np.maximum(others(weight * shifted**2) - w1 * centre**2, 0.0)
    scale = w1 - w2 / w1
    tau2 = np.maximum((q - (wv - wwv / w1)) / scale, 0.0)
    facing = np.where(shifted > centre, estimates.errors_below, estimates.errors_above)
    of_centre = (wwv + tau2 * w2) / w1**2
    variance = _at_least_rounding(facing, estimates.values) ** 2 + tau2 + of_centre
    trace = (
        (wwvv + 2.0 * tau2 * wwv + tau2**2 * w2)
        - 2.0 * (wwwvv + 2.0 * tau2 * wwwv + tau2**2 * w3) / w1
        + (of_centre * w1) ** 2
    )
    most = len(shifted) - 2.0
    dof = np.minimum((variance * scale) ** 2 / np.maximum(trace, np.finfo(float).tiny), most)
    return _Deleted((shifted - centre) / np.sqrt(variance), dof)


def _centre_and_variance(estimates: Estimates) -> tuple[float, float]:
    """Return the mean of all estimates, and the variance of what they are estimates of."""
    shift = float(np.mean(estimates.values))
    shifted, own = estimates.values - shift, _mean_variance(estimates)
    weight = _weights(shifted, own)
    total = float(np.sum(weight))
    centre = float(weight @ shifted) / total
    q = float(weight @ (shifted - centre) ** 2)
    expected = float(weight @ own - weight**2 @ own / total)
    scale = total - float(weight @ weight) / total
    return shift + centre, max((q - expected) / scale, 0.0)


def _weights(shifted: Array, own: Array) -> Array:
    """Weights, of mean one, of a first estimate of tau by the median absolute deviation."""
    deviation = float(np.median(np.abs(shifted - np.median(shifted)))) / NORMAL_MEDIAN
    tau2 = max(deviation**2 - float(np.median(own)), 0.0)
    weight = 1.0 / (own + tau2)
    return weight / np.mean(weight)


def _mean_variance(estimates: Estimates) -> Array:
    mean = 0.5 * (estimates.errors_below + estimates.errors_above)
    return _at_least_rounding(mean, estimates.values) ** 2


def _at_least_rounding(errors: Array, values: Array) -> Array:
    least = ROUNDING * max(float(np.max(np.abs(values))), np.finfo(float).tiny ** 0.25)
    return np.maximum(errors, least)
