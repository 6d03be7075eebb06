"""The process of another program: its answers, its end."""

import os
import sys
import time

import pytest

from exfit.external.process import ExternalProcess, ProgramError

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
    for _ in range(100):  # until the system has removed it
        if not is_alive(child) or "Z" in state(child):
            break
        time.sleep(0.05)
    assert not is_alive(child) or "Z" in state(child)


def state(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:  # noqa: PTH123
            return file.read().split()[2]
    except OSError:
        return "Z"


def test_a_command_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(ProgramError, match="no-such-program cannot be started"):
        ExternalProcess(["no-such-program"], tmp_path).answer({"id": 1}, 5.0)
