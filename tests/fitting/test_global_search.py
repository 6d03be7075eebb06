"""Strategy auto: how far it goes, which end it returns, and when it counts as converged."""

from dataclasses import replace

import numpy as np
import pytest
from exfit.fitting.recommended import MORE_STARTS, STAGES, recommended

from exfit.estimate import LocalMinimum, MultistartResult, Result, SolverIteration, Stop

MARGIN = 0.01  # of a cost


def end(cost, stop=Stop.GRADIENT, phases=("dgn",)):
    """Return the end of a search at a cost, a line of its log for each phase."""
    x, nothing = np.array([cost]), np.zeros(1)
    lines = tuple(
        SolverIteration(number, phase, x, cost, 0.0, 0.0, 1.0, 0, number + 1, number + 1, 1.0)
        for number, phase in enumerate(phases)
    )
    converged = stop is Stop.GRADIENT
    return Result(
        x, cost, nothing, np.zeros((1, 1)), nothing, 0.0, 0.0, len(lines), len(lines), len(lines),
        1 if converged else 0, stop.value, converged, lines, stop,
    )  # fmt: skip


class Scripted:
    """Searches whose ends are given: of the stages, then of the further starts."""

    def __init__(self, *stages, more=(), interrupted=False, bounded=True):
        self.stages, self.more = dict(zip(STAGES, stages, strict=False)), more
        self.interrupted, self.bounded = interrupted, bounded
        self.methods = []

    def one(self, method, announce):
        self.methods.append(method)
        found = self.stages[method]
        if found is KeyboardInterrupt:
            raise KeyboardInterrupt
        for line in found.history:
            announce(line)
        return found

    def many(self, method, count, earlier):
        assert (method, count) == ("lm-then-dgn", MORE_STARTS)
        self.methods.append("starts")
        if not self.bounded:
            return None
        ends = sorted([*earlier, *self.more], key=lambda each: each.cost)
        costs = np.array([each.cost for each in [*earlier, *self.more]])
        groups = {}
        for each in ends:
            groups.setdefault(each.cost, []).append(each)
        minima = tuple(
            LocalMinimum(group[0].x, cost, len(group), group[0]) for cost, group in groups.items()
        )
        return MultistartResult(minima, ends[0], costs, costs, 0, 0, self.interrupted)

    def margin(self, cost):
        return MARGIN * cost


def doubted(*costs):
    """Return a judgement that doubts the ends at these costs."""
    return lambda each: f"doubt about {each.cost:g}" if each.cost in costs else ""


def search(searches, doubt):
    heard = []
    return recommended(searches, doubt, heard.append), heard


def test_an_end_without_doubt_is_all_that_is_looked_for():
    searches = Scripted(end(1.0))
    found, heard = search(searches, doubted())
    assert searches.methods == ["dgn"]
    assert found.best.cost == 1.0
    assert found.notes == ()
    assert list(found.history) == heard


def test_a_doubt_leads_to_lm_and_dgn_and_the_note_says_why():
    searches = Scripted(end(4.0), end(1.0, phases=("lm", "lm", "dgn")))
    found, _ = search(searches, doubted(4.0))
    assert searches.methods == ["dgn", "lm-then-dgn"]
    assert found.best.cost == 1.0
    assert found.notes == ("auto took dgn and lm-then-dgn, because after dgn: doubt about 4",)


def test_the_history_joins_the_searches_and_ends_with_that_of_the_best():
    searches = Scripted(end(1.0, phases=("dgn", "dgn")), end(4.0, phases=("lm",)))
    found, _ = search(searches, doubted(1.0, 4.0))
    assert [line.cost for line in found.history] == [4.0, 1.0, 1.0]
    assert [line.number for line in found.history] == [0, 1, 2]
    assert [line.nfev for line in found.history] == [1, 2, 3]
    assert (found.best.nfev, found.best.njev) == (3, 3)


def test_a_worse_minimum_is_never_returned_however_little_doubt_there_is_about_it():
    worse = 1.0 + 2.0 * MARGIN
    searches = Scripted(end(1.0), end(worse), more=[end(worse)] * 3 + [end(1.0)])
    found, _ = search(searches, doubted(1.0))
    assert found.best.cost == 1.0


def test_of_minima_that_the_records_do_not_tell_apart_it_is_the_one_without_doubt():
    like = 1.0 + 0.5 * MARGIN
    searches = Scripted(end(1.0), end(4.0), more=[end(1.0), end(like)])
    found, _ = search(searches, doubted(1.0, 4.0))
    assert found.best.cost == like
    assert found.best.success
    assert "no independent test" in found.notes[-1]


@pytest.mark.parametrize(("times", "success"), [(1, False), (2, True)])
def test_a_minimum_in_doubt_has_converged_only_if_two_searches_led_there(times, success):
    searches = Scripted(end(4.0), end(4.0), more=[end(1.0)] * times + [end(9.0)] * 3)
    found, _ = search(searches, doubted(1.0, 4.0, 9.0))
    assert found.best.cost == 1.0
    assert found.best.success == success
    assert (found.best.stop is Stop.UNCONFIRMED) == (not success)
    assert f"{times} of {5 + times} searches" in found.notes[-1]


@pytest.mark.parametrize(("second", "success"), [(1.0, True), (4.0, False)])
def test_without_bounds_both_stages_must_agree_on_a_minimum_in_doubt(second, success):
    searches = Scripted(end(1.0), end(second), bounded=False)
    found, _ = search(searches, doubted(1.0, 4.0))
    assert found.minima is None
    assert found.best.success == success


def test_the_lowest_end_that_did_not_converge_is_returned_as_such():
    searches = Scripted(end(1.0, Stop.ITERATIONS), end(4.0), more=[end(4.0)] * 3)
    found, _ = search(searches, doubted(1.0))
    assert found.best.stop is Stop.ITERATIONS
    assert not found.best.success


@pytest.mark.parametrize("second", [end(0.5, Stop.INTERRUPTED), KeyboardInterrupt])
def test_an_interruption_keeps_the_best_point_so_far(second):
    found, _ = search(Scripted(end(1.0), second), doubted(1.0))
    assert found.best.stop is Stop.INTERRUPTED
    assert not found.best.success
    assert found.best.cost == (1.0 if second is KeyboardInterrupt else 0.5)
    assert found.history[-1].cost == found.best.cost


def test_an_interruption_of_the_judgement_keeps_the_end_that_was_judged():
    def interrupted(_):
        raise KeyboardInterrupt

    found, _ = search(Scripted(end(1.0)), interrupted)
    assert (found.best.stop, found.best.cost) == (Stop.INTERRUPTED, 1.0)


def test_an_interruption_among_further_starts_keeps_the_lowest_of_all():
    searches = Scripted(end(4.0), end(3.0), more=[end(1.0)], interrupted=True)
    found, _ = search(searches, doubted(3.0, 4.0))
    assert (found.best.stop, found.best.cost) == (Stop.INTERRUPTED, 1.0)
    assert found.minima.interrupted


def test_an_interruption_before_any_end_is_passed_on():
    with pytest.raises(KeyboardInterrupt):
        search(Scripted(KeyboardInterrupt), doubted())


def test_a_result_of_another_start_has_its_own_iterations_last():
    other = replace(end(1.0, phases=("lm", "dgn")), nfev=7)
    found, _ = search(Scripted(end(4.0), end(3.0), more=[other, other]), doubted(4.0, 3.0))
    assert [line.cost for line in found.history] == [4.0, 3.0, 1.0, 1.0]
    assert found.best.nfev == 1 + 1 + 7
