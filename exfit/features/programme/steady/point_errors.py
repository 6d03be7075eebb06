"""Intervals of points on load that allow for the errors of values that were given."""

from collections.abc import Mapping
from dataclasses import replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from exfit.features.programme.steady.point_fit import FittedPoints, PointProblem, linearisation
from exfit.results.intervals.value_errors import first_order_shifts, widened_by

Array = NDArray[np.float64]

STEP = 0.01  # of a standard error, to either side: small beside what curves the residuals


def allowing_for_errors(
    problem: PointProblem, fit: FittedPoints, std_errors: Mapping[str, float]
) -> FittedPoints:
    """Return the fit of some points with intervals that allow for the errors of given values.

    As `intervals.value_errors.allowing_for`; derivatives by the values are central differences.
    What is free, no value of the problem, or without effect on the points is left out.
    """
    free = {parameter.name for parameter in problem.free}
    given = {*problem.given} - free
    moved = {
        name: _change(problem, fit.values, name, std_error)
        for name, std_error in std_errors.items()
        if name in given
    }
    errors = {name: change for name, change in moved.items() if change.any()}
    if not errors:
        return fit
    linear, theta = linearisation(problem, fit.values), problem.theta(fit.values)
    slopes = [parameter.slope(float(x)) for parameter, x in zip(problem.free, theta, strict=True)]
    own = problem.jacobian(theta) / slopes
    of_values = np.zeros((len(own), len(errors)))
    of_values[: len(linear.errors)] = np.stack([*errors.values()], axis=1)
    shifts = first_order_shifts(own, of_values, linear.free, bounds_hold=False)
    parameters = {
        parameter.name: widened_by(
            hypot(*moved), fit.confidence.parameters[parameter.name], parameter, x, size, [*errors]
        )
        for parameter, moved, x, size in zip(
            problem.free, shifts.tolist(), theta.tolist(), linear.own_size.tolist(), strict=True
        )
    }
    confidence = replace(fit.confidence, parameters=parameters)
    return replace(fit, confidence=confidence, allowed_for=tuple(errors))


def _change(
    problem: PointProblem, values: Mapping[str, float], name: str, std_error: float
) -> Array:
    """Change of the errors of the points (M,) by one standard error of a value."""
    change, sides = np.zeros_like(problem.errors(values)), 0
    for step in (-STEP, STEP):
        moved = problem.errors({**values, name: values[name] + step * std_error})
        if np.isfinite(moved).all():  # else the data contradict each other on this side
            change, sides = change + (moved - problem.errors(values)) / step, sides + 1
    return change / max(sides, 1)
