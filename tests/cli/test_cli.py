"""The commands: what they print, what they leave, how they end."""

import csv
import json
import re
import shutil
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace
from io import StringIO
from pathlib import Path

import click
import jsonschema
import numpy as np
import pytest
import yaml
from cases import FILES_OF_A_FIT, FIRST_ORDER, TIME, TRUTH, with_local_search
from commands import COMMANDS, Ran
from new_process import NothingLoaded
from places import ROOT
from rich.console import Console
from tiers import few_of

from exfit import workflows
from exfit.engine import kernel as engine
from exfit.engine.kernel import kernel, linear_kernel
from exfit.engine.tangents import tangent_kernel
from exfit.models import LIMITERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.output import figures as plots
from exfit.output import live
from exfit.output.figure_files import FigureFiles
from exfit.results.model import Iteration
from exfit.util import files

CONFIGS = sorted((ROOT / "configs").glob("*.yaml"))
OF_CASES = ("fit", "simulate", "validate", "check")
WIDTH = 80

# k/(s + a) with k = 4 and a = 2, a unit step at 0.5 s from rest
DOWN = {"vt0": 2.0, "vref": [{"at": 0.5, "step": -1.0}]}
CASE = {
    **FIRST_ORDER,
    "record": {"file": "up.csv", "time": "t", "channels": {"vt": "v"}},
    "validate": [
        {
            "name": "down-step",
            "test": DOWN,
            "record": {"file": "down.csv", "time": "t", "channels": {"vt": "v"}},
        }
    ],
}


def rms_below(limit):
    """Return the change of a case that accepts an rms of the difference up to a limit (pu)."""
    return "criteria", {"limits": [{"quantity": "rms", "limit": limit}]}


MACHINE_CASE = {
    **yaml.safe_load((ROOT / "configs" / "ac1a_typical.yaml").read_text()),
    "test": {"vt0": 1.0, "vref": [{"at": 0.5, "step": 0.05}]},
    "record": {"file": "unit.csv", "time": "t", "channels": {"vt": "v"}},
    "validate": [],
}


@pytest.fixture(autouse=True)
def workplace(empty_folder):
    """Work in an empty folder with the records of CASE, in no terminal."""
    records = {
        "up.csv": TRUTH,
        "down.csv": 2.0 - TRUTH,
        "flat.csv": np.ones(len(TIME)),
        "unit.csv": 1.0 + 0.05 * (1.0 - np.exp(-3.0 * np.maximum(TIME - 0.5, 0.0))),
    }
    for name, samples in records.items():
        (empty_folder / name).write_text(csv_text(TIME, samples))
    (empty_folder / "values.yaml").write_text("parameters: {k: 4.0, a: 2.0}\n")
    return empty_folder


def program(code, *arguments):
    """Return what Python code leaves that runs as a process of its own, arguments behind it."""
    ran = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return Ran(ran.returncode, ran.stdout, ran.stderr)


def csv_text(time, samples):
    rows = (f"{t:.6g},{v:.9g}" for t, v in zip(time, samples, strict=True))
    return "\n".join(["t,v", *rows]) + "\n"


def case_file(content=CASE, path="case.yaml"):
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    text = yaml.safe_dump(with_local_search(content), sort_keys=False)
    path.write_text(text, encoding="utf-8")
    return path


def changed(content, *changes):
    """Return a copy of a case with values put at dotted places; None takes the key away."""
    content = deepcopy(content)
    for place, value in changes:
        *way, last = [int(part) if part.isdigit() else part for part in place.split(".")]
        inner = content
        for part in way:
            inner = inner[part]
        if value is None:
            del inner[last]
        else:
            inner[last] = value
    return content


def listing(folder):
    return sorted(str(path) for path in folder.rglob("*"))


def columns(path):
    header, *rows = csv.reader(Path(path).read_text().splitlines())
    return {name: [row[k] for row in rows] for k, name in enumerate(header)}


# what is wrong, and the words that must name place, value and limit
CASE_FAULTS = {
    "unknown key": (CASE, [("estimat", {})], ["case.yaml:", "estimat", "estimate"]),
    "unknown model": (CASE, [("model", "AC1B")], ["case.yaml:1: model", "AC1B", "AC1A"]),
    "unknown parameter": (
        CASE,
        [("parameters.fixed", {"q": 1.0})],
        ["parameters.fixed.q", "FIRST_ORDER"],
    ),
    "start outside bounds": (
        CASE,
        [("parameters.free.k.start", 0.01)],
        ["parameters.free.k.start", "0.01", "0.1 ... 100"],
    ),
    "min above max": (
        CASE,
        [("parameters.free.k.min", 200.0)],
        ["parameters.free.k.min", "200", "100"],
    ),
    "text in a number": (
        CASE,
        [("parameters.free.k.start", "one")],
        ["parameters.free.k.start", "'one'", "not a number"],
    ),
    "step outside the window": (
        CASE,
        [("record.window", [1.0, 3.0])],
        ["test.vref[0].at", "0.5", "1 ... 3"],
    ),
    "machine data out of order": (
        MACHINE_CASE,
        [("plant.parameters.Xd", 0.28)],
        ["plant.parameters", "Xd", "0.28", "0.3"],
    ),
    "saturation points that contradict": (
        MACHINE_CASE,
        [("parameters.fixed.SE1", 0.01)],
        ["parameters.fixed.SE1", "0.01", "0.03"],
    ),
    "crossed limits": (
        MACHINE_CASE,
        [("parameters.fixed.VAMAX", 0.0), ("parameters.fixed.VAMIN", 0.0)],
        ["parameters.fixed.VAMIN", "VAMAX"],
    ),
    "start beyond a limit": (
        MACHINE_CASE,
        [("parameters.fixed.VRMAX", 0.5)],
        ["VRMAX", "0.5", "1.83"],
    ),
}
TWICE = np.where(TIME == 1.0, 0.95, TIME)
BACK = np.where(TIME == 1.0, 0.5, TIME)
RECORD_FAULTS = {
    "missing file": (None, ["up.csv", "No such file"]),
    "empty record": ("", ["up.csv", "empty"]),
    "no samples": ("t,v\n", ["up.csv", "no samples"]),
    "missing column": ("t,w\n0,0\n1,0\n", ["up.csv", "'v'", "'w'"]),
    "duplicate time": (csv_text(TWICE, TRUTH), ["up.csv:22", "0.95", "repeats"]),
    "decreasing time": (csv_text(BACK, TRUTH), ["up.csv:22", "0.5", "0.95"]),
    "NaN in a channel": ("t,v\n0,0\n1,nan\n2,0\n", ["up.csv:3", "'v'", "nan"]),
    "text in a channel": ("t,v\n0,0\n1,n/a\n2,0\n", ["up.csv:3", "'v'", "'n/a'"]),
    "shorter than the step time": (
        csv_text(TIME[:5], TRUTH[:5]),
        ["up.csv", "0 ... 0.2 s", "0.5 s"],
    ),
}


def arguments(command, case):
    given = ["--parameters", "values.yaml"] if command == "validate" else []
    plots = [] if command == "check" else ["--no-plots"]
    return [command, case, *given, *plots]


def is_refused(ran, words, before, folder):
    assert ran.code == 1
    assert ran.out == ""
    assert ran.err.startswith("Error: ")
    assert "Traceback" not in ran.err
    for word in words:
        assert word in ran.err, word
    assert listing(folder) == before


@pytest.mark.parametrize("command", OF_CASES)
@pytest.mark.parametrize("fault", CASE_FAULTS)
def test_a_fault_of_the_case_is_reported_and_nothing_is_written(run, workplace, fault, command):
    base, changes, words = CASE_FAULTS[fault]
    if base is MACHINE_CASE:
        Path("values.yaml").write_text("parameters: {KA: 400.0}\n")
    case = case_file(changed(base, *changes))
    before = listing(workplace)
    is_refused(run(*arguments(command, case)), words, before, workplace)


@pytest.mark.parametrize("command", OF_CASES)
@pytest.mark.parametrize("fault", RECORD_FAULTS)
def test_a_fault_of_the_record_is_reported_and_nothing_is_written(run, workplace, fault, command):
    text, words = RECORD_FAULTS[fault]
    if text is None:
        Path("up.csv").unlink()
    else:
        Path("up.csv").write_text(text)
    case, before = case_file(), listing(workplace)
    is_refused(run(*arguments(command, case)), words, before, workplace)


@pytest.mark.parametrize("command", ["fit", "validate"])
def test_a_fault_of_a_validation_is_reported_before_anything_is_written(run, workplace, command):
    Path("down.csv").unlink()
    case, before = case_file(), listing(workplace)
    is_refused(run(*arguments(command, case)), ["down.csv", "No such file"], before, workplace)


@pytest.mark.parametrize("command", OF_CASES)
def test_a_case_that_does_not_exist_is_reported(run, workplace, command):
    before = listing(workplace)
    is_refused(run(*arguments(command, "none.yaml")), ["none.yaml", "No such"], before, workplace)


def test_a_fit_needs_a_free_parameter_but_a_simulation_does_not(run, workplace):
    case = case_file(changed(CASE, ("parameters", {"fixed": {"k": 4.0, "a": 2.0}})))
    before = listing(workplace)
    words = ["case.yaml", "parameters.free", "needs a free parameter"]
    is_refused(run("fit", case), words, before, workplace)
    assert run("simulate", case, "--no-plots").code == 0
    assert run("check", case).code == 0


def test_a_fit_needs_a_record_but_a_simulation_does_not(run, workplace):
    case = case_file(
        changed(
            CASE, ("record", None), ("validate", None), ("test", {**CASE["test"], "duration": 2.0})
        )
    )
    before = listing(workplace)
    is_refused(run("fit", case), ["case.yaml", "record", "missing"], before, workplace)
    words = ["case.yaml", "validate: missing: the case has no record that was not fitted"]
    is_refused(run("validate", case, "--parameters", "values.yaml"), words, before, workplace)
    assert run("simulate", case, "--no-plots").code == 0
    assert run("check", case).code == 0


def test_all_faults_of_a_case_are_reported_at_once(run):
    case = case_file(changed(CASE, ("model", "AC1B"), ("test.vref.0.at", "x"), ("criteria", {})))
    ran = run("fit", case)
    assert ran.code == 1
    assert [line.split(": ")[1] for line in ran.err.removeprefix("Error: ").splitlines()] == [
        "model",
        "test.vref[0].at",
        "criteria",
    ]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--set", "q=1"], ["--set", "q", "known: k, a"]),
        (["--set", "k=four"], ["--set", "k=four"]),
        (["--set", "k"], ["--set", "KA=400"]),
        (["--set", "k="], ["--set", "KA=400"]),
        (["--set", "k=nan"], ["--set", "nan", "1e+06"]),
        (["--set", "k=-1"], ["--set", "-1 is below 1e-06", "the equations"]),
        (["--parameters", "none.yaml"], ["none.yaml", "No such file"]),
        (["--parameters", "up.csv"], ["up.csv"]),
        (["--parameters", "."], ["contains no parameters.yaml of a fit"]),
        (["--parameters", "other.yaml"], ["other.yaml", "AC8B", "FIRST_ORDER"]),
        (["--parameters", "text.yaml"], ["text.yaml", "parameters.k", "'four'"]),
        (["--parameters", "symbol.yaml"], ["symbol.yaml", "KQ"]),
    ],
)
def test_a_wrong_value_is_reported_and_nothing_is_written(run, workplace, given, words):
    Path("other.yaml").write_text("model: AC8B\nparameters: {k: 1.0}\n")
    Path("text.yaml").write_text("parameters: {k: four}\n")
    Path("symbol.yaml").write_text("parameters: {KQ: 1.0}\n")
    case, before = case_file(), listing(workplace)
    is_refused(run("simulate", case, *given), words, before, workplace)


@pytest.mark.parametrize("command", ["fit", "simulate", "validate"])
@pytest.mark.parametrize("place", ["taken", "taken/below"])
def test_an_output_that_cannot_be_a_folder_is_reported_before_the_work(
    run, workplace, command, place
):
    Path("taken").write_text("mine")
    case, before = case_file(), listing(workplace)
    ran = run(*arguments(command, case), "-o", place)
    is_refused(ran, ["taken", "cannot be written"], before, workplace)
    assert Path("taken").read_text() == "mine"


@pytest.mark.parametrize(
    "damage", few_of([b"", b"damaged", None], 1), ids=["emptied", "overwritten", "one bit turned"]
)
def test_a_damaged_cache_is_rebuilt_in_silence(run, tmp_path, monkeypatch, damage):
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(engine, "_loaded", NothingLoaded())
    case = case_file()
    for of_this_process in (kernel, tangent_kernel, linear_kernel):
        of_this_process.cache_clear()
    assert run("simulate", case, "--no-plots", "-o", "first").code == 0
    kept = {path: path.read_bytes() for path in (tmp_path / "cache").glob("*.code")}
    assert kept
    for of_this_process in (kernel, tangent_kernel, linear_kernel):
        of_this_process.cache_clear()
    for path, content in kept.items():
        path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]) if damage is None else damage)
    ran = run("simulate", case, "--no-plots", "-o", "second", "-q")
    assert (ran.code, ran.out, ran.err) == (0, "", "")
    assert Path("first/response.csv").read_text() == Path("second/response.csv").read_text()
    assert {path: path.read_bytes() for path in (tmp_path / "cache").glob("*.code")} == kept


def test_a_cache_that_cannot_be_written_costs_only_time(run, tmp_path, monkeypatch):
    (tmp_path / "cache").write_text("a file in its place")
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    ran = run("fit", case_file(), "--no-plots", "-q")
    assert (ran.code, ran.out, ran.err) == (0, "", "")


@pytest.mark.pixels
def test_a_fit_that_converges_ends_with_0_and_writes_its_files(run):
    ran = run("fit", case_file())
    assert (ran.code, ran.err) == (0, "")
    assert {path.name for path in Path("runs/case-fit").iterdir()} == FILES_OF_A_FIT


def test_a_fit_without_a_terminal_prints_plain_lines_of_80_columns(run):
    """Not the iterations, which history.csv has."""
    ran = run("fit", case_file(), "--no-plots")
    everything = run("fit", case_file(), "--no-plots", "--verbose")
    last = [line for line in ran.out.splitlines() if line[0:1] != " "][-1]
    assert last.startswith("verdict: ")
    assert len(ran.out.splitlines()) <= 30
    for out in (ran.out, everything.out):
        assert "\x1b" not in out
        assert "…" not in out
        assert max(map(len, out.splitlines())) <= WIDTH
        assert not re.search(r"^ +(\d+) (?:lm|dgn) ", out, re.MULTILINE)
        for word in ("cost", "rmse", "runs/case-fit", "down-step"):
            assert word in out
    for word in ("converged", "simulations", "sensitivity:", "step of vt"):
        assert word in everything.out
        assert word not in ran.out


def test_a_stored_result_is_shown_as_its_run_showed_it(run):
    for option, whole in (([], []), (["--verbose"], ["--all"])):
        ran = run("fit", case_file(), "--no-plots", *option)
        shown = run("show", "runs/case-fit", *whole)
        assert (shown.code, shown.err) == (0, "")
        assert ran.out.endswith(shown.out)
    drawn = run("fit", case_file())
    assert drawn.code == 0
    assert "overlay.png " in run("show", "runs/case-fit/result.json", "--all").out
    run("validate", case_file(), "--no-plots")
    assert "validated: down-step" in run("show", "runs/case-validate").out
    assert run("show", "runs").code == 1
    Path("programme.json").write_text("{}")
    for place in (".", "programme.json"):
        assert "the result of a programme: use exfit report" in run("show", place).err
    for beside in (("--quiet",), ("--json",), ("--strategy", "lm", "--strategy", "dgn")):
        assert run("fit", case_file(), "--verbose", *beside).code == 2


@pytest.mark.parametrize("columns", few_of([60, 80], 1))
def test_no_number_is_cut_however_narrow_the_terminal_is(run, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    ran = run("fit", case_file(), "--no-plots")
    assert "…" not in ran.out
    tables = ran.out[ran.out.index("parameter ") :]
    assert max(map(len, tables.splitlines())) <= columns
    wide = run("fit", case_file(), "--no-plots", "-o", "again").out
    numbers = re.findall(r"\d+\.\d+", wide[wide.index("parameter ") : wide.index("cost ")])
    assert all(number in tables for number in numbers)


def test_a_pipe_without_columns_gets_every_sentence_in_one_line(run, monkeypatch):
    wrapped = run("fit", case_file(), "--no-plots", "-o", "first").out
    monkeypatch.delenv("COLUMNS")
    whole = run("fit", case_file(), "--no-plots", "-o", "second").out
    begins = ("note:", "unresolved:", "sensitivity:", "converged", "GOOD", "MATCHES")
    assert [line for line in whole.splitlines() if line.startswith("      ") and ":" in line] == []
    for line in wrapped.splitlines():
        if line.startswith(begins):
            assert any(own.startswith(line.rstrip()) for own in whole.splitlines())


def test_a_value_on_its_bound_is_marked(run):
    ran = run("fit", case_file(changed(CASE, ("parameters.free.k.max", 3.0))), "--no-plots")
    (line,) = [line for line in ran.out.splitlines() if line.startswith("k ")]
    assert line.rstrip().endswith("on its max")
    stored = json.loads(Path("runs/case-fit/result.json").read_text())
    assert stored["parameters"]["k"]["at_bound"] == "max"
    assert stored["parameters"]["a"]["at_bound"] is None


def test_quiet_prints_nothing_and_writes_the_same(run):
    case = case_file()
    ran = run("fit", case, "--no-plots", "-q")
    assert (ran.code, ran.out, ran.err) == (0, "", "")
    for command in ("simulate", "validate"):
        ran = run(command, case, "--no-plots", "-q")
        assert (ran.code, ran.out, ran.err) == (0, "", "")


def restricted(stored, printed):
    """Return what is stored under the keys that are printed: samples are in the file alone."""
    if isinstance(printed, dict):
        return {key: restricted(stored[key], printed[key]) for key in printed}
    if isinstance(printed, list):
        return [restricted(*pair) for pair in zip(stored, printed, strict=True)]
    return stored


def test_json_is_the_result_and_nothing_else(run):
    ran = run("fit", case_file(), "--no-plots", "--json")
    assert (ran.code, ran.err) == (0, "")
    printed = json.loads(ran.out, parse_constant=pytest.fail)
    assert printed.keys() >= {
        *("case", "model", "strategy", "parameters", "fixed", "cost", "rmse", "status", "message"),
        *("success", "nit", "nfev", "njev", "seconds", "validation", "versions", "inputs"),
        *("typical", "machine", "substeps", "simulations", "interrupted", "start_cost", "notes"),
    }
    assert printed["parameters"].keys() == {"k", "a"}
    for one in printed["parameters"].values():
        assert one.keys() >= {"value", "start", "min", "max", "at_bound"}
    (validation,) = printed["validation"]
    assert validation.keys() >= {"name", "rmse", "max_error", "fit_percent", "features"}
    assert validation["name"] == "down-step"
    assert all(re.fullmatch("[0-9a-f]{64}", digest) for digest in printed["inputs"].values())
    assert "record" in printed["inputs"]
    assert "exfit" in printed["versions"]
    assert printed["parameters"]["k"]["value"] == pytest.approx(4.0, rel=1e-4)
    stored = json.loads(Path("runs/case-fit/result.json").read_text())
    assert restricted(stored, printed) == printed


def test_json_of_a_validation_is_the_result_and_nothing_else(run):
    ran = run("validate", case_file(), "--no-plots", "--json", "--parameters", "values.yaml")
    assert (ran.code, ran.err) == (0, "")
    names = [one["name"] for one in json.loads(ran.out)["validation"]]
    assert names == ["fit", "down-step"]
    printed, stored = (
        json.loads(ran.out),
        json.loads(Path("runs/case-validate/validation.json").read_text()),
    )
    assert restricted(stored, printed) == printed


def test_the_iteration_limit_ends_with_3_and_leaves_the_best_point(run):
    case = case_file(changed(CASE, ("estimate", {"strategy": "lm", "iterations": 1})))
    ran = run("fit", case, "--no-plots", "--json")
    assert ran.code == 3
    printed = json.loads(ran.out)
    assert not printed["success"]
    assert "iteration limit" in printed["message"]
    assert printed["nit"] == 1
    assert printed["cost"] < printed["start_cost"]
    assert Path("runs/case-fit/parameters.yaml").is_file()
    assert "verdict: not converged" in run("fit", case, "--no-plots").out


def test_a_validation_beyond_its_limit_ends_with_3(run):
    case = case_file(changed(CASE, rms_below(1e-12)))
    ran = run("fit", case, "--no-plots")
    assert ran.code == 3
    assert "not accepted: on down-step rms of the difference, vt: +" in ran.out
    assert "the limit is 1e-12 pu" in " ".join(ran.out.split())
    assert "\ncriteria: 2 not met\n" in ran.out
    ran = run("fit", case, "--no-plots", "--verbose")
    assert re.search(r"to fit +rms of the difference, +\S+ +1e-12 +pu +not met", ran.out)
    ran = run("validate", case, "--no-plots")
    assert ran.code == 3
    assert ran.out.splitlines()[1].startswith("not accepted: on fit")
    assert "\nnot accepted: on down-step" in ran.out


def test_a_file_of_criteria_judges_the_case_that_names_it(run):
    Path("limits").mkdir()
    rows = "limits: [{quantity: overshoot, limit: 5}, {quantity: rms, percent: 10, to: 2}]"
    file = Path("limits/planner.yaml")
    file.write_text(f"source: the planner\n{rows}\n")
    case = case_file(changed(CASE, ("criteria", {"file": "limits/planner.yaml"})))
    ran = run("fit", case, "--no-plots", "--json")
    assert ran.code == 0
    (match,) = json.loads(ran.out)["records"]
    outcomes = {each["quantity"]: each["outcome"] for each in match["criteria"]}
    assert outcomes == {"overshoot": "met", "rms": "met"}
    file.write_text("source: the planner\nlimits:\n  - {quantity: rme, limit: 1}\n")
    ran = run("fit", case, "--no-plots")
    assert ran.code == 1
    assert "planner.yaml:3: limits[0].quantity: 'rme' is not possible" in ran.err


def test_a_validation_much_worse_than_the_fit_ends_with_3_and_criteria_alone_judge(run):
    """The step down is that of a unit whose voltage is 5 % higher."""
    samples = columns("down.csv")
    Path("down.csv").write_text(csv_text(TIME, 1.05 * np.array(samples["v"], float)))
    ran = run("fit", case_file(), "--no-plots")
    assert ran.code == 3
    assert ran.out.count("\nnot accepted: on down-step the error is") == 1
    assert ran.out.index("\nparameter ") < ran.out.index("\nnot accepted: on down-step")
    assert "down-step is not accepted" in " ".join(ran.out.partition("\nverdict: ")[2].split())
    printed = json.loads(run("fit", case_file(), "--no-plots", "--json").out)
    (match,) = printed["validation"]
    assert not match["accepted"]
    assert match["reason"]
    assert run("validate", case_file(), "--no-plots").code == 3
    case = case_file(changed(CASE, rms_below(0.2)))
    assert run("fit", case, "--no-plots").code == 0
    assert run("validate", case, "--no-plots").code == 0


@pytest.mark.parametrize(
    "given",
    [["fit"], ["simulate", "a", "b"], ["fit", "a", "--strategy", "x"], ["none"], ["fit", "-z"]],
)
def test_wrong_usage_ends_with_2(run, given):
    ran = run(*given)
    assert ran.code == 2
    assert ran.out == ""
    assert "Usage" in ran.err


def test_the_strategy_option_goes_over_the_case(run):
    ran = run("fit", case_file(), "--no-plots", "--json", "--strategy", "gn")
    assert json.loads(ran.out)["strategy"] == "gn"


@pytest.mark.parametrize("source", ["--parameters", "last fit"])
def test_the_parameters_of_a_fit_give_its_response_again(run, source):
    case = case_file()
    run("fit", case, "--no-plots", "-q", "-o", "else where")
    response = columns("else where/response.csv")
    values = "else where/parameters.yaml"
    run("simulate", case, "--no-plots", "-q", "--parameters", values)
    assert columns("runs/case-simulate/response.csv")["vt"] == response["vt_simulated"]
    given = ["--parameters", values] if source == "--parameters" else []
    assert run("validate", case, "--no-plots", "-q", *given).code == 0
    again = columns("runs/case-validate/fit.csv")
    assert again["vt_simulated"] == response["vt_simulated"]
    assert columns("runs/case-validate/down-step.csv") == columns("else where/down-step.csv")


def test_a_validation_without_a_fit_says_what_to_give(run, workplace):
    case, before = case_file(), listing(workplace)
    words = ["case.yaml", "this case was not fitted yet", "--parameters"]
    is_refused(run("validate", case), words, before, workplace)


BY_HAND = ("--no-plots", "--parameters", "values.yaml", "--record")


def other_record(samples):
    """Return a record in a folder of its own."""
    other = Path("elsewhere/other.csv")
    other.parent.mkdir()
    other.write_text(csv_text(TIME, samples))
    return other


@pytest.mark.parametrize(("level", "size"), [(0.0, 1.0), (2.5, -1.0), (1.0, 0.25)])
def test_the_step_of_a_record_by_hand_is_found_in_it_whatever_the_case_stepped(run, level, size):
    """It takes the place of the validation; level, sign and size are those of the record."""
    other = other_record(level + size * TRUTH)
    ran = run("validate", case_file(), "--json", *BY_HAND, other)
    assert ran.code == 0
    fit, validation = json.loads(ran.out)["validation"]
    assert (fit["name"], validation["name"]) == ("fit", "other")
    (step,) = validation["steps"]
    assert step["found"] == ["instant", "size"]
    assert step["at"] == pytest.approx(0.5, abs=5e-3)
    assert step["size"] == pytest.approx(size, rel=5e-3)
    assert validation["rmse"] < 5e-3 * abs(size)
    stored = json.loads(Path("runs/case-validate/validation.json").read_text())
    assert restricted(stored, json.loads(ran.out)) == json.loads(ran.out)
    shown = run("validate", case_file(), *BY_HAND, other).out
    assert f"step: vref {step['size']:+.4g} pu at {step['at']:.4g} s, time and size" in shown


def test_the_report_of_a_validation_has_the_record_by_hand_and_whose_values_they_are(run):
    """The values are those in the folder of a fit; the steps are those that the record shows."""
    assert run("fit", case_file(), "--no-plots", "--quiet").code == 0
    other = other_record(2.0 - TRUTH)
    ran = run("validate", "case.yaml", "--parameters", "runs/case-fit", "--record", other)
    assert ran.code == 0
    assert ran.out.startswith("values of runs/case-fit/parameters.yaml")
    assert run("report", "runs/case-validate").code == 0
    page = Path("runs/case-validate/report.html").read_text(encoding="utf-8")
    assert "Simulated with values of runs/case-fit/parameters.yaml" in page
    command = (
        "exfit validate case.yaml -o runs/case-validate --parameters runs/case-fit/parameters.yaml"
    )
    assert f"{command} --record {other}" in page
    assert "time and size found in the record" in page
    # of a fit in the same folder the report is that of the fit
    assert run("validate", "case.yaml", "-o", "runs/case-fit", "--no-plots", "-q").code == 0
    assert run("report", "runs/case-fit").code == 0
    assert "Fitted parameters" in Path("runs/case-fit/report.html").read_text(encoding="utf-8")
    against = run("report", "runs/case-validate", "--against", "runs/case-fit")
    assert "--against compares fits, and this is a validation" in against.err


def test_a_model_as_found_is_validated_before_any_fit(run):
    ran = run("validate", case_file(), "--as-found", "--no-plots")
    assert ran.code == 3  # so far off is the start
    assert ran.out.startswith("the model as found, before any fit\nnot accepted: ")
    assert "\nvalidated: record (up.csv), down-step (" in ran.out
    refused = run("validate", "case.yaml", "--as-found", "--parameters", "values.yaml")
    assert (refused.code, refused.out) == (1, "")
    assert "--as-found and --parameters exclude each other" in refused.err


def test_a_step_that_is_given_takes_the_place_of_the_one_found(run):
    """Each alone, or both; a wrong one is not accepted."""
    other = other_record(2.0 - TRUTH)
    given = {(): 0, ("--step", -1.0): 0, ("--at", 0.5): 0, ("--step", 1.0, "--at", 0.5): 3}
    for options, code in given.items():
        ran = run("validate", case_file(), "--json", *BY_HAND, other, *options)
        assert ran.code == code, options
        (step,) = json.loads(ran.out)["validation"][-1]["steps"]
        assert ("size" in step["found"]) is ("--step" not in options)
        assert ("instant" in step["found"]) is ("--at" not in options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--record", "flat.csv"], ["flat.csv", "no step found", "--step SIZE and --at TIME"]),
        (["--record", "down.csv", "--at", 7], ["at: 7 s lies outside", "down.csv", "0 ... 3 s"]),
        (
            ["--record", "down.csv", "--step", 1, "--step", 2],
            ["step: 2 given for 1 step, at 0.5 s"],
        ),
        (["--record", "down.csv", "--at", 1, "--at", 0.5], ["0.5 s is not after 1 s"]),
        (["--step", 1], ["case.yaml", "step and at need a record with them: --record"]),
        (["--record", "dwon.csv"], ["dwon.csv", "No such file"]),
    ],
)
def test_a_record_by_hand_without_a_step_to_use_is_refused(run, workplace, options, words):
    case, before = case_file(), listing(workplace)
    ran = run("validate", case, "--parameters", "values.yaml", *options)
    is_refused(ran, words, before, workplace)


def test_nothing_to_validate_on_is_refused(run, workplace):
    case, before = case_file(changed(CASE, ("validate", []))), listing(workplace)
    ran = run("validate", case, "--parameters", "values.yaml")
    is_refused(
        ran,
        ["case.yaml: validate: missing", "the case has no record that was not fitted", "--record"],
        before,
        workplace,
    )


def test_the_fitted_record_does_not_validate_its_fit_and_the_command_says_so(run):
    ran = run("validate", case_file(), *BY_HAND, "up.csv")
    assert "up.csv was fitted (fit)" in " ".join(ran.out.split())


def test_a_record_that_is_called_fit_is_not_taken_for_the_fitted_one(run):
    shutil.copy("down.csv", "fit.csv")
    case = case_file(changed(CASE, rms_below(1e-6)))
    given = ["--parameters", "values.yaml", "--record", "fit.csv"]
    ran = run("validate", case, "--no-plots", "--json", *given)
    assert ran.code == 3
    fit, other = json.loads(ran.out)["validation"]
    assert (fit["accepted"], other["accepted"]) == (True, False)
    assert len(list(Path("runs/case-validate").glob("*.csv"))) == 2


def test_a_record_that_does_not_exist_is_reported(run, workplace):
    case, before = case_file(), listing(workplace)
    ran = run("validate", case, "--parameters", "values.yaml", "--record", "none.csv")
    is_refused(ran, ["none.csv", "No such file"], before, workplace)


def final_voltage():
    return float(columns("runs/case-simulate/response.csv")["vt"][-1])


def test_set_goes_over_parameters_and_both_over_the_case(run):
    case = case_file()
    run("simulate", case, "--no-plots", "-q")
    assert final_voltage() == pytest.approx(1.0 - np.exp(-2.5), rel=1e-6)
    run("simulate", case, "--no-plots", "-q", "--parameters", "values.yaml")
    assert final_voltage() == pytest.approx(2.0 * (1.0 - np.exp(-5.0)), rel=1e-6)
    given = ["--parameters", "values.yaml", "--set", "k=8", "--set", "k=6"]
    run("simulate", case, "--no-plots", "-q", *given)
    assert final_voltage() == pytest.approx(3.0 * (1.0 - np.exp(-5.0)), rel=1e-6)


def test_a_simulation_writes_every_signal_and_its_figures(run):
    ran = run("simulate", case_file())
    assert (ran.code, ran.err) == (0, "")
    names = {path.name for path in Path("runs/case-simulate").iterdir()}
    assert names == {"response.csv", "response.png", "overlay.png"}
    assert list(columns("runs/case-simulate/response.csv")) == ["t", "vref", "vt", "V"]


def test_a_simulation_of_a_machine_writes_its_field_and_all_states(run):
    case = case_file(MACHINE_CASE)
    assert run("simulate", case, "--no-plots", "-q", "--set", "machine.Tpd0=7").code == 0
    header = list(columns("runs/case-simulate/response.csv"))
    assert header[:5] == ["t", "vref", "vt", "efd", "ifd"]
    assert set(header[5:]) == {"EQP", "PSID", *MODELS["AC1A"].states}


def test_paths_are_relative_to_the_case_not_to_the_shell(run, tmp_path, monkeypatch):
    case = case_file(path="deep/er/case.yaml")
    for name in ("up.csv", "down.csv"):
        shutil.move(name, case.parent / name)
    monkeypatch.chdir(tmp_path)
    assert run("fit", Path("work") / case, "--no-plots", "-q").code == 0
    assert (tmp_path / "runs" / "case-fit" / "result.json").is_file()


@pytest.mark.long
def test_a_path_may_hold_spaces_brackets_and_letters_of_any_language(run):
    case = case_file(path="Prüfung [1] 試験/fall ä.yaml")
    for name in ("up.csv", "down.csv"):
        shutil.copy(name, case.parent / name)
    ran = run("fit", case)
    assert (ran.code, ran.err) == (0, "")
    assert "written to runs/fall ä-fit" in ran.out
    ran = run("validate", case, "--no-plots", "-o", "aus [2]")
    assert ran.code == 0
    assert "written to aus [2]" in ran.out


INTERRUPTED = """\
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
from exfit.cli import main
from exfit.output import live, terminal
show = live.LiveIterations.__call__
def interrupted(self, line):
    show(self, line)
    if line.number == 1:
        signal.raise_signal(signal.SIGINT)
live.LiveIterations.__call__ = interrupted
main()
"""


def test_ctrl_c_keeps_the_best_point_and_ends_with_3():
    ran = program(INTERRUPTED, "fit", case_file(), "--no-plots")
    assert ran.code == 3
    assert ran.err == "Interrupted: what was done until then is kept\n"
    assert "verdict: not converged: interrupted" in ran.out
    stored = json.loads(Path("runs/case-fit/result.json").read_text())
    assert stored["interrupted"]
    assert not stored["success"]
    assert stored["cost"] < stored["start_cost"]
    assert Path("runs/case-fit/parameters.yaml").read_text().splitlines()[0].endswith("interrupted")
    assert len(columns("runs/case-fit/history.csv")["f"]) == stored["nit"] + 1


SEARCH_INTERRUPTED = """\
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
from exfit.cli import main
from exfit import workflows
fit = workflows.fit
def interrupted(case, strategy, progress, search_progress, *others, **more):
    def watch(progress):
        search_progress(progress)
        if progress.done == 3:
            signal.raise_signal(signal.SIGINT)
    return fit(case, strategy, progress, watch, *others, **more)
workflows.fit = interrupted
main()
"""


@pytest.mark.long
def test_ctrl_c_in_a_search_from_further_starts_keeps_the_best_point_and_ends_with_3():
    case = case_file(changed(CASE, ("estimate", {"search": "global", "starts": 20})))
    ran = program(SEARCH_INTERRUPTED, "fit", case)
    assert (ran.code, ran.err) == (3, "Interrupted: what was done until then is kept\n")
    stored = json.loads(Path("runs/case-fit/result.json").read_text())
    assert stored["interrupted"]
    assert stored["cost"] <= stored["start_cost"]
    names = {path.name for path in Path("runs/case-fit").iterdir()}
    assert "note: interrupted in the search from further starts" in ran.out
    assert stored["success"]  # the descent from the start of the case was at its end
    assert sum(minimum["starts"] for minimum in stored["minima"]["minima"]) < 21
    assert names >= {"overlay.png", "starts.png", "response.csv", "parameters.yaml"}


@pytest.mark.parametrize("command", ["fit", "validate"])
def test_results_never_go_over_the_record_of_a_case(run, workplace, command):
    """The table of a validation is named after it, and so may its record be."""
    Path("down.csv").rename("down-step.csv")
    case = case_file(changed(CASE, ("validate.0.record.file", "down-step.csv")))
    before = listing(workplace)
    ran = run(*arguments(command, case), "-o", ".")
    is_refused(ran, ["down-step.csv", "overwritten", "-o"], before, workplace)
    assert run(*arguments(command, case), "-o", "elsewhere").code == 0


def test_a_comparison_never_goes_over_what_it_compares(run, workplace):
    Path("up.csv").rename("compare.csv")
    before = listing(workplace)
    ran = run("compare", "compare.csv", "down.csv", "-o", ".")
    is_refused(ran, ["compare.csv", "overwritten", "-o"], before, workplace)
    Path("compare.csv").rename("response.csv")  # which no comparison writes
    columns = ["--columns", "vt=v", "--time", "t"]
    assert run("compare", "response.csv", "down.csv", *columns, "--no-plots", "-o", ".").code == 0


@pytest.mark.long
def test_a_disk_that_is_full_leaves_the_former_files_and_shows_the_result(run, monkeypatch):
    case = case_file()
    assert run("fit", case, "--no-plots").code == 0
    folder = Path("runs/case-fit")
    before = {path: path.read_bytes() for path in folder.iterdir()}

    def full(path, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "_write_new", full)
    ran = run("fit", case)
    assert ran.code == 1
    assert ran.err == f"Error: {folder}: cannot be written: No space left on device\n"
    assert "verdict: " in ran.out
    assert "written to" not in ran.out
    printed = run("fit", case, "--json")
    assert (printed.code, printed.err) == (1, ran.err)
    assert json.loads(printed.out)["success"]
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_a_figure_that_fails_is_a_warning(run, monkeypatch):
    def broken(result):
        raise ZeroDivisionError("of its own")

    monkeypatch.setattr(plots, "convergence", broken)
    ran = run("fit", case_file())
    place = Path("runs/case-fit/convergence.png")
    assert ran.code == 0
    assert ran.err == f"Warning: {place}: not drawn: ZeroDivisionError: of its own\n"
    assert not place.exists()
    assert (place.parent / "trajectories.png").is_file()


@pytest.mark.long
def test_ctrl_c_while_drawing_ends_with_130_and_says_what_stands(run, monkeypatch):
    def interrupted(result):
        raise KeyboardInterrupt

    monkeypatch.setattr(plots, "convergence", interrupted)
    ran = run("fit", case_file())
    place = Path("runs/case-fit")
    assert ran.code == 130
    missing = "convergence.png, trajectories.png, sensitivity.png, correlation.png"
    text = f"{place}: all numbers are written, figures are missing: {missing}"
    assert ran.err.startswith(f"Interrupted: {text}")
    assert "verdict: " in ran.out
    assert (place / "overlay.png").is_file()
    assert json.loads((place / "result.json").read_text())["success"]


@pytest.mark.parametrize("option", few_of([None, "--json", "-q"], 1))
def test_results_are_written_and_shown_before_a_figure_is_drawn(run, monkeypatch, capsys, option):
    shown = []
    draw = FigureFiles.draw

    def drawn(self, *announce):
        shown.append(capsys.readouterr().out)
        assert json.loads(Path("runs/case-fit/result.json").read_text())["success"]
        return draw(self, *announce)

    monkeypatch.setattr(FigureFiles, "draw", drawn)
    monkeypatch.setattr(plots, "encoded", lambda picture: b"")
    ran = run("fit", case_file(), option or "--verbose")
    assert ran.code == 0
    (before,) = shown
    if option is None:
        assert "converged" in before
        last = [line for line in before.splitlines() if line[0:1] != " "][-1]
        assert last.startswith("verdict: ")
        lines = ran.out.splitlines()
        figures = {name for name in FILES_OF_A_FIT if name.endswith(".png")}
        assert {line.split()[0] for line in lines} == figures
        assert len({line.index(line.split(None, 2)[1]) for line in lines}) == 1
        assert max(map(len, lines)) <= WIDTH
    else:
        assert ran.out == ""
        assert bool(before) == (option == "--json")


def test_ctrl_c_elsewhere_ends_with_130_and_one_line(run, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(workflows, "simulate", interrupted)
    ran = run("simulate", case_file())
    assert (ran.code, ran.out, ran.err) == (130, "", "Interrupted\n")


@pytest.mark.parametrize("command", ["fit", "simulate", "validate"])
def test_a_folder_in_the_place_of_the_results_is_refused(run, workplace, command):
    case = case_file()
    name = {"fit": "result.json", "simulate": "response.csv", "validate": "validation.json"}
    (Path("runs") / name[command]).mkdir(parents=True)
    before = listing(workplace)
    ran = run(*arguments(command, case), "-o", "runs")
    is_refused(ran, [name[command], "it is a folder"], before, workplace)


@pytest.mark.long
def test_an_interruption_at_the_start_leaves_the_start_and_all_figures(run, monkeypatch):
    def stop(self, line):
        raise KeyboardInterrupt

    monkeypatch.setattr(live.LiveIterations, "__call__", stop)
    ran = run("fit", case_file())
    assert (ran.code, ran.err) == (3, "")
    stored = json.loads(Path("runs/case-fit/result.json").read_text())
    assert stored["interrupted"]
    assert stored["parameters"]["k"]["value"] == 1.0
    assert Path("runs/case-fit/trajectories.png").is_file()


OWN = (ROOT / "tests" / "support" / "own_model.py").read_text(encoding="utf-8")  # AC1A


def own_case(text):
    Path("own.py").write_text(text, encoding="utf-8")
    return case_file(
        changed(MACHINE_CASE, ("model", "own.py"), ("estimate", {"iterations": 2})), "own.yaml"
    )


@pytest.mark.long
def test_a_model_of_the_user_s_own_gives_the_same_fit(run):
    builtin = case_file(changed(MACHINE_CASE, ("estimate", {"iterations": 2})))
    found = json.loads(run("fit", builtin, "--no-plots", "--json").out)
    own = json.loads(run("fit", own_case(OWN), "--no-plots", "--json").out)
    assert own["parameters"] == found["parameters"]
    assert (own["cost"], own["nfev"]) == (found["cost"], found["nfev"])
    assert own["model"] == "OWN"
    assert own["inputs"].keys() == found["inputs"].keys() | {"model"}
    assert run("models", "own.py").code == 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        pytest.param("def rest(", "def rest((", ["SyntaxError"], id="syntax"),
        pytest.param("SHEET = ", "PAPER = ", ["lacks SHEET"], id="no sheet"),
        pytest.param("def rest(", "def still(", ["lacks rest"], id="no rest"),
        pytest.param("import Signal", "import Sgnal", ["ImportError"], id="import"),
        pytest.param(", p.TC,", ", p.TQ,", ["TQ", "declare"], id="unknown parameter"),
        pytest.param("u.vref +", "u.vreff +", ["vreff", "declare"], id="unknown input"),
        pytest.param("vc, d.VC", "vc, _", ["VC"], id="slope forgotten"),
        pytest.param("x.VC, x.VL", "_, x.VL", ["VC"], id="state at rest forgotten"),
        pytest.param(
            "    vr = clip(clip(va, u.vuel, u.voel), p.VRMIN, p.VRMAX)\n",
            "    vr = p.VRMAX if va > p.VRMAX else va\n",
            ["own.py:", "branch", "where"],
            id="branch",
        ),
        pytest.param(
            "return rectifier(ve,", "return rectifier(vee,", ["own.py:", "vee"], id="name"
        ),
        pytest.param(
            "(s: Signal, u: Signal, p", "(s: Signal, p", ["own.py", "arg"], id="arguments"
        ),
        pytest.param("return u.vc1 + error", "return None  #", ["own.py"], id="returns nothing"),
        pytest.param("error = vfe / p.KA", "error = vfe", ["rest"], id="rest that moves"),
    ],
)
def test_a_broken_model_of_the_user_s_own_is_reported(run, workplace, monkeypatch, old, new, words):
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert OWN.count(old) >= 1
    case = own_case(OWN.replace(old, new, 1))
    before = listing(workplace)
    ran = run("fit", case, "--no-plots")
    is_refused(ran, words, before, workplace)


@pytest.mark.parametrize("command", [None, *COMMANDS])
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_every_command_has_help_that_fits_80_columns(run, command, flag):
    ran = run(*([] if command is None else [command]), flag)
    assert (ran.code, ran.err) == (0, "")
    assert max(map(len, ran.out.splitlines())) <= WIDTH
    # nothing is cut off: KA=400 ... and the like do not occur in help
    assert "..." not in ran.out.replace("]...", "")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_explained(command):
    for one in COMMANDS[command].params:
        if isinstance(one, click.Option):
            assert one.help, one.name


def test_the_schema_is_one_and_accepts_the_cases(run):
    ran = run("schema")
    assert (ran.code, ran.err) == (0, "")
    schema = json.loads(ran.out)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for path in CONFIGS:
        validator.validate(yaml.safe_load(path.read_text()))
    assert not validator.is_valid({**CASE, "estimat": {}})


def test_the_catalogue_names_every_model_and_machine(run):
    ran = run("models")
    assert ran.code == 0
    assert {line.split()[0] for line in ran.out.splitlines() if line} >= {*MODELS, *MACHINES}


@pytest.mark.each_model
@pytest.mark.parametrize("name", [None, *MODELS, *MACHINES, "esac1a"])
def test_models_are_described_in_80_columns_with_nothing_cut_off(run, name):
    ran = run("models", *([] if name is None else [name]))
    assert (ran.code, ran.err) == (0, "")
    assert max(map(len, ran.out.splitlines())) <= WIDTH
    assert "…" not in ran.out


@pytest.mark.each_model
@pytest.mark.parametrize("name", [*MODELS, *MACHINES])
def test_a_data_sheet_holds_every_parameter_with_its_meaning(run, name):
    words = set(run("models", name).out.split())
    for row in {**MODELS, **MACHINES}[name].sheet:
        assert row.symbol in words
        assert set(row.meaning.split()) <= words


@pytest.mark.parametrize("name", ["AC1A", "GENROU"])
def test_the_parameters_that_a_new_case_frees_are_listed_below_a_data_sheet(run, name):
    free = [row.symbol for row in {**MODELS, **MACHINES}[name].sheet if row.free]
    lines = run("models", name).out.splitlines()
    last = [f"free in the case of `exfit new`: {', '.join(free)}"] if free else []
    assert [line for line in lines if line.startswith("free")] == last


@pytest.mark.parametrize("name", ["AC1A", "DC4C", "OEL3C", "PSS4C"])
def test_what_is_not_settled_about_a_diagram_is_noted_below_its_data_sheet(run, name):
    described = {**MODELS, **LIMITERS, **STABILISERS}[name]
    _, _, note = run("models", name).out.partition("note: ")
    assert note.split() == (f"{name} {described.doubt}".split() if described.doubt else [])
    assert bool(described.doubt) == (name != "AC1A")


def test_an_unknown_model_is_reported_with_the_known_ones(run, workplace):
    is_refused(
        run("models", "AC1B"), ["AC1B", "AC1A", "did you mean"], listing(workplace), workplace
    )


CHECKED = ("ac8b_on_line", "machine_playback")  # by default: a plant each


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[] if path.stem in CHECKED else [pytest.mark.long])
        for path in CONFIGS
    ],
)
def test_every_case_of_configs_simulates_and_passes_its_check(run, path):
    assert run("simulate", path, "--no-plots", "-q").code == 0
    ran = run("check", path)
    assert ran.code == 0, ran.out
    assert "derivatives agree" in ran.out
    assert "stays at rest" in ran.out
    assert max(map(len, ran.out.splitlines())) <= WIDTH


def test_a_check_that_fails_ends_with_3(run, monkeypatch):
    monkeypatch.setattr("exfit.workflows.model_check.AGREEMENT", 0.0)
    ran = run("check", case_file())
    assert ran.code == 3
    assert "DISAGREE" in ran.out


def lines(count):
    for number in range(count):
        yield Iteration(number, "dgn", 1e-300, 1e-10, 1e-10, 1e-10, 30, 9999, 9999, 0.5, {})


@pytest.mark.parametrize("width", [80, 120])
def test_a_terminal_shows_the_last_iterations_whole(width):
    screen = StringIO()
    console = Console(file=screen, force_terminal=True, width=width, height=24, color_system=None)
    with live.LiveIterations(console, "case: AC1A").running() as watch:
        for line in lines(30):
            watch(line)
    last = screen.getvalue().rpartition("earlier iterations)")[2]
    rows = [row.split() for row in last.splitlines() if "dgn" in row]
    assert [row[0] for row in rows] == [str(number) for number in range(18, 30)]
    counts = ["30", "dgn", "-", "-", "9999"]
    cells = ["1.0000e-300", *["1.00e-10"] * 3, *counts[: 5 if width > 80 else 4]]
    assert rows[-1][1:] == cells
    assert "…" not in screen.getvalue()


def test_more_validations_than_fit_beside_each_other_stand_below_each_other(run):
    many = [
        {**CASE["validate"][0], "name": f"repetition-{number}-of-the-down-step"}
        for number in range(4)
    ]
    ran = run("fit", case_file(changed(CASE, ("validate", many))), "--no-plots")
    assert "…" not in ran.out
    assert max(map(len, ran.out.splitlines())) <= WIDTH
    for one in many:
        assert one["name"] in ran.out


def test_the_program_starts_as_a_command_and_as_a_pipe(tmp_path):
    program = shutil.which("exfit", path=str(Path(sys.executable).parent))
    start = [program] if program else [sys.executable, "-m", "exfit.cli"]
    if not program:
        pytest.skip("exfit is not installed as a command")
    case = case_file()
    ran = subprocess.run(
        [*start, "fit", str(case), "--no-plots", "--json"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    assert json.loads(ran.stdout)["success"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        pytest.param(("record.file", "flat.csv"), "vt is 1 pu throughout", id="flat"),
        pytest.param(
            ("record.channels.vt", {"column": "v", "scale": 0.0}),
            "must not be 0",
            id="scaled away",
        ),
        pytest.param(
            ("record.channels.vt", {"column": "v", "scale": 1e200}), "exceeds", id="overflow"
        ),
    ],
)
def test_a_record_that_shows_no_test_is_refused(run, change, words):
    ran = run("fit", case_file(changed(CASE, change)), "--no-plots")
    assert (ran.code, ran.out) == (1, "")
    assert words in ran.err


def test_a_record_with_fewer_samples_than_unknowns_is_refused(run):
    ran = run("fit", case_file(changed(MACHINE_CASE, ("record.window", [0.45, 0.6]))), "--no-plots")
    assert ran.code == 1
    assert "4 samples for 7 free parameters" in ran.err


@pytest.mark.long
def test_a_fit_no_better_than_a_constant_ends_with_3_and_says_why(run):
    """The step is given with the wrong sign: every value runs to a bound, and none helps."""
    wrong = changed(MACHINE_CASE, ("test.vref.0.step", -0.05), ("estimate", {"iterations": 5}))
    ran = run("fit", case_file(wrong), "--no-plots")
    assert ran.code == 3
    told = " ".join(ran.out.split())
    assert "cause: " in told[: told.index("verdict: no match: the response goes the other way")]
    assert "converged" not in told


def test_a_search_that_was_cut_short_ends_with_3_though_its_best_point_converged(run, monkeypatch):
    found = workflows.fit
    monkeypatch.setattr(
        "exfit.workflows.fit",
        lambda *given, **more: replace(found(*given, **more), interrupted=True),
    )
    ran = run("fit", case_file(), "--no-plots")
    assert ran.code == 3
