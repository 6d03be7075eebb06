"""A validation is judged against the fit, unless the case says by what."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest

from exfit.dsp.filtering import Filtering, LowPass
from exfit.fitting.experiment import Channel
from exfit.fitting.noise import noise_of
from exfit.results.acceptance import MUCH_WORSE, judged
from exfit.results.comparisons import Comparison, Match, PlayedRecord, StepFeatures

TIME = np.arange(0.0, 10.0, 0.01)
STEP = np.where(TIME < 1.0, 1.0, 1.05)


def channel(noise=1e-4, signal="vt", filtering=None):
    """Return a record of a step with white noise."""
    scatter = np.random.default_rng(5).standard_normal(len(TIME))
    return Channel(signal, STEP + noise * scatter, filtering=filtering)


def comparison(name, rmse, fit_percent=99.0, signal="vt"):
    return Comparison(
        name=name,
        record=f"{name}.csv",
        cost=1.0,
        accepted=True,
        channels={signal: Match(rmse, 3.0 * rmse, fit_percent)},
        features=StepFeatures(None, None),
    )


FIT = comparison("fit", 1e-4)


@pytest.mark.parametrize("times", [0.5, 1.0, 0.99 * MUCH_WORSE, 1.01 * MUCH_WORSE, 22.0])
def test_without_accept_a_validation_is_held_against_the_worst_record_of_the_fit(times):
    fitted = [comparison("best", 2e-5), FIT]
    found = judged(comparison("down", 1e-4 * times), fitted, [channel()])
    assert found.validation
    assert found.accepted is (times < MUCH_WORSE)
    assert found.limit == pytest.approx(3e-4, rel=1e-12)
    assert (f"on down the error is {times:.1f} times that of the fit" in found.reason) is (
        not found.accepted
    )


@pytest.mark.parametrize("bad", ["p", "q", "efd"])
def test_of_a_grid_event_p_and_q_must_match_both(bad):
    """The field voltage, whose base is often in doubt, judges no event."""
    played = PlayedRecord(1.0, {}, {})

    def event(name, error):
        rmse = dict.fromkeys(("p", "q", "efd"), 0.0001) | {bad: error}
        match = comparison(name, 1e-4, signal="p")
        return replace(
            match, played=played, channels={name: Match(e, e, 99.0) for name, e in rmse.items()}
        )

    channels = [channel(signal=signal) for signal in ("efd", "q", "p")]
    validation = judged(event("trip", 1e-3), [event("fit", 1e-4)], channels)
    assert validation.accepted is (bad == "efd")
    assert (f"on trip the error of {bad} is 10.0 times" in validation.reason) is (bad != "efd")


@pytest.mark.parametrize("times", [0.9 * MUCH_WORSE, 1.1 * MUCH_WORSE])
def test_noise_that_drives_a_simulation_does_not_condemn_a_right_model(times):
    """A regulator sums up noise of the voltage: q drifts by far more than its samples scatter."""
    match = comparison("trip", times * 2e-3, signal="q")
    record = [channel(signal="q")]
    found = judged(match, [comparison("fit", 1e-4, signal="q")], record, {"q": 2e-3})
    assert found.accepted is (times < MUCH_WORSE)


@pytest.mark.parametrize("fit_percent", [0.0, -206.0, nan])
def test_without_accept_what_a_constant_matches_as_well_is_not_accepted(fit_percent):
    """However bad the fit is itself: nan is that of a record that does not move."""
    found = judged(comparison("down", 1e-4, fit_percent), [comparison("fit", 1.0)], [channel()])
    assert not found.accepted
    assert "no better than a constant" in found.reason


@pytest.mark.parametrize("noise", [1e-3, 5e-3])
def test_a_record_noisier_than_that_of_the_fit_does_not_condemn_a_good_model(noise):
    """Of the true model the error is the noise; its estimate scatters by 5 % over 1000 samples."""
    record = [channel(noise)]
    assert judged(comparison("down", noise), [FIT], record).accepted
    assert judged(comparison("down", 0.8 * MUCH_WORSE * noise), [FIT], record).accepted
    assert not judged(comparison("down", 1.2 * MUCH_WORSE * noise), [FIT], record).accepted


def test_the_noise_that_counts_is_that_which_a_filter_leaves():
    """A low-pass at 5 Hz leaves a third of white noise at 100 Hz, here to a few percent."""
    filtering = Filtering(TIME, np.ones(len(TIME), dtype=bool), LowPass(5.0))
    noisy = channel(1e-2, filtering=filtering)
    left = float(np.std(noisy.filtered(noisy.measured - STEP)))
    limit = judged(comparison("down", 1e-4), [FIT], [noisy]).limit
    assert left < 0.5 * noise_of(noisy)
    assert limit == pytest.approx(MUCH_WORSE * left, rel=0.2)


def test_an_error_that_is_not_a_number_is_not_accepted():
    assert not judged(comparison("down", nan), [FIT], [channel()]).accepted


def test_signals_are_held_against_their_own_kind():
    """An efd of 1e-2 pu is as usual; nothing limits it where no efd was fitted."""
    efd = comparison("down", 1e-2, signal="efd")
    record = [channel(signal="efd")]
    assert judged(efd, [comparison("up", 1e-2, signal="efd"), FIT], record).accepted
    alone = judged(efd, [FIT], record)
    assert (alone.accepted, alone.limit) == (True, None)
