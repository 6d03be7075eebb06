"""Intervals of dense profiles over all minima, by the true covariance of the noise.

At many values of a parameter, over the whole range between its bounds and closer about the fit, the
others are fitted anew: from each minimum that the search found, and from the truth. No value
follows from its neighbours; the interval is where the least cost is below the rise.
"""

import numpy as np
from coverage_cases import covariance_of, truth_of

from exfit.estimate import Descent
from exfit.estimate.lockstep import finish_all
from exfit.fitting.parameters import UNIT

CHI_SQUARE = 3.841  # of one degree of freedom, 95 %
OVER_BOUNDS, NEAR, ABOUT_PRINTED = 9, 15, 15  # values
BEYOND_PRINTED = 0.2  # of the printed interval, on either side of it
REACH = 4.0  # standard errors about the fit, the truth and the other minima
LIKELY = 20.0  # times the rise: minima higher than that are not followed


def dense_intervals(name, problem, search, printed):
    """Return the interval of each parameter, None for a side that does not close within bounds.

    ``printed`` are the intervals to compare with: the costs are looked at about their ends, too.
    """
    residuals, truth = problem.compressed, truth_of(name, problem)
    errors, rises = errors_and_rises(name, problem, truth)
    minima = [] if search.minima is None else [*search.minima.minima]
    highest = search.best.cost + LIKELY * max(rises)
    starts = [search.best.x, truth, *(m.x for m in minima if m.cost < highest)]
    likely = np.array(starts)
    low, high = residuals.bounds
    functions, descents, places = residuals, [], []
    for k in range(len(truth)):
        about = ends_of(printed[residuals.free[k].name], residuals.free[k], low[k], high[k])
        for value in values_of(likely[:, k], errors[k], about, low[k], high[k]):
            at_low, at_high = low.copy(), high.copy()
            at_low[k] = at_high[k] = value
            leg = Descent(
                functions=functions,
                bounds=(at_low, at_high),
                method="lm-then-dgn",
                ftol=1e-5,
                x_scale=UNIT,
            )
            for start in starts:
                descents.append(leg.begin(np.clip(start, at_low, at_high)))
                places.append((k, float(value)))
    ends = {}

    def receive(place, end):
        ends[places[place]] = min(ends.get(places[place], np.inf), end.cost)

    finish_all(descents, 1, receive)
    lowest = min(search.best.cost, *ends.values())
    return {
        parameter.name: within(
            parameter,
            np.array(sorted((x, cost) for (j, x), cost in ends.items() if j == k)),
            lowest,
            rises[k],
        )
        for k, parameter in enumerate(residuals.free)
    }


def ends_of(interval, parameter, low, high):
    """Return the ends of a printed interval, scaled, an open side ending at its bound."""
    if interval is None:
        return low, high
    ends = [None if end is None else parameter.scaled(end) for end in interval]
    return low if ends[0] is None else ends[0], high if ends[1] is None else ends[1]


def values_of(likely, error, about, low, high):
    """Return the values of a parameter, scaled, at which the others are fitted anew.

    Those of the fit, the truth and the other minima are among them: a minimum may be narrower than
    the distance of the others. So may the end of a valley, which lies ``about`` a printed end.
    """
    reach = REACH * error if np.isfinite(error) else high - low
    near = np.linspace(min(likely) - reach, max(likely) + reach, NEAR)
    more = BEYOND_PRINTED * (about[1] - about[0])
    printed = np.linspace(about[0] - more, about[1] + more, ABOUT_PRINTED)
    every = [*np.linspace(low, high, OVER_BOUNDS), *near, *printed, *likely]
    return np.unique(np.clip(every, low, high))


def errors_and_rises(name, problem, truth):
    """Return the true standard errors at the truth, and by how much the cost rises there (N,)."""
    jacobian = problem.residuals.exact(truth)
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    middle, first = np.zeros_like(inverse), 0
    for channel, size in zip(problem.residuals.channels, problem.residuals.sizes, strict=True):
        rows = jacobian[first : first + size]
        middle += channel.weight**2 * covariance_of(name, channel, rows)
        first += size
    variances = np.diag(inverse @ middle @ inverse)
    return np.sqrt(variances), 0.5 * CHI_SQUARE * variances / np.diag(inverse)


def within(parameter, points, lowest, rise):
    """Return the interval in which the least costs are below the rise, None for an open side."""
    x, height = points[:, 0], np.sqrt(np.maximum(points[:, 1] - lowest, 0.0) / rise)
    inside = np.flatnonzero(height <= 1.0)
    first, last = inside[0], inside[-1]

    def crossing(k, beyond):
        share = (1.0 - height[k]) / (height[beyond] - height[k])
        return parameter.value(float(x[k] + share * (x[beyond] - x[k])))

    low = None if first == 0 else crossing(first, first - 1)
    return low, None if last == len(x) - 1 else crossing(last, last + 1)
