"""Numbers and clocks that nothing measures are refused with place, value and limit; none warns."""

import os
import re

import numpy as np
import pytest

from exfit.dsp.lines import ripple_at_rest
from exfit.errors import RecordError
from exfit.records.clock import Clock
from exfit.records.formats import open_table
from exfit.records.inspection import inspect
from exfit.records.reading import ThreePhases, read_record
from exfit.records.record import Record

COUNT = 200
TIME = np.arange(COUNT) * 0.01
VOLTAGE = 1.0 + 0.05 * (TIME > 1.0)
CLOCKS = {
    "steps of 1e-300 s": (TIME * 1e-298, r":3: column 't': 1e-300 s after the sample before, as "
        r"most are: closer than 1e-12 s"),
    "steps of 1e-320 s": (np.arange(COUNT) * 1e-320, r":3: column 't': .* closer than 1e-12 s"),
    "the largest number": (np.append(TIME[:-1], 1.7e308), r":201: column 't': 1.7e\+308 exceeds"),
    "from -1e308": ((np.arange(COUNT) - 100) * 1e306, r":2: column 't': -1e\+308 exceeds 1e\+100"),
    "infinite": (np.append(TIME[:-1], np.inf), r":201: column 't': inf is not a finite number"),
    "standing still": (0.0 * TIME, r":(3|103): column 't': time 0.0 s repeats"),
    "backwards": (TIME[::-1], r":3: column 't': time goes back from 1.99 s to 1.98 s"),
}  # fmt: skip
HUGE = {
    "1e308": VOLTAGE * 1e308,
    "1e308 once": np.where(TIME[0] == TIME, 1e308, VOLTAGE),
    "of both signs": np.where(np.arange(COUNT) % 2, 1e308, -1e308),
    "1e200": VOLTAGE * 1e200,
}
HARMLESS = {
    "a gap of 1e10 s": (np.where(TIME > 1.5, TIME + 1e10, TIME), VOLTAGE),
    "one short step": (np.where(np.arange(COUNT) == 100, TIME[99] + 1e-15, TIME), VOLTAGE),
    "tiny numbers": (TIME, VOLTAGE * 1e-308),
    "denormal numbers": (TIME, VOLTAGE * 1e-320),
    "zeros": (TIME, 0.0 * VOLTAGE),
    "infinite numbers": (TIME, np.where(TIME > 1.0, np.inf, VOLTAGE)),
    "no numbers": (TIME, np.full(COUNT, np.nan)),
}


@pytest.fixture
def write(tmp_path):
    """Return a function that writes columns as a file."""

    def written(**columns):
        path = tmp_path / "bump.csv"
        rows = zip(*(map(repr, column.tolist()) for column in columns.values()), strict=True)
        path.write_text("\n".join([",".join(columns), *map(",".join, rows), ""]))
        return path

    return written


def read(path, **channel):
    return read_record(path, Clock(("t",)), {"vt": Channel(**channel)})


class Channel:
    """A channel with scale and base."""

    column, unit, offset = "vt", None, 0.0

    def __init__(self, scale=1.0, base=None):
        self.scale, self.base = scale, base


@pytest.mark.parametrize("name", CLOCKS)
def test_a_clock_that_no_recorder_has_is_refused(write, name):
    time, message = CLOCKS[name]
    path = write(t=time, vt=VOLTAGE)
    for use in (lambda: inspect(open_table(path)), lambda: read(path)):
        with pytest.raises(RecordError, match=re.escape(str(path)) + message):
            use()


@pytest.mark.parametrize("name", HUGE)
def test_numbers_beyond_all_measure_are_refused(write, name):
    path = write(t=TIME, vt=HUGE[name], efd=VOLTAGE)
    with pytest.raises(
        RecordError, match=r"bump\.csv:2: column 'vt': .*e\+\d+ \* 1 exceeds 1e\+100"
    ):
        read(path)
    with pytest.raises(RecordError, match=r"sample 0: vt: .*e\+\d+ exceeds 1e\+100"):
        Record.from_arrays(TIME, {"vt": HUGE[name]})
    inspection = inspect(open_table(path))
    assert [channel.name for channel in inspection.channels] == ["efd"]
    assert "exceeds 1e+100" in inspection.unreadable["vt"]


@pytest.mark.parametrize("name", HARMLESS)
def test_other_odd_numbers_are_inspected_without_a_warning(write, name):
    time, voltage = HARMLESS[name]
    assert inspect(open_table(write(t=time, vt=voltage))).sampling is not None


@pytest.mark.parametrize("channel", [{"scale": 1e308}, {"scale": 1e200}, {"base": 1e-308}])
def test_a_scale_or_base_that_makes_numbers_beyond_all_measure_is_refused(write, channel):
    with pytest.raises(RecordError, match=r"column 'vt': .* (exceeds 1e|is not a finite number)"):
        read(write(t=TIME, vt=VOLTAGE * 1e10), **channel)


def test_a_signal_below_all_measure_is_refused(write):
    with pytest.raises(RecordError, match=r"column 'vt': at most 1\.05e-308 pu throughout, below"):
        read(write(t=TIME, vt=VOLTAGE * 1e-308))


def test_phases_beyond_all_measure_are_refused(write):
    path = write(t=TIME, a=VOLTAGE, b=VOLTAGE * 1e308, c=VOLTAGE)
    phases = ThreePhases(("a", "b", "c"), "rms", "V", 1.0, "phase-to-ground", 1)
    with pytest.raises(RecordError, match=r":2: column 'b': 1e\+308 exceeds 1e\+100"):
        read_record(path, Clock(("t",)), {"vt": phases})


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes among its files")
def test_a_pipe_or_a_device_is_refused_at_once(tmp_path):
    for name in ("bump.csv", "bump.xlsx", "bump.mat", "bump.parquet", "bump.cfg", "bump.cff"):
        os.mkfifo(tmp_path / name)
        with pytest.raises(RecordError, match=f"{name}: cannot be read: a pipe or a device"):
            open_table(tmp_path / name)
        (tmp_path / name).unlink()
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    with pytest.raises(RecordError, match=r"zero\.csv: cannot be read: a pipe or a device"):
        open_table(tmp_path / "zero.csv")
    (tmp_path / "loop.csv").symlink_to(tmp_path / "loop.csv")
    with pytest.raises(RecordError, match=r"loop\.csv: cannot be read: "):
        open_table(tmp_path / "loop.csv")


def test_a_sparse_file_of_a_terabyte_is_refused_unread(tmp_path):
    path = tmp_path / "bump.csv"
    with path.open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(RecordError, match=r"1000000000000 bytes: .* the limit is 4 GB"):
        open_table(path)


def test_a_rest_that_is_a_gap_shows_no_ripple():
    """Its even samples would take terabytes."""
    time = np.arange(200) * 0.01
    time[150:] += 1e10
    noise = np.random.default_rng(3).normal(0.0, 1.0, time.size)
    assert ripple_at_rest(time, noise, [(time[0], time[-1])]) is None
