"""Thinned lines: what is seen of a long one stays."""

import numpy as np
import pytest

from exfit.dsp.decimation import envelope, kept_rows


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
