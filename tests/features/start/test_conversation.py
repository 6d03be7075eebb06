"""new and verify as a conversation, by a file of answers, and from Python: nobody edits a file."""

import re
import subprocess
import sys
from shutil import copy

import pytest
from click.testing import CliRunner
from places import SAMPLES
from stepped_record import stepped_record
from tiers import few_of

from exfit import cli
from exfit.case.load import load_case
from exfit.features.start import command
from exfit.features.start.questions import place_of
from exfit.output import run_folder


@pytest.fixture
def folder(empty_folder):
    """Work beside two records and no planner's file."""
    for name in ("field_record.csv", "ac1a_down.csv"):
        copy(SAMPLES / name, empty_folder)
    return empty_folder


@pytest.fixture
def talk(monkeypatch):
    """Return a function that runs a command whose questions get some lines; figures are left."""
    monkeypatch.setattr(command, "is_terminal", lambda: True)
    monkeypatch.setattr(command, "names_case", lambda given: "output" not in given)
    monkeypatch.setattr(run_folder.FigureFiles, "draw", lambda *_: ())

    def run(*arguments, lines):
        text = "".join(f"{line}\n" for line in lines)
        arguments = [str(argument) for argument in arguments]
        return CliRunner().invoke(cli.main, arguments, input=text, prog_name="exfit")

    return run


# each answer behind a wrong one, and what is said of that
CONVERSATION = (
    ("9.csv", "cannot be read"), ("2", ""),  # the record
    ("1.75", "The voltage rests at 15.706 kV, far from 1.75 kV"), ("kV", "'kV' is not a number"),
    ("15.75", ""),
    ("5", "5 % is 0.05 pu"), ("0.02", "changes by +5 % there"), ("0.05", ""),
    ("unit.dry", "cannot be read"), ("", ""),  # no planner's file
    ("4", "4 is not in the catalogue"), ("2", ""), ("AC1B", "AC11C or AC1A?"), ("AC1A", ""),
    ("square", "square is not a machine model"), ("", ""),
    ("6.0", ""), ("35", "35 s is far from the typical 0.06"), ("0.035", ""),  # T'd0, T''d0
    ("18", "18 lies outside 0.01 ... 10 pu"), ("1.8", ""), ("", ""), ("", ""), ("0.2", ""),  # Xl
    ("0.4", ""), ("0.12", "S12: 0.12 at 1.2 pu is not above S10 = 0.4"), ("0.12", ""), ("0.4", ""),
    ("14.5", ""), ("", ""), ("14.5", ""), ("15", "VRMIN: 15 is not below VRMAX = 14.5"),
    ("14.5", ""), ("-14.5", ""),
    ("KX=3", "KX: no parameter of AC1A"), ("KE", "'KE' is not of the form KE=1.0"), ("KE=1", ""),
    ("guess", "'guess' is not in the list"), ("maker", ""),
    ("up.csv", "cannot be read"), ("ac1a_down.csv", ""),
    ("East", ""), ("", ""), ("A. Test", ""),
    ("field_record.csv.yaml", ""),
)  # fmt: skip


def test_a_conversation_makes_a_case_and_explains_every_wrong_answer(folder, talk):
    ran = talk("new", lines=[answer for answer, _ in CONVERSATION])
    assert ran.exit_code == 0, ran.output
    said = " ".join(ran.output.split())
    missing = [text for _, text in CONVERSATION if text not in said]
    assert missing == []
    case = load_case(folder / "field_record.csv.yaml")
    values, sources = case.values(), case.sources()
    assert case.model == "AC1A"
    assert (values["machine.Tpd0"], values["machine.S12"], values["VRMIN"]) == (6.0, 0.4, -14.5)
    assert {sources[f"machine.{name}"] for name in ("Tpd0", "Xd", "Xl")} == {"maker"}
    assert {sources[f"machine.{name}"] for name in ("Xpd", "Tpq0")} == {"typical"}
    assert sources["VAMAX"] == sources["KE"] == "maker"
    assert case.about == {"Plant": "East", "Tested by": "A. Test"}
    assert [each.record.file for each in case.validations] == ["ac1a_down.csv"]
    assert "next: exfit fit field_record.csv.yaml" in ran.output
    assert "typical, not of this unit: generator: Xpd and Xppd; exciter: TR, TB" in said


def test_the_answers_of_a_conversation_make_the_same_case_in_a_script(
    folder, talk, run, monkeypatch
):
    talk("new", lines=[answer for answer, _ in CONVERSATION])
    made = (folder / "field_record.csv.yaml").read_text(encoding="utf-8")
    monkeypatch.setattr(command, "is_terminal", lambda: False)
    ran = run("new", "--answers", "field_record.csv.answers.yaml", "-o", "again.yaml")
    assert ran.code == 0, ran.err
    assert (folder / "again.yaml").read_text(encoding="utf-8") == made
    assert str(folder) not in (folder / "field_record.csv.answers.yaml").read_text("utf-8")


def test_a_question_mark_explains_and_enter_takes_the_proposals(folder, talk):
    lines = ["2", "?", "", "?", "", "?", "", "?", "ac", "?", "", "?", *[""] * 40]
    ran = talk("new", lines=lines)
    assert ran.exit_code == 0, ran.output
    said = " ".join(ran.output.split())
    for text in ("secondary voltage, as 0.11", "5 % are 0.05 pu", "`exfit rank` then compares"):
        assert text in said
    case = load_case(folder / "field_record.yaml")
    assert case.model == "AC8B"
    assert case.record.channels["vt"].base == 15.75
    assert case.test.vref[0].step == 0.05
    assert max(map(len, ran.output.splitlines())) <= 80


@pytest.mark.parametrize("count", few_of([1, 13, 19, 26, 34, *range(2, len(CONVERSATION))], 5))
def test_what_was_answered_before_an_interruption_is_not_asked_again(folder, talk, count):
    """The end of the input is Ctrl-D; what follows is answered in a second conversation."""
    lines = [answer for answer, _ in CONVERSATION]
    ended = talk("new", lines=lines[:count])
    assert ended.exit_code == 130
    if CONVERSATION[1][0] not in lines[:count]:
        assert "nothing was answered" in ended.output
        return
    again = re.search("exfit (new --answers .*)", ended.output)[1].split()
    left = lines[count:]
    ran = talk(*again, lines=[*left, *[""] * 40])
    assert ran.exit_code == 0, ran.output
    values = load_case(folder / "field_record.csv.yaml").values()
    assert (values["machine.Tpd0"], values["machine.S12"], values["VRMIN"]) == (6.0, 0.4, -14.5)


def test_with_a_planners_file_only_the_size_of_the_step_and_facts_are_asked(folder, talk):
    for name in ("unit.dyr", "ac1a_channels.csv"):
        copy(SAMPLES / name, folder)
    options = ("--dyr", "unit.dyr", "--bus", "101")
    ran = talk("new", *options, lines=["", "", "", "", "", ""])
    assert ran.exit_code == 0, ran.output
    asked = [line for line in ran.output.splitlines() if line.rstrip().endswith((":", "]:"))]
    assert [text.split(",")[0].split("[")[0].strip(" :") for text in asked] == [
        "Record of the test: its number", "Size of the 2 steps", "Plant", "Unit", "Tested by",
        "File for the case",
    ]  # fmt: skip
    assert "typical" not in ran.output
    assert load_case(folder / "ac1a_channels.yaml").as_found.bus == 101
    options = ("--record", "ac1a_channels.csv", *options, "--step", "0.05", "-o", "other.yaml")
    ran = talk("new", *options, lines=[])  # whose record and unit are given: nothing is asked
    assert ran.exit_code == 0, ran.output
    assert load_case(folder / "other.yaml").values() == (
        load_case(folder / "ac1a_channels.yaml").values()
    )


def test_of_several_units_of_a_planners_file_one_is_chosen(folder, talk):
    text = (SAMPLES / "unit.dyr").read_text(encoding="utf-8")
    (folder / "units.dyr").write_text(text + text.replace("101 '", "102 '"), encoding="utf-8")
    lines = ["field_record.csv", "", "", "", "3", "103 1", "102 1", "", "", "", "", ""]
    ran = talk("new", lines=lines)
    assert ran.exit_code == 0, ran.output
    assert "'103 1' is not in the list" in ran.output
    assert load_case(folder / "field_record.yaml").as_found.bus == 102


def test_tests_of_different_size_are_asked_one_by_one(folder, talk):
    stepped_record(folder / "steps.csv")
    lines = ["15.75", "", "", "0.03", "0.03", "-0.02", *[""] * 30]
    ran = talk("new", "--record", "steps.csv", "--model", "SEXS", "-o", "u.yaml", lines=lines)
    assert ran.exit_code == 0, ran.output
    said = " ".join(ran.output.split())
    assert "To keep it, enter it once more" in said
    assert "vt rises there" in said
    case = load_case(folder / "u.yaml")
    tests = [each.test for each in (*case.recordings, *case.validations)]
    assert sorted(test.vref[0].step for test in tests) == [-0.05, -0.03, 0.02, 0.05]


def test_verify_asks_as_new_does_keeps_the_answers_and_refuses_an_edited_case_with_them(
    folder, talk
):
    (folder / "field_record.yaml").write_text("model: AC1A\n")
    options = ("--kv", "15.75", "--step", "0.05", "--model", "SEXS")
    ran = talk("verify", "field_record.csv", *options, lines=[""] * 30)
    assert ran.exit_code == 1
    assert "field_record.yaml: exists already" in ran.output
    assert "model: SEXS" in (folder / "field_record.answers.yaml").read_text(encoding="utf-8")
    ended = talk("verify", "field_record.csv", "--kv", "15.75", lines=["0.05"])
    assert ended.exit_code == 130
    assert "exfit verify --answers field_record.answers.yaml" in ended.output


def test_another_file_with_the_name_of_the_answers_is_kept(folder, talk):
    (folder / "field_record.answers.yaml").write_text("mine: 1\n")
    ended = talk("new", lines=["2"])
    assert "exfit new --answers field_record.answers-2.yaml" in ended.output
    assert (folder / "field_record.answers.yaml").read_text() == "mine: 1\n"


def test_the_first_question_waits_for_no_heavy_library(folder):
    code = (
        "import sys, atexit; from exfit.features.start import command; "
        "command.is_terminal = lambda: True; "
        "atexit.register(lambda: print(*sys.modules)); from exfit.cli import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "new"], input="", capture_output=True, text=True, check=False
    )
    assert done.returncode == 130
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert not loaded & {"scipy", "matplotlib", "rich", "jinja2", "llvmlite"}


@pytest.mark.parametrize("text", ["\N{SUPERSCRIPT TWO}", "1" * 5000, "0", "3", "-1", "two"])
def test_what_is_no_number_of_a_listed_word_is_no_place(text):
    assert place_of(text, ["a.csv", "b.csv"]) is None
    assert [place_of(number, ["a.csv", "b.csv"]) for number in ("1", "2")] == [0, 1]
