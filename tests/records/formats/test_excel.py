"""Excel workbooks, as openpyxl writes them: the one table is found below its titles."""

import hashlib
import sys
import zipfile
from contextlib import suppress
from datetime import date, datetime, time, timedelta
from functools import partial

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from openpyxl import Workbook
from tables import damage, everything, in_this_process, refused

from exfit.errors import RecordError
from exfit.records.formats import excel, open_table

read_excel = in_this_process(excel.read)

NAMES = ("Time", "Ut", "If")
ROWS = [(0.0, 15.75, 700), (0.1, 15.8, 701), (0.2, 15.85, 702)]
MIDNIGHT = datetime(2015, 9, 20)
START = MIDNIGHT + timedelta(hours=10, minutes=51, seconds=42, milliseconds=858)


@pytest.fixture
def book(tmp_path):
    """Return a function that writes sheets of rows to a file."""

    def write(**sheets):
        path = tmp_path / "bump.xlsx"
        workbook = Workbook()
        workbook.remove(workbook.active)
        for name, rows in sheets.items():
            sheet = workbook.create_sheet(name)
            for row in rows:
                sheet.append(row)
        workbook.save(path)
        return path

    return write


def assert_the_record(table):
    assert table.names == NAMES
    assert table.clock == ("Time",)
    columns = table.numbers(NAMES)
    for at, name in enumerate(NAMES):
        assert columns[name].tolist() == [row[at] for row in ROWS]
    assert table.instants(["Time"]).tolist() == [0.0, 0.1, 0.2]


UNITS = ("s", "kV", "A")
TITLES = [
    ("Unit 1, bump test",),
    (),
    ("Operator", "N. N.", "shift", "B", "day"),
    ("Rated", 15.75, "kV", 120.0, "MVA"),
    (),
]
LAYOUTS = {
    "names": [NAMES, *ROWS],
    "titles": [*TITLES, NAMES, *ROWS],
    "units": [NAMES, UNITS, *ROWS],
    "units in brackets": [NAMES, [f"[{unit}]" for unit in UNITS], *ROWS],
    "titles and units": [*TITLES, NAMES, UNITS, *ROWS],
    "blank rows": [(), NAMES, (), *ROWS[:1], (), *ROWS[1:], ()],
    "names with blanks": [[f" {name} " for name in NAMES], *ROWS],
    "blank columns": [(*NAMES, None, ""), *((*row, None, "") for row in ROWS)],
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_same_table_is_found_in_every_layout(book, layout):
    path = book(Data=LAYOUTS[layout])
    table = read_excel(path)
    assert_the_record(table)
    assert table.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert table.units == (dict(zip(NAMES, UNITS, strict=True)) if "units" in layout else {})


def test_a_table_may_stand_anywhere_below_merged_titles(tmp_path):
    workbook = Workbook()
    sheet = workbook.active
    sheet["C2"] = "Bump test"
    sheet.merge_cells("C2:E2")
    for at, row in enumerate([NAMES, *ROWS]):
        for place, cell in enumerate(row):
            sheet.cell(4 + at, 3 + place, cell)
    workbook.save(tmp_path / "bump.xlsx")
    table = read_excel(tmp_path / "bump.xlsx")
    assert_the_record(table)
    assert table.place(0).endswith("bump.xlsx: row 5")


def test_a_column_without_a_name_is_called_by_its_number(book):
    table = read_excel(book(Data=[("", *NAMES, None), *((7.0, *row, "x") for row in ROWS)]))
    assert table.names == ("1", *NAMES, "5")
    assert table.numbers(["1"])["1"].tolist() == [7.0, 7.0, 7.0]


def test_units_stand_in_the_names_too(book):
    table = read_excel(book(Data=[("t/ms", "Ut [kV]", "If (A)"), *ROWS]))
    assert table.units == {"t/ms": "ms", "Ut [kV]": "kV", "If (A)": "A"}
    np.testing.assert_allclose(table.instants(table.clock), [0.0, 1e-4, 2e-4], rtol=1e-13)


def test_a_sheet_is_named_where_several_hold_a_table(book):
    path = book(up=[NAMES, *ROWS], down=[NAMES, *ROWS[:2]], notes=[("Remarks",)])
    refused(lambda: read_excel(path), "bump.xlsx", "'up', 'down'")
    assert_the_record(read_excel(path, "up"))
    assert read_excel(path, "down").place(1).endswith("bump.xlsx: sheet 'down', row 3")
    refused(lambda: read_excel(path, "left"), "bump.xlsx", "'left'", "'up', 'down', 'notes'")
    refused(lambda: read_excel(path, "notes"), "bump.xlsx", "no table", "'notes'")


def test_a_sheet_needs_no_name_where_only_one_holds_a_table(book):
    assert_the_record(
        read_excel(book(notes=[("Remarks",), ("none", "at all")], Data=[NAMES, *ROWS]))
    )


def instants(step=timedelta(milliseconds=5)):
    return [START + at * step for at in range(3)]


@pytest.mark.parametrize("blank", [None, "", " "])
def test_a_blank_cell_is_a_missing_sample_in_columns_of_every_kind(book, blank):
    rows = [[at, at.time(), float(k)] for k, at in enumerate(instants())]
    for column in range(3):
        rows[column][column] = blank
    table = read_excel(book(Data=[("Timestamp", "Time of day", "Ut"), *rows]))
    numbers = table.numbers(["Ut"], frozenset({"Ut"}))["Ut"]
    assert numbers.tolist() == pytest.approx([0.0, 1.0, np.nan], nan_ok=True)
    for row, name in enumerate(["Timestamp", "Time of day"]):
        refused(partial(table.instants, [name]), f"row {row + 2}", repr(name), "missing")


def test_timestamps_count_from_the_first(book):
    table = read_excel(book(Data=[("Timestamp", "Ut"), *((at, 1.0) for at in instants())]))
    np.testing.assert_allclose(table.instants(["Timestamp"]), [0, 0.005, 0.01], rtol=0, atol=1e-9)
    refused(lambda: table.numbers(["Timestamp"]), "'Timestamp'", "timestamps")
    refused(lambda: table.instants(["Timestamp"], "ms"), "'Timestamp'", "ms")


def test_date_and_time_stand_in_two_columns(book):
    rows = [(at.date(), at.time(), 1.0) for at in instants()]
    table = read_excel(book(Data=[("Date", "Time", "Ut"), *rows]))
    assert table.clock == ("Date", "Time")
    for columns in (["Date", "Time"], ["Time", "Date"], ["Time"]):
        np.testing.assert_allclose(table.instants(columns), [0, 0.005, 0.01], rtol=0, atol=1e-9)


def test_timestamps_are_the_time_also_behind_a_count(book):
    rows = [(at, instant, 1.0) for at, instant in enumerate(instants())]
    assert read_excel(book(Data=[("N", "When", "Ut"), *rows])).clock == ("When",)
    assert read_excel(book(Data=[("N", "Ut"), (1, 2.0), (2, 1.0)])).clock == ("N",)


def test_midnight_is_passed_where_the_date_says_so(book):
    rows = [(date(2015, 9, 20), time(23, 59, 59), 1.0), (date(2015, 9, 21), time(0, 0, 1), 1.0)]
    table = read_excel(book(Data=[("Date", "Time", "Ut"), *rows]))
    assert table.instants(table.clock).tolist() == [0.0, 2.0]


def test_two_columns_that_are_not_date_and_time_are_refused(book):
    rows = [(at.date(), at.date(), 1.0) for at in instants()]
    table = read_excel(book(Data=[("Date", "Time", "Ut"), *rows]))
    refused(lambda: table.instants(["Date", "Time"]), "'Date' and 'Time'", "time of day")


def with_cell(cell):
    return [*TITLES, NAMES, UNITS, ROWS[0], (0.1, cell, 701), ROWS[2]]


@pytest.mark.parametrize("cell", [None, "", "=1/0"], ids=str)
def test_a_blank_cell_is_a_missing_sample(book, cell):
    table = read_excel(book(Data=with_cell(cell)))
    vt = table.numbers(["Ut"], frozenset(["Ut"]))["Ut"]
    assert np.isnan(vt).tolist() == [False, True, False]
    refused(lambda: table.numbers(["Ut"]), "bump.xlsx: row 9: column 'Ut'", "missing")


@pytest.mark.parametrize("cell", ["15,8", "15.8", "over", datetime(2015, 9, 20)], ids=str)
def test_a_cell_that_is_no_number_is_refused_by_row_and_column(book, cell):
    table = read_excel(book(Data=with_cell(cell)))
    quoted = repr(cell) if isinstance(cell, str) else "2015-09-20"
    refused(
        lambda: table.numbers(["Ut"]), "bump.xlsx: row 9: column 'Ut'", quoted, "is not a number"
    )
    assert table.numbers(["If"])["If"].tolist() == [700, 701, 702]


def test_a_second_table_below_is_refused(book):
    table = read_excel(book(Data=[NAMES, *ROWS, (), NAMES, *ROWS]))
    refused(lambda: table.numbers(["Ut"]), "bump.xlsx: row 6: column 'Ut'", "'Ut'")


NO_TABLE = {
    "nothing": [],
    "names alone": [NAMES],
    "numbers alone": ROWS,
    "texts alone": [NAMES, ("a", "b", "c")],
    "one column": [("t",), (0.0,), (0.1,)],
    "numbers as text": [NAMES, *[[str(cell) for cell in row] for row in ROWS]],
}


@pytest.mark.parametrize("rows", NO_TABLE)
def test_a_workbook_without_a_table_is_refused(book, rows):
    refused(lambda: read_excel(book(Data=NO_TABLE[rows])), "bump.xlsx", "no table")


def test_a_file_of_another_kind_is_refused(tmp_path):
    path = tmp_path / "bump.xlsx"
    for content in (b"", b"t,vt\n0,1\n", b"PK\x03\x04" + bytes(40)):
        path.write_bytes(content)
        refused(lambda: read_excel(path), "bump.xlsx", "damaged")
    refused(lambda: read_excel(tmp_path / "none.xlsx"), "none.xlsx", "No such file")


def test_a_workbook_that_is_cut_off_is_refused(book):
    path = book(Data=[NAMES, *ROWS])
    path.write_bytes(path.read_bytes()[:-30])
    refused(lambda: read_excel(path), "bump.xlsx", "damaged")


def test_the_missing_package_is_named_with_its_extra(book, monkeypatch):
    path = book(Data=[NAMES, *ROWS])
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    refused(lambda: read_excel(path), "bump.xlsx", 'pip install "exfit[excel]"')


@pytest.mark.long
@pytest.mark.parametrize("inside", [False, True], ids=["file", "sheet"])
@given(damage())
@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_whatever_is_damaged_only_record_errors_come_out(book, inside, apply):
    path = book(Data=[("Date", "Time", "Ut"), *((at.date(), at.time(), 1.0) for at in instants())])
    if not inside:
        path.write_bytes(apply(path.read_bytes()))
    else:
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        members["xl/worksheets/sheet1.xml"] = apply(members["xl/worksheets/sheet1.xml"])
        with zipfile.ZipFile(path, "w") as archive:
            for name, content in members.items():
                archive.writestr(name, content)
    with suppress(RecordError):
        everything(open_table(path))
