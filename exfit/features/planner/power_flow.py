"""The power flow files of PSS/E (.raw, versions 32 to 36): ratings of the machines of a grid."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from exfit.errors import DynamicsError
from exfit.features.planner.buses import Bus, Buses
from exfit.features.planner.fields import (
    WHOLE,
    DynamicsFault,
    Field,
    lines_of,
    located,
    number,
    text_of,
)
from exfit.features.planner.import_case import read_file
from exfit.features.planner.psse import COMMENTS, read_line
from exfit.features.start.ratings import Ratings, StepUp
from exfit.features.start.record_files import UnitKey
from exfit.util.text import show

VERSIONS = (32, 36)
SECTIONS = ("BUS", "LOAD", "FIXED SHUNT", "GENERATOR", "BRANCH")
WITH_DROOP = 36  # from this version on there are sections before and behind the generators
WITH_DROOP_SECTIONS = (*SECTIONS[:3], "VOLTAGE DROOP CONTROL", "GENERATOR", "RATING SET", "BRANCH")
SYSTEM_WIDE = 34  # from this version on there are sections before the buses, behind the branches
BEGIN = re.compile(r"BEGIN\s+(.*?)\s+DATA", re.IGNORECASE)
TITLE_LINES = 3
SBASE, REV, BASFRQ = 1, 2, 5  # fields of the first line
BASKV = 2  # of a bus
# of a generator; one later in version 35, which has NREG before them
MBASE, ZR, RT, XT, GTAP = 8, 9, 11, 12, 13
WITH_NREG = 35
THIRD_BUS, CW, CZ, STAT = 2, 4, 5, 11  # of a transformer
IN_KV, OF_NOMINAL = 2.0, 3.0  # CW: of its taps, else per unit of the bus
ON_SYSTEM_BASE, ON_OWN_BASE = 1.0, 2.0  # CZ: of its impedance


class _Row(NamedTuple):
    """A line of a file."""

    line: int
    fields: Sequence[Field]


class _Bus(NamedTuple):
    name: str
    kv: float


def read_power_flow(path: Path) -> Mapping[UnitKey, Ratings]:
    """Read the ratings of machines, by bus and id in capitals, from a power flow file.

    Raises DynamicsError with all faults, each with its line, and for another version of the file.
    """
    faults = list[DynamicsFault]()
    (base, version, f0), sections = _read(path, faults)
    ratings = _ratings(sections, base, version, f0, faults)
    if faults:
        raise DynamicsError(located(faults, str(path)))
    return ratings


def read_buses(path: Path) -> Buses:
    """Read the names and the kV of buses from a power flow file; raises as ``read_power_flow``."""
    faults = list[DynamicsFault]()
    _, sections = _read(path, faults)
    buses = _buses(sections, faults)
    if faults:
        raise DynamicsError(located(faults, str(path)))
    return {
        int(number): Bus(bus.name, bus.kv or None)
        for number, bus in buses.items()
        if WHOLE.fullmatch(number)
    }


def _read(
    path: Path, faults: list[DynamicsFault]
) -> tuple[tuple[float, float, float], dict[str, list[_Row]]]:
    """Return the heading and the sections of a file, none where the heading has faults."""
    lines = [
        (place, line)
        for place, (_, line) in enumerate(lines_of(text_of(read_file(path), str(path))), start=1)
        if not line.lstrip().startswith(COMMENTS)
    ]
    heading = _heading(lines, faults)
    return heading, {} if faults else _sections(lines[TITLE_LINES:], int(heading[1]))


def _heading(
    lines: Sequence[tuple[int, str]], faults: list[DynamicsFault]
) -> tuple[float, float, float]:
    """Return base, version and frequency of the first line; add what is wrong with them."""
    place, line = lines[0] if lines else (1, "")
    head = _Row(place, read_line(line, place, 0, True).fields)
    for at, name in ((SBASE, "SBASE"), (REV, "REV")):
        if at >= len(head.fields):
            faults.append(DynamicsFault(head.line, f"{name}: missing"))
    base, version = _number(head, SBASE, "SBASE", faults), _number(head, REV, "REV", faults)
    low, high = VERSIONS
    if not faults and not low <= int(version) <= high:
        text = f"REV: {show(version)} lies outside {low} ... {high}, the versions that are read"
        faults.append(DynamicsFault(head.line, text))
    return base, version, _number(head, BASFRQ, "BASFRQ", faults)


def _ratings(
    sections: Mapping[str, Sequence[_Row]],
    base: float,
    version: float,
    f0: float,
    faults: list[DynamicsFault],
) -> dict[UnitKey, Ratings]:
    """Return the ratings of the machines of a file; add what is wrong with its rows."""
    buses = _buses(sections, faults)
    generators = [row for row in sections.get("GENERATOR", ()) if len(row.fields) > 1]
    at_bus = Counter(row.fields[0].text for row in generators)
    step_ups = _step_ups(sections.get("TRANSFORMER", ()), base, buses, faults)
    later = int(version) >= WITH_NREG
    ratings: dict[UnitKey, Ratings] = {}
    for row in generators:
        bus, machine_id = row.fields[0].text, row.fields[1].text.upper()
        if bus not in buses or not bus.isdigit():
            faults.append(DynamicsFault(row.line, f"bus {bus}: not in the section of the buses"))
            continue
        mva = _number(row, MBASE + later, "MBASE", faults)
        resistance = _number(row, RT + later, "RT", faults)
        own = _number(row, XT + later, "XT", faults)
        ra = _number(row, ZR + later, "ZR", faults)
        if own > 0.0 and _number(row, GTAP + later, "GTAP", faults) not in (0.0, 1.0):
            continue  # on which side of it the tap is is not public: its case asks
        step_up = StepUp(resistance, own, None) if own > 0.0 else None
        beside = step_ups.get(bus, ())
        if step_up is None and at_bus[bus] == len(beside) == 1:
            step_up = beside[0].on_base(mva)
        kv, power, frequency = (value or None for value in (buses[bus].kv, mva, f0))
        key = UnitKey(int(bus), machine_id or "1")
        ratings[key] = Ratings(kv, power, f0=frequency, step_up=step_up, ra=ra)
    return ratings


def _buses(sections: Mapping[str, Sequence[_Row]], faults: list[DynamicsFault]) -> dict[str, _Bus]:
    """Return the buses by their numbers; add what is wrong with their rows."""
    return {
        row.fields[0].text: _Bus(row.fields[1].text, _number(row, BASKV, "BASKV", faults))
        for row in sections.get("BUS", ())
        if len(row.fields) > BASKV
    }


def _sections(lines: Sequence[tuple[int, str]], version: int) -> dict[str, list[_Row]]:
    """Return the rows of each section: named where the one before ends, else in their order."""
    more = version >= SYSTEM_WIDE
    before, behind = (["SYSTEM-WIDE"], ["SYSTEM SWITCHING DEVICE"]) if more else ([], [])
    order = iter(
        [
            *before,
            *(SECTIONS if version < WITH_DROOP else WITH_DROOP_SECTIONS),
            *behind,
            "TRANSFORMER",
        ]
    )
    name = next(order)
    sections: dict[str, list[_Row]] = {}
    for place, line in lines:
        fields = read_line(line, place, 0, True).fields
        # a transformer's resistance may be 0, too, with its reactance behind it
        if [field.text.upper() for field in fields[:2]] in (["0"], ["Q"], ["0", "END"]):
            begins = BEGIN.search(line)
            following = next(order, "")
            name = begins[1].upper() if begins else following
        elif fields:
            sections.setdefault(name, []).append(_Row(place, fields))
    return sections


class _Transformer(NamedTuple):
    """A transformer as one of its buses sees it: its impedance, pu of 1 MVA, and the other's kV."""

    r: float
    x: float
    kv: float

    def on_base(self, mva: float) -> StepUp:
        """Return it per unit of a machine."""
        return StepUp(float(f"{self.r * mva:.6g}"), float(f"{self.x * mva:.6g}"), self.kv)


def _step_ups(
    rows: Sequence[_Row], base: float, buses: Mapping[str, _Bus], faults: list[DynamicsFault]
) -> dict[str, list[_Transformer]]:
    """Return the transformers of two windings in service that a bus is the lower side of.

    With taps t of the sides, low = t_low^2 (R + jX) i + (t_low / t_high) high.
    """
    found: dict[str, list[_Transformer]] = {}
    for first, second, *windings in _of_two_windings(rows):
        ends = [buses.get(field.text) for field in first.fields[:2]]
        code = _number(first, CZ, "CZ", faults)
        resistance = _number(second, 0, "R1-2", faults)
        reactance = _number(second, 1, "X1-2", faults)
        if (
            None in ends
            or first.fields[STAT].text == "0"
            or code not in (ON_SYSTEM_BASE, ON_OWN_BASE)
        ):
            continue
        power = base if code == ON_SYSTEM_BASE else _number(second, 2, "SBASE1-2", faults)
        kv = [bus.kv for bus in ends if bus is not None]
        if power > 0.0 and kv[0] != kv[1]:
            at = kv.index(min(kv))
            taps = [_tap(*own, first, faults) for own in zip(windings, kv, strict=True)]
            low, high = taps[at], taps[1 - at]
            share = low * low / power  # as a power it would raise for 1e200
            behind = max(kv) * high / low if min(taps) > 0.0 else max(kv)
            own = _Transformer(share * resistance, share * reactance, float(f"{behind:.6g}"))
            found.setdefault(first.fields[at].text, []).append(own)
    return found


def _tap(winding: _Row, kv: float, first: _Row, faults: list[DynamicsFault]) -> float:
    """Return the tap of a winding, pu of the kV of its bus; add its fault."""
    if not winding.fields or not winding.fields[0].text:
        return 1.0  # its default
    code, tap = _number(first, CW, "CW", faults), _number(winding, 0, "WINDV", faults)
    nominal = _number(winding, 1, "NOMV", faults)
    in_kv = tap if code == IN_KV else tap * nominal if code == OF_NOMINAL else 0.0
    if in_kv > 0.0 >= kv:
        faults.append(DynamicsFault(winding.line, f"WINDV: {show(in_kv)} kV: its bus has no kV"))
        return 0.0
    pu = in_kv / kv if in_kv > 0.0 else tap
    if pu <= 0.0:
        faults.append(DynamicsFault(winding.line, f"WINDV: {show(tap)} is not above 0"))
    return pu


def _of_two_windings(rows: Sequence[_Row]) -> Iterator[Sequence[_Row]]:
    """Yield the four lines of each transformer of two windings; one of three has five."""
    at = 0
    while at + 3 < len(rows):
        first = rows[at]
        two = len(first.fields) > STAT and first.fields[THIRD_BUS].text in ("0", "")
        if two:
            yield rows[at : at + 4]
        at += 4 if two else 5


def _number(row: _Row, at: int, name: str, faults: list[DynamicsFault]) -> float:
    """Return a number of a row, 0 where the row ends before; add its fault."""
    if at >= len(row.fields):
        return 0.0
    try:
        return number(row.fields[at])
    except ValueError as error:
        faults.append(DynamicsFault(row.line, f"{name}: {error}"))
        return 0.0
