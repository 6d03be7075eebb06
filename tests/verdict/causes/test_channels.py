"""A record that was clipped, and one that was not; factors that a base may be wrong by."""

import numpy as np

from exfit.verdict.causes.channels import clipped_samples, is_wrong_base

TIME = np.linspace(0.0, 10.0, 1001)
RNG = np.random.default_rng(5)
NOISY = np.sin(TIME) + 1e-3 * RNG.standard_normal(len(TIME))
EVERY = np.ones(len(TIME), dtype=bool)


def test_samples_that_stay_at_the_highest_or_lowest_value_are_clipped():
    for sign in (1.0, -1.0):
        cut = sign * np.minimum(NOISY, 0.9)
        flat = clipped_samples(cut, EVERY)
        assert np.array_equal(flat, cut == sign * 0.9)


def test_noise_is_not_clipped_nor_is_what_is_rounded_coarsely():
    assert clipped_samples(NOISY, EVERY) is None
    assert clipped_samples(np.round(NOISY, 3), EVERY) is None


def test_samples_that_are_left_out_do_not_count():
    cut = np.minimum(NOISY, 0.9)
    assert clipped_samples(cut, cut < 0.9) is None


def test_a_factor_that_rounds_to_one_is_no_wrong_base():
    for signal in ("vt", "p", "efd"):
        for factor in (1.0, 1.00004, 0.9996):
            assert not is_wrong_base(signal, factor)
        for factor in (0.5, 1.05, 1.732):
            assert is_wrong_base(signal, factor)
