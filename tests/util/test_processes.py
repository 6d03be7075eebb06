"""How many threads compute."""

import os

import pytest

from exfit.errors import ExfitError
from exfit.util.processes import in_threads, processors


def test_the_environment_says_how_many_threads_compute(monkeypatch):
    monkeypatch.setenv("EXFIT_THREADS", "3")
    assert processors() == 3
    monkeypatch.delenv("EXFIT_THREADS")
    assert 1 <= processors() <= os.cpu_count()


def test_only_the_processors_of_the_process_count(monkeypatch):
    monkeypatch.delenv("EXFIT_THREADS", raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {1, 5}, raising=False)
    assert processors() == 2
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert processors() == 1


@pytest.mark.parametrize("given", ["0", "-1", "two", "1.5"])
def test_another_number_is_refused(monkeypatch, given):
    monkeypatch.setenv("EXFIT_THREADS", given)
    with pytest.raises(ExfitError, match=f"EXFIT_THREADS: {given} must be a whole number from 1"):
        processors()


@pytest.mark.parametrize("threads", ["1", "2"])
def test_results_come_in_the_order_of_their_items(monkeypatch, threads):
    monkeypatch.setenv("EXFIT_THREADS", threads)
    assert [*in_threads(lambda number: number**2, range(5))] == [0, 1, 4, 9, 16]
