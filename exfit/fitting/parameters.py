"""The parameters that a fit may move, as it moves them."""

from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Literal

import numpy as np

UNIT = 0.5  # of a scaled parameter, a reasonable step: a factor of 1.6, or half of the interval


@dataclass(frozen=True)
class Prior:
    """What is known of a parameter beforehand: its mean and standard deviation."""

    mean: float
    std: float


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that the fit may move, between ``low`` and ``high``, which may be infinite.

    The estimator sees its logarithm, or its place in the interval where zero may be reached.
    """

    name: str
    start: float
    low: float
    high: float
    logarithmic: bool
    prior: Prior | None = None

    @cached_property
    def width(self) -> float:
        """The interval between the bounds.

        Without one of them it is twice the distance of the start to zero or, where that is more,
        to the other one: half of it, a reasonable step, then is the size of the start.
        """
        if isfinite(self.high - self.low):
            return self.high - self.low
        given = [bound for bound in (0.0, self.low, self.high) if isfinite(bound)]
        return 2.0 * max(abs(self.start - bound) for bound in given)

    @cached_property
    def _scaled_bounds(self) -> dict[float, float]:
        """The bounds by what is scaled of them."""
        return {self.scaled(bound): bound for bound in (self.high, self.low)}

    def scaled(self, value: float) -> float:
        """Return the number that the estimator moves."""
        return float(np.log(value)) if self.logarithmic else value / self.width

    def value(self, scaled: float) -> float:
        """Return the parameter's own value; at a bound, exactly that bound."""
        if scaled in self._scaled_bounds:
            return self._scaled_bounds[scaled]
        return float(np.exp(scaled)) if self.logarithmic else scaled * self.width

    def bound(self, value: float) -> Literal["min", "max"] | None:
        """Return which bound a value lies on."""
        if value == self.low:
            return "min"
        return "max" if value == self.high else None

    def slope(self, scaled: float) -> float:
        """Return d value / d scaled."""
        return float(np.exp(scaled)) if self.logarithmic else self.width
