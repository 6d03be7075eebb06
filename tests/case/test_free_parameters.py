"""What a new case frees: no parameter that does nothing, and bounds between which units lie."""

import numpy as np
import pytest
from channel_records import response_of

from exfit.case.other_model import bounds_of, free_of
from exfit.models import MODELS
from exfit.models.sheet import typical

OPEN = {"type": "open-circuit", "machine": "GENROU"}
TIME = np.arange(0.0, 10.0, 0.02)  # s
STEP = 0.05  # pu
NEARBY = 1e-3  # of a parameter
EFFECT = 1e-4  # of a step, of a parameter times e; without effect it is 1e-8


def free_names(model, **values):
    """Return the symbols that are free with typical values but for some."""
    return [
        row.symbol for row in free_of(MODELS[model], {**typical(MODELS[model].sheet), **values})
    ]


@pytest.mark.each_model
def test_each_parameter_that_is_free_moves_the_response_as_no_others_do(model):
    """With the typical data, in a step of 5 % on open circuit.

    A gain that others make up for, as KB of AC2A or KPA of AC7B, leaves 1e-6 of that: what the
    differences err by.
    """
    if model == "FIRST_ORDER":
        return
    test = {"vt0": 1.0, "vref": [{"at": 1.0, "step": STEP}]}
    shown = {"vt": "vt", "efd": "efd"}
    content = {"model": model, "plant": OPEN, "test": test, "record": {"channels": shown}}
    moves = []
    for row in free_of(MODELS[model]):
        more, less = (
            response_of(content, {row.symbol: row.typical * np.exp(by)}, TIME)
            for by in (NEARBY, -NEARBY)
        )
        moves.append(np.concatenate([(more[s] - less[s]) / (2.0 * NEARBY) for s in shown]))
        assert np.max(np.abs(moves[-1])) > EFFECT * STEP, row.symbol
    sizes = [np.linalg.norm(move) for move in moves]
    apart = np.linalg.svd(np.array(moves) / np.array(sizes)[:, None], compute_uv=False)
    assert apart[-1] > 1e-5


@pytest.mark.parametrize(
    ("model", "gain", "lag"),
    [("AC8B", "KDR", "TDR"), ("AC1A", "KF", "TF"), ("AC7B", "KF3", "TF"), ("DC4B", "KF", "TF")],
)
def test_the_lag_of_a_term_is_free_only_with_its_gain(model, gain, lag):
    assert lag not in free_names(model, **{gain: 0.0})
    assert lag in free_names(model, **{gain: 0.05})
    assert gain not in free_names(model, **{gain: 0.0})


@pytest.mark.parametrize(
    ("model", "gain", "lag"),
    [("AC8B", "KDR", "TDR"), ("DC4B", "KD", "TD"), ("ESAC8B", "KD", "TD"), ("ST6B", "KDA", "TDA")],
)
def test_a_derivative_without_a_lag_is_none_and_its_gain_not_free(model, gain, lag):
    assert {gain, lag} <= {*free_names(model, **{gain: 1.0, lag: 0.1})}
    assert not {gain, lag} & {*free_names(model, **{gain: 1.0, lag: 0.0})}
    test = {"vt0": 1.0, "vref": [{"at": 1.0, "step": STEP}]}
    content = {"model": model, "plant": OPEN, "test": test, "record": {"channels": {"vt": "vt"}}}
    pi, without_lag = (
        response_of(content, {gain: k, lag: t}, TIME)["vt"] for k, t in ((0.0, 0.1), (1.0, 0.0))
    )
    assert np.array_equal(pi, without_lag)


def test_of_two_alternatives_the_one_that_acts_is_free():
    """ST1A reduces its gain by a lag and its lead, or stabilises by rate feedback."""
    assert free_names("ST1A") == ["TC", "TB", "KA"]
    assert free_names("ST1A", TC=1.0, TB=1.0, KF=0.03) == ["KA", "KF", "TF"]
    assert free_names("ST1A", TC=0.0, TB=0.0, KF=0.03) == ["KA", "KF", "TF"]


def test_bounds_end_where_units_do():
    rows = {row.symbol: row for row in MODELS["AC8B"].sheet}
    assert bounds_of(rows["KC"]) == (pytest.approx(0.055), pytest.approx(1.1))  # twice the start
    assert bounds_of(rows["KC"], 0.2) == (pytest.approx(0.02), 1.0)
    assert bounds_of(rows["TE"], 0.1) == (0.02, 1.0)
    assert bounds_of(rows["KPR"], 50.0) == (5.0, 500.0)


def test_a_start_lies_between_its_bounds_wherever_it_is():
    for start in (1e-3, 0.3, 5.0, 80.0):
        for row in MODELS["AC1A"].sheet:
            if row.free and row.low < start < row.high:
                low, high = bounds_of(row, start)
                assert low < start < high, row.symbol
