"""What a least-squares fit determines of its parameters, and what it does not.

Arrays in, results out: a `Linearisation` of the fit at its minimum gives `confidence` (standard
errors, intervals) and `identifiability` (what can move together unseen, and what to fix).
"""

from exfit.inference.combinations import WEAK, Combination, SignalChange
from exfit.inference.confidence import (
    LEVEL,
    UNDETERMINED,
    Confidence,
    Correlation,
    Uncertainty,
    confidence,
    rises,
)
from exfit.inference.fixings import Fixing
from exfit.inference.identifiability import Identifiability, identifiability
from exfit.inference.linear import Linearisation, PriorRow, ResidualBlock
from exfit.inference.noise import Noise

__all__ = [
    "LEVEL",
    "UNDETERMINED",
    "WEAK",
    "Combination",
    "Confidence",
    "Correlation",
    "Fixing",
    "Identifiability",
    "Linearisation",
    "Noise",
    "PriorRow",
    "ResidualBlock",
    "SignalChange",
    "Uncertainty",
    "confidence",
    "identifiability",
    "rises",
]
