"""What a fit, a simulation or a validation leaves behind: data, written and read back."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.features import Features
from exfit.fitting.uncertainty import UncertaintyAnalysis

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Iteration:
    """One line of a fit's history; line 0 is the start.

    f = 1/2 sum of squared residuals; ``gradient_norm`` of its gradient over the scaled parameters;
    ``damping`` is nu of Levenberg-Marquardt or the step length of Gauss-Newton; ``inner`` counts
    the trials that were rejected before; ``nfev`` and ``njev`` count residuals and Jacobians until
    now.
    """

    number: int
    phase: str
    cost: float
    gradient_norm: float
    step_norm: float
    damping: float
    inner: int
    nfev: int
    njev: int
    quality: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class FittedParameter:
    """A free parameter after a fit; ``of_record`` where it belongs to a record, not to the unit."""

    value: float
    start: float
    min: float
    max: float
    at_bound: Literal["min", "max"] | None
    unit: str
    of_record: bool = False


@dataclass(frozen=True)
class Overlay:
    """Measured and simulated samples (M,) of one signal, per unit; ``start`` after a fit.

    What is left out of the comparison is nan.
    """

    measured: Array
    simulated: Array
    start: Array | None = None

    @property
    def error(self) -> Array:
        """Simulated minus measured."""
        return self.simulated - self.measured

    @property
    def rmse(self) -> float:
        """Root mean square of the error, per unit."""
        return float(np.sqrt(np.nanmean(self.error**2)))

    @property
    def max_error(self) -> float:
        """Largest magnitude of the error, per unit."""
        return float(np.nanmax(np.abs(self.error)))

    @property
    def fit_percent(self) -> float:
        """100 (1 - |error| / |measured - its mean|), norms of the whole signal: 100 is perfect."""
        kept = np.isfinite(self.error)
        measured, error = self.measured[kept], self.error[kept]
        spread = float(np.linalg.norm(measured - np.mean(measured)))
        return 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread else float("nan")


def judged_of(signals: Iterable[str]) -> str:
    """Return the signal that a match is judged by: vt, or the first where there is no vt."""
    names = tuple(signals)
    return "vt" if "vt" in names else names[0]


@dataclass(frozen=True, eq=False)
class IterationResponses:
    """The response after some iterations of a fit: ``samples`` (K, M) of one signal, per unit.

    ``numbers`` (K,) are those of the iterations, in rising order; 0 is the start. What is left out
    of the comparison is nan.
    """

    signal: str
    numbers: tuple[int, ...]
    samples: Array


@dataclass(frozen=True)
class Comparison:
    """A simulated response beside a record: ``time`` (M,) in s, one overlay per signal.

    ``cost`` is of the weighted residuals of all signals; ``rmse``, ``max_error`` and
    ``fit_percent`` are those of vt, or of the first signal where there is no vt. Features are those
    of vt after the first step, None where the record does not have it. ``courses`` show how a fit
    came about, None where that is not kept.
    """

    name: str
    time: Array
    overlays: Mapping[str, Overlay]
    cost: float
    measured: Features | None
    simulated: Features | None
    record: Path
    sha256: str
    substeps: int
    rmse_limit: float | None = None
    iteration_responses: IterationResponses | None = None

    @property
    def judged_by(self) -> str:
        """The name of the signal that the match is judged by."""
        return judged_of(self.overlays)

    @property
    def judged(self) -> Overlay:
        """The signal that the match is judged by."""
        return self.overlays[self.judged_by]

    @property
    def rmse(self) -> float:
        """Root mean square of its error, per unit."""
        return self.judged.rmse

    @property
    def max_error(self) -> float:
        """Largest magnitude of its error, per unit."""
        return self.judged.max_error

    @property
    def fit_percent(self) -> float:
        """Its fit percentage; not above zero where a constant would match as well."""
        return self.judged.fit_percent

    @property
    def accepted(self) -> bool:
        """Whether the error is within the limit that the case sets, if it sets one."""
        return self.rmse_limit is None or self.rmse <= self.rmse_limit

    def as_json(self) -> dict[str, Any]:
        """Return the figures, without the samples."""
        return {
            "name": self.name,
            "record": self.record.name,
            "rmse": self.rmse,
            "max_error": self.max_error,
            "fit_percent": self.fit_percent,
            "cost": self.cost,
            "accepted": self.accepted,
            "channels": {
                signal: {"rmse": o.rmse, "max_error": o.max_error, "fit_percent": o.fit_percent}
                for signal, o in self.overlays.items()
            },
            "features": {
                "measured": None if self.measured is None else asdict(self.measured),
                "simulated": None if self.simulated is None else asdict(self.simulated),
            },
        }


class Minimum(NamedTuple):
    """A minimum of the cost: the values there, and how many starts led to it."""

    values: Mapping[str, float]
    cost: float
    starts: int


@dataclass(frozen=True, eq=False)
class Minima:
    """What a search from many starts found: the distinct minima, the lowest first.

    ``start_costs`` (starts,) are inf where there is no response, ``end_costs`` (starts,) nan where
    a start was not refined.
    """

    minima: tuple[Minimum, ...]
    start_costs: Array
    end_costs: Array

    @property
    def failed(self) -> int:
        """How many starts have no response."""
        return int(np.count_nonzero(np.isinf(self.start_costs)))

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "starts": len(self.start_costs),
            "refined": int(np.count_nonzero(np.isfinite(self.end_costs))),
            "failed": self.failed,
            "minima": [one._asdict() for one in self.minima],
            "start_costs": self.start_costs.tolist(),
            "end_costs": self.end_costs.tolist(),
        }


class PartOf(NamedTuple):
    """A part of what was fitted: its kind, its model, how its parameters' names begin."""

    kind: str
    name: str
    prefix: str


@dataclass(frozen=True)
class FitResult:
    """A fit: what was found, how, and how well it matches.

    ``parameters`` holds the fitted ones, ``fixed`` all others of every part, those that follow
    others by ``ties`` too, under their names in the system: KA, machine.Tpd0. ``cost`` is what the
    fit made small, ``comparisons`` are with each record, ``knowledge`` is what they tell of the
    parameters, None where that is not known; ``about`` is what identifies the unit and the test.
    """

    case: Path
    name: str
    model: str
    strategy: str
    saturation: str
    parameters: Mapping[str, FittedParameter]
    fixed: Mapping[str, float]
    ties: Mapping[str, str]
    typical: tuple[str, ...]
    parts: tuple[PartOf, ...]
    cost: float
    comparisons: tuple[Comparison, ...]
    knowledge: UncertaintyAnalysis | None
    minima: Minima | None
    status: int
    message: str
    success: bool
    interrupted: bool
    history: tuple[Iteration, ...]
    nfev: int
    njev: int
    simulations: int
    substeps: int
    seconds: float
    notes: tuple[str, ...]
    validation: tuple[Comparison, ...]
    versions: Mapping[str, str]
    inputs: Mapping[str, str]
    about: Mapping[str, float | str] = field(default_factory=dict)

    @property
    def comparison(self) -> Comparison:
        """The comparison with the first record."""
        return self.comparisons[0]

    @property
    def nit(self) -> int:
        """Number of iterations."""
        return len(self.history) - 1

    @property
    def start_cost(self) -> float:
        """The cost of the start values."""
        return self.history[0].cost if self.history else float("nan")

    @property
    def values(self) -> dict[str, float]:
        """Every parameter of all parts."""
        return {**self.fixed, **{name: one.value for name, one in self.parameters.items()}}

    def values_of(self, prefix: str) -> dict[str, float]:
        """Return the values of one part by symbol; the exciter's prefix is empty."""
        own = {name: v for name, v in self.values.items() if name.startswith(prefix)}
        if not prefix:
            others = tuple(part.prefix for part in self.parts if part.prefix)
            own = {name: v for name, v in own.items() if not name.startswith(others)}
        return {name.removeprefix(prefix): value for name, value in own.items()}

    @property
    def accepted(self) -> bool:
        """Whether every validation is within the limit of the case."""
        return all(one.accepted for one in self.validation)

    @property
    def describes(self) -> bool:
        """Whether the response matches every record better than a constant would."""
        return all(one.fit_percent > 0.0 for one in self.comparisons)

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` prints: everything but history and samples."""
        return {
            "case": str(self.case),
            "about": dict(self.about),
            "model": self.model,
            "strategy": self.strategy,
            "saturation": self.saturation,
            "parameters": {
                name: {
                    "value": one.value,
                    "start": one.start,
                    "min": one.min,
                    "max": one.max,
                    "at_bound": one.at_bound,
                    "of_record": one.of_record,
                    **self._confidence_as_json(name),
                }
                for name, one in self.parameters.items()
            },
            "fixed": {
                name: value
                for name, value in self.values_of("").items()
                if name not in self.parameters
            },
            "ties": dict(self.ties),
            "typical": list(self.typical),
            **self._parts_as_json(),
            "cost": self.cost,
            "start_cost": self.start_cost,
            "rmse": self.comparison.rmse,
            "status": self.status,
            "message": self.message,
            "success": self.success,
            "interrupted": self.interrupted,
            "nit": self.nit,
            "nfev": self.nfev,
            "njev": self.njev,
            "simulations": self.simulations,
            "substeps": self.substeps,
            "seconds": self.seconds,
            "notes": list(self.notes),
            "fit": self.comparison.as_json(),
            "records": [one.as_json() for one in self.comparisons],
            "minima": None if self.minima is None else self.minima.as_json(),
            "knowledge": None if self.knowledge is None else self.knowledge.as_json(),
            "validation": [one.as_json() for one in self.validation],
            "versions": dict(self.versions),
            "inputs": dict(self.inputs),
        }

    def _confidence_as_json(self, name: str) -> dict[str, Any]:
        """Return how well a parameter is known."""
        if self.knowledge is None:
            why = "the search was interrupted" if self.interrupted else "no finite derivatives"
            return {"std_error": None, "interval": None, "why": why}
        one = self.knowledge.confidence.parameters[name]
        return {"std_error": one.std_error, "interval": one.interval, "why": one.why}

    def _parts_as_json(self) -> dict[str, Any]:
        """Return the values of machine, network and stabiliser, and the names of their models."""
        content: dict[str, Any] = {}
        parts = {part.kind: part for part in self.parts}
        for kind in ("machine", "network", "stabiliser"):
            part = parts.get(kind)
            content[kind] = {} if part is None else self.values_of(part.prefix)
            content[f"{kind}_model"] = None if part is None else part.name
        return content
