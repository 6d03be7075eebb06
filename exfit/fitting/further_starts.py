"""The further starts of a global search: where they lie, and by which legs their descents go."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from exfit.estimate import Descent, spread
from exfit.fitting.forms.legs import legs_of
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import SideBySide, SimulationCounter
from exfit.util.strategies import DEFAULT_STRATEGY

Array = NDArray[np.float64]
Way = Literal["strategy", "linear", "direct"]

DIRECT = 3  # every third start goes without the linear phase, which misleads where limits are met
MERGED = 3.0  # standard errors: linear phases that end so near lead to one minimum, 480 of 480 did
MOST_ITERATIONS = 50  # of a phase of the last leg: what takes more creeps along a valley
TO_DISTINGUISH = 1e-8  # of the cost: what a search may leave where minima are compared


@dataclass(frozen=True)
class FurtherStarts:
    """The points (S, N) from which a search goes, and the legs that the descents from them take.

    ``ways`` says what each descent begins with: "linear" the linear phase, "direct" the model
    itself. ``why_direct`` is the reason where the linear phase has no meaning.
    """

    points: Array
    legs: tuple[Descent, ...]
    ways: tuple[Way, ...]
    why_direct: str

    @property
    def merged(self) -> float | None:
        """Within how many standard errors the ends of linear phases go on as one."""
        return None if self.why_direct else MERGED

    @property
    def first_legs(self) -> tuple[int, ...]:
        """The leg that each descent begins with."""
        linear = not self.why_direct
        return tuple(int(linear and way == "direct") for way in self.ways)


def further_starts(
    problem: FitProblem, count: int, counter: SimulationCounter | None
) -> FurtherStarts:
    """Return ``count`` starts: that of the case by way of the linear phase, others over the bounds.

    ``counter`` counts the simulations of their descents.
    """
    residuals = problem.residuals.counted_by(counter)
    legs = legs_of(residuals, last_leg(problem, counter))
    direct: tuple[Way, ...] = ("direct",)
    if legs.no_linear_phase:
        points = spread(residuals.bounds, count)
        return FurtherStarts(points, legs.direct, direct * count, legs.no_linear_phase)
    by_linear: tuple[Way, ...] = ("linear",)
    ways = (by_linear * (DIRECT - 1) + direct) * count
    points = spread(residuals.bounds, count, residuals.start)
    return FurtherStarts(points, legs.linear, ways[:count], "")


def last_leg(problem: FitProblem, counter: SimulationCounter | None = None) -> Descent:
    """Return the descent of a further start on the case's own grid."""
    return Descent(
        functions=SideBySide(problem.compressed.counted_by(counter)),
        bounds=problem.residuals.bounds,
        method=DEFAULT_STRATEGY,
        max_iterations=MOST_ITERATIONS,
        ftol=TO_DISTINGUISH,
        x_scale=problem.residuals.units,
    )
