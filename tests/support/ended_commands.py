"""Commands that a signal meets as processes, at some moment, and what they leave in a folder."""

import signal
import subprocess
import sys
import time
from contextlib import contextmanager

from writers import WRITERS

WITH_SIGNALS = ("fit", "simulate", "report", "run", "export")
ENDS = {  # the exit codes of a command that meets a signal, and of one that is done before
    # the negative ones: before the command, or after it
    "SIGINT": (130, -2, 3, 0),
    "SIGTERM": (143, -15, 3, 0),
    "SIGKILL": (-9, 3, 0),
}
TEMPORARY = ".exfit-"
# the end of a phase, the validation, the uncertainty
OF_LATER_PHASES = ("parameters_lm.yaml", "down-step.csv", "sensitivities.csv")
PATIENCE = 120  # s


def contents(folder):
    """Return the files of a folder, and of those in it."""
    return {
        path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


@contextmanager
def heeding_interrupts():
    """Have the processes that start inside heed Ctrl-C: what a shell's background runs ignores it.

    They inherit that.
    """
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)


def started(name, place):
    """Start a command in a folder, in a process of its own."""
    with heeding_interrupts():
        return subprocess.Popen(
            [sys.executable, "-m", "exfit", *WRITERS[name]],
            cwd=place,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )


def undisturbed(name, place):
    """Run a command to its end; return how long that took, s."""
    began = time.perf_counter()
    process = started(name, place)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode in (0, 3), errors
    return time.perf_counter() - began


def fault_of(name, kind, moment, place):
    """Return what is wrong after a signal met a command a moment, s, after its start; or "".

    The command has run in the folder before. What SIGKILL leaves over, its next run must clear.
    """
    expected = {*contents(place)}
    process = started(name, place)
    time.sleep(moment)
    process.send_signal(signal.Signals[kind])
    _, errors = process.communicate(timeout=PATIENCE)
    left = {*contents(place)}
    if kind == "SIGKILL" and any(path.name.startswith(TEMPORARY) for path in left):
        undisturbed(name, place)
        left = {*contents(place)}
    if process.returncode not in ENDS[kind]:
        return f"exit code {process.returncode}: {errors}"
    if "Traceback" in errors:
        return errors
    if name == "fit" and left - expected == set():  # met in its first phase, a fit has fewer
        expected -= {path for path in expected - left if path.name in OF_LATER_PHASES}
    return "" if left == expected else f"files: {sorted(map(str, left ^ expected))}"
