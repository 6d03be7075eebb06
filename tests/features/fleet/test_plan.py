"""The cases of a batch before they are fitted."""

import re
from pathlib import Path

import pytest
from batches import case_file, record_file
from tiers import few_of

from exfit.errors import ExfitError
from exfit.features.fleet.batch import batch
from exfit.features.fleet.folder import IndexEntry
from exfit.features.fleet.plan import BatchSettings, case_files, planned_case, share_of
from exfit.runs.runner import FitSettings
from exfit.util.gate import guarded
from exfit.util.trust import refuse_unknown

SETTINGS = BatchSettings(FitSettings(search="local"))


@pytest.fixture
def record(tmp_path):
    return record_file(tmp_path / "records" / "r.csv")


def test_a_folder_stands_for_all_cases_below_it(tmp_path, record, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cases, folder = Path("cases"), Path("cases/fleet")
    for name in ("b.yaml", "a.yml", "deep/er/c.yaml", ".git/d.yaml", "fleet/e.yaml"):
        case_file(cases / name, record)
    (cases / "parameters.yaml").write_text("model: SEXS\nparameters: {K: 1.0}\n")
    (cases / "broken.yaml").write_text("{")
    (cases / "empty.yaml").write_text("")
    names = ["a.yml", "b.yaml", "broken.yaml", "empty.yaml", "deep/er/c.yaml"]
    assert case_files([cases], folder) == tuple(cases / name for name in names)
    # what is given itself is taken, and nothing twice
    given = [cases / "b.yaml", tmp_path / "cases" / "b.yaml", cases / "fleet"]
    assert case_files(given, folder) == (cases / "b.yaml", cases / "fleet" / "e.yaml")


def test_what_does_not_exist_is_refused_with_all_of_it(tmp_path):
    with pytest.raises(ExfitError) as refusal:
        case_files([tmp_path / "a.yaml", tmp_path / "b"], tmp_path / "fleet")
    assert str(refusal.value).count("No such file or folder") == 2
    with pytest.raises(ExfitError, match=f"^{re.escape(str(tmp_path))}: no case"):
        batch([tmp_path], tmp_path / "fleet")


@pytest.mark.parametrize("parts", few_of([3, 1, 40], 1))
def test_parts_have_every_case_once_and_are_equally_large(tmp_path, parts):
    cases = [tmp_path / f"{number}.yaml" for number in range(100)]
    shares = [share_of(cases, (number + 1, parts), tmp_path) for number in range(parts)]
    assert sorted(case for share in shares for case in share) == sorted(cases)
    sizes = {len(share) for share in shares}
    assert max(sizes) - min(sizes) <= 1
    assert shares == [share_of(cases[::-1], (k + 1, parts), tmp_path)[::-1] for k in range(parts)]


def test_parts_are_balanced_where_models_alternate(tmp_path):
    """By position every second case of two models would be of one; binomial: 3.5 deviations."""
    cases = [tmp_path / f"{number:04}.yaml" for number in range(1000)]
    first = share_of(cases, (1, 2), tmp_path)
    even = sum(int(case.stem) % 2 == 0 for case in first)
    assert abs(even - 250) < 3.5 * (500 * 0.25) ** 0.5


def test_a_case_has_the_key_of_its_content_and_not_of_its_place(tmp_path, record):
    first, second = case_file(tmp_path / "a.yaml", record), case_file(tmp_path / "b.yaml", record)
    other = case_file(tmp_path / "c.yaml", record, about={"Unit": "3"})
    tasks = [planned_case(case, tmp_path, SETTINGS).task for case in (first, second, other)]
    assert tasks[0].key == tasks[1].key != tasks[2].key
    assert tasks[0].group == tasks[2].group
    assert tasks[0].files == (first, record)
    assert planned_case(first, tmp_path, BatchSettings()).task.key != tasks[0].key


@pytest.mark.parametrize(
    ("content", "status", "reason"),
    [
        ("model: SEXS\nplant: {type: open-circuit}\n", "no record", "the case has no record"),
        ("model: own.py\nrecord: {file: r.csv}\n", "refused", "own.py: not run"),
        (
            "plant: {type: external, command: [python, own.py]}\nrecord: {file: r.csv}\n",
            "refused",
            "the command python own.py: not run",
        ),
        ("plant: {type: fmu, file: own.py}\nrecord: {file: r.csv}\n", "refused", "own.py: not run"),
    ],
)
def test_a_case_without_a_task_has_a_reason(tmp_path, monkeypatch, content, status, reason):
    monkeypatch.setenv("EXFIT_CONFIG", str(tmp_path / "configuration"))  # nothing is trusted
    case = tmp_path / "a.yaml"
    case.write_text(content)
    (tmp_path / "own.py").touch()
    with guarded(refuse_unknown):
        planned = planned_case(case, tmp_path, SETTINGS)
    assert isinstance(planned, IndexEntry)
    assert planned.status == status
    assert reason in planned.reason


@pytest.mark.parametrize("content", ["", "{", "- 1", "tests: [{name: a}]", "model: 3\nrecord: 4"])
def test_a_faulty_case_has_a_key_so_that_it_fails_once(tmp_path, content):
    case = tmp_path / "a.yaml"
    case.write_text(content)
    assert planned_case(case, tmp_path, SETTINGS).entry.key


def test_code_is_part_of_the_key(tmp_path, record):
    code = tmp_path / "own.py"
    code.write_text("")
    case = case_file(tmp_path / "a.yaml", record, model="own.py")
    first = planned_case(case, tmp_path, SETTINGS).task
    assert first.files == (case, code, record)
    code.write_text("# other")
    assert planned_case(case, tmp_path, SETTINGS).task.key != first.key


def test_the_script_of_a_command_is_part_of_the_key(tmp_path, record):
    script = tmp_path / "simulator.py"
    script.write_text("")
    plant = {"type": "external", "twin": "open-circuit", "command": ["python", "simulator.py"]}
    case = case_file(tmp_path / "a.yaml", record, plant=plant)
    first = planned_case(case, tmp_path, SETTINGS).task
    assert script in first.files
    script.write_text("# other")
    assert planned_case(case, tmp_path, SETTINGS).task.key != first.key


def test_an_fmu_is_part_of_the_key(tmp_path, record):
    unit = tmp_path / "unit.fmu"
    unit.write_bytes(b"")
    plant = {"type": "fmu", "twin": "open-circuit", "file": "unit.fmu"}
    case = case_file(tmp_path / "a.yaml", record, plant=plant)
    first = planned_case(case, tmp_path, SETTINGS).task
    assert unit in first.files
    unit.write_bytes(b"other")
    assert planned_case(case, tmp_path, SETTINGS).task.key != first.key


def test_a_case_that_cannot_be_read_is_a_row(tmp_path):
    planned = planned_case(tmp_path / "gone.yaml", tmp_path, SETTINGS)
    assert (type(planned), planned.status) == (IndexEntry, "refused")
    assert "gone.yaml: cannot be read" in planned.reason
