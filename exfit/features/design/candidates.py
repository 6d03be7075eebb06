"""A test that could be made: whether it keeps the limits, and how well it would determine what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, NamedTuple

import numpy as np

from exfit.errors import CaseError, SimulationError
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import slopes_of
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Run, Simulator
from exfit.util.arrays import Array, median_step
from exfit.util.text import near

Extremes = Mapping[str, tuple[float, float]]

REST = 1.0  # s before the first step: the rest that a record must show
LAST_DWELL = 1.0  # s that the last level is recorded at least
ROUNDING = 1e-9  # pu: a limit that is met exactly is kept
SMALLEST_SIZE = 0.1  # of the interval between bounds: what counts as 100 % of a value near zero


@dataclass(frozen=True)
class Limits:
    """How far a test may go, per unit.

    ``vt`` and ``vref`` may deviate so far from the start, the reference by default as far as vt;
    ``efd`` and ``efd_min`` are the largest and the least field voltage, besides the model's own.
    Raises CaseError for a limit that leaves no room.
    """

    vt: float = 0.05
    vref: float = inf
    efd: float = inf
    efd_min: float = -inf

    def __post_init__(self) -> None:
        for name in ("vt", "vref"):
            if not getattr(self, name) > 0.0:
                raise CaseError(f"limit {name}: {getattr(self, name):g}: must be above 0")
        if not self.efd_min < self.efd:
            raise CaseError(f"limit efd_min: {self.efd_min:g}: must be below {self.efd:g}")

    @staticmethod
    def of(values: Mapping[str, float]) -> "Limits":
        """Return the limits of some names; raises CaseError for a name that is none."""
        names = ("vt", "vref", "efd", "efd_min")
        unknown = [name for name in values if name not in names]
        if unknown:
            raise CaseError(f"limit {name}: not a limit; {near(name, names)}" for name in unknown)
        return Limits(**values)

    @property
    def given(self) -> dict[str, float]:
        """The limits that there are, by name."""
        limits = {"vt": self.vt, "vref": self.of_vref, "efd": self.efd, "efd_min": self.efd_min}
        return {name: limit for name, limit in limits.items() if abs(limit) < inf}

    @property
    def of_vref(self) -> float:
        """How far the reference may deviate from the start, pu."""
        return self.vt if self.vref == inf else self.vref

    def keep(self, run: Run) -> bool:
        """Tell whether a simulated test is within the limits at every point of its grid."""
        extremes = extremes_of(run)
        return bool(np.isfinite([*extremes.values()]).all()) and self.allow(
            extremes, float(run.outputs["vt"][0])
        )

    def allow(self, extremes: Extremes, vt0: float) -> bool:
        """Tell whether signals that stay between extremes, from a voltage, are within limits."""
        (vt_low, vt_high), (efd_low, efd_high) = extremes["vt"], extremes["efd"]
        deviation = max(vt_high - vt0, vt0 - vt_low)
        within_efd = self.efd_min - ROUNDING <= efd_low and efd_high <= self.efd + ROUNDING
        return deviation <= self.vt + ROUNDING and within_efd


def extremes_of(run: Run) -> Extremes:
    """Return the least and the largest value of each signal that has a limit, pu."""
    return {
        signal: (float(run.outputs[signal].min()), float(run.outputs[signal].max()))
        for signal in ("vt", "efd")
    }


class ReferenceMove(NamedTuple):
    """A move of the reference to a level: a ``share`` of its limit, ``dwell`` s after the last."""

    dwell: float
    share: float


Moves = tuple[ReferenceMove, ...]


@dataclass(frozen=True)
class Stage:
    """A test on the way to the designed one: its steps, channels and duration in s.

    ``errors`` are the standard errors that it predicts, in shares of the parameters; ``criterion``
    is the root of their mean square (A), or the geometric mean over the axes of their ellipsoid
    (D).
    """

    label: str
    steps: tuple[InputStep, ...]
    channels: tuple[str, ...]
    duration: float
    criterion: float
    errors: Mapping[str, float]

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "label": self.label,
            "duration": self.duration,
            "channels": list(self.channels),
            "steps": [{"at": step.at, "step": step.step} for step in self.steps],
            "criterion": self.criterion,
            "std_errors": dict(self.errors),
        }


@dataclass(frozen=True, eq=False)
class Bench:
    """What all candidates share, and the information of those tried already.

    ``candidates`` are the channels that could be recorded, weighted by their noise; ``chosen`` are
    the places of the parameters among the free ones.
    """

    base: Experiment
    problem: Residuals
    candidates: tuple[Channel, ...]
    chosen: tuple[int, ...]
    criterion: str
    limits: Limits
    tried: dict[tuple[Moves, float], Array | None] = field(default_factory=dict)

    def steps(self, moves: Moves) -> tuple[InputStep, ...]:
        """Return the steps of the reference that moves are."""
        at, level, steps = REST, 0.0, []
        for k, move in enumerate(moves):
            at += move.dwell if k else 0.0
            target = move.share * self.limits.of_vref
            steps.append(InputStep(round(at, 6), round(target - level, 9)))
            level = target
        return tuple(steps)

    def simulator(self, moves: Moves, duration: float) -> Simulator:
        """Return the simulator of a test, sampled as often as that of the case."""
        old = self.base.simulator
        count = round(duration / median_step(old.times))
        times = np.linspace(0.0, duration, count + 1)
        inputs = Inputs(0.0, duration, self.steps(moves))
        return old.remade(inputs=inputs, times=times, delay=0.0)

    def values(self) -> dict[str, float]:
        """Return the values of the case."""
        return self.base.parameters(self.problem.values(self.problem.start))

    def information(self, moves: Moves, duration: float) -> Array | None:
        """Compute the information of each candidate channel (C, N, N), None beyond a limit."""
        if (moves, duration) not in self.tried:
            self.tried[moves, duration] = self._information(moves, duration)
        return self.tried[moves, duration]

    def _information(self, moves: Moves, duration: float) -> Array | None:
        shares = [0.0, *(move.share for move in moves)]
        dwelt = REST + sum(move.dwell for move in moves[1:])
        if dwelt + LAST_DWELL > duration or not all(np.diff(shares)):
            return None
        simulator = self.simulator(moves, duration)
        try:
            run = simulator.run(self.values())
        except SimulationError:
            return None
        if not self.limits.keep(run):
            return None
        zeros = np.zeros(len(simulator.times))
        channels = tuple(replace(channel, measured=zeros) for channel in self.candidates)
        experiment = replace(self.base, simulator=simulator, channels=channels)
        problem = replace(self.problem, experiments=[experiment])
        slopes = problem.exact(problem.start)[: problem.count]
        if not np.isfinite(slopes).all():
            return None
        blocks = slopes.reshape(len(channels), -1, slopes.shape[1])
        return np.asarray(np.einsum("cmi,cmj->cij", blocks, blocks))

    def covariance(self, moves: Moves, signals: Sequence[str], duration: float) -> Array | None:
        """Compute the covariance of all relative errors (N, N), None where it has no bound."""
        information = self.information(moves, duration)
        if information is None:
            return None
        recorded = [channel.signal in signals for channel in self.candidates]
        sizes = np.array(  # the change of each that counts as 100 %, in its own unit
            [
                abs(free.start)
                if free.logarithmic
                else max(abs(free.start), SMALLEST_SIZE * free.width)
                for free in self.problem.free
            ]
        )
        scales = sizes / slopes_of(self.problem, self.problem.start)  # the matrix is well scaled
        whole = information[recorded].sum(axis=0) * np.outer(scales, scales)
        for k, prior in self.problem.priors.items():
            whole[k, k] += (sizes[k] / prior.std) ** 2
        values, vectors = np.linalg.eigh(whole)
        if values[0] <= len(values) * np.finfo(float).eps * values[-1]:
            return None
        return np.asarray((vectors / values) @ vectors.T)

    def cost(self, moves: Moves, signals: Sequence[str], duration: float) -> float:
        """Return the criterion, infinite for a test that determines nothing or breaks a limit."""
        covariance = self.covariance(moves, signals, duration)
        if covariance is None:
            return inf
        own = covariance[np.ix_(self.chosen, self.chosen)]
        if self.criterion == "A":
            return float(np.sqrt(np.mean(np.diag(own))))
        return float(np.exp(np.linalg.slogdet(own)[1] / (2.0 * len(own))))

    def errors(self, moves: Moves, signals: Sequence[str], duration: float) -> dict[str, float]:
        """Return the relative standard errors of the chosen parameters, none where undetermined."""
        covariance = self.covariance(moves, signals, duration)
        if covariance is None:
            return {}
        errors = np.sqrt(np.diag(covariance))
        return {self.problem.free[k].name: float(errors[k]) for k in self.chosen}

    def stage(self, label: str, moves: Moves, signals: tuple[str, ...], duration: float) -> Stage:
        """Return a test that is allowed with what it would show."""
        cost = self.cost(moves, signals, duration)
        errors = self.errors(moves, signals, duration)
        return Stage(label, self.steps(moves), signals, duration, cost, errors)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters to determine best."""
        return tuple(self.problem.free[k].name for k in self.chosen)
