"""V-curves as data: what the points were, what the machine's model has there, what was fitted."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exfit.results.model import FittedParameter
from exfit.results.verdict import Verdict
from exfit.util.typed import IN_FILE, plain

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FieldReading:
    """The readings of ifd or efd at the points, and the same by the model, (M,) per unit.

    ``base`` is what 1 pu is in ``unit``: as given, or as fitted, then ``base_fitted``. ``noise`` is
    the standard deviation that was given for the readings (pu); ``scatter`` that of the residuals,
    less what was fitted (pu), None without a fit; ``limit`` the largest rms that counts as a match.
    """

    DERIVED: ClassVar = {"rms": "rms", "worst": "worst"}

    signal: str
    unit: str
    base: float
    measured: Array
    simulated: Array
    noise: float | None
    scatter: Annotated[float, nan] | None
    limit: float
    base_fitted: bool = False

    @property
    def residuals(self) -> Array:
        """Simulated less measured (M,), pu."""
        return np.asarray(self.simulated - self.measured)

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, pu."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def worst(self) -> int:
        """The point with the largest residual, counted from 0."""
        return int(np.argmax(np.abs(self.residuals)))

    @property
    def matches(self) -> bool:
        """Whether the residuals are within their limit."""
        return self.rms <= self.limit


@dataclass(frozen=True, eq=False)
class PowerLevel:
    """The V-curve of one power: the ``points`` that belong to it, and the model's curve (K,).

    ``p`` is the mean of these points; the curve runs over ``q``, at voltages ``vt`` that follow a
    line through those of the points, with stator current ``it`` and field current ``ifd``, pu.
    """

    p: float
    points: tuple[int, ...]
    q: Array
    vt: Array
    it: Array
    ifd: Array


@dataclass(frozen=True, eq=False)
class VCurve:
    """Points of V-curves (M,) per unit on the machine's base, beside the machine's model.

    ``given`` are the machine's data before anything was fitted, ``machine_data`` those after;
    ``parameters`` what was fitted: machine data by symbol, ``ifd.base`` and ``efd.base`` in the
    unit of the column. ``undetermined`` says what the points leave open, ``notes`` what else is
    remarkable.
    """

    DERIVED: ClassVar = {"it": "it", "determined": "determined"}

    machine: str
    p: Array
    q: Array
    vt: Array
    readings: Mapping[str, FieldReading]
    given: Mapping[str, float]
    machine_data: Mapping[str, float]
    parameters: Mapping[str, FittedParameter]
    verdict: Verdict
    undetermined: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    levels: tuple[PowerLevel, ...] = field(default=(), metadata=IN_FILE)

    @property
    def it(self) -> Array:
        """The stator current at each point (M,), pu."""
        return np.asarray(np.hypot(self.p, self.q) / self.vt)

    @property
    def determined(self) -> tuple[str, ...]:
        """The machine data that were fitted and that the points limit on both sides."""
        return tuple(
            name
            for name, parameter in self.parameters.items()
            if parameter.determined and not parameter.of_record
        )

    def as_json(self) -> dict[str, Any]:
        """The plain data of all but the curves."""
        data: dict[str, Any] = plain(self)
        return data
