"""What contradicts itself in the parameters of a model: values, bounds, what was found before."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from math import inf, isfinite
from typing import Any

from exfit.case.checks.node import ContentNode
from exfit.case.parts import (
    FORMS,
    MEANINGS,
    POINTS,
    Part,
    Parts,
    has_saturation,
    helpers_of,
    is_held,
    saturation_places,
    search_bounds,
    tied_texts,
)
from exfit.case.schema.values import PERCENT
from exfit.case.ties import TieError, Ties, is_tie, parse
from exfit.case.yaml import Fault
from exfit.models.blocks import SHORTEST
from exfit.models.sheet import Parameter
from exfit.util.text import Place, near, show, show_value


def bound_faults(section: ContentNode) -> Iterator[Fault]:
    """Check ``start``, ``min`` and ``max`` of a section against each other, as far as readable."""
    start, low, high = (section.at(key).number for key in ("start", "min", "max"))
    lowest, highest = -inf if low is None else low, inf if high is None else high
    if section.content.get("bounds") == "none":
        given = [key for key in ("min", "max") if key in section]
        yield from (section.at(key).fault("not allowed with bounds: none") for key in given)
    elif lowest >= highest:
        yield section.at("min").fault(f"{show(lowest)} is not below max = {show(highest)}")
    elif start is not None and not lowest <= start <= highest:
        limits = " ... ".join("?" if limit is None else show(limit) for limit in (low, high))
        yield section.at("start").fault(f"{show(start)} lies outside its bounds {limits}")


def parameter_faults(content: ContentNode, parts: Parts, ties: Ties) -> Iterator[Fault]:
    """Yield the faults of the parameters of all parts, those that follow others among them."""
    values: dict[str, float] = {}
    for part in parts.all:
        fixed, free = _sections_of(content, part)
        given = _readable(part, fixed.content, _starts(free))
        values |= {part.prefix + symbol: value for symbol, value in given.items()}
    helpers = helpers_of(content.content, parts)
    for name, place in helpers.items():
        start = content.at(*place).start
        if start is not None:
            values[name] = start
    tied, used = dict[str, float](), set[str]()
    texts = tied_texts(content.content, parts)
    for name in ties.order:
        tie = ties.by_name[name]
        if not values.keys() >= {*tie.names}:
            continue  # it uses a value that is not readable, which is a fault of its own
        try:
            values[name] = tied[name] = tie.value(values)
        except TieError as error:
            yield Fault(texts[name][0], str(error))
    for _, text in texts.values():
        with suppress(TieError):
            used |= {*parse(text).names}
    for part in parts.all:
        yield from part_faults(content, part, tied, [name for name in helpers if name in used])
        if part.kind == "exciter" and has_saturation(part.sheet):
            yield from _saturation_faults(content)


def _sections_of(content: ContentNode, part: Part) -> tuple[ContentNode, ContentNode]:
    free = ContentNode((), None) if part.free is None else content.at(*part.free)
    return content.at(*part.fixed), free


def _starts(free: ContentNode) -> dict[str, Any]:
    return {symbol: section.at("start").value for symbol, section in free.sections}


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


def part_faults(
    content: ContentNode, part: Part, tied: Mapping[str, float], helpers: Collection[str]
) -> Iterator[Fault]:
    """Yield the faults of what the file gives for one part, and of its free parameters."""
    section, free = _sections_of(content, part)
    rows = {row.symbol: row for row in part.sheet}
    tied = _of_part(part, tied)
    fixed = {
        symbol: tied.get(symbol, value) if is_tie(value) else value
        for symbol, value in section.content.items()
    }
    allowed = [*rows]
    if part.kind == "exciter":
        allowed += [*helpers, *(MEANINGS if has_saturation(part.sheet) else ())]
    values = ContentNode(part.fixed, fixed)
    for symbol, parameter in (*values.sections, *free.sections):
        if symbol not in allowed:
            yield parameter.fault(f"not a parameter of {part.name}; {near(symbol, allowed)}")
    for row in part.sheet:
        value = values.at(row.symbol).number
        if value is not None and not row.is_physical(value):
            limits = f"{show(row.low)} ... {show(row.high)} {row.unit}"
            text = f"{show(value)} lies outside {limits}, its data sheet's range"
            yield values.at(row.symbol).fault(text)
    for symbol, parameter in free.sections:
        if symbol in fixed:
            yield parameter.fault("both fixed and free")
        yield from _free_faults(parameter, rows.get(symbol))
    # what follows without standing in the file is checked where it comes from
    curve = [*saturation_places(content.content), ("parameters",)][0]
    places: dict[str, Place] = dict.fromkeys(tied, curve)
    places |= {symbol: node.place for symbol, node in values.sections}
    places |= {symbol: node.at("start").place for symbol, node in free.sections}
    yield from _placed(part, places, part.check(_readable(part, tied, fixed, _starts(free))))


def _of_part(part: Part, values: Mapping[str, float]) -> dict[str, float]:
    """Return the values of a part by symbol."""
    symbols = {part.prefix + symbol: symbol for symbol in part.symbols}
    return {symbols[name]: value for name, value in values.items() if name in symbols}


def _placed(
    part: Part, places: Mapping[str, Place], texts: Iterable[tuple[str, str]]
) -> Iterator[Fault]:
    """Yield each contradiction where the file gives its parameter, else the other one it names."""
    whole = part.section if part.kind == "exciter" else part.fixed
    for symbol, text in texts:
        if symbol in places:
            yield Fault(places[symbol], text)
        elif text.startswith("is missing"):
            yield Fault((*whole, symbol), text)
        else:
            others = [places[word] for word in re.findall(r"\w+", text) if word in places]
            yield Fault(others[0] if others else whole, f"{symbol} (typical): {text}")


def _free_faults(section: ContentNode, row: Parameter | None) -> Iterator[Fault]:
    """Yield the faults of one free parameter: its bounds, its start, its scale, its prior.

    Its bounds and its start may leave the range of the data sheet where the equations allow it.
    """
    yield from bound_faults(section)
    yield from percentage_faults(section.at("prior", "std"), section.at("prior", "mean"))
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


def percentage_faults(std: ContentNode, of: ContentNode) -> Iterator[Fault]:
    """Yield the faults of a standard deviation that is a percentage of a value."""
    if std.text is not None and re.search(PERCENT, std.text):
        if of.number == 0.0:
            yield std.fault(f"a share of {of.place[-1]} = 0 is 0: give a number")
        if not 0.0 < float(std.text.rstrip("% ")) < inf:
            yield std.fault(f"{show_value(std.text)} is not above 0, or not finite")


def _bypass_faults(section: ContentNode) -> Iterator[Fault]:
    """Yield a time constant whose bounds lie on both sides of the shortest one."""
    start, low, high = (section.at(key).number for key in ("start", "min", "max"))
    limit = f"{show(SHORTEST)} s, below which the block is bypassed"
    if low is not None and low < SHORTEST <= (inf if high is None else high):
        text = f"{show(low)} is below {limit}; a free time must not cross it"
        yield section.at("min").fault(text)
    elif "min" not in section and start is not None and start < SHORTEST:
        advice = "" if section.content.get("bounds") == "none" else "; give a min as well"
        yield section.at("start").fault(f"{show(start)} is below {limit}{advice}")


def _scale_faults(section: ContentNode, row: Parameter | None) -> Iterator[Fault]:
    """Demand what the scale of a search needs: bounds above 0, or a size by which to search."""
    start, low, high = (section.at(key).number for key in ("start", "min", "max"))
    unbounded = section.content.get("bounds") == "none"
    lowest, highest = search_bounds(low, high, None if unbounded else row)
    scale = section.content.get("scale", "log")
    if scale == "start" and start == 0.0:
        yield section.at("start").fault("0 sets no scale for the search: use another scale")
    elif scale != "log":
        if start == 0.0 and not isfinite(highest - lowest) and lowest in (0.0, -inf):
            yield section.at("start").fault("0 sets no scale for the search: give min and max")
    elif unbounded:
        text = "none leaves no min above 0, as scale: log needs: use scale: linear, start or raw"
        yield section.at("bounds").fault(text)
    elif low is not None and low <= 0.0:
        text = f"{show(low)} is not above 0, as scale: log needs; or scale: linear"
        yield section.at("min").fault(text)
    elif lowest <= 0.0 and "min" not in section:
        text = "is missing: scale: log needs a min above 0; without a lower bound: scale: linear"
        yield section.at("min").fault(text)


def _saturation_faults(content: ContentNode) -> Iterator[Fault]:
    """Check the values beside a given AEX or BEX."""
    parameters, form = content.at("parameters"), content.at("saturation").text or "quadratic"
    given = {place[-1]: content.at(*place) for place in saturation_places(content.content)}
    if not given:
        return
    first = next(iter(given.values()))
    if form not in FORMS:
        forms = " or ".join(FORMS)
        yield first.fault(f"of an exponential curve; this case has saturation: {form}, not {forms}")
    for name in MEANINGS:
        if name not in given:
            yield Fault((*first.place[:-1], name), f"is missing: {first.place[-1]} is given")
    for node in (parameters.at(key, symbol) for key in ("fixed", "free") for symbol in POINTS):
        if node.value is not None:
            yield node.fault("not allowed with AEX and BEX, from which it follows")
    factor = given["AEX"].start if "AEX" in given else None
    if factor is not None and factor < 0.0:
        yield given["AEX"].fault(f"{factor:g} is below 0")
