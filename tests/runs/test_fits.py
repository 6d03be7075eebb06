"""Fits of several cases with several strategies: all are checked first, and none is lost."""

import csv
from pathlib import Path

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH, with_local_search

import exfit
from exfit.errors import CaseError
from exfit.results.side_by_side import parameters_beside, results_table
from exfit.runs.fits import fit_all, planned, run_all
from exfit.runs.runner import distinct_names

STRATEGIES = ("dgn", "lm")
STEP = FIRST_ORDER["test"]
NOISE = 1e-3


@pytest.fixture(autouse=True)
def workplace(tmp_path, monkeypatch):
    """Work in a folder with a record of FIRST_ORDER."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    samples = TRUTH + NOISE * rng.standard_normal(len(TIME))
    rows = (f"{t:.6g},{v:.9g}" for t, v in zip(TIME, samples, strict=True))
    Path("record.csv").write_text("\n".join(["t,v", *rows]) + "\n")
    return tmp_path


def case_file(name, **changes):
    record = {"file": str(Path("record.csv").absolute()), "time": "t", "channels": {"vt": "v"}}
    path = Path(name)
    path.parent.mkdir(exist_ok=True)
    content = with_local_search({**FIRST_ORDER, "record": record, **changes})
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


@pytest.mark.long
def test_every_case_is_fitted_with_every_strategy_as_it_is_alone():
    cases = [case_file("a.yaml"), case_file("b.yaml", estimate={"iterations": 2})]
    series = fit_all(cases, STRATEGIES)
    assert [*series.results] == ["a-dgn", "a-lm", "b-dgn", "b-lm"]
    for name, result in series.results.items():
        stem, strategy = name.split("-")
        alone = exfit.fit(f"{stem}.yaml", strategy)
        assert result.cost == alone.cost
        assert result.values == alone.values
    assert [*series.by_case] == ["a", "b"]
    assert not series.all_hold  # two iterations are not enough


def test_without_a_strategy_each_case_has_its_own():
    cases = [case_file("a.yaml", estimate={"strategy": "lm"}), case_file("b.yaml")]
    assert [fit.name for fit in planned(cases, [])] == ["a-lm", "b-lm-then-dgn"]
    series = exfit.fit_all(cases)
    assert series.all_hold
    assert [result.strategy_given for result in series.results.values()] == [False, False]


def no_record(name):
    return {"file": name, "time": "t", "channels": {"vt": "v"}}


def test_the_faults_of_all_cases_are_reported_before_any_fit():
    cases = [
        case_file("good.yaml"),
        case_file("key.yaml", estimat={}),
        case_file("record.yaml", record=no_record("none.csv")),
        case_file(
            "later.yaml", validate=[{"name": "x", "test": STEP, "record": no_record("no.csv")}]
        ),
        Path("missing.yaml"),
    ]
    fitted = []
    with pytest.raises(CaseError) as refused:
        fit_all([*cases, "good.yaml"], ["lm", "magic"], finished=fitted.append)
    text = str(refused.value)
    for words in (
        "key.yaml:",
        "none.csv",
        "no.csv",
        "missing.yaml",
        "'magic'",
        "case good.yaml: given 2",
    ):
        assert words in text
    assert fitted == []


def test_cases_of_one_stem_and_strategies_that_look_like_stems_keep_apart():
    paths = [Path("a/unit.yaml"), Path("b/Unit.yaml"), Path("c/a/unit.yaml"), Path("x.yaml")]
    assert distinct_names(paths) == ["a-unit", "b-Unit", "a-unit-2", "x"]
    cases = [case_file(f"{name}.yaml") for name in ("a", "a-lm-then")]
    names = [fit.name for fit in planned(cases, ["lm-then-dgn", "dgn"])]
    assert names == ["a-lm-then-dgn", "a-dgn", "a-lm-then-lm-then-dgn", "a-lm-then-dgn-2"]


def test_an_interruption_keeps_what_is_done_and_the_best_point_of_the_fit_that_runs():
    cases = [case_file(f"{name}.yaml") for name in "abc"]

    def interrupt(fit, progress):
        if fit.name == "b-lm" and progress.number == 2:
            raise KeyboardInterrupt

    series = fit_all(cases, ["lm"], progress=interrupt)
    assert [*series.results] == ["a-lm", "b-lm"]
    assert series.not_run == ("c-lm",)
    stopped = series.results["b-lm"]
    assert (stopped.interrupted, stopped.nit) == (True, 2)
    assert stopped.cost < stopped.start_cost
    assert series.interrupted
    assert not series.all_hold
    assert series.to_dict()["not_run"] == ["c-lm"]


def test_a_fit_that_fails_keeps_no_other_from_running():
    cases = [case_file(f"{name}.yaml") for name in "ab"]
    plan = planned(cases, ["lm"])
    Path("record.csv").write_text("t,v\n0,0\n")
    good = planned([case_file("c.yaml", record=other_record())], ["lm"])
    series = run_all([*plan, *good])
    assert [*series.failed] == ["a-lm", "b-lm"]
    assert run_all(plan).results == {}
    assert [*series.results] == ["c-lm"]
    assert not series.all_hold


def other_record():
    rows = (f"{t:.6g},{v:.9g}" for t, v in zip(TIME, TRUTH, strict=True))
    Path("other.csv").write_text("\n".join(["t,v", *rows]) + "\n")
    return {"file": "other.csv", "time": "t", "channels": {"vt": "v"}}


def test_the_table_has_a_line_for_each_fit_and_blanks_where_a_model_has_no_such_parameter():
    free = FIRST_ORDER["parameters"]["free"]
    fixed = {"free": {"k": free["k"]}, "fixed": {"a": 2.0}}
    series = fit_all([case_file("a.yaml"), case_file("b.yaml", parameters=fixed)], ["lm"])
    first, second = series.results.values()
    beside = parameters_beside([first, second])
    assert [*beside] == ["k", "a"]
    (fitted, given) = beside["a"]
    assert (fitted.value, fitted.fitted) == (first.values["a"], True)
    assert (given.value, given.fitted, given.resolved) == (2.0, False, True)
    runs = {run.name: (run.case_name, run.result) for run in series.runs}
    header, *lines = csv.reader(results_table(runs).splitlines())
    rows = [dict(zip(header, line, strict=True)) for line in lines]
    assert [row["run"] for row in rows] == ["a-lm", "b-lm"]
    assert float(rows[0]["k"]) == pytest.approx(first.values["k"], rel=1e-8)
    assert float(rows[1]["f"]) == pytest.approx(second.cost, rel=1e-8)
    assert {row["outcome"] for row in rows} == {"good"}
