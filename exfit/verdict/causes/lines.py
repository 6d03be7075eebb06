"""Lines for the case that leave to the fit what may be wrong, each with the place it belongs to."""

from collections.abc import Mapping
from math import inf

from exfit.case.case import Case
from exfit.inference.wording import listed
from exfit.util.text import dotted, yaml_number

FACTOR = 4.0  # from the start of a freed value to its bounds
FACTOR_OF_STEP = 5.0  # from the start of a step to its bounds
DIGITS = 3  # of a number in a line


def freeing(case: Case, starts: Mapping[str, float]) -> str:
    """Word the change of a case that frees values of a part; "" if its section has no free ones."""
    names = [*starts]
    part = next(
        part
        for part in reversed(case.parts.all)
        if names[0].startswith(part.prefix) and names[0].removeprefix(part.prefix) in part.symbols
    )
    if part.free is None:
        return ""
    values = case.values()
    given = {symbol: values[part.prefix + symbol] for symbol in part.symbols}
    freed = {name.removeprefix(part.prefix): start for name, start in starts.items()}
    if any(part.check(given | freed)):  # what matches best may be no machine's
        freed = {symbol: given[symbol] for symbol in freed}
    ranges = {row.symbol: row.domain for row in part.sheet}
    lines = (f"`{symbol}: {parameter(start, ranges[symbol])}`" for symbol, start in freed.items())
    places = f"under {dotted(part.free)}, in place of {dotted(part.fixed)}"
    return f"or free {listed(names)}: {places}, {', '.join(lines)}"


def step_found(size: float) -> str:
    """Write the line that leaves the size of a step (pu) to the fit."""
    return f"under vref: `step: {within(size, FACTOR_OF_STEP)}`"


def delay_found(delay: float, farthest: float) -> str:
    """Write the line that leaves the delay of a recorder (s) to the fit."""
    return f"under record: `delay: {between(delay, delay - farthest, delay + farthest)}`"


def offset_found(signal: str, offset: float, farthest: float) -> str:
    """Write the line that leaves the offset of a channel (pu) to the fit."""
    line = between(offset, offset - farthest, offset + farthest)
    return f"under record.channels.{signal}, beside its column: `offset: {line}`"


def within(start: float, factor: float, limits: tuple[float, float] = (-inf, inf)) -> str:
    """Write the entry of a value that is fitted within a factor of its start."""
    low, high = sorted((start / factor, start * factor))
    return between(start, max(low, limits[0]), min(high, limits[1]))


def parameter(start: float, limits: tuple[float, float]) -> str:
    """Write the entry of a free parameter: below 0 there is no log scale."""
    found = within(start, FACTOR, limits)
    return found if start > 0.0 else f"{found[:-1]}, scale: linear}}"


def between(start: float, low: float, high: float) -> str:
    """Write the entry of a value that is fitted between bounds."""
    numbers = (yaml_number(float(f"{number:.{DIGITS}g}")) for number in (start, low, high))
    return "{{start: {}, min: {}, max: {}}}".format(*numbers)
