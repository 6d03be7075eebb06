"""The search of a fit: which descents it makes, which end it returns, and the path to it."""

import numpy as np
import pytest

from exfit.errors import SimulationError
from exfit.estimate import LocalMinimum, MultistartResult, Result, SolverIteration, Stop
from exfit.fitting.global_search import (
    METHODS_OF_AUTO,
    NO_JUDGE,
    FurtherDescents,
    Judge,
    extended,
    global_search,
    judged_again,
    local_search,
    no_doubt,
)

MARGIN = 0.01  # of a cost
WAYS = ("linear", "direct")


def end(cost, stop=Stop.GRADIENT, phases=("dgn",)):
    """Return the end of a descent at a cost, a line of its log for each phase.

    Where costs differ by a unit the ends are minima of their own.
    """
    x, nothing = np.array([cost]), np.full(2, np.sqrt(cost))
    lines = tuple(
        SolverIteration(number, phase, x, cost, 0.0, 0.0, 1.0, 0, number + 1, number + 1, 1.0)
        for number, phase in enumerate(phases)
    )
    converged = stop is Stop.GRADIENT
    return Result(
        x, cost, nothing, np.ones((2, 1)), np.zeros(1), 0.0, 0.0, len(lines), len(lines),
        len(lines), 1 if converged else 0, stop.value, converged, lines, stop,
        np.zeros(1, dtype=int),
    )  # fmt: skip


class Scripted:
    """Searches whose ends are given: of the methods in turn, then of the further starts."""

    def __init__(self, *own, more=(), interrupted=False, unbounded=(), why_direct=""):
        self.own, self.more = list(own), more
        self.is_interrupted, self.unbounded = interrupted, unbounded
        self.why_direct = why_direct
        self.calls = []

    def one(self, method, announce):
        self.calls.append(method)
        result = self.own.pop(0)
        if result is KeyboardInterrupt:
            raise KeyboardInterrupt
        for line in result.history:
            announce(line)
        return result

    def further(self, earlier):
        self.calls.append("further")
        every = [*earlier, *self.more]
        costs = np.array([each.cost for each in every])
        groups = {}
        for each in sorted(every, key=lambda each: each.cost):
            groups.setdefault(each.cost, []).append(each)
        minima = tuple(
            LocalMinimum(group[0].x, cost, len(group), group[0]) for cost, group in groups.items()
        )
        best = min(every, key=lambda each: each.cost)
        found = MultistartResult(minima, best, costs, costs, 0, 0, self.is_interrupted)
        return FurtherDescents(found, WAYS, self.why_direct)

    def refined(self, result, announce):
        self.calls.append("refined")
        lines = [line._replace(number=k, phase="lm", nfev=k + 1, njev=k + 1)
                 for k, line in enumerate(result.history[-1:] * 3)]  # fmt: skip
        for line in lines:
            announce(line)
        return result._replace(history=tuple(lines), nfev=3, njev=3)

    def margin(self, lowest):
        return MARGIN * lowest.cost


def doubted(*costs):
    """Return a judgement that doubts the ends at these costs."""
    return lambda each: f"doubt about {each.cost:g}" if each.cost in costs else ""


def judged(searches, doubt, search=global_search):
    """Return what strategy auto comes to, and the lines that were announced."""
    lines = []
    return search(searches, METHODS_OF_AUTO, Judge(doubt, doubt), lines.append), lines


def searched(searches, search=global_search, refused=no_doubt):
    """Return what a search by another strategy comes to, and the lines that were announced."""
    lines = []
    return search(searches, ("lm",), Judge(refused, no_doubt), lines.append), lines


def test_a_local_search_is_the_descent_from_the_start_of_the_case():
    searches = Scripted(end(4.0, phases=("lm", "lm")), more=[end(1.0)])
    found, lines = searched(searches, local_search)
    assert searches.calls == ["lm"]
    assert (found.best.cost, found.minima, found.notes) == (4.0, None, ())
    assert list(found.history) == lines


def test_where_the_own_descent_came_to_the_lowest_minimum_its_path_is_the_result():
    own, near = end(1.0, phases=("lm", "dgn")), end(1.0 - 1e-9)
    searches = Scripted(own, more=[near, end(4.0)])
    found, lines = searched(searches)
    assert searches.calls == ["lm", "further"]
    assert found.best.history is own.history
    assert list(found.history) == lines == [*own.history]
    assert found.minima.minima[found.place].cost == near.cost
    assert found.ways == ("strategy", *WAYS)


def test_a_lower_minimum_of_another_start_is_refined_behind_the_own_path():
    own = end(4.0, phases=("lm", "dgn"))
    searches = Scripted(own, more=[end(1.0), end(9.0)])
    found, lines = searched(searches)
    assert searches.calls == ["lm", "further", "refined"]
    assert (found.best.cost, found.own.cost, found.place) == (1.0, 4.0, 0)
    assert list(found.history) == lines
    assert [line.phase for line in lines] == ["lm", "dgn", "search", "lm", "lm"]
    assert [line.cost for line in lines] == [4.0, 4.0, 1.0, 1.0, 1.0]
    assert [line.number for line in lines] == [0, 1, 2, 3, 4]
    assert [line.nfev for line in lines] == [1, 2, 3, 4, 5]
    assert np.isnan(lines[2].damping)
    assert (found.best.nfev, found.best.njev) == (5, 5)


def test_an_own_descent_that_did_not_converge_is_not_preferred():
    own = end(1.0, Stop.ITERATIONS)
    searches = Scripted(own, more=[end(1.0 - 1e-9)])
    found, _ = searched(searches)
    assert searches.calls == ["lm", "further", "refined"]
    assert found.best.success


@pytest.mark.parametrize("stop", [Stop.MATCH, Stop.FLAT])
def test_a_tolerance_of_the_case_that_ended_the_descent_ends_the_search(stop):
    searches = Scripted(end(4.0, stop), more=[end(1.0)])
    found, _ = searched(searches)
    assert searches.calls == ["lm"]
    assert found.best.stop is stop
    assert found.notes == (
        "no search from further starts: a tolerance of the case ended the run from its start",
    )


def test_without_bounds_there_are_no_further_starts_and_a_note_says_so():
    searches = Scripted(end(4.0), more=[end(1.0)], unbounded=("KA", "TE"))
    found, _ = searched(searches)
    assert searches.calls == ["lm"]
    assert found.minima is None
    assert found.notes[0].startswith("no search from further starts")
    assert "KA, TE" in found.notes[0]


def test_a_search_without_its_linear_phase_says_why():
    found, _ = searched(Scripted(end(1.0), more=[end(4.0)], why_direct="the network is switched"))
    assert found.notes == ("the search has no linear phase: the network is switched",)


def test_an_interruption_of_the_own_descent_is_the_end():
    searches = Scripted(end(4.0, Stop.INTERRUPTED), more=[end(1.0)])
    found, _ = searched(searches)
    assert searches.calls == ["lm"]
    assert found.best.stop is Stop.INTERRUPTED


def test_an_interruption_among_further_starts_keeps_the_lowest_of_all():
    found, lines = searched(Scripted(end(4.0), more=[end(1.0)], interrupted=True))
    assert (found.best.stop, found.best.cost) == (Stop.INTERRUPTED, 1.0)
    assert not found.best.success
    assert [line.phase for line in lines] == ["dgn", "search"]
    assert list(found.history) == lines
    assert found.minima.interrupted


def test_an_interruption_among_further_starts_keeps_the_own_descent_where_none_is_lower():
    own = end(1.0)
    found, lines = searched(Scripted(own, more=[end(4.0)], interrupted=True))
    assert found.best.history is own.history
    assert list(found.history) == lines == [*own.history]
    assert found.minima.interrupted


def test_an_interruption_before_any_end_is_passed_on():
    with pytest.raises(KeyboardInterrupt):
        searched(Scripted(KeyboardInterrupt))


# ---- minima that the records do not tell apart

LIKE = 1.0 + 0.5 * MARGIN
WORSE = 1.0 + 2.0 * MARGIN


def test_of_minima_that_the_records_do_not_tell_apart_it_is_one_on_which_validations_hold():
    searches = Scripted(end(1.0), more=[end(1.0), end(LIKE), end(4.0)])
    found, lines = searched(searches, refused=doubted(1.0))
    assert searches.calls == ["lm", "further", "refined"]
    assert (found.best.cost, found.place, found.for_validation) == (LIKE, 1, True)
    assert (found.best.success, found.notes) == (True, ())
    assert list(found.history) == lines


@pytest.mark.parametrize("refused", [(), (LIKE,), (1.0, LIKE)])
def test_it_is_the_lowest_where_validations_hold_on_it_or_on_none(refused):
    found, _ = searched(Scripted(end(1.0), more=[end(LIKE)]), refused=doubted(*refused))
    assert (found.best.cost, found.place, found.for_validation) == (1.0, 0, False)


def test_a_minimum_that_the_records_refute_is_not_taken_for_a_validation():
    found, _ = searched(Scripted(end(1.0), more=[end(WORSE)]), refused=doubted(1.0))
    assert (found.best.cost, found.place, found.for_validation) == (1.0, 0, False)


def test_validations_are_not_computed_where_there_is_nothing_to_choose_from():
    judged_ends = []
    searched(Scripted(end(1.0), more=[end(1.0)]), refused=judged_ends.append)
    assert judged_ends == []


@pytest.mark.parametrize(("other", "taken"), [(LIKE, True), (WORSE, False)])
def test_a_lower_minimum_found_later_is_judged_like_the_others(other, taken):
    searches = Scripted(end(1.0), more=[end(other)])
    found, lines = searched(searches)
    again = judged_again(searches, found, Judge(doubted(1.0), no_doubt), lines.append)
    assert (again.best.cost, again.for_validation) == ((other, True) if taken else (1.0, False))
    assert again.minima.minima[again.place].cost == again.best.cost
    assert list(again.history) == lines
    back = judged_again(searches, again._replace(place=0), NO_JUDGE, lines.append)
    assert not back.for_validation


# ---- strategy auto


@pytest.mark.parametrize("search", [local_search, global_search])
def test_a_doubt_leads_to_lm_and_dgn_and_the_note_says_why(search):
    searches = Scripted(end(4.0), end(1.0, phases=("lm", "lm", "dgn")))
    found, _ = judged(searches, doubted(4.0), search)
    assert searches.calls[:2] == [*METHODS_OF_AUTO]
    assert found.best.cost == 1.0
    assert found.notes == ("auto took dgn and lm-then-dgn, because after dgn: doubt about 4",)


def test_an_end_without_doubt_is_followed_by_no_other_strategy():
    searches = Scripted(end(1.0))
    found, lines = judged(searches, doubted())
    assert searches.calls == ["dgn", "further"]
    assert (found.best.cost, found.notes) == (1.0, ())
    assert list(found.history) == lines


@pytest.mark.parametrize("search", [local_search, global_search])
def test_the_history_joins_the_descents_and_ends_with_that_of_the_best(search):
    searches = Scripted(end(1.0, phases=("dgn", "dgn")), end(4.0, phases=("lm",)))
    found, _ = judged(searches, doubted(1.0, 4.0), search)
    assert [line.cost for line in found.history] == [4.0, 1.0, 1.0]
    assert [line.number for line in found.history] == [0, 1, 2]
    assert [line.nfev for line in found.history] == [1, 2, 3]
    assert (found.best.nfev, found.best.njev) == (3, 3)


def test_a_worse_minimum_is_never_returned_however_little_doubt_there_is_about_it():
    searches = Scripted(end(1.0), end(WORSE), more=[end(WORSE)] * 3 + [end(1.0)])
    found, _ = judged(searches, doubted(1.0))
    assert found.best.cost == 1.0


def test_of_minima_that_the_records_do_not_tell_apart_it_is_the_one_without_doubt():
    searches = Scripted(end(1.0), end(4.0), more=[end(1.0), end(LIKE)])
    found, _ = judged(searches, doubted(1.0, 4.0))
    assert (found.best.cost, found.place) == (LIKE, 1)
    assert (found.best.success, found.for_validation) == (True, True)


def test_in_a_local_search_a_note_says_that_the_validation_decided():
    found, _ = judged(Scripted(end(1.0), end(LIKE)), doubted(1.0), local_search)
    assert found.best.cost == LIKE
    assert "no independent test" in found.notes[-1]


@pytest.mark.parametrize(("times", "success"), [(1, False), (2, True)])
def test_a_minimum_in_doubt_has_converged_only_if_two_descents_led_there(times, success):
    searches = Scripted(end(4.0), end(4.0), more=[end(1.0)] * times + [end(9.0)] * 3)
    found, _ = judged(searches, doubted(1.0, 4.0, 9.0))
    assert found.best.cost == 1.0
    assert found.best.success == success
    assert (found.best.stop is Stop.UNCONFIRMED) == (not success)
    assert f"{times} of {5 + times} runs converged to this minimum" in found.notes[-1]


@pytest.mark.parametrize(("second", "success"), [(1.0, True), (4.0, False)])
def test_in_a_local_search_both_stages_must_agree_on_a_minimum_in_doubt(second, success):
    searches = Scripted(end(1.0), end(second))
    found, _ = judged(searches, doubted(1.0, 4.0), local_search)
    assert found.minima is None
    assert found.best.success == success


def test_the_lowest_end_that_did_not_converge_is_returned_as_such():
    searches = Scripted(end(1.0, Stop.ITERATIONS), end(4.0), more=[end(4.0)] * 3)
    found, _ = judged(searches, doubted(1.0))
    assert found.best.stop is Stop.ITERATIONS
    assert not found.best.success


@pytest.mark.parametrize("second", [end(0.5, Stop.INTERRUPTED), KeyboardInterrupt])
def test_an_interruption_keeps_the_best_point_so_far(second):
    found, _ = judged(Scripted(end(1.0), second), doubted(1.0))
    assert found.best.stop is Stop.INTERRUPTED
    assert not found.best.success
    assert found.best.cost == (1.0 if second is KeyboardInterrupt else 0.5)
    assert found.history[-1].cost == found.best.cost


def test_an_interruption_of_the_judgement_keeps_the_end_that_was_judged():
    def interrupted(_):
        raise KeyboardInterrupt

    found, _ = judged(Scripted(end(1.0)), interrupted)
    assert (found.best.stop, found.best.cost) == (Stop.INTERRUPTED, 1.0)


def test_an_interruption_of_the_last_judgement_keeps_the_lowest_of_all():
    def interrupted(each):
        if each.cost == 1.0:
            raise KeyboardInterrupt
        return "doubt"

    found, _ = judged(Scripted(end(4.0), end(3.0), more=[end(1.0)]), interrupted)
    assert (found.best.stop, found.best.cost) == (Stop.INTERRUPTED, 1.0)
    assert found.minima.interrupted


def test_a_minimum_without_a_response_among_other_parameters_is_left_out():
    class Restless(Scripted):
        def refined(self, result, announce):
            if result.cost == 3.0:
                raise SimulationError("no state of rest")
            return super().refined(result, announce)

    found, _ = searched(Restless(end(1.0), more=[end(2.0), end(3.0)]))
    assert [minimum.cost for minimum in found.minima.minima] == [1.0, 2.0, 3.0]
    wider = extended(Restless(), found, lambda x: x, lambda _: None, "given")
    assert [minimum.cost for minimum in wider.minima.minima] == [1.0, 2.0]
    assert wider.best.cost == 1.0
