"""Records: what is read is what the file holds, and what cannot be used is refused by name."""

import hashlib
from dataclasses import FrozenInstanceError, dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat
from tables import refused

from exfit.errors import RecordError
from exfit.records.clock import Clock
from exfit.records.reading import file_hash, read_record
from exfit.records.record import Record


@dataclass(frozen=True)
class Channel:
    column: str
    scale: float = 1.0
    offset: float = 0.0
    unit: str | None = None
    base: float | None = None


T = Clock(("t",))
VT = {"vt": Channel("vt")}
GOOD = "t,vt,ifd\n0.0,1.0,1.1\n0.1,1.01,1.2\n0.2,1.02,1.3\n0.3,1.03,1.4\n"


@pytest.fixture
def csv(tmp_path):
    """Return a function that writes a file and returns its path."""

    def write(content: str | bytes, name: str = "bump.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


def refusal(path, channels=VT, window=None):
    return refused(lambda: read_record(path, T, channels, window))


def test_a_signal_is_column_times_scale_plus_offset(csv):
    path = csv(GOOD)
    record = read_record(path, T, {"vt": Channel("vt", 2.0, -1.0), "ifd": Channel("ifd")})
    assert record.time.tolist() == [0.0, 0.1, 0.2, 0.3]
    assert record.signals["vt"].tolist() == [1.0, 2 * 1.01 - 1, 2 * 1.02 - 1, 2 * 1.03 - 1]
    assert record.signals["ifd"].tolist() == [1.1, 1.2, 1.3, 1.4]
    assert record.source == path


def test_the_window_includes_both_its_ends(csv):
    record = read_record(csv(GOOD), T, VT, (0.1, 0.2))
    assert record.time.tolist() == [0.1, 0.2]
    assert record.signals["vt"].tolist() == [1.01, 1.02]


def test_the_hash_is_of_the_bytes(csv):
    data = b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()
    path = csv(data)
    assert read_record(path, T, VT).sha256 == hashlib.sha256(data).hexdigest() == file_hash(path)


def test_a_record_cannot_be_changed(csv):
    record = read_record(csv(GOOD), T, VT)
    with pytest.raises(FrozenInstanceError):
        record.time = record.time
    for array in (record.time, record.signals["vt"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    with pytest.raises(TypeError):
        record.signals["vt"] = record.time


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + GOOD,
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.rstrip("\n"),
        GOOD + "\n\n",
        GOOD.replace("0.1,1.01", "\n0.1,1.01"),
        "\n" + GOOD,
        GOOD.replace(",", ";"),
        GOOD.encode("utf-16"),
        GOOD.replace("ifd", "Läuferstrom").encode("latin-1"),
        GOOD.replace("t,vt,ifd", '"t", vt ,"ifd"'),
        GOOD.replace("1.01", '"1.01"').replace("1.02", " 1.02 "),
        GOOD.replace("1.2", '"a, b"').replace("1.3", "text"),
    ],
    ids=[
        *(
            "BOM",
            "CRLF",
            "CR",
            "no last end",
            "blank end",
            "blank row",
            "blank first",
            "semicolons",
        ),
        *("UTF-16", "latin-1", "header", "cells", "others"),
    ],
)
def test_the_same_numbers_in_other_dress_read_the_same(csv, text):
    record = read_record(csv(text), T, VT)
    assert record.time.tolist() == [0.0, 0.1, 0.2, 0.3]
    assert record.signals["vt"].tolist() == [1.0, 1.01, 1.02, 1.03]


def test_one_column_may_serve_twice(csv):
    record = read_record(csv(GOOD), T, {"vt": Channel("vt"), "efd": Channel("vt", 2.0)})
    assert np.array_equal(record.signals["efd"], 2 * record.signals["vt"])


def test_engineering_units_become_per_unit_by_their_base(csv):
    """The field current's base is on the air-gap line: at no load it reads more than 1 pu."""
    path = csv("Zeit/ms;Ugen [kV];If\n0;15,75;550\n5;16,5375;600\n")
    record = read_record(
        path,
        Clock(("Zeit/ms",)),
        {
            "vt": Channel("Ugen [kV]", unit="KV", base=15.75),
            "ifd": Channel("If", 2.0, -1.0, unit="A", base=500.0),
        },
    )
    assert record.time.tolist() == [0.0, 0.005]
    assert record.signals["vt"].tolist() == [1.0, pytest.approx(1.05)]
    assert record.signals["ifd"].tolist() == [pytest.approx(1.2), pytest.approx(1.4)]


def test_a_unit_that_the_file_contradicts_is_refused(csv):
    path = csv("t,Ugen [V]\n0,15750\n1,15760\n")
    message = refusal(path, {"vt": Channel("Ugen [V]", unit="kV", base=15.75)})
    assert message.endswith("bump.csv: column 'Ugen [V]': in V as the file says, not in kV")


@pytest.mark.parametrize(
    ("unit", "advice"),
    [("kV", "unit: kV and base"), ("MVA", "unit: MVA and base"), ("%", "scale: 0.01"),
     ("A", "unit: A and base")],
)  # fmt: skip
def test_what_is_taken_for_per_unit_must_not_be_in_another_unit(csv, unit, advice):
    path = csv(f"t,x [{unit}]\n0,15.75\n1,15.76\n")
    channels = {"vt": Channel(f"x [{unit}]")}
    named = ("bump.csv", f"column 'x [{unit}]'", f"in {unit} as", "give vt", advice)
    refused(lambda: read_record(path, T, channels, per_unit=frozenset({"vt"})), *named)
    assert read_record(path, T, channels).signals["vt"].tolist() == [15.75, 15.76]


@pytest.mark.parametrize("name", ["vt [pu]", "vt [p.u.]", "vt [1]", "vt [-]", "vt", "vt [L1]"])
def test_numbers_per_unit_pass_as_they_stand(csv, name):
    path = csv(f"t,{name}\n0,1.0\n1,1.01\n")
    record = read_record(path, T, {"vt": Channel(name)}, per_unit=frozenset({"vt"}))
    assert record.signals["vt"].tolist() == [1.0, 1.01]


def test_a_column_is_as_long_as_the_time(tmp_path):
    path = tmp_path / "bump.mat"
    savemat(path, {"t": np.arange(6.0), "vt": np.ones(6), "slow": np.ones(3)})
    assert read_record(path, T, VT).time.size == 6
    with pytest.raises(RecordError, match=r"bump\.mat: column 't' has 6 samples, 'slow' has 3"):
        read_record(path, T, {"vt": Channel("slow")})


def test_a_clock_may_have_another_unit_and_stand_in_two_columns(csv):
    path = csv(GOOD)
    assert read_record(path, Clock(("t",), "ms"), VT).time[1] == 0.0001
    path = csv("Date;Time;vt\n20.09.2015;23:59:59,9;1\n21.09.2015;00:00:00,1;2\n")
    record = read_record(path, Clock(("Date", "Time")), VT, (0.0, 0.2))
    assert record.time.tolist() == [0.0, 0.2]


def test_timestamps_that_repeat_or_go_back_are_refused(csv):
    path = csv("Time;vt\n10:51:42,1;1\n10:51:42,1;2\n10:51:42,3;3\n")
    with pytest.raises(RecordError, match=r"bump\.csv:3: column 'Time': time 0\.0 s repeats"):
        read_record(path, Clock(("Time",)), VT)
    path = csv("Date;Time;vt\n2020-01-02;10:00;1\n2020-01-01;10:00;2\n")
    with pytest.raises(RecordError, match=r"csv:3: columns 'Date' and 'Time': .* goes back"):
        read_record(path, Clock(("Date", "Time")), VT)


# what is wrong -> content, then all that the message must name
FAULTS = {
    "empty file": ("", ["bump.csv", "empty"]),
    "blank file": (" \n\n", ["bump.csv", "empty"]),
    "header only": ("t,vt\n", ["bump.csv", "no samples"]),
    "header and blank lines": ("t,vt\n\n\n", ["bump.csv", "no samples"]),
    "one sample": ("t,vt\n0,1\n", ["bump.csv", "1 of 1 samples", "at least 2"]),
    "missing column": (GOOD.replace("vt", "Ut"), ["bump.csv", "'vt'", "'t', 'Ut', 'ifd'"]),
    "missing time": (GOOD.replace("t,vt", "s,vt"), ["bump.csv", "no column 't'", "'s', 'vt'"]),
    "no header": (GOOD.partition("\n")[2], ["bump.csv", "no column 't'", "'1', '2', '3'"]),
    "column twice": (GOOD.replace("ifd", "vt"), ["bump.csv", "'vt'", "2 and 3"]),
    "text in a number": (GOOD.replace("1.02", "1.0.2"), ["bump.csv:4", "'vt'", "'1.0.2'"]),
    "decimal comma": (GOOD.replace("1.02", '"1,02"'), ["bump.csv:4", "'vt'", "'1,02'"]),
    "underscore": (GOOD.replace("1.02", "1_02"), ["bump.csv:4", "'vt'", "'1_02'"]),
    "other digits": (GOOD.replace("1.02", "١"), ["bump.csv:4", "'vt'", "'١'"]),
    "empty cell": (GOOD.replace("1.02", ""), ["bump.csv:4", "'vt'", "empty cell"]),
    "text in time": (GOOD.replace("0.2,", "x,"), ["bump.csv:4", "'t'", "'x'"]),
    "comment": (GOOD.replace("0.2,", "#0.2,"), ["bump.csv:4", "'t'", "'#0.2'"]),
    "short row": (GOOD.replace("0.2,1.02,1.3", "0.2,1.02"), ["bump.csv:4", "row: 2", "columns: 3"]),
    "long row": (GOOD.replace("1.3", "1.3,0"), ["bump.csv:4", "row: 4", "columns: 3"]),
    "long and short row": (
        GOOD.replace("1.1", "1.1,0").replace("1.02,", ""),
        ["bump.csv:2", "row: 4", "columns: 3"],
    ),
    "blank of spaces": (GOOD.replace("0.2,1.02,1.3", "  "), ["bump.csv:4", "row: 1", "columns: 3"]),
    "nan": (GOOD.replace("1.02", "nan"), ["bump.csv:4", "'vt'", "nan is not a finite"]),
    "inf": (GOOD.replace("1.02", "-inf"), ["bump.csv:4", "'vt'", "-inf is not a finite"]),
    "overflow": (GOOD.replace("1.02", "1e999"), ["bump.csv:4", "'vt'", "inf is not a finite"]),
    "nan in time": (GOOD.replace("0.2,", "nan,"), ["bump.csv:4", "'t'", "nan is not a finite"]),
    "nan behind a blank row": (
        GOOD.replace("0.1,", "\n0.1,").replace("1.02", "nan"),
        ["bump.csv:5", "'vt'", "nan"],
    ),
    "repeated time": (
        GOOD.replace("0.2,", "0.1,"),
        ["bump.csv:4", "'t'", "0.1 s repeats", "0.1 s"],
    ),
    "time going back": (GOOD.replace("0.2,", "0.05,"), ["bump.csv:4", "'t'", "0.05 s", "0.1 s"]),
    "letter": (b"t,vt\n0,1\n\xff,2\n", ["bump.csv:3", "'t'", "'ÿ'"]),
    "bytes": (b"t,vt\n0,1\n\x81,2\n", ["bump.csv:3", "0x81"]),
    "null characters": (b"t,vt\n0,1\n0\x00,2\n", ["bump.csv:3", "0x00"]),
    "endless cell": ("t,vt\n0," + "9" * 200_000 + "x\n1,1\n", ["bump.csv:2", "limit"]),
    "endless name": ("t," + "v" * 200_000 + "\n0,1\n", ["bump.csv:1", "limit"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_file_that_cannot_be_used_is_refused_with_place_and_value(csv, fault):
    content, named = FAULTS[fault]
    path = csv(content)
    refused(lambda: read_record(path, T, VT), *named)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    assert refusal(tmp_path / "no.csv").endswith(
        "no.csv: cannot be read: No such file or directory"
    )
    assert "cannot be read: Is a directory" in refusal(tmp_path)
    assert "null" in refusal(tmp_path / "a\0b")
    assert "cannot be read" in refusal(tmp_path / ("x" * 5000))
    with pytest.raises(RecordError, match=r"no\.csv"):
        file_hash(tmp_path / "no.csv")


def test_a_window_with_too_few_samples_is_refused(csv):
    message = refusal(csv(GOOD), window=(0.15, 0.25))
    for part in ("bump.csv", "1 of 4", "0.15 ... 0.25 s", "0 ... 0.3 s", "at least 2"):
        assert part in message


def test_a_gap_outside_the_window_is_left_out_with_the_rest(csv):
    path = csv(GOOD.replace("1.0,", "nan,"))
    assert "bump.csv:2" in refusal(path)
    assert read_record(path, T, VT, (0.1, 0.3)).signals["vt"].tolist() == [1.01, 1.02, 1.03]


def test_a_scale_that_overflows_is_refused(csv):
    message = refusal(csv(GOOD.replace("1.02", "1e300")), {"vt": Channel("vt", 1e10)})
    for part in ("bump.csv:4", "'vt'", "1e+300 * 1e+10"):
        assert part in message


def test_many_columns_are_not_all_listed(csv):
    names = [f"c{at}" for at in range(50)]
    message = refusal(csv(",".join(names) + "\n" + ",".join("1" * 50) + "\n"))
    assert "'c29' and 20 more" in message
    assert "c30" not in message


def test_a_sound_file_is_not_read_cell_by_cell(csv, monkeypatch):
    """Millions of samples are read by NumPy in C; Python only looks for the place of a fault."""

    def first_row(_):
        yield 2, ["0.25", "1.5"]
        raise AssertionError

    monkeypatch.setattr("exfit.records.formats.text.TextTable.rows", first_row)
    path = csv("t,vt\n" + "".join(f"{at}.25,1.5\n" for at in range(1000)))
    assert read_record(path, T, VT).time.size == 1000


# how a recorder writes that a sample is missing -> the column with one in the third row
GAPS = ["", "  ", '""', "nan", "NaN", " NAN "]


@pytest.mark.parametrize("gap", GAPS)
def test_a_missing_sample_is_nan_where_it_may_be_missing_and_refused_elsewhere(csv, gap):
    path = csv(GOOD.replace("1.02", gap))
    channels = {"vt": Channel("vt", 2.0, -1.0), "ifd": Channel("ifd")}
    record = read_record(path, T, channels, missing=True)
    assert record.time.tolist() == [0.0, 0.1, 0.2, 0.3]
    assert np.isnan(record.signals["vt"]).tolist() == [False, False, True, False]
    assert record.signals["vt"][[0, 1, 3]].tolist() == [1.0, 2 * 1.01 - 1, 2 * 1.03 - 1]
    assert record.signals["ifd"].tolist() == [1.1, 1.2, 1.3, 1.4]
    assert "bump.csv:4: column 'vt'" in refusal(path, channels)


def test_allowing_for_missing_samples_changes_nothing_where_none_is(csv):
    path = csv(GOOD)
    plain, allowed = (read_record(path, T, VT, missing=missing) for missing in (False, True))
    assert np.array_equal(plain.time, allowed.time)
    assert np.array_equal(plain.signals["vt"], allowed.signals["vt"])
    assert plain.sha256 == allowed.sha256


def test_samples_missing_at_both_ends_and_in_every_signal_stay_apart(csv):
    path = csv("t,vt,ifd\n0,,1\n1,2,\n2,3,nan\n3,NaN,4\n")
    record = read_record(path, T, {"vt": Channel("vt"), "ifd": Channel("ifd")}, missing=True)
    assert record.signals["vt"].tolist() == pytest.approx([np.nan, 2, 3, np.nan], nan_ok=True)
    assert record.signals["ifd"].tolist() == pytest.approx([1, np.nan, np.nan, 4], nan_ok=True)


# what is wrong, though samples may be missing -> content, then all that the message must name
FAULTS_BESIDE_GAPS = {
    "text": (GOOD.replace("1.02", "1.0.2"), ["bump.csv:4", "'vt'", "'1.0.2'"]),
    "text behind a gap": (
        GOOD.replace("1.01", "").replace("1.02", "bad"),
        ["bump.csv:4", "'vt'", "'bad'"],
    ),
    "underscore behind a gap": (
        GOOD.replace("1.01", "").replace("1.02", "1_02"),
        ["bump.csv:4", "'vt'", "'1_02'"],
    ),
    "empty time": (GOOD.replace("0.2,", ","), ["bump.csv:4", "'t'", "empty cell"]),
    "empty time beside a gap": (
        GOOD.replace("0.2,1.02", ","),
        ["bump.csv:4", "'t'", "empty cell"],
    ),
    "nan in time": (GOOD.replace("0.2,", "nan,"), ["bump.csv:4", "'t'", "nan is not a finite"]),
    "inf": (GOOD.replace("1.02", "inf"), ["bump.csv:4", "'vt'", "inf is not a finite"]),
    "inf behind a gap": (
        GOOD.replace("1.01", "").replace("1.02", "-inf"),
        ["bump.csv:4", "'vt'", "-inf is not a finite"],
    ),
    "short row behind a gap": (
        GOOD.replace("1.01", "").replace("1.02,1.3", "1.02"),
        ["bump.csv:4", "row: 2", "columns: 3"],
    ),
    "nothing but gaps": (
        "t,vt\n0,\n1,nan\n2,\n",
        ["bump.csv", "'vt'", "every sample is missing"],
    ),
}


@pytest.mark.parametrize("fault", FAULTS_BESIDE_GAPS)
def test_only_samples_may_be_missing(csv, fault):
    content, named = FAULTS_BESIDE_GAPS[fault]
    path = csv(content)
    refused(lambda: read_record(path, T, VT, missing=True), *named)


def test_a_signal_missing_from_the_whole_window_is_refused(csv):
    path = csv(GOOD.replace("1.02", "").replace("1.03", ""))
    with pytest.raises(RecordError, match="'vt': every sample is missing"):
        read_record(path, T, VT, (0.2, 0.3), missing=True)


def test_a_scale_of_zero_makes_no_number_of_an_infinite_one(csv):
    with pytest.raises(RecordError, match="inf is not a finite"):
        read_record(csv(GOOD.replace("1.02", "inf")), T, {"vt": Channel("vt", 0.0)}, missing=True)


def test_the_column_of_time_cannot_have_gaps_as_a_signal_either(csv):
    with pytest.raises(RecordError, match=r"bump\.csv:4: column 't': an empty cell"):
        read_record(csv(GOOD.replace("0.2,", ",")), T, {"x": Channel("t")}, missing=True)


def test_arrays_make_the_record_that_their_file_makes(csv):
    read = read_record(csv(GOOD), T, {"vt": Channel("vt"), "ifd": Channel("ifd")})
    built = Record.from_arrays(read.time.tolist(), dict(read.signals), source="bench test")
    assert np.array_equal(built.time, read.time)
    assert built.signals.keys() == read.signals.keys()
    assert all(np.array_equal(built.signals[name], read.signals[name]) for name in read.signals)
    assert built.source == Path("bench test")


def test_a_record_of_arrays_keeps_read_only_copies():
    vt = np.array([1.0, 1.01])
    record = Record.from_arrays([0, 1], {"vt": vt})
    vt[0] = 0.0
    assert record.signals["vt"].tolist() == [1.0, 1.01]
    for array in (record.time, record.signals["vt"]):
        assert array.dtype == np.float64
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_the_hash_of_arrays_is_of_their_content():
    def digest(**changes):
        arrays = {"time": [0.0, 1.0], "vt": [1.0, 1.1], "efd": [2.0, 2.1], **changes}
        return Record.from_arrays(arrays.pop("time"), arrays).sha256

    same = digest(time=np.array([0, 1]), vt=np.array([1.0, 1.1]))
    reordered = Record.from_arrays([0.0, 1.0], {"efd": [2.0, 2.1], "vt": [1.0, 1.1]}).sha256
    assert digest() == same == reordered
    others = [
        digest(time=[0.0, 1.5]),
        digest(vt=[1.0, 1.2]),
        digest(vt=[2.0, 2.1], efd=[1.0, 1.1]),
        Record.from_arrays([0.0, 1.0], {"vt": [1.0, 1.1]}).sha256,
    ]
    assert len({digest(), *others}) == 1 + len(others)


# what is wrong -> time, vt, and what the message must name beside the source
UNUSABLE_ARRAYS = {
    "one sample": ([0.0], [1.0], "1 samples; at least 2"),
    "none": ([], [], "0 samples; at least 2"),
    "uneven": ([0.0, 1.0], [1.0], "vt: 1 samples, but time has 2"),
    "a table": ([0.0, 1.0], [[1.0, 2.0]], "vt: 2 dimensions"),
    "a number": ([0.0, 1.0], 1.0, "vt: 0 dimensions"),
    "complex": ([0.0, 1.0], [1.0, 1j], "vt: complex128 instead of real"),
    "text": ([0.0, 1.0], ["1", "2"], "vt: <U1 instead of real"),
    "nothing": ([0.0, 1.0], [1.0, None], "vt: object instead of real"),
    "timestamps": (np.array([0, 1], "datetime64[s]"), [1.0, 2.0], "time: datetime64[s] instead"),
    "nan": ([0.0, 1.0], [1.0, np.nan], "sample 1: vt: nan is not a finite"),
    "inf": ([0.0, 1.0], [np.inf, 1.0], "sample 0: vt: inf is not a finite"),
    "nan in time": ([0.0, np.nan], [1.0, 1.0], "sample 1: time: nan is not a finite"),
    "repeated time": ([0.0, 1.0, 1.0], [1.0, 1.0, 1.0], "sample 2: time: time 1.0 s repeats"),
    "time going back": (
        [0.0, 2.0, 1.0],
        [1.0, 1.0, 1.0],
        "sample 2: time: time goes back from 2.0 s to 1.0 s",
    ),
}


@pytest.mark.parametrize("fault", UNUSABLE_ARRAYS)
def test_arrays_that_are_no_record_are_refused_by_name(fault):
    time, vt, named = UNUSABLE_ARRAYS[fault]
    refused(lambda: Record.from_arrays(time, {"vt": vt}, source="bench"), f"bench: {named}")


def test_a_sample_of_an_array_may_be_missing_where_that_is_allowed():
    gappy = Record.from_arrays([0.0, 1.0], {"vt": [1.0, np.nan]}, missing=True)
    assert np.isnan(gappy.signals["vt"]).tolist() == [False, True]
    for time, vt, named in (
        ([0.0, 1.0], [np.nan, np.nan], "vt: every sample is missing"),
        ([0.0, 1.0], [np.nan, np.inf], "sample 1: vt: inf"),
        ([0.0, np.nan], [1.0, 1.0], "sample 1: time: nan"),
    ):
        refused(partial(Record.from_arrays, time, {"vt": vt}, missing=True), named)
    refused(lambda: Record.from_arrays([0.0, 1.0], {}), "no signals")
    refused(lambda: Record.from_arrays([0, 1], {"time": [0, 1]}), "named time")


@given(
    at=st.integers(0, len(GOOD)),
    cut=st.integers(0, 12),
    junk=st.one_of(
        st.text(alphabet=',."\n\r\t 0123456789eE+-naif;#_\x00\ufeffé١\x0b\x1c\u2028', max_size=8),
        st.text(max_size=6).map(lambda text: text.encode("utf-8", "replace").decode()),
        st.binary(max_size=4),
    ),
    missing=st.booleans(),
)
def test_no_damage_gives_anything_but_a_record_or_its_refusal(
    tmp_path_factory, at, cut, junk, missing
):
    path = tmp_path_factory.getbasetemp() / "damaged.csv"
    data = junk if isinstance(junk, bytes) else junk.encode()
    path.write_bytes(GOOD.encode()[:at] + data + GOOD.encode()[at + cut :])
    try:
        channels = {"vt": Channel("vt"), "ifd": Channel("ifd")}
        record = read_record(path, T, channels, missing=missing)
    except RecordError:
        return
    assert np.all(np.diff(record.time) > 0)
    finite = np.isfinite([*record.signals.values()])
    assert np.all(finite | missing)
    assert np.all(finite.any(axis=1))
