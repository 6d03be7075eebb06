"""Samples of many channels come back as they were, those of a switch out of a bit each."""

import numpy as np

from exfit.records.samples import Samples

LENGTH = 1001  # no whole number of bytes
SWITCH = np.where(np.arange(LENGTH) % 3 == 0, 1.0, 0.0)
COLUMNS = {
    "switch": SWITCH,
    "open": np.zeros(LENGTH),
    "levels": 2.0 * SWITCH,
    "missing": np.where(np.arange(LENGTH) == 7, np.nan, SWITCH),
    "negative zero": -0.0 * SWITCH,
    "vt": 1.0 + 1e-3 * np.sin(np.arange(LENGTH)),
}


def test_every_column_comes_back_bit_by_bit():
    samples = Samples(COLUMNS.items())
    assert [*samples] == [*COLUMNS]
    for name, column in COLUMNS.items():
        assert samples[name].tobytes() == column.tobytes()


def test_a_switch_takes_a_bit_for_each_sample():
    kept = Samples(COLUMNS.items())._kept
    assert kept["switch"].packed.nbytes == -(-LENGTH // 8)


def test_columns_stand_beside_others():
    both = Samples([("a", SWITCH)]).beside(Samples([("b", -SWITCH)]))
    assert {name: column.sum() for name, column in both.items()} == {
        "a": SWITCH.sum(),
        "b": -SWITCH.sum(),
    }
