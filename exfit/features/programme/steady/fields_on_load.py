"""The field signals at points on load, as functions of the machine's data: what a fit compares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exfit.errors import ModelError
from exfit.features.programme.steady.point_fit import FittedPoints, PointProblem, fit_points
from exfit.fitting.parameters import FreeParameter
from exfit.inference.linear import ResidualBlock
from exfit.models.machines import Machine
from exfit.plants.loaded_machine import Flow, loaded_at_rest
from exfit.plants.parts import Names
from exfit.signals import NOISE

Array = NDArray[np.float64]
Values = Mapping[str, float]

SALIENCY = "saliency"  # (1 - Xq / Xd)^2, in which the field current is smooth up to Xq = Xd
UP_TO_XD = "has no upper limit: the points do not exclude Xq = Xd"


class FieldMeasurement(NamedTuple):
    """Readings (M,) of a field signal in ``unit``, of which ``base`` is 1 pu.

    ``noise`` is their standard deviation, pu, where it is known; ``free_base`` says between which
    bounds the base is found, if it is not known.
    """

    measured: Array
    unit: str = "pu"
    base: float = 1.0
    noise: float | None = None
    free_base: FreeParameter | None = None


class PointsOnLoad(NamedTuple):
    """Points at rest, each (M,) per unit on the machine's base, and readings of its field."""

    p: Array
    q: Array
    vt: Array
    measurements: Mapping[str, FieldMeasurement]


@dataclass(frozen=True, eq=False)
class FieldsOnLoad:
    """The field signals at points on load, by a machine's model."""

    machine: Machine
    points: PointsOnLoad

    @property
    def symbols(self) -> tuple[str, ...]:
        """The machine's data by symbol."""
        return tuple(row.symbol for row in self.machine.sheet)

    def problem(self, data: Values, free: Sequence[FreeParameter]) -> PointProblem:
        """Return the fit of free machine data, and of the bases that are free."""
        measurements = self.points.measurements
        bases = {base_of(signal): measurement.base for signal, measurement in measurements.items()}
        free_bases = (measurement.free_base for measurement in measurements.values())
        parameters = (*free, *(base for base in free_bases if base is not None))
        priors = {each.name: each.prior for each in parameters if each.prior is not None}
        return PointProblem(self.errors, {**data, **bases}, parameters, self.blocks, priors)

    def fit(self, problem: PointProblem) -> FittedPoints:
        """Return the fit of what is free; raises ModelError where its start contradicts itself."""
        start = {**problem.given, **{each.name: each.start for each in problem.free}}
        for symbol, text in self.machine.faults(start):
            raise ModelError(f"{self.machine.name}: the fit starts from {symbol}: {text}")
        fit = fit_points(problem, self.search(problem))
        known = fit.confidence.parameters.get("Xq")
        if known is None or known.interval is None or known.interval[1] is not None:
            return fit
        quadrature = next(each for each in problem.free if each.name == "Xq")
        if quadrature.high < fit.values["Xd"]:
            return fit
        return fit.explained("Xq", UP_TO_XD)

    def search(self, problem: PointProblem) -> PointProblem:
        """Return the same problem with SALIENCY free in place of Xq.

        By Xq itself the field current is stationary where Xq = Xd: a descent that comes there finds
        no way back, and beyond it the same field currents return.
        """
        quadrature = next((each for each in problem.free if each.name == "Xq"), None)
        if quadrature is None:
            return problem
        start = {**problem.given, **{each.name: each.start for each in problem.free}}
        share = min(quadrature.start / start["Xd"], 1.0)
        saliency = FreeParameter(SALIENCY, (1.0 - share) ** 2, 0.0, 1.0, logarithmic=False)

        def following(values: dict[str, float]) -> dict[str, float]:
            xq = values["Xd"] * (1.0 - sqrt(values[SALIENCY]))
            return values | {"Xq": min(max(xq, quadrature.low), quadrature.high)}

        return replace(
            problem,
            free=tuple(saliency if each is quadrature else each for each in problem.free),
            following=following,
            leading=lambda values: {
                SALIENCY: (1.0 - min(values["Xq"] / values["Xd"], 1.0)) ** 2,
                **values,
            },
        )

    @property
    def blocks(self) -> tuple[ResidualBlock, ...]:
        """Slices of the errors of each field signal."""
        count = len(self.points.p)
        return tuple(
            ResidualBlock(
                signal,
                slice(k * count, (k + 1) * count),
                noise=None if measurement.noise is None else 1.0,
                weight=weight_of(signal, measurement),
            )
            for k, (signal, measurement) in enumerate(self.points.measurements.items())
        )

    def errors(self, values: Values) -> Array:
        """Return the weighted errors of all field signals; nan where the data contradict."""
        measurements = self.points.measurements
        if any(True for _ in self.machine.faults(values)):
            return np.full(len(self.points.p) * len(measurements), np.nan)
        ifd = self.simulated({**values, "Xq": min(values["Xq"], values["Xd"])})
        # in shares of the base at the start: the weights of the readings stay as they are
        errors = [
            weight_of(signal, measurement)
            * (ifd * values[base_of(signal)] - measurement.measured)
            / measurement.base
            for signal, measurement in measurements.items()
        ]
        return np.concatenate(errors)

    def simulated(self, values: Values) -> Array:
        """Return the model's field current (M,), which is its field voltage at rest."""
        data = {symbol: values[symbol] for symbol in self.symbols}
        return field_on_load(self.machine, data, self.points.p, self.points.q, self.points.vt)


def base_of(signal: str) -> str:
    """Return the name of the base of a field signal."""
    return f"{signal}.base"


def weight_of(signal: str, measurement: FieldMeasurement) -> float:
    """Return the weight of the errors of a field signal: one over its noise, or a typical one."""
    return 1.0 / (NOISE[signal] if measurement.noise is None else measurement.noise)


def field_on_load(
    machine: Machine, data: Mapping[str, float], p: ArrayLike, q: ArrayLike, vt: ArrayLike
) -> Array:
    """Return ifd (M,) that holds p, q and vt, each (M,), all per unit; efd at rest is the same.

    ``data`` has a value for every symbol of the machine's sheet. It is nan where no rest exists.

    Source: Kundur, Power System Stability and Control, 3.6.3 to 3.6.5 (steady state, on the
    machine's rotor axes); saturation as the machine's model has it.
    """
    active, reactive, voltage = (np.asarray(signal, np.float64) for signal in (p, q, vt))
    terminals = Flow(active / voltage, reactive / voltage, voltage, np.zeros_like(voltage))
    with np.errstate(all="ignore"):
        ifd = loaded_at_rest(voltage, terminals, machine, Names(**data)).ifd
    return np.asarray(ifd, np.float64)
