"""What a disturbance of the record would explain, by linear theory: no fit is made for it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.fitting.uncertainty import slices
from exfit.verdict.causes.evidence import Evidence

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DEPENDENT = 1e-9  # of the longest column: a column that is shorter without the others is none


class Explained(NamedTuple):
    """The cost that is left when columns are added to a linear model, and their coefficients."""

    cost: float
    coefficients: Array


class LinearFit(NamedTuple):
    """The weighted errors (M,) of a fit, and an orthonormal basis (M, K) of what it can move."""

    errors: Array
    basis: Array

    def beyond(self, columns: Array) -> Array:
        """Return what of columns (M, ...) the parameters cannot do."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns), dtype=np.float64)

    def with_columns(self, columns: Array) -> Explained:
        """Return what is left when columns (M, C) are fitted too, beside the parameters."""
        own, errors = self.beyond(columns), self.beyond(self.errors)
        coefficients, *_ = np.linalg.lstsq(own, errors, rcond=DEPENDENT)
        left = errors - own @ coefficients
        return Explained(0.5 * float(left @ left), np.asarray(-coefficients, dtype=np.float64))


def linear_fit(evidence: Evidence) -> LinearFit | None:
    """Return the linear model at the solution, None where it has no finite derivatives.

    A parameter on a bound does not move.
    """
    try:
        errors, slopes = evidence.residuals.errors(evidence.solution.x)
    except SimulationError:
        return None
    if not np.isfinite(slopes).all():
        return None
    return linear_model(errors, slopes[:, moving(evidence)])


def moving(evidence: Evidence) -> Mask:
    """Return which free parameters are not on a bound."""
    low, high = evidence.residuals.bounds
    return np.asarray((evidence.solution.x > low) & (evidence.solution.x < high))


def linear_model(errors: Array, slopes: Array) -> LinearFit:
    """Return the linear model of errors (M,) by their derivatives (M, N)."""
    basis, triangle = np.linalg.qr(slopes)
    sizes = np.abs(np.diag(triangle))
    return LinearFit(errors, basis[:, sizes > DEPENDENT * np.max(sizes, initial=0.0)])


def blocks(evidence: Evidence) -> list[list[slice]]:
    """Return where the errors of each channel of each record are among all of them."""
    places = iter(slices(evidence.residuals.sizes))
    return [[next(places) for _ in each.channels] for each in evidence.residuals.experiments]
