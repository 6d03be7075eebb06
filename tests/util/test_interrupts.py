"""An interruption waits for what may not be cut in two; what ends a program interrupts it."""

import importlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import exfit
from exfit.util.interrupts import ENDING, deferred_interrupts, endings_as_interruptions

PATIENCE = 30  # s


def interrupted(steps, error=None):
    """Be interrupted twice, and take a step after that, or fail."""
    with deferred_interrupts():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        if error is not None:
            raise error
        steps.append("the end")


def interrupted_inside(steps):
    with deferred_interrupts():
        interrupted(steps)
        steps.append("behind the inner one")


def test_an_interruption_waits_for_the_end():
    steps = []
    with pytest.raises(KeyboardInterrupt):
        interrupted(steps)
    assert steps == ["the end"]


def test_an_interruption_waits_for_the_end_of_the_outermost():
    steps = []
    with pytest.raises(KeyboardInterrupt):
        interrupted_inside(steps)
    assert steps == ["the end", "behind the inner one"]


def test_what_fails_counts_more_than_an_interruption_and_the_next_one_is_heard():
    with pytest.raises(ValueError, match="of its own"):
        interrupted([], ValueError("of its own"))
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_interruptions_that_are_ignored_stay_so():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with deferred_interrupts():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_other_threads_do_what_is_inside_and_leave_interruptions_alone():
    handlers = []

    def work():
        with deferred_interrupts():
            handlers.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert handlers == [signal.default_int_handler]


def ended(number, steps):
    """Take a step that a signal may not cut in two, and another one."""
    with deferred_interrupts():
        signal.raise_signal(number)
        steps.append("whole")
    steps.append("behind")


@pytest.mark.parametrize("number", ENDING)
def test_what_ends_a_program_interrupts_it_as_ctrl_c_does(number):
    former, steps = signal.getsignal(number), []
    with pytest.raises(KeyboardInterrupt), endings_as_interruptions() as received:
        ended(number, steps)
    assert (received, steps) == ([number], ["whole"])
    assert signal.getsignal(number) is former is signal.SIG_DFL


@pytest.mark.parametrize("number", ENDING)
def test_what_is_ignored_ends_nothing(number):
    former, steps = signal.signal(number, signal.SIG_IGN), []
    try:
        with endings_as_interruptions() as received:
            ended(number, steps)
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, former)
    assert (received, steps) == ([], ["whole", "behind"])


def together(numbers):
    """Raise signals where they may not cut anything in two."""
    with endings_as_interruptions(), deferred_interrupts():
        for number in numbers:
            signal.raise_signal(number)


@pytest.mark.parametrize("numbers", [(signal.SIGINT, ENDING[0]), (ENDING[0], signal.SIGINT)])
def test_all_handlers_are_restored_where_several_signals_come_at_once(numbers):
    with pytest.raises(KeyboardInterrupt):
        together(numbers)
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, *ENDING)]
    assert handlers == [signal.default_int_handler, *[signal.SIG_DFL] * len(ENDING)]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked there")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_process_that_was_forked_ends_as_others_do():
    with endings_as_interruptions():
        child = os.fork()
        if not child:
            signal.raise_signal(signal.SIGTERM)
            os._exit(0)
        _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == -signal.SIGTERM


def test_other_threads_get_no_handlers():
    handlers = []

    def work():
        with endings_as_interruptions():
            handlers.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert handlers == [signal.SIG_DFL]


def imported(module):
    """Import a module that a signal meets, and wait for what that does."""
    with endings_as_interruptions():
        importlib.import_module(module)
        time.sleep(PATIENCE)


@pytest.mark.parametrize("number", [signal.SIGINT, *ENDING])
def test_an_import_is_whole_before_an_interruption_takes_effect(number, tmp_path, monkeypatch):
    module = f"met_by_{number.name}"
    text = f"import signal\nsignal.raise_signal({number})\nwhole = True\n"
    (tmp_path / f"{module}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        imported(module)
    assert sys.modules.pop(module).whole


IN_TEXT = """\
from exfit.util.interrupts import endings_as_interruptions
def main():
    try:
        with endings_as_interruptions():
            exec("raise KeyboardInterrupt")
    except KeyboardInterrupt:
        raise SystemExit(143) from None
"""


def test_an_interruption_of_code_made_of_text_changes_no_exit_code(tmp_path):
    (tmp_path / "program.py").write_text(IN_TEXT + "main()\n")
    root = str(Path(exfit.__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((root, str(tmp_path)))}
    ran = subprocess.run([sys.executable, "-m", "program"], env=environment, check=False)
    assert ran.returncode == 143
