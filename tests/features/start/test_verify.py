"""verify: one command from a recorder's file to the report; answers from a file, in scripts too."""

import json
import signal
import sys
from contextlib import suppress
from shutil import copy

import pytest
import yaml
from places import SAMPLES
from tiers import few_of
from two_buses import MACHINE_RECORD, reference

import exfit
from exfit import workflows
from exfit.case.load import load_case
from exfit.errors import ExfitError
from exfit.features.start.answers import Answers
from exfit.output import run_folder

ANSWERS = SAMPLES / "field_answers.yaml"
TRUTH = {
    "KA": 364.2, "TA": 0.0542, "TE": 1.672, "KF": 0.0413, "TF": 1.458, "KC": 0.486, "KD": 0.404
}  # fmt: skip


@pytest.fixture
def locally(monkeypatch):
    """Fit from the start of the case alone: what is tested is around the fit."""
    fit = workflows.fit

    def local(case, strategy, *callbacks, search=None):
        return fit(case, strategy, *callbacks, search="local")

    monkeypatch.setattr(workflows, "fit", local)


def result_in(folder):
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))


@pytest.mark.long
def test_one_command_leads_from_a_record_to_a_report_whose_intervals_hold_the_truth(
    empty_folder, run
):
    """No file is edited, and each value is given once."""
    ran = run("verify", SAMPLES / "field_record.csv", "--answers", ANSWERS, "-o", "report.html")
    assert ran.code == 0, ran.err
    assert "\nverdict: matches, not all determined: 1 of 7 parameters is not determined" in ran.out
    assert ran.out.splitlines()[-1] == "report: report.html"
    parameters = result_in(empty_folder / "runs" / "field_record-fit")["parameters"]
    missed = [
        symbol
        for symbol, truth in TRUTH.items()
        if (own := parameters[symbol]["interval"]) is None or not own[0] <= truth <= own[1]
    ]
    assert missed == ["KD"]  # the maker's saturation leaves it open
    page = (empty_folder / "report.html").read_text(encoding="utf-8")
    assert "N. N." in page


def test_an_interrupted_verify_keeps_the_fit_and_begins_no_report(
    empty_folder, run, locally, monkeypatch
):
    write = run_folder.write_fit

    def interrupting(*arguments):
        written = write(*arguments)
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return written

    monkeypatch.setattr(run_folder, "write_fit", interrupting)
    ran = run("verify", SAMPLES / "field_record.csv", "--answers", ANSWERS, "-o", "r.html", "-q")
    assert (ran.code, ran.err) == (3, "Interrupted: what was done until then is kept\n")
    assert result_in(empty_folder / "runs" / "field_record-fit")["model"] == "AC1A"
    assert not (empty_folder / "r.html").exists()


def test_verify_writes_case_fit_and_report_and_ends_with_the_verdict_and_its_page(
    empty_folder, run, locally
):
    ran = run("verify", SAMPLES / "field_record.csv", "--answers", ANSWERS, "-o", "out/r.html")
    assert ran.code in (0, 3), ran.err
    assert "\nverdict: " in ran.out
    assert ran.out.splitlines()[-1] == "report: out/r.html"
    assert (empty_folder / "out" / "r.html").is_file()
    case = load_case(empty_folder / "out" / "field_record.yaml")
    assert {case.sources()[f"machine.{name}"] for name in ("Tpd0", "S12")} == {"maker"}
    assert result_in(empty_folder / "runs" / "field_record-fit")["model"] == "AC1A"


def test_a_planners_file_leaves_only_the_size_of_the_step(empty_folder, run, locally):
    record = copy(SAMPLES / "ac1a_channels.csv", empty_folder)
    ran = run("verify", record, "--dyr", SAMPLES / "unit.dyr")
    assert ran.code == 1
    assert "step: missing: pu, as keyed in" in ran.err
    assert [*empty_folder.iterdir()] == [empty_folder / "ac1a_channels.csv"]
    options = ("--dyr", SAMPLES / "unit.dyr", "--bus", "101", "--step", "0.05")
    ran = run("verify", record, *options, "-q")
    assert (ran.code, ran.out) == (0, ""), ran.err
    assert (empty_folder / "ac1a_channels-report.html").is_file()


def test_a_grid_event_is_verified_with_a_planners_file(empty_folder, run, monkeypatch):
    """Only the fit is left out, which takes long."""
    fitted = []

    def interrupted(case, *_, **__):
        fitted.append(case)
        raise ExfitError("as far as this test goes")

    monkeypatch.setattr(workflows, "fit", interrupted)
    (empty_folder / "a.yaml").write_text("{kv: 18, mva: 100, open: {plant.network.f0: 60}}")
    options = ("--dyr", SAMPLES / "unit.dyr", "--answers", "a.yaml")
    ran = run("verify", SAMPLES / "grid_event.csv", *options)
    assert "as far as this test goes" in ran.err
    (case,) = fitted
    assert case.plant.type == "grid-playback"


def test_a_stabiliser_that_psse_has_otherwise_is_as_in_psse(empty_folder, run):
    """PSS4B in a grid event; a case on open circuit says what it needs on load."""
    records = [MACHINE_RECORD, *reference("psse_pss4b")[0]["records"]]
    (empty_folder / "unit.dyr").write_text("\n".join(records))
    event = ("--record", SAMPLES / "grid_event.csv", "--dyr", "unit.dyr", "--kv", 18, "--mva", 100)
    assert "\n  dialect: psse " in run("new", *event).out
    assert "on load with plant.dialect: psse" in run("import", "unit.dyr").out


def test_each_answer_that_is_missing_has_its_meaning(run):
    ran = run("verify", SAMPLES / "grid_event.csv", "--dyr", SAMPLES / "unit.dyr")
    missing = [line.partition(": missing: ") for line in ran.err.splitlines() if "missing" in line]
    assert {"kv", "mva"} <= {key.split()[-1] for key, _, _ in missing}
    assert all(meaning.strip() for _, _, meaning in missing)


def test_all_that_is_missing_is_named_at_once_by_its_key(empty_folder, run):
    ran = run("verify", SAMPLES / "field_record.csv")
    assert ran.code == 1
    for key in ("model", "kv", "step"):
        assert f"{key}: missing: " in ran.err
    (empty_folder / "a.yaml").write_text('machine: {Tpd0: "?", Xd: 1.8}\nkv: 15.75')
    ran = run("new", "--answers", "a.yaml", "--record", SAMPLES / "field_record.csv")
    assert ran.code == 1
    for key in ("model", "step", "machine.Tpd0"):
        assert f"a.yaml: {key}: missing: " in ran.err
    assert "kv" not in ran.err
    assert [*empty_folder.iterdir()] == [empty_folder / "a.yaml"]


@pytest.mark.parametrize(
    ("text", "says"),
    few_of(
        [
            ("kV: 15.75\nstep: x", "a.yaml:1: kV: unknown key; did you mean kv?"),
            ("kV: 15.75\nstep: x", "a.yaml:2: step"),
            ("kv: -3", "a.yaml:1: kv: -3 is not above 0"),
            ("bus: 0\nkv: high", "a.yaml:2: kv: 'high' is not a number"),
            ("sources: guess", "'guess' is not possible"),
            ("machine: {Tpd1: 6}", "machine: Tpd1: no parameter of GENROU; did you mean Tpd0?"),
            ("machine: {Xd: 18}", "machine: Xd: 18 lies outside 0.01 ... 10 pu"),
            ("sources: {Xdd: maker}", "sources: Xdd: no parameter of this unit; did you mean Xd"),
            ("open: {plant.network.X: 1}", "plant.network.X: not open in this case"),
            ("tests: t.csv", "--step: not allowed with --tests"),
            ("vt: Ugan", "vt: Ugan: no column of"),
            ("validate: nowhere.csv", "nowhere.csv: cannot be read"),
            ("kv:", "a.yaml:1: kv: has no value"),
        ],
        6,
    ),
)
def test_a_file_of_answers_that_is_wrong_is_refused_by_place_and_value(
    empty_folder, run, text, says
):
    (empty_folder / "a.yaml").write_text(text)
    record = SAMPLES / "field_record.csv"
    options = ("--model", "AC1A", "--step", "0.05", "--record", record, "--answers", "a.yaml")
    ran = run("new", *options)
    assert ran.code in (1, 2)
    assert says in " ".join(ran.err.split())


def test_a_case_that_somebody_edited_is_not_written_over(empty_folder, run, locally):
    arguments = ("verify", SAMPLES / "field_record.csv", "--answers", ANSWERS, "-o", "r.html", "-q")
    assert run(*arguments).code in (0, 3)
    assert run(*arguments, "--step", "0.051").code in (0, 3)  # nobody edited it
    case = empty_folder / "field_record.yaml"
    edited = case.read_text(encoding="utf-8").replace("Tpd0: {value: 6.0", "Tpd0: {value: 6.1")
    case.write_text(edited, encoding="utf-8")
    ran = run(*arguments)
    assert ran.code == 1
    assert "field_record.yaml: exists already" in ran.err
    assert case.read_text(encoding="utf-8") == edited
    assert run(*arguments, "--force").code in (0, 3)
    assert case.read_text(encoding="utf-8") != edited


def test_a_case_that_is_refused_is_not_written(empty_folder, run):
    answers = ANSWERS.read_text(encoding="utf-8").partition("validate:")[0]
    (empty_folder / "a.yaml").write_text(answers.replace("Xd: 1.8", "Xd: 0.1"), encoding="utf-8")
    record = SAMPLES / "field_record.csv"
    ran = run("verify", record, "--answers", "a.yaml", "-o", "new/r.html")
    assert ran.code == 1
    assert "plant.parameters.Xd: 0.1 is not above Xpd = 0.3" in ran.err
    assert "field_record.yaml is not written" in ran.err
    assert [path.name for path in empty_folder.iterdir()] == ["a.yaml"]


@pytest.mark.parametrize("name", ["report.txt", "report.yaml", "folder.html", "notes.html"])
def test_a_report_that_cannot_be_written_is_refused_before_any_work(empty_folder, run, name):
    (empty_folder / "folder.html").mkdir()
    (empty_folder / "notes.html").write_text("mine")
    ran = run("verify", SAMPLES / "field_record.csv", "--answers", ANSWERS, "-o", name)
    assert ran.code == 1
    assert f"Error: {name}: " in ran.err
    assert not (empty_folder / "runs").exists()


def test_a_pdf_without_weasyprint_is_refused_before_any_work(empty_folder, run, monkeypatch):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    ran = run("verify", SAMPLES / "field_record.csv", "--answers", ANSWERS, "-o", "r.pdf")
    assert ran.code == 1
    assert "pip install 'exfit[pdf]'" in ran.err
    assert not (empty_folder / "runs").exists()


def test_python_inspects_a_record_and_makes_a_case(empty_folder):
    record = exfit.inspect(SAMPLES / "field_record.csv")
    assert [(channel.name, channel.signal) for channel in record.channels] == [
        ("Ugen", "vt"), ("If", "ifd")
    ]  # fmt: skip
    assert record.time.shape == record.samples["Ugen"].shape == (2493,)
    text = exfit.new(SAMPLES / "field_record.csv", "AC1A", step=0.05, kv=15.75,
                     machine={"Tpd0": 6.0}, sources="maker", output="unit.yaml")  # fmt: skip
    assert (empty_folder / "unit.yaml").read_text(encoding="utf-8") == text
    case = exfit.load_case("unit.yaml")
    assert case.values()["machine.Tpd0"] == 6.0
    assert case.sources()["machine.Tpd0"] == "maker"
    planned = exfit.new(SAMPLES / "ac1a_channels.csv", dyr=SAMPLES / "unit.dyr", step=0.05)
    assert yaml.safe_load(planned)["as_found"]["bus"] == 101
    with pytest.raises(ExfitError, match="model: missing"):
        exfit.new(SAMPLES / "field_record.csv")
    with pytest.raises(ExfitError, match=r"5 % is 0\.05 pu"):
        exfit.new(SAMPLES / "field_record.csv", "AC1A", step=5)


def test_the_case_of_python_is_that_of_the_command(empty_folder, run):
    options = ("--model", "AC1A", "--step", "up=0.05", "--kv", "15.75", "--about", "Unit=3")
    ran = run("new", "--record", SAMPLES / "field_record.csv", *options)
    text = exfit.new(SAMPLES / "field_record.csv", "AC1A", step={"up": 0.05}, kv=15.75,
                     about={"Unit": "3"})  # fmt: skip
    assert ran.out == text


def test_the_page_names_every_key_of_the_answers():
    page = (SAMPLES.parent / "docs" / "own_record.md").read_text(encoding="utf-8")
    keys = {field.alias or name for name, field in Answers.model_fields.items()}
    assert {key for key in keys if f"`{key}`" not in page} == set()
