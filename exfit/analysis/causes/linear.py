"""What a disturbance of the record would explain, by linear theory: no fit is made for it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.analysis.causes.evidence import Evidence
from exfit.errors import SimulationError
from exfit.fitting.uncertainty import slices

Array = NDArray[np.float64]

DEPENDENT = 1e-9  # of the longest column: a column that is shorter without the others is none


class Explained(NamedTuple):
    """The cost that is left when columns are added to a linear model, and their coefficients."""

    cost: float
    coefficients: Array


class LinearFit(NamedTuple):
    """The weighted errors (M,) of a fit, and an orthonormal basis (M, K) of what it can move."""

    errors: Array
    basis: Array

    def with_columns(self, columns: Array) -> Explained:
        """Return what is left when columns (M, C) are fitted too, beside the parameters."""
        own = columns - self.basis @ (self.basis.T @ columns)
        errors = self.errors - self.basis @ (self.basis.T @ self.errors)
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
    low, high = evidence.residuals.bounds
    moving = (evidence.solution.x > low) & (evidence.solution.x < high)
    basis, triangle = np.linalg.qr(slopes[:, moving])
    sizes = np.abs(np.diag(triangle))
    return LinearFit(errors, basis[:, sizes > DEPENDENT * np.max(sizes, initial=0.0)])


def blocks(evidence: Evidence) -> list[list[slice]]:
    """Return where the errors of each channel of each record are among all of them."""
    places = iter(slices(evidence.residuals.sizes))
    return [[next(places) for _ in each.channels] for each in evidence.residuals.experiments]
