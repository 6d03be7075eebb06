"""Simulated minus measured, weighted, with its Jacobian, over the scaled free parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.simulate import Simulator, each

Array = NDArray[np.float64]

CENTRAL_STEP = np.finfo(float).eps ** (1 / 3)
ONE_SIDED_STEP = np.finfo(float).eps ** (1 / 2)


@dataclass(frozen=True)
class Free:
    """A parameter that the fit may move, between ``low`` and ``high``.

    The estimator sees its logarithm, or its place in the interval where zero may be reached.
    """

    name: str
    start: float
    low: float
    high: float
    logarithmic: bool

    def scaled(self, value: float) -> float:
        """Return the number that the estimator moves."""
        return float(np.log(value)) if self.logarithmic else value / (self.high - self.low)

    def value(self, scaled: float) -> float:
        """Return the parameter's own value; at a bound, exactly that bound."""
        for bound in (self.low, self.high):
            if scaled == self.scaled(bound):
                return bound
        return float(np.exp(scaled)) if self.logarithmic else scaled * (self.high - self.low)

    def bound(self, value: float) -> Literal["min", "max"] | None:
        """Return which bound a value lies on."""
        if value == self.low:
            return "min"
        return "max" if value == self.high else None

    def slope(self, scaled: float) -> float:
        """Return d value / d scaled."""
        return float(np.exp(scaled)) if self.logarithmic else self.high - self.low


@dataclass(frozen=True)
class Channel:
    """A measured signal (M,) per unit, and the weight of its residuals."""

    signal: str
    measured: Array
    weight: float = 1.0


class Residuals:
    """Residuals of all channels, one behind the other, as functions of the scaled parameters (N,).

    ``fixed`` holds every parameter of the system that is not free. A set that cannot be simulated
    has infinite residuals. ``simulations`` counts runs of the equations, and ``substeps`` is the
    largest number of sub-steps that any of them took.
    """

    def __init__(
        self,
        simulator: Simulator,
        channels: Sequence[Channel],
        free: Sequence[Free],
        fixed: Mapping[str, float],
    ) -> None:
        self.simulator, self.channels, self.free, self.fixed = simulator, channels, free, fixed
        self.signals = tuple(channel.signal for channel in channels)
        self.measured = np.stack([channel.measured for channel in channels], axis=1)
        self.weights = np.array([channel.weight for channel in channels])
        self.simulations, self.substeps = 0, 1

    @property
    def start(self) -> Array:
        """The scaled start values (N,)."""
        return np.array([one.scaled(one.start) for one in self.free])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The scaled bounds, (N,) each."""
        low = np.array([one.scaled(one.low) for one in self.free])
        return low, np.array([one.scaled(one.high) for one in self.free])

    def values(self, theta: Array) -> dict[str, float]:
        """Return every parameter of the system by name."""
        moved = {one.name: one.value(float(x)) for one, x in zip(self.free, theta, strict=True)}
        return {**self.fixed, **moved}

    def __call__(self, theta: Array) -> Array:
        """Return the residuals (M * channels,)."""
        self.simulations += 1
        try:
            samples, parts = self.simulator.samples(self.values(theta), self.signals)
        except SimulationError:
            return np.full(self.measured.size, np.inf)
        self.substeps = max(self.substeps, parts)
        return self._residuals(samples)

    def exact(self, theta: Array) -> Array:
        """Return the exact Jacobian (M * channels, N)."""
        self.simulations += 1
        directions = each(one.name for one in self.free)
        _, slopes = self.simulator.tangents(self.values(theta), self.signals, directions)
        chain = np.array([one.slope(float(x)) for one, x in zip(self.free, theta, strict=True)])
        weighted = slopes * self.weights[:, None] * chain
        return np.asarray(weighted.transpose(1, 0, 2).reshape(-1, len(self.free)))

    def central(self, theta: Array) -> Array:
        """Return the Jacobian by central differences, all 2 N runs side by side."""
        return self.differences(theta, -CENTRAL_STEP, CENTRAL_STEP)

    def forward(self, theta: Array) -> Array:
        """Return the Jacobian by forward differences."""
        return self.differences(theta, 0.0, ONE_SIDED_STEP)

    def backward(self, theta: Array) -> Array:
        """Return the Jacobian by backward differences."""
        return self.differences(theta, -ONE_SIDED_STEP, 0.0)

    def differences(self, theta: Array, below: float, above: float) -> Array:
        """Return difference quotients over [theta + below, theta + above] within the bounds."""
        low, high = self.bounds
        down, up = np.clip(theta + below, low, high), np.clip(theta + above, low, high)
        stuck = down == up  # a one-sided difference at the bound that it points to
        down, up = np.where(stuck, theta - above, down), np.where(stuck, theta - below, up)
        sets = [*self._moved(theta, down), *self._moved(theta, up)]
        self.simulations += len(sets)
        samples = self.simulator.samples_of_many(
            [self.values(point) for point in sets], self.signals
        )
        columns = np.stack([self._residuals(samples[:, :, k]) for k in range(len(sets))], axis=1)
        count = len(theta)
        return np.asarray((columns[:, count:] - columns[:, :count]) / (up - down))

    def _moved(self, theta: Array, to: Array) -> list[Array]:
        return [np.where(np.arange(len(theta)) == k, to, theta) for k in range(len(theta))]

    def _residuals(self, samples: Array) -> Array:
        return np.asarray(((samples - self.measured) * self.weights).T.ravel())


JACOBIANS: Mapping[str, Callable[[Residuals], Callable[[Array], Array]]] = {
    "exact": lambda residuals: residuals.exact,
    "central": lambda residuals: residuals.central,
    "forward": lambda residuals: residuals.forward,
    "backward": lambda residuals: residuals.backward,
}
