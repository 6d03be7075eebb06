"""COMTRADE: one record reads the same in every form, and what is damaged is refused by its place.

The files are written here straight from the layout of the standard (IEEE Std C37.111-1991, -1999,
-2013), not by the package that reads them.
"""

import hashlib
import struct
import sys
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tables import damage, everything, refused

from exfit.errors import RecordError
from exfit.records.formats.comtrade import read_comtrade

RATES = ((1000.0, 30), (200.0, 50))
SAMPLES = RATES[-1][1]
# 1 ms from sample to sample, then 5 ms: the distance of each sample from the one before it
INSTANTS = np.concatenate([np.arange(30) * 1e-3, 0.029 + np.arange(1, 21) * 5e-3])
VT = 15.75 * (1.0 + 0.05 * np.exp(-INSTANTS / 0.05) * np.cos(40.0 * INSTANTS))
IF = 700.0 - 100.0 * np.exp(-INSTANTS / 0.02)
BREAKERS = [(np.arange(SAMPLES) // (at + 2)) % 2 for at in range(19)]  # more than a word of 16
MULTIPLIER = 2.0
FORMS = ("ASCII", "BINARY", "BINARY32", "FLOAT32")
SCALES = {  # a and b of the two analog channels: what one step of the raw number is worth
    "ASCII": ((1e-3, 0.5), (0.05, -3.0)),
    "BINARY": ((1e-3, 0.5), (0.05, -3.0)),
    "BINARY32": ((1e-7, 0.5), (1e-6, -3.0)),
    "FLOAT32": ((1.0, 0.0), (1.0, 0.0)),
}
LETTERS = {"BINARY": "h", "BINARY32": "i", "FLOAT32": "f"}
DATE = {"1991": "09/20/15", "1999": "20/09/2015", "2013": "20/09/2015"}


def steps(form):
    """Return the largest error of each channel: half a step, or half a unit of the last place."""
    if form == "FLOAT32":
        return [np.spacing(np.float32(np.max(np.abs(x)))) / 2 for x in (VT, IF)]
    return [a / 2 * (1 + 1e-6) for a, _ in SCALES[form]]


def configuration(form="BINARY", revision="1999", rates=RATES, fraction="859893", scales=None):
    """Return the lines of a .cfg."""
    old = revision == "1991"
    tail = "" if old else ",15750,100,P"
    lines = ["Unit 1,recorder" + ("" if old else f",{revision}"), "21,2A,19D"]
    for at, ((a, b), name, unit) in enumerate(
        zip(scales or SCALES[form], ("Ugen", "If"), ("kV", "A"), strict=True)
    ):
        lines.append(f"{at + 1},{name},A,G1,{unit},{a!r},{b!r},0.0,-32767,32767{tail}")
    lines += [f"{at + 1},CB{at + 1}{'' if old else ',,'},0" for at in range(19)]
    lines += ["50", str(len([rate for rate, _ in rates if rate]))]
    lines += [f"{rate:g},{last}" for rate, last in rates]
    stamp = f"{DATE[revision]},10:51:42.{fraction}"
    lines += [stamp, stamp, form]
    if not old:
        lines.append(f"{MULTIPLIER:g}")
    if revision == "2013":
        lines += ["0,0", "0,0"]
    return lines


def ticks(per_second=1e6, multiplier=MULTIPLIER, first=0):
    return [first + round(t * per_second / multiplier) for t in INSTANTS]


def raw(form, scales=None):
    samples = [(x - b) / a for x, (a, b) in zip((VT, IF), scales or SCALES[form], strict=True)]
    return [x if form == "FLOAT32" else np.rint(x).astype(int) for x in samples]


def samples(form, stamps=None, analog=None):
    """Return the bytes of a .dat."""
    stamps, analog = stamps or ticks(), raw(form) if analog is None else analog
    out = []
    for row in range(SAMPLES):
        bits = [int(one[row]) for one in BREAKERS]
        values = [x[row] for x in analog]
        if form == "ASCII":
            cells = [row + 1, stamps[row], *values, *bits]
            out.append((",".join(map(str, cells)) + "\r\n").encode())
        else:
            words = [sum(bit << at for at, bit in enumerate(bits[i : i + 16])) for i in (0, 16)]
            out.append(struct.pack(f"<II2{LETTERS[form]}2H", row + 1, stamps[row], *values, *words))
    return b"".join(out)


def text(lines):
    return ("\r\n".join(lines) + "\r\n").encode("latin-1")


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a record as two files and returns the name of the first."""

    def write(lines, data, name="bump", suffixes=(".cfg", ".dat")):
        for suffix, content in zip(suffixes, (text(lines), data), strict=True):
            (tmp_path / (name + suffix)).write_bytes(content)
        return tmp_path / (name + suffixes[0])

    return write


def one_file(lines, data, form, size=True):
    """Return a .cff."""
    of = f" {form}" + (f": {len(data)}" if size and form != "ASCII" else "")
    return (
        b"--- file type: CFG ---\r\n"
        + text(lines)
        + b"--- file type: INF ---\r\n\r\n--- file type: HDR ---\r\nnone\r\n"
        + f"--- file type: DAT{of} ---\r\n".encode()
        + data
    )


def assert_the_record(table, form):
    columns = table.numbers(table.names)
    assert table.names == ("time", "Ugen", "If", *(f"CB{at + 1}" for at in range(19)))
    assert table.clock == ("time",)
    assert {**table.units} == {"time": "s", "Ugen": "kV", "If": "A"}
    np.testing.assert_allclose(table.instants(["time"]), INSTANTS, rtol=0, atol=1e-12)
    for name, truth, step in zip(("Ugen", "If"), (VT, IF), steps(form), strict=True):
        assert np.max(np.abs(columns[name] - truth)) <= step
    for at, truth in enumerate(BREAKERS):
        assert np.array_equal(columns[f"CB{at + 1}"], truth)


@pytest.mark.parametrize("revision", ["1999", "2013"])
@pytest.mark.parametrize("form", FORMS)
def test_one_record_reads_the_same_in_every_form(write, form, revision):
    path = write(configuration(form, revision), samples(form))
    assert_the_record(read_comtrade(path), form)


@pytest.mark.parametrize("size", [True, False])
@pytest.mark.parametrize("form", FORMS)
def test_one_record_reads_the_same_in_one_file(tmp_path, form, size):
    path = tmp_path / "bump.cff"
    path.write_bytes(one_file(configuration(form, "2013"), samples(form), form, size))
    table = read_comtrade(path)
    assert_the_record(table, form)
    assert table.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("form", ["ASCII", "BINARY"])
def test_the_standard_of_1991_has_fewer_cells(write, form):
    assert_the_record(read_comtrade(write(configuration(form, "1991"), samples(form))), form)


@pytest.mark.parametrize("written", ["0", "1997", "2000", " 2000 "])
@pytest.mark.parametrize("form", ["ASCII", "BINARY"])
def test_a_revision_that_no_standard_has_is_read_by_the_cells_of_the_channels(write, form, written):
    """Wisp.Comtrade, ComtradeTests/ExampleSet2: a file of 1997 and one of 2000, both as in 1999."""
    rates = ((0.0, SAMPLES),)  # the time is that of the stamps, with the multiplier of 1999
    for revision, multiplier in (("1999", MULTIPLIER), ("1991", 1.0)):
        station, *lines = configuration(form, revision, rates=rates)
        station = ",".join([*station.split(",")[:2], written])
        data = samples(form, ticks(multiplier=multiplier))
        assert_the_record(read_comtrade(write([station, *lines], data)), form)


@pytest.mark.parametrize("first", [0, 1])
def test_a_last_sample_that_is_counted_from_zero_is_read(write, first):
    """Wisp.Comtrade, ComtradeTests/ExampleSet2: 2.cfg numbers from 0, 4.CFG from 1."""
    whole = configuration(rates=((1000.0, SAMPLES),))
    data = b"".join(
        struct.pack("<I", row + first) + GOOD[row * ROW + 4 : (row + 1) * ROW]
        for row in range(SAMPLES)
    )
    expected = read_comtrade(write(whole, GOOD)).numbers(("time", "Ugen"))
    found = read_comtrade(write(configuration(rates=((1000.0, SAMPLES - 1),)), data)).numbers(
        ("time", "Ugen")
    )
    for name, samples in expected.items():
        assert np.array_equal(found[name], samples)
    with pytest.raises(RecordError, match="50 samples, but 48"):
        read_comtrade(write(configuration(rates=((1000.0, SAMPLES - 2),)), data))


def test_a_status_channel_without_its_normal_state_is_read(write):
    """Wisp.Comtrade, ComtradeTests/ExampleSet2, 2.cfg: of spare channels the fifth cell lacks."""
    lines = [f"{line[:-2]}" if ",CB" in line else line for line in configuration()]
    assert {line.count(",") for line in lines if ",CB" in line} == {3}
    assert_the_record(read_comtrade(write(lines, samples("BINARY"))), "BINARY")


@pytest.mark.parametrize(
    "suffixes", [(".CFG", ".DAT"), (".cfg", ".DAT"), (".Cfg", ".dat")], ids="".join
)
def test_either_file_may_be_named_whatever_its_capitals(write, suffixes):
    cfg = write(configuration(), samples("BINARY"), suffixes=suffixes)
    by_cfg, by_other = read_comtrade(cfg), read_comtrade(cfg.with_suffix(suffixes[1]))
    assert_the_record(by_cfg, "BINARY")
    assert_the_record(by_other, "BINARY")
    both = text(configuration()) + samples("BINARY")
    assert by_cfg.sha256 == by_other.sha256 == hashlib.sha256(both).hexdigest()


def test_a_name_that_is_not_utf_8_is_read(write):
    lines = [line.replace("Ugen", "Ugén") for line in configuration()]
    assert read_comtrade(write(lines, samples("BINARY"))).names[1] == "Ugén"


@pytest.mark.parametrize("form", FORMS)
def test_without_rates_the_time_follows_the_stamps_and_starts_at_zero(write, form):
    lines = configuration(form, rates=((0.0, SAMPLES),))
    table = read_comtrade(write(lines, samples(form, ticks(first=5_000_000))))
    np.testing.assert_allclose(table.instants(["time"]), INSTANTS, rtol=0, atol=1e-9)


def test_stamps_of_2013_count_nanoseconds_where_the_dates_do(write):
    lines = configuration("BINARY", "2013", ((0.0, SAMPLES),), "859893123")
    table = read_comtrade(write(lines, samples("BINARY", ticks(1e9))))
    np.testing.assert_allclose(table.instants(["time"]), INSTANTS, rtol=0, atol=1e-12)


def test_with_rates_the_stamps_do_not_matter(write):
    for stamps in (ticks(first=777), [0] * SAMPLES, [0xFFFFFFFF] * SAMPLES):
        table = read_comtrade(write(configuration(), samples("BINARY", stamps)))
        assert_the_record(table, "BINARY")


def test_stamps_may_be_blank_where_there_are_rates(write):
    data = samples("ASCII")
    for stamp in set(ticks()):
        data = data.replace(f",{stamp},".encode(), b",,", 1)
    assert_the_record(read_comtrade(write(configuration("ASCII"), data)), "ASCII")


def test_seconds_need_no_fraction(write):
    lines = [line.replace(".859893", "") for line in configuration()]
    assert_the_record(read_comtrade(write(lines, samples("BINARY"))), "BINARY")


@pytest.mark.parametrize("form", FORMS)
def test_the_package_reads_the_same_channels_and_times(write, form):
    import comtrade

    path = write(configuration(form), samples(form))
    theirs = comtrade.load(str(path), use_numpy_arrays=True, use_double_precision=True)
    ours = read_comtrade(path)
    columns = ours.numbers(ours.names)
    np.testing.assert_allclose(columns["time"], theirs.time, rtol=0, atol=1e-12)
    for at, name in enumerate(theirs.analog_channel_ids):
        np.testing.assert_allclose(columns[name], theirs.analog[at], rtol=1e-13)
    for at, name in enumerate(theirs.status_channel_ids):
        assert np.array_equal(columns[name], theirs.status[at])


def test_a_long_record_keeps_its_time_to_the_nanosecond(tmp_path):
    count, rate = 400_000, 3000.0
    lines = ["s,d,1999", "1,1A,0D", "1,u,,,V,1,0,0,-32767,32767,1,1,P", "50", "1"]
    lines += [f"{rate:g},{count}", "01/01/2020,0:00:00.0", "01/01/2020,0:00:00.0", "BINARY", "1"]
    (tmp_path / "long.cfg").write_bytes(text(lines))
    data = np.zeros(count, [("n", "<u4"), ("t", "<u4"), ("x", "<i2")])
    data["n"] = np.arange(count) + 1
    (tmp_path / "long.dat").write_bytes(data.tobytes())
    time = read_comtrade(tmp_path / "long.cfg").instants(["time"])
    assert abs(time[-1] - (count - 1) / rate) < 1e-9


MARKS = {
    ("ASCII", "1999"): 99999,
    ("ASCII", "1991"): "",
    ("BINARY", "1999"): -0x8000,
    ("BINARY32", "2013"): -0x80000000,
    ("FLOAT32", "2013"): -sys.float_info.max,
}


@pytest.mark.parametrize(("form", "revision"), MARKS, ids=str)
def test_a_missing_sample_is_nan_where_it_may_be_missing(write, form, revision):
    analog = [list(x) for x in raw(form)]
    mark = MARKS[form, revision]
    analog[0][7] = np.finfo(np.float32).min if form == "FLOAT32" else mark
    table = read_comtrade(write(configuration(form, revision), samples(form, analog=analog)))
    vt = table.numbers(["Ugen", "If"], frozenset(["Ugen"]))["Ugen"]
    assert np.flatnonzero(np.isnan(vt)).tolist() == [7]
    refused(lambda: table.numbers(["Ugen"]), "bump.dat: sample 8", "'Ugen'", "missing")
    assert table.place(7).endswith("bump.dat: sample 8")


def test_minus_one_is_missing_in_1991_only_where_the_range_leaves_it_out(write):
    analog = [list(x) for x in raw("BINARY")]
    analog[0][7] = analog[1][7] = -1
    lines = configuration("BINARY", "1991")
    lines[3] = lines[3].replace("-32767,", "0,")
    columns = read_comtrade(write(lines, samples("BINARY", analog=analog))).numbers(
        ["Ugen", "If"], frozenset(["If"])
    )
    (a, b), _ = SCALES["BINARY"]
    assert columns["Ugen"][7] == pytest.approx(b - a)
    assert np.isnan(columns["If"][7])


def test_a_column_that_is_not_there_is_refused_with_those_that_are(write):
    table = read_comtrade(write(configuration(), samples("BINARY")))
    refused(lambda: table.numbers(["Ugem"]), "bump.cfg", "'Ugem'", "did you mean 'Ugen'?", "'If'")


def test_a_name_of_two_channels_is_refused_when_it_is_requested(write):
    lines = [line.replace(",If,", ",Ugen,") for line in configuration()]
    table = read_comtrade(write(lines, samples("BINARY")))
    assert table.numbers(["CB1"])["CB1"].size == SAMPLES
    refused(lambda: table.numbers(["Ugen"]), "'Ugen'", "2 and 3")


def test_the_missing_package_is_named_with_its_extra(write, monkeypatch):
    monkeypatch.setitem(sys.modules, "comtrade", None)
    path = write(configuration(), samples("BINARY"))
    refused(lambda: read_comtrade(path), "bump.cfg", 'pip install "exfit[comtrade]"')


def changed(at, line):
    """Return a .cfg with one line changed, counted from 1 as messages do; None drops the rest."""
    lines = configuration()
    return lines[: at - 1] if line is None else [*lines[: at - 1], line, *lines[at:]]


GOOD = samples("BINARY")
ROW = len(GOOD) // SAMPLES
ASCII = samples("ASCII").split(b"\r\n")


def with_line(at, line):
    return b"\r\n".join([*ASCII[: at - 1], line, *ASCII[at:]])


# what is wrong -> configuration, data, all that the message must name
FAULTS = {
    "empty cfg": ([""], GOOD, ["bump.cfg:1"]),
    "four cells first": (changed(1, "a,b,c,1999"), GOOD, ["bump.cfg:1", "4 cells"]),
    "unknown revision": (changed(1, "a,b,2031"), GOOD, ["bump.cfg:1", "'2031'", "2013"]),
    "no counts": (changed(2, "21,2,19"), GOOD, ["bump.cfg:2", "6,4A,2D"]),
    "counts that do not add up": (changed(2, "20,2A,19D"), GOOD, ["bump.cfg:2", "20", "2", "19"]),
    "too few channel lines": (changed(9, None), GOOD, ["bump.cfg:8", "21 channels, but 6 lines"]),
    "a comma in a name": (
        changed(3, "1,U,gen,A,G1,kV,1,0,0,-9,9,1,1,P"),
        GOOD,
        ["bump.cfg:3", "14 cells", "analog"],
    ),
    "a short channel line": (changed(4, "2,If,A,G1,A"), GOOD, ["bump.cfg:4", "5 cells"]),
    "a short status line": (changed(9, "5,CB5"), GOOD, ["bump.cfg:9", "2 cells", "status"]),
    "no number for a": (
        changed(3, "1,U,A,G1,kV,1.0.0,0,0,-9,9,1,1,P"),
        GOOD,
        ["bump.cfg:3", "'1.0.0'"],
    ),
    "an infinite a": (
        changed(4, "2,If,A,G1,A,inf,0,0,-9,9,1,1,P"),
        GOOD,
        ["bump.cfg:4", "'If'", "inf"],
    ),
    "no number of rates": (changed(25, "two"), GOOD, ["bump.cfg:25", "'two'"]),
    "a negative rate": (changed(26, "-1000,30"), GOOD, ["bump.cfg:26", "-1000"]),
    "a rate without its end": (changed(26, "1000"), GOOD, ["bump.cfg:26", "'1000'"]),
    "ends that go back": (changed(27, "200,20"), GOOD, ["bump.cfg:27", "20", "30"]),
    "no date": (changed(28, "20/09/2015,noon"), GOOD, ["bump.cfg:28", "noon"]),
    "an unknown kind": (changed(30, "BINARY64"), GOOD, ["bump.cfg", "'BINARY64'", "FLOAT32"]),
    "no time multiplier": (changed(31, "x"), GOOD, ["bump.cfg:31", "'x'"]),
    "a multiplier of zero": (changed(31, "0"), GOOD, ["bump.cfg", "multiplier of 0"]),
    "no text": (["a\0b", *configuration()[1:]], GOOD, ["bump.cfg:1", "0x00"]),
    "no samples": (configuration(), b"", ["bump.dat", "0 samples", "50"]),
    "cut off in a sample": (configuration(), GOOD[:-3], ["bump.dat", "49 samples", "cut off"]),
    "cut off behind a sample": (configuration(), GOOD[:-ROW], ["bump.dat", "49 samples", "50"]),
    "a sample too many": (configuration(), GOOD + GOOD[-ROW:], ["bump.dat", "51 samples", "50"]),
    "one channel fewer in the data": (
        configuration(),
        b"".join(GOOD[at : at + ROW - 2] for at in range(0, len(GOOD), ROW)),
        ["bump.dat", "bump.cfg"],
    ),
    "a sample out of its turn": (
        configuration(),
        GOOD[: 4 * ROW] + struct.pack("<I", 9) + GOOD[4 * ROW + 4 :],
        ["bump.dat: sample 5", "9", "4"],
    ),
    "no stamps and no rates": (
        configuration(rates=((0.0, SAMPLES),)),
        samples("BINARY", [*ticks()[:9], 0xFFFFFFFF, *ticks()[10:]]),
        ["bump.dat: sample 10", "stamp"],
    ),
    "nanoseconds before 2013": (
        configuration(rates=((0.0, SAMPLES),), fraction="859893123"),
        GOOD,
        ["bump.cfg", "1999", "ns"],
    ),
    "text in a cell": (
        configuration("ASCII"),
        with_line(3, ASCII[2].replace(b"3,1000,", b"3,1000,x")),
        ["bump.dat:3", "is not a number"],
    ),
    "a short line": (configuration("ASCII"), with_line(4, b"4,1500,3"), ["bump.dat:4", "3 cells"]),
    "a line without a number": (
        configuration("ASCII"),
        with_line(4, ASCII[3].replace(b"4,1500", b",1500")),
        ["bump.dat:4", "an empty cell"],
    ),
    "a line that is none elsewhere": (
        configuration("ASCII"),
        with_line(4, ASCII[3] + b"\r\n\x0b"),
        ["bump.dat: damaged"],
    ),
    "ASCII cut off": (configuration("ASCII"), b"\r\n".join(ASCII[:20]), ["bump.dat", "20", "50"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_damaged_record_is_refused_by_its_place(write, fault):
    lines, data, named = FAULTS[fault]
    path = write(lines, data)
    refused(lambda: read_comtrade(path), *named)


def test_a_status_channel_is_zero_or_one(write):
    last = ASCII[4].rpartition(b",")[0] + b",2"
    table = read_comtrade(write(configuration("ASCII"), with_line(5, last)))
    refused(lambda: table.numbers(["CB19"]), "bump.dat: sample 5", "'CB19'", "2 is not 0 or 1")


@pytest.mark.parametrize("given", [".cfg", ".dat"])
def test_the_file_that_is_not_beside_it_is_named(write, given):
    path = write(configuration(), GOOD).with_suffix(given)
    other = ".dat" if given == ".cfg" else ".cfg"
    path.with_suffix(other).unlink()
    refused(lambda: read_comtrade(path), f"bump{given}", f"bump{other} is missing beside it")


def test_two_files_that_may_belong_to_it_are_both_named(write):
    path = write(configuration(), GOOD)
    path.with_suffix(".DAT").write_bytes(GOOD)
    refused(lambda: read_comtrade(path), "bump.cfg", "bump.DAT and bump.dat")


def test_a_file_that_is_not_there_or_of_another_kind_is_refused(tmp_path):
    refused(lambda: read_comtrade(tmp_path / "bump.cfg"), "bump.cfg", "No such file")
    refused(lambda: read_comtrade(tmp_path / "bump.hdr"), "bump.hdr", ".cfg", ".cff")


CFF = one_file(configuration("BINARY", "2013"), GOOD, "BINARY")
CFF_FAULTS = {
    "no data": (CFF[: CFF.index(b"--- file type: DAT")], ["bump.cff", "DAT"]),
    "no configuration": (CFF.replace(b"type: CFG", b"type: XYZ"), ["bump.cff", "CFG"]),
    "cut off": (CFF[:-1], ["bump.cff", "cut off", str(len(GOOD))]),
    "a damaged line": (CFF.replace(b"1000,30", b"1000;30"), ["bump.cff:27", "'1000;30'"]),
    "data first": (
        b"--- file type: DAT ASCII ---\r\n1,2\r\n" + CFF,
        ["bump.cff", "CFG"],
    ),
}


@pytest.mark.parametrize("fault", CFF_FAULTS)
def test_a_damaged_single_file_is_refused_by_its_place(tmp_path, fault):
    data, named = CFF_FAULTS[fault]
    (tmp_path / "bump.cff").write_bytes(data)
    refused(lambda: read_comtrade(tmp_path / "bump.cff"), *named)


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
@given(damage(), st.sampled_from(["cfg", "dat", "cff"]))
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_whatever_is_damaged_only_record_errors_come_out(tmp_path, form, apply, part):
    lines, data = configuration(form, "2013"), samples(form)
    contents = {
        "cfg": text(lines),
        "dat": data,
        "cff": one_file(lines, data, form, size=False),
    }
    contents[part] = apply(contents[part])
    for suffix, content in contents.items():
        (tmp_path / f"bump.{suffix}").write_bytes(content)
    with suppress(RecordError):
        everything(read_comtrade(tmp_path / f"bump.{part}"))
