"""The model in the planner's base beside the records of a fit."""

import numpy as np
import pytest
from records import TEST, TIME, UNIT, case_of, one, synthetic

from exfit import workflows
from exfit.errors import CaseError
from exfit.results.io import load_result, result_text
from exfit.util.vocabulary import Criteria, Criterion


def fitted(folder, **sections):
    """Fit the gain of the AC1A to a record of its own, from a start that is 20 % off."""
    synthetic(folder, TEST, TIME)
    content = {**one(TEST, free=["KA"]), **sections}
    content["parameters"]["free"]["KA"]["start"] = 400.0
    return workflows.fit(case_of(content, folder))


def test_without_a_word_of_the_case_its_start_values_are_as_found(tmp_path):
    result = fitted(tmp_path)
    before = result.as_found
    assert not before.is_stated
    assert before.model == "AC1A"
    assert before.values["KA"] == 400.0
    assert before.values["machine.Xd"] == result.machine["Xd"]
    (match,) = before.comparisons
    start = result.comparison.overlays["vt"].start - result.comparison.overlays["vt"].measured
    # one response, simulated twice
    assert match.rmse == pytest.approx(np.sqrt(np.mean(start**2)), rel=1e-9)
    assert match.overlays == {}


def test_the_values_of_the_planner_s_base_are_simulated_and_what_it_leaves_out_is_the_case_s(
    tmp_path,
):
    stated = {"source": "unit.dyr, bus 101", "parameters": {"KA": 200.0, "machine.Tpd0": 5.0}}
    result = fitted(tmp_path, as_found=stated)
    before = result.as_found
    assert (before.source, before.why) == ("unit.dyr, bus 101", "")
    assert (before.values["KA"], before.values["machine.Tpd0"]) == (200.0, 5.0)
    assert before.values["TE"] == UNIT["TE"]
    case = case_of({**one(TEST, free=["KA"]), "as_found": stated}, tmp_path)
    simulated = workflows.simulate(case, {"KA": 200.0, "machine.Tpd0": 5.0}).comparison
    assert before.comparisons[0].rmse == pytest.approx(simulated.rmse, rel=1e-9)
    assert before.comparisons[0].rmse > 10.0 * result.rmse


def test_another_exciter_may_have_been_in_the_planner_s_base(tmp_path):
    stated = {"model": "SEXS", "parameters": {"K": 50.0}}
    result = fitted(tmp_path, as_found=stated)
    before = result.as_found
    assert (before.model, before.values["K"], before.why) == ("SEXS", 50.0, "")
    assert "KA" not in before.values
    (match,) = before.comparisons
    assert match.rmse > 10.0 * result.rmse
    assert len(match.time) == len(TIME)


def test_a_file_of_python_that_is_called_like_a_model_is_not_run(tmp_path):
    (tmp_path / "SEXS.py").write_text("raise SystemExit")
    result = fitted(tmp_path, as_found={"model": "SEXS.py", "parameters": {"K": 50.0}})
    assert (result.as_found.model, result.as_found.why) == ("SEXS", "")


def test_a_model_that_has_no_state_of_rest_is_reported_with_its_reason(tmp_path):
    result = fitted(tmp_path, as_found={"parameters": {"VRMAX": 0.1}})
    assert result.as_found.comparisons == ()
    assert result.as_found.why


def test_what_was_found_is_read_back(tmp_path):
    where = {"bus": 101, "id": "1", "file": "base/unit.dyr"}
    result = fitted(tmp_path, as_found={**where, "parameters": {"KA": 200.0}})
    before = result.as_found
    assert (before.bus, before.machine_id, before.file) == (101, "1", "base/unit.dyr")
    (tmp_path / "result.json").write_text(result_text(result), encoding="utf-8")
    assert result_text(load_result(tmp_path)) == result_text(result)


@pytest.mark.parametrize(
    ("stated", "fault"),
    [
        ({"model": "AC99"}, "as_found.model: AC99 is not in the catalogue"),
        ({"parameters": {"KAA": 1.0}}, "as_found.parameters.KAA: not a parameter"),
        ({"parameters": {"TA": -1.0}}, "as_found.parameters.TA: -1 is below"),
        ({"model": "SEXS", "parameters": {"KA": 1.0}}, "as_found.parameters.KA: not a parameter"),
        ({"bus": 1_000_000}, "as_found.bus: 1000000 is above 999999"),
        ({"bus": "101"}, "as_found.bus: '101' is not a whole number"),
        ({"id": 1}, "as_found.id: 1 is not text; put it in quotes"),
        ({"model": "own.py"}, "as_found.model: own is not in the catalogue"),
    ],
)
def test_a_fault_of_the_section_is_reported_with_its_place(tmp_path, stated, fault):
    with pytest.raises(CaseError, match=fault):
        case_of({**one(TEST, free=["KA"]), "as_found": stated}, tmp_path)


def test_the_criteria_of_a_case_are_those_of_its_result(tmp_path):
    limits = [{"quantity": "rise_time", "percent": 1.0, "limit": 0.01}]
    result = fitted(tmp_path, criteria={"limits": limits, "source": "the planner"})
    row = Criterion("rise_time", percent=1.0, limit=0.01)
    assert result.criteria == Criteria((row,), "the planner", given=True)
    assert not fitted(tmp_path).criteria.given
