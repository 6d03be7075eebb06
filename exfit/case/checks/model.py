"""What contradicts itself in a case file though every single value has the right form.

The checks run on the plain data of the file, so that one unreadable value does not hide the faults
of the others: a value that has the wrong form is left to the schema and skipped here.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from math import inf

from exfit.case.checks.data import Data, is_number, list_of, numbers_in, section_of
from exfit.case.checks.record import noise_faults, outside, repeated_names, trial_faults
from exfit.case.messages import PERCENT
from exfit.case.parts import (
    Part,
    Parts,
    helpers_of,
    kind_of,
    network_part,
    places_of_ties,
    plants_of_records,
    used_by_ties,
)
from exfit.case.ties import TieError, Ties, is_tie
from exfit.case.yaml import Fault, Place
from exfit.models.blocks import SHORTEST
from exfit.models.sheet import Parameter
from exfit.plants import PlantKind
from exfit.util.text import near, show, show_value

Contradictions = Iterable[tuple[str, str]]


def contradictions(data: Data, parts: Parts, ties: Ties) -> Iterator[Fault]:
    """Yield the faults of a case file's data beyond its form."""
    kind = kind_of(section_of(data, "plant"))
    yield from _model_faults(data, kind)
    tied, faults = _tied_values(data, parts, ties)
    yield from faults
    helpers = _helper_places(data, parts)
    for part in parts.all:
        yield from _part_faults(data, part, tied, helpers)
    yield from _stabiliser_faults(data, parts, kind)
    yield from _records_faults(data, kind)
    recorded = [
        ((key, at), one)
        for key in ("records", "validate")
        for at, one in enumerate(list_of(data, key))
    ]
    for place, plant in plants_of_records(data).items():
        yield from _plant_of_record_faults(data, place, plant, kind)
    if "records" not in data:
        yield from trial_faults((), data, data, kind)
    for place, trial in recorded:
        plant = section_of(trial, "plant")
        yield from trial_faults(place, trial, data, kind_of(plant) if "type" in plant else kind)
    yield from noise_faults(data, [((), data), *recorded], kind)
    yield from repeated_names(recorded)
    if "accept" in data and not list_of(data, "validate"):
        yield Fault(("accept",), "there is no validation that it could judge")
    estimate = section_of(data, "estimate")
    if "refine" in estimate and numbers_in(estimate).get("starts", 1.0) <= 1.0:
        yield Fault(("estimate", "refine"), "only with more than one of estimate.starts")
    if "loss_scale" in estimate and estimate.get("loss", "least-squares") == "least-squares":
        yield Fault(("estimate", "loss_scale"), "only with estimate.loss: huber or soft-l1")


def _records_faults(data: Data, kind: PlantKind) -> Iterator[Fault]:
    """Yield what does not fit together where there are several records, or one, or none."""
    if "records" not in data:
        if "test" not in data:
            yield Fault(("test",), "is missing")
        return
    for key in ("test", "record"):
        if key in data:
            yield Fault((key,), "does not go with records: each of them has its own")


def _plant_of_record_faults(
    data: Data, place: Place, plant: Data, kind: PlantKind
) -> Iterator[Fault]:
    """Yield the faults of the plant that a record has in place of the case's."""
    if not kind.closed_loop:
        yield Fault(place, f"not allowed with plant {kind.name}")
    elif kind_of(plant).on_load and isinstance(plant.get("network"), dict):
        yield from _part_faults(data, network_part(plant["network"], (*place, "network")), {}, {})


def _tied_values(data: Data, parts: Parts, ties: Ties) -> tuple[dict[str, float], list[Fault]]:
    """Return the start values of what follows other parameters, and what is wrong with them."""
    known: dict[str, float] = {}
    for part in parts.all:
        fixed, free = _given_of(data, part)
        starts = {symbol: section_of(free, symbol).get("start") for symbol in free}
        values = _readable(part, fixed, starts)
        known |= {part.prefix + symbol: value for symbol, value in values.items()}
    for name, place in helpers_of(data, parts).items():
        value = section_of(data, *place[:-1]).get(name)
        start = numbers_in({name: value.get("start") if isinstance(value, dict) else value})
        known |= start
    found: dict[str, float] = {}
    faults, places = [], places_of_ties(data, parts)
    for name in ties.order:
        tie = ties.by_name[name]
        if not known.keys() >= {*tie.names}:
            continue  # it uses a value that has no readable form, which is told
        try:
            known[name] = found[name] = tie.value(known)
        except TieError as error:
            faults.append(Fault(places[name], str(error)))
    return found, faults


def _helper_places(data: Data, parts: Parts) -> dict[str, Place]:
    """Return the helpers that some tie uses: they may stand among the exciter's parameters."""
    used = used_by_ties(data, parts)
    return {name: place for name, place in helpers_of(data, parts).items() if name in used}


def _model_faults(data: Data, kind: PlantKind) -> Iterator[Fault]:
    if kind.has_exciter:
        if "model" not in data:
            yield Fault(("model",), "is missing")
        return
    for key in ("model", "saturation", "parameters", "stabiliser"):
        if key in data:
            yield Fault((key,), f"not allowed with plant {kind.name}: the machine stands alone")


def _given_of(data: Data, part: Part) -> tuple[Data, Data]:
    """Return what the file gives for one part: fixed and free."""
    return section_of(data, *part.fixed), {} if part.free is None else section_of(data, *part.free)


def _part_faults(
    data: Data, part: Part, tied: Mapping[str, float], helpers: Mapping[str, Place]
) -> Iterator[Fault]:
    """Yield the faults of what the file gives for one part, and of its free parameters."""
    fixed, free = _given_of(data, part)
    tied = {name.removeprefix(part.prefix): value for name, value in tied.items()}
    fixed = {
        symbol: tied.get(symbol, value) if is_tie(value) else value
        for symbol, value in fixed.items()
    }
    places = {symbol: (*part.fixed, symbol) for symbol in fixed}
    rows = {row.symbol: row for row in part.sheet}
    allowed = [*rows, *helpers] if part.kind == "exciter" else [*rows]
    yield from _unknown_symbols(part.fixed, fixed, allowed, part.name)
    yield from _outside_sheet(part.fixed, fixed, rows)
    if part.free is not None:
        yield from _unknown_symbols(part.free, free, allowed, part.name)
        for symbol in free:
            if symbol in fixed:
                yield Fault((*part.free, symbol), "both fixed and free")
            yield from _bound_faults(
                (*part.free, symbol), section_of(free, symbol), rows.get(symbol)
            )
            places[symbol] = (*part.free, symbol, "start")
    starts = {symbol: section_of(free, symbol).get("start") for symbol in free}
    values = _readable(part, fixed, starts)
    section = part.fixed[:1] if part.kind == "exciter" else part.fixed
    yield from _placed(section, places, part.check(values))


def _stabiliser_faults(data: Data, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    section = section_of(data, "stabiliser")
    if not section:
        return
    if kind.has_exciter and not kind.has_machine:
        yield Fault(("stabiliser",), f"not allowed with plant {kind.name}: nothing feeds it")
    kinds = (kind, *map(kind_of, plants_of_records(data).values()))
    on_load = any(kind.on_load for kind in kinds)
    if kind.closed_loop and not on_load and section_of(section, "free"):
        yield Fault(("stabiliser", "free"), "on open circuit a stabiliser does not act")
    inputs = section.get("inputs")
    if parts.stabiliser is not None and isinstance(inputs, list):
        wanted = len(parts.stabiliser.inputs)
        if len(inputs) != wanted:
            text = f"{len(inputs)} given; {parts.stabiliser.name} listens to {wanted}"
            yield Fault(("stabiliser", "inputs"), text)


def _unknown_symbols(
    place: Place, given: Data, known: Collection[str], owner: str
) -> Iterator[Fault]:
    for symbol in given:
        if symbol not in known:
            yield Fault((*place, symbol), f"not a parameter of {owner}; {near(symbol, known)}")


def _outside_sheet(place: Place, given: Data, rows: Mapping[str, Parameter]) -> Iterator[Fault]:
    for symbol, value in numbers_in(given).items():
        row = rows.get(symbol)
        if row is not None and not row.low <= value <= row.high:
            limits = f"{show(row.low)} ... {show(row.high)} {row.unit}"
            yield Fault(
                (*place, symbol), f"{show(value)} lies outside {limits}, its data sheet's range"
            )


def _bound_faults(place: Place, entry: Data, row: Parameter | None) -> Iterator[Fault]:
    """Yield the faults of one free parameter: its bounds, its start, its scale."""
    numbers = numbers_in(entry)
    start, low, high = (numbers.get(key) for key in ("start", "min", "max"))
    if low is not None and high is not None and low >= high:
        yield Fault((*place, "min"), f"{show(low)} is not below max = {show(high)}")
    elif outside(start, low, high):
        limits = " ... ".join("?" if limit is None else show(limit) for limit in (low, high))
        yield Fault((*place, "start"), f"{show(start or 0.0)} lies outside its bounds {limits}")
    if low is not None and low <= 0 and entry.get("scale", "log") == "log":
        yield Fault(
            (*place, "min"), f"{show(low)} is not above 0, as scale: log needs; or scale: linear"
        )
    yield from _prior_faults((*place, "prior"), section_of(entry, "prior"))
    if row is None:
        return
    yield from _outside_sheet(place, numbers, dict.fromkeys(("start", "min", "max"), row))
    if row.unit == "s" and low is not None and low < SHORTEST <= (inf if high is None else high):
        limit = f"{show(SHORTEST)} s, below which the block is bypassed"
        yield Fault((*place, "min"), f"{show(low)} is below {limit}; a free time must not cross it")


def _prior_faults(place: Place, prior: Data) -> Iterator[Fault]:
    """Yield why a share of the mean is no standard deviation."""
    std, mean = prior.get("std"), numbers_in(prior).get("mean")
    if not isinstance(std, str) or not re.search(PERCENT, std):
        return
    if mean == 0.0:
        yield Fault((*place, "std"), "a share of mean = 0 is nothing: give a number")
    if not 0.0 < float(std.rstrip("% ")) < inf:
        yield Fault((*place, "std"), f"{show_value(std)} is not above 0, or not finite")


def _placed(section: Place, given: Mapping[str, Place], found: Contradictions) -> Iterator[Fault]:
    """Yield each contradiction where the file gives its parameter, else the other one it names."""
    for symbol, text in found:
        if symbol in given:
            yield Fault(given[symbol], text)
        elif text.startswith("is missing"):
            yield Fault((*section, symbol), text)
        else:
            others = [given[word] for word in re.findall(r"\w+", text) if word in given]
            yield Fault(others[0] if others else section, f"{symbol} (typical): {text}")


def _readable(part: Part, *given: Data) -> dict[str, float]:
    """Return the resolved values without those that the file gives in no readable form."""
    unreadable = {
        symbol for some in given for symbol, value in some.items() if not is_number(value)
    }
    values = part.resolved(*map(numbers_in, given))
    return {symbol: value for symbol, value in values.items() if symbol not in unreadable}
