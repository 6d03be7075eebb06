"""Levenberg-Marquardt whose steps are cut in half until Armijo's rule holds (update: armijo)."""

from dataclasses import dataclass, replace
from typing import Self

from exfit.estimate.damping_ratio import damped_step
from exfit.estimate.linear import LinearModel
from exfit.estimate.problem import Problem
from exfit.estimate.requests import Steps
from exfit.estimate.search import ARMIJO, Move, shorten, to_half


@dataclass(frozen=True)
class ArmijoDamping:
    """Levenberg-Marquardt: (nu I + J^T J) d = -g, of which lambda = 1, 1/2, 1/4 ... is tried.

    ``nu`` is the same everywhere; None: the norm of the gradient at each point. As in
    `RatioDamping` the identity is that of x itself, whatever its units.
    """

    nu: float | None = None
    armijo: float = ARMIJO
    phase: str = "lm"

    def handing_over(self) -> Self:
        """Return the same search: it goes on until it converges or meets its limit."""
        return self

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Try the whole damped step, then half of it."""
        nu = linear.gradient_norm if self.nu is None else self.nu
        step = damped_step(linear, nu)
        move = yield from shorten(problem, linear, step, armijo=self.armijo, cut=to_half)
        return replace(move, damping=nu, capped=nu > 0.0), self
