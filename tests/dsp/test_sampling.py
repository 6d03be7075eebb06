"""Sampling: steps, gaps and unevenness of a clock are those that it was made with."""

import numpy as np
import pytest

from exfit.dsp.sampling import (
    envelope,
    even_step,
    increasing,
    kept_rows,
    present_samples,
    sampling_of,
)


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


@pytest.mark.parametrize("seed", range(5))
def test_thinning_keeps_the_extremes_the_ends_and_the_gaps(seed):
    rng = np.random.default_rng(seed)
    y = rng.standard_normal(20_000)
    y[5_000:6_000] = np.nan
    y[::37] = np.nan  # one or two of each stretch
    x = np.arange(len(y), dtype=float)
    rows = kept_rows([y], 500)
    assert len(rows) <= 2 * 500 + 2
    assert (rows[0], rows[-1]) == (0, len(y) - 1)
    assert np.all(np.diff(rows) > 0)
    seen_x, seen_y = envelope(x, y, 500)
    assert np.nanmax(seen_y) == np.nanmax(y)
    assert np.nanmin(seen_y) == np.nanmin(y)
    assert np.isnan(seen_y[(seen_x > 5_100) & (seen_x < 5_900)]).all()
    np.testing.assert_array_equal(envelope(x[:900], y[:900], 500)[1], y[:900])
    for first in range(0, len(y), 40):
        stretch, there = y[first : first + 40], seen_y[(seen_x >= first) & (seen_x < first + 40)]
        if np.isfinite(stretch).any():
            extremes = (np.nanmin(stretch), np.nanmax(stretch))
            assert (np.nanmin(there), np.nanmax(there)) == extremes


def test_the_extremes_of_several_signals_are_all_kept():
    signals = list(np.random.default_rng(1).standard_normal((3, 10_001)))
    rows = kept_rows(signals, 100)
    for signal in signals:
        assert (signal[rows].min(), signal[rows].max()) == (signal.min(), signal.max())
