"""Intervals where more than noise is left of an event with all given values fitted."""

from collections.abc import Mapping

import numpy as np

from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.intervals.value_errors import ErrorsOfValues

NOT_NOISE = 2.0  # times the errors, as measured
COUNTED_TWICE = "more than noise is left with all values fitted: errors and intervals count twice"


def counted_twice(errors: ErrorsOfValues) -> ErrorsOfValues:
    """Return what records leave of the given values twice as large."""
    return errors._replace(
        sides={
            name: (NOT_NOISE * down, NOT_NOISE * up) for name, (down, up) in errors.sides.items()
        },
        left={name: NOT_NOISE * own for name, own in errors.left.items()},
    )


def allowing_for_misfit(
    uncertainty: UncertaintyAnalysis, residuals: Residuals, values: Mapping[str, float]
) -> UncertaintyAnalysis:
    """Return the uncertainty of an event of which more than noise is left with all values fitted.

    What the model lacks moves as many parameters as far as it can: errors and the sides of the
    intervals about the fitted ``values`` count twice, which is how far they were off.
    """
    parameters = {**uncertainty.confidence.parameters}
    for free in residuals.free:
        own, at = parameters[free.name], values[free.name]
        error, relative, ends = own.std_error, own.relative_error, own.interval
        parameters[free.name] = own._replace(
            std_error=None if error is None else NOT_NOISE * error,
            relative_error=None if relative is None else NOT_NOISE * relative,
            interval=ends and (_farther(free, at, ends[0]), _farther(free, at, ends[1])),
            by_noise=own.by_noise or ends,
        )
    return uncertainty.with_parameters(parameters)


def _farther(free: FreeParameter, value: float, limit: float | None) -> float | None:
    if limit is None:
        return None
    at, bounds = free.scaled(value), (free.scaled(free.low), free.scaled(free.high))
    return free.value(float(np.clip(at + NOT_NOISE * (free.scaled(limit) - at), *bounds)))
