"""The models of a fit with their drawings."""

from exfit.results.description import PartDescription
from exfit.results.model import FitResult


def model(result: FitResult) -> tuple[PartDescription, ...]:
    """Return the models that were fitted; a network is none."""
    return tuple(part for part in result.parts if part.kind != "network")
