"""The arrays of the estimator and the numbers that count as nothing."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EPS = float(np.finfo(np.float64).eps)
TINY = float(np.finfo(np.float64).tiny)
UNSEEN = 1e-11  # share of the largest singular value: below it is only rounding
