"""Batches on a Dask cluster: the same files as here, whatever happens to its processes."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from concurrent.futures import Future
from pathlib import Path

import psutil
import pytest
from batches import Events, case_file, record_file
from clusters import HERE, kill_group, running_cluster, waited, without_times
from ended_commands import heeding_interrupts

import exfit
from exfit.features.fleet import dispatch, remote
from exfit.features.fleet.dispatch import ClusterError, connected
from exfit.models.exciters import first_order

CODE = Path(first_order.__file__).read_text()
HANGING = f"import time\ntime.sleep(600.0)\n{CODE}"
CRASHING = f"import os\nprint('of the model')\nos.abort()\n{CODE}"


@pytest.fixture
def user(tmp_path, monkeypatch):
    """Work in the folder of a user."""
    (tmp_path / "user").mkdir()
    monkeypatch.chdir(tmp_path / "user")
    monkeypatch.setenv("EXFIT_CACHE", str(Path(os.environ["EXFIT_CACHE"]).absolute()))
    return tmp_path


def cases(count):
    """Write cases with records of their own, which lie elsewhere, and return their folder."""
    for number in range(count):
        record = record_file(Path(f"records/r{number}.csv"), seed=number)
        path = record.absolute() if number % 2 else Path("..") / record
        case_file(Path(f"cases/c{number}.yaml"), path)
    return Path("cases")


def own_model(name, code):
    record_file(Path("records/own.csv"))
    Path(f"cases/{name}.py").write_text(code)
    return case_file(Path(f"cases/{name}.yaml"), "../records/own.csv", model=f"{name}.py")


@pytest.mark.long
def test_a_cluster_leaves_the_files_that_this_computer_leaves(user):
    folder = cases(3)
    own_model("hanging", HANGING)
    own_model("crashing", CRASHING)
    own_model("sound", CODE)
    case_file(Path("cases/none.yaml"), "../records/none.csv")
    with running_cluster(user / "cluster") as there:
        events = Events()
        limits = {"time_limit": 15.0, "trust": True}
        fleet = exfit.batch(folder, "there", scheduler=there.address, observer=events, **limits)
        with connected(there.address) as client:
            worker = next(iter(dispatch.threads_of(client)))
        with pytest.raises(ClusterError, match="a Worker of Dask, not a scheduler"):
            exfit.batch(folder, "there", scheduler=worker, retry_failed=True)
    rows = {case.name: case for case in fleet.cases}
    assert rows["hanging"].status == "timed out"
    assert rows["crashing"].status == "crashed"
    assert "SIGABRT: of the model, 3 times" in rows["crashing"].reason
    Path("cases/hanging.yaml").unlink()
    Path("cases/crashing.yaml").unlink()
    exfit.batch(folder, "here", workers=1, trust=True)
    expected = without_times("here")
    assert {name for name in expected if name.endswith("result.json")}
    found = without_times("there")
    assert {name: found.get(name) for name in expected if "fleet." not in name} == expected
    assert sorted(events.of("started")) == sorted(f"{row.name}.yaml" for row in fleet.cases)


class Killer(Events):
    """An observer that kills a worker when some case has ended, and starts another one."""

    def __init__(self, cluster, moments):
        super().__init__()
        self.cluster, self.moments, self.processes = cluster, moments, []

    def finished(self, summary):
        super().finished(summary)
        if sum(event[0] == "done" for event in self.events) in self.moments:
            worker = self.cluster.workers.pop(0)
            self.processes += psutil.Process(worker.pid).children()
            worker.kill()  # alone: the process beside it ends by itself
            self.cluster.add_worker()


def processes_of(there):
    """Return the processes beside the workers of a cluster that fit cases."""
    children = (
        child for worker in there.workers for child in psutil.Process(worker.pid).children()
    )
    return [child for child in children if fits_cases(child)]


def fits_cases(process):
    try:
        return "exfit.features.fleet.worker" in " ".join(process.cmdline())
    except (psutil.ZombieProcess, psutil.NoSuchProcess):  # it has just ended
        return False


def none_runs(processes):
    running = (process for process in processes if process.is_running())
    return all(process.status() == psutil.STATUS_ZOMBIE for process in running)


@pytest.mark.long
def test_workers_that_are_killed_lose_nothing_and_blame_no_case(user):
    folder = cases(12)
    with running_cluster(user / "cluster") as there:
        killer = Killer(there, (1, 3, 5))
        fleet = exfit.batch(folder, "there", scheduler=there.address, observer=killer)
        assert fleet.counts == {"done": 12}
        assert sorted(killer.of("done")) == sorted(f"c{number}.yaml" for number in range(12))
        assert killer.processes
        waited(lambda: none_runs(killer.processes), "the end of the processes beside")
        there.add_worker(hidden=True)
        with connected(there.address) as client:
            waited(lambda: len(dispatch.threads_of(client)) == 3, "a worker without exfit")
        with pytest.raises(ClusterError, match=r"exfit is missing there, .*No module named"):
            exfit.batch(folder, "again", scheduler=there.address)
    assert {case.status for case in exfit.read_fleet("again").cases} == {"not run"}


@pytest.mark.long
def test_an_interruption_ends_all_workers_and_a_lost_scheduler_the_batch(user):
    folder = cases(3)
    own_model("hanging", HANGING)
    with running_cluster(user / "cluster") as there:
        command = ["batch", str(folder), "--trust", "-q", "--scheduler", there.address]
        for output, stop, code in (
            ("interrupted", lambda batch: batch.send_signal(signal.SIGINT), 3),
            ("killed", lambda batch: batch.kill(), -signal.SIGKILL),
            ("lost", lambda _: kill_group(there.scheduler), 1),
        ):
            with heeding_interrupts():
                batch = subprocess.Popen(
                    [sys.executable, "-m", "exfit", *command, "-o", output],
                    stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(HERE)}, text=True,
                )  # fmt: skip
            waited(lambda: len([*Path(output).glob("*/result.json")]) == 3, "the results")  # noqa: B023
            beside = processes_of(there)
            assert beside
            stop(batch)
            said = batch.communicate(timeout=60.0)[1]
            assert batch.returncode == code
            lost = f"Error: {there.address}: connection to the scheduler lost"
            begins = {1: [lost], 3: ["Interrupted"]}.get(code, [])
            assert len(said.splitlines()) == len(begins), said
            assert all(said.startswith(words) for words in begins), said
            assert {case.status for case in exfit.read_fleet(output).cases} == {"done", "not run"}
            assert Path(output, "fleet.csv").is_file() == (code > 0)
            if code == 3:
                waited(lambda: none_runs(beside), "the end of all fits")  # noqa: B023
            if code < 0:  # those without a case stay for a while
                waited(lambda: len(processes_of(there)) == 1, "the end of the fit that hangs")


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def refusal(address):
    with pytest.raises(ClusterError) as refused, connected(address):
        pass
    return str(refused.value)


@pytest.mark.long
def test_an_address_without_a_scheduler_is_refused_in_a_line(monkeypatch, capfd):
    monkeypatch.setattr(dispatch, "CONNECTED_WITHIN", 0.3)
    free = f"127.0.0.1:{free_port()}"
    # a busy machine may not even come to the refusal in so short a time
    assert re.fullmatch(f"{free}: no connection: (Connection refused|Timed out .*)", refusal(free))
    assert refusal("here") == "here: no connection: missing port number in address 'here'"
    assert "unknown address scheme 'fax'" in refusal("fax://here:1")
    assert refusal(f"tls://{free}").endswith(
        "no certificates are configured for TLS (distributed.comm.tls of Dask's settings)"
    )
    assert refusal("nowhere.invalid:8786").startswith("nowhere.invalid:8786: no connection: ")
    assert capfd.readouterr() == ("", "")


@pytest.mark.long
def test_another_program_at_the_address_is_no_scheduler(monkeypatch, capfd):
    monkeypatch.setattr(dispatch, "CONNECTED_WITHIN", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer():
            talk, _ = server.accept()
            with talk:
                talk.sendall(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n")

        threading.Thread(target=answer, daemon=True).start()
        address = f"127.0.0.1:{server.getsockname()[1]}"
        assert refusal(address) == f"{address}: not a scheduler of Dask"
    assert capfd.readouterr() == ("", "")


def test_without_the_package_the_message_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert refusal("here:1") == (
        '--scheduler: needs the package distributed: pip install "exfit[cluster]"'
    )


def test_versions_that_differ_are_named():
    here = remote.versions()
    assert {"exfit", "Python", "numpy", "scipy", "llvmlite", "system"} <= here.keys()
    for there, words in {
        (): "",
        (("numpy", "1.9"),): f"numpy 1.9, here {here['numpy']}",
        (("Python", "3.99.0"), ("exfit", "9")): f"exfit 9, here {here['exfit']}, Python 3.99.0",
    }.items():
        answer = Future()
        answer.set_result({"w": {**here, **dict(there)}})
        assert words in dispatch.answered("w", answer)
        assert bool(words) == bool(dispatch.answered("w", answer))
    for fault, words in {
        ModuleNotFoundError("No module named 'exfit'"): "exfit is missing there, or is an earlier",
        RuntimeError("odd"): "RuntimeError: odd",
    }.items():
        answer = Future()
        answer.set_result({"w": fault})
        assert words in dispatch.answered("w", answer)
    for lost in (OSError("gone"), KeyError("w")):
        answer = Future()
        answer.set_exception(lost)
        assert dispatch.answered("w", answer) is None
