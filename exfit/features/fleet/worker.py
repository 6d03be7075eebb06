"""The process of a worker on this computer: it fits one case at a time, with one thread.

It is given tasks on its standard input and answers on its standard output, both as pickles. Its
standard input ends where the batch ends, however that happened: then it ends, too, in the middle of
a fit. What else would be printed goes to the standard error.
"""

import gc
import os
import pickle
import signal
import sys
from queue import SimpleQueue
from threading import Thread
from typing import Any, BinaryIO

from exfit.util.interrupts import ENDING

READY, BEGUN = "ready", "begun"  # what a worker answers beside outcomes


def main() -> None:
    """Fit the cases that the batch gives, until there are no more."""
    # Ctrl-C and the end of a terminal reach all its processes; the batch ends its workers
    for number in (signal.SIGINT, *ENDING):
        signal.signal(number, signal.SIG_IGN)
    # the standard input and output, which nothing else uses from now on
    tasks_from = os.fdopen(os.dup(sys.stdin.fileno()), "rb")
    answers_to = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, sys.stdin.fileno())
    os.close(nothing)
    tasks: SimpleQueue[Any] = SimpleQueue()
    Thread(target=_receive, args=(tasks_from, tasks), daemon=True).start()

    # what every fit needs; the collector of garbage need not look through it
    import exfit.results.io
    import exfit.workflows  # noqa: F401
    from exfit.features.fleet.task import crash

    gc.set_threshold(100_000)
    gc.collect()
    gc.freeze()
    _answer(answers_to, READY)
    while True:
        task = tasks.get()
        _answer(answers_to, BEGUN)
        _answer(answers_to, crash(task) if isinstance(task, Exception) else task.run())


def _receive(tasks_from: BinaryIO, tasks: "SimpleQueue[Any]") -> None:
    """Put tasks into a queue as they come; end the process where there will be no more."""
    while True:
        try:
            task = pickle.load(tasks_from)
        except (EOFError, OSError, pickle.UnpicklingError):
            os._exit(0)
        except Exception as fault:  # of what the task names: its case fails, no other
            task = fault
        tasks.put(task)


def _answer(answers_to: BinaryIO, answer: Any) -> None:
    content = pickle.dumps(answer, protocol=pickle.HIGHEST_PROTOCOL)
    try:
        answers_to.write(content)
        answers_to.flush()
    except OSError:  # the batch has ended
        os._exit(0)
