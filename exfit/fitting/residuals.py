"""What a fit makes small: errors of all records, weighted, with their exact Jacobian.

They are functions of the scaled free parameters; what is known beforehand adds one each.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from exfit.case.ties import TieError, Ties
from exfit.dsp.noise import NEIGHBOURS, noise
from exfit.dsp.robust_loss import Loss
from exfit.errors import SimulationError
from exfit.estimate import half_square
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.parameters import FreeParameter, Prior

Array = NDArray[np.float64]

CENTRAL_STEP = np.finfo(float).eps ** (1 / 3)
ONE_SIDED_STEP = np.finfo(float).eps ** (1 / 2)
ROUNDING_OF_RUNS = 2e3 * np.finfo(float).eps  # of signals, by what scaled parameters do to them
UNREACHABLE = (SimulationError, TieError)  # why a set of values has no response
LEAST_NOISE = 1e-7  # pu: no recorder's noise is less


@dataclass(frozen=True)
class Robust:
    """A loss that bears spikes, from ``scale`` standard deviations of a channel's noise on."""

    loss: Loss
    scale: float


class SimulationCounter:
    """Counts simulations, in whatever threads they run, and the most sub-steps of any of them."""

    def __init__(self) -> None:
        self.simulations, self.substeps = 0, 1
        self._lock = Lock()

    def add(self, simulations: int, substeps: int = 1) -> None:
        """Add simulations, with the sub-steps that they took where these are known."""
        with self._lock:
            self.simulations += simulations
            self.substeps = max(self.substeps, substeps)


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of all records, one behind the other, over the scaled parameters (N,).

    ``fixed`` holds every value that is neither free nor follows others by ``ties``. A set that
    cannot be simulated has infinite residuals. ``difference_step`` is that of `central`, `forward`
    and `backward` in scaled parameters. ``counter`` counts the simulations that all of it costs.
    """

    experiments: Sequence[Experiment]
    free: Sequence[FreeParameter]
    fixed: Mapping[str, float]
    ties: Ties = field(default_factory=Ties)
    robust: Robust | None = None
    difference_step: float | None = None
    counter: SimulationCounter | None = None

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """How many errors each channel of each record has."""
        return tuple(size for experiment in self.experiments for size in experiment.sizes)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels of all records."""
        return tuple(channel for experiment in self.experiments for channel in experiment.channels)

    @property
    def count(self) -> int:
        """How many errors there are."""
        return sum(self.sizes)

    @property
    def samples(self) -> int:
        """How many samples are compared: as many, unless they are compressed."""
        return sum(channel.samples for channel in self.channels)

    @property
    def start(self) -> Array:
        """The scaled start values (N,)."""
        return np.array([parameter.scaled(parameter.start) for parameter in self.free])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The scaled bounds, (N,) each."""
        low = np.array([parameter.scaled(parameter.low) for parameter in self.free])
        return low, np.array([parameter.scaled(parameter.high) for parameter in self.free])

    @cached_property
    def noise(self) -> float:
        """The standard deviation of a weighted error, by the noise of the records."""
        deviations = [channel.weight * noise_of(channel) for channel in self.channels]
        return float(np.sqrt(np.mean(np.square(deviations))))

    def match(self, residuals: Array, rmse: float) -> bool:
        """Return whether no channel of any record has a root mean square error above ``rmse``.

        ``residuals`` (samples + priors,) are weighted; those of priors do not count.
        """
        errors = np.split(residuals[: self.count], np.cumsum(self.sizes)[:-1])
        return all(
            float(own @ own) <= channel.samples * rmse**2
            for own, channel in zip(errors, self.channels, strict=True)
        )

    def values(self, theta: Array) -> dict[str, float]:
        """Return every value by name."""
        pairs = zip(self.free, theta, strict=True)
        return self.completed({free.name: free.value(float(x)) for free, x in pairs})

    def completed(self, free: Mapping[str, float]) -> dict[str, float]:
        """Return every value by name, given those of the free parameters."""
        return self.ties.apply({**self.fixed, **free})

    def counted_by(self, counter: SimulationCounter | None) -> "Residuals":
        """Return the same residuals, whose simulations a counter counts, if there is one."""
        return replace(self, counter=counter)

    def __call__(self, theta: Array) -> Array:
        """Return the residuals (samples + priors,)."""
        self._count(len(self.experiments))
        try:
            values = self.values(theta)
            each = [experiment.errors(values) for experiment in self.experiments]
        except UNREACHABLE:
            return np.full(self.count + len(self.priors), np.inf)
        self._count(0, max(substeps for _, substeps in each))
        return self._residuals(np.concatenate([errors for errors, _ in each]), values)

    def errors(self, theta: Array) -> tuple[Array, Array]:
        """Return the weighted errors (samples,) and their exact derivatives (samples, N).

        No loss is applied, and no prior is among them.
        """
        self._count(len(self.experiments))
        values, moves = self.values(theta), self.moves(theta)
        each = [experiment.tangents(values, moves) for experiment in self.experiments]
        errors = np.concatenate([errors for errors, _ in each])
        return errors, np.concatenate([slopes for _, slopes in each])

    def exact(self, theta: Array) -> Array:
        """Return the exact Jacobian (samples + priors, N)."""
        errors, slopes = self.errors(theta)
        if self.robust:
            slopes *= self.robust.loss.slope(errors, self._loss_scales)[:, None]
        if not self.priors:
            return slopes
        of_priors = np.zeros((len(self.priors), len(theta)))
        for row, (k, prior) in enumerate(self.priors.items()):
            of_priors[row, k] = self.noise * self.free[k].slope(float(theta[k])) / prior.std
        return np.vstack([slopes, of_priors])

    def influence(self, errors: Array) -> tuple[Array, Array]:
        """Return how far each weighted error pulls, and the derivative of that; (samples,)."""
        if self.robust is None:
            return errors, np.ones_like(errors)
        loss = self.robust.loss
        return loss.influence(errors, self._loss_scales), loss.curvature(errors, self._loss_scales)

    @property
    def priors(self) -> dict[int, Prior]:
        """What is known beforehand, by the place of the parameter among the free ones."""
        return {
            k: parameter.prior
            for k, parameter in enumerate(self.free)
            if parameter.prior is not None
        }

    def central(self, theta: Array) -> Array:
        """Return the Jacobian by central differences, all 2 N runs side by side."""
        step = self.difference_step or CENTRAL_STEP
        return self.differences(theta, -step, step)

    def forward(self, theta: Array) -> Array:
        """Return the Jacobian by forward differences."""
        return self.differences(theta, 0.0, self.difference_step or ONE_SIDED_STEP)

    def backward(self, theta: Array) -> Array:
        """Return the Jacobian by backward differences."""
        return self.differences(theta, -(self.difference_step or ONE_SIDED_STEP), 0.0)

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

    def of_many(self, points: Sequence[Array]) -> list[Array]:
        """Return the residuals at each of points (N,), infinite where there are none."""
        if not len(points):
            return []
        try:
            return self._of_many(points)
        except UNREACHABLE:
            if len(points) == 1:
                return [np.full(self.count + len(self.priors), np.inf)]
            return [residuals for point in points for residuals in self.of_many([point])]

    def costs(self, points: Sequence[Array]) -> Array:
        """Return half the sum of squares at each of points (N,), infinite where there are none."""
        return np.array([half_square(residuals) for residuals in self.of_many(points)])

    def exact_of_many(self, points: Sequence[Array]) -> list[Array]:
        """Return the exact Jacobian at each of points (N,), nan where there is none."""
        return [self._exact_or_nan(point) for point in points]

    def _exact_or_nan(self, theta: Array) -> Array:
        try:
            return self.exact(theta)
        except UNREACHABLE:
            return np.full((self.count + len(self.priors), len(theta)), np.nan)

    def _of_many(self, points: Sequence[Array]) -> list[Array]:
        """Return the residuals of several points, simulated side by side where that is possible."""
        self._count(len(points) * len(self.experiments))
        sets = [self.values(point) for point in points]
        parts = [experiment.errors_of_many(sets) for experiment in self.experiments]
        return [
            self._residuals(np.concatenate([part[k] for part in parts]), values)
            for k, values in enumerate(sets)
        ]

    def _count(self, simulations: int, substeps: int = 1) -> None:
        if self.counter is not None:
            self.counter.add(simulations, substeps)

    def _moved(self, theta: Array, to: Array) -> list[Array]:
        return [np.where(np.arange(len(theta)) == k, to, theta) for k in range(len(theta))]

    def moves(self, theta: Array) -> list[dict[str, float]]:
        """Return which values each scaled parameter moves, and how fast.

        Raises SimulationError where what follows them moves infinitely fast.
        """
        try:
            tied = self.ties.slopes(self.values(theta), [free.name for free in self.free])
        except TieError as fault:
            raise SimulationError(str(fault)) from fault
        moves = []
        for free, x in zip(self.free, theta, strict=True):
            slope = free.slope(float(x))
            followers = {
                name: slope * slopes[free.name]
                for name, slopes in tied.items()
                if free.name in slopes
            }
            moves.append({free.name: slope, **followers})
        return moves

    def _residuals(self, errors: Array, values: Mapping[str, float]) -> Array:
        if self.robust:
            errors = self.robust.loss.residual(errors, self._loss_scales)
        if not self.priors:
            return errors
        of_priors = [
            self.noise * (values[self.free[k].name] - prior.mean) / prior.std
            for k, prior in self.priors.items()
        ]
        return np.concatenate([errors, of_priors])

    @cached_property
    def _loss_scales(self) -> Array:
        """The error of each sample from which on it costs less than its square."""
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
    return max(
        noise(measured[::apart] if len(measured) > NEIGHBOURS * apart else measured), LEAST_NOISE
    )


JACOBIANS: Mapping[str, Callable[[Residuals], Callable[[Array], Array]]] = {
    "exact": lambda residuals: residuals.exact,
    "central": lambda residuals: residuals.central,
    "forward": lambda residuals: residuals.forward,
    "backward": lambda residuals: residuals.backward,
}


def jacobian_error(jacobian: str, difference_step: float | None = None) -> float | None:
    """Return the error of a Jacobian by differences, as a share of its largest singular value.

    It is what rounding or curvature makes of a direction that no signal sees; None for the exact
    one.
    """
    if jacobian == "exact":
        return None
    central = jacobian == "central"
    step = difference_step or (CENTRAL_STEP if central else ONE_SIDED_STEP)
    return max(ROUNDING_OF_RUNS / step, step**2 if central else step)


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Residuals and Jacobians of many points at once, as searches in lock-step ask for them."""

    residuals_of: Residuals
    jacobian: str = "exact"

    def residuals(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return the residuals (M,) at each of points (N,)."""
        return self.residuals_of.of_many(points)

    def jacobians(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return the Jacobian (M, N) at each of points (N,)."""
        if self.jacobian == "exact":
            return self.residuals_of.exact_of_many(points)
        return [JACOBIANS[self.jacobian](self.residuals_of)(point) for point in points]
