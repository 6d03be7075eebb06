"""Ctrl-C while the program of a case hangs."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from ended_commands import PATIENCE, heeding_interrupts
from outside_cases import written_case

# fits as processes; the states of processes are those of /proc
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform != "linux", reason="reads /proc"),
]
RUNS = 3  # after which it hangs: the start and two trials
HANGING = f"""
import os, subprocess, sys, time
from pathlib import Path
import outside_program, json
place = Path(__file__).parent
for number, line in enumerate(sys.stdin, 1):
    if number > {RUNS}:
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        (place / "pids.part").write_text(f"{{os.getpid()}} {{child.pid}}")
        (place / "pids.part").rename(place / "pids")
        time.sleep(600)
    print(json.dumps(outside_program.answer(json.loads(line), "")), flush=True)
"""


def test_an_interruption_ends_a_fit_whose_program_hangs_with_the_best_point(tmp_path):
    case = written_case(tmp_path)
    (tmp_path / "program.py").rename(tmp_path / "outside_program.py")
    (tmp_path / "program.py").write_text(HANGING, encoding="utf-8")
    text = case.read_text(encoding="utf-8").replace("time_limit: 20.0", "time_limit: 600.0")
    case.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "exfit", "fit", str(case), "-o", str(tmp_path / "run")]
    with heeding_interrupts():
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    wait_for((tmp_path / "pids").exists)
    group, child = map(int, (tmp_path / "pids").read_text().split())
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert b"Traceback" not in errors
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert result["interrupted"]
    assert result["cost"] < 0.5 * result["start_cost"]
    assert result["other_program"]["runs"] == RUNS
    wait_for(lambda: not is_running(group) and not is_running(child))
    assert not processes_of(tmp_path)


def wait_for(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def is_running(pid):
    """Return whether a process exists that has not ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").split()[2] != "Z"
    except OSError:
        return False


def processes_of(folder):
    """Return the processes that work in a folder."""
    found = (each for each in Path("/proc").iterdir() if each.name.isdigit())
    return [process for process in found if place_of(process) == folder]


def place_of(process):
    try:
        return (process / "cwd").readlink()
    except OSError:
        return None
