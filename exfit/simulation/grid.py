"""The grid of a simulation: equal steps between the changes of its inputs."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ON_GRID = 1e-6  # of a step: a sample that near to a grid point lies on it


class GridSegment(NamedTuple):
    """Equal steps of the grid between two changes of the inputs."""

    start: float
    step: float
    steps: int

    @property
    def end(self) -> float:
        """Where it ends, s."""
        return self.start + self.step * self.steps

    @property
    def times(self) -> Array:
        """Its grid points (n + 1,), s."""
        return np.linspace(self.start, self.end, self.steps + 1)
