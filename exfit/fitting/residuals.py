"""What a fit makes small: errors of all records, weighted, with their exact Jacobian.

They are functions of the scaled free parameters; what is known beforehand adds one each.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from exfit.case.schema.estimate import MOST_ITERATIONS
from exfit.case.ties import TieError, Ties
from exfit.errors import SimulationError
from exfit.estimate import half_square
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.noise import noise_of
from exfit.fitting.nuisances import Nuisance
from exfit.fitting.parameters import FreeParameter, Prior, units_of
from exfit.simulation.substeps import NO_SUBSTEPS
from exfit.util.arrays import Array

if TYPE_CHECKING:
    from exfit.dsp.robust_loss import Loss


CENTRAL_STEP = np.finfo(float).eps ** (1 / 3)
ONE_SIDED_STEP = np.finfo(float).eps ** (1 / 2)
UNSTABLE = 3.0  # logarithm by which a deviation from an unstable rest grows within a test
UNREACHABLE = (SimulationError, TieError)  # why a set of values has no response
MOST_NUMBERS_AT_ONCE = 1 << 21  # of Jacobians that are made together: 16 MB


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


class Robust(NamedTuple):
    """A loss that tolerates spikes, from ``scale`` standard deviations of a channel's noise on."""

    loss: "Loss"
    scale: float


SHORT_RUNS = 5000  # steps, of the simulations of all records together
WORK_OF_PROFILES = 2e8  # steps of a Jacobian, times its directions: about twenty seconds
LEAST_ITERATIONS = 15  # most sides take four to twelve


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of all records, one behind the other, over the scaled parameters (N,).

    ``fixed`` holds every value that is neither free nor follows others by ``ties``. A set that
    cannot be simulated has infinite residuals. ``difference_step`` is that of `central`, `forward`
    and `backward` in scaled parameters, or, with ``relative_differences``, as a share of values.
    ``counter`` counts the simulations that all of it costs. ``iterations`` are the most of a phase
    of the search.
    """

    experiments: Sequence[Experiment]
    free: Sequence[FreeParameter]
    fixed: Mapping[str, float]
    ties: Ties = field(default_factory=Ties)
    robust: Robust | None = None
    difference_step: float | None = None
    relative_differences: bool = False
    counter: SimulationCounter | None = None
    iterations: int = MOST_ITERATIONS

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Number of errors of each channel of each record."""
        return tuple(size for experiment in self.experiments for size in experiment.sizes)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels of all records."""
        return tuple(channel for experiment in self.experiments for channel in experiment.channels)

    @property
    def count(self) -> int:
        """Number of errors."""
        return sum(self.sizes)

    @property
    def samples(self) -> int:
        """Number of samples that are compared: as many, unless they are compressed."""
        return sum(channel.samples for channel in self.channels)

    @property
    def threads(self) -> int | None:
        """Number of threads that advance searches: None for as many as there are processors.

        One where the simulations are short: what surrounds them holds the interpreter's lock, and
        searches that advance together share more blocks of sets.
        """
        tests = [experiment.simulator for experiment in self.experiments]
        alone = all(test.responder is None for test in tests)
        return 1 if alone and sum(test.steps for test in tests) <= SHORT_RUNS else None

    def iterations_of_side(self, profiles: int) -> int:
        """Return how many iterations a side of some profiles may take: fewer of long records."""
        share = self.iterations / MOST_ITERATIONS
        steps = sum(experiment.simulator.steps for experiment in self.experiments)
        within = WORK_OF_PROFILES / (2 * profiles * steps * (1 + len(self.free)))
        return round(max(1.0, share) * min(MOST_ITERATIONS, max(LEAST_ITERATIONS, within)))

    @property
    def of_records(self) -> dict[str, Nuisance]:
        """What is found about the records, by name."""
        return {own.name: own for each in self.experiments for own in each.nuisances}

    @property
    def start(self) -> Array:
        """The scaled start values (N,)."""
        return np.array([parameter.scaled(parameter.start) for parameter in self.free])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The scaled bounds, (N,) each."""
        low = np.array([parameter.scaled(parameter.low) for parameter in self.free])
        return low, np.array([parameter.scaled(parameter.high) for parameter in self.free])

    @property
    def units(self) -> Array:
        """A reasonable step of each scaled parameter, (N,)."""
        return units_of(self.free)

    @cached_property
    def noise(self) -> float:
        """The standard deviation of a weighted error, by the noise of the records.

        Where the channels are weighted by their residuals, it is that of these; or of white errors.
        """
        if white := [each.whitening for each in self.experiments if each.whitening is not None]:
            return white[0].scale
        sizes = [c.weight * (c.residual_deviation or noise_of(c)) for c in self.channels]
        return float(np.sqrt(np.mean(np.square(sizes))))

    @property
    def bias(self) -> Array:
        """What noise of the inputs would add to the errors (M,) of the records: none is left."""
        pairs = ((each.whitening, sum(each.sizes)) for each in self.experiments)
        return np.concatenate([np.zeros(n) if white is None else white.bias for white, n in pairs])

    def match(self, residuals: Array, rmse: float) -> bool:
        """Test that no channel of any record has a root mean square error above ``rmse``.

        ``residuals`` (samples + priors,) are weighted; those of priors do not count.
        """
        errors = np.split(residuals[: self.count], np.cumsum(self.sizes)[:-1])
        return all(
            float(own @ own) <= channel.samples * rmse**2
            for own, channel in zip(errors, self.channels, strict=True)
        )

    def values(self, theta: Array) -> dict[str, float]:
        """Return every value by name.

        Raises SimulationError where there is no response to one.
        """
        values = {}
        for free, x in zip(self.free, theta, strict=True):
            value = values[free.name] = free.value(float(x))
            if value < free.least:
                raise SimulationError(f"{free.name} = {value:g}: no response below {free.least:g}")
        return self.completed(values)

    def completed(self, free: Mapping[str, float]) -> dict[str, float]:
        """Return every value by name, given those of the free parameters."""
        return self.ties.apply({**self.fixed, **free})

    def counted_by(self, counter: SimulationCounter | None) -> "Residuals":
        """Return the same residuals, whose simulations a counter counts, if there is one."""
        return replace(self, counter=counter)

    def __call__(self, theta: Array) -> Array:
        """Return the residuals (samples + priors,)."""
        return self.residuals([theta])[0]

    def errors(self, theta: Array, some: Sequence[int] | None = None) -> tuple[Array, Array]:
        """Return the weighted errors (samples,) and their exact derivatives (samples, N).

        They are those to ``some`` of the free parameters, where these are given. No loss is
        applied, and no prior is among them.
        """
        self._count(len(self.experiments))
        values, moves = self.values(theta), self.moves(theta)
        moves = moves if some is None else [moves[k] for k in some]
        each = [experiment.tangents(values, moves) for experiment in self.experiments]
        errors = _stacked([errors for errors, _ in each])
        return errors, _stacked([slopes for _, slopes in each])

    def exact(self, theta: Array) -> Array:
        """Return the exact Jacobian (samples + priors, N)."""
        return self._jacobian(*self.errors(theta), theta)

    def _jacobian(self, errors: Array, slopes: Array, theta: Array) -> Array:
        """Return the Jacobian of the residuals, given the errors and their derivatives."""
        if self.robust:
            slopes *= self.robust.loss.slope(errors, self._loss_scales)[:, None]
        if not self.priors:
            return slopes
        of_priors = np.zeros((len(self.priors), len(theta)))
        for row, (k, prior) in enumerate(self.priors.items()):
            of_priors[row, k] = self.noise * self.free[k].slope(float(theta[k])) / prior.std
        return np.vstack([slopes, of_priors])

    def influence(self, errors: Array) -> tuple[Array, Array]:
        """Pull of each weighted error, and the derivative of that; (samples,)."""
        if self.robust is None:
            return errors, np.ones_like(errors)
        loss = self.robust.loss
        return loss.influence(errors, self._loss_scales), loss.curvature(errors, self._loss_scales)

    @property
    def priors(self) -> dict[int, Prior]:
        """Priors by the place of the parameter among the free ones."""
        return {
            k: parameter.prior
            for k, parameter in enumerate(self.free)
            if parameter.prior is not None
        }

    def central(self, theta: Array) -> Array:
        """Return the Jacobian by central differences, all 2 N runs side by side."""
        step = self._steps(theta, CENTRAL_STEP)
        return self.differences(theta, -step, step)

    def forward(self, theta: Array) -> Array:
        """Return the Jacobian by forward differences."""
        return self.differences(theta, 0.0, self._steps(theta, ONE_SIDED_STEP))

    def backward(self, theta: Array) -> Array:
        """Return the Jacobian by backward differences."""
        return self.differences(theta, -self._steps(theta, ONE_SIDED_STEP), 0.0)

    def _steps(self, theta: Array, usual: float) -> Array:
        """Return the step of the differences of each scaled parameter (N,)."""
        step = np.full(len(theta), self.difference_step or usual)
        if not self.relative_differences:
            return step
        shares = np.array([free.logarithmic for free in self.free]) | (theta == 0.0)
        return np.where(shares, step, step * np.abs(theta))

    def differences(self, theta: Array, below: Array | float, above: Array | float) -> Array:
        """Return difference quotients over [theta + below, theta + above] within the bounds.

        Raises SimulationError where one of these points has no response.
        """
        low, high = self.bounds
        low = np.maximum(low, [parameter.scaled_least for parameter in self.free])
        down, up = np.clip(theta + below, low, high), np.clip(theta + above, low, high)
        stuck = down == up  # a one-sided difference at the bound that it points to
        down, up = np.where(stuck, theta - above, down), np.where(stuck, theta - below, up)
        moved = np.eye(len(theta), dtype=bool)
        points = [*np.where(moved, down, theta), *np.where(moved, up, theta)]
        residuals = self._of_many(points)
        for point, of_point in zip(points, residuals, strict=True):
            if of_point is None:  # say why
                try:
                    values = self.values(point)
                except TieError as fault:
                    raise SimulationError(str(fault)) from fault
                for experiment in self.experiments:
                    experiment.with_inputs(values).substeps(experiment.parameters(values))
        columns = np.stack([of_point for of_point in residuals if of_point is not None], axis=1)
        count = len(theta)
        return np.asarray((columns[:, count:] - columns[:, :count]) / (up - down))

    def residuals(self, points: Sequence[Array]) -> list[Array]:
        """Return the residuals at each of points (N,), infinite where there are none.

        They run side by side; those of a point do not depend on what the others are.
        """
        nothing = np.full(self.count + len(self.priors), np.inf)
        return [nothing.copy() if own is None else own for own in self._of_many(points)]

    def growth(self, theta: Array) -> float:
        """Logarithm by which a deviation from the rest grows in a test, infinite without a rest."""
        try:
            values = self.values(theta)
            return max(
                experiment.with_inputs(values).growth(experiment.parameters(values))
                for experiment in self.experiments
            )
        except UNREACHABLE:
            return float("inf")

    def costs(self, points: Sequence[Array]) -> Array:
        """Return half the sum of squares at each of points (N,), infinite where there are none."""
        with np.errstate(over="ignore"):
            return np.array([half_square(residuals) for residuals in self.residuals(points)])

    def jacobians(self, points: Sequence[Array]) -> list[Array]:
        """Return the exact Jacobian at each of points (N,), nan where there is none.

        They too run side by side, as searches in lock-step ask for them.
        """
        at_once = max(1, MOST_NUMBERS_AT_ONCE // (self.count * max(1, len(self.free))))
        return [
            jacobian
            for first in range(0, len(points), at_once)
            for jacobian in self._exact_of_block(points[first : first + at_once])
        ]

    def _of_many(self, points: Sequence[Array]) -> list[Array | None]:
        """Return the residuals of several points, None where there are none."""
        self._count(len(points) * len(self.experiments))
        residuals: list[Array | None] = [None] * len(points)
        sets = dict[int, dict[str, float]]()
        for k, theta in enumerate(points):
            with suppress(*UNREACHABLE):
                sets[k] = self.values(theta)
        if not sets:
            return residuals
        with np.errstate(all="ignore"):
            runs = [experiment.errors_of_many([*sets.values()]) for experiment in self.experiments]
            whole = _stacked([errors for errors, _ in runs], axis=1)
            if self.robust is not None:
                whole = self.robust.loss.residual(whole, self._loss_scales)
        parts = np.stack([parts for _, parts in runs])
        self._count(0, int(parts.max()))
        reached = np.all(parts != NO_SUBSTEPS, axis=0)
        for (k, values), own, has_response in zip(sets.items(), whole, reached, strict=True):
            if has_response:
                of_priors = [
                    self.noise * (values[self.free[j].name] - prior.mean) / prior.std
                    for j, prior in self.priors.items()
                ]
                residuals[k] = np.concatenate([own, of_priors]) if of_priors else own
        return residuals

    def _exact_of_block(self, points: Sequence[Array]) -> list[Array]:
        self._count(len(points) * len(self.experiments))
        rows = self.count + len(self.priors)
        jacobians = [np.full((rows, len(theta)), np.nan) for theta in points]
        directed = dict[int, tuple[dict[str, float], list[dict[str, float]]]]()
        for k, theta in enumerate(points):
            with suppress(*UNREACHABLE):
                directed[k] = self.values(theta), self.moves(theta)
        if not directed:
            return jacobians
        sets, moves = ([*part] for part in zip(*directed.values(), strict=True))
        with np.errstate(all="ignore"):
            runs = [experiment.tangents_of_many(sets, moves) for experiment in self.experiments]
            errors = _stacked([errors for errors, _, _ in runs], axis=1)
            reached = np.all([parts != NO_SUBSTEPS for _, _, parts in runs], axis=0)
            for row, k in enumerate(directed):
                if reached[row]:
                    slopes = _stacked([slopes[row] for _, slopes, _ in runs])
                    jacobians[k] = self._jacobian(errors[row], slopes, points[k])
        return jacobians

    def _count(self, simulations: int, substeps: int = 1) -> None:
        if self.counter is not None:
            self.counter.add(simulations, substeps)

    def moves(self, theta: Array) -> list[dict[str, float]]:
        """Values that each scaled parameter moves, with their rates.

        Raises SimulationError where what follows them moves infinitely fast.
        """
        tied: Mapping[str, Mapping[str, float]] = {}
        try:
            if self.ties.by_name:
                names = [free.name for free in self.free]
                tied = self.ties.slopes(self.values(theta), names)
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

    @cached_property
    def _loss_scales(self) -> Array:
        """The error of each sample from which on it costs less than its square."""
        share = 1.0 if self.robust is None else self.robust.scale
        scales = [share * channel.weight * noise_of(channel) for channel in self.channels]
        return np.repeat(scales, self.sizes)


def with_freed(residuals: Residuals, freed: Sequence[FreeParameter]) -> Residuals:
    """Return residuals with more free parameters, which were fixed."""
    names = {parameter.name for parameter in freed}
    fixed = {name: value for name, value in residuals.fixed.items() if name not in names}
    return replace(residuals, free=[*residuals.free, *freed], fixed=fixed, counter=None)


def _stacked(blocks: Sequence[Array], axis: int = 0) -> Array:
    """Return the blocks of all records as one, without a copy of a single one."""
    return blocks[0] if len(blocks) == 1 else np.concatenate(blocks, axis=axis)
