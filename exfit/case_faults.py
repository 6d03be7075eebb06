"""What contradicts itself in a case file though every single value has the right form.

The checks run on the plain data of the file, so that one unreadable value does not hide the faults
of the others: a value that has the wrong form is left to the schema and skipped here.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from math import inf, isfinite
from typing import Any

from exfit.case_form import near, show
from exfit.models.blocks import SHORTEST
from exfit.models.machines import Machine
from exfit.models.sheet import (
    Model,
    Parameter,
    Sheet,
    crossed_limits,
    exponential_faults,
    saturation_faults,
    typical,
)
from exfit.yaml_lines import Fault, Place

Data = Mapping[str, Any]
Contradictions = Iterable[tuple[str, str]]

FIXED: Place = ("parameters", "fixed")
FREE: Place = ("parameters", "free")
MACHINE: Place = ("plant", "parameters")
TAKEN = ("fit", "response", "history", "overlay", "convergence", "trajectories")


def contradictions(data: Data, exciter: Model | None, machine: Machine | None) -> Iterator[Fault]:
    """Yield the faults of a case file's data beyond its form."""
    if exciter is not None:
        yield from _exciter_faults(data, exciter)
    if machine is not None:
        yield from _machine_faults(data, machine)
    yield from _trial_faults((), data, data)
    for at, trial in enumerate(_list(data, "validate")):
        yield from _trial_faults(("validate", at), trial, data)
    yield from _repeated_names(_list(data, "validate"))
    if "accept" in data and not _list(data, "validate"):
        yield Fault(("accept",), "there is no validation that it could judge")


def resolved(rows: Sheet, *given: Mapping[str, float]) -> dict[str, float]:
    """Return a value for each parameter of a sheet: typical unless given, the last one wins."""
    values = typical(rows)
    for some in given:
        values |= {symbol: value for symbol, value in some.items() if symbol in values}
    return values


def _exciter_faults(data: Data, exciter: Model) -> Iterator[Fault]:
    fixed, free = _section(data, *FIXED), _section(data, *FREE)
    rows = {row.symbol: row for row in exciter.sheet}
    yield from _unknown_symbols(FIXED, fixed, rows, exciter.name)
    yield from _unknown_symbols(FREE, free, rows, exciter.name)
    yield from (Fault((*FREE, symbol), "both fixed and free") for symbol in free if symbol in fixed)
    yield from _outside_sheet(FIXED, fixed, rows)
    for symbol in free:
        yield from _bound_faults((*FREE, symbol), _section(free, symbol), rows.get(symbol))

    starts = {symbol: _section(free, symbol).get("start") for symbol in free}
    given = {symbol: (*FIXED, symbol) for symbol in fixed}
    given |= {symbol: (*FREE, symbol, "start") for symbol in free}
    values = _readable(exciter.sheet, fixed, starts)
    yield from _placed(FIXED[:1], given, crossed_limits(values))
    yield from _placed(FIXED[:1], given, saturation_faults(values))
    if str(data.get("saturation")).startswith("exponential"):
        yield from _placed(("saturation",), given, exponential_faults(values))


def _machine_faults(data: Data, machine: Machine) -> Iterator[Fault]:
    parameters = _section(data, *MACHINE)
    rows = {row.symbol: row for row in machine.sheet}
    single = [
        *_unknown_symbols(MACHINE, parameters, rows, machine.name),
        *_outside_sheet(MACHINE, parameters, rows),
    ]
    yield from single
    values = _readable(machine.sheet, parameters)
    if not single and len(values) == len(rows):
        given = {symbol: (*MACHINE, symbol) for symbol in parameters}
        yield from _placed(MACHINE, given, machine.faults(values))


def _unknown_symbols(
    place: Place, given: Data, rows: Mapping[str, Parameter], owner: str
) -> Iterator[Fault]:
    for symbol in given:
        if symbol not in rows:
            yield Fault((*place, symbol), f"not a parameter of {owner}; {near(symbol, rows)}")


def _outside_sheet(place: Place, given: Data, rows: Mapping[str, Parameter]) -> Iterator[Fault]:
    for symbol, value in _numbers(given).items():
        row = rows.get(symbol)
        if row is not None and not row.low <= value <= row.high:
            limits = f"{show(row.low)} ... {show(row.high)} {row.unit}"
            yield Fault(
                (*place, symbol), f"{show(value)} lies outside {limits}, its data sheet's range"
            )


def _bound_faults(place: Place, entry: Data, row: Parameter | None) -> Iterator[Fault]:
    """Yield the faults of one free parameter: its bounds, its start, its scale."""
    numbers = _numbers(entry)
    start, low, high = (numbers.get(key) for key in ("start", "min", "max"))
    if low is not None and high is not None and low >= high:
        yield Fault((*place, "min"), f"{show(low)} is not below max = {show(high)}")
    elif _outside(start, low, high):
        limits = " ... ".join("?" if limit is None else show(limit) for limit in (low, high))
        yield Fault((*place, "start"), f"{show(start or 0.0)} lies outside its bounds {limits}")
    if low is not None and low <= 0 and entry.get("scale", "log") == "log":
        yield Fault(
            (*place, "min"), f"{show(low)} is not above 0, as scale: log needs; or scale: linear"
        )
    if row is None:
        return
    yield from _outside_sheet(place, numbers, dict.fromkeys(("start", "min", "max"), row))
    if row.unit == "s" and low is not None and low < SHORTEST <= (inf if high is None else high):
        limit = f"{show(SHORTEST)} s, below which the block is bypassed"
        yield Fault((*place, "min"), f"{show(low)} is below {limit}; a free time must not cross it")


def _outside(start: float | None, low: float | None, high: float | None) -> bool:
    if start is None:
        return False
    return (low is not None and start < low) or (high is not None and start > high)


def _placed(section: Place, given: Mapping[str, Place], found: Contradictions) -> Iterator[Fault]:
    """Yield each contradiction where the file gives its parameter, else the other one it names."""
    for symbol, text in found:
        if symbol in given:
            yield Fault(given[symbol], text)
        else:
            others = [given[word] for word in re.findall(r"\w+", text) if word in given]
            yield Fault(others[0] if others else section, f"{symbol} (typical): {text}")


def _trial_faults(place: Place, trial: Any, data: Data) -> Iterator[Fault]:
    """Yield what does not fit together in a test and its record."""
    test, record = _section(trial, "test"), _section(trial, "record")
    yield from _step_faults((*place, "test"), test)
    has_record = isinstance(trial, dict) and "record" in trial
    if has_record:
        yield from _record_faults(place, test, record)
    elif not place:
        yield from _missing_without_record((*place, "test"), test)
    vt0 = _numbers(test).get("vt0")
    kind = _section(data, "plant").get("type")
    if kind == "open-circuit" and vt0 is not None and vt0 <= 0:
        yield Fault((*place, "test", "vt0"), f"{show(vt0)} is not above 0")
    if kind == "none":
        for signal in _section(record, "channels"):
            if signal in ("efd", "ifd"):
                here = (*place, "record", "channels", signal)
                yield Fault(here, "without a plant there is only vt")


def _step_faults(place: Place, test: Data) -> Iterator[Fault]:
    before: float | None = None
    end = _numbers(test).get("duration")
    for index, step in enumerate(_list(test, "vref")):
        here, numbers = (*place, "vref", index), _numbers(step)
        if numbers.get("step") == 0:
            yield Fault((*here, "step"), "0 is no step")
        at = numbers.get("at")
        if at is not None and before is not None and at <= before:
            yield Fault(
                (*here, "at"), f"{show(at)} s is not after {show(before)} s, the step before"
            )
        if at is not None and end is not None and not 0 <= at < end:
            yield Fault(
                (*here, "at"), f"{show(at)} s lies outside 0 ... {show(end)} s, the duration"
            )
        before = at


def _record_faults(place: Place, test: Data, record: Data) -> Iterator[Fault]:
    if "duration" in test:
        yield Fault(
            (*place, "test", "duration"), "only without a record; record.window cuts a record"
        )
    begin = _numbers(test).get("begin")
    if begin is not None and "vt0" not in test:
        yield Fault((*place, "test", "vt0"), "is missing: with begin it says where to start")
    channels = _section(record, "channels")
    if channels and "begin" not in test and "vt" not in channels and "vt0" not in test:
        yield Fault((*place, "test", "vt0"), "is missing, and the record has no vt to take it from")
    window = record.get("window")
    if not (isinstance(window, list) and len(window) == 2 and all(map(_is_number, window))):
        return
    start, end = window
    if start >= end:
        yield Fault(
            (*place, "record", "window"), f"start {show(start)} is not below end {show(end)}"
        )
        return
    if begin is not None and begin > start:
        here = (*place, "test", "begin")
        yield Fault(
            here, f"{show(begin)} s is after {show(start)} s, where the record's window starts"
        )
    start = start if begin is None else begin
    for index, step in enumerate(_list(test, "vref")):
        at = _numbers(step).get("at")
        if at is not None and not start <= at < end:
            limits = f"{show(start)} ... {show(end)} s"
            here = (*place, "test", "vref", index, "at")
            yield Fault(here, f"{show(at)} s lies outside the window {limits} of the record")


def _missing_without_record(place: Place, test: Data) -> Iterator[Fault]:
    if "begin" in test:
        yield Fault((*place, "begin"), "only with a record; without one the time begins at 0")
    if test and "duration" not in test:
        yield Fault(
            (*place, "duration"), "is missing: without a record it says how long to simulate"
        )
    if test and "vt0" not in test:
        yield Fault((*place, "vt0"), "is missing: without a record it says where to start")


def _repeated_names(trials: list[Any]) -> Iterator[Fault]:
    seen = dict.fromkeys(TAKEN, "a file of every run")
    for at, trial in enumerate(trials):
        name = trial.get("name") if isinstance(trial, dict) else None
        if not isinstance(name, str):
            continue
        if name.casefold() in seen:
            text = f"{name!r} is taken by {seen[name.casefold()]}: files are named after it"
            yield Fault(("validate", at, "name"), text)
        seen.setdefault(name.casefold(), repr(name))


def _readable(rows: Sheet, *given: Data) -> dict[str, float]:
    """Return the resolved values without those that the file gives in no readable form."""
    unreadable = {
        symbol for some in given for symbol, value in some.items() if not _is_number(value)
    }
    values = resolved(rows, *map(_numbers, given))
    return {symbol: value for symbol, value in values.items() if symbol not in unreadable}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _numbers(entries: Any) -> dict[str, float]:
    """Return those entries of a mapping that are numbers, none where it is no mapping."""
    if not isinstance(entries, dict):
        return {}
    return {key: float(value) for key, value in entries.items() if _is_number(value)}


def _section(data: Any, *place: str | int) -> dict[str, Any]:
    """Return the mapping at a place, an empty one where there is none."""
    for key in place:
        data = data.get(key) if isinstance(data, dict) else None
    return data if isinstance(data, dict) else {}


def _list(data: Any, key: str) -> list[Any]:
    """Return the list under a key, an empty one where there is none."""
    found = data.get(key) if isinstance(data, dict) else None
    return found if isinstance(found, list) else []
