"""An interruption waits for what may not be cut in two."""

import signal
import threading

import pytest

from exfit.util.interrupts import deferred_interrupts


@pytest.fixture(autouse=True)
def handler():
    """Have interruptions raise KeyboardInterrupt, as in a program that a shell starts."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


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
