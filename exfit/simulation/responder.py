"""What simulates in place of equations, and what a simulator keeps of its last run."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.simulation.inputs import Direction
from exfit.util.arrays import Array

if TYPE_CHECKING:
    from exfit.simulation.simulator import Simulator

Counts = NDArray[np.int64]
Values = Mapping[str, float]


class Kept(NamedTuple):
    """Outputs (M, ny) of one parameter set, and their derivatives (M, ny, N) by directions."""

    asked: tuple[tuple[str, ...], tuple[float, ...]]
    directions: tuple[Direction, ...]
    samples: Array
    slopes: Array


class Responder(Protocol):
    """What gives the response of a simulator in place of the equations of its system."""

    def outputs(self, simulator: "Simulator") -> tuple[str, ...]:
        """Name the outputs of a response for which no others are asked."""

    def confirm(self, simulator: "Simulator", values: Values) -> None:
        """Raise SimulationError where there is no response though the start is at rest."""

    def samples_of_many(
        self,
        simulator: "Simulator",
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: "Sequence[Simulator] | None",
    ) -> tuple[Array, Counts]:
        """Simulate as `Simulator.samples_of_many`."""

    def tangents_of_many(
        self,
        simulator: "Simulator",
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: "Sequence[Simulator] | None",
    ) -> tuple[Array, Array, Counts]:
        """Simulate as `Simulator.tangents_of_many`."""
