"""The folder of a batch: what is written is read back, and what is missing is made again."""

import json
from dataclasses import replace

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME, TRUTH

import exfit
from exfit.errors import ExfitError
from exfit.features.fleet.folder import (
    MOST_POINTS,
    VERSION,
    CaseFacts,
    CaseOutcome,
    Failure,
    IndexEntry,
    case_name,
    entries_of,
    facts_of,
    prepare_folder,
    read_fleet,
    state_of,
    summary_of,
    write_entry,
    write_outcome,
)
from exfit.results.intervals.determination import NEEDS_PROFILE
from exfit.results.io import result_text
from exfit.util.typed import plain

ABOUT = {"about": {"Unit": "Unit 3", "Plant": "Test"}}
FACTS = CaseFacts("bus 101, machine 1", 101, "1", "FIRST_ORDER")


@pytest.fixture(scope="module")
def result():
    noise = 1e-3 * np.random.default_rng(5).standard_normal(len(TIME))
    record = exfit.Record.from_arrays(TIME, {"vt": TRUTH + noise})
    return exfit.fit(exfit.Case.from_dict({**ABOUT, **FIRST_ORDER}, record))


@pytest.fixture
def folder(tmp_path, result):
    """Return a folder with a case that is done, one that failed, one refused and one not run."""
    outcome = CaseOutcome({"result.json": result_text(result)}, summary_of(result, "a" * 32, 1.5))
    write_outcome(tmp_path, "a" * 32, outcome)
    failure = CaseOutcome(failure=Failure("timed out", "not finished after 60 s", 60.0))
    write_outcome(tmp_path, "b" * 32, failure)
    entries = [
        IndexEntry("cases/one.yaml", "a" * 32, facts=FACTS),
        IndexEntry("other/one.yaml", "a" * 32),
        IndexEntry("cases/slow.yaml", "b" * 32, facts=FACTS),
        IndexEntry("cases/own.yaml", status="refused", reason="avr.py"),
        IndexEntry("cases/later.yaml", "c" * 32),
    ]
    prepare_folder(tmp_path)
    for entry in entries:
        write_entry(tmp_path, entry)
    return tmp_path


def test_a_fleet_has_a_row_for_every_case_of_the_index(folder, result):
    rows = {case.name: case for case in read_fleet(folder).cases}
    assert [*rows] == ["cases-one", "later", "other-one", "own", "slow"]
    assert {name: row.status for name, row in rows.items()} == {
        "cases-one": "done",
        "later": "not run",
        "other-one": "done",  # of equal content
        "own": "refused",
        "slow": "timed out",
    }
    done, slow = rows["cases-one"], rows["slow"]
    assert (done.unit, done.model, done.seconds) == ("Unit 3", "FIRST_ORDER", 1.5)
    assert done.about == ABOUT["about"]
    assert done.parameters["k"].value == result.parameters["k"].value
    assert done.parameters["k"][1:3] == result.parameters["k"].interval
    assert (done.parameters["k"].source, [*done.fitted]) == ("fitted", ["k", "a"])
    assert done.rmse == {"vt": result.rmse}
    assert (slow.unit, slow.bus, slow.reason) == (
        "bus 101, machine 1",
        101,
        "not finished after 60 s",
    )
    assert read_fleet(folder).counts["done"] == 2


@pytest.mark.parametrize(
    "damage", [None, "", "{}", f'{{"version": {VERSION}}}', '{"version": 1}', "[1]"]
)
def test_a_summary_that_is_missing_or_damaged_is_made_again_from_the_result(folder, damage):
    before = plain(read_fleet(folder).cases[0], whole=True)
    file = folder / ("a" * 32) / "summary.json"
    file.unlink()
    if damage is not None:
        file.write_text(damage)
    again = plain(read_fleet(folder).cases[0], whole=True)
    assert again.pop("seconds") != before.pop("seconds")  # processor time is nowhere else
    assert again == before


def test_a_damaged_result_is_a_row_with_its_reason(folder):
    (folder / ("a" * 32) / "summary.json").unlink()
    (folder / ("a" * 32) / "result.json").write_text("{")
    row = read_fleet(folder).cases[0]
    assert row.status == "failed"
    assert "result.json: not JSON" in row.reason


def test_a_result_takes_the_place_of_a_failure(folder, result):
    key = "b" * 32
    write_outcome(
        folder, key, CaseOutcome({"result.json": result_text(result)}, summary_of(result, key, 1.0))
    )
    assert {case.status for case in read_fleet(folder).cases if case.key == key} == {"done"}
    assert not (folder / key / "failed.json").exists()


def test_a_damaged_entry_of_the_index_hides_no_other(folder):
    next((folder / "index").iterdir()).write_text("{")
    assert len(entries_of(folder)) == 4


@pytest.mark.parametrize("key", ["../outside", "9" * 400, "a" * 31, "A" * 32, "a\0"])
def test_an_entry_whose_key_is_none_leads_nowhere(folder, key):
    write_entry(folder, IndexEntry("cases/hostile.yaml", key))
    assert len(read_fleet(folder).cases) == 5


def test_another_folder_is_refused(tmp_path):
    with pytest.raises(ExfitError, match="not the folder of a batch: index is missing"):
        read_fleet(tmp_path)


def test_the_state_of_a_folder_changes_with_every_case_that_ends(folder):
    before = state_of(folder)
    assert state_of(folder) == before
    write_outcome(folder, "c" * 32, CaseOutcome(failure=Failure("failed", "no match")))
    assert state_of(folder) != before


def test_curves_have_few_points_and_their_extremes(result):
    long = np.linspace(0.0, 3.0, 5001)
    noise = 1e-3 * np.random.default_rng(6).standard_normal(len(long))
    record = exfit.Record.from_arrays(long, {"vt": np.interp(long, TIME, TRUTH) + noise})
    fit = exfit.fit(exfit.Case.from_dict(FIRST_ORDER, record))
    (curve,) = summary_of(fit, "", 0.0).curves
    assert 60 < len(curve.time) == len(curve.measured) == len(curve.simulated) <= MOST_POINTS
    measured = record.signals["vt"]
    assert curve.measured.max() == pytest.approx(measured.max(), rel=1e-5)
    assert curve.measured.min() == pytest.approx(measured.min(), abs=1e-5)


def test_the_path_of_a_case_is_relative_to_the_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cases").mkdir()
    case = tmp_path / "cases" / "a.yaml"
    assert case_name(tmp_path / "fleet", case) == "../cases/a.yaml"
    assert case_name(tmp_path / "fleet", case.relative_to(tmp_path)) == "../cases/a.yaml"


@pytest.mark.parametrize(
    ("content", "facts"),
    [
        ({"about": {"unit": 3}, "model": "AC8B", "plant": {"machine": "GENSAL"}},
         CaseFacts("3", model="AC8B", machine_model="GENSAL")),
        ({"about": {"Generator": "G2"}}, CaseFacts("G2")),
        ({"as_found": {"bus": 101, "id": "1"}}, CaseFacts("bus 101, machine 1", 101, "1")),
        ({"as_found": {"bus": True, "id": 7}, "about": [1]}, CaseFacts("machine 7", None, "7")),
        ({"as_found": "x", "plant": 1, "model": ["y"]}, CaseFacts()),
    ],
)  # fmt: skip
def test_facts_are_read_off_any_content(content, facts):
    assert facts_of(content) == facts


def test_a_summary_as_a_file_is_what_it_was(folder):
    content = json.loads((folder / ("a" * 32) / "summary.json").read_text())
    row = read_fleet(folder).cases[0]
    written = {**plain(row, whole=True), "name": content["name"], "case": content["case"]}
    assert {"version": VERSION, **written} == content


def test_an_interval_that_was_not_looked_for_is_not_an_unresolved_parameter(result):
    """As the verdict counts: of a local search intervals are missing, which a profile gives."""
    named = {"k": NEEDS_PROFILE, "a": "has no interval: the records do not determine it"}
    parameters = {
        name: replace(result.parameters[name], interval=None, why=why)
        for name, why in named.items()
    }
    assert summary_of(replace(result, parameters=parameters), "", 0.0).unresolved == ("a",)
