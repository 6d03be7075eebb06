"""new with several tests, sizes, bases, a table, a planner's file: a case without an editor."""

from pathlib import Path

import pytest
import yaml
from places import CONFIGS, SAMPLES
from programme_files import BUS, programme_file
from records import workbook_of
from stepped_record import stepped_record
from tiers import few_of
from truths import holds

from exfit.case.load import load_case
from exfit.case.stated_values import taken_apart
from exfit.models import MODELS


@pytest.fixture
def record(empty_folder):
    """Write a record of four tests in kV; return its path."""
    return stepped_record(empty_folder / "record.csv")


@pytest.fixture
def new(run):
    """Return a function that makes a case and returns what was printed, and the case's content."""

    def command(*options, model="AC1A"):
        which = ("--model", model) if model else ()
        ran = run("new", *which, *options, "-o", "case.yaml", "--force")
        assert ran.code == 0, ran.err
        return ran, yaml.safe_load(Path("case.yaml").read_text(encoding="utf-8"))

    return command


def sizes_of(content):
    """Return the sizes of the steps by the name of their record."""
    entries = [*content["records"], *content.get("validate", ())]
    return {entry["name"]: entry["test"]["vref"][0]["step"] for entry in entries}


def test_alternate_tests_are_fitted_and_validate(record, new):
    _, content = new("--record", record, "--base", "vt=15.75kV", "--step", "5%-at-30s=0.05",
                     "--step", "0.02", "--step", "5%-at-60s=0.05")  # fmt: skip
    assert [entry["name"] for entry in content["records"]] == ["up-5%-at-30s", "down-2%-at-90s"]
    assert [entry["name"] for entry in content["validate"]] == ["down-5%-at-60s", "up-2%-at-120s"]
    assert [*sizes_of(content).values()] == [0.05, -0.02, -0.05, 0.02]
    case = load_case(record.parent / "case.yaml")
    assert [each.record.channels["vt"].base for each in case.recordings] == [15.75, 15.75]
    assert case.validations[0].record.window[1] <= case.recordings[1].record.window[0]


def test_a_size_for_all_that_one_test_contradicts_is_refused_with_the_remedy(record, run):
    ran = run("new", "--model", "AC1A", "--record", record, "--step", "0.05")
    assert ran.code == 1
    assert "vt changes by -2 % at " in ran.err
    assert "give the size of that test, as --step at-90s=" in ran.err


@pytest.mark.parametrize(
    ("size", "says"),
    few_of(
        [
            ("up=-0.05", "vt rises there"),
            ("5", "too large for a test"),
            ("0", "0 is no step"),
            ("sideways=0.05", "no test of that name; the record's tests: up-5%-at-30s"),
            ("up=five", "not of the form 0.05 or up=0.05"),
        ],
        2,
    ),
)
def test_a_size_that_cannot_be_is_refused(record, run, size, says):
    ran = run("new", "--model", "AC1A", "--record", record, "--step", size)
    assert ran.code == 1
    assert says in ran.err


def test_a_size_of_a_step_that_a_record_does_not_show_is_refused_with_the_remedy(empty_folder, run):
    (empty_folder / "flat.csv").write_text("t,vt\n" + "".join(f"{k},1.0\n" for k in range(20)))
    ran = run("new", "--model", "AC1A", "--record", "flat.csv", "--step", "0.05")
    assert ran.code == 1
    assert ran.err.startswith("Error: flat.csv: --step: it shows no step; --tests gives a table")
    assert "vt in --answers names it" in ran.err


@pytest.mark.parametrize(
    ("base", "value"), [("vt=15.75kV", 15.75), ("vt=15750 V", 15.75), ("vt=15.75", 15.75)]
)
def test_a_base_is_written_in_the_unit_of_its_channel(record, new, base, value):
    _, content = new("--record", record, "--base", base)
    assert content["records"][0]["record"]["channels"]["vt"]["base"] == value


@pytest.mark.parametrize(
    ("base", "says"),
    [
        ("vt=15.75kA", "Ugen (kV) is in kV"),
        ("vt=-3kV", "not a positive number with a unit"),
        ("vt=1e308kV", "1e+308 exceeds 1e+100"),
        ("ut=15.75kV", "not a signal and its base"),
        ("15.75kV", "give it as vt=15.75kV"),
    ],
)
def test_a_base_that_cannot_be_is_refused(record, run, base, says):
    ran = run("new", "--model", "AC1A", "--record", record, "--base", base)
    assert ran.code == 1
    assert says in ran.err


def test_a_base_far_from_the_voltage_at_rest_is_warned_of(record, new):
    ran, _ = new("--record", record, "--base", "vt=18kV")
    assert "Ugen (kV) rests at 0.875 times its base: is 18 the rated voltage" in ran.err
    assert new("--record", record, "--base", "vt=15kV")[0].err == ""


def test_how_the_record_is_read_is_in_the_case_too(empty_folder, new):
    file = workbook_of(SAMPLES / "ac1a_up.csv", empty_folder / "two.xlsx", ("1", "2"), "lap", 1e3)
    new("--record", file, "--step", "0.05", "--sheet", "2", "--time", "lap", "--time-unit", "ms",
        "--memory", "0.5")  # fmt: skip
    given = load_case(empty_folder / "case.yaml").recordings[0].record
    assert (given.sheet, given.time.column, given.time.unit) == ("2", "lap", "ms")
    assert given.memory == 0.5


def test_what_is_open_is_named_once_with_its_line(record, new, run):
    ran, _ = new("--record", record, "--step", "up=0.05", "--step", "at-120s=0.02")
    lines = (record.parent / "case.yaml").read_text(encoding="utf-8").splitlines()
    named = [line for line in ran.out.splitlines() if line.startswith("to be filled in")]
    refused = run("check", "case.yaml")
    assert refused.code == 1
    places = [text for text in refused.err.splitlines() if "is to be filled in" in text]
    assert len(named) == len(places) == sum('"?"' in line for line in lines) == 3
    for text in places:
        number = int(text.partition("case.yaml:")[2].partition(":")[0])
        assert '"?"' in lines[number - 1]


def test_a_table_names_tests_of_several_files(record, new):
    stepped_record(record.parent / "other.csv", base=13.8)
    rows = ["file,at,step,base,validates", "record.csv,31,0.05,15.75kV,no",
            "other.csv,60,0.05,13.8kV,no", "other.csv,90,0.021,13.8kV,yes"]  # fmt: skip
    (record.parent / "tests.csv").write_text("\n".join(rows) + "\n")
    _, content = new("--tests", "tests.csv")
    assert sizes_of(content) == {
        "up-5%-at-30s": 0.05, "down-5%-at-60s": -0.05, "down-2.1%-at-90s": -0.021
    }  # fmt: skip
    bases = [entry["record"]["channels"]["vt"]["base"] for entry in content["records"]]
    assert bases == [15.75, 13.8]
    assert content["validate"][0]["record"]["channels"] == {
        "vt": {"column": "Ugen (kV)", "unit": "kV", "base": 13.8}
    }


@pytest.mark.parametrize(
    ("table", "says"),
    few_of(
        [
            ("at,step\n75,0.05\n", "tests.csv:2: at: no step within 5 s of 75 s"),
            ("step\n0.05\n", "tests.csv:2: at: missing"),
            ("at,size\n30,0.05\n", "tests.csv:1: column size"),
            ("at,step\n30,five\n60,x\n", "tests.csv:3: step: 'x' is not a number"),
            ("at,validates\n30,perhaps\n", "neither yes nor no"),
            ("at,validates\n30,yes\n", "at least one must be fitted"),
            ("at,step\n", "no row below"),
        ],
        3,
    ),
)
def test_a_table_that_cannot_be_used_is_refused_by_its_line(record, run, table, says):
    (record.parent / "tests.csv").write_text(table)
    ran = run("new", "--model", "AC1A", "--record", record, "--tests", "tests.csv")
    assert ran.code == 1
    assert says in ran.err


def test_the_data_of_a_planners_file_are_starts_and_fixed_values(record, new):
    _, content = new("--record", record, "--dyr", SAMPLES / "unit.dyr", "--bus", "101", model="")
    assert content["model"] == "AC1A"
    assert content["parameters"]["free"]["KA"]["start"] == 766.0
    assert content["plant"]["parameters"]["Xd"] == {"value": 1.8, "source": "planner"}
    assert content["as_found"]["source"] == "unit.dyr, bus 101, machine 1"
    assert content["as_found"]["parameters"]["KA"] == 766.0
    assert (content["as_found"]["bus"], content["as_found"]["id"]) == (101, "1")
    assert (record.parent / content["as_found"]["file"]).samefile(SAMPLES / "unit.dyr")
    _, other = new("--record", record, "--dyr", SAMPLES / "unit.dyr", model="SEXS")
    assert other["model"] == "SEXS"
    assert other["as_found"]["model"] == "AC1A"
    assert other["plant"]["parameters"]["Xd"] == {"value": 1.8, "source": "planner"}
    assert other["parameters"]["free"]["K"]["start"] == 200.0


def test_the_machine_of_another_case_comes_with_its_sources(record, new):
    _, content = new("--record", record, "--machine-from", CONFIGS / "ac8b_unit1.yaml")
    expected = load_case(CONFIGS / "ac8b_unit1.yaml")
    values, sources = expected.values(), expected.sources()
    plant = taken_apart(content).content["plant"]
    for symbol, value in plant["parameters"].items():
        assert value == values[f"machine.{symbol}"]
        assert plant["sources"].get(symbol, "not stated") == sources[f"machine.{symbol}"]


def test_facts_come_into_the_case(record, new):
    _, content = new("--record", record, "--about", "Unit=3", "--about", "Tested by=A. Test")
    assert content["about"] == {"Unit": "3", "Tested by": "A. Test"}


def test_facts_that_mean_something_in_yaml_stay_text(record, new):
    facts = {"Plant": "...", "...": "a", "Unit": "--- b", "true": "no", "#": "x: y"}
    options = [option for fact in facts.items() for option in ("--about", "=".join(fact))]
    assert new("--record", record, *options)[1]["about"] == facts


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), "'--record', or '--tests'"),
        (("--record", "record.csv", "--bus", "101"), "only with --dyr"),
        (("--tests", "t.csv", "--step", "0.05"), "not allowed with --tests"),
        (("--record", "record.csv", "--machine-from", "a.yaml", "--machine", "GENSAL"),
         "not allowed with --dyr"),
    ],
)  # fmt: skip
def test_options_that_contradict_each_other_are_refused(record, run, options, says):
    ran = run("new", "--model", "AC1A", *options)
    assert ran.code == 2
    assert says in " ".join(ran.err.split())


@pytest.mark.long
@pytest.mark.parametrize("number", [2, 3])
def test_three_commands_lead_from_a_long_file_to_a_report(empty_folder, run, number):
    """With no edit but the base: the intervals hold the truth, but for one that chance leaves."""
    made = programme_file(number, empty_folder)
    ran = run("new", "--record", made.record, "--tests", made.table, "--dyr", made.dyr,
              "--bus", BUS, "--base", f"vt={made.base}kV", "-o", "unit.yaml")  # fmt: skip
    assert ran.code == 0, ran.err
    ran = run("fit", "unit.yaml", "--no-plots", "--json")
    assert ran.code == 0, ran.err
    assert run("report", "runs/unit-fit", "--no-plots").code in (0, 2)
    parameters = yaml.safe_load(ran.out)["parameters"]
    missed = [
        symbol
        for symbol, truth in made.truth.items()
        if symbol in parameters and parameters[symbol]["interval"]
        and not holds(parameters[symbol]["interval"], truth)
    ]  # fmt: skip
    assert len(missed) <= 1
    assert MODELS[made.model].name == made.model
