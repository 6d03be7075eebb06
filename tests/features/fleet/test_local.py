"""Worker processes: they compute what this process would, and what kills one kills no batch."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from batches import Events, case_file, record_file, table_of, troubled

import exfit
from exfit.errors import ExfitError
from exfit.features.fleet import local
from exfit.features.fleet.folder import IndexEntry
from exfit.features.fleet.local import Waiting
from exfit.features.fleet.local import in_this_process as here
from exfit.features.fleet.plan import PlannedCase
from exfit.features.fleet.task import CaseTask

UNITS = ("killed", "1", "large", "hanging", "2", "noisy", "unpicklable", "3")
LIMIT = 6.0  # s: a small fit needs a tenth of a second


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Return a fleet of which some cases kill, block or spoil the worker that fits them."""
    place = tmp_path_factory.mktemp("local")
    for seed, unit in enumerate(UNITS):
        record = record_file(place / f"records/{unit}.csv", seed)
        case_file(place / f"cases/{unit}.yaml", record, about={"Unit": unit})
    events = Events()
    fleet = exfit.batch(
        place / "cases",
        place / "fleet",
        workers=2,
        time_limit=LIMIT,
        further=[troubled],
        observer=events,
    )
    return fleet, events


@pytest.mark.long
def test_the_death_of_a_worker_is_a_row_and_the_rest_goes_on(fleet):
    rows = {case.name: case for case in fleet[0].cases}
    assert {name: row.status for name, row in rows.items()} == {
        "1": "done",
        "2": "done",
        "3": "done",
        "noisy": "done",
        "hanging": "timed out",
        "killed": "crashed",
        "large": "crashed",
        "unpicklable": "crashed",
    }
    assert rows["hanging"].reason == "not finished after 6 s"
    assert rows["large"].reason.startswith("MemoryError")
    if os.name != "nt":
        assert "ended by SIGKILL" in rows["killed"].reason
    assert "pickle" in rows["unpicklable"].reason


@pytest.mark.long
def test_every_case_is_announced_once(fleet):
    kinds = Counter(event[0] for event in fleet[1].events)
    assert kinds == {"begun": 1, "started": 8, "done": 4, "crashed": 3, "timed out": 1}


def test_workers_compute_what_this_process_does(tmp_path):
    for seed in range(2):
        record = record_file(tmp_path / f"{seed}.csv", seed)
        case_file(tmp_path / f"cases/{seed}.yaml", record)
    exfit.batch(tmp_path / "cases", tmp_path / "fleet", workers=1)
    exfit.batch(tmp_path / "cases", tmp_path / "here", compute=here)
    assert table_of(tmp_path / "fleet") == table_of(tmp_path / "here")


def test_workers_that_cannot_be_started_end_the_batch_with_the_reason(tmp_path, monkeypatch):
    monkeypatch.setattr(local, "PROGRAM", "raise SystemExit('no such computer')")
    case = case_file(tmp_path / "a.yaml", record_file(tmp_path / "a.csv"))
    with pytest.raises(ExfitError, match=r"no worker can be started: .*no such computer"):
        exfit.batch(case, tmp_path / "fleet", workers=1)


def waiting(*groups):
    cases = Waiting(iter(()))
    for number, group in enumerate(groups):
        cases.add(PlannedCase(IndexEntry(f"{number}"), CaseTask((), "", Path(), group=group)))
    return cases


def test_a_worker_stays_with_the_group_that_it_has_compiled():
    cases = waiting("a", "b", "a", "b", "b")
    order = [cases.next_for("a", Counter()).task.group for _ in range(5)]
    assert order == ["a", "a", "b", "b", "b"]
    assert len(cases) == 0


def test_workers_are_spread_over_the_groups_by_their_sizes():
    cases = waiting(*"aaaabbb")
    assert cases.next_for("", Counter()).task.group == "a"
    assert cases.next_for("", Counter("a")).task.group == "b"
    assert cases.next_for("", Counter("ab")).task.group == "a"


def test_the_batch_itself_imports_nothing_that_only_its_workers_need():
    code = "import exfit.features.fleet.batch, sys; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(Path(exfit.__file__).parents[2])},
    )  # fmt: skip
    assert not {"scipy", "llvmlite", "pydantic", "exfit.workflows"} & {*done.stdout.split()}
