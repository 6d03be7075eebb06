"""Tables of tests, when and how large each was, and of records from which cases are made."""

import csv
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from math import isfinite
from pathlib import Path
from typing import NamedTuple, TypeVar

from exfit.case.json_schema import PATTERNS
from exfit.case.schema.values import FILE_NAME
from exfit.case.suggestion import Base, RecordSettings, base_of
from exfit.errors import ExfitError, FileError
from exfit.features.start.ratings import ANGLE_UNITS, CONNECTIONS, NO_RATINGS, Ratings
from exfit.features.start.starting_tests import (
    StartingTest,
    renamed,
    started,
    starting_tests,
)
from exfit.records.formats import WORKBOOKS
from exfit.records.inspection import Inspection
from exfit.records.recorded_tests import DetectedTest, tests_of
from exfit.records.units import unit_of
from exfit.signals import RECORDED
from exfit.util.files import read_limited, utf8
from exfit.util.text import near, show_value

LARGEST_TABLE = 16_000_000  # bytes
MOST_COLUMNS = 1000  # of a table
COLUMNS = ("file", "at", "step", "base", "validates")
YES, NO = ("yes", "y", "x", "1", "true"), ("", "no", "n", "0", "false", "-")
NEAREST = 5.0  # s: how far a noted instant may be from the step that the record shows
OF_UNIT = ("dyr", "bus", "id", "model", "machine", "name")
OF_RECORD = ("time", "time unit", "sheet", "vt")
OF_RATINGS = ("kv", "mva", "connection", "angle unit", "raw")
OF_NETWORK = {"f0": "f0", "x": "X", "p": "P", "q": "Q"}  # columns, and their keys in a case
ABOUT = "about."  # begins the names of columns for reports
CHANNEL = "channel."  # begins those of a signal's column of the record
ALL_COLUMNS = (*COLUMNS, "unit", *OF_RECORD, *OF_UNIT, *OF_RATINGS, *OF_NETWORK)
MOST_BUSES = 999_999
LONGEST_ID = 2
TIME_UNITS = ("s", "ms", "us", "min")
BETWEEN_COLUMNS = ";"  # of date and time

Value = TypeVar("Value")


class Cells(NamedTuple):
    """The cells of a row by the names of their columns; ``place`` is the file and its row."""

    place: str
    by_name: Mapping[str, str]

    def read(self, name: str, reader: Callable[[str], Value], faults: list[str]) -> Value | None:
        """Read a cell, None where it is blank; add its faults, which a reader raises as text."""
        text = self.by_name.get(name, "")
        try:
            return reader(text) if text else None
        except ExfitError as fault:
            faults.append(f"{self.place}: {name}: {fault}")
            return None


def is_table(path: Path) -> bool:
    """Tell by its suffix if a file is a table: CSV or a workbook."""
    return path.suffix.lower() in (".csv", *WORKBOOKS)


def read_cells(path: Path, columns: Sequence[str], prefixes: Sequence[str] = ()) -> list[Cells]:
    """Return the rows of a CSV file or of the only sheet of a workbook with a table.

    ``columns`` are the names that it may have; a name may begin with one of the ``prefixes``, too.
    Rows without a word are left out. Raises ExfitError where the file cannot be read or is empty,
    and with all columns that are unknown or repeated, and rows that are too long.
    """
    lines = [*_workbook_rows(path)] if path.suffix.lower() in WORKBOOKS else [*_csv_rows(path)]
    if not lines:
        raise ExfitError(f"{path}: the file is empty; columns: {', '.join(columns)}")
    (head, texts), rows = lines[0], lines[1:]
    names = _without_blank_end([text.strip() for text in texts])
    names = [name if name.startswith(tuple(prefixes)) else name.lower() for name in names]
    faults = [*_wrong_names(names, f"{path}:{head}", columns, prefixes)]
    table = []
    for number, cells in rows:
        count = len(_without_blank_end(cells))
        if count > len(names):
            faults.append(f"{path}:{number}: more cells than columns: {count}, {len(names)}")
        elif not faults:  # a table of too many columns is not copied
            pairs = zip_longest(names, cells[: len(names)], fillvalue="")
            table.append(Cells(f"{path}:{number}", {name: cell.strip() for name, cell in pairs}))
    if faults:
        raise FileError(faults)
    if not table:
        raise ExfitError(f"{path}: no row below the names of the columns")
    return table


def _wrong_names(
    names: Sequence[str], place: str, columns: Sequence[str], prefixes: Sequence[str]
) -> Iterator[str]:
    """Yield the names of columns that are unknown or repeated, or that there are too many."""
    if len(names) > MOST_COLUMNS:
        yield f"{place}: {len(names):,} columns; at most {MOST_COLUMNS:,} allowed"
        return
    known = (*columns, *(f"{prefix}..." for prefix in prefixes))
    for number, name in enumerate(names):
        if name in names[:number]:
            yield f"{place}: column {name}: given twice"
        elif name not in columns and not (prefixes and name.startswith(tuple(prefixes))):
            yield f"{place}: column {name or number + 1}; {near(name, known)}"


def _without_blank_end(cells: Sequence[str]) -> list[str]:
    """Return the cells up to the last that holds a word, with which a row counts."""
    count = max((k + 1 for k, cell in enumerate(cells) if cell.strip()), default=0)
    return [*cells[:count]]


def _csv_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each row of a CSV file behind the number of its line."""
    lines = utf8(read_limited(path, LARGEST_TABLE), path).splitlines()
    separator = ";" if lines and ";" in lines[0] else ","
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as fault:
        raise ExfitError(f"{path}:{reader.line_num}: cannot be read: {fault}") from None


def _workbook_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each row of the only sheet with content behind its number."""
    from exfit.records.formats.child import texts_of_sheets

    sheets = {name: rows for name, rows in texts_of_sheets(path).items() if any(map(any, rows))}
    if len(sheets) > 1:
        raise ExfitError(f"{path}: several sheets: {', '.join(sheets)}; leave one with the table")
    for rows in sheets.values():
        for number, cells in enumerate(rows, start=1):
            if any(cells):
                yield number, cells


class TableRow(NamedTuple):
    """A row of a table, from a ``place``: what is None is not given."""

    place: str
    file: Path | None
    at: float | None
    step: float | None
    base: Base | None
    validates: bool | None


def read_test_table(path: Path) -> tuple[TableRow, ...]:
    """Return the rows of a CSV file or workbook: columns file, at (s), step (pu), base, validates.

    All may be missing; files are relative to the table's folder. Raises ExfitError with all faults.
    """
    faults = list[str]()
    rows = tuple(_table_row(row, path.parent, faults) for row in read_cells(path, COLUMNS))
    if faults:
        raise FileError(faults)
    return rows


def tests_of_table(
    rows: Sequence[TableRow], inspections: Mapping[Path, Inspection], bases: Mapping[str, Base]
) -> tuple[StartingTest, ...]:
    """Return the tests that rows name, whose files are all inspected, in order of the rows.

    Where no row says which tests validate, it is as `starting_tests` has it. Raises ExfitError
    where a record shows no step at the instant of a row, and for an instant or a size of a grid
    event.
    """
    alternate = all(row.validates is None for row in rows)
    files = [row.file for row in rows if row.file is not None]
    events: Sequence[StartingTest | None] = [None] * len(rows)
    if any(inspections[file].is_event for file in files):
        _refuse_as_events(rows)
        events = starting_tests([inspections[file] for file in files], {}, bases)
    tests, recorded = list[StartingTest](), list[DetectedTest]()
    for k, (row, file, event) in enumerate(zip(rows, files, events, strict=True)):
        inspection = inspections[file]
        own = bases if row.base is None else {**bases, "vt": row.base}
        validates = _usual(k, event) if alternate else bool(row.validates)
        if event is not None:
            tests.append(replace(event, bases=own, validates=validates))
            continue
        test = _nearest(row, tests_of(inspection))
        try:
            tests.append(started(inspection, test, row.step, own, validates))
        except ExfitError as fault:
            raise ExfitError(f"{row.place}: {fault}") from None
        recorded.append(test)
    if all(test.validates for test in tests):
        raise ExfitError(f"{rows[0].place}: every test validates; at least one must be fitted")
    return renamed(tests, recorded) if recorded else tuple(tests)


def _usual(place: int, event: StartingTest | None) -> bool:
    """Test whether a row validates of which no row says so."""
    return place % 2 == 1 if event is None else event.validates


def _refuse_as_events(rows: Sequence[TableRow]) -> None:
    """Raise FileError where rows of grid events give what no event has, or one record twice."""
    faults, seen = list[str](), set[Path | None]()
    for row in rows:
        for name, value in (("at", row.at), ("step", row.step)):
            if value is not None:
                faults.append(
                    f"{row.place}: {name}: {value:g}: not allowed: {row.file} shows a grid event"
                )
        if row.file in seen:
            faults.append(f"{row.place}: file: {row.file}: a grid event in a further row, too")
        seen.add(row.file)
    if faults:
        raise FileError(faults)


def _nearest(row: TableRow, tests: Sequence[DetectedTest]) -> DetectedTest:
    """Return the test of a record that a row means; raises ExfitError where there is none."""
    shown = f"{row.file} shows steps at (s): " + (
        ", ".join(f"{test.at:.1f}" for test in tests) or "none"
    )
    if row.at is None:
        if len(tests) == 1:
            return tests[0]
        raise ExfitError(f"{row.place}: at: missing; {shown}")
    at = row.at
    nearest = min(tests, key=lambda test: abs(test.at - at), default=None)
    if nearest is None or abs(nearest.at - at) > NEAREST:
        raise ExfitError(f"{row.place}: at: no step within {NEAREST:g} s of {at:g} s; {shown}")
    return nearest


def _table_row(row: Cells, folder: Path, faults: list[str]) -> TableRow:
    """Return a row with the files of a folder; add all that is wrong with it."""
    place, cells = row
    base = row.read("base", base_of, faults)
    word = cells.get("validates", "").lower()
    if word not in (*YES, *NO):
        faults.append(f"{place}: validates: {show_value(word)} is neither yes nor no")
    return TableRow(
        place,
        folder / cells["file"] if cells.get("file") else None,
        row.read("at", _number, faults),
        row.read("step", _number, faults),
        base,
        word in YES if "validates" in cells else None,
    )


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ExfitError(f"{show_value(text)} is not a number") from None
    if not isfinite(value):
        raise ExfitError(f"{show_value(text)} is not a finite number")
    return value


@dataclass(frozen=True)
class CaseOfTable:
    """A case to be made: its name, its unit, its tests, and how each record is read.

    The unit is that of a bus and an id of ``dyr``, with another exciter where a ``model`` is given;
    without ``dyr`` a ``model`` and a ``machine`` with typical data. ``network`` are values of the
    grid by their keys in a case, ``about`` what a report shows, ``raw`` a power flow file with
    ratings of the unit; ``place`` is where its first row is.
    """

    place: str
    name: str
    dyr: Path | None
    bus: int | None
    machine_id: str | None
    model: str | None
    machine: str | None
    tests: tuple[TableRow, ...]
    settings: Mapping[Path, RecordSettings]
    network: Mapping[str, float]
    about: Mapping[str, str]
    ratings: Ratings = NO_RATINGS
    raw: Path | None = None


def read_case_table(path: Path, dyr: Path | None = None) -> tuple[CaseOfTable, ...]:
    """Return the cases that the rows of a CSV file or workbook describe, in its order.

    Columns are file (required), at, step, base and validates as in a table of tests; unit, that of
    base; time (columns of date and time with ; between), time unit, sheet and vt (its column) of
    the record, channel.SIGNAL for its columns; dyr, bus, id, model, machine and name of the unit;
    kV, MVA, connection, angle unit and raw, a power flow file that has ratings; f0, X, P and Q of
    its grid; about.NAME for reports. Files are relative to the table's folder. What a unit has is
    given in one of its rows or more. With a ``dyr`` every row is of a unit of that file.

    Raises ExfitError with all faults, each with its row and column.
    """
    faults = list[str]()
    by_case: dict[tuple[str, ...], list[Cells]] = {}
    for row in read_cells(path, ALL_COLUMNS, (ABOUT, CHANNEL)):
        by_case.setdefault(_identity(row.by_name), []).append(row)
    for identity, rows in by_case.items():  # with an id in one row and none in another
        of_file, bus, machine_id = (*identity, "", "")[:3]
        others = [key for key in by_case if key[:2] == (of_file, bus) and len(key) > 1 and key[2]]
        if len(identity) > 1 and bus and not machine_id and others:
            faults.append(f"{rows[0].place}: id: missing, but given in another row of bus {bus}")
    cases = [_case(rows, path.parent, dyr, faults) for rows in by_case.values()]
    first: dict[str, str] = {}
    for case in cases:
        place = first.setdefault(case.name.casefold(), case.place)
        if place != case.place:
            faults.append(f"{case.place}: name: {case.name}: also that of another unit, at {place}")
    if faults:
        raise FileError(dict.fromkeys(faults))
    return tuple(cases)


def case_name_of(bus: int, machine_id: str | None) -> str:
    """Return the name of the case of a unit, which any system takes for a file: bus-101-1."""
    letters = [
        letter if letter.isascii() and letter.isalnum() else f"x{ord(letter):02x}"
        for letter in machine_id or ""
    ]
    return "-".join([f"bus-{bus}", *(["".join(letters)] if letters else [])])


def _identity(cells: Mapping[str, str]) -> tuple[str, ...]:
    """Identify the case of a row: by its name, or its unit, or its record."""
    if cells.get("name"):
        return (cells["name"].casefold(),)
    if cells.get("bus"):
        return (cells.get("dyr", ""), cells["bus"], cells.get("id", "").upper())
    return (cells.get("dyr", ""), "", cells.get("file", ""))


def _case(rows: Sequence[Cells], folder: Path, dyr: Path | None, faults: list[str]) -> CaseOfTable:
    """Return the case of rows of one unit; add all that is wrong with them."""
    about = [name for name in rows[0].by_name if name.startswith(ABOUT)]
    unit = _common(rows, [*OF_UNIT, *OF_RATINGS, *OF_NETWORK, *about], faults)
    cells = unit.by_name
    own = _file(unit, "dyr", folder) or dyr
    bus, machine_id = unit.read("bus", _bus, faults), unit.read("id", _id, faults)
    name = unit.read("name", _name, faults)
    faults += _of_unit(unit, own, dyr)
    network = {key: unit.read(column, _number, faults) for column, key in OF_NETWORK.items()}
    model = cells.get("model") or None
    return CaseOfTable(
        rows[0].place,
        name or _default_name(bus, machine_id, rows[0]),
        own,
        bus,
        machine_id,
        str(folder / model) if model and model.endswith(".py") else model,
        cells.get("machine") or None,
        tuple(_test(row, folder, faults) for row in rows),
        _settings(rows, folder, faults),
        {key: value for key, value in network.items() if value is not None},
        {key.removeprefix(ABOUT): cells[key] for key in about if cells[key]},
        _ratings(unit, faults),
        _file(unit, "raw", folder),
    )


def _file(unit: Cells, column: str, folder: Path) -> Path | None:
    """Return the file that a cell names, None where it is blank."""
    name = unit.by_name.get(column)
    return folder / name if name else None


def _ratings(unit: Cells, faults: list[str]) -> Ratings:
    """Return the ratings of a unit; add those that are none."""
    numbers = {column: unit.read(column, _number, faults) for column in ("kv", "mva")}
    for column, value in numbers.items():
        if value is not None and value <= 0.0:
            faults.append(f"{unit.place}: {column}: {value:g} is not above 0")
    words: dict[str, str | None] = {}
    for column, known in (("connection", CONNECTIONS), ("angle unit", ANGLE_UNITS)):
        text = unit.by_name.get(column) or None
        words[column] = text
        if text is not None and text not in known:
            faults.append(f"{unit.place}: {column}: {show_value(text)}; {near(text, known)}")
    return Ratings(numbers["kv"], numbers["mva"], words["connection"], words["angle unit"])


def _default_name(bus: int | None, machine_id: str | None, row: Cells) -> str:
    if bus is not None:
        return case_name_of(bus, machine_id)
    stem = Path(row.by_name.get("file", "")).stem
    return re.sub("[^A-Za-z0-9._%-]+", "-", stem).lstrip("-._%") or "case"


def _common(rows: Sequence[Cells], names: Sequence[str], faults: list[str]) -> Cells:
    """Return cells that all rows share where they have them; add those that differ."""
    shared: dict[str, str] = {}
    for row in rows:
        for name in names:
            text = row.by_name.get(name, "")
            former = shared.get(name) or text
            if text and text.casefold() != former.casefold():
                faults.append(
                    f"{row.place}: {name}: {text}, but {former} in a row of the same unit"
                )
            shared[name] = former
    return Cells(rows[0].place, shared)


def _of_unit(unit: Cells, dyr: Path | None, of_all: Path | None) -> Iterator[str]:
    """Check the data of a unit for gaps and contradictions."""
    cells, place = unit.by_name, unit.place
    if of_all is not None:
        for name in ("dyr", "model", "machine"):
            if cells.get(name):
                yield f"{place}: {name}: not allowed: every row is of a unit of {of_all}"
        if not cells.get("bus"):
            yield f"{place}: bus: missing"
    elif dyr is None:
        if not cells.get("model"):
            yield f"{place}: model: missing, and no dyr is given"
        for name in ("bus", "id"):
            if cells.get(name):
                yield f"{place}: {name}: {cells[name]}: only with dyr, in which it is looked for"
    elif cells.get("machine"):
        yield f"{place}: machine: {cells['machine']}: not allowed with dyr, which has its own"


def _bus(text: str) -> int:
    if not (text.isascii() and text.isdigit() and 0 < int(text[:10]) <= MOST_BUSES):
        raise ExfitError(f"{show_value(text)} is not a whole number of 1 ... {MOST_BUSES}")
    return int(text)


def _id(text: str) -> str:
    if len(text) > LONGEST_ID:
        raise ExfitError(f"{show_value(text)} has more than {LONGEST_ID} letters or digits")
    return text


def _name(text: str) -> str:
    if not re.match(FILE_NAME, text):
        raise ExfitError(f"{show_value(text)} {PATTERNS[FILE_NAME]}")
    return text


def _test(row: Cells, folder: Path, faults: list[str]) -> TableRow:
    """Return a row, the base of the voltage with the unit of its own column, where it has none."""
    test = _table_row(row, folder, faults)
    if test.file is None:
        faults.append(f"{row.place}: file: missing")
    base, unit, place = test.base, row.by_name.get("unit", ""), f"{row.place}: unit"
    if not unit:
        return test
    if unit_of(unit) is None:
        faults.append(f"{place}: {show_value(unit)} is not a unit of a voltage, as kV")
    elif base is None:
        faults.append(f"{place}: {unit}: it is that of base, which is missing")
    elif base.unit is not None:
        faults.append(f"{place}: {unit}: not allowed beside a base with its own, {base.unit}")
    else:
        return test._replace(base=base_of(f"{base.value!r} {unit}"))
    return test


def _channels(row: Cells, columns: Sequence[str], faults: list[str]) -> dict[str, str]:
    """Return the columns of a record by signal; add the names that are none of a signal."""
    for name in columns:
        signal = name.removeprefix(CHANNEL)
        if signal not in RECORDED:
            faults.append(f"{row.place}: {name}: no signal; {near(signal, RECORDED)}")
    given = {name.removeprefix(CHANNEL): row.by_name[name] for name in columns}
    return {signal: column for signal, column in given.items() if column}


def _settings(rows: Sequence[Cells], folder: Path, faults: list[str]) -> dict[Path, RecordSettings]:
    """Collect the settings by which each record of a unit is read."""
    settings: dict[Path, RecordSettings] = {}
    for file in dict.fromkeys(row.by_name.get("file", "") for row in rows):
        if file:
            of_file = [row for row in rows if row.by_name.get("file", "") == file]
            columns = [name for name in of_file[0].by_name if name.startswith(CHANNEL)]
            row = _common(of_file, [*OF_RECORD, *columns], faults)
            cells, unit = row.by_name, row.by_name["time unit"]
            if unit and unit not in TIME_UNITS:
                meant = near(unit, TIME_UNITS)
                faults.append(f"{row.place}: time unit: {show_value(unit)}; {meant}")
            names = (name.strip() for name in cells["time"].split(BETWEEN_COLUMNS))
            clock, sheet = tuple(filter(None, names)), cells["sheet"] or None
            settings[folder / file] = RecordSettings(
                clock,
                unit or None,
                sheet,
                cells["vt"] or None,
                channels=_channels(row, columns, faults),
            )
    return settings
