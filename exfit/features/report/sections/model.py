"""The models of a fit with their drawings, and the saturation curve of the exciter."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, log

from exfit.features.drawings.diagram import block_diagram
from exfit.features.drawings.letters import diagram_and_remarks
from exfit.features.report.sections.other_program import has_no_equations, other_program
from exfit.results.description import PartDescription
from exfit.results.validation_result import Reported

# formula of a curve, and what of a point lies on the exponential
EXPONENTIAL: Mapping[str, tuple[str, Callable[[float, float], float]]] = {
    "exponential": ("VX = AEX exp(BEX E)", lambda e, se: e * se),
    "exponential-se": ("VX = E SE, SE = AEX exp(BEX E),", lambda _, se: se),
}


@dataclass(frozen=True)
class ModelView:
    """The models that were fitted; ``saturation`` is a sentence, empty where there is none.

    ``other_program`` are sentences on what simulated in place of exfit.
    """

    parts: tuple["PartView", ...]
    saturation: str
    other_program: tuple[str, ...] = ()
    has_equations: bool = True


@dataclass(frozen=True)
class PartView:
    """A model with its block diagram as SVG, empty where it has none, and what is said of it."""

    part: PartDescription
    diagram: str
    remarks: tuple[str, ...]


def model(result: Reported) -> ModelView:
    """Return the models that were fitted; a network is none."""
    parts = (part for part in result.parts if part.kind != "network")
    return ModelView(
        tuple(map(_view, parts)),
        saturation(result),
        other_program(result),
        not has_no_equations(result),
    )


def _view(part: PartDescription) -> PartView:
    _, remarks = diagram_and_remarks(part.drawing)
    return PartView(part, block_diagram(part.drawing, part.name, part.title), tuple(remarks))


def saturation(result: Reported) -> str:
    """Return the saturation curve of the exciter in words: its points, its form, its constants."""
    values = result.values_of("")
    if not {"E1", "SE1", "E2", "SE2"} <= values.keys():
        return ""
    e1, se1, e2, se2 = (values[name] for name in ("E1", "SE1", "E2", "SE2"))
    if se1 == se2 == 0.0:
        return "The exciter has no saturation: SE1 and SE2 are 0."
    points = f"SE({e1:g}) = {se1:.4g}, SE({e2:g}) = {se2:.4g}"
    if min(se1, se2) <= 0.0 or result.saturation not in EXPONENTIAL:
        return f"Saturation of the exciter: {points}, {result.saturation} between them."
    formula, height = EXPONENTIAL[result.saturation]
    heights = height(e1, se1), height(e2, se2)
    exponent = log(heights[1] / heights[0]) / (e2 - e1)
    factor = heights[0] * exp(-exponent * e1)
    constants = f"AEX = {factor:.4g}, BEX = {exponent:.4g} 1/pu"
    return f"Saturation of the exciter: {points}, which is {formula} with {constants}."
