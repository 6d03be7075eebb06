"""A time stamp that repeats: rows that are alike are one, others need a word of the user."""

import numpy as np
import pytest
import yaml
from pmu_records import pmu_columns, smooth_course, write_table
from records import TEST, TIME, case_of, one, write

import exfit
from exfit.errors import RecordError
from exfit.fitting.build import build_experiments

AT = 100  # the row that repeats the one before


def columns(other):
    """Return a time (M,) that repeats once, and a voltage whose repeated row may be another."""
    time = np.insert(TIME, AT, TIME[AT - 1])
    vt = np.insert(np.sin(TIME), AT, np.sin(TIME[AT - 1]) + other)
    return {"t": time, "vt": vt}


@pytest.fixture
def case(tmp_path):
    """Return a function that reads a record as a case does, with a key beside its file."""

    def case(table, **record):
        write(tmp_path / "record.csv", **table)
        (setup,) = build_experiments(case_of(one(TEST, free=("KA",), **record), tmp_path))
        return setup.record

    return case


def test_rows_that_are_alike_are_one_and_a_note_names_the_place(case):
    record = case(columns(0.0))
    np.testing.assert_allclose(record.time, TIME, atol=1e-9)
    np.testing.assert_allclose(record.signals["vt"], np.sin(TIME), atol=1e-9)
    (note,) = record.notes
    assert "record.csv:102" in note  # one for the names, one as the first row is 1
    assert "1 row that repeats the time of another" in note


def test_rows_that_differ_are_refused_until_the_user_says_which_counts(case):
    with pytest.raises(RecordError, match=r"record\.csv:102: .* repeats, .*`repeats: first`"):
        case(columns(0.01))
    first, last = (case(columns(0.01), repeats=which) for which in ("first", "last"))
    for record, other in ((first, 0.0), (last, 0.01)):
        np.testing.assert_allclose(record.time, TIME, atol=1e-9)
        expected = np.sin(TIME[AT - 1]) + other
        assert record.signals["vt"][AT - 1] == pytest.approx(expected, abs=1e-9)
        assert np.delete(record.signals["vt"], AT - 1) == pytest.approx(
            np.delete(np.sin(TIME), AT - 1), abs=1e-9
        )
        assert len(record.notes) == 1


def test_time_that_goes_back_is_refused_whatever_the_key_says(case):
    table = columns(0.0)
    table["t"][AT] -= 0.005
    for repeats in ("refuse", "first", "last"):
        with pytest.raises(RecordError, match="goes back"):
            case(table, repeats=repeats)


EVENT = {
    "model": "SEXS",
    "given": "exact",
    "plant": {"type": "grid-playback", "machine": "GENROU", "network": {"f0": 60.0}},
    "record": {
        "file": "event.csv",
        "time": "Timestamp (UTC)",
        "phasors": {
            "voltage": {
                "magnitude": "UNIT1-PM1 (V)",
                "angle": "UNIT1-PA1 (deg)",
                "unit": "V",
                "angle_unit": "deg",
                "connection": "phase-to-ground",
            },
            "current": {
                "magnitude": "UNIT1-PM2 (A)",
                "angle": "UNIT1-PA2 (deg)",
                "unit": "A",
                "angle_unit": "deg",
            },
            "kV": 18.0,
            "MVA": 120.0,
        },
        "channels": {
            "vt": "phasors.vt",
            "angle": "phasors.angle",
            "p": "phasors.p",
            "q": "phasors.q",
        },
    },
}


def test_a_grid_event_with_one_row_twice_drives_the_unit_as_without_it(tmp_path):
    plain = pmu_columns(smooth_course())
    twice = {name: np.insert(column, AT, column[AT - 1]) for name, column in plain.items()}
    powers, notes = [], []
    for table in (plain, twice):
        write_table(tmp_path / "event.csv", {k: [*v] for k, v in table.items()})
        (tmp_path / "case.yaml").write_text(yaml.safe_dump(EVENT))
        simulated = exfit.simulate(tmp_path / "case.yaml")
        powers.append(simulated.response.signals["p"])
        notes.append([note for note in simulated.notes if "repeats the time" in note])
    assert np.array_equal(*powers)
    assert [len(each) for each in notes] == [0, 1]


def test_a_time_that_stands_still_is_refused(case):
    """Rows that are all alike are one, which is no record."""
    with pytest.raises(RecordError, match="all 40 samples have one time"):
        case({"t": np.full(40, 3.0), "vt": np.ones(40)})
