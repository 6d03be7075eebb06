"""The process of another program: its answers, its end."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import exfit
from exfit.features.external.program import ExternalProcess, ProgramError

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="the states are those of /proc")
ECHO = "import sys, json\nfor line in sys.stdin:\n    print({answer}, flush=True)\n"


def process(answer, folder):
    return ExternalProcess([sys.executable, "-c", ECHO.format(answer=answer)], folder)


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_one_process_answers_one_request_after_the_other(tmp_path):
    program = process(
        "json.dumps({**json.loads(line), 'pid': __import__('os').getpid()})", tmp_path
    )
    answers = [program.answer({"id": number}, 20.0) for number in (1, 2)]
    assert [answer["id"] for answer in answers] == [1, 2]
    assert answers[0]["pid"] == answers[1]["pid"]
    program.end()
    assert not is_alive(answers[0]["pid"])


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ("'hello'", "'hello' is not a line of JSON"),
        ("[1]", r"\[1\]' is not a JSON object"),
        ("json.dumps({'id': 7})", "the answer has id 7, not 1"),
        ("sys.exit('no licence')", "ended with exit code 1: no licence"),
    ],
)
def test_what_is_no_answer_is_reported_and_the_process_started_anew(answer, reason, tmp_path):
    program = process(answer, tmp_path)
    for starts in (1, 2):
        with pytest.raises(ProgramError, match=reason):
            program.answer({"id": 1}, 20.0)
        assert program.starts == starts


@pytest.mark.long
@on_linux
def test_a_process_that_hangs_is_ended_with_all_that_it_has_started(tmp_path):
    pids = tmp_path / "pids"
    code = (
        "import os, subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
        "open('pids', 'w').write(f'{os.getpid()} {child.pid}')\n"
        "time.sleep(600)\n"
    )
    program = ExternalProcess([sys.executable, "-c", code], tmp_path)
    with pytest.raises(ProgramError, match=r"no answer within 3 s"):
        program.answer({"id": 1}, 3.0)
    own, child = map(int, pids.read_text().split())
    assert not is_alive(own)
    wait_for(lambda: "Z" in state(child))


def state(pid):
    """Return the state of a process as Linux has it, Z where there is none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").split()[2]
    except OSError:
        return "Z"


def test_a_command_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(ProgramError, match="no-such-program cannot be started"):
        ExternalProcess(["no-such-program"], tmp_path).answer({"id": 1}, 5.0)


HANGING = "import os; open('pid', 'w').write(str(os.getpid())); import time; time.sleep(600)"
KILLED = f"""
import sys
from pathlib import Path
from exfit.features.external.program import ExternalProcess
ExternalProcess([sys.executable, "-c", {HANGING!r}], Path(".")).answer({{"id": 1}}, 600.0)
"""


@on_linux
def test_a_process_that_hangs_ends_where_this_one_is_killed(tmp_path):
    path = str(Path(exfit.__file__).parents[2])
    parent = subprocess.Popen(
        [sys.executable, "-c", KILLED], cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}
    )
    wait_for(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text())
    time.sleep(0.2)  # until its guard has been started, too
    parent.kill()
    parent.wait()
    wait_for(lambda: "Z" in state((tmp_path / "pid").read_text()))


def wait_for(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)
