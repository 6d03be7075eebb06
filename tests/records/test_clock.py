"""The time is known by the names of columns, else a first column that increases is held for it."""

import pytest

from exfit.records.clock import find_clock

CLOCKS = {
    ("t", "vt"): ("t",),
    ("vt", "Time"): ("Time",),
    ("Time [s]", "vt"): ("Time [s]",),
    ("t/ms", "vt"): ("t/ms",),
    ("t_ms", "vt"): ("t_ms",),
    ("Zeit (s)", "U"): ("Zeit (s)",),
    ("Tiempo, s", "U"): ("Tiempo, s",),
    ("Date", "Time", "vt"): ("Date", "Time"),
    ("Time", "Date", "vt"): ("Date", "Time"),
    ("Datum", "Uhrzeit", "U"): ("Datum", "Uhrzeit"),
    ("Fecha", "Hora", "U"): ("Fecha", "Hora"),
    ("Date", "Timestamp", "vt"): ("Timestamp",),
    ("Date/Time", "vt"): ("Date/Time",),
    ("Time stamp", "vt"): ("Time stamp",),
    ("Relative Time", "vt"): ("Relative Time",),
    ("Date", "vt"): ("Date",),
    ("s.vt", "s.time"): ("s.time",),
    ("s.time", "s.vt", "t"): ("t",),
    ("vt", "ifd"): (),
    ("Timer", "T"): ("T",),
    (): (),
}


@pytest.mark.parametrize("names", CLOCKS, ids=str)
def test_the_time_is_known_by_its_name(names):
    assert find_clock(names, (), lambda columns: False) == CLOCKS[names]


@pytest.mark.parametrize(
    ("names", "stamps", "increasing", "clock"),
    [
        (("N", "U"), (), {("N",)}, ("N",)),
        (("N", "U"), (), {("U",)}, ()),
        (("N", "t"), (), {("N",)}, ("t",)),
        (("N", "When", "U"), ("When",), {("N",), ("When",)}, ("When",)),
        (("Day", "Clock"), ("Day", "Clock"), {("Day", "Clock")}, ("Day", "Clock")),
        (("Begin", "End"), ("Begin", "End"), {("Begin",), ("End",)}, ("Begin",)),
    ],
)
def test_where_no_name_says_so_the_time_is_what_increases(names, stamps, increasing, clock):
    assert find_clock(names, stamps, increasing.__contains__) == clock
