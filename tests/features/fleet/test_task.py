"""One case of a batch: its key holds all that goes into its fit, and nothing of it is raised."""

import pickle
from dataclasses import replace

import pytest
from batches import case_file, files_of_case, record_file

import exfit
from exfit.features.fleet.task import CHANGED, CaseTask, key_of, run_case
from exfit.results.io import files_of_fit
from exfit.runs.runner import FitSettings

LOCAL = FitSettings(search="local")


def task_of(case, *others, settings=LOCAL):
    files = (case, *others)
    return CaseTask(files, key_of(files, settings), case.parent / "fleet" / "key", settings)


@pytest.fixture
def case(tmp_path):
    """Return the files of a case: itself and its record."""
    return case_file(tmp_path / "a.yaml", record_file(tmp_path / "record.csv"))


def without_times(files):
    return {name: text for name, text in files.items() if name != "result.json"}


def test_a_case_has_the_files_of_its_fit_and_its_summary(case):
    outcome = run_case(task_of(*files_of_case(case)))
    result = exfit.fit(case, search="local")
    assert without_times(outcome.files) == without_times(dict(files_of_fit(result)))
    assert [*outcome.files][-1] == "result.json"
    assert outcome.failure is None
    summary = outcome.summary
    assert summary.parameters["k"].value == result.parameters["k"].value
    assert (summary.status, summary.holds) == ("done", result.holds)
    assert summary.seconds > 0.0


def test_further_files_are_made_of_the_result(case):
    task = replace(task_of(*files_of_case(case)), further=(described,))
    assert run_case(task).files["about.txt"] == f"FIRST_ORDER in {task.folder}"


def described(result, folder):
    return [("about.txt", f"{result.model} in {folder}")]


def test_a_task_travels_to_another_process(case):
    task = replace(task_of(*files_of_case(case)), further=(described,))
    assert pickle.loads(pickle.dumps(task)) == task


@pytest.mark.parametrize("place", [0, 1])
def test_a_file_that_changes_before_the_fit_is_noticed(case, place):
    files = files_of_case(case)
    task = task_of(*files)
    files[place].write_bytes(files[place].read_bytes() + b"\n")
    outcome = run_case(task)
    assert (outcome.changed, outcome.failure, outcome.summary) == (CHANGED, None, None)


def test_a_file_that_changes_during_the_fit_is_noticed(case):
    files = files_of_case(case)
    task = replace(task_of(*files), further=(EDITS[0],))
    assert run_case(task).changed == CHANGED


def edited(result, folder):
    """Change the record while its fit is at hand."""
    record = folder.parent.parent / "record.csv"
    record.write_bytes(record.read_bytes() + b"\n")
    return ()


EDITS = (edited,)


def test_a_faulty_case_fails_with_all_its_faults(tmp_path):
    faulty = tmp_path / "faulty.yaml"
    faulty.write_text("model: SEXS\nplants: {}\n")
    failure = run_case(task_of(faulty)).failure
    assert failure.kind == "failed"
    assert f"{faulty}:2: plants" in failure.reason


def test_a_case_that_is_not_there_any_more_has_changed(tmp_path):
    assert run_case(task_of(tmp_path / "gone.yaml")).changed == CHANGED


def broken(result, folder):
    raise MemoryError("no room")


def test_what_should_not_happen_is_a_crash_with_its_place(case):
    failure = run_case(replace(task_of(*files_of_case(case)), further=(broken,))).failure
    assert failure.kind == "crashed"
    assert failure.reason.startswith("MemoryError: no room (test_task.py:")
    assert failure.seconds > 0.0


def test_a_key_changes_with_every_file_and_setting(case):
    files = files_of_case(case)
    keys = {key_of(files, LOCAL), key_of(files, FitSettings()), key_of(files, FitSettings("lm"))}
    keys.add(key_of(files[:1], LOCAL))
    files[1].write_bytes(files[1].read_bytes() + b"\n")
    keys.add(key_of(files, LOCAL))
    files[1].unlink()
    keys.add(key_of(files, LOCAL))
    assert len(keys) == 6
    assert all(len(key) == 32 for key in keys)


def test_code_is_run_only_as_it_was_when_the_key_was_made(tmp_path):
    code = tmp_path / "own.py"
    code.write_text("raise SystemExit('it ran')")
    content = {"model": "own.py", "plant": {"type": "none"}}
    case = case_file(tmp_path / "a.yaml", record_file(tmp_path / "r.csv"), **content)
    task = task_of(*files_of_case(case))
    assert "it ran" in run_case(task).failure.reason
    code.write_text("raise SystemExit('something else ran')")
    assert run_case(task).changed == CHANGED
