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
HIDING = "raise ModuleNotFoundError(\"No module named 'exfit'\", name='exfit')\n"
STARTED_WITHIN = 60.0  # s
# as docs/fleets.md sets them: without Dask's own diagnostics
SETTINGS = {
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "false",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
}
TIMES = re.compile(r"\"seconds\": [^,}\n]+")


@dataclass
class Cluster:
    """A scheduler, from which exfit is hidden, with workers: each in a folder of its own."""

    folder: Path
    address: str = ""
    count: int = 0
    scheduler: subprocess.Popen | None = None
    workers: list[subprocess.Popen] = field(default_factory=list)

    def start(self, workers=2, nanny=False):
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "hiding").mkdir()
        (self.folder / "hiding" / "exfit.py").write_text(HIDING)
        file = self.folder / "scheduler.json"
        self.scheduler = self._run(
            "scheduler", "--scheduler-file", str(file), "--port", "0", "--host", "127.0.0.1"
        )
        waited(lambda: address_in(file), "a scheduler")
        self.address = address_in(file)
        for _ in range(workers):
            self.add_worker(nanny)

    def add_worker(self, nanny=False, threads=1, hidden=False):
        """Start a worker, with exfit of this checkout unless that is ``hidden`` from it."""
        self.count += 1
        place = self.folder / f"worker{self.count}"
        place.mkdir()
        worker = self._run(
            "worker", self.address, "--nthreads", str(threads), "--local-directory", str(place),
            "--memory-limit", "0", "--nanny" if nanny else "--no-nanny",
            place=place, hidden=hidden,
        )  # fmt: skip
        self.workers.append(worker)
        return worker

    def _run(self, kind, *arguments, place=None, hidden=True):
        module = f"distributed.cli.dask_{kind}"
        path = self.folder / "hiding" if hidden else HERE
        with (self.folder / f"{kind}{self.count}.log").open("wb") as log:
            return subprocess.Popen(
                [sys.executable, "-P", "-m", module, *arguments, "--no-dashboard"],
                stdout=log,
                stderr=log,
                stdin=subprocess.DEVNULL,
                cwd=place or self.folder,
                env={**os.environ, **SETTINGS, "PYTHONPATH": str(path)},
                start_new_session=True,
            )

    def stop(self):
        for process in (*self.workers, self.scheduler):
            if process is not None:
                kill_group(process)
                process.wait()


def address_in(file):
    """Return the address in the file of a scheduler, "" while it is not there and whole."""
    try:
        return json.loads(file.read_text())["address"]
    except (OSError, ValueError):
        return ""


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
