"""Batches that SIGKILL meets at some moment, alone or with their workers, and the next run."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass

from batches import table_of
from ended_commands import heeding_interrupts

PROGRAM = """
import sys
import exfit
from exfit.features.fleet.table import write_tables

class Log:
    def begun(self, cases, workers): print("begun", flush=True)
    def kept(self, case): print(f"kept {case}", flush=True)
    def started(self, case): print(f"started {case}", flush=True)
    def finished(self, summary): print(f"finished {summary.case}", flush=True)

cases, folder, workers = sys.argv[1:]
exfit.batch(cases, folder, workers=int(workers), search="local", observer=Log(),
            write_tables=write_tables)
"""
WORKERS = 2
PATIENCE = 600.0  # s
TO_END = 10.0  # s: for workers whose batch is gone


@dataclass(frozen=True)
class ResumedBatch:
    """What a kill left of a batch, and what the next run made of it.

    ``done`` counts the cases whose results were there, ``lost`` those among them that the next run
    changed; ``repeated`` the cases that were begun before the kill and again after it. ``left`` is
    whether a worker was still there some time after the kill, ``same`` whether the final table is
    that of a run without a kill, ``temporary`` counts temporary files after it.
    """

    done: int
    lost: int
    repeated: int
    left: bool
    same: bool
    temporary: int

    @property
    def whole(self):
        """Whether nothing was lost, left over, or done twice but what was under way.

        A worker has its next case before its last result is written: two each are under way.
        """
        under_way = self.repeated <= 2 * WORKERS
        return self.same and under_way and not (self.lost or self.left or self.temporary)


def start(cases, folder):
    """Start a batch in a process that leads a group of its own."""
    with heeding_interrupts():
        return subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(cases), str(folder), str(WORKERS)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )


def whole_batch(cases, folder):
    """Run a batch that no signal meets; return the cases that it began, and how long it took, s."""
    began = time.perf_counter()
    process = start(cases, folder)
    out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, out
    return _started(out), time.perf_counter() - began


def killed_and_resumed(cases, folder, moment, expected, with_workers):
    """Return what becomes of a batch that is killed a moment, s, after its start.

    ``expected`` is the table of a run without a kill.
    """
    process = start(cases, folder)
    out = ""
    try:
        out, _ = process.communicate(timeout=moment)
    except subprocess.TimeoutExpired:
        if with_workers:
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
        out, _ = process.communicate()
    left = _is_left(process.pid)
    results = {path: path.read_bytes() for path in folder.glob("*/result.json")}
    again, _ = whole_batch(cases, folder)
    return ResumedBatch(
        done=len(results),
        lost=sum(path.read_bytes() != content for path, content in results.items()),
        repeated=len(set(_started(out)) & set(again)),
        left=left,
        same=table_of(folder) == expected,
        temporary=len([*folder.rglob(".exfit-*")]),
    )


def _started(out):
    lines = out.rpartition("\n")[0].splitlines()  # without one that the kill has cut off
    return [line.removeprefix("started ") for line in lines if line.startswith("started ")]


def _is_left(group):
    """Return whether a process of a group is there still after some time; end it then."""
    end = time.monotonic() + TO_END
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.05)
    os.killpg(group, signal.SIGKILL)
    return True
