"""Each record of the samples with a channel that is dead, stands still or stops is inspected."""

import numpy as np
import pytest
from columns import Columns
from places import SAMPLES
from tiers import few_of

from exfit.records.inspection import inspect
from exfit.records.kinds import kind_of

DAMAGES = {
    "dead": lambda y: np.full(len(y), np.nan),
    "at zero": lambda y: np.zeros(len(y)),
    "still": lambda y: np.full(len(y), np.mean(y)),
    "late": lambda y: np.where(np.arange(len(y)) < len(y) // 2, np.nan, y),
    "stops": lambda y: np.where(np.arange(len(y)) > len(y) // 2, np.nan, y),
    "every other": lambda y: np.where(np.arange(len(y)) % 2 == 1, np.nan, y),
    "one sample": lambda y: np.where(np.arange(len(y)) == len(y) // 2, y, np.nan),
}
WITHOUT_TIME = ("programme_saturation.csv", "programme_v_curve.csv", "field_record.csv")
RECORDS = sorted(path.name for path in SAMPLES.glob("*.csv") if path.name not in WITHOUT_TIME)


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", few_of(RECORDS, 5))
def test_a_channel_that_shows_nothing_ends_no_inspection(name, damage):
    """Nor is there a word of NumPy's: warnings are errors here."""
    rows = np.genfromtxt(SAMPLES / name, delimiter=",", names=True)
    signals = rows.dtype.names[1:]
    for signal in signals:
        columns = {own: rows[own] for own in rows.dtype.names}
        columns[signal] = DAMAGES[damage](columns[signal])
        shown = inspect(Columns(columns))
        assert {entry.name for entry in shown.channels} == {*signals}, signal
        assert kind_of(shown).why
