"""What a least-squares fit determines of its parameters, and what it does not.

Arrays in, results out: a `Linearisation` of the fit at its minimum gives `confidence` (standard
errors, intervals), `identifiability` (what can move together unseen, and what to fix) and `effects`
(which parameter matters first).
"""

from exfit.inference.combinations import WEAK, Combination, SignalChange
from exfit.inference.confidence import (
    CORRELATED,
    LEVEL,
    TIED,
    UNDETERMINED,
    Confidence,
    Correlation,
    Interval,
    IntervalMethod,
    Uncertainty,
    closed,
    confidence,
    partners_on_bounds,
    rises,
)
from exfit.inference.fixings import Fixing
from exfit.inference.identifiability import Identifiability, identifiability
from exfit.inference.linear import Linearisation, PriorRow, ResidualBlock, Rounding
from exfit.inference.noise import Noise
from exfit.inference.sensitivity import ParameterEffect, effects

__all__ = [
    "CORRELATED",
    "LEVEL",
    "TIED",
    "UNDETERMINED",
    "WEAK",
    "Combination",
    "Confidence",
    "Correlation",
    "Fixing",
    "Identifiability",
    "Interval",
    "IntervalMethod",
    "Linearisation",
    "Noise",
    "ParameterEffect",
    "PriorRow",
    "ResidualBlock",
    "Rounding",
    "SignalChange",
    "Uncertainty",
    "closed",
    "confidence",
    "effects",
    "identifiability",
    "partners_on_bounds",
    "rises",
]
