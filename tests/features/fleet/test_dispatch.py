"""What a batch sends to a cluster, and what it makes of what comes back: with a cluster in words.

A made-up client has workers that answer when a test says so; nothing is fitted.
"""

import pickle
from concurrent.futures import Future
from dataclasses import replace
from itertools import count, pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

from exfit.features.fleet import dispatch, remote
from exfit.features.fleet.dispatch import (
    AHEAD,
    MOST_DEATHS,
    MOST_LOSSES,
    TOGETHER,
    ClusterError,
    Dispatch,
)
from exfit.features.fleet.folder import CaseOutcome, Failure, IndexEntry
from exfit.features.fleet.local import Waiting
from exfit.features.fleet.plan import PlannedCase
from exfit.features.fleet.remote import Reply
from exfit.features.fleet.task import CaseTask


class Futures:
    """What a client gives for a task: here a case that a worker of words has, or has done."""

    def __init__(self, key, worker, cases):
        self.key, self.worker, self.cases = key, worker, cases
        self.answer, self.callbacks = Future(), []

    def add_done_callback(self, call):
        self.callbacks.append(call)

    def finish(self, reply):
        """Let the worker reply, or raise."""
        if isinstance(reply, Exception):
            self.answer.set_exception(reply)
        else:
            self.answer.set_result(reply)
        for call in self.callbacks:
            call(self)

    def result(self, timeout):
        return self.answer.result(timeout)

    def release(self):
        """Forget it."""


class WordyClient:
    """A client whose workers are names with threads; ``under_way`` is what they have."""

    def __init__(self, **threads):
        self.threads, self.under_way, self.most, self.status = threads, [], 0, "running"
        self.versions, self.seconds = {}, 10.0
        self.scheduler = SimpleNamespace(address="tcp://words:1", ncores=lambda: None)
        self.stopped = []

    def sync(self, call, *_, **options):
        if call == self.scheduler.ncores:
            if self.status != "running":
                raise OSError("gone")
            return dict(self.threads)
        self.stopped.append(options["workers"])
        return None

    async def _run(self, *_, **__):
        """Stand for what `stop` calls."""

    def submit(self, run, payload, key, workers, pure):
        assert run.__closure__ is None  # pickled with its code alone
        future = Futures(key, workers[0], pickle.loads(payload).cases)
        self.under_way.append(future)
        self.most = max(self.most, len(self.under_way))
        return future

    def cancel(self, futures, force):
        for future in futures if isinstance(futures, list) else [futures]:
            if future in self.under_way:
                self.under_way.remove(future)

    def finish(self, future, reply=None):
        self.under_way.remove(future)
        done = Reply(CaseOutcome(failure=Failure("failed", "of words", self.seconds)))
        refused = isinstance(reply, Exception)
        future.finish(reply if refused else (reply or done,) * len(future.cases))


@pytest.fixture(autouse=True)
def quickly(monkeypatch):
    """Look at the workers each time, and take all that are there for workers of these versions."""
    monkeypatch.setattr(dispatch, "LOOK", 0.0)
    monkeypatch.setattr(dispatch, "FETCHED_WITHIN", 0.01)

    def asked(client, worker):
        answer = Future()
        answer.set_result(client.versions.get(worker, ""))
        return answer

    monkeypatch.setattr(dispatch, "asked", asked)
    monkeypatch.setattr(dispatch, "answered", lambda _, answer: answer.result())


def planned(names, tmp_path):
    """Return a case for each name, grouped by its first letter."""
    file = tmp_path / "case.yaml"
    file.write_text("{}")
    return [
        PlannedCase(IndexEntry(name), CaseTask((file,), name, Path("fleet"), group=name[0]))
        for name in names
    ]


class Run:
    """A dispatch of cases to a made-up client, step by step."""

    def __init__(self, client, cases, begin=lambda _: True):
        self.client, self.ended = client, {}
        self.dispatch = Dispatch(client, Waiting(iter(cases)), begin, self._end, 60.0)
        self.dispatch.wait_for_workers()

    def _end(self, case, outcome):
        assert case.entry.case not in self.ended
        self.ended[case.entry.case] = outcome

    def until_done(self, reply, most=100_000):
        """Go on, and let ``reply(client)`` act between two steps."""
        run, steps = self.dispatch, count()
        while not run.waiting.exhausted:
            run.waiting.plan_one()
        while run.waiting or run.sent:
            assert next(steps) < most
            run._look()
            run._send()
            if self.client.under_way:
                reply(self.client)
            while not run.arrived.empty():
                run._fetch()
        return self.ended


def test_no_more_cases_are_under_way_than_the_workers_need(tmp_path):
    client = WordyClient(a=1, b=3)
    run = Run(client, planned([f"m{number}" for number in range(500)], tmp_path))
    ended = run.until_done(lambda client: client.finish(client.under_way[0]))
    assert len(ended) == 500
    assert client.most == AHEAD * 4


def test_short_cases_travel_together_and_long_ones_alone(tmp_path):
    cases = planned([f"{kind}{number}" for kind in "ls" for number in range(100)], tmp_path)
    client, sizes = WordyClient(a=2, b=1), {"s": [], "l": []}

    def reply(client):
        future = client.under_way[0]
        (group,) = {case.task.group for case in future.cases}
        client.seconds = {"s": 0.2, "l": 2.0}[group]
        sizes[group].append(len(future.cases))
        client.finish(future)

    assert len(Run(client, cases).until_done(reply)) == 200
    assert max(sizes["s"]) == TOGETHER / 0.2
    assert set(sizes["l"]) == {1}


def test_the_last_short_cases_travel_alone_so_that_all_workers_end_together(tmp_path):
    client, sizes = WordyClient(a=2, b=1), []
    client.seconds = 0.2

    def reply(client):
        sizes.append(len(client.under_way[0].cases))
        client.finish(client.under_way[0])

    Run(client, planned([f"m{number}" for number in range(200)], tmp_path)).until_done(reply)
    assert max(sizes) == TOGETHER / 0.2
    assert sizes[-1] == 1


def test_of_cases_that_travel_together_one_that_dies_is_tried_again_alone(tmp_path):
    client, tries = WordyClient(a=1), []
    client.seconds = 0.2

    def reply(client):
        future = client.under_way[0]
        names = [case.entry.case for case in future.cases]
        if "m9" in names:
            tries.append(names)
            client.under_way.remove(future)
            death = Reply(death="the worker was ended by SIGSEGV")
            future.finish(tuple(death if name == "m9" else Reply() for name in names))
        else:
            client.finish(future)

    ended = Run(client, planned([f"m{number}" for number in range(40)], tmp_path)).until_done(reply)
    assert len(ended) == 40
    assert len(tries[0]) > 1
    assert tries[1:] == [["m9"]] * (MOST_DEATHS - 1)
    assert ended["m9"].failure.kind == "crashed"


def test_what_a_worker_did_not_come_to_is_sent_again(tmp_path):
    client = WordyClient(a=1)
    client.seconds = 0.2

    def reply(client):
        future = client.under_way.pop(0)
        future.finish((Reply(CaseOutcome(failure=Failure("failed", "of words", 0.2))),))

    assert len(Run(client, planned([f"m{n}" for n in range(30)], tmp_path)).until_done(reply)) == 30


def test_large_cases_travel_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.setattr(dispatch, "MOST_BYTES", 1)
    client = WordyClient(a=4, b=4)
    run = Run(client, planned([f"m{number}" for number in range(20)], tmp_path))
    assert len(run.until_done(lambda client: client.finish(client.under_way[0]))) == 20
    assert client.most == 1


def test_a_worker_stays_with_a_model_as_long_as_there_are_cases_of_it(tmp_path):
    names = [f"{model}{number}" for number in range(50) for model in "pqrstuvw"]
    client, had = WordyClient(a=1, b=1), {"a": [], "b": []}

    def reply(client):
        for worker in had:
            future = next(sent for sent in client.under_way if sent.worker == worker)
            had[worker].append(future.cases[0].task.group)
            client.finish(future)
            if not client.under_way:
                break

    Run(client, planned(names, tmp_path)).until_done(reply, most=1_000)
    changes = sum(a != b for models in had.values() for a, b in pairwise(models))
    # each model once, and the last ones shared
    assert changes <= 8


def test_a_worker_that_is_lost_gives_back_what_it_had_and_nothing_counts_twice(tmp_path):
    client = WordyClient(a=1, b=1)
    names = iter(range(1_000))
    rounds = count()

    def reply(client):
        if next(rounds) % 5 == 4:  # often: each case is hit at times
            lost = next(iter(client.threads))
            del client.threads[lost]
            client.threads[f"w{next(names)}"] = 1
        elif client.under_way:
            client.finish(client.under_way[0])

    run = Run(client, planned([f"m{number}" for number in range(100)], tmp_path))
    ended = run.until_done(reply)
    assert len(ended) == 100
    assert {outcome.failure.kind for outcome in ended.values()} == {"failed"}  # as the words say
    assert client.under_way == []


def test_what_comes_late_from_a_worker_that_was_lost_is_not_counted(tmp_path):
    client = WordyClient(a=1)
    run = Run(client, planned(["m1"], tmp_path)).dispatch
    run.waiting.plan_one()
    run._send()
    late = client.under_way[0]
    client.threads = {"b": 1}
    run._look()
    run._look()
    run._send()
    assert [future.worker for future in client.under_way] == ["b"]
    late.finish((Reply(),))
    run._fetch()
    assert [*run.sent] == [client.under_way[0].key]


def test_a_case_whose_process_dies_is_tried_again_and_then_has_crashed(tmp_path):
    client, tries = WordyClient(a=1, b=1), []

    def reply(client):
        future = client.under_way[0]
        if future.cases[0].entry.case == "m3":
            tries.append(future.worker)
            client.finish(future, Reply(death="the worker was ended by SIGSEGV"))
        else:
            client.finish(future)

    ended = Run(client, planned(["m1", "m2", "m3", "m4"], tmp_path)).until_done(reply)
    assert len(tries) == MOST_DEATHS
    failure = ended.pop("m3").failure
    assert failure.kind == "crashed"
    assert failure.reason == f"the worker was ended by SIGSEGV, {MOST_DEATHS} times"
    assert {outcome.failure.kind for outcome in ended.values()} == {"failed"}


def test_a_case_in_whose_middle_all_workers_are_lost_is_not_sent_for_ever(tmp_path):
    client, number, losses = WordyClient(w0=1), count(1), []

    def reply(client):
        if client.under_way and client.under_way[0].cases[0].entry.case == "m1":
            losses.append(client.threads)
            client.threads = {f"w{next(number)}": 1}
        elif client.under_way:
            client.finish(client.under_way[0])

    ended = Run(client, planned(["m1", "m2"], tmp_path)).until_done(reply)
    assert len(losses) == MOST_LOSSES
    assert ended["m1"].failure.kind == "crashed"
    assert ended["m2"].failure.kind == "failed"  # it only waited there


def test_what_waits_behind_a_long_case_goes_to_a_worker_that_has_nothing_to_do(tmp_path):
    client, begun = WordyClient(a=1, b=1), []

    def reply(client):
        long = [future for future in client.under_way if future.cases[0].entry.case == "m0"]
        others = [future for future in client.under_way if future.worker != long[0].worker]
        client.finish((others or long)[0])

    def begin(case):
        begun.append(case.entry.case)
        return True

    run = Run(client, planned([f"m{number}" for number in range(9)], tmp_path), begin)
    ended = run.until_done(reply)
    assert [*ended][-1] == "m0"
    assert sorted(begun) == sorted(ended)  # each is announced once


def test_a_worker_that_can_fit_nothing_is_used_no_more(tmp_path):
    client = WordyClient(a=1, b=1)

    def reply(client):
        for future in [*client.under_way]:
            broken = future.worker == "a"
            client.finish(future, remote.NoProcess("no memory") if broken else None)

    run = Run(client, planned([f"m{number}" for number in range(20)], tmp_path))
    ended = run.until_done(reply)
    assert len(ended) == 20
    assert {outcome.failure.kind for outcome in ended.values()} == {"failed"}
    assert run.dispatch.refused == {"a": "cannot fit any case: NoProcess: no memory"}


def test_where_no_worker_is_left_the_batch_ends_with_the_reasons(tmp_path, monkeypatch):
    client = WordyClient(a=1)

    def break_all(client):
        for future in [*client.under_way]:
            client.finish(future, remote.NoProcess("no memory"))

    run = Run(client, planned(["m1", "m2"], tmp_path))
    with pytest.raises(ClusterError, match="worker a: cannot fit any case: NoProcess: no memory"):
        run.until_done(break_all)
    run = Run(WordyClient(a=1), planned(["m1", "m2"], tmp_path))
    monkeypatch.setattr(dispatch, "WITHOUT_WORKERS", 0.0)
    with pytest.raises(ClusterError, match="tcp://words:1: no worker is left"):
        run.until_done(lambda client: client.threads.clear())


def test_a_worker_with_other_versions_ends_the_batch_before_its_first_case(tmp_path):
    client = WordyClient(a=1, b=1)
    client.versions["b"] = "numpy 1.9, here 2.4"
    with pytest.raises(ClusterError, match=r"worker b: numpy 1.9, here 2.4"):
        Run(client, planned(["m1"], tmp_path))
    assert client.under_way == []
    client = WordyClient(a=1)  # one that comes later is not used
    run = Run(client, planned([f"m{number}" for number in range(9)], tmp_path))
    client.threads["late"], client.versions["late"] = 1, "numpy 1.9, here 2.4"

    def reply(client):
        assert {future.worker for future in client.under_way} == {"a"}
        client.finish(client.under_way[0])

    assert len(run.until_done(reply)) == 9


def test_a_lost_scheduler_ends_the_batch(tmp_path):
    client = WordyClient(a=1)
    run = Run(client, planned(["m1"], tmp_path))
    client.status = "connecting"
    with pytest.raises(ClusterError, match="connection to the scheduler lost"):
        run.until_done(lambda _: None)


def test_what_has_arrived_is_kept_where_the_scheduler_is_lost(tmp_path):
    client = WordyClient(a=1)
    run = Run(client, planned([f"m{number}" for number in range(9)], tmp_path))

    def reply(client):
        client.finish(client.under_way[0])

        def refuse(*_, **__):
            raise RuntimeError("closed")

        client.submit = refuse

    with pytest.raises(ClusterError, match="tcp://words:1: connection to the scheduler lost: clo"):
        run.until_done(reply)
    assert [*run.ended] == ["m0"]


def test_without_workers_the_message_names_the_command_that_starts_one(tmp_path, monkeypatch):
    monkeypatch.setattr(dispatch, "FIRST_WORKER", 0.0)
    with pytest.raises(ClusterError, match="dask worker tcp://words:1 --nthreads 1"):
        Run(WordyClient(), planned(["m1"], tmp_path))


def test_what_is_under_way_is_ended_with_the_batch(tmp_path):
    client = WordyClient(a=1, b=2)
    run = Run(client, planned([f"m{number}" for number in range(9)], tmp_path)).dispatch
    run.waiting.plan_one()
    run.waiting.plan_one()
    run._send()
    assert len(client.under_way) == 2
    run.stop()
    assert client.under_way == []
    assert [sorted(workers) for workers in client.stopped] == [["a", "b"]]


def test_a_case_that_cannot_be_packed_fails_alone(tmp_path):
    cases = planned(["m1", "m2"], tmp_path)
    cases[0] = cases[0]._replace(task=replace(cases[0].task, files=(tmp_path,)))
    ended = Run(WordyClient(a=1), cases).until_done(
        lambda client: [client.finish(future) for future in [*client.under_way]]
    )
    assert "cannot be read: Is a directory" in ended["m1"].failure.reason
    assert ended["m2"].failure.reason == "of words"
