"""Parquet files, as pyarrow writes them: columns of numbers and timestamps, nulls where none is."""

import hashlib
import sys
from contextlib import suppress
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from decimal import Decimal

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from pyarrow.parquet import write_table
from tables import damage, everything, in_this_process, refused
from tiers import few_of

from exfit.errors import RecordError
from exfit.records.formats import open_table
from exfit.records.formats import parquet as parquet_files

read_parquet = in_this_process(parquet_files.read)

T = [0.0, 0.1, 0.2]
UT = [15.75, 15.8, 15.85]
START = datetime(2015, 9, 20, 23, 59, 59, 999_000)
INSTANTS = [START + at * timedelta(microseconds=800) for at in range(3)]


@pytest.fixture
def parquet(tmp_path):
    """Return a function that writes columns to a file."""

    def write(columns, **options):
        path = tmp_path / "bump.parquet"
        table = columns if isinstance(columns, pa.Table) else pa.table(columns)
        write_table(table, path, **options)
        return path

    return write


@pytest.mark.parametrize(
    "options",
    [{}, {"compression": "zstd"}, {"row_group_size": 1}, {"use_dictionary": False}],
    ids=str,
)
def test_columns_are_read_as_they_stand(parquet, options):
    path = parquet({"t": T, "Ut [kV]": UT}, **options)
    table = read_parquet(path)
    assert table.names == ("t", "Ut [kV]")
    assert table.clock == ("t",)
    assert table.units == {"Ut [kV]": "kV"}
    assert table.numbers(["Ut [kV]"])["Ut [kV]"].tolist() == UT
    assert table.instants(["t"]).tolist() == T
    assert table.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert table.place(1).endswith("bump.parquet: row 2")


KINDS = {
    "int8": pa.array([1, 2, 3], pa.int8()),
    "uint64": pa.array([1, 2, 3], pa.uint64()),
    "float16": pa.array(np.array([1, 2, 3], np.float16)),
    "float32": pa.array([1, 2, 3], pa.float32()),
    "decimal": pa.array([Decimal(1), Decimal(2), Decimal(3)]),
    "dictionary": pa.array([1.0, 2.0, 3.0]).dictionary_encode(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_numbers_of_every_kind_become_float64(parquet, kind):
    column = read_parquet(parquet({"x": KINDS[kind]})).numbers(["x"])["x"]
    assert column.dtype == np.float64
    assert column.tolist() == [1.0, 2.0, 3.0]


def test_truth_values_are_zero_and_one(parquet):
    column = read_parquet(parquet({"x": [True, False, None]})).numbers(["x"], frozenset("x"))["x"]
    np.testing.assert_array_equal(column, [1.0, 0.0, np.nan])


def test_a_null_is_a_missing_sample(parquet):
    table = read_parquet(parquet({"x": [1.0, None, 3.0], "i": [1, None, 3], "n": pa.nulls(3)}))
    for name in ("x", "i"):
        np.testing.assert_array_equal(
            table.numbers([name], frozenset([name]))[name], [1, np.nan, 3]
        )
        refused(lambda name=name: table.numbers([name]), "bump.parquet: row 2", repr(name), "miss")
    assert np.isnan(table.numbers("n", frozenset("n"))["n"]).all()


def test_the_unit_of_the_metadata_counts_before_that_of_the_name(parquet):
    schema = pa.schema([pa.field("t [ms]", pa.float64(), metadata={"unit": "s"})])
    table = read_parquet(parquet(pa.table([T], schema=schema)))
    assert table.units == {"t [ms]": "s"}
    refused(lambda: table.instants(["t [ms]"], "ms"), "'t [ms]'", "in s", "not in ms")


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_timestamps_count_from_the_first_to_their_last_digit(parquet, unit, zone):
    step = {"ms": 10**6, "us": 10**3, "ns": 1}[unit]
    ticks = np.array([0, 1, 4_800_000_001]) + 1_442_746_302_858 * (10**6 // step)
    column = pa.array(ticks, pa.timestamp(unit, zone))
    time = read_parquet(parquet({"ts": column})).instants(["ts"])
    np.testing.assert_allclose(time, [0.0, step * 1e-9, 4_800_000_001 * step * 1e-9], rtol=1e-13)


@pytest.mark.parametrize("kind", [pa.time64("us"), pa.duration("us")], ids=str)
def test_date_and_time_stand_in_two_columns(parquet, kind):
    since = [timedelta(seconds=86399, microseconds=999_000), timedelta(), timedelta(seconds=2)]
    of_day = (
        [(datetime.min + duration).time() for duration in since]
        if pa.types.is_time(kind)
        else since
    )
    days = [date(2015, 9, 20), date(2015, 9, 21), date(2015, 9, 21)]
    table = read_parquet(parquet({"Date": days, "Time": pa.array(of_day, kind)}))
    np.testing.assert_allclose(table.instants(table.clock), [0, 0.001, 2.001], rtol=0, atol=1e-9)


def test_timestamps_are_the_time_also_behind_a_count(parquet):
    table = read_parquet(parquet({"N": [1, 2, 3], "When": INSTANTS, "Ut": UT}))
    assert table.clock == ("When",)
    assert read_parquet(parquet({"N": [1, 2, 3], "Ut": UT[::-1]})).clock == ("N",)


def test_a_missing_instant_is_refused(parquet):
    table = read_parquet(parquet({"ts": [INSTANTS[0], None]}))
    refused(lambda: table.instants(["ts"]), "bump.parquet: row 2", "'ts'", "missing")


@pytest.mark.parametrize("kind", ["M8[us]", float])
def test_a_column_whose_samples_a_damaged_file_lacks_is_refused(parquet, kind):
    table = read_parquet(parquet({"ts": INSTANTS}))
    without = replace(table, fetch=lambda _: np.array([], kind))
    for read in (without.instants, without.numbers):
        refused(lambda read=read: read(["ts"]), "bump.parquet", "column 'ts' has no samples")


OTHERS = {
    "text": ["15,75", "15,8"],
    "lists": [[1.0], [2.0]],
    "structs": [{"a": 1}, {"a": 2}],
    "bytes": [b"1", b"2"],
}


@pytest.mark.parametrize("kind", OTHERS)
def test_what_is_no_number_is_refused_when_it_is_requested(parquet, kind):
    table = read_parquet(parquet({"t": [0.0, 1.0], "x": OTHERS[kind]}))
    assert table.numbers(["t"])["t"].tolist() == [0.0, 1.0]
    refused(lambda: table.numbers(["x"]), "bump.parquet", "'x'", "not numbers")


def test_timestamps_are_no_numbers(parquet):
    table = read_parquet(parquet({"ts": INSTANTS, "tod": [time(1), time(2), time(3)]}))
    refused(lambda: table.numbers(["ts"]), "'ts'", "timestamps")
    refused(lambda: table.numbers(["tod"]), "'tod'", "timestamps")


def test_a_year_beyond_nanoseconds_is_refused(parquet):
    table = read_parquet(parquet({"ts": [datetime(9999, 1, 1), datetime(9999, 1, 2)]}))
    refused(lambda: table.instants(["ts"]), "bump.parquet", "'ts'", "out of bounds")


def test_a_name_of_two_columns_is_refused_when_it_is_requested(parquet):
    path = parquet(pa.table([T, UT, UT], names=["t", "x", "x"]))
    refused(lambda: read_parquet(path).numbers(["x"]), "'x'", "2 and 3")


def test_only_the_columns_requested_are_read(parquet):
    path = parquet({"t": T, "Ut": UT}, compression="none", use_dictionary=False)
    data = path.read_bytes()
    at = data.index(np.array(UT).tobytes())
    table = read_parquet(path)
    path.write_bytes(data[: at - 20] + bytes(20) + data[at:])  # the page's header
    assert table.numbers(["t"])["t"].tolist() == T
    refused(lambda: table.numbers(["Ut"]), "bump.parquet", "damaged")


def test_a_page_that_does_not_fit_its_checksum_is_refused(parquet):
    path = parquet({"Ut": UT}, compression="none", use_dictionary=False, write_page_checksum=True)
    data = path.read_bytes()
    at = data.index(np.array(UT).tobytes())
    path.write_bytes(data[:at] + bytes(8) + data[at + 8 :])
    refused(lambda: read_parquet(path).numbers(["Ut"]), "bump.parquet", "damaged")


def test_a_file_of_another_kind_or_without_samples_is_refused(parquet, tmp_path):
    path = tmp_path / "bump.parquet"
    for content in (b"", b"t,vt\n0,1\n", b"PAR1" + bytes(20) + b"PAR1"):
        path.write_bytes(content)
        refused(lambda: read_parquet(path), "bump.parquet", "damaged")
    refused(lambda: read_parquet(parquet({"t": pa.array([], pa.float64())})), "no samples")
    refused(lambda: read_parquet(tmp_path / "none.parquet"), "none.parquet", "No such file")


def test_a_file_that_is_cut_off_is_refused(parquet):
    path = parquet({"t": T})
    path.write_bytes(path.read_bytes()[:-9])
    refused(lambda: read_parquet(path), "bump.parquet", "damaged")


def test_the_missing_package_is_named_with_its_extra(parquet, monkeypatch):
    path = parquet({"t": T})
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    refused(lambda: read_parquet(path), "bump.parquet", 'pip install "exfit[parquet]"')


@pytest.mark.long
@pytest.mark.parametrize("compression", few_of(["none", "snappy"], 1))
@given(damage())
@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_whatever_is_damaged_only_record_errors_come_out(parquet, compression, apply):
    columns = {"t": T, "ts": INSTANTS, "x": [1, None, 3], "s": ["a", "b", "c"]}
    path = parquet(columns, compression=compression)
    path.write_bytes(apply(path.read_bytes()))
    with suppress(RecordError):
        everything(open_table(path))
