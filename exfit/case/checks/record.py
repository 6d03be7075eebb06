"""What contradicts itself in the tests and records of a case file."""

from collections.abc import Iterator, Sequence
from typing import Any

from exfit.case.checks.data import Data, is_pair, list_of, numbers_in, section_of, starts_in
from exfit.case.yaml import Fault, Place
from exfit.plants import EVENTS, PlantKind
from exfit.records.units import needs_base
from exfit.util.text import show

TAKEN = (
    "fit",
    "response",
    "history",
    "overlay",
    "iterations",
    "convergence",
    "trajectories",
    "sensitivity",
    "correlation",
    "profile",
    "starts",
)
PREFIXES = ("machine", "network", "stabiliser")


def trial_faults(place: Place, trial: Any, data: Data, kind: PlantKind) -> Iterator[Fault]:
    """Yield what does not fit together in a test and its record."""
    test, record = section_of(trial, "test"), section_of(trial, "record")
    yield from _event_faults((*place, "test"), test, kind)
    for index, switch in enumerate(list_of(test, "network")):
        network = section_of(trial, "plant", "network") or section_of(data, "plant", "network")
        if "E" in numbers_in(switch) and "E" not in network:
            here = (*place, "test", "network", index, "E")
            yield Fault(here, "only where plant.network gives E; test.E changes it by steps")
    has_record = isinstance(trial, dict) and "record" in trial
    yield from _unknown_faults(place, test, record, kind, has_record)
    if has_record:
        yield from _record_faults(place, test, record)
        yield from _channel_faults((*place, "record"), section_of(record, "channels"), kind)
    elif kind.plays_back:
        yield Fault((*place, "record"), f"is missing: plant {kind.name} plays it back")
    elif not place:
        yield from _missing_without_record((*place, "test"), test)
    vt0 = starts_in(test).get("vt0")
    lowest = numbers_in(section_of(test, "vt0")).get("min")
    if not kind.per_unit:
        return
    if vt0 is not None and vt0 <= 0:
        yield Fault((*place, "test", "vt0"), f"{show(vt0)} is not above 0")
    if lowest is not None and lowest <= 0:
        yield Fault((*place, "test", "vt0", "min"), f"{show(lowest)} is not above 0")


def _channel_faults(place: Place, channels: Data, kind: PlantKind) -> Iterator[Fault]:
    for signal in channels:
        if signal not in kind.signals:
            signals = ", ".join(kind.signals)
            here = (*place, "channels", signal)
            yield Fault(here, f"not allowed with plant {kind.name}, which has {signals}")
    for signal in kind.driving:
        for key in ("weight", "noise", "filter", "outliers"):
            if key in section_of(channels, signal):
                here = (*place, "channels", signal, key)
                yield Fault(here, "has no effect: the signal drives, and is not compared")
    for signal in channels:
        median = numbers_in(section_of(channels, signal, "filter")).get("median")
        if median is not None and median % 2 == 0:
            here = (*place, "channels", signal, "filter", "median")
            yield Fault(here, f"{show(median)} is not an odd number")
        if numbers_in(section_of(channels, signal)).get("scale") == 0.0:
            here = (*place, "channels", signal, "scale")
            yield Fault(here, "0 leaves nothing of the column")
        here = (*place, "channels", signal)
        yield from _unit_faults(here, section_of(channels, signal), kind)
        yield from _phase_faults(here, section_of(channels, signal), signal)
    for signal in kind.required:
        if channels and signal not in channels:
            yield Fault((*place, "channels", signal), f"is missing: plant {kind.name} needs it")
    compared = kind.compared
    if channels and not {*compared} & {*channels, *kind.required}:
        lacking = f"neither {' nor '.join(compared)}"
        yield Fault((*place, "channels"), f"{lacking}: there is nothing to compare")


def _unit_faults(place: Place, channel: Data, kind: PlantKind) -> Iterator[Fault]:
    """Yield a base of no unit, and a unit that nothing makes per unit, as a machine's must be."""
    unit = channel.get("unit")
    if "base" in channel and "unit" not in channel:
        yield Fault((*place, "unit"), "is missing: in which unit is base?")
    if "base" in channel or "scale" in channel or not isinstance(unit, str):
        return
    if unit and kind.per_unit and needs_base(unit):
        yield Fault((*place, "base"), f"is missing: what is 1 pu in {unit}?")


def _phase_faults(place: Place, channel: Data, signal: str) -> Iterator[Fault]:
    """Yield three phases of what is no voltage of the machine, and what goes with one kind only."""
    if "phases" not in channel:
        return
    if signal != "vt":
        yield Fault((*place, "phases"), "only of vt")
    if channel.get("kind") == "rms" and "cycles" in channel:
        yield Fault((*place, "cycles"), "only with kind: waveform")
    if channel.get("kind") == "waveform" and "averaged" in channel:
        yield Fault((*place, "averaged"), "waveforms have a window of their own: cycles")


def _event_faults(place: Place, test: Data, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of the steps and switchings of a test."""
    for name in EVENTS:
        yield from _step_faults((*place, name), test, name)
        if name in test and name not in kind.events:
            yield Fault((*place, name), f"not allowed with plant {kind.name}")
    instants = _instants(test)
    if test and not kind.plays_back and not {*EVENTS} & test.keys():
        yield Fault(place, f"no step: give one of {', '.join(kind.events)}")
    if "begin" in test and kind.plays_back:
        yield Fault((*place, "begin"), f"not allowed with plant {kind.name}: the record drives it")
    steady = numbers_in(test).get("steady_until")
    if steady is None and kind.plays_back and not instants:
        yield Fault((*place, "steady_until"), "is missing: until when is the record at rest?")
    if steady is not None and instants and steady > min(instants):
        text = f"{show(steady)} s is after the first step, at {show(min(instants))} s"
        yield Fault((*place, "steady_until"), text)


def _instants(test: Data) -> list[float]:
    """Return the readable instants of all events of a test."""
    return [
        starts["at"]
        for name in EVENTS
        for starts in map(starts_in, list_of(test, name))
        if "at" in starts
    ]


def _step_faults(place: Place, test: Data, name: str) -> Iterator[Fault]:
    before: float | None = None
    end = numbers_in(test).get("duration")
    for index, step in enumerate(list_of(test, name)):
        here, numbers = (*place, index), starts_in(step)
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
    begin = numbers_in(test).get("begin")
    if begin is not None and "vt0" not in test:
        yield Fault((*place, "test", "vt0"), "is missing: with begin it says where to start")
    if "resample" in record and record.get("gaps") == "skip":
        text = "does not go with gaps: skip: a filter needs all samples"
        yield Fault((*place, "record", "resample"), text)
    for index, stretch in enumerate(list_of(record, "mask")):
        if is_pair(stretch) and stretch[0] >= stretch[1]:
            text = f"start {show(stretch[0])} is not below end {show(stretch[1])}"
            yield Fault((*place, "record", "mask", index), text)
    channels = section_of(record, "channels")
    if channels and "begin" not in test and "vt" not in channels and "vt0" not in test:
        yield Fault((*place, "test", "vt0"), "is missing, and the record has no vt to take it from")
    window = record.get("window")
    if not is_pair(window):
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
    for name in EVENTS:
        for index, step in enumerate(list_of(test, name)):
            at = starts_in(step).get("at")
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
    place: Place, test: Data, record: Data, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    """Yield the faults of what the fit shall find about a record: instants, sizes, levels."""
    found: list[tuple[Place, Any]] = [((*place, "test", "vt0"), test.get("vt0"))]
    for name in ("vref", "vs"):
        for at in range(len(list_of(test, name))):
            for key in ("at", "step"):
                found.append(((*place, "test", name, at, key), section_of(test, name, at).get(key)))
    found.append(((*place, "record", "delay"), record.get("delay")))
    for signal, channel in section_of(record, "channels").items():
        for key in ("scale", "offset"):
            here = (*place, "record", "channels", signal, key)
            found.append((here, channel.get(key) if isinstance(channel, dict) else None))
    for here, value in found:
        if isinstance(value, dict):
            yield from _unknown_value_faults(here, value)
            if kind.plays_back:
                yield Fault(here, f"not allowed with plant {kind.name}: the record drives it")
            elif value.get("start") == "auto":
                if not has_record:
                    yield Fault((*here, "start"), "auto needs a record")
                elif "vt" not in section_of(record, "channels"):
                    yield Fault((*here, "start"), "auto needs vt in the record")
    vt = section_of(record, "channels", "vt")
    for key in ("scale", "offset"):
        if test and isinstance(vt.get(key), dict) and "vt0" not in test:
            here = (*place, "test", "vt0")
            yield Fault(here, f"is missing: the record cannot tell it where {key} of vt is found")
            break
    if kind.plays_back and numbers_in(record).get("delay", 0.0) != 0.0:
        yield Fault((*place, "record", "delay"), f"not allowed with plant {kind.name}")


def _unknown_value_faults(place: Place, value: Data) -> Iterator[Fault]:
    """Yield the faults of one value that the fit shall find: its bounds and its start."""
    numbers = numbers_in(value)
    start, low, high = (numbers.get(key) for key in ("start", "min", "max"))
    auto = value.get("start") == "auto"
    if auto and (place[-1] not in ("at", "step") or place[-3:-1] != ("vref", 0)):
        yield Fault((*place, "start"), "auto finds the first step of vref: its at and its step")
    for key in ("min", "max"):
        if key not in value and not auto:
            yield Fault((*place, key), "is missing")
    if low is not None and high is not None and low >= high:
        yield Fault((*place, "min"), f"{show(low)} is not below max = {show(high)}")
    elif outside(start, low, high):
        limits = " ... ".join("?" if limit is None else show(limit) for limit in (low, high))
        yield Fault((*place, "start"), f"{show(start or 0.0)} lies outside its bounds {limits}")
    if place[-1] in ("step", "scale") and low is not None and high is not None and low <= 0 <= high:
        yield Fault((*place, "min"), f"{show(low)} ... {show(high)} holds 0")


def outside(start: float | None, low: float | None, high: float | None) -> bool:
    """Tell whether a start lies outside its bounds, as far as these are known."""
    if start is None:
        return False
    return (low is not None and start < low) or (high is not None and start > high)


def noise_faults(data: Data, trials: list[tuple[Place, Any]], kind: PlantKind) -> Iterator[Fault]:
    """Yield channels without noise where another has it, and channels with weight and noise."""
    channels = {
        (*place, "record", "channels", signal): channel if isinstance(channel, dict) else {}
        for place, trial in trials
        for signal, channel in section_of(trial, "record", "channels").items()
        if signal not in kind.driving
    }
    fitted = {place: one for place, one in channels.items() if place[0] != "validate"}
    given = any("noise" in channel for channel in fitted.values())
    for place, channel in channels.items():
        if "noise" in channel and "weight" in channel:
            yield Fault((*place, "weight"), "does not go with noise: it is one over the noise")
        if given and place in fitted and "noise" not in channel:
            yield Fault((*place, "noise"), "is missing: other channels have it")


def repeated_names(trials: Sequence[tuple[Place, Any]]) -> Iterator[Fault]:
    """Yield the names of records that are taken: files and values are named after them."""
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
