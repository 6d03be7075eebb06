"""The parameters that a fit may move, as it moves them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, log, nan
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.parts import bounds_of
from exfit.case.schema import FreeSection
from exfit.models.sheet import Parameter
from exfit.util.text import LARGEST

LARGEST_FACTOR = 4.0  # by which a value may differ from the given one
LARGEST_LOGARITHM = log(LARGEST)  # of a value that has no upper bound
UNIT = 0.5  # of a scaled parameter, a reasonable step: a factor of 1.6, or half of the interval


class Prior(NamedTuple):
    """Prior of a parameter: its mean and standard deviation."""

    mean: float
    std: float


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that the fit may move, between ``low`` and ``high``, which may be infinite.

    The estimator sees its logarithm, or its place in the interval where zero may be reached; where
    a ``divisor`` is given, the value over that. A value below ``least`` has no response.
    ``given`` are those bounds that a case has; the others are limits of the equations, which say
    nothing of its size. None: both are bounds.
    """

    name: str
    start: float
    low: float
    high: float
    logarithmic: bool
    prior: Prior | None = None
    divisor: float | None = None
    least: float = -inf
    given: tuple[float, ...] | None = None

    @cached_property
    def width(self) -> float:
        """The interval between the bounds.

        Without one of them it is twice the distance of the start to zero or, where that is more,
        to the other one: half of it, a reasonable step, then is the size of the start. Where that
        is 0, it is the interval that the equations allow, if they do. Bounds that rounding makes
        one leave nothing to scale: any number will do.
        """
        interval = self.high - self.low
        if self.given is None and isfinite(interval):
            return interval or 1.0
        given = (self.low, self.high) if self.given is None else self.given
        distances = [abs(self.start - bound) for bound in (0.0, *given) if isfinite(bound)]
        return 2.0 * max(distances) or (interval if isfinite(interval) else 0.0)

    @property
    def unit(self) -> float:
        """A reasonable step of the scaled parameter."""
        return UNIT if self.logarithmic else UNIT * self.width / self._linear_scale

    @property
    def _linear_scale(self) -> float:
        return self.width if self.divisor is None else self.divisor

    @cached_property
    def _scaled_bounds(self) -> dict[float, float]:
        """The bounds by what is scaled of them."""
        return {self.scaled(bound): bound for bound in (self.high, self.low)}

    def scaled(self, value: float) -> float:
        """Number that the estimator moves for a value; nan for one that its scale does not have."""
        if not self.logarithmic:
            return value / self._linear_scale
        if value > 0.0:
            return float(np.log(value))
        return -inf if value == 0.0 else nan

    def value(self, scaled: float) -> float:
        """Return the parameter's own value; at a bound, exactly that bound."""
        if scaled in self._scaled_bounds:
            return self._scaled_bounds[scaled]
        return _exp(scaled) if self.logarithmic else scaled * self._linear_scale

    def bound(self, value: float) -> Literal["min", "max"] | None:
        """Name the bound on which a value lies."""
        if value == self.low:
            return "min"
        return "max" if value == self.high else None

    @property
    def scaled_least(self) -> float:
        """Scaled form of ``least``."""
        return -inf if self.logarithmic else self.least / self._linear_scale

    def slope(self, scaled: float) -> float:
        """Return d value / d scaled."""
        return _exp(scaled) if self.logarithmic else self._linear_scale


def _exp(logarithm: float) -> float:
    return float(np.exp(min(logarithm, LARGEST_LOGARITHM)))


def free_parameter(name: str, section: FreeSection, row: Parameter | None) -> FreeParameter:
    """Return a parameter that a case leaves free, as a fit moves it."""
    prior = None if section.prior is None else Prior(section.prior.mean, section.prior.sigma)
    bounds = tuple(bound for bound in (section.min, section.max) if bound is not None)
    return FreeParameter(
        name,
        section.start,
        *bounds_of(section, row),
        section.scale == "log",
        prior,
        {"raw": 1.0, "start": abs(section.start)}.get(section.scale),
        0.0 if row is not None and row.is_time and row.low >= 0.0 else -inf,
        None if len(bounds) == 2 else bounds,
    )


def units_of(free: Iterable[FreeParameter]) -> NDArray[np.float64]:
    """Return a reasonable step of each scaled parameter, (N,)."""
    return np.array([parameter.unit for parameter in free])


def freed_within(
    name: str, value: float, factor: float, std_error: float | None = None
) -> FreeParameter:
    """Return a fixed value as a parameter that may change by a factor, with its error if given."""
    low, high = sorted((value / factor, value * factor))
    prior = None if std_error is None else Prior(value, std_error)
    return FreeParameter(name, value, low, high, logarithmic=value > 0.0, prior=prior)


def scaled_values(
    free: Iterable[FreeParameter], values: Mapping[str, float]
) -> NDArray[np.float64]:
    """Return the numbers (N,) that the estimator moves, at values by name."""
    return np.array([parameter.scaled(values[parameter.name]) for parameter in free])
