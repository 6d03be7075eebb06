"""An exciter's saturation as AEX exp(BEX E), from which its two points follow exactly."""

from collections.abc import Iterator, Mapping
from typing import Any

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.models.sheet import Sheet
from exfit.util.text import Place

CONSTANTS = ("AEX", "BEX")
POINTS = ("SE1", "SE2")
MEANINGS = {"AEX": "factor of the saturation curve", "BEX": "exponent of the saturation curve"}
# the saturation at a voltage, by the form of the curve: VX = E SE is the exponential, or SE is
FORMS = {"exponential": "=AEX*exp(BEX*{0})/{0}", "exponential-se": "=AEX*exp(BEX*{0})"}


def has_saturation(sheet: Sheet) -> bool:
    """Tell if a model has the two points of a saturation curve."""
    return {*POINTS} <= {row.symbol for row in sheet}


def saturation_ties(data: Mapping[str, Any], sheet: Sheet) -> Iterator[tuple[str, Place, str]]:
    """Yield name, place and text of the points that follow from AEX and BEX, where these are given.

    The points are those of the data sheet's voltages E1 and E2, or of the case's.
    """
    parameters = ContentNode((), data).at("parameters")
    form = FORMS.get(str(data.get("saturation")))
    given = [*_given(parameters)]
    if form is None or len(given) < len(CONSTANTS) or not has_saturation(sheet):
        return
    for symbol in POINTS:
        yield symbol, given[-1].place, form.format(symbol.replace("SE", "E"))


def place_of_points(content: ContentNode) -> Place:
    """Find the place of AEX and BEX, from which the points follow."""
    return next((node.place for node in _given(content.at("parameters"))), ("parameters",))


def saturation_faults(content: ContentNode) -> Iterator[Fault]:
    """Check the values beside a given AEX or BEX."""
    parameters, form = content.at("parameters"), content.at("saturation").text or "quadratic"
    given = {str(node.place[-1]): node for node in _given(parameters)}
    if not given:
        return
    first = next(iter(given.values()))
    if form not in FORMS:
        text = (
            f"of an exponential curve; this case has saturation: {form}, not {' or '.join(FORMS)}"
        )
        yield first.fault(text)
    for name in CONSTANTS:
        if name not in given:
            yield Fault((*first.place[:-1], name), f"is missing: {first.place[-1]} is given")
    for node in _points(parameters):
        yield node.fault("not allowed with AEX and BEX, from which it follows")
    factor = given["AEX"].start if "AEX" in given else None
    if factor is not None and factor < 0.0:
        yield given["AEX"].fault(f"{factor:g} is below 0")


def _points(parameters: ContentNode) -> Iterator[ContentNode]:
    """Yield the places at which the points themselves are given."""
    for kind in ("fixed", "free"):
        section = parameters.at(kind)
        yield from (section.at(symbol) for symbol in POINTS if symbol in section)


def _given(parameters: ContentNode) -> Iterator[ContentNode]:
    """Yield the places at which AEX and BEX are given, in this order."""
    for name in CONSTANTS:
        for kind in ("fixed", "free"):
            if name in parameters.at(kind):
                yield parameters.at(kind, name)
