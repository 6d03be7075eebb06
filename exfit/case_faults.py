"""What contradicts itself in a case file though every single value has the right form.

The checks run on the plain data of the file, so that one unreadable value does not hide the faults
of the others: a value that has the wrong form is left to the schema and skipped here.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from math import inf, isfinite
from typing import Any, TypeGuard

from exfit.case_form import PERCENT, near, show, show_value
from exfit.case_parts import (
    TIE,
    WITHOUT_EXCITER,
    Part,
    Parts,
    helpers_of,
    network_part,
    places_of_ties,
    plants_of_records,
    used_by_ties,
)
from exfit.models.blocks import SHORTEST
from exfit.models.sheet import Parameter
from exfit.plant import DRIVING
from exfit.ties import TieError, Ties
from exfit.yaml_lines import Fault, Place

Data = Mapping[str, Any]
Contradictions = Iterable[tuple[str, str]]

TAKEN = (
    "fit",
    "response",
    "history",
    "overlay",
    "convergence",
    "trajectories",
    "sensitivity",
    "correlation",
    "profile",
    "starts",
)
PREFIXES = ("machine", "network", "stabiliser")
EVENTS: Mapping[str, tuple[str, ...]] = {
    "open-circuit": ("vref", "vs"),
    "infinite-bus": ("vref", "vs", "E", "network"),
    "playback": ("vref",),
    "machine-playback": (),
    "none": ("vref",),
}
SIGNALS: Mapping[str, tuple[str, ...]] = {
    "open-circuit": ("vt", "efd", "ifd"),
    "infinite-bus": ("vt", "efd", "ifd", "p", "q"),
    "playback": ("vref", *DRIVING, "efd"),
    "machine-playback": ("efd", "vt", "ifd"),
    "none": ("vt",),
}
DRIVERS: Mapping[str, tuple[str, ...]] = {
    "playback": ("vref", *DRIVING),
    "machine-playback": ("efd",),
}
NEEDED: Mapping[str, tuple[str, ...]] = {
    "playback": ("vt", "efd"),
    "machine-playback": ("efd",),
}


def contradictions(data: Data, parts: Parts, ties: Ties) -> Iterator[Fault]:
    """Yield the faults of a case file's data beyond its form."""
    kind = str(_section(data, "plant").get("type"))
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
        for at, one in enumerate(_list(data, key))
    ]
    for place, plant in plants_of_records(data).items():
        yield from _plant_of_record_faults(data, place, plant, kind)
    if "records" not in data:
        yield from _trial_faults((), data, data, kind)
    for place, trial in recorded:
        own = _section(trial, "plant").get("type", kind)
        yield from _trial_faults(place, trial, data, str(own))
    yield from _noise_faults(data, [((), data), *recorded], kind)
    yield from _repeated_names(recorded)
    if "accept" in data and not _list(data, "validate"):
        yield Fault(("accept",), "there is no validation that it could judge")
    estimate = _section(data, "estimate")
    if "refine" in estimate and _numbers(estimate).get("starts", 1.0) <= 1.0:
        yield Fault(("estimate", "refine"), "only with more than one of estimate.starts")
    if "loss_scale" in estimate and estimate.get("loss", "least-squares") == "least-squares":
        yield Fault(("estimate", "loss_scale"), "only with estimate.loss: huber or soft-l1")


def _records_faults(data: Data, kind: str) -> Iterator[Fault]:
    """Yield what does not fit together where there are several records, or one, or none."""
    if "records" not in data:
        if "test" not in data:
            yield Fault(("test",), "is missing")
        return
    for key in ("test", "record"):
        if key in data:
            yield Fault((key,), "does not go with records: each of them has its own")


def _plant_of_record_faults(data: Data, place: Place, plant: Data, kind: str) -> Iterator[Fault]:
    """Yield the faults of the plant that a record has in place of the case's."""
    if kind not in ("open-circuit", "infinite-bus"):
        yield Fault(place, f"does not go with plant {kind}")
    elif plant.get("type") == "infinite-bus" and isinstance(plant.get("network"), dict):
        yield from _part_faults(data, network_part(plant["network"], (*place, "network")), {}, {})


def _tied_values(data: Data, parts: Parts, ties: Ties) -> tuple[dict[str, float], list[Fault]]:
    """Return the start values of what follows other parameters, and what is wrong with them."""
    known: dict[str, float] = {}
    for part in parts.all:
        fixed, free = _given_of(data, part)
        starts = {symbol: _section(free, symbol).get("start") for symbol in free}
        values = _readable(part, fixed, starts)
        known |= {part.prefix + symbol: value for symbol, value in values.items()}
    for name, place in helpers_of(data, parts).items():
        value = _section(data, *place[:-1]).get(name)
        start = _numbers({name: value.get("start") if isinstance(value, dict) else value})
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


def _model_faults(data: Data, kind: str) -> Iterator[Fault]:
    if kind not in WITHOUT_EXCITER:
        if "model" not in data:
            yield Fault(("model",), "is missing")
        return
    for key in ("model", "saturation", "parameters", "stabiliser"):
        if key in data:
            yield Fault((key,), f"does not go with plant {kind}: the machine stands alone")


def _given_of(data: Data, part: Part) -> tuple[Data, Data]:
    """Return what the file gives for one part: fixed and free."""
    return _section(data, *part.fixed), {} if part.free is None else _section(data, *part.free)


def _part_faults(
    data: Data, part: Part, tied: Mapping[str, float], helpers: Mapping[str, Place]
) -> Iterator[Fault]:
    """Yield the faults of what the file gives for one part, and of its free parameters."""
    fixed, free = _given_of(data, part)
    tied = {name.removeprefix(part.prefix): value for name, value in tied.items()}
    fixed = {
        symbol: tied.get(symbol, value) if _is_tie(value) else value
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
            yield from _bound_faults((*part.free, symbol), _section(free, symbol), rows.get(symbol))
            places[symbol] = (*part.free, symbol, "start")
    starts = {symbol: _section(free, symbol).get("start") for symbol in free}
    values = _readable(part, fixed, starts)
    section = part.fixed[:1] if part.kind == "exciter" else part.fixed
    yield from _placed(section, places, part.check(values))


def _stabiliser_faults(data: Data, parts: Parts, kind: str) -> Iterator[Fault]:
    section = _section(data, "stabiliser")
    if not section:
        return
    if kind in ("playback", "none"):
        yield Fault(("stabiliser",), f"does not go with plant {kind}: nothing feeds it")
    kinds = {kind, *(str(plant.get("type")) for plant in plants_of_records(data).values())}
    if kind == "open-circuit" and "infinite-bus" not in kinds and _section(section, "free"):
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
    yield from _prior_faults((*place, "prior"), _section(entry, "prior"))
    if row is None:
        return
    yield from _outside_sheet(place, numbers, dict.fromkeys(("start", "min", "max"), row))
    if row.unit == "s" and low is not None and low < SHORTEST <= (inf if high is None else high):
        limit = f"{show(SHORTEST)} s, below which the block is bypassed"
        yield Fault((*place, "min"), f"{show(low)} is below {limit}; a free time must not cross it")


def _prior_faults(place: Place, prior: Data) -> Iterator[Fault]:
    """Yield why a share of the mean is no standard deviation."""
    std, mean = prior.get("std"), _numbers(prior).get("mean")
    if not isinstance(std, str) or not re.search(PERCENT, std):
        return
    if mean == 0.0:
        yield Fault((*place, "std"), "a share of mean = 0 is nothing: give a number")
    if not 0.0 < float(std.rstrip("% ")) < inf:
        yield Fault((*place, "std"), f"{show_value(std)} is not above 0, or not finite")


def _outside(start: float | None, low: float | None, high: float | None) -> bool:
    if start is None:
        return False
    return (low is not None and start < low) or (high is not None and start > high)


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


def _trial_faults(place: Place, trial: Any, data: Data, kind: str) -> Iterator[Fault]:
    """Yield what does not fit together in a test and its record."""
    test, record = _section(trial, "test"), _section(trial, "record")
    yield from _event_faults((*place, "test"), test, kind)
    for index, switch in enumerate(_list(test, "network")):
        network = _section(trial, "plant", "network") or _section(data, "plant", "network")
        if "E" in _numbers(switch) and "E" not in network:
            here = (*place, "test", "network", index, "E")
            yield Fault(here, "only where plant.network gives E; test.E changes it by steps")
    has_record = isinstance(trial, dict) and "record" in trial
    yield from _unknown_faults(place, test, record, kind, has_record)
    if has_record:
        yield from _record_faults(place, test, record)
        yield from _channel_faults((*place, "record"), _section(record, "channels"), kind)
    elif kind in NEEDED:
        yield Fault((*place, "record"), f"is missing: plant {kind} plays it back")
    elif not place:
        yield from _missing_without_record((*place, "test"), test)
    vt0 = _starts(test).get("vt0")
    lowest = _numbers(_section(test, "vt0")).get("min")
    if kind not in SIGNALS or kind == "none":
        return
    if vt0 is not None and vt0 <= 0:
        yield Fault((*place, "test", "vt0"), f"{show(vt0)} is not above 0")
    if lowest is not None and lowest <= 0:
        yield Fault((*place, "test", "vt0", "min"), f"{show(lowest)} is not above 0")


def _channel_faults(place: Place, channels: Data, kind: str) -> Iterator[Fault]:
    for signal in channels:
        if signal not in SIGNALS.get(kind, (signal,)):
            known = ", ".join(SIGNALS[kind])
            here = (*place, "channels", signal)
            yield Fault(here, f"does not go with plant {kind}, which has {known}")
    for signal in DRIVERS.get(kind, ()):
        for key in ("weight", "noise", "filter", "outliers"):
            if key in _section(channels, signal):
                here = (*place, "channels", signal, key)
                yield Fault(here, "has no effect: the signal drives, and is not compared")
    for signal in channels:
        median = _numbers(_section(channels, signal, "filter")).get("median")
        if median is not None and median % 2 == 0:
            here = (*place, "channels", signal, "filter", "median")
            yield Fault(here, f"{show(median)} is not an odd number")
        if _numbers(_section(channels, signal)).get("scale") == 0.0:
            here = (*place, "channels", signal, "scale")
            yield Fault(here, "0 leaves nothing of the column")
    for signal in NEEDED.get(kind, ()):
        if channels and signal not in channels:
            yield Fault((*place, "channels", signal), f"is missing: plant {kind} needs it")
    if kind == "machine-playback" and channels and not {"vt", "ifd"} & channels.keys():
        yield Fault((*place, "channels"), "neither vt nor ifd: there is nothing to compare")


def _event_faults(place: Place, test: Data, kind: str) -> Iterator[Fault]:
    """Yield the faults of the steps and switchings of a test."""
    events = {"vref", "vs", "E", "network"}
    for name in sorted(events):
        yield from _step_faults((*place, name), test, name)
        if name in test and name not in EVENTS.get(kind, (name,)):
            yield Fault((*place, name), f"does not go with plant {kind}")
    instants = _instants(test)
    if test and kind not in NEEDED and not events & test.keys():
        yield Fault(place, f"no step: give one of {', '.join(EVENTS.get(kind, ('vref',)))}")
    if "begin" in test and kind in NEEDED:
        yield Fault((*place, "begin"), f"does not go with plant {kind}: the record drives it")
    steady = _numbers(test).get("steady_until")
    if steady is None and kind in NEEDED and not instants:
        yield Fault((*place, "steady_until"), "is missing: until when is the record at rest?")
    if steady is not None and instants and steady > min(instants):
        text = f"{show(steady)} s is after the first step, at {show(min(instants))} s"
        yield Fault((*place, "steady_until"), text)


def _instants(test: Data) -> list[float]:
    """Return the readable instants of all events of a test."""
    return [
        starts["at"]
        for name in ("vref", "vs", "E", "network")
        for starts in map(_starts, _list(test, name))
        if "at" in starts
    ]


def _step_faults(place: Place, test: Data, name: str) -> Iterator[Fault]:
    before: float | None = None
    end = _numbers(test).get("duration")
    for index, step in enumerate(_list(test, name)):
        here, numbers = (*place, index), _starts(step)
        if numbers.get("step") == 0:
            yield Fault((*here, "step"), "0 is no step")
        if name == "network" and isinstance(step, dict) and not {"R", "X", "E"} & step.keys():
            yield Fault(here, "changes nothing: give R, X or E")
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
    for index, stretch in enumerate(_list(record, "mask")):
        if _is_pair(stretch) and stretch[0] >= stretch[1]:
            text = f"start {show(stretch[0])} is not below end {show(stretch[1])}"
            yield Fault((*place, "record", "mask", index), text)
    channels = _section(record, "channels")
    if channels and "begin" not in test and "vt" not in channels and "vt0" not in test:
        yield Fault((*place, "test", "vt0"), "is missing, and the record has no vt to take it from")
    window = record.get("window")
    if not _is_pair(window):
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
    for name in ("vref", "vs", "E", "network"):
        for index, step in enumerate(_list(test, name)):
            at = _starts(step).get("at")
            if at is not None and not start <= at < end:
                limits = f"{show(start)} ... {show(end)} s"
                here = (*place, "test", name, index, "at")
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


def _unknown_faults(
    place: Place, test: Data, record: Data, kind: str, has_record: bool
) -> Iterator[Fault]:
    """Yield the faults of what the fit shall find about a record: instants, sizes, levels."""
    found: list[tuple[Place, Any]] = [((*place, "test", "vt0"), test.get("vt0"))]
    for name in ("vref", "vs"):
        for at in range(len(_list(test, name))):
            for key in ("at", "step"):
                found.append(((*place, "test", name, at, key), _section(test, name, at).get(key)))
    found.append(((*place, "record", "delay"), record.get("delay")))
    for signal, channel in _section(record, "channels").items():
        for key in ("scale", "offset"):
            here = (*place, "record", "channels", signal, key)
            found.append((here, channel.get(key) if isinstance(channel, dict) else None))
    for here, value in found:
        if isinstance(value, dict):
            yield from _unknown_value_faults(here, value)
            if kind in NEEDED:
                yield Fault(here, f"does not go with plant {kind}: the record drives it")
            elif value.get("start") == "auto":
                if not has_record:
                    yield Fault((*here, "start"), "auto needs a record")
                elif "vt" not in _section(record, "channels"):
                    yield Fault((*here, "start"), "auto needs vt in the record")
    vt = _section(record, "channels", "vt")
    for key in ("scale", "offset"):
        if test and isinstance(vt.get(key), dict) and "vt0" not in test:
            here = (*place, "test", "vt0")
            yield Fault(here, f"is missing: the record cannot tell it where {key} of vt is found")
            break
    if kind in NEEDED and _numbers(record).get("delay", 0.0) != 0.0:
        yield Fault((*place, "record", "delay"), f"does not go with plant {kind}")


def _unknown_value_faults(place: Place, value: Data) -> Iterator[Fault]:
    """Yield the faults of one value that the fit shall find: its bounds and its start."""
    numbers = _numbers(value)
    start, low, high = (numbers.get(key) for key in ("start", "min", "max"))
    auto = value.get("start") == "auto"
    if auto and (place[-1] not in ("at", "step") or place[-3:-1] != ("vref", 0)):
        yield Fault((*place, "start"), "auto finds the first step of vref: its at and its step")
    for key in ("min", "max"):
        if key not in value and not auto:
            yield Fault((*place, key), "is missing")
    if low is not None and high is not None and low >= high:
        yield Fault((*place, "min"), f"{show(low)} is not below max = {show(high)}")
    elif _outside(start, low, high):
        limits = " ... ".join("?" if limit is None else show(limit) for limit in (low, high))
        yield Fault((*place, "start"), f"{show(start or 0.0)} lies outside its bounds {limits}")
    if place[-1] in ("step", "scale") and low is not None and high is not None and low <= 0 <= high:
        yield Fault((*place, "min"), f"{show(low)} ... {show(high)} holds 0")


def _noise_faults(data: Data, trials: list[tuple[Place, Any]], kind: str) -> Iterator[Fault]:
    """Yield channels without noise where another has it, and channels with weight and noise."""
    channels = {
        (*place, "record", "channels", signal): channel if isinstance(channel, dict) else {}
        for place, trial in trials
        for signal, channel in _section(trial, "record", "channels").items()
        if signal not in DRIVERS.get(kind, ())
    }
    fitted = {place: one for place, one in channels.items() if place[0] != "validate"}
    given = any("noise" in channel for channel in fitted.values())
    for place, channel in channels.items():
        if "noise" in channel and "weight" in channel:
            yield Fault((*place, "weight"), "does not go with noise: it is one over the noise")
        if given and place in fitted and "noise" not in channel:
            yield Fault((*place, "noise"), "is missing: other channels have it")


def _repeated_names(trials: Sequence[tuple[Place, Any]]) -> Iterator[Fault]:
    seen = dict.fromkeys(TAKEN, "a file of every run")
    for place, trial in trials:
        name = trial.get("name") if isinstance(trial, dict) else None
        if not isinstance(name, str):
            continue
        if name.casefold().partition(".")[0] in PREFIXES:
            yield Fault((*place, "name"), f"{name!r} is taken: a part of the plant begins so")
        elif name.casefold() in seen:
            text = f"{name!r} is taken by {seen[name.casefold()]}: files are named after it"
            yield Fault((*place, "name"), text)
        seen.setdefault(name.casefold(), repr(name))


def _readable(part: Part, *given: Data) -> dict[str, float]:
    """Return the resolved values without those that the file gives in no readable form."""
    unreadable = {
        symbol for some in given for symbol, value in some.items() if not _is_number(value)
    }
    values = part.resolved(*map(_numbers, given))
    return {symbol: value for symbol, value in values.items() if symbol not in unreadable}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _numbers(entries: Any) -> dict[str, float]:
    """Return those entries of a mapping that are numbers, none where it is no mapping."""
    if not isinstance(entries, dict):
        return {}
    return {key: float(value) for key, value in entries.items() if _is_number(value)}


def _starts(entries: Any) -> dict[str, float]:
    """Return those entries that are numbers, or are found by the fit from a start that is one."""
    if not isinstance(entries, dict):
        return {}
    known = {
        key: value.get("start") if isinstance(value, dict) else value
        for key, value in entries.items()
    }
    return _numbers(known)


def _is_tie(value: Any) -> bool:
    return isinstance(value, str) and value.startswith(TIE)


def _is_pair(value: Any) -> TypeGuard[list[float]]:
    return isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))


def _section(data: Any, *place: str | int) -> dict[str, Any]:
    """Return the mapping at a place, an empty one where there is none."""
    for key in place:
        if isinstance(data, list) and isinstance(key, int) and key < len(data):
            data = data[key]
        else:
            data = data.get(key) if isinstance(data, dict) else None
    return data if isinstance(data, dict) else {}


def _list(data: Any, key: str) -> list[Any]:
    """Return the list under a key, an empty one where there is none."""
    found = data.get(key) if isinstance(data, dict) else None
    return found if isinstance(found, list) else []
