"""exfit fit of several cases with several strategies: files, tables, exit codes."""

import csv
import io
import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH, with_local_search
from matplotlib.figure import Figure
from places import CONFIGS, SAMPLES
from rich.console import Console
from tiers import few_of

from exfit import workflows
from exfit.errors import ExfitError
from exfit.output import figures as plots
from exfit.output import run_folder, terminal
from exfit.results.verdict import GOOD, MATCHES, NOT_CONVERGED

BOTH = ("--strategy", "dgn", "--strategy", "lm")
WIDTH = 80
OF_ONE_FIT = ("overlay", "iterations", "convergence", "trajectories", "sensitivity", "correlation")


@pytest.fixture(autouse=True)
def workplace(empty_folder, monkeypatch):
    """Work in a folder with a record of FIRST_ORDER, and draw little."""
    rows = (f"{t:.6g},{v:.9g}" for t, v in zip(TIME, TRUTH, strict=True))
    (empty_folder / "up.csv").write_text("\n".join(["t,v", *rows]) + "\n")
    monkeypatch.setattr(plots.style, "DPI", 40)
    for name in OF_ONE_FIT:
        monkeypatch.setattr(plots, name, lambda *_: Figure(figsize=(1, 1)))
    return empty_folder


def case_file(name, **changes):
    record = {"file": str(Path("up.csv").absolute()), "time": "t", "channels": {"vt": "v"}}
    path = Path(name)
    path.parent.mkdir(exist_ok=True)
    content = with_local_search({**FIRST_ORDER, "record": record, **changes})
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


@pytest.mark.long
def test_each_fit_has_its_folder_and_all_have_one_table_and_one_figure(run):
    cases = [case_file("one/unit.yaml"), case_file("two/unit.yaml", estimate={"iterations": 1})]
    ran = run("fit", *cases, *BOTH)
    assert (ran.code, ran.err) == (3, "")  # one iteration is not enough
    folder = Path("runs/fits")
    runs = ["one-unit-dgn", "one-unit-lm", "two-unit-dgn", "two-unit-lm"]
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        [*runs, "fits.csv", "fits.json", "fits.png"]
    )
    header, *lines = csv.reader((folder / "fits.csv").read_text().splitlines())
    rows = {line[0]: dict(zip(header, line, strict=True)) for line in lines}
    assert [*rows] == runs
    stored = json.loads((folder / "fits.json").read_text())
    for entry in stored["runs"]:
        alone = json.loads((folder / entry["name"] / "result.json").read_text())
        assert alone["cost"] == entry["result"]["cost"]
        assert float(rows[entry["name"]]["f"]) == pytest.approx(alone["cost"], rel=1e-8)
        assert rows[entry["name"]]["outcome"] == entry["outcome"]
        assert (folder / entry["name"] / "overlay.png").is_file()
    outcomes = [entry["outcome"] for entry in stored["runs"]]
    assert {*outcomes[:2]} <= {GOOD, MATCHES}
    assert outcomes[2:] == [NOT_CONVERGED] * 2
    assert max(map(len, ran.out.splitlines())) <= WIDTH
    for words in (*runs, "one-unit: FIRST_ORDER", "iterations", "simulations", "written to runs"):
        assert words in ran.out


def test_json_is_one_document_and_quiet_is_silent(run):
    cases = [case_file("a.yaml"), case_file("b.yaml")]
    ran = run("fit", *cases, "--json", "--no-plots", "-o", "out")
    assert ran.code == 0
    assert json.loads(ran.out) == json.loads(Path("out/fits.json").read_text())
    assert not [*Path("out").rglob("*.png")]
    assert run("fit", *cases, "--quiet", "--no-plots", "-o", "out")[:2] == (0, "")


@pytest.mark.long
def test_values_given_beside_the_cases_are_the_starts_of_all_fits(run):
    cases = [case_file("a.yaml"), case_file("b.yaml")]
    ran = run("fit", *cases, *BOTH, "--set", "k=3", "--json", "--no-plots")
    assert ran.code == 0
    starts = [entry["result"]["parameters"]["k"]["start"] for entry in json.loads(ran.out)["runs"]]
    assert starts == [3.0] * 4
    refused = run("fit", *cases, *BOTH, "--set", "q=3")
    assert (refused.code, refused.out) == (1, "")
    assert "q" in refused.err


def test_a_validation_that_is_not_accepted_is_explained_below_the_table(run):
    wrong = {"name": "down", "test": {"vt0": 0.0, "vref": [{"at": 0.5, "step": 2.0}]}, **again()}
    ran = run("fit", case_file("a.yaml", validate=[wrong]), *BOTH, "--no-plots")
    assert ran.code == 3
    assert "dgn: not accepted: " in ran.out
    assert "lm: not accepted: " in ran.out
    assert max(map(len, ran.out.splitlines())) <= WIDTH


@pytest.mark.long
@pytest.mark.parametrize(
    ("estimate", "options", "alone"),
    [
        ({}, (), True),
        *few_of(
            [
                ({}, ("--search", "global"), False),
                ({"search": "global"}, (), False),
                ({"starts": 2}, (), False),
            ],
            1,
        ),
    ],
)
def test_several_strategies_are_compared_by_their_descents_unless_more_is_asked(
    run, estimate, options, alone
):
    """Full steps alone end 130 times as high: a global search hides that."""
    content = yaml.safe_load((CONFIGS / "ac1a_typical.yaml").read_text())
    del content["validate"]
    content["record"]["file"] = str(SAMPLES / "ac1a_up.csv")
    Path("a.yaml").write_text(yaml.safe_dump({**content, "estimate": estimate}))
    ran = run("fit", "a.yaml", "--strategy", "gn", "--strategy", "lm", "--no-plots", *options)
    runs = json.loads(Path("runs/fits/fits.json").read_text())["runs"]
    full_steps, damped = (entry["result"]["cost"] for entry in runs)
    assert (full_steps > 100.0 * damped) == alone
    assert ("one run from the start of its case" in ran.out) == alone


def test_one_case_with_one_strategy_is_a_fit_as_ever(run):
    ran = run("fit", case_file("a.yaml"), "--strategy", "lm", "--no-plots")
    assert ran.code == 0
    assert Path("runs/a-fit/result.json").is_file()
    assert not Path("runs/fits").exists()


def test_faults_of_all_cases_are_reported_and_nothing_is_written(run):
    bad = [case_file("key.yaml", estimat={}), case_file("model.yaml", model="AC1B")]
    ran = run("fit", case_file("good.yaml"), *bad, "none.yaml")
    assert (ran.code, ran.out) == (1, "")
    for words in ("key.yaml:", "model.yaml:", "none.yaml"):
        assert words in ran.err
    assert not Path("runs").exists()
    twice = run("fit", "good.yaml", "./good.yaml")
    assert (twice.code, twice.out) == (1, "")
    assert "given 2 times" in twice.err


def test_results_never_replace_a_file_of_a_case(run):
    Path("up.csv").rename("fits.csv")
    record = {"file": str(Path("fits.csv").absolute()), "time": "t", "channels": {"vt": "v"}}
    ran = run("fit", case_file("a.yaml", record=record), *BOTH, "-o", ".")
    assert (ran.code, ran.out) == (1, "")
    assert "overwritten" in ran.err
    assert "-o" in ran.err


def test_watch_is_for_one_fit(run):
    ran = run("fit", case_file("a.yaml"), *BOTH, "--watch")
    assert ran.code == 2
    assert "one case and one strategy" in ran.err


def test_a_folder_that_cannot_be_written_costs_no_other_fit(run, monkeypatch):
    """It appears after the check; the other fits are done, and the error comes last."""
    write = run_folder.write_fit

    def failing(result, folder):
        if folder.name == "a-dgn":
            folder.mkdir(parents=True)
            (folder / "result.json").mkdir()
        return write(result, folder)

    monkeypatch.setattr(run_folder, "write_fit", failing)
    ran = run("fit", case_file("a.yaml"), *BOTH, "--no-plots")
    assert ran.code == 1
    assert "a-dgn: " in ran.err
    assert Path("runs/fits/a-lm/result.json").is_file()
    assert [*json.loads(Path("runs/fits/fits.json").read_text())["failed"]] == ["a-dgn"]


def test_where_no_fit_could_be_run_the_faults_are_all_that_is_shown(run, monkeypatch):
    def failing(*_, **__):
        raise ExfitError("the record has gone")

    monkeypatch.setattr(workflows, "fit", failing)
    ran = run("fit", case_file("a.yaml"), *BOTH)
    assert ran.code == 1
    assert ran.err.splitlines() == [
        f"{start}a-{name}: the record has gone"
        for start, name in (("Error: ", "dgn"), ("       ", "lm"))
    ]
    assert sorted(path.name for path in Path("runs/fits").iterdir()) == ["fits.csv", "fits.json"]


def test_the_fit_with_the_lowest_cost_is_the_last_fit_of_its_case(run):
    case = case_file("a.yaml", validate=[{"name": "again", "test": FIRST_ORDER["test"], **again()}])
    assert run("fit", case, "--strategy", "lm", "--strategy", "gn", "--no-plots").code in (0, 3)
    series = json.loads(Path("runs/fits/fits.json").read_text())
    lowest = min((entry["result"] for entry in series["runs"]), key=lambda fit: fit["cost"])
    shown = run("validate", case, "--json", "--no-plots")
    assert shown.code == 0
    assert json.loads(shown.out)["validation"][0]["cost"] == pytest.approx(lowest["cost"], rel=1e-9)


def again():
    return {
        "record": {"file": str(Path("up.csv").absolute()), "time": "t", "channels": {"vt": "v"}}
    }


INTERRUPTED = """\
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
from exfit.cli import main
from exfit.output import live
show = live.SeriesProgress.__call__
def interrupted(self, fit, progress):
    show(self, fit, progress)
    if fit.name == "b-lm" and progress.number == 1:
        signal.raise_signal(signal.SIGINT)
live.SeriesProgress.__call__ = interrupted
main()
"""


@pytest.mark.long  # a process of its own
def test_ctrl_c_keeps_what_is_done_and_ends_with_3():
    cases = [str(case_file(f"{name}.yaml")) for name in "abc"]
    ran = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, "fit", *cases, "--strategy", "lm", "--no-plots"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ran.returncode == 3
    assert ran.stderr == "Interrupted: what was done until then is kept\n"
    assert "not run (interrupted): c-lm" in ran.stdout
    folder = Path("runs/fits")
    stored = json.loads((folder / "fits.json").read_text())
    done, stopped = (entry["outcome"] for entry in stored["runs"])
    assert done in (GOOD, MATCHES)
    assert stopped == "interrupted"
    assert (stored["not_run"], stored["interrupted"]) == (["c-lm"], True)
    for entry in stored["runs"]:
        whole = json.loads((folder / entry["name"] / "result.json").read_text())
        assert whole["cost"] == entry["result"]["cost"]
    assert not (folder / "c-lm").exists()


@pytest.mark.parametrize("width", few_of([40, 80, 200], 1))
def test_a_terminal_shows_the_fit_that_runs_and_no_line_is_too_wide(run, monkeypatch, width):
    stream = io.StringIO()
    screen = Console(file=stream, force_terminal=True, color_system=None, width=width)
    monkeypatch.setattr(terminal, "console", lambda: screen)
    strategies = [
        word for name in ("dgn", "lm", "lm-then-dgn", "robust") for word in ("--strategy", name)
    ]
    assert run("fit", case_file("a.yaml"), *strategies, "--no-plots").code == 0
    printed = stream.getvalue()
    assert "1 of 4: a-dgn, iteration" in printed
    table = printed.rpartition("a: FIRST_ORDER")[2].splitlines()
    tables = sum("simulations" in line for line in table)
    assert tables > 1 if width == 40 else tables == 1
    rows = [line for line in table if line.startswith(("k ", "f ", "simulations"))]
    assert max(map(len, rows)) <= width
