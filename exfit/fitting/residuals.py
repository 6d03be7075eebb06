"""What a fit makes small: errors of all records, weighted, with their exact Jacobian.

They are functions of the scaled free parameters; what is known beforehand adds one each.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from exfit.case.ties import TieError, Ties
from exfit.dsp.noise import NEIGHBOURS, noise
from exfit.dsp.robust_loss import Loss
from exfit.engine.kernel import SIDE_BY_SIDE
from exfit.errors import SimulationError
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.parameters import FreeParameter, Prior
from exfit.util.threads import in_threads

Array = NDArray[np.float64]

CENTRAL_STEP = np.finfo(float).eps ** (1 / 3)
ONE_SIDED_STEP = np.finfo(float).eps ** (1 / 2)
UNREACHABLE = (SimulationError, TieError)  # why a set of values has no response
FINEST = 1e-7  # pu: no recorder's noise is less


@dataclass(frozen=True)
class Robust:
    """A loss that bears spikes, from ``scale`` standard deviations of a channel's noise on."""

    loss: Loss
    scale: float


class Residuals:
    """Residuals of all records, one behind the other, over the scaled parameters (N,).

    ``fixed`` holds every value that is neither free nor follows others by ``ties``. A set that
    cannot be simulated has infinite residuals. ``simulations`` counts runs of the equations, and
    ``substeps`` is the largest number of sub-steps that any of them took.
    """

    def __init__(
        self,
        experiments: Sequence[Experiment],
        free: Sequence[FreeParameter],
        fixed: Mapping[str, float],
        ties: Ties | None = None,
        robust: Robust | None = None,
    ) -> None:
        self.experiments, self.free, self.fixed = tuple(experiments), tuple(free), fixed
        self.ties = Ties({}) if ties is None else ties
        self.sizes = tuple(size for one in experiments for size in one.sizes)
        self.simulations, self.substeps = 0, 1
        self.robust = robust
        self._last: tuple[bytes, Array] | None = None  # where it was asked for, and the errors
        self._scales = self._loss_scales() if robust else np.zeros(0)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels of all records."""
        return tuple(channel for one in self.experiments for channel in one.channels)

    @property
    def count(self) -> int:
        """How many errors there are."""
        return sum(self.sizes)

    @property
    def samples(self) -> int:
        """How many samples are compared: as many, unless they are condensed."""
        return sum(channel.samples for channel in self.channels)

    @property
    def start(self) -> Array:
        """The scaled start values (N,)."""
        return np.array([one.scaled(one.start) for one in self.free])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The scaled bounds, (N,) each."""
        low = np.array([one.scaled(one.low) for one in self.free])
        return low, np.array([one.scaled(one.high) for one in self.free])

    @cached_property
    def noise(self) -> float:
        """The standard deviation of a weighted error, by the noise of the records."""
        deviations = [channel.weight * noise_of(channel) for channel in self.channels]
        return float(np.sqrt(np.mean(np.square(deviations))))

    def values(self, theta: Array) -> dict[str, float]:
        """Return every value by name."""
        moved = {one.name: one.value(float(x)) for one, x in zip(self.free, theta, strict=True)}
        return self.completed(moved)

    def completed(self, free: Mapping[str, float]) -> dict[str, float]:
        """Return every value by name, given those of the free parameters."""
        return self.ties.apply({**self.fixed, **free})

    def __call__(self, theta: Array) -> Array:
        """Return the residuals (samples + priors,)."""
        self.simulations += len(self.experiments)
        try:
            values = self.values(theta)
            found = [one.errors(values) for one in self.experiments]
        except UNREACHABLE:
            return np.full(self.count + len(self.priors), np.inf)
        self.substeps = max(self.substeps, *(parts for _, parts in found))
        errors = np.concatenate([one for one, _ in found])
        self._last = theta.tobytes(), errors
        return self._residuals(errors, values)

    def errors(self, theta: Array) -> tuple[Array, Array]:
        """Return the weighted errors (samples,) and their exact derivatives (samples, N).

        No loss is applied, and no prior is among them.
        """
        self.simulations += len(self.experiments)
        values, moves = self.values(theta), self.moves(theta)
        found = [one.tangents(values, moves) for one in self.experiments]
        errors = np.concatenate([one for one, _ in found])
        self._last = theta.tobytes(), errors
        return errors, np.concatenate([slopes for _, slopes in found])

    def first_errors(self, theta: Array) -> Array:
        """Return the weighted errors of the first record, for a look that counts no simulation.

        They are simulated anew only where the last evaluation was not at theta (N,).
        """
        last, first = self._last, self.experiments[0]
        if last is None or last[0] != theta.tobytes():
            return first.errors(self.values(theta))[0]
        return last[1][: sum(first.sizes)]

    def exact(self, theta: Array) -> Array:
        """Return the exact Jacobian (samples + priors, N)."""
        errors, slopes = self.errors(theta)
        if self.robust:
            slopes *= self.robust.loss.slope(errors, self._scales)[:, None]
        if not self.priors:
            return slopes
        known = np.zeros((len(self.priors), len(theta)))
        for row, (k, prior) in enumerate(self.priors.items()):
            known[row, k] = self.noise * self.free[k].slope(float(theta[k])) / prior.std
        return np.vstack([slopes, known])

    def influence(self, errors: Array) -> tuple[Array, Array]:
        """Return how far each weighted error pulls, and the derivative of that; (samples,)."""
        if self.robust is None:
            return errors, np.ones_like(errors)
        loss = self.robust.loss
        return loss.influence(errors, self._scales), loss.curvature(errors, self._scales)

    @property
    def priors(self) -> dict[int, Prior]:
        """What is known beforehand, by the place of the parameter among the free ones."""
        return {k: one.prior for k, one in enumerate(self.free) if one.prior is not None}

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
        """Return difference quotients over [theta + below, theta + above] within the bounds.

        Raises SimulationError where one of these points has no response.
        """
        low, high = self.bounds
        down, up = np.clip(theta + below, low, high), np.clip(theta + above, low, high)
        stuck = down == up  # a one-sided difference at the bound that it points to
        down, up = np.where(stuck, theta - above, down), np.where(stuck, theta - below, up)
        sets = [*self._moved(theta, down), *self._moved(theta, up)]
        try:
            columns = np.stack(self._of_many(sets), axis=1)
        except TieError as fault:
            raise SimulationError(str(fault)) from fault
        count = len(theta)
        return np.asarray((columns[:, count:] - columns[:, :count]) / (up - down))

    def costs(self, points: Array) -> Array:
        """Return half the sum of squares at each of points (K, N), inf where there is none."""
        blocks = [points[k : k + SIDE_BY_SIDE] for k in range(0, len(points), SIDE_BY_SIDE)]
        return np.concatenate(list(in_threads(self._costs, blocks)))

    def _costs(self, points: Array) -> Array:
        try:
            found = self._of_many(points)
        except UNREACHABLE:
            if len(points) == 1:
                return np.full(1, np.inf)
            return np.concatenate([self._costs(point[None, :]) for point in points])
        with np.errstate(all="ignore"):
            costs = np.array([0.5 * float(r @ r) for r in found])
        return np.where(np.isfinite(costs), costs, np.inf)

    def _of_many(self, points: Array | Sequence[Array]) -> list[Array]:
        """Return the residuals of several points, simulated side by side where that is possible."""
        self.simulations += len(points) * len(self.experiments)
        sets = [self.values(point) for point in points]
        parts = [one.errors_of_many(sets) for one in self.experiments]
        return [
            self._residuals(np.concatenate([part[k] for part in parts]), values)
            for k, values in enumerate(sets)
        ]

    def _moved(self, theta: Array, to: Array) -> list[Array]:
        return [np.where(np.arange(len(theta)) == k, to, theta) for k in range(len(theta))]

    def moves(self, theta: Array) -> list[dict[str, float]]:
        """Return which values each scaled parameter moves, and how fast.

        Raises SimulationError where what follows them moves infinitely fast.
        """
        try:
            tied = self.ties.slopes(self.values(theta), [one.name for one in self.free])
        except TieError as fault:
            raise SimulationError(str(fault)) from fault
        moves = []
        for one, x in zip(self.free, theta, strict=True):
            slope = one.slope(float(x))
            followers = {name: slope * by[one.name] for name, by in tied.items() if one.name in by}
            moves.append({one.name: slope, **followers})
        return moves

    def _residuals(self, errors: Array, values: Mapping[str, float]) -> Array:
        if self.robust:
            errors = self.robust.loss.residual(errors, self._scales)
        if not self.priors:
            return errors
        known = [
            self.noise * (values[self.free[k].name] - prior.mean) / prior.std
            for k, prior in self.priors.items()
        ]
        return np.concatenate([errors, known])

    def _loss_scales(self) -> Array:
        """Return the error of each sample from which on it costs less than its square."""
        share = 1.0 if self.robust is None else self.robust.scale
        scales = [share * channel.weight * noise_of(channel) for channel in self.channels]
        return np.repeat(scales, self.sizes)


def noise_of(channel: Channel) -> float:
    """Return the standard deviation of a channel's noise, per unit: given, or estimated."""
    if channel.noise is not None:
        return channel.noise
    measured = channel.measured[channel.kept]
    apart = 1 if channel.filtering is None else channel.filtering.smooth_over
    # neighbours in one window of an average scatter little: they share most of it
    return max(noise(measured[::apart] if len(measured) > NEIGHBOURS * apart else measured), FINEST)


JACOBIANS: Mapping[str, Callable[[Residuals], Callable[[Array], Array]]] = {
    "exact": lambda residuals: residuals.exact,
    "central": lambda residuals: residuals.central,
    "forward": lambda residuals: residuals.forward,
    "backward": lambda residuals: residuals.backward,
}
