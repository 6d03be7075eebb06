"""The report of values that another program simulated: whose responses they are, what is not."""

import json
import re
import shlex
from html import unescape

import pytest
from click.testing import CliRunner
from outside_cases import written_case
from pages import Page

from exfit.cli import main

pytestmark = pytest.mark.long  # fits by a program


def run(*arguments):
    outcome = CliRunner().invoke(main, [*map(str, arguments)])
    assert outcome.exit_code in (0, 3), outcome.output
    return outcome


def report_of(folder):
    run("report", folder)
    html = (folder / "report.html").read_text(encoding="utf-8")
    return unescape(re.sub(r"<[^>]+>", "", html))


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Fit a program with a twin; return the folder of the run."""
    case = written_case(tmp_path_factory.mktemp("program"))
    run("fit", case, "-o", case.parent / "run")
    return case.parent / "run"


def test_a_report_says_whose_the_responses_are_and_what_the_twin_did(fitted):
    text = report_of(fitted)
    result = json.loads((fitted / "result.json").read_text(encoding="utf-8"))
    program = result["other_program"]
    assert f"simulator, {program['command']}, not of exfit: {program['runs']} runs." in text
    assert f"SHA-256 of program.py: {result['inputs']['program']}." in text
    assert "The plant open-circuit of exfit, its twin, gave the derivatives of the search" in text
    difference = program["differences"]["fit"]["vt"]
    assert 0.0 < difference < 1e-6
    assert f"differ at these values by at most: fit: vt {difference:.2g} pu." in text
    assert "By the simulation of the twin in exfit" in text


def test_the_command_that_a_report_names_makes_the_result_again(fitted, tmp_path):
    command = re.search(r"(exfit fit \S+) repeats this, with the same program", report_of(fitted))
    run(*shlex.split(command[1])[1:], "-o", tmp_path)
    own, again = (
        json.loads((folder / "result.json").read_text(encoding="utf-8"))
        for folder in (fitted, tmp_path)
    )
    assert again["cost"] == own["cost"]
    assert again["parameters"] == own["parameters"]
    assert again["other_program"] == own["other_program"]


def test_without_a_twin_a_report_says_what_that_leaves_out(tmp_path):
    case = written_case(tmp_path, with_twin=False)
    run("fit", case, "-o", tmp_path / "run")
    text = report_of(tmp_path / "run")
    assert "No plant of exfit stands beside it" in text
    assert "an earlier version of exfit" not in text
    assert text.count("it needs the equations of a twin, and the case has none") > 3


def test_a_validation_is_reported_as_the_programs(fitted):
    case = fitted.parent / "case.yaml"
    folder = fitted.parent / "validated"
    record = ("--record", case.parent / "bump.csv", "-o", folder)
    run("validate", case, "--parameters", fitted / "parameters.yaml", *record)
    text = report_of(folder)
    assert "not of exfit: 2 runs." in text
    assert "its twin, gave poles and limits" in text
    assert Page((folder / "report.html").read_text(encoding="utf-8")).tables
