"""batch on a table of records: its rows become cases, and rows of the table of the batch."""

import shutil
from pathlib import Path

import pytest
from dynamics import THREE
from places import ROOT

from exfit.case.load import load_case
from exfit.features.fleet import batch as batches
from exfit.features.fleet.batch import batch
from exfit.features.fleet.folder import read_fleet
from exfit.features.planner.import_all import cases_of_table

TABLE = """\
file,dyr,bus,id,step,about.Plant
records/up.csv,units.dyr,1,1,0.05,East
records/down.csv,units.dyr,1,1,0.05,
records/up.csv,units.dyr,9,,,
records/none.csv,units.dyr,1,2,0.05,
records/up.csv,units.dyr,8,1,0.05,
"""


@pytest.fixture(autouse=True)
def workplace(empty_folder):
    """Work in a folder with a file of three units, two records, and a table of them."""
    Path("units.dyr").write_text(THREE)
    Path("records").mkdir()
    for name in ("up", "down"):
        shutil.copy(ROOT / "sample_data" / f"ac1a_{name}.csv", Path("records", f"{name}.csv"))
    Path("table.csv").write_text(TABLE)
    return empty_folder


def without_fits(cases, begin, _):
    """Begin every case, and leave it there."""
    for case in cases:
        begin(case)


def rows_of(table="table.csv", **options):
    """Return the rows of a batch that makes the cases of a table and fits none, by their names."""
    made = cases_of_table(table, "fleet")
    fleet = batch([], "fleet", made=made, compute=without_fits, **options)
    return {row.name: row for row in fleet.cases}


@pytest.mark.long
def test_rows_of_a_unit_become_one_case_as_new_makes_it(run):
    rows = rows_of()
    case = load_case(Path("fleet", "cases", "bus-1-1.yaml"))
    assert [each.record.file for each in (*case.recordings, *case.validations)] == [
        "../../records/up.csv",
        "../../records/down.csv",
    ]
    assert dict(case.about) == {"Plant": "East"}
    assert (rows["bus-1-1"].status, rows["bus-1-1"].bus) == ("not run", 1)
    Path("tests.csv").write_text("file,step\nrecords/up.csv,0.05\nrecords/down.csv,0.05\n")
    run("new", "--dyr", "units.dyr", "--bus", "1", "--id", "1", "--tests", "tests.csv",
        "--about", "Plant=East", "-o", "fleet/cases/new.yaml")  # fmt: skip
    made = Path("fleet", "cases", "bus-1-1.yaml").read_text()
    assert made == Path("fleet", "cases", "new.yaml").read_text()


def test_what_cannot_be_made_is_a_row_with_its_reason_and_the_others_go_on():
    rows = rows_of()
    refused = {name: row.reason for name, row in rows.items() if row.status == "refused"}
    assert refused.keys() == {"bus-9", "bus-1-2", "bus-8-1"}
    assert "table.csv:4: missing in the table ('?' in fleet/cases/bus-9.yaml): " in refused["bus-9"]
    assert "test.vref[0].step (line " in refused["bus-9"]
    assert "records/none.csv: cannot be read" in refused["bus-1-2"]
    assert refused["bus-8-1"] == "table.csv:6: units.dyr: bus 8: no such unit can be imported"


@pytest.mark.long
def test_a_case_that_someone_has_edited_is_kept_and_its_row_says_so():
    rows_of()
    edited = Path("fleet", "cases", "bus-1-1.yaml")
    edited.write_text(edited.read_text() + "# mine\n")
    row = rows_of()["bus-1-1"]
    assert row.status == "refused"
    assert "exists with other content than the table makes" in row.reason
    assert edited.read_text().endswith("# mine\n")


def test_the_parts_of_a_table_make_each_case_once():
    made = []
    for part in (1, 2, 3):
        shutil.rmtree(Path("fleet"), ignore_errors=True)
        rows_of(part=(part, 3))
        made += [path.name for path in Path("fleet", "cases").glob("*.yaml")]
    assert sorted(made) == ["bus-1-1.yaml", "bus-9.yaml"]


def test_a_table_with_faults_makes_nothing(run):
    Path("table.csv").write_text("file,model,step\na.csv,,x\nb.csv,AC1A,y\n")
    ran = run("batch", "table.csv", "-o", "fleet")
    assert ran.code == 1
    assert "table.csv:2: step: 'x' is not a number" in ran.err
    assert "table.csv:2: model: missing" in ran.err
    assert "table.csv:3: step: 'y' is not a number" in ran.err
    assert not Path("fleet").exists()


def test_the_command_takes_tables_beside_cases(run, monkeypatch):
    monkeypatch.setattr(batches, "local_workers", lambda *_: without_fits)
    run("import", "units.dyr", "--bus", "1", "--id", "2", "-o", "cases/own.yaml")
    Path("table.csv").write_text("\n".join(TABLE.splitlines()[:3]))
    ran = run("batch", "table.csv", "cases", "-o", "fleet", "--quiet")
    assert ran.code == 1, ran.err
    rows = {row.name: row.status for row in read_fleet("fleet").cases}
    assert rows == {"bus-1-1": "not run", "own": "no record"}


def test_a_case_with_open_values_is_refused_with_their_places(run):
    run("new", "--dyr", "units.dyr", "--bus", "9", "--record", "records/up.csv", "-o", "up.yaml")
    fleet = batch(["up.yaml"], "fleet", compute=without_fits)
    assert [(row.status, row.reason) for row in fleet.cases] == [
        ("refused", "up.yaml: to be filled in: test.vref[0].step")
    ]
