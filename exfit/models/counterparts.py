"""Which parameters of two models are the same quantity: by what their data sheets say of them.

A name says little of it: KD is a derivative gain in DC4B and the demagnetising factor in AC1A, and
the limits VRMAX of AC1A and of EXAC1 are at different places.
"""

from collections.abc import Mapping
from typing import NamedTuple

from exfit.models.sheet import Parameter, Sheet

NO_LIMIT = 9999.0  # pu: where the data sheets end
OUT_OF_REACH = 99.0  # pu: data sheets write limits that never act as 99 or 999

# what qualifies a limit, not which one it is
QUALIFIERS = (", and at rated voltage", ", or 0", " at rated voltage")
SAME: Mapping[str, str] = {
    "proportional gain of the regulator": "proportional gain",
    "integral gain of the regulator": "integral gain",
    "derivative gain of the regulator": "derivative gain",
    "first regulator lag": "regulator lag",
    "first regulator lead": "regulator lead",
    "stabilising feedback gain up to EFDN": "stabilising feedback gain",
    "stabilising feedback gain beyond EFDN": "stabilising feedback gain",
    "limit of the exciter's field current": "ceiling of the exciter's field current",
    "ceiling of the bridge voltage": "ceiling of the field voltage",
    "floor of the bridge voltage": "floor of the field voltage",
}
# of the rectifier of a static exciter, which moves its ceiling alone and is not fitted
LOADING, CEILING_LOADING = "rectifier loading factor", "rectifier loading of the ceiling"
# the value of a quantity at which its block does nothing
WITHOUT_EFFECT: Mapping[str, float] = {
    "voltage transducer lag": 0.0,
    "regulator lag": 0.0,
    "regulator lead": 0.0,
    "second regulator lag": 0.0,
    "second regulator lead": 0.0,
    "regulator time constant": 0.0,
    "proportional gain": 1.0,
    "integral gain": 0.0,
    "derivative gain": 0.0,
    "second stage gain": 1.0,
    "loading factor of the supply's rectifier": 0.0,
    "feedback gain of the exciter's field current": 0.0,
    "stabilising feedback gain": 0.0,
    "stabilising feedback lag": 0.0,
    "stabilising feedback lead": 0.0,
    LOADING: 0.0,
    CEILING_LOADING: 0.0,
    "demagnetising factor": 0.0,
    "exciter constant": 1.0,
    "saturation at E1": 0.0,
    "saturation at E2": 0.0,
    "field current limit": NO_LIMIT,
}
# the limits of the signal's way from the regulator to the field voltage: each bounds the same
CEILINGS = (
    "regulator ceiling",
    "ceiling of the exciter's field voltage",
    "ceiling of the field voltage",
    "ceiling of the PID",
)
FLOORS = tuple(ceiling.replace("ceiling", "floor") for ceiling in CEILINGS)
OUTPUT_FLOOR = "floor of the field voltage"
# further limits, which may be out of reach
REMOVABLE = (
    *("ceiling of the PID", "floor of the PID", "ceiling of the exciter's field current"),
    *("floor of the exciter voltage", "ceiling of the voltage error", "floor of the voltage error"),
)
GAIN, PROPORTIONAL = "regulator gain", "proportional gain"
FACTORS = (PROPORTIONAL, "second stage gain")  # of the regulator, beside its gain
LEAD, LAG = "regulator lead", "regulator lag"
LEAD_AS_SHARE = "regulator lead, as a share of its lag"
SUPPLY_SWITCH = "supply: 1 terminals, 2 independent"
FED_BY_TERMINALS = ("potential source gain", "at rated voltage", "bridge voltage")


class Counterpart(NamedTuple):
    """A parameter of a model, and that of another which is the same quantity, if there is one."""

    row: Parameter
    source: Parameter | None


def quantity(row: Parameter) -> str:
    """Name the quantity of a parameter in the same words for all data sheets."""
    meaning = row.meaning
    if meaning == LOADING and not row.free:
        return CEILING_LOADING
    for qualifier in QUALIFIERS:
        meaning = meaning.removesuffix(qualifier)
    return SAME.get(meaning, meaning)


def by_quantity(sheet: Sheet) -> dict[str, Parameter]:
    """Return the parameters of a data sheet by what they are, the first of each."""
    rows: dict[str, Parameter] = {}
    for row in sheet:
        rows.setdefault(quantity(row), row)
    return rows


def counterparts(sheet: Sheet, source: Sheet) -> tuple[Counterpart, ...]:
    """Return every parameter of a data sheet with its counterpart in another."""
    literal = {(row.meaning, quantity(row)): row for row in source}
    rows = by_quantity(source)
    return tuple(
        Counterpart(row, literal.get((row.meaning, quantity(row))) or rows.get(quantity(row)))
        for row in sheet
    )


def computed_if_zero(row: Parameter) -> bool:
    """Test for a parameter that the model computes at the start where it is given as 0."""
    return row.meaning.endswith(", or 0")


def has_effect(row: Parameter, value: float) -> bool:
    """Test for any effect of a parameter at a value."""
    if row.symbol.endswith(("MAX", "MIN")):
        return abs(value) < OUT_OF_REACH
    return WITHOUT_EFFECT.get(quantity(row)) != value
