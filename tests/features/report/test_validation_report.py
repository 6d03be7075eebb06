"""The report of a planner's model as it is beside recorded events: nothing was fitted."""

import json
from dataclasses import replace

import pytest
import yaml
from grid_events import FIXED, TRUTH, event_case, recorded
from pages import Page

from exfit.case.load import load_case
from exfit.errors import ExfitError
from exfit.features.report.writing import write_report
from exfit.output.run_folder import write_validation
from exfit.results.io import load_validation
from exfit.workflows import validation_result

WRONG = {"K": 40.0}  # in the planner's base: half the gain of the unit
PARAMETERS = {"fixed": FIXED | TRUTH | WRONG, "sources": {"K": "maker"}}
OF_A_FIT = ("search", "iteration", "95 %", "interval", "bounds", "standard error", "fitted values")
ROWS = "Tests and their records"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Validate a model in two events; return the folder of the run."""
    folder = tmp_path_factory.mktemp("events")
    recorded(folder / "trip.csv", noise=1e-4)
    recorded(folder / "night.csv", noise=1e-4, seed=2, P=0.5, Q=-0.1, vt0=1.02)
    case = event_case(
        folder,
        "trip",
        "night",
        free=False,
        about={"Recorder": "PMU, 230 kV side"},
        as_found={"source": "unit3.dyr", "parameters": {"K": TRUTH["K"]}},
        parameters=PARAMETERS,
    )
    write_validation(validation_result(case, {}), folder / "run")
    return folder / "run"


@pytest.fixture(scope="module")
def result(folder):
    return load_validation(folder / "validation.json")


@pytest.fixture(scope="module")
def page(folder):
    return Page(write_report(folder)[0].read_text(encoding="utf-8"))


def test_every_event_is_judged_by_p_and_q_and_shown(page):
    rows = page.tables["Criteria: simulated minus recorded"][1:]
    assert [(row[0], row[2][-1]) for row in rows] == [
        ("trip", "p"), ("trip", "q"), ("night", "p"), ("night", "q")
    ]  # fmt: skip
    assert {"played-0", "played-1", "overlay-0-q", "overlay-1-p"} <= set(page.ids)
    assert [row[:2] for row in page.tables[ROWS][1:]] == [
        ["trip", "to validate"], ["night", "to validate"]
    ]  # fmt: skip


def test_it_says_whose_values_they_are_and_has_no_word_of_a_fit(page):
    assert "Simulated with values of the case, which has no free parameter" in page.text
    form = page.tables["What a verification report states (cf.: clauses of NERC MOD-026-1)"]
    rows = {row[1]: row[2] for row in form[1:]}
    text = rows["Model response beside a recorded response"]
    assert text.startswith("nothing fitted; validated on: trip, night; measured system disturb")
    assert rows["Model in the planner's base"] == "SEXS, unit3.dyr"
    assert rows["Recorder"] == "PMU, 230 kV side"
    body = page.text.split("The case")[0].lower()
    assert [word for word in OF_A_FIT if word in body] == []


def test_what_is_wrong_with_the_record_of_an_event_is_noted(folder, result, page, tmp_path):
    """As before a fit: here p is counted towards the unit."""
    assert result.notes == ()
    assert "None." in page.text
    case = event_case(folder.parent, "trip", free=False, parameters=PARAMETERS)
    content = yaml.safe_load(case.read_text())
    content["record"]["channels"]["p"] = {"column": "p", "scale": -1}
    case.write_text(yaml.safe_dump(content))
    (note,) = validation_result(case, {}).notes
    assert note.startswith("record: ")
    assert "p" in note.split()
    assert "scale: -1" in note


def test_values_have_their_sources(page):
    exciter = {row[0]: row for row in page.tables["Exciter SEXS"][1:]}
    assert (exciter["K"][1], exciter["K"][3]) == ("40", "maker")
    assert exciter["TE"][3] == "not stated"


def test_the_model_as_found_is_shown_where_it_is_another_one(page, folder, result, tmp_path):
    (row,) = page.tables["As found and compared: the parameters that differ"][1:]
    assert row[:3] == ["K", "80", "40"]
    content = json.loads((folder / "validation.json").read_text())
    content["as_found"]["values"] = dict(result.values)
    (tmp_path / "validation.json").write_text(json.dumps(content))
    same = Page(write_report(tmp_path)[0].read_text(encoding="utf-8"))
    assert "as-found" in page.ids
    assert "as-found" not in same.ids


def test_the_model_as_found_is_validated_on_what_its_case_would_fit(folder):
    """Of a case for a fit, which has not been made: the unit of the planner's base, as it is."""
    found = {"source": "unit3.dyr", "parameters": TRUTH}
    case = event_case(folder.parent, "trip", validate=["night"], as_found=found)
    result = validation_result(case, None)
    assert [(match.name, match.validation) for match in result.matches] == [
        ("record", True), ("night", True)
    ]  # fmt: skip
    assert result.values.items() >= TRUTH.items()
    assert result.origin == "the model as found, before any fit"
    assert "fitted" not in result.sources.values()
    assert [test.role for test in result.tests] == ["validation"] * 2
    start = validation_result(replace(load_case(case), as_found=None), None)
    errors = [[match.channels["q"].rmse for match in each.matches] for each in (result, start)]
    assert 2.0 * max(errors[0]) < min(errors[1])  # seeded: 3 times; noise of vt leaves 5e-4 pu


def test_the_file_of_a_validation_holds_all_of_it(result):
    assert result.values["K"] == WRONG["K"]
    assert [match.validation for match in result.matches] == [True, True]
    assert {*result.inputs} == {"case", "records.trip", "records.night"}
    assert len(result.behaviour.flat_runs) == 2
    assert result.case_text.startswith("model: SEXS")


@pytest.mark.parametrize(
    ("change", "words"),
    {
        "of an earlier version": (lambda c: c.update(version=9), "version: 9: .*: validate again"),
        "of a later one": (lambda c: c.update(version=99), "written by a later exfit"),
        "without a record": (lambda c: c.update(validation=[]), "validation: empty"),
        "with a wrong value": (lambda c: c["values"].update(K="x"), "values.K"),
    }.values(),
)
def test_a_damaged_file_is_refused_with_its_place(folder, tmp_path, change, words):
    content = json.loads((folder / "validation.json").read_text())
    change(content)
    (tmp_path / "validation.json").write_text(json.dumps(content))
    with pytest.raises(ExfitError, match=words):
        write_report(tmp_path)
    assert not (tmp_path / "report.html").exists()
