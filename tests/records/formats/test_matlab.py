"""MATLAB files, as SciPy writes them: vectors, matrices and structs become columns by name."""

import hashlib
import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from scipy.io import savemat
from tables import damage, everything, in_this_process, refused
from tiers import few_of

from exfit.errors import RecordError
from exfit.records.formats import matlab, open_table
from exfit.records.formats.table import increases

read_mat = in_this_process(matlab.read)

T = np.arange(6) * 0.01
UT = 15.75 + 0.1 * T
DATA = np.column_stack([UT, 2.0 * UT, -UT])


@pytest.fixture
def mat(tmp_path):
    """Return a function that writes variables to a file."""

    def write(variables, **options):
        path = tmp_path / "bump.mat"
        savemat(path, variables, **options)
        return path

    return write


@pytest.mark.parametrize(
    "options",
    [{"format": "4"}, {"format": "5"}, {"do_compression": True}, {"oned_as": "column"}],
    ids=str,
)
def test_vectors_and_the_columns_of_matrices_are_read_from_every_version(mat, options):
    path = mat({"t": T, "Ut": UT, "data": DATA, "f": 50.0}, **options)
    table = read_mat(path)
    assert table.names == ("t", "Ut", "data(:,1)", "data(:,2)", "data(:,3)")
    assert table.clock == ("t",)
    assert table.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    columns = table.numbers(table.names)
    assert np.array_equal(table.instants(["t"]), T)
    assert np.array_equal(columns["Ut"], UT)
    assert np.array_equal(columns["data(:,3)"], -UT)


@pytest.mark.parametrize("kind", ["int16", "uint8", "float32", "bool"])
def test_numbers_of_every_kind_become_float64(mat, kind):
    values = (T * 100).astype(kind)
    column = read_mat(mat({"x": values})).numbers(["x"])["x"]
    assert column.dtype == np.float64
    assert np.array_equal(column, values)


def test_fields_of_structs_are_called_as_in_matlab(mat):
    inner = {"Ut": UT, "gain": 2.0, "name": "unit 1"}
    table = read_mat(mat({"s": {"time": T, "a": inner}}))
    assert table.names == ("s.time", "s.a.Ut")
    assert table.clock == ("s.time",)
    assert np.array_equal(table.numbers(["s.a.Ut"])["s.a.Ut"], UT)


def test_several_structs_are_counted_from_one(mat):
    several = np.array([(T,), (UT,)], dtype=[("x", "O")])
    table = read_mat(mat({"s": several}))
    assert table.names == ("s(1).x", "s(2).x")


def simulink(*signals):
    structs = np.zeros((1, len(signals)), [("values", "O"), ("dimensions", "O"), ("label", "O")])
    for at, (values, label) in enumerate(signals):
        structs[0, at] = (values, 1, label)
    return {"scope": {"time": T[:, None], "signals": structs, "blockName": "model/Scope"}}


def test_a_structure_with_time_gives_its_signals_by_their_labels(mat):
    table = read_mat(mat(simulink((UT[:, None], "Ut"), (DATA, ""), (DATA[:, :2], "If"))))
    assert table.names == (
        "scope.time",
        "scope.Ut",
        *(f"scope.signals(2).values(:,{at})" for at in (1, 2, 3)),
        "scope.If(:,1)",
        "scope.If(:,2)",
    )
    assert table.clock == ("scope.time",)
    assert np.array_equal(table.numbers(["scope.If(:,2)"])["scope.If(:,2)"], DATA[:, 1])


def test_a_scalar_signal_may_have_three_dimensions(mat):
    table = read_mat(mat(simulink((UT.reshape(1, 1, -1), "Ut"))))
    assert np.array_equal(table.numbers(["scope.Ut"])["scope.Ut"], UT)


def test_a_first_column_that_increases_is_the_time(mat):
    assert read_mat(mat({"data": np.column_stack([T, UT])})).clock == ("data(:,1)",)


def test_units_stand_in_the_names(mat):
    assert read_mat(mat({"t": T, "P_MW": UT})).units == {"P_MW": "MW"}


def test_milliseconds_are_requested_by_their_unit(mat):
    table = read_mat(mat({"t": T * 1e3}))
    np.testing.assert_allclose(table.instants(["t"], "ms"), T, rtol=1e-13)


def test_vectors_of_other_lengths_are_refused_only_together(mat):
    table = read_mat(mat({"t": T, "Ut": UT, "slow": UT[:3]}))
    assert table.numbers(["slow"])["slow"].size == 3
    refused(lambda: table.numbers(["Ut", "slow"]), "bump.mat", "'Ut' has 6", "'slow' has 3")


def test_nan_is_a_missing_sample(mat):
    table = read_mat(mat({"x": np.array([1.0, np.nan, 3.0])}))
    assert np.isnan(table.numbers(["x"], frozenset("x"))["x"]).tolist() == [False, True, False]
    refused(lambda: table.numbers(["x"]), "bump.mat: sample 2", "'x'", "missing")


@pytest.mark.parametrize(
    ("values", "kind"), [(UT + 1j, "complex"), (np.array([["a"], ["b"]]), "text")], ids=["j", "abc"]
)
def test_what_is_no_number_is_refused_when_it_is_requested(mat, values, kind):
    table = read_mat(mat({"t": T, "x": values}))
    name = next(name for name in table.names if name != "t")
    refused(lambda: table.numbers([name]), "bump.mat", repr(name), kind)


def test_a_file_without_vectors_is_refused(mat):
    refused(lambda: read_mat(mat({"f": 50.0, "name": "unit 1"})), "bump.mat", "no vector")


def test_version_7_3_is_refused_with_advice(tmp_path):
    path = tmp_path / "bump.mat"
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512)
    path.write_bytes(head + b"\x89HDF\r\n\x1a\n" + bytes(64))
    refused(lambda: read_mat(path), "bump.mat", "7.3", "'-v7'")


DAMAGED = {"empty": b"", "text": b"t,vt\n0,1\n", "zeros": bytes(200)}


@pytest.mark.parametrize("damaged", DAMAGED)
def test_a_file_of_another_kind_is_refused(tmp_path, damaged):
    path = tmp_path / "bump.mat"
    path.write_bytes(DAMAGED[damaged])
    refused(lambda: read_mat(path), "bump.mat")


def test_a_file_that_is_cut_off_is_refused(mat):
    path = mat({"t": T, "Ut": UT})
    path.write_bytes(path.read_bytes()[:-9])
    refused(lambda: read_mat(path), "bump.mat", "damaged")


FLAGS_OF_FIRST = 128 + 16  # behind the head of the file and two tags


@pytest.mark.parametrize(
    ("at", "new"),
    [(FLAGS_OF_FIRST + 1, b"\x08"), (FLAGS_OF_FIRST + 16, b"\x01\x00\x00\x7f"), (132, b"\xff")],
    ids=["complex without an imaginary part", "more rows than numbers", "longer than the file"],
)
def test_a_layout_that_would_end_python_is_refused(mat, at, new):
    path = mat({"t": T, "Ut": UT})
    data = path.read_bytes()
    path.write_bytes(data[:at] + new + data[at + len(new) :])
    refused(lambda: open_table(path), "bump.mat", "damaged")


MATLABS_OWN = sorted((Path(scipy.io.__file__).parent / "matlab/tests/data").glob("*.mat"))


@pytest.mark.skipif(not MATLABS_OWN, reason="this SciPy came without its tests")
def test_no_file_of_matlab_that_scipy_reads_is_held_for_damaged():
    read = 0
    for path in MATLABS_OWN:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                scipy.io.loadmat(path)
            except Exception:  # some of them are there because they are damaged
                continue
        read += 1
        with suppress(RecordError):
            read_mat(path)
            continue
        refused(lambda path=path: read_mat(path), "no vector")
    assert read > 50


@pytest.mark.long
@pytest.mark.parametrize(
    "options", few_of([{"format": "4"}, {"format": "5"}, {"do_compression": True}], 1), ids=str
)
@given(damage())
@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_whatever_is_damaged_only_record_errors_come_out(tmp_path, options, apply):
    path = tmp_path / "bump.mat"
    fields = {} if options == {"format": "4"} else simulink((UT[:, None], "Ut"))
    savemat(path, {"t": T, "data": DATA} | fields, **options)
    path.write_bytes(apply(path.read_bytes()))
    with suppress(RecordError):
        everything(open_table(path))


def test_several_infinite_numbers_are_no_time(mat):
    table = read_mat(mat({"t": np.append(T[:-2], [np.inf, np.inf])}))
    assert not increases(table, ["t"])
