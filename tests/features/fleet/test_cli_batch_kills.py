"""A kill at any moment of a batch loses nothing that was done, and leaves no worker behind."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest
from batches import case_file, record_file, table_of
from killed_batches import PATIENCE, killed_and_resumed, start, whole_batch

pytestmark = [
    pytest.mark.long,  # batches as processes, one after the other
    pytest.mark.skipif(os.name == "nt", reason="sends signals of POSIX"),
]

CASES = 7
SEED = 3


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    """Return a folder with small cases, the table of a batch of them, and how long it took, s."""
    place = tmp_path_factory.mktemp("kills")
    for number in range(CASES):
        record = record_file(place / "records" / f"{number}.csv", number)
        case_file(place / "cases" / f"{number:02}.yaml", record)
    whole_batch(place / "cases", place / "first")  # compiles
    _, seconds = whole_batch(place / "cases", place / "whole")
    return place / "cases", table_of(place / "whole"), seconds


@pytest.fixture
def fleet(batch, request):
    """Return a folder of its own beside those cases: their paths are relative to it."""
    return batch[0].parent / request.node.name.replace("[", "-").rstrip("]")


@pytest.mark.parametrize("with_workers", [False, True])
def test_a_batch_that_is_killed_goes_on_to_the_same_table(batch, fleet, with_workers):
    cases, expected, seconds = batch
    moment = random.Random(SEED).uniform(0.3, 0.9) * seconds
    resumed = killed_and_resumed(cases, fleet, moment, expected, with_workers)
    assert resumed.whole, resumed


@pytest.mark.parametrize(
    ("with_workers", "number"), [(False, signal.SIGINT), (True, signal.SIGTERM)]
)
def test_an_interruption_stops_at_once_and_writes_the_table(batch, fleet, with_workers, number):
    cases, expected, _ = batch
    process = start(cases, fleet)
    for line in process.stdout:
        if line.startswith("finished"):
            break
    began = time.monotonic()
    (os.killpg if with_workers else os.kill)(process.pid, number)
    process.communicate(timeout=PATIENCE)
    assert time.monotonic() - began < 20.0  # not the rest of the cases
    rows = table_of(fleet)
    assert {row["status"] for row in rows} <= {"done", "not run"}  # and none crashed
    assert len(rows) == CASES
    assert (fleet / "fleet.csv").is_file()
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    whole_batch(cases, fleet)
    assert table_of(fleet) == expected


def test_two_batches_on_one_folder_come_to_the_same(batch, fleet):
    cases, expected, _ = batch
    both = [start(cases, fleet) for _ in range(2)]
    for process in both:
        process.communicate(timeout=PATIENCE)
        assert process.returncode == 0
    assert table_of(fleet) == expected


def test_a_script_needs_no_guard_for_its_main_module(batch, fleet):
    cases, *_ = batch
    script = fleet.with_suffix(".py")
    script.write_text(
        "import numpy, exfit\n"
        f"fleet = exfit.batch({str(cases)!r}, {str(fleet)!r}, workers=1)\n"
        "print(fleet.counts)\n"
    )
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, check=True, timeout=PATIENCE
    )
    assert done.stdout == f"{{'done': {CASES}}}\n"
