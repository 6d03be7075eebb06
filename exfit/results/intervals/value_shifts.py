"""How far the minimum of a fit moves with the values that it takes as given."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import slopes_of

Array = NDArray[np.float64]


def shifts_by_values(
    residuals: Residuals, theta: Array, deviations: Mapping[str, float], bounds_hold: bool = True
) -> Array | None:
    """Return how far each free parameter moves with each of K values, (N, K), in its own unit.

    ``deviations`` are those of the values by name. At the minimum theta (N,) the gradient stays
    zero, so that to first order the parameters move by -(J'J)^-1 J' dr/dv times the deviation of v:
    one Jacobian with a column more for each of these values gives both. A parameter on a bound
    stays there or, unless ``bounds_hold``, moves as if it were let go, the others as if it stayed.
    None where a derivative is not finite.

    Source: the implicit function theorem on the gradient, with the Gauss-Newton matrix.
    """
    jacobian = _in_own_units(residuals, theta, deviations)
    if jacobian is None:
        return None
    count, values = len(residuals.free), residuals.values(theta)
    own, of_values = jacobian[:, :count], jacobian[:, count:] * [*deviations.values()]
    moving = np.array([free.bound(values[free.name]) is None for free in residuals.free])
    return first_order_shifts(own, of_values, moving, bounds_hold)


def first_order_shifts(
    own: Array, of_values: Array, moving: NDArray[np.bool_], bounds_hold: bool
) -> Array:
    """Return by how much changes of the residuals (M, K) move each parameter, (N, K).

    ``own`` (M, N) is the Jacobian by the parameters, ``moving`` (N,) those that lie on no bound.
    """
    shifts = np.zeros((own.shape[1], of_values.shape[1]))
    if not (bounds_hold or moving.all()):
        shifts = -_least_squares(own, of_values)
    shifts[moving] = -_least_squares(own[:, moving], of_values)
    return shifts


def _least_squares(matrix: Array, right: Array) -> Array:
    """Return X (N, K) with the least norm of matrix (M, N) X - right (M, K), of small columns too.

    Source: Golub & Van Loan 2013, section 5.3.
    """
    triangle = np.linalg.qr(np.hstack([matrix, right]), mode="r")
    own, other = np.split(triangle, [matrix.shape[1]], axis=1)
    size = np.linalg.norm(own, axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(own / size, other)[0] / size[:, None])


def _in_own_units(
    residuals: Residuals, theta: Array, deviations: Mapping[str, float]
) -> Array | None:
    """Return the Jacobian by the free parameters and other values, None where not finite."""
    given = {name: residuals.fixed[name] for name in deviations}
    added = [
        FreeParameter(name, value or deviations[name], -np.inf, np.inf, logarithmic=False)
        for name, value in given.items()
    ]
    fixed = {name: value for name, value in residuals.fixed.items() if name not in given}
    extended = replace(residuals, free=[*residuals.free, *added], fixed=fixed, counter=None)
    point = np.array([*theta, *(free.scaled(given[free.name]) for free in added)])
    try:
        jacobian = extended.exact(point) / slopes_of(extended, point)
    except SimulationError:
        return None
    return jacobian if np.isfinite(jacobian).all() else None
