"""The program that runs an FMU: when it exchanges values, what its inputs are then."""

import numpy as np
import pytest

from exfit.features.external.fmu import LONGEST_STEP, Grid, corners, grid_of, share

TIMES = np.arange(0.013, 4.0, 0.04)
STEP = {"signal": "vref", "at": 1.0, "step": 0.05, "ramp": 0.0}
RAMP = {"signal": "vref", "at": 2.0, "step": -0.05, "ramp": 0.5}
EXACT = 1e-9  # s


@pytest.mark.parametrize("times", [TIMES, np.clip(TIMES, 0.02, None), TIMES[:1], TIMES + 10.0])
def test_samples_lie_on_the_grid_and_the_first_step_after_its_start(times):
    grid = grid_of(times, [STEP])
    places = (times[1:] - grid.start) / grid.step
    assert np.abs(places - np.round(places)).max(initial=0.0) * grid.step < EXACT
    assert grid.step <= LONGEST_STEP + EXACT
    assert grid.start <= min(times[0], STEP["at"]) - grid.step + EXACT
    assert grid.end >= times[-1] - EXACT


def test_a_grid_of_an_fmu_with_its_own_step_has_the_first_step_of_the_test():
    grid = grid_of(TIMES, [RAMP, {**STEP, "at": 1.0123}], own_step=5e-3)
    place = (1.0123 - grid.start) / 5e-3
    assert place == pytest.approx(round(place))
    assert grid.step == 5e-3
    assert grid.start < TIMES[0] < TIMES[-1] <= grid.end


def test_an_input_is_complete_at_the_instant_of_a_step_and_a_line_over_a_ramp():
    grid = Grid(-0.5, 1e-3, 4.0)
    instants, after = corners([STEP, RAMP], grid, 0.0)
    assert (instants + grid.start).tolist() == [-0.5, 1.0, 1.0, 2.0, 2.5, 4.0]
    assert share(STEP, grid, 0.0, instants, after).tolist() == [0, 0, 1, 1, 1, 1]
    assert share(RAMP, grid, 0.0, instants, after).tolist() == [0, 0, 0, 0, 1, 1]


def test_an_input_that_is_held_has_the_value_in_the_middle_of_each_step():
    grid = Grid(0.0, 0.1, 4.0)
    instants, after = corners([RAMP], grid, 0.5 * grid.step)
    complete = share(RAMP, grid, 0.5 * grid.step, instants, after)
    held = np.interp([1.9, 2.0, 2.1, 2.4, 2.5], instants, complete)
    assert held == pytest.approx([0.0, 0.1, 0.3, 0.9, 1.0])
