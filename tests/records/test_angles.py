"""Angles that were wrapped."""

import numpy as np
import pytest

from exfit.records.phasors import AngleError, in_radians, unit_by_range, unwrapped

TIME = np.arange(0.0, 10.0, 1.0 / 30.0)
ANGLE = 2.0 * np.pi * 0.4 * TIME + 0.2 * np.sin(TIME)  # rad


def wrapped(angle, turn):
    return (angle + 0.5 * turn) % turn - 0.5 * turn


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2.0 * np.pi)])
@pytest.mark.parametrize("from_zero", [True, False])
def test_a_wrapped_angle_becomes_the_smooth_one_less_whole_turns(unit, turn, from_zero):
    recorded = ANGLE * turn / (2.0 * np.pi)
    recorded = recorded % turn if from_zero else wrapped(recorded, turn)
    smooth = unwrapped(in_radians(recorded, unit))
    turns = (smooth - ANGLE) / (2.0 * np.pi)
    assert np.ptp(turns) < 1e-12
    assert turns[0] == pytest.approx(round(turns[0]), abs=1e-12)


def test_an_angle_that_moves_too_far_between_samples_is_refused_with_its_row():
    angle = np.array(ANGLE)
    angle[40:] += 2.0  # rad
    with pytest.raises(AngleError, match="degrees") as fault:
        unwrapped(angle)
    assert fault.value.row == 40


def test_missing_samples_stay_missing_and_those_beside_them_are_counted_on():
    angle = wrapped(ANGLE, 2.0 * np.pi)
    angle[50:53] = np.nan
    smooth = unwrapped(angle)
    assert np.isnan(smooth[50:53]).all()
    assert smooth[53:] == pytest.approx(ANGLE[53:], abs=1e-12)


def test_the_jumps_of_a_wrapped_angle_show_its_unit():
    assert unit_by_range(wrapped(np.degrees(ANGLE), 360.0)) == "deg"
    assert unit_by_range(wrapped(ANGLE, 2.0 * np.pi)) == "rad"


def test_the_range_of_an_angle_that_is_not_wrapped_shows_nothing():
    assert unit_by_range(np.degrees(ANGLE)) is None
    assert unit_by_range(ANGLE) is None
