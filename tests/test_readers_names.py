"""What a column's name says is read where it is certain, and not where it is not."""

import pytest

from exfit.readers.names import clock_of, is_unit, unit_in

UNITS = {
    "Ugen [kV]": "kV",
    "If (A)": "A",
    "If(A)": "A",
    "t/ms": "ms",
    "U / kV": "kV",
    "Time, s": "s",
    "Zeit [s]": "s",
    "P [MW]": "MW",
    "Q (Mvar)": "Mvar",
    "vt [p.u.]": "p.u.",
    "Ifd [%]": "%",
    "f (Hz)": "Hz",
    "Ugen": None,
    "U (L1)": None,
    "U (S)": None,
    "data[1]": None,
    "Phase, A": None,
    "Ua/Ub": None,
    "omega rad/s": None,
    "rad/s": None,
    "1/min": None,
    "m/s": None,
    "[kV]": None,
    "": None,
}


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_is_split_off_a_name_only_where_it_is_one(name):
    assert unit_in(name) == UNITS[name]


@pytest.mark.parametrize("text", ["kV", "[kV]", "(s)", "ms", "A", "pu", "p.u.", "%", "-", "Mvar"])
def test_a_unit_is_known_with_brackets_or_without(text):
    assert is_unit(text)


@pytest.mark.parametrize("text", ["", "Ugen", "L1", "[1]", "time", "kVolts per metre"])
def test_other_texts_are_no_units(text):
    assert not is_unit(text)


CLOCKS = {
    ("t", "vt"): ("t",),
    ("vt", "Time"): ("Time",),
    ("Time [s]", "vt"): ("Time [s]",),
    ("t/ms", "vt"): ("t/ms",),
    ("Zeit (s)", "U"): ("Zeit (s)",),
    ("Date", "Time", "vt"): ("Date", "Time"),
    ("Time", "Date", "vt"): ("Date", "Time"),
    ("Datum", "Uhrzeit", "U"): ("Datum", "Uhrzeit"),
    ("Date", "Timestamp", "vt"): ("Timestamp",),
    ("Date/Time", "vt"): ("Date/Time",),
    ("Time stamp", "vt"): ("Time stamp",),
    ("Date", "vt"): ("Date",),
    ("vt", "ifd"): (),
    ("Timer", "T"): ("T",),
    (): (),
}


@pytest.mark.parametrize("names", CLOCKS, ids=str)
def test_the_time_is_known_by_its_name(names):
    assert clock_of(names) == CLOCKS[names]
