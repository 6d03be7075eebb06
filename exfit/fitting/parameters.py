"""The parameters that a fit may move, as it moves them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class Prior:
    """What is known of a parameter beforehand: its mean and standard deviation."""

    mean: float
    std: float


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that the fit may move, between ``low`` and ``high``.

    The estimator sees its logarithm, or its place in the interval where zero may be reached.
    """

    name: str
    start: float
    low: float
    high: float
    logarithmic: bool
    prior: Prior | None = None

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
