"""What of a record drove a simulation, and how far what it gave is from the rest of it."""

import numpy as np
import pytest

from exfit.results.compare_with_record import driving_signals, excursion, left_out_of, played_errors

TIME = np.arange(0.0, 10.0, 0.02)
BEGINS = 2.0
SWING = np.where(TIME < BEGINS, 0.0, -0.1 * np.exp(-0.5 * (TIME - BEGINS)))


def test_an_angle_is_shown_as_the_frequency_that_it_has():
    """A ramp of 2 pi 0.1 rad a second is 0.1 Hz; behind the corner the differences are exact."""
    angle = 0.4 + 2.0 * np.pi * 0.1 * np.maximum(TIME - BEGINS, 0.0)
    shown = driving_signals(TIME, BEGINS, {"vt": 1.0 + SWING, "angle": angle})
    assert {name: signal.unit for name, signal in shown.items()} == {"vt": "pu", "frequency": "Hz"}
    away = np.abs(TIME - BEGINS) > 0.03
    course = np.where(TIME < BEGINS, 0.0, 0.1)
    np.testing.assert_allclose(shown["frequency"].samples[away], course[away], atol=1e-12)
    assert shown["vt"].excursion.value == pytest.approx(-0.1, rel=1e-12)
    assert shown["vt"].excursion.at == BEGINS


@pytest.mark.parametrize("offset", [0.0, 0.03, -0.2])
def test_an_error_at_rest_is_none_of_the_swing(offset):
    measured, simulated = 0.8 + SWING, 0.8 + offset + 1.5 * SWING
    errors = played_errors(TIME, BEGINS, measured, simulated)
    assert errors.at_rest == pytest.approx(offset, abs=1e-12)
    assert errors.measured.value == pytest.approx(-0.1, rel=1e-9)
    assert errors.simulated.value == pytest.approx(-0.15, rel=1e-9)
    assert abs(errors.largest) == pytest.approx(max(abs(offset), abs(offset - 0.05)), rel=1e-9)


def test_what_is_left_out_of_the_comparison_is_no_peak():
    measured, simulated = 0.8 + SWING, 0.8 + SWING
    spiked = measured.copy()
    spiked[TIME > 9.0] = np.nan
    simulated[TIME > 9.0] = 7.0
    errors = played_errors(TIME, BEGINS, spiked, simulated)
    assert errors.largest == 0.0
    assert errors.simulated.value == pytest.approx(-0.1, rel=1e-9)


def test_what_a_mask_leaves_out_is_kept_to_be_seen():
    whole, simulated = 0.8 + SWING, 0.8 + 1.1 * SWING
    compared = np.where((TIME > 2.0) & (TIME < 3.0), np.nan, whole)
    left_out = left_out_of(whole, compared, simulated)
    inside = np.isfinite(left_out.measured)
    np.testing.assert_array_equal(inside, np.isnan(compared))
    np.testing.assert_array_equal(left_out.measured[inside], whole[inside])
    # the line of the simulation meets that of what is compared
    assert np.count_nonzero(np.isfinite(left_out.simulated)) == np.count_nonzero(inside) + 2
    assert left_out_of(whole, whole, simulated) is None
    gap = np.where(TIME > 9.0, np.nan, whole)
    assert left_out_of(gap, gap, simulated) is None


def test_without_samples_there_is_no_departure():
    nothing = np.full(len(TIME), np.nan)
    assert excursion(TIME, BEGINS, nothing) is None
    errors = played_errors(TIME, BEGINS, nothing, SWING)
    assert errors.measured is None
    assert np.isnan(errors.largest)
