"""Sampling: steps, gaps and unevenness of a clock are those that it was made with."""

import numpy as np
import pytest

from exfit.dsp.sampling import even_step, increasing, present_samples, sampling_of


def test_gaps_are_judged_against_the_median_step():
    time = np.concatenate([np.arange(0.0, 1.0, 0.01), np.arange(1.5, 2.0, 0.01)])
    sampling = sampling_of(time)
    assert [(gap.start, gap.end, gap.lost) for gap in sampling.gaps] == [
        (pytest.approx(0.99), pytest.approx(1.5), 50)
    ]
    assert sampling.even
    assert (sampling.smallest, sampling.largest) == pytest.approx((0.01, 0.01))


@pytest.mark.parametrize(("off", "even"), [(0.009, True), (0.011, False)])
def test_a_clock_is_even_where_no_step_is_more_than_one_percent_off(off, even):
    steps = np.full(1000, 0.004)
    steps[500] *= 1.0 + off  # the mean moves by a thousandth of this
    time = np.concatenate([[0.0], np.cumsum(steps)])
    assert sampling_of(time).even == even
    if even:
        assert even_step(time, "a filter") == pytest.approx(np.mean(steps), rel=1e-12)
    else:
        with pytest.raises(ValueError, match=r"^a filter needs even .* 1\.1 % .* allowed is 1 %"):
            even_step(time, "a filter")


def test_stamps_that_do_not_exceed_all_before_them_are_left_out():
    time = np.array([0.0, 2.0, 1.0, 2.0, 3.0])
    assert increasing(time).tolist() == [True, True, False, False, True]
    assert sampling_of(time).backward == (2, 3)


def test_missing_samples_are_left_out_with_their_instants():
    time, samples = np.arange(4.0), np.array([1.0, np.nan, 2.0, np.nan])
    assert [part.tolist() for part in present_samples(time, samples)] == [[0.0, 2.0], [1.0, 2.0]]
