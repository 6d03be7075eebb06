"""Programmes: their order, what each test gives the later ones, and what is not run again."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import whole_unit
from places import CONFIGS
from programmes import OF_MACHINE, TRUTH, programme_content, written
from tiers import few_of

import exfit
from exfit import workflows
from exfit.errors import CaseError, ExfitError
from exfit.features.programme import run as running
from exfit.features.programme.folder import load_summary, result_kept, summary_text
from exfit.features.programme.programme import load_programme
from exfit.features.programme.result import ProgrammeStep
from exfit.results.verdict import GOOD, MATCHES, NOT_CONVERGED
from exfit.util.files import write

ORDER = ["saturation", "v-curve", OF_MACHINE, "fit"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("programme")


@pytest.fixture(scope="module")
def whole(folder):
    """Return a programme that has been run, its results kept in a folder."""
    return exfit.run(written(programme_content(), folder), folder / "run")


@pytest.fixture
def again(folder, whole, tmp_path):
    """Return what runs another content where the results are kept; nothing is kept of that."""

    def run(content, **options):
        ran = []

        def progress(step, iteration):
            if iteration is None:  # it begins
                ran.append(step.name)

        path = written(content, tmp_path)
        places = {"folder": folder / "run", "keep": lambda *_: None}
        return exfit.run(path, progress=progress, **places, **options), ran

    return run


@pytest.mark.long
def test_both_halves_of_a_unit_are_found_in_one_programme():
    result = exfit.run(CONFIGS / "programmes" / "hydro_unit.yaml").fit
    assert result.verdict.verdict in (GOOD, MATCHES)
    governor = {f"governor.{name}": value for name, value in whole_unit.GOVERNOR.items()}
    known = whole_unit.EXCITER | governor
    for name, parameter in result.parameters.items():
        low, high = parameter.interval
        assert low < known[name] < high, name


@pytest.mark.long
def test_what_measures_the_machine_comes_before_what_needs_it(whole):
    assert [test.name for test in whole.tests] == ORDER
    assert whole.tests[-1].tests == ("up", "down")
    assert whole.holds


def test_what_a_test_measured_enters_the_later_ones_with_its_source(whole):
    fit = whole.fit
    for value in whole.values:
        if value.name.startswith("machine."):
            assert fit.machine[value.name.removeprefix("machine.")] == value.value
            assert fit.sources[value.name] == value.source
            assert fit.given_values[value.name].source == f"test {value.test}"
    sources = {value.name: (value.test, value.source) for value in whole.values}
    assert sources == {
        "machine.S10": ("saturation", "measured"),
        "machine.S12": ("saturation", "measured"),
        "ifd.base": ("saturation", "measured"),
        "machine.Xd": ("v-curve", "measured"),
        "machine.Tpd0": (OF_MACHINE, "fitted"),
    }
    v_curve = whole.results["v-curve"]
    assert v_curve.readings["ifd"].base == whole.results["saturation"].curve.ifd_base.value
    assert v_curve.given["S10"] == fit.machine["S10"]


def test_the_intervals_of_the_example_hold_the_unit_that_it_was_made_with(whole):
    truth = {"machine.S10": 0.12, "machine.S12": 0.4, "ifd.base": 850.0, "machine.Xd": 1.8}
    values = {value.name: value.interval for value in whole.values}
    assert {name for name, at in truth.items() if values[name][0] < at < values[name][1]} == {
        *truth
    }


def test_the_errors_of_what_a_test_measured_enter_the_later_fits(whole):
    """By the wider side of its interval at 95 %, which is 1.96 standard errors."""
    entered = {value.name: value for value in whole.values}
    given = whole.fit.knowledge.given_errors
    of_tests = {"machine.S10", "machine.S12", "machine.Xd", "machine.Tpd0"}
    assert of_tests <= {*given}
    for name in of_tests:
        value, error = entered[name], given[name]
        sides = np.abs(np.array(value.interval) - value.value)
        assert error.std_error == pytest.approx(np.max(sides) / 1.96)
    of_machine = whole.results[OF_MACHINE].knowledge.given_errors
    assert {"machine.S10", "machine.S12", "machine.Xd"} <= {*of_machine}
    for name, parameter in whole.fit.parameters.items():
        low, high = parameter.interval
        assert low < TRUTH[name] < high
        shifts = [abs(given[value].shifts[name]) for value in of_tests]
        assert high - low > 3.9 * max(shifts)


def test_a_standard_error_of_the_file_is_not_that_of_what_a_test_fits(folder):
    content = programme_content()
    content["plant"]["parameters"] |= {
        "Tpd0": {"value": 5.2, "std_error": 0.2},
        "Xq": {"value": 1.72, "source": "maker", "std_error": 0.1},
    }
    programme = load_programme(written(content, folder, "errors.yaml"))
    assert programme.case_of(OF_MACHINE).std_errors() == {"machine.Xq": 0.1}
    assert programme.case_of("fit").std_errors() == {"machine.Tpd0": 0.2, "machine.Xq": 0.1}


def test_the_bump_tests_are_one_fit_with_its_validation(whole):
    assert [match.name for match in whole.fit.comparisons] == ["up"]
    assert [match.name for match in whole.fit.validation] == ["down"]


@pytest.mark.long
def test_a_case_is_the_programme_of_one_test(folder):
    content = programme_content()
    up = next(test for test in content.pop("tests") if test["name"] == "up")
    content |= {"test": up["test"], "record": up["record"]}
    content["plant"]["parameters"] |= {"S10": 0.12, "S12": 0.4}
    path = written(content, folder, "case.yaml")
    (test,), fit = exfit.run(path).tests, workflows.fit(path)
    assert test.name == "fit"
    assert test.result.values == fit.values
    assert test.result.cost == fit.cost
    assert test.result.verdict == fit.verdict


def test_what_is_kept_is_not_run_again_and_is_the_same(again, whole):
    result, ran = again(programme_content())
    assert ran == []
    assert result.values == whole.values
    assert result.fit.values == whole.fit.values
    assert [test.key for test in result.tests] == [test.key for test in whole.tests]
    assert [test.kept for test in result.tests] == [True] * len(ORDER)


@pytest.mark.long
def test_again_runs_all(again):
    _, ran = again(programme_content(), again=True)
    assert ran == ORDER


def test_facts_about_the_unit_are_no_reason_to_run_a_test_again(again):
    result, ran = again(programme_content() | {"about": {"Unit": 7}})
    assert ran == []
    assert result.fit.about == {"Unit": 7}
    assert "Unit: 7" in result.fit.case_text


@pytest.mark.long
def test_a_test_whose_section_changes_is_run_again_and_the_others_only_for_its_values(again):
    content = programme_content()
    content["tests"][1]["free"]["Xd"]["max"] = 2.9  # far from the value: it stays the same
    result, ran = again(content)
    xd = {value.name: value.value for value in result.values}["machine.Xd"]
    before = again(programme_content())[0].values
    if xd == {value.name: value.value for value in before}["machine.Xd"]:
        assert ran == ["v-curve"]
    else:
        assert ran == ORDER[1:]


def test_a_record_that_changes_is_a_reason(again, tmp_path):
    content = programme_content()
    up = next(test for test in content["tests"] if test["name"] == "up")
    lines = Path(up["record"]["file"]).read_text(encoding="utf-8").splitlines()
    changed = tmp_path / "up.csv"
    changed.write_text("\n".join([*lines[:-1], ""]), encoding="utf-8")
    up["record"] = {**up["record"], "file": str(changed)}
    _, ran = again(content)
    assert ran == ["fit"]


@pytest.mark.long
def test_a_value_of_a_better_source_stays_and_what_excludes_it_is_reported(again):
    content = programme_content()
    content["plant"]["parameters"]["Xd"] = {"value": 1.9, "source": "maker"}
    result, ran = again(content)
    assert ran == ORDER  # the sources belong to every test
    (xd,) = (value for value in result.values if value.name == "machine.Xd")
    assert not xd.entered
    assert result.fit.machine["Xd"] == 1.9
    assert result.fit.sources["machine.Xd"] == "maker"
    assert result.warnings[0].startswith("machine.Xd: 1.9 in the file (maker) lies outside 1.77")


@pytest.mark.long
def test_a_base_that_the_file_gives_stays(again):
    content = programme_content()
    content["tests"][1]["columns"]["ifd"]["base"] = 900.0
    content["tests"][1]["free"] = {}
    result, _ = again(content)
    assert result.results["v-curve"].readings["ifd"].base == 900.0
    assert any(text.startswith("ifd.base: 900 in the file") for text in result.warnings)


@pytest.mark.long
def test_a_test_that_is_not_matched_gives_nothing(again):
    content = programme_content()
    content["tests"][1]["accept"] = {"rmse": 1e-9}
    result, _ = again(content)
    assert not result.holds
    assert "machine.Xd" not in {value.name for value in result.values}
    assert result.fit.machine["Xd"] == 1.9


def test_a_test_that_fails_keeps_no_other_from_running(again):
    content = programme_content()
    content["plant"]["free"] = {"Xd": {"start": 1.5, "min": 1.0, "max": 1.6}}
    del content["plant"]["parameters"]["Xd"]
    result, _ = again(content)
    assert [*result.failed] == ["fit"]  # Xd of the V-curve lies outside what it is free in
    assert "machine.Xd: 1.79" in result.failed["fit"]
    assert OF_MACHINE in result.results
    assert not result.holds


def test_an_interruption_keeps_what_is_done_and_the_next_run_goes_on(
    folder, whole, tmp_path, monkeypatch
):
    path = written(programme_content(), folder)

    def interrupt(step, _):
        if step.name == OF_MACHINE:
            raise KeyboardInterrupt

    first = exfit.run(path, tmp_path, progress=interrupt)
    assert first.interrupted
    assert [*first.results] == ["saturation", "v-curve"]
    assert first.not_run == (OF_MACHINE, "fit")
    begun = []
    second = exfit.run(path, tmp_path, progress=lambda step, _: begun.append(step.name))
    assert [*dict.fromkeys(begun)] == [OF_MACHINE, "fit"]
    assert second.holds
    assert second.fit.values == whole.fit.values


@pytest.mark.long
def test_a_fit_that_was_interrupted_is_not_done(folder, tmp_path):
    path = written(programme_content(), folder)

    def interrupt(step, progress):
        if step.name == "fit" and progress is not None:
            raise KeyboardInterrupt

    first = exfit.run(path, tmp_path, progress=interrupt)
    assert first.interrupted
    assert first.tests[-1].verdict in ("interrupted", NOT_CONVERGED)
    assert not exfit.run(path, tmp_path).tests[-1].kept


@pytest.mark.parametrize("damage", few_of([b"", b"{", b"[]", b'{"key": 1}'], 1), ids=str)
def test_what_is_damaged_is_run_again(folder, whole, tmp_path, damage):
    path = written(programme_content(), folder)
    programme = load_programme(path)
    programme = replace(programme, tests=programme.tests[:2], content={
        **programme.content, "tests": programme.content["tests"][:2],
    })  # fmt: skip
    running.run(programme, tmp_path)
    (tmp_path / "v-curve" / "result.json").write_bytes(damage)
    kept = {test.name: test.kept for test in running.run(programme, tmp_path).tests}
    assert kept == {"saturation": True, "v-curve": False}


def test_all_files_are_read_before_the_first_test(tmp_path):
    content = programme_content()
    content["tests"][0]["file"] = "no.csv"
    content["tests"][2]["record"]["file"] = "none.csv"
    begun = []
    with pytest.raises(CaseError) as refused:
        exfit.run(written(content, tmp_path), progress=lambda step, _: begun.append(step))
    assert [name in str(refused.value) for name in ("no.csv", "none.csv")] == [True, True]
    assert begun == []


def test_the_summary_is_read_back_as_it_was_written(folder, whole, tmp_path):
    write(folder / "run" / "programme.json", summary_text(whole))
    read = load_summary(folder / "run")
    assert summary_text(read) == summary_text(whole)
    assert read.values == whole.values
    saturation = read.results["saturation"]
    assert np.array_equal(saturation.ifd, whole.results["saturation"].ifd)
    assert json.dumps(read.to_dict()["values"]) == json.dumps(whole.to_dict()["values"])


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (["about"], 3, "about: 3 is not a mapping"),
        (["interrupted"], "no", "interrupted: 'no' is not true or false"),
        (["failed", "up"], ["x"], "failed.up: a list is not a text"),
        (["tests", 0, "name"], "../run", r"tests\[0\].name: '../run' is not that of a test"),
        (["values", 0, "value"], 10**309, r"values\[0\].value: 10{59}\.{3} is not a number"),
        (["version"], 99, "version: 99 is not 1"),
        (["tests"], None, "tests: None is not a list"),
    ],
)
def test_a_damaged_summary_is_refused_with_its_place(folder, whole, place, value, words):
    content = json.loads(summary_text(whole))
    section = content
    for key in place[:-1]:
        section = section[key]
    section[place[-1]] = value
    write(folder / "run" / "programme.json", json.dumps(content))
    with pytest.raises(ExfitError, match=f"not the result of a programme: {words}"):
        load_summary(folder / "run")


@pytest.mark.parametrize(
    ("test", "place"),
    [
        ("saturation", ["vt"]),
        ("saturation", ["curves", 0, "low"]),
        ("saturation", ["curves"]),
        ("v-curve", ["q"]),
        ("v-curve", ["levels", 0, "it"]),
    ],
)
def test_a_result_at_rest_whose_parts_do_not_fit_together_is_none(folder, whole, test, place):
    file = folder / "run" / test / "result.json"
    text = file.read_text(encoding="utf-8")
    (finished,) = (each for each in whole.tests if each.name == test)
    step = ProgrammeStep(finished.name, finished.kind, finished.tests)
    assert result_kept(step, finished.key, folder / "run") is not None
    content = json.loads(text)
    section = content["result"]
    for key in place[:-1]:
        section = section[key]
    if place == ["curves"]:
        section["curves"] = [
            curve for curve in section["curves"] if curve["form"] != section["form"]
        ]
    else:
        section[place[-1]].pop()
    file.write_text(json.dumps(content), encoding="utf-8")
    damaged = result_kept(step, finished.key, folder / "run")
    file.write_text(text, encoding="utf-8")
    assert damaged is None
