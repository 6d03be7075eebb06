"""fit --set and --parameters: values in place of those of the case, on the command line."""

import hashlib
import json

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH

from exfit.features.report.page import html
from exfit.results.io import load_result

CASE = {**FIRST_ORDER, "record": {"file": "up.csv", "time": "t", "channels": {"vt": "v"}}}


@pytest.fixture(autouse=True)
def workplace(empty_folder):
    """Work in an empty folder with a case, its record and values of an earlier fit."""
    (empty_folder / "case.yaml").write_text(yaml.safe_dump(CASE))
    samples = np.column_stack([TIME, TRUTH])
    np.savetxt(empty_folder / "up.csv", samples, delimiter=",", header="t,v", comments="")
    (empty_folder / "values.yaml").write_text("parameters: {k: 3.0, a: 2.5}\n")
    return empty_folder


def test_a_fit_starts_from_a_file_and_from_the_command_line(run, workplace):
    given = ["--parameters", "values.yaml", "--set", "k=8", "--set", "k=6"]
    ran = run("fit", "case.yaml", *given, "-o", "out", "--no-plots")
    assert ran.code == 0
    assert "note: the fit starts from k 6" in ran.out
    result = load_result("out")
    assert result.history[0].values == {"k": 6.0, "a": 2.5}
    sources = {name: given.source for name, given in result.given_values.items()}
    assert sources == {"k": "--set", "a": "values.yaml"}
    file = (workplace / "values.yaml").read_bytes()
    assert result.inputs["parameters"] == hashlib.sha256(file).hexdigest()
    assert result.files["parameters"] == "values.yaml"
    assert json.loads((workplace / "out" / "result.json").read_text())["given_values"]["k"] == {
        "value": 6.0,
        "in_case": 1.0,
        "start": True,
        "source": "--set",
    }


@pytest.mark.long
def test_the_report_shows_the_values_beside_the_case_that_does_not_have_them(run, workplace):
    run("fit", "case.yaml", "--set", "k=6", "-o", "out", "--no-plots", "-q")
    page = html(load_result("out"), workplace / "out")
    assert "--set k=6.0" in page
    assert "Values used in place of those in the case file" in page
    run("fit", "case.yaml", "-o", "plain", "--no-plots", "-q")
    assert "in place of those" not in html(load_result("plain"), workplace / "plain")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--set", "k=1000"], ["--set: k: 1000", "bounds 0.1 ... 100", "case.yaml"]),
        (["--set", "q=1"], ["--set", "q", "known: k, a"]),
        (["--set", "k"], ["--set k: not of the form KA=400"]),
        (["--parameters", "none.yaml"], ["none.yaml"]),
        (["--parameters", "far.yaml"], ["far.yaml: k: 500", "bounds 0.1 ... 100", "case.yaml"]),
    ],
)
def test_values_that_a_fit_cannot_start_from_are_refused(run, workplace, given, words):
    (workplace / "far.yaml").write_text("parameters: {k: 500.0}\n")
    ran = run("fit", "case.yaml", *given)
    assert ran.code == 1
    assert all(word in ran.err for word in words), ran.err
    assert not (workplace / "runs").exists()


def test_the_file_of_an_earlier_fit_is_not_written_over(run, workplace):
    run("fit", "case.yaml", "-o", "out", "--no-plots", "-q")
    before = (workplace / "out" / "parameters.yaml").read_bytes()
    ran = run("fit", "case.yaml", "--parameters", "out/parameters.yaml", "-o", "out")
    assert ran.code == 1
    assert "would be overwritten" in ran.err
    assert (workplace / "out" / "parameters.yaml").read_bytes() == before


def test_values_given_beside_several_strategies_hold_in_each_of_their_fits(run):
    strategies = ["--strategy", "gn", "--strategy", "lm"]
    assert run("fit", "case.yaml", *strategies, "--set", "k=6", "-o", "out", "--no-plots").code == 0
    for strategy in ("gn", "lm"):
        assert load_result(f"out/case-{strategy}").parameters["k"].start == 6.0
