"""What a reader must know beside the numbers."""

from dataclasses import dataclass

from exfit.results.model import FitResult
from exfit.results.validation_result import ValidationResult


@dataclass(frozen=True)
class Findings:
    """What the records leave unresolved, and the notes of the fit."""

    unresolved: tuple[str, ...]
    notes: tuple[str, ...]


def findings_of_validation(result: ValidationResult) -> Findings:
    """Return the notes on the records of a validation."""
    return Findings((), result.notes)


def findings(result: FitResult) -> Findings:
    """Return the findings of a fit."""
    uncertainty = result.knowledge
    return Findings(() if uncertainty is None else uncertainty.sentences, result.notes)
