"""The legs of a further start of a search: the linear phase, a coarse grid, the case's own grid.

Each only has to come near enough for the next one: docs/methods.md has what was measured.
"""

from dataclasses import dataclass

from exfit.estimate import Descent
from exfit.fitting.forms.coarse import coarse_form
from exfit.fitting.forms.compression import compressed
from exfit.fitting.forms.linear import linear_form
from exfit.fitting.residuals import Residuals, SideBySide

LINEAR_ITERATIONS = 40  # with 25 of them one start in fifty ends elsewhere
COARSE_ITERATIONS = 50  # where limits make the cost creep from kink to kink
NEAR = 1e-3  # of the cost: what the next leg gains in an iteration or two
NEAR_STEP = 1e-6  # units


@dataclass(frozen=True)
class Legs:
    """The descents of a further start, one after the other.

    ``direct`` leave out the linear phase; ``no_linear_phase`` says why it has no meaning, "" where
    it has one: then ``linear`` begin with it.
    """

    direct: tuple[Descent, ...]
    linear: tuple[Descent, ...]
    no_linear_phase: str = ""


def legs_of(residuals: Residuals, own: Descent) -> Legs:
    """Return the legs that end with the ``own`` descent of a case, whose residuals these are.

    Only its bounds and units are those of the others: they do not depend on the case's methods and
    tolerances.
    """
    coarse = coarse_form(residuals)
    linear = linear_form(coarse)
    direct = (_leg(coarse, own, "lm-then-dgn", COARSE_ITERATIONS), own)
    if isinstance(linear, str):
        return Legs(direct, direct, linear)
    return Legs(direct, (_leg(linear, own, "lm", LINEAR_ITERATIONS), *direct))


def _leg(residuals: Residuals, own: Descent, method: str, iterations: int) -> Descent:
    return Descent(
        functions=SideBySide(compressed(residuals)),
        bounds=own.bounds,
        method=method,
        max_iterations=iterations,
        ftol=NEAR,
        xtol=NEAR_STEP,
        x_scale=own.x_scale,
    )
