"""Whether the intervals of the linear theory hold: what the cost itself is at their ends."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from exfit.estimate.problem import half_square
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis

Array = NDArray[np.float64]

MOST_RISE = 2.0  # times the rise that the linear theory predicts: there an end may be 30 % off


def nonlinear_parameters(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis, of_record: Sequence[str]
) -> tuple[str, ...]:
    """Return the parameters over whose intervals the response is not linear.

    Each end of an interval is visited along the linear trace, on which the other parameters follow,
    and the rise of the cost is compared with what the linear theory predicts. ``theta`` (N,) is the
    solution; what belongs to a record, ``of_record``, is left out.

    Source: Bates & Watts 1988, chapter 7; Donaldson & Schnabel 1987.
    """
    least, rises = half_square(residuals(theta)), uncertainty.rises
    names = [
        name
        for name, end in _ends(residuals, theta, uncertainty)
        if not 1.0 / MOST_RISE <= (half_square(residuals(end)) - least) / rises[name] <= MOST_RISE
    ]
    return tuple(name for name in dict.fromkeys(names) if name not in of_record)


def _ends(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis
) -> Iterator[tuple[str, Array]]:
    """Yield both ends of each interval, with the others along, unless a bound comes before."""
    low, high = residuals.bounds
    own = np.array([free.slope(float(x)) for free, x in zip(residuals.free, theta, strict=True)])
    covariance = np.nan_to_num(uncertainty.confidence.covariance / np.outer(own, own))
    for k, free in enumerate(residuals.free):
        for limit in uncertainty.confidence.parameters[free.name].interval or ():
            if free.low < limit < free.high:
                along = covariance[:, k] / covariance[k, k] * (free.scaled(limit) - theta[k])
                end = theta + along
                if np.all((end >= low) & (end <= high)):
                    yield free.name, end
