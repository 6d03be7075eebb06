"""What a new case frees of a model: its parameters, by the values they start from, and bounds."""

from collections.abc import Mapping

from exfit.models.blocks import SHORTEST
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Parameter, SearchRange, typical

ALONE = "FIRST_ORDER"  # the model whose output is vt itself
BOUNDS = (0.1, 10.0)  # times the start
WITHIN = 2.0  # a factor: a start is at least so far from the bounds that its sheet names


def free_of(
    model: Model | Machine, values: Mapping[str, float] | None = None
) -> tuple[Parameter, ...]:
    """Return the parameters that a bump test is fitted for: those marked in the data sheet.

    Left out is what has no effect with these values, by default the typical ones: a gain or time
    of zero, the lag of a term whose gain is zero, and one of two alternatives. Of a sheet without a
    mark, as a user's own may be, they are its time constants and gains.
    """
    own = typical(model.sheet) if values is None else values
    marked = [(row, row.search) for row in model.sheet if row.search is not None]
    if marked:
        return tuple(row for row, search in marked if _acts(row, search, own))
    return tuple(
        row
        for row in model.sheet
        if own[row.symbol] > 0.0 and (row.is_time or row.symbol.upper().startswith("K"))
    )


def bounds_of(row: Parameter, start: float | None = None) -> tuple[float, float]:
    """Return a tenth and ten times a start, as far as units of its kind and the sheet go."""
    value = row.typical if start is None else start
    low, high = (share * value for share in BOUNDS)
    if row.search is not None:
        low = max(low, min(row.search.low, value / WITHIN))
        high = min(high, max(row.search.high, value * WITHIN))
    if row.is_time:
        low = max(low, SHORTEST)
    return max(low, row.low), min(high, row.high)


def _acts(row: Parameter, search: SearchRange, values: Mapping[str, float]) -> bool:
    """Tell if a parameter has an effect of its own with these values."""
    own = values[row.symbol]
    if own == 0.0 or (search.needs and values[search.needs] == 0.0):
        return False
    if search.unlike and values[search.unlike] == own:
        return False
    others = [values[symbol] for symbol in search.instead_of]
    return not others or len(set(others)) == 1
