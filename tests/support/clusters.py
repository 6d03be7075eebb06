"""A Dask cluster on the loopback, started by Dask's own commands in processes of their own."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import exfit

HERE = Path(exfit.__file__).parents[1]
STARTED_WITHIN = 60.0  # s
TIMES = re.compile(r"\"seconds\": [^,}\n]+")


@dataclass
class Cluster:
    """A scheduler with workers: each in a folder that nobody else has, none sees this checkout's.

    A scheduler needs no exfit; workers import it from here unless it is ``hidden`` from them.
    """

    folder: Path
    address: str = ""
    scheduler: subprocess.Popen | None = None
    workers: list[subprocess.Popen] = field(default_factory=list)

    def start(self, workers=2, nanny=False):
        self.folder.mkdir(parents=True, exist_ok=True)
        file = self.folder / "scheduler.json"
        self.scheduler = self._run("scheduler", "--scheduler-file", str(file), "--port", "0")
        waited(file.is_file, "a scheduler")
        self.address = json.loads(file.read_text())["address"]
        for _ in range(workers):
            self.add_worker(nanny)

    def add_worker(self, nanny=False, threads=1, **environment):
        place = self.folder / f"worker{len(self.workers)}"
        place.mkdir()
        worker = self._run(
            "worker", self.address, "--nthreads", str(threads), "--local-directory", str(place),
            "--memory-limit", "0", "--nanny" if nanny else "--no-nanny",
            place=place, PYTHONPATH=str(HERE), **environment,
        )  # fmt: skip
        self.workers.append(worker)
        return worker

    def _run(self, kind, *arguments, place=None, **environment):
        module = f"distributed.cli.dask_{kind}"
        plain = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
        with (self.folder / f"{kind}{len(self.workers)}.log").open("wb") as log:
            return subprocess.Popen(
                [sys.executable, "-P", "-m", module, *arguments, "--no-dashboard"]
                + ([] if kind == "worker" else ["--host", "127.0.0.1"]),
                stdout=log,
                stderr=log,
                stdin=subprocess.DEVNULL,
                cwd=place or self.folder,
                env={**plain, **environment},
                start_new_session=True,
            )

    def stop(self):
        for process in (*self.workers, self.scheduler):
            if process is not None:
                kill_group(process)
                process.wait()


def kill_group(process):
    """Kill a process and what it has started, at once."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def waited(condition, what, within=STARTED_WITHIN):
    """Wait until a condition holds."""
    until = time.monotonic() + within
    while not condition():
        if time.monotonic() > until:
            raise TimeoutError(f"{what}: not there after {within:g} s")
        time.sleep(0.02)


@contextmanager
def running_cluster(folder, workers=2, nanny=False):
    """Give a cluster that runs, and end it in the end."""
    cluster = Cluster(Path(folder))
    try:
        cluster.start(workers, nanny)
        yield cluster
    finally:
        cluster.stop()


def without_times(folder):
    """Return the files below a folder by their paths in it, without how long fits took."""
    return {
        path.relative_to(folder).as_posix(): TIMES.sub("", path.read_text(encoding="utf-8"))
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file()
    }
