"""Curves as a page takes them: what is thinned keeps its extremes, what is packed its numbers."""

import json

import numpy as np
import pytest

from exfit.features.app.packing import COLUMNS, MOST, packed, thinned


def unpacked(data):
    """Read a message as the page does."""
    size = int.from_bytes(data[:4], "little")
    return json.loads(data[4 : 4 + size]), np.frombuffer(data[4 + size :], "<f4")


@pytest.mark.parametrize("count", [2, MOST, MOST + 1, 99_991, 2_000_000])
def test_a_thinned_curve_keeps_the_extremes_and_every_peak(count):
    time = np.linspace(0.0, 10.0, count)
    curve = np.sin(time)
    curve[count // 3] = 7.0  # one sample alone
    at, (shown,) = thinned(time, [curve])
    assert len(at) == len(shown) <= max(MOST, 2 * COLUMNS)
    assert (shown.min(), shown.max()) == (curve.min(), curve.max())
    assert (at[0], at[-1]) == (time[0], time[-1])
    assert np.all(np.diff(at) >= 0.0)


def test_a_thinned_curve_has_a_gap_where_all_samples_are_left_out():
    time = np.linspace(0.0, 10.0, 100_000)
    curve = np.where((time > 4.0) & (time < 5.0), np.nan, 1.0)
    at, (shown,) = thinned(time, [curve])
    assert np.isnan(shown[(at > 4.1) & (at < 4.9)]).all()
    assert np.isfinite(shown[(at < 3.9) | (at > 5.1)]).all()


def test_a_packed_message_holds_its_arrays_and_null_for_what_is_no_number():
    first, second = np.array([1.0, np.nan]), np.array([2.5, -1e300, 3.0])
    head, numbers = unpacked(packed({"a": [first], "b": {"c": second}, "d": np.inf, "e": "ü"}))
    assert head == {"a": [{"at": 0, "n": 2}], "b": {"c": {"at": 2, "n": 3}}, "d": None, "e": "ü"}
    with np.errstate(over="ignore"):
        expected = np.concatenate([first, second]).astype("<f4")
    np.testing.assert_array_equal(numbers, expected)
