"""Cases for batches: small ones, each in a file with its record."""

import os
import signal
import time

import numpy as np
import yaml
from cases import FIRST_ORDER, TIME, TRUTH, with_local_search

from exfit.case.peek import files_of
from exfit.features.fleet.folder import read_fleet
from exfit.util.typed import plain

NOISE = 1e-3


def record_file(path, seed=3):
    """Write a record of FIRST_ORDER, with noise of its own by the seed; return its path."""
    samples = TRUTH + NOISE * np.random.default_rng(seed).standard_normal(len(TIME))
    rows = (f"{t:.6g},{v:.9g}" for t, v in zip(TIME, samples, strict=True))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(["t,v", *rows]) + "\n")
    return path


def case_file(path, record, **changes):
    """Write a case of FIRST_ORDER with a record; return its path."""
    section = {"file": str(record), "time": "t", "channels": {"vt": "v"}}
    content = with_local_search({**FIRST_ORDER, "record": section, **changes})
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def files_of_case(case):
    """Return a case and the files that it names, as a batch counts them."""
    return files_of(case)


class Events:
    """An observer that collects what a batch announces."""

    def __init__(self):
        self.events = []

    def begun(self, cases, workers):
        self.events.append(("begun", cases, workers))

    def kept(self, case):
        self.events.append(("kept", case))

    def started(self, case):
        self.events.append(("started", case))

    def finished(self, summary):
        self.events.append((summary.status, summary.case))

    def of(self, kind):
        """Return the cases of the events of a kind, without their folders."""
        return [event[1].rpartition("/")[2] for event in self.events if event[0] == kind]


def troubled(result, folder):
    """Make no further files, but the trouble that the case asks for under Unit."""
    match result.about.get("Unit"):
        case "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        case "hanging":
            time.sleep(600.0)
        case "large":
            raise MemoryError
        case "noisy":
            print("printed by a worker")
        case "unpicklable":
            return [("x.txt", lambda: None)]
    return ()


def table_of(folder):
    """Return the rows of a batch's folder as plain data, without how long the fits took."""
    rows = [plain(case, whole=True) for case in read_fleet(folder).cases]
    return [{**row, "seconds": None} for row in rows]
