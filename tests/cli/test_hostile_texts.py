"""Names that would control a terminal, in files that commands are given, are shown as codes."""

import csv
import json
import os
import shutil
import sys

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from mutant_runs import CONTROL
from payloads import CONTROL_TEXT, MARKUP
from places import ROOT
from tiers import few_of

NAME = f"<b>U{CONTROL_TEXT}[bold]"
FACT = f"{' '.join(MARKUP)}{CONTROL_TEXT}"
UNIT = f"k{CONTROL_TEXT}V"
MODEL = ROOT / "exfit" / "models" / "exciters" / "first_order.py"
RECORD, CASE, RUN = "<b>[red]up.csv", "<i>[bold]case.yaml", "run"


@pytest.fixture
def hostile(empty_folder):
    """A case in the current folder whose names, facts, units and model hold what does harm."""
    source = MODEL.read_text(encoding="utf-8")
    for word in ("a check with a known response", '"gain"', '"pole"'):
        assert word in source
    source = source.replace("a check with a known response", "[/] <script>alert(1)</script>")
    source = source.replace('"gain"', repr(FACT)).replace('"pole"', repr(NAME))
    (empty_folder / "mine.py").write_text(source, encoding="utf-8")
    noisy = 10.0 * (TRUTH + 1e-3 * np.random.default_rng(1).standard_normal(len(TIME)))
    with (empty_folder / RECORD).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("t", NAME), *zip(TIME, noisy, strict=True)])
    channel = {"column": NAME, "unit": UNIT, "base": 10.0}
    content = FIRST_ORDER | {
        "model": "mine.py",
        "record": {"file": RECORD, "time": "t", "channels": {"vt": channel}},
        "about": {FACT: FACT, NAME: 1, "Unit": FACT},
        "as_found": {"source": FACT, "parameters": {"k": 2.0}},
    }
    (empty_folder / CASE).write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return empty_folder


def is_guarded(ran):
    assert not CONTROL.search(ran.out)
    assert not CONTROL.search(ran.err)


def test_every_command_shows_hostile_names_as_codes(run, hostile):
    fitted = run("fit", CASE, "-o", RUN, "--no-plots")
    assert fitted.code == 0, fitted.err
    is_guarded(fitted)
    for arguments in (
        ("fit", CASE, "-o", RUN, "--no-plots", "--json"),
        ("check", CASE),
        ("simulate", CASE, "-o", "simulated", "--no-plots"),
        ("identify", CASE, "-o", "identified", "--no-plots"),
        ("inspect", RECORD, "-o", "inspected", "--no-plots"),
        ("inspect", RECORD, "-o", "inspected", "--no-plots", "--json"),
        ("new", "--model", "AC1A", "--record", RECORD, "-o", f"{NAME}.yaml"),
        ("report", RUN),
        ("compare", RUN, RUN),
    ):
        ran = run(*arguments)
        assert ran.code in (0, 3), ran
        is_guarded(ran)
    # what a terminal obeys is escaped in JSON too, and read back as it was
    printed = run("inspect", RECORD, "-o", "inspected", "--no-plots", "--json").out
    assert NAME in {channel["name"] for channel in json.loads(printed)["channels"]}


@pytest.mark.parametrize(
    "change",
    [
        {"model": f"{NAME}.py"},
        {"model": NAME},
        {NAME: 1.0},
        {"plant": {"type": NAME}},
        {"test": {"vt0": NAME}},
        {"record": {"file": f"{NAME}.csv", "time": "t", "channels": {"vt": "v"}}},
        {"record": {"file": RECORD, "time": NAME, "channels": {"vt": "v" + NAME}}},
        {"about": {NAME: [NAME]}},
        {"parameters": {"free": {NAME: 1.0}, "fixed": {"a": NAME}}},
    ],
    ids=lambda change: next(iter(change)).strip(NAME) or "key",
)
def test_a_refusal_quotes_hostile_names_as_codes(run, hostile, change):
    content = yaml.safe_load((hostile / CASE).read_text(encoding="utf-8")) | change
    file = f"{NAME}.yaml"
    (hostile / file).write_text(yaml.safe_dump(content), encoding="utf-8")
    ran = run("fit", file)
    assert ran.code == 1
    is_guarded(ran)
    assert r"\x1b]0;owned\x07" in ran.err


@pytest.mark.parametrize(
    "given",
    [
        ("batch", CASE, "--part", NAME),
        ("fit", CASE, "--search", NAME),
        (NAME,),
        ("fit", f"--{NAME}"),
    ],
    ids=("value", "choice", "command", "option"),
)
def test_a_refused_option_is_quoted_as_codes(run, hostile, given):
    ran = run(*given)
    assert ran.code == 2
    is_guarded(ran)


@pytest.mark.parametrize(
    "name", few_of(["a\nmodel: x", NAME, "c\\ 'x' \"", "d: {#", "e\u2028\x85"], 3)
)
def test_a_case_made_of_files_with_hostile_names_names_them_as_they_are(run, empty_folder, name):
    samples = ROOT / "sample_data"
    shutil.copy(samples / "unit.dyr", f"{name}.dyr")
    shutil.copy(samples / "ac1a_up.csv", f"{name}.csv")
    assert run("import", f"{name}.dyr", "-o", "imported.yaml").code == 0
    assert run("simulate", "imported.yaml", "--no-plots").code == 0
    options = ("--dyr", f"{name}.dyr", "--step", "0.05", "-o", "new.yaml")
    assert run("new", "--record", f"{name}.csv", *options).code == 0
    content = yaml.safe_load((empty_folder / "new.yaml").read_text(encoding="utf-8"))
    assert content["record"]["file"] == f"{name}.csv"
    assert content["as_found"]["file"] == f"{name}.dyr"


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux alone")
@pytest.mark.parametrize(
    "command", [("inspect",), ("new", "--model", "AC1A", "--record"), ("fit",)]
)
def test_a_name_that_is_not_text_is_refused(run, empty_folder, command):
    name = os.fsdecode(b"\xff.csv")
    (empty_folder / name).write_text("t,vt\n0,1\n1,1\n")
    ran = run(*command, name)
    assert ran.code == 1
    assert "not UTF-8 text" in ran.err


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux alone")
@pytest.mark.parametrize("command", [("fit",), ("batch", "-o", "fleet")])
def test_a_name_that_the_locale_lacks_is_no_fault_of_the_name(run, empty_folder, command):
    """In the locale C the two bytes of a letter come as two surrogates, not as the letter."""
    name = "fall\udcc3\udca4.yaml"
    (empty_folder / name).write_text("model: AC1A\n")
    ran = run(*command, name)
    assert ran.code == 1
    assert "not UTF-8" not in ran.err
    assert r"lacks '\xe4' of the name of the file; set PYTHONUTF8=1" in ran.err


def test_a_message_quotes_no_name_of_any_length(run, empty_folder):
    (empty_folder / "tests.csv").write_text(f"file,at\n{'x' * 50_000}.csv,1\n")
    ran = run("new", "--model", "AC1A", "--tests", "tests.csv")
    assert ran.code == 1
    assert 500 < len(ran.err) < 1100


def test_tables_of_a_run_have_a_cell_for_each_column(run, hostile):
    assert run("fit", CASE, "-o", RUN, "--no-plots").code == 0
    files = [*(hostile / RUN).glob("*.csv")]
    assert files
    for path in files:
        assert not CONTROL.search(path.read_text(encoding="utf-8"))
        with path.open(newline="", encoding="utf-8") as file:
            assert len({len(row) for row in csv.reader(file)}) == 1


@pytest.mark.pixels
def test_figures_draw_hostile_names(run, hostile):
    """A dollar sign begins a formula in a figure, unless it is escaped."""
    shutil.copy(hostile / RECORD, hostile / "$\\frac{$.csv")
    ran = run("inspect", "$\\frac{$.csv", "-o", "drawn")
    assert ran.code == 0
    assert not ran.err
    assert (hostile / "drawn" / "inspect.png").stat().st_size > 0


def test_commands_print_by_echo_which_guards_the_terminal():
    """But for bytes of files and JSON, which options.py escapes itself."""
    files = (ROOT / "exfit" / "cli").glob("*.py")
    own = {path.stem for path in files if "click.echo(" in path.read_text(encoding="utf-8")}
    assert own == {"streams", "options"}, "exfit.cli.streams.echo in place of click.echo"
