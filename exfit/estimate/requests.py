"""What a search asks for while it runs, and who answers: residuals and Jacobians of many points.

A search is a generator. It yields a request, and is sent the answer; so many searches can be
advanced together, whose requests are answered side by side.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.arrays import Array

Function = Callable[[Array], ArrayLike]
Done = TypeVar("Done")


class Functions(Protocol):
    """What is made small: residuals of several points at once, and their Jacobians."""

    def residuals(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return the residuals (M,) at each of S points (N,), not finite where there are none."""

    def jacobians(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return the Jacobian (M, N) at each of S points (N,), not finite where there is none."""


@dataclass(frozen=True, eq=False, slots=True)
class ResidualsAt:
    """Asks for the residuals at some points (N,)."""

    functions: Functions
    points: Sequence[Array]


@dataclass(frozen=True, eq=False, slots=True)
class JacobianAt:
    """Asks for the Jacobian at a point (N,)."""

    functions: Functions
    point: Array


@dataclass(frozen=True, eq=False, slots=True)
class TriangleOf:
    """Asks for R of the QR decomposition of a matrix (M, N): (min(M, N), N)."""

    matrix: Array


@dataclass(frozen=True, eq=False, slots=True)
class SingularValuesOf:
    """Asks for U, s and V' of a matrix."""

    matrix: Array


Request = ResidualsAt | JacobianAt | TriangleOf | SingularValuesOf
Answer = Sequence[Array] | Array
Steps = Generator[Request, Answer, Done]


def residuals_at(functions: Functions, points: Sequence[Array]) -> Steps[Sequence[Array]]:
    """Ask for the residuals (M,) at some points."""
    return cast(Sequence[Array], (yield ResidualsAt(functions, points)))


def jacobian_at(functions: Functions, point: Array) -> Steps[Array]:
    """Ask for the Jacobian (M, N) at a point."""
    return cast(Array, (yield JacobianAt(functions, point)))


def triangle_of(matrix: Array) -> Steps[Array]:
    """Ask for R of the QR decomposition of a matrix."""
    return cast(Array, (yield TriangleOf(matrix)))


def singular_values_of(matrix: Array) -> Steps[Sequence[Array]]:
    """Ask for U, s and V' of a matrix."""
    return cast(Sequence[Array], (yield SingularValuesOf(matrix)))


@dataclass(frozen=True, eq=False)
class OneByOne:
    """The user's functions of one point, which are never trusted to be finite.

    Where arithmetic fails the residuals are one nan, and so is the Jacobian.
    """

    fun: Function
    jac: Function | None = None

    def residuals(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return fun at each point."""
        return [self._residuals(x) for x in points]

    def jacobians(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return jac at each point."""
        return [self._jacobian(x) for x in points]

    def _residuals(self, x: Array) -> Array:
        try:
            r = np.array(self.fun(x.copy()), dtype=np.float64, ndmin=1)
        except ArithmeticError:
            return np.full(1, np.nan)
        if r.ndim != 1:
            raise ValueError(f"fun must return residuals in one dimension, not {r.shape}")
        return r

    def _jacobian(self, x: Array) -> Array:
        if self.jac is None:
            raise TypeError("jac: missing")
        try:
            return np.array(self.jac(x.copy()), dtype=np.float64, ndmin=2)
        except ArithmeticError:
            return np.full((1, 1), np.nan)
