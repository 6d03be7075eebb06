"""The time is known by the names of columns, else what increases is held for it; epochs."""

from pathlib import Path

import numpy as np
import pytest

from exfit.errors import RecordError
from exfit.records.clock import find_clock, from_first, soc_in_seconds
from exfit.records.formats import open_table

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


# ---- times that count from 1970

START = 1_715_956_267
TIME = np.arange(90) / 30.0  # s


def of_soc(seconds, fractions):
    columns = {"SOC": seconds, "FRACSEC": fractions}
    return soc_in_seconds(Path("pmu.csv"), [*columns], columns)


@pytest.mark.parametrize("ticks", [1.0, 1e3, 1e6, 1e9])
def test_an_epoch_counts_from_its_first_sample_in_whatever_it_counts(ticks):
    # an epoch of 1.7e18 ns is rounded to 256 ns
    assert from_first(np.round((START + TIME) * ticks, 6)) == pytest.approx(TIME, abs=1e-6)


def test_a_time_that_counts_from_no_epoch_stays_as_it_is():
    assert np.array_equal(from_first(TIME + 3600.0), TIME + 3600.0)


@pytest.mark.parametrize("base", [1e3, 1e6, float((1 << 24) - 1), float(1 << 24)])
def test_the_time_base_of_fracsec_is_the_one_with_which_the_clock_runs_evenly(base):
    seconds, fractions = np.divmod(START + 0.2 + TIME, 1.0)
    counts = np.floor(fractions * base)
    # a base of 1000 counts rounds to 1 ms
    assert of_soc(seconds, counts) == pytest.approx(TIME, abs=1.5e-3)


def test_the_quality_of_the_time_is_no_part_of_fracsec():
    seconds, fractions = np.divmod(START + TIME, 1.0)
    counts = np.round(fractions * 1e6)
    assert np.array_equal(of_soc(seconds, counts + (0x0F << 24)), of_soc(seconds, counts))


def test_a_fracsec_of_no_time_base_is_refused():
    with pytest.raises(RecordError, match="column 'FRACSEC': with none of the time bases"):
        of_soc(START + np.arange(40.0) // 8, np.arange(40.0) % 8 * 1.3e6)


def test_a_file_with_soc_and_fracsec_has_them_as_its_clock(tmp_path):
    seconds, fractions = np.divmod(START + TIME, 1.0)
    rows = [f"{s:.0f},{f * 1e6:.0f},1.0" for s, f in zip(seconds, fractions, strict=True)]
    path = tmp_path / "pmu.csv"
    path.write_text("\n".join(["SOC,FRACSEC,V", *rows]))
    table = open_table(path)
    assert table.clock == ("SOC", "FRACSEC")
    assert table.instants(table.clock) == pytest.approx(TIME, abs=2e-6)  # whole microseconds


def test_a_soc_that_is_no_whole_number_is_named_with_its_column(tmp_path):
    path = tmp_path / "pmu.csv"
    path.write_text("SOC,FRACSEC,V\n1.5,0,1\n2.5,0,1\n3.5,0,1\n")
    with pytest.raises(RecordError, match=r"column 'SOC': SOC must be whole seconds"):
        open_table(path).instants(("SOC", "FRACSEC"))
