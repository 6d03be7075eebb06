"""T'd0 over windows of a playback: one that moves after the step down, and one that does not."""

from dataclasses import replace

import pytest
from two_steps import CASE, DOWN, UP, record_of_two_steps

from exfit.case.load import load_case
from exfit.results.io import load_result, result_text
from exfit.results.verdict import MISSES
from exfit.workflows import fit


def fitted(folder, of_up, of_down):
    (folder / "two_steps.yaml").write_text(CASE, encoding="utf-8")
    case = load_case(folder / "two_steps.yaml")
    return fit(replace(case, given_records={"fit": record_of_two_steps(of_up, of_down)}))


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    return fitted(tmp_path_factory.mktemp("moving"), 4.9, 5.3)


@pytest.mark.long
def test_a_time_constant_that_moves_after_the_step_down_is_found_by_the_windows(moving):
    up, down = (window for window in moving.windows.windows if window.kind == "step")
    assert up.start < UP < up.end < DOWN < down.end
    assert up.value == pytest.approx(4.9, abs=4 * up.std_error)
    assert down.value == pytest.approx(5.3, abs=4 * down.std_error)
    assert moving.windows.moves


@pytest.mark.long
def test_the_interval_over_windows_then_holds_both_and_beside_a_misfit_none_is_given(moving):
    low, high = moving.windows.hull
    assert low < 4.95
    assert high > 5.25
    parameter = moving.parameters["machine.Tpd0"]
    assert moving.verdict.verdict == MISSES
    assert parameter.interval is None
    assert "misses" in parameter.why
    assert any("the spread exceeds that of the noise" in note for note in moving.notes)


@pytest.mark.long
def test_a_constant_one_keeps_the_interval_of_the_fit(tmp_path):
    result = fitted(tmp_path, 5.0, 5.0)
    assert not result.windows.moves
    assert result.parameters["machine.Tpd0"].interval == result.windows.interval
    assert any("the spread is that of the noise" in note for note in result.notes)


@pytest.mark.long
def test_the_windows_are_in_the_file_of_the_result(moving, tmp_path):
    file = tmp_path / "result.json"
    file.write_text(result_text(moving), encoding="utf-8")
    assert load_result(file).windows == moving.windows
