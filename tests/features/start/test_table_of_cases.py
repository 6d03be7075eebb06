"""A table of records from which cases are made: rows of one unit are one case; faults by place."""

from pathlib import Path

import pytest

from exfit.errors import ExfitError
from exfit.features.start.tables import case_name_of, read_case_table


def planned(folder, text, dyr=None, name="table.csv"):
    path = folder / name
    path.write_text(text)
    return read_case_table(path, dyr)


def faults_of(folder, text, dyr=None):
    with pytest.raises(ExfitError) as caught:
        planned(folder, text, dyr)
    return [fault.removeprefix(f"{folder}/") for fault in str(caught.value).splitlines()]


def test_rows_of_one_unit_are_one_case(tmp_path):
    cases = planned(
        tmp_path,
        "file,dyr,bus,id,at,step,base,unit,about.Plant,validates\n"
        "a.csv,u.dyr,101,1,30,0.05,15.75,kV,East,\n"
        "b.csv,u.dyr,102,1,,,,,,\n"
        "a.csv,u.dyr,101,1,60,-0.05,,,,yes\n",
    )
    first, second = cases
    assert (first.name, first.bus, first.machine_id) == ("bus-101-1", 101, "1")
    assert first.dyr == tmp_path / "u.dyr"
    assert [(row.at, row.step, row.validates) for row in first.tests] == [
        (30.0, 0.05, False),
        (60.0, -0.05, True),
    ]
    assert [(row.base.value, row.base.unit) for row in first.tests if row.base] == [(15.75, "kV")]
    assert dict(first.about) == {"Plant": "East"}
    assert first.settings.keys() == {tmp_path / "a.csv"}
    assert (second.name, second.tests[0].file) == ("bus-102-1", tmp_path / "b.csv")


def test_names_join_rows_and_records_name_cases(tmp_path):
    cases = planned(
        tmp_path,
        "name;file;model;time;time unit;sheet;vt;f0;X\n"
        'north;a.csv;AC1A;"date;time";ms;S1;U;50;0.2\n'
        "North;b.csv;;;;;;;\n;my unit.csv;ST1A;;;;;;\n",
    )
    north, own = cases
    assert (north.name, len(north.tests), own.name) == ("north", 2, "my-unit")
    settings = north.settings[tmp_path / "a.csv"]
    assert (settings.clock, settings.unit) == (("date", "time"), "ms")
    assert (settings.sheet, settings.voltage) == ("S1", "U")
    assert dict(north.network) == {"f0": 50.0, "X": 0.2}
    assert (north.model, own.model, own.machine) == ("AC1A", "ST1A", None)


def test_a_workbook_is_read_like_the_same_table_as_text(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    rows = [("file", "model", "at", "step", "validates"), ("a.csv", "AC1A", 30, 0.05, False)]
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.save(tmp_path / "table.xlsx")
    text = "\n".join(",".join(map(str, row)) for row in rows).replace("False", "no")
    (case,) = read_case_table(tmp_path / "table.xlsx")
    (same,) = planned(tmp_path, text)
    assert case.tests[0]._replace(place="") == same.tests[0]._replace(place="")
    assert case.place == f"{tmp_path / 'table.xlsx'}:2"


def test_all_faults_are_reported_at_once_with_row_and_column(tmp_path):
    assert faults_of(
        tmp_path,
        "file,dyr,bus,id,model,machine,step,base,unit,validates,time unit,at\n"
        ",u.dyr,1000000,123,,,x,y,,maybe,h,inf\n"
        "a.csv,,5,,,,,,kV,,,\n"
        "b.csv,u.dyr,7,1,,GENROU,,15kV,kV,,,\n",
    ) == [
        "table.csv:2: bus: '1000000' is not a whole number of 1 ... 999999",
        "table.csv:2: id: '123' has more than 2 letters or digits",
        "table.csv:2: base: 'y' is not a positive number with a unit, as 15.75kV",
        "table.csv:2: validates: 'maybe' is neither yes nor no",
        "table.csv:2: at: 'inf' is not a finite number",
        "table.csv:2: step: 'x' is not a number",
        "table.csv:2: file: missing",
        "table.csv:3: model: missing, and no dyr is given",
        "table.csv:3: bus: 5: only with dyr, in which it is looked for",
        "table.csv:3: unit: kV: it is that of base, which is missing",
        "table.csv:4: machine: GENROU: not allowed with dyr, which has its own",
        "table.csv:4: unit: kV: not allowed beside a base with its own, kV",
    ]


@pytest.mark.parametrize("column", ["step", "bus", "id", "validates", "unit", "time unit"])
def test_a_message_quotes_the_beginning_of_a_cell(tmp_path, column):
    text = f"file,dyr,base,{column}\na.csv,u.dyr,1,{'0' * 5000}x\n"
    assert max(map(len, faults_of(tmp_path, text))) < 200


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("file,modell\na,AC1A\n", "table.csv:1: column modell; did you mean model?"),
        ("file,file\na,b\n", "table.csv:1: column file: given twice"),
        ("file,model\na,AC1A,3\n", "table.csv:2: more cells than columns: 3, 2"),
        ("file,model\n", "no row below the names of the columns"),
        ("", "the file is empty; columns: file, at, "),
        ("file,model,name\na,AC1A,a/b\n", "table.csv:2: name: 'a/b' must begin with a letter"),
        (
            "file,model,name\na,AC1A,x\nb,ST1A,X\n",
            "table.csv:3: model: ST1A, but AC1A in a row of the same unit",
        ),
        (
            "file,model\na.csv,AC1A\nb/a.csv,ST1A\n",
            "table.csv:3: name: a: also that of another unit, at ",
        ),
        (
            "file,dyr,bus,id\na,u,5,1\nb,u,5,\n",
            "table.csv:3: id: missing, but given in another row of bus 5",
        ),
    ],
)
def test_a_table_that_contradicts_itself_is_refused_by_its_place(tmp_path, text, fault):
    assert fault in "\n".join(faults_of(tmp_path, text))


def test_with_a_planner_s_file_every_row_is_of_one_of_its_units(tmp_path):
    (case,) = planned(tmp_path, "file,bus\na.csv,101\n", Path("u.dyr"))
    assert (case.dyr, case.bus, case.machine_id) == (Path("u.dyr"), 101, None)
    faults = faults_of(tmp_path, "file,bus,model,dyr\na.csv,,ST1A,v.dyr\n", Path("u.dyr"))
    assert [fault.split(": ")[1] for fault in faults] == ["dyr", "model", "bus"]


def test_every_machine_id_makes_a_name_of_its_own():
    ids = [chr(code) for code in range(33, 127)]
    names = {case_name_of(101, machine_id).casefold() for machine_id in ids}
    assert len(names) == len({machine_id.upper() for machine_id in ids})
    assert all(name.replace("-", "").isalnum() for name in names)
