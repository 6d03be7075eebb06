"""The process that reads binary files gives the tables that its readers find, and then ends."""

import gc
import hashlib
import subprocess
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest
from oversized_files import xlsx
from pyarrow.parquet import write_table
from scipy.io import savemat
from tables import everything, in_this_process, refused

from exfit.records.formats import child, excel, matlab, open_table, parquet
from exfit.records.inspection import inspect

T = np.arange(50) / 100.0
READERS = {".xlsx": excel, ".mat": matlab, ".parquet": parquet}


@pytest.fixture
def written(tmp_path):
    """Return the paths of a time and a voltage in each kind of file, by suffix."""
    paths = {suffix: tmp_path / f"bump{suffix}" for suffix in READERS}
    paths[".xlsx"].write_bytes(xlsx())
    savemat(paths[".mat"], {"t": T, "vt": np.ones(50), "note": "text"})
    stamps = pa.array(np.arange(50), pa.timestamp("ms"))
    write_table(pa.table({"t": T, "when": stamps, "note": ["x"] * 50}), paths[".parquet"])
    return paths


@pytest.mark.parametrize("suffix", READERS)
def test_a_child_gives_the_table_that_its_reader_finds(written, suffix):
    path = written[suffix]
    there, here = open_table(path), in_this_process(READERS[suffix].read)(path)
    assert there.names == here.names
    assert there.units == here.units
    assert there.stamps == here.stamps
    assert there.clock == here.clock
    assert there.sha256 == here.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert there.place(3) == here.place(3)
    for name, column in everything(here).items():
        assert np.array_equal(everything(there)[name], column)
    for at in range(len(here.names)):
        if here.names[at] != "note":
            assert there.fetch(at).dtype == here.fetch(at).dtype


def test_a_column_that_is_refused_costs_no_other(written):
    table = open_table(written[".parquet"])
    refused(lambda: table.numbers(["note"]), "bump.parquet", "'note'", "not numbers")
    assert table.numbers(["t"])["t"].tolist() == T.tolist()


@pytest.fixture
def started(monkeypatch):
    """Return the processes that are started, in a list that grows."""
    processes = []

    class Noted(subprocess.Popen):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            processes.append(self)

    monkeypatch.setattr(child, "Popen", Noted)
    return processes


def test_a_child_ends_with_its_table(written, started):
    table = open_table(written[".mat"])
    (process,) = started
    assert process.poll() is None
    del table
    gc.collect()
    assert process.poll() is not None


def test_inspection_says_why_a_child_ended_at_a_later_column(written, started):
    table = open_table(written[".mat"])

    def fetch(at):
        if table.names[at] == "vt":
            started[0].kill()
        return table.fetch(at)

    message = refused(lambda: inspect(replace(table, fetch=fetch)), "bump.mat", "damaged")
    assert "the process that read it" in message


def test_a_file_that_takes_too_long_is_refused(written, monkeypatch):
    monkeypatch.setattr(child, "LONGEST", (1e-3, 0.0))
    refused(lambda: open_table(written[".mat"]), "bump.mat", "took longer than 0.001 s")


def test_what_lies_in_the_current_folder_is_not_imported(written, tmp_path, monkeypatch):
    (tmp_path / "numpy.py").write_text("raise SystemExit('not this one')")
    monkeypatch.chdir(tmp_path)
    assert open_table(written[".mat"]).names[0] == "t"
