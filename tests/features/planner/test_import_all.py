"""import --all: a case for every unit of a planner's file, with its records where there are any."""

import csv
import shutil
from pathlib import Path

import pytest
import yaml
from dynamics import SOUND, THREE, replaced
from places import ROOT
from records import workbook_of
from tiers import few_of

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.features.planner import psse

SAMPLES = ROOT / "sample_data"
CASES = ["bus-1-1.yaml", "bus-1-2.yaml", "bus-9-1.yaml"]


@pytest.fixture(autouse=True)
def workplace(empty_folder):
    """Work in a folder with a file of three units, a classical machine, and a load."""
    Path("units.dyr").write_text(THREE + "7 GENCLS 1 3 0 /\n8 IEELBL 1 1 0 /\n")
    Path("records").mkdir()
    return empty_folder


def units_of(folder="cases"):
    """Return the rows of the table of units by bus and id."""
    with (Path(folder) / "units.csv").open(newline="") as file:
        return {f"{row['bus']} {row['id']}": row for row in csv.DictReader(file)}


def record(name, sample="ac1a_up"):
    """Put a sample record under a name among the records."""
    path = Path("records", name)
    path.parent.mkdir(exist_ok=True)
    shutil.copy(SAMPLES / f"{sample}.csv", path)


def test_every_unit_becomes_the_case_that_it_becomes_alone(run):
    ran = run("import", "--all", "units.dyr", "-o", "cases")
    assert ran.code == 0
    assert ran.out == "written to cases; cases: 3, with records: 0; all units: units.csv\n"
    assert "not imported: 1 GENCLS without an exciter" in ran.err
    assert sorted(path.name for path in Path("cases").iterdir()) == [*CASES, "units.csv"]
    for name in CASES:
        _, bus, machine_id = name.removesuffix(".yaml").split("-")
        alone = Path("cases", "alone.yaml")
        run("import", "units.dyr", "--bus", bus, "--id", machine_id, "-o", alone, "--force")
        assert Path("cases", name).read_text() == alone.read_text()
    rows = units_of()
    assert [row["status"] for row in rows.values()] == ["written"] * 3
    assert "left out, no model of exfit (other devices): IEELBL (1)" in ran.err
    assert (rows["1 2"]["machine"], rows["1 2"]["case"]) == ("GENROU", "bus-1-2.yaml")


def test_a_machine_without_an_exciter_is_a_case_at_constant_field_voltage(run):
    Path("alone.dyr").write_text(
        THREE + "88 GENROU 1 6 .03 .5 .08 6.4 0 .9 .86 .12 .2 .09 .05 0 0 /\n88 'IEEEG9' 1 0 /\n"
        "99 GENROU 1 6 .03 .5 .08 6.4 0 .9 .86 .12 .2 .09 .05 0 0 /\n"
        "99 'TGOV1' 1 .05 .4 1.2 0 2 8 0 /\n99 'IEEEVC' 1 0 .05 /\n"
    )
    ran = run("import", "--all", "alone.dyr", "-o", "cases")
    rows = units_of()
    assert (ran.code, rows["88 1"]["status"]) == (1, "refused")  # IEEEG9 may be its exciter
    of_machine = [rows["99 1"][column] for column in ("machine", "exciter", "status", "case")]
    assert of_machine == ["GENROU", "", "written", "bus-99-1.yaml"]
    ran = run("import", "alone.dyr", "--bus", "99", "-o", "cases/alone.yaml")
    left_out = "is left out: without an exciter the machine is alone on load"
    assert all(f"{name} {left_out}" in ran.err for name in ("TGOV1", "IEEEVC"))
    assert Path("cases", "bus-99-1.yaml").read_text() == Path("cases", "alone.yaml").read_text()
    assert run("simulate", "cases/alone.yaml", "-o", "simulated").code == 0


def test_a_unit_with_a_fault_is_named_and_the_others_are_written(run):
    faulty = replaced("9 GENROU 1 6.0", "9 GENROU 1 x", THREE)
    Path("units.dyr").write_text(faulty + "/ a comment\n9 'IEEEG1' 1 0 0 / \n")
    ran = run("import", "--all", "units.dyr", "-o", "cases")
    assert ran.code == 1
    assert "Error: bus 9, machine 1: line 9: GENROU: Tpd0: 'x' is not a number" in ran.err
    assert sorted(path.name for path in Path("cases").glob("*.yaml")) == CASES[:2]
    assert units_of()["9 1"]["status"] == "refused"


def test_files_that_exist_are_kept_unless_forced(run):
    Path("cases").mkdir()
    Path("cases", CASES[0]).write_text("mine")
    ran = run("import", "--all", "units.dyr", "-o", "cases")
    assert ran.code == 1
    assert f"cases/{CASES[0]}\n       exist already; --force writes over them" in ran.err
    assert [path.name for path in Path("cases").iterdir()] == CASES[:1]
    assert run("import", "--all", "units.dyr", "-o", "cases", "--force").code == 0
    assert Path("cases", CASES[0]).read_text() != "mine"


def test_records_are_joined_by_bus_and_id_and_others_are_named(run):
    record("1_1.csv")
    record("9/up.csv")
    record("9/down.csv", "ac1a_down")
    record("1.csv")
    record("other.csv")
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records",
              "--step", "0.05")  # fmt: skip
    assert ran.code == 1
    assert "cases: 3, with records: 2" in ran.out
    assert "records/1.csv: bus 1: 2 machines, 1, 2; which one is not said" in ran.err
    assert "no unit for records/other.csv" in ran.err
    both = load_case(Path("cases", CASES[2]))
    assert [each.test.vref[0].step for each in (*both.recordings, *both.validations)] == [
        -0.05,
        0.05,
    ]
    assert both.as_found.bus == 9
    assert load_case(Path("cases", CASES[0])).recordings[0].record.file == "../records/1_1.csv"
    assert load_case(Path("cases", CASES[1])).recordings == ()
    assert [row["status"] for row in units_of().values()] == [
        "written with records", "written", "written with records"
    ]  # fmt: skip


def test_a_case_with_records_is_the_one_that_new_makes(run):
    record("1_1.csv")
    run("import", "--all", "units.dyr", "-o", "cases", "--records", "records", "--step", "0.05")
    run("new", "--dyr", "units.dyr", "--bus", "1", "--id", "1", "--step", "0.05", "--record",
        "records/1_1.csv", "-o", "cases/new.yaml")  # fmt: skip
    assert Path("cases", CASES[0]).read_text() == Path("cases", "new.yaml").read_text()


@pytest.mark.parametrize("in_table", few_of([True, False], 1))
def test_the_sheet_of_a_workbook_is_in_the_case(run, in_table):
    workbook_of(SAMPLES / "ac1a_up.csv", Path("records", "1_1.xlsx"), ("a", "b"))
    Path("records", "table.csv").write_text("bus,id,file,step,sheet\n1,1,1_1.xlsx,0.05,b\n")
    options = ("records/table.csv",) if in_table else ("records", "--step", "0.05", "--sheet", "b")
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", *options)
    assert ran.code == 0, ran.err
    assert load_case(Path("cases", CASES[0])).recordings[0].record.sheet == "b"


def test_a_size_that_no_record_has_a_test_for_is_refused(run):
    record("1_1.csv")
    record("9/down.csv", "ac1a_down")
    sizes = ("--step", "up=0.05", "--step", "down=0.05")
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records", *sizes)
    assert ran.code == 0, ran.err
    assert load_case(Path("cases", CASES[2])).recordings[0].test.vref[0].step == -0.05
    ran = run("import", "--all", "units.dyr", "-o", "more", "--records", "records",
              "--step", "pulse=0.05")  # fmt: skip
    assert ran.code == 1
    assert "--step pulse=0.05: no test of that name in any record" in ran.err
    assert not Path("more").exists()


def test_what_the_record_does_not_show_is_to_be_filled_in(run):
    record("1_1.csv")
    run("import", "--all", "units.dyr", "-o", "cases", "--records", "records")
    with pytest.raises(CaseError, match=r"test.vref\[0\].step: '\?' is to be filled in"):
        load_case(Path("cases", CASES[0]))


def test_a_record_that_cannot_be_read_refuses_its_unit_alone(run):
    record("1_1.csv")
    Path("records", "9_1.csv").write_text("no record")
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records")
    assert ran.code == 1
    assert "bus 9, machine 1: records/9_1.csv" in ran.err
    assert sorted(path.name for path in Path("cases").glob("*.yaml")) == CASES[:2]


def test_a_table_says_which_record_belongs_to_which_unit(run):
    record("a.csv")
    record("b.csv", "ac1a_down")
    Path("records", "table.csv").write_text(
        "bus,id,file,step,name,about.Plant\n"
        "1,2,a.csv,0.05,,East\n9,,b.csv,0.05,nine,\n9,,a.csv,0.05,,\n"
    )
    # the last two rows are one unit: the second has no name of its own
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records/table.csv")
    assert ran.code == 1
    assert "bus 9, machine 1: also in records/table.csv:3" in ran.err
    text = Path("records", "table.csv").read_text().replace("nine", "")
    Path("records", "table.csv").write_text(text)
    ran = run("import", "--all", "units.dyr", "-o", "more", "--records", "records/table.csv")
    assert ran.code == 0, ran.err
    first = yaml.safe_load(Path("more", CASES[1]).read_text())
    assert (first["about"], first["test"]["vref"][0]["step"]) == ({"Plant": "East"}, 0.05)
    both = load_case(Path("more", "bus-9.yaml"))
    assert [len(both.recordings), len(both.validations)] == [1, 1]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--all",), "Missing option '-o'"),
        (("--all", "-o", "x", "--bus", "1"), "--bus and --id: not allowed with --all"),
        (("--all", "-o", "x", "--step", "0.05"), "only with --records"),
        (("--records", "records"), "only with --all"),
        (("--step", "0.05"), "only with --all"),
        (("--all", "-o", "x", "--records", "units.dyr", "--step", "1"), "not allowed with a table"),
    ],
)
def test_options_that_contradict_each_other_are_refused(run, options, says):
    ran = run("import", "units.dyr", *options)
    assert ran.code == 2
    assert says in " ".join(ran.err.split())


def test_two_hundred_units_take_one_reading_of_their_file(run, monkeypatch):
    text = "".join(
        SOUND.replace("1 GENROU", f"{bus} GENROU").replace("1 ESAC1A", f"{bus} ESAC1A")
        for bus in range(101, 301)
    )
    Path("many.dyr").write_text(text)
    read, lines = psse.read_line, list[int]()
    monkeypatch.setattr(
        psse,
        "read_line",
        lambda line, number, *more: (lines.append(number), read(line, number, *more))[1],
    )
    assert run("import", "--all", "many.dyr", "-o", "many").code == 0
    assert len(lines) == len({*lines}) == len(text.split("\n"))
    assert len([*Path("many").glob("*.yaml")]) == 200


def test_a_base_of_a_channel_in_per_unit_makes_a_case_that_can_be_loaded(run):
    record("1_1.csv")
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records",
              "--step", "0.05", "--base", "efd=1.25")  # fmt: skip
    assert ran.code == 0, ran.err
    channels = load_case(Path("cases", CASES[0])).recordings[0].record.channels
    assert (channels["efd"].unit, channels["efd"].base) == ("pu", 1.25)
