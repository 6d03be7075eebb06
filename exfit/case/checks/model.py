"""What contradicts itself in the parameters of a model: values, bounds, what was found before."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from math import inf, isfinite
from pathlib import Path
from typing import Any

from exfit.case.bounds import is_held, search_bounds
from exfit.case.checks.node import ContentNode
from exfit.case.messages import PERCENT
from exfit.case.parts import Part, Parts, helpers_of, kind_of, places_of_ties, used_by_ties
from exfit.case.saturation import (
    CONSTANTS,
    has_saturation,
    place_of_points,
    saturation_faults,
)
from exfit.case.ties import TieError, Ties, is_tie
from exfit.case.yaml import Fault
from exfit.errors import ModelError
from exfit.models import GOVERNORS, find
from exfit.models.blocks import SHORTEST
from exfit.models.sheet import Parameter
from exfit.util.text import Place, near, show, show_value


def bound_faults(section: ContentNode) -> Iterator[Fault]:
    """Check ``start``, ``min`` and ``max`` of a section against each other."""
    start, low, high = (section.at(key).number for key in ("start", "min", "max"))
    if section.content.get("bounds") == "none":
        given = [key for key in ("min", "max") if key in section]
        yield from (section.at(key).fault("not allowed with bounds: none") for key in given)
    elif low is not None and high is not None and low >= high:
        yield section.at("min").fault(f"{show(low)} is not below max = {show(high)}")
    elif start is not None and _outside(start, low, high):
        limits = " ... ".join("?" if limit is None else show(limit) for limit in (low, high))
        yield section.at("start").fault(f"{show(start)} lies outside its bounds {limits}")


def _outside(start: float, low: float | None, high: float | None) -> bool:
    """Tell if a start lies outside its bounds, as far as these are readable."""
    return (low is not None and start < low) or (high is not None and start > high)


def parameter_faults(content: ContentNode, parts: Parts, ties: Ties) -> Iterator[Fault]:
    """Yield the faults of the parameters of all parts, those that follow others among them."""
    tied, faults = _tied_values(content, parts, ties)
    yield from faults
    used = used_by_ties(content.content, parts)
    helpers = [name for name in helpers_of(content.content, parts) if name in used]
    for part in parts.all:
        yield from part_faults(content, part, tied, helpers)
        if part.kind == "exciter" and has_saturation(part.sheet):
            yield from saturation_faults(content)


def _tied_values(
    content: ContentNode, parts: Parts, ties: Ties
) -> tuple[dict[str, float], list[Fault]]:
    """Return the start values of what follows other parameters, and what is wrong with them."""
    values: dict[str, float] = {}
    for part in parts.all:
        fixed, free = _sections_of(content, part)
        given = _readable(part, fixed.content, _starts(free))
        values |= {part.prefix + symbol: value for symbol, value in given.items()}
    for name, place in helpers_of(content.content, parts).items():
        start = content.at(*place).start
        if start is not None:
            values[name] = start
    tied: dict[str, float] = {}
    faults, places = [], places_of_ties(content.content, parts)
    for name in ties.order:
        tie = ties.by_name[name]
        if not values.keys() >= {*tie.names}:
            continue  # it uses a value that is not readable, which is a fault of its own
        try:
            values[name] = tied[name] = tie.value(values)
        except TieError as error:
            faults.append(Fault(places[name], str(error)))
    return tied, faults


def _sections_of(content: ContentNode, part: Part) -> tuple[ContentNode, ContentNode]:
    free = ContentNode((), None) if part.free is None else content.at(*part.free)
    return content.at(*part.fixed), free


def _starts(free: ContentNode) -> dict[str, Any]:
    return {symbol: section.at("start").value for symbol, section in free.sections}


def part_faults(
    content: ContentNode, part: Part, tied: Mapping[str, float], helpers: Collection[str]
) -> Iterator[Fault]:
    """Yield the faults of what the file gives for one part, and of its free parameters."""
    section, free = _sections_of(content, part)
    tied = _of_part(part, tied)
    fixed = {
        symbol: tied.get(symbol, value) if is_tie(value) else value
        for symbol, value in section.content.items()
    }
    rows = {row.symbol: row for row in part.sheet}
    allowed = [*rows, *_further(part, helpers)]
    values = ContentNode(part.fixed, fixed)
    yield from _unknown_symbols(values, allowed, part.name)
    yield from _outside_sheet(values, rows)
    yield from _unknown_symbols(free, allowed, part.name)
    for symbol, parameter in free.sections:
        if symbol in fixed:
            yield parameter.fault("both fixed and free")
        yield from _free_faults(parameter, rows.get(symbol))
    # what follows without standing in the file is checked where it comes from
    places = dict.fromkeys(tied, place_of_points(content))
    places |= {symbol: (*part.fixed, symbol) for symbol in fixed}
    places |= {symbol: parameter.at("start").place for symbol, parameter in free.sections}
    whole = part.fixed[:1] if part.kind == "exciter" else part.fixed
    yield from _placed(whole, places, part.check(_readable(part, tied, fixed, _starts(free))))


def _of_part(part: Part, values: Mapping[str, float]) -> dict[str, float]:
    """Return the values of a part by symbol."""
    symbols = {part.prefix + symbol: symbol for symbol in part.symbols}
    return {symbols[name]: value for name, value in values.items() if name in symbols}


def _further(part: Part, helpers: Collection[str]) -> tuple[str, ...]:
    """Return the names that may be given with the parameters of a part."""
    if part.kind != "exciter":
        return ()
    return (*helpers, *(CONSTANTS if has_saturation(part.sheet) else ()))


def _unknown_symbols(given: ContentNode, symbols: Collection[str], owner: str) -> Iterator[Fault]:
    for symbol, parameter in given.sections:
        if symbol not in symbols:
            yield parameter.fault(f"not a parameter of {owner}; {near(symbol, symbols)}")


def _outside_sheet(given: ContentNode, rows: Mapping[str, Parameter]) -> Iterator[Fault]:
    for symbol, value in given.numbers.items():
        row = rows.get(symbol)
        if row is not None and not row.is_physical(value):
            limits = f"{show(row.low)} ... {show(row.high)} {row.unit}"
            text = f"{show(value)} lies outside {limits}, its data sheet's range"
            yield given.at(symbol).fault(text)


def _free_faults(section: ContentNode, row: Parameter | None) -> Iterator[Fault]:
    """Yield the faults of one free parameter: its bounds, its start, its scale, its prior.

    Its bounds and its start may leave the range of the data sheet where the equations allow it.
    """
    yield from bound_faults(section)
    yield from _prior_faults(section.at("prior"))
    if row is not None:
        for key in ("start", "min", "max"):
            value = section.at(key).number
            if value is not None and (text := row.range_fault(value)) is not None:
                yield section.at(key).fault(text)
    if is_held(section.at("start").number, row):
        return
    yield from _scale_faults(section, row)
    if row is not None and row.is_time:
        yield from _bypass_faults(section)


def _scale_faults(section: ContentNode, row: Parameter | None) -> Iterator[Fault]:
    """Demand what the scale of a search needs: bounds above 0, or a size by which to search."""
    start, low, high = (section.at(key).number for key in ("start", "min", "max"))
    unbounded = section.content.get("bounds") == "none"
    lowest, highest = search_bounds(low, high, None if unbounded else row)
    scale = section.content.get("scale", "log")
    if scale == "start" and start == 0.0:
        yield section.at("start").fault("0 is no size by which to search: use another scale")
    elif scale != "log":
        if start == 0.0 and not isfinite(highest - lowest) and lowest in (0.0, -inf):
            yield section.at("start").fault("0 gives no size by which to search: give min and max")
    elif unbounded:
        text = "none leaves no min above 0, as scale: log needs: use scale: linear, start or raw"
        yield section.at("bounds").fault(text)
    elif low is not None and low <= 0.0:
        text = f"{show(low)} is not above 0, as scale: log needs; or scale: linear"
        yield section.at("min").fault(text)
    elif lowest <= 0.0 and "min" not in section:
        text = "is missing: scale: log needs a min above 0; without a lower bound: scale: linear"
        yield section.at("min").fault(text)


def _bypass_faults(time: ContentNode) -> Iterator[Fault]:
    """Yield a time constant whose bounds lie on both sides of the shortest one."""
    start, low, high = (time.at(key).number for key in ("start", "min", "max"))
    limit = f"{show(SHORTEST)} s, below which the block is bypassed"
    if low is not None and low < SHORTEST <= (inf if high is None else high):
        text = f"{show(low)} is below {limit}; a free time must not cross it"
        yield time.at("min").fault(text)
    elif "min" not in time and start is not None and start < SHORTEST:
        advice = "" if time.content.get("bounds") == "none" else "; give a min as well"
        yield time.at("start").fault(f"{show(start)} is below {limit}{advice}")


def _prior_faults(prior: ContentNode) -> Iterator[Fault]:
    """Refuse a share of a mean that makes no standard deviation."""
    std = prior.at("std")
    if std.text is None or not re.search(PERCENT, std.text):
        return
    if prior.at("mean").number == 0.0:
        yield std.fault("a share of mean = 0 is 0: give a number")
    if not 0.0 < float(std.text.rstrip("% ")) < inf:
        yield std.fault(f"{show_value(std.text)} is not above 0, or not finite")


def _placed(
    section: Place, given: Mapping[str, Place], contradictions: Iterable[tuple[str, str]]
) -> Iterator[Fault]:
    """Yield each contradiction where the file gives its parameter, else the other one it names."""
    for symbol, text in contradictions:
        if symbol in given:
            yield Fault(given[symbol], text)
        elif text.startswith("is missing"):
            yield Fault((*section, symbol), text)
        else:
            others = [given[word] for word in re.findall(r"\w+", text) if word in given]
            yield Fault(others[0] if others else section, f"{symbol} (typical): {text}")


def _readable(part: Part, *given: Mapping[str, Any]) -> dict[str, float]:
    """Return the resolved values without those that the file gives in no readable form."""
    numbers = [ContentNode((), {**values}).numbers for values in given]
    unreadable = {
        symbol
        for values, readable in zip(given, numbers, strict=True)
        for symbol in values
        if symbol not in readable
    }
    values = part.resolved(*numbers)
    return {symbol: value for symbol, value in values.items() if symbol not in unreadable}


def as_found_faults(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield a model that is not in the catalogue, and parameters that no part has."""
    section = content.at("as_found")
    rows = {part.prefix + row.symbol: row for part in parts.all for row in part.sheet}
    name = section.at("model")
    if name.text:
        try:
            sheet = find(name.text.removesuffix(".py"), Path()).sheet
        except ModelError as error:
            yield name.fault(str(error))
            return
        if not kind_of(content.at("plant").content).has_exciter:
            yield name.fault("not allowed with this plant: it has no exciter")
        rows = {**_of_others(rows), **{row.symbol: row for row in sheet}}
    for symbol, value in (*section.at("parameters").sections, *_unused(section, parts)):
        if symbol not in rows:
            yield value.fault(f"not a parameter of the model as found; {near(symbol, rows)}")
        elif value.number is not None and (text := rows[symbol].range_fault(value.number)):
            yield value.fault(text)


def _unused(section: ContentNode, parts: Parts) -> list[tuple[str, ContentNode]]:
    """List the unused values but for those that only a governor's record has, as GGOV1's Trate."""
    listed = {
        part.prefix + name
        for part in parts.all
        if part.name in GOVERNORS
        for record in GOVERNORS[part.name].records
        for name in record.ignored
    }
    return [(name, node) for name, node in section.at("unused").sections if name not in listed]


def _of_others(rows: dict[str, Parameter]) -> dict[str, Parameter]:
    """Return the rows of all parts but the exciter."""
    return {name: row for name, row in rows.items() if "." in name}
