"""Whether the intervals of the linear theory hold: what the cost itself is at their ends."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.estimate import half_square
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.inference.confidence import CORRELATED

Array = NDArray[np.float64]

MOST_RISE = 1.25  # times the rise that linear theory predicts: there an end may be 12 % off


class TraceEnd(NamedTuple):
    """End of a parameter's linear interval: all parameters there, scaled (N,).

    ``within``: all of them lie within their bounds.
    """

    name: str
    x: Array
    within: bool


def nonlinear_parameters(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis, of_record: Sequence[str]
) -> tuple[str, ...]:
    """Return the parameters over whose intervals the response is not linear.

    Each end of an interval is visited along the linear trace, on which the other parameters follow,
    and the rise of the cost is compared with what the linear theory predicts. ``theta`` (N,) is the
    solution; what belongs to a record, ``of_record``, is left out.

    Source: Bates & Watts 1988, chapter 7; Donaldson & Schnabel 1987.
    """
    ends = [end for end in trace_ends(residuals, theta, uncertainty) if end.within]
    if not ends:
        return ()
    rises = residuals.costs([end.x for end in ends]) - half_square(residuals(theta))
    expected = np.array([uncertainty.rises[end.name] for end in ends])
    alike = (rises >= expected / MOST_RISE) & (rises <= expected * MOST_RISE)
    names = dict.fromkeys(end.name for end, linear in zip(ends, alike, strict=True) if not linear)
    return tuple(name for name in names if name not in of_record)


def not_served_by_linear_theory(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis, of_record: Sequence[str]
) -> tuple[str, ...]:
    """Return the parameters whose interval linear theory does not give, in their order.

    These are `nonlinear_parameters`, which ``uncertainty`` names, those on a bound or correlated
    with one there, those that reach a bound, or take others to one, within their interval, those
    without an interval, and those that correlate with any of these and so follow it where linear
    theory does not. ``theta`` (N,) is the solution.
    """
    leaving = {end.name for end in trace_ends(residuals, theta, uncertainty) if not end.within}
    failing = {*uncertainty.nonlinear, *uncertainty.leaning_on_bounds, *leaving}
    parameters = uncertainty.confidence.parameters
    failed = np.array([name in failing or not own.determined for name, own in parameters.items()])
    with np.errstate(invalid="ignore"):
        follows = np.abs(uncertainty.confidence.correlation.matrix[:, failed]) > CORRELATED
    not_served = failed | follows.any(axis=1)
    return tuple(
        name
        for name, fails in zip(parameters, not_served, strict=True)
        if fails and name not in of_record
    )


def trace_ends(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis
) -> Iterator[TraceEnd]:
    """Yield both ends of each linear interval, with the other parameters along."""
    low, high = residuals.bounds
    own = np.array([free.slope(float(x)) for free, x in zip(residuals.free, theta, strict=True)])
    covariance = np.nan_to_num(uncertainty.confidence.covariance / np.outer(own, own))
    for k, free in enumerate(residuals.free):
        for limit in uncertainty.confidence.parameters[free.name].interval or ():
            if limit is not None:
                along = covariance[:, k] / covariance[k, k] * (free.scaled(limit) - theta[k])
                end = theta + along
                within = free.low < limit < free.high
                yield TraceEnd(
                    free.name, end, within and bool(np.all((end >= low) & (end <= high)))
                )
