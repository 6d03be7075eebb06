"""Disks that are full and places that nobody may write: one message, and all files as they were."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
from writers import FIT_BEFORE, WRITERS

from exfit.util import files

TOO_LONG = 300 * "a"  # most systems take names of 255 characters
FULL = (errno.ENOSPC, "No space left on device")
READ_ONLY = (errno.EROFS, "Read-only file system")
FEW = ("simulate", "new", "import")  # the others take longer
LATER = 3  # writes after which a disk is full

pytestmark = [pytest.mark.usefixtures("in_prepared_folder"), pytest.mark.pixels]


@pytest.fixture
def done(run, prepared_folder):
    """Return a function that runs a command once, and what it reads of a fit before that."""

    def command(name):
        if "fit/parameters.yaml" in WRITERS[name] or "fit" in WRITERS[name][1:]:
            assert Path("fit").is_dir() or run(*FIT_BEFORE).code in (0, 3)
        assert run(*WRITERS[name]).code in (0, 3)
        return state(prepared_folder)

    return command


def state(folder):
    """Return what changes when a file is replaced, of all files of a folder."""
    paths = (Path(root, name) for root, _, names in os.walk(folder) for name in names)
    return {path: (path.stat().st_ino, path.read_bytes()) for path in paths}


def refusing(monkeypatch, fault, at=1):
    """Have every write fail from one of them on, the file half written."""
    real, count = files._write_new, []

    def write(path, data):
        count.append(path)
        if len(count) >= at:
            path.write_bytes(data[: len(data) // 2])
            raise OSError(*fault)
        real(path, data)

    monkeypatch.setattr(files, "_write_new", write)
    return count


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("simulate", READ_ONLY),
        *((name, FULL) for name in FEW),
        *(pytest.param(name, FULL, marks=pytest.mark.long) for name in WRITERS if name not in FEW),
    ],
)
def test_a_place_that_takes_nothing_leaves_all_files_as_they_were(
    run, done, prepared_folder, monkeypatch, name, fault
):
    before = done(name)
    with monkeypatch.context() as patch:
        refusing(patch, fault)
        ran = run(*WRITERS[name])
    assert ran.code == 1
    assert ran.err.endswith(f": cannot be written: {fault[1]}\n")
    assert state(prepared_folder) == before


@pytest.mark.long
@pytest.mark.parametrize("name", WRITERS)
def test_a_disk_that_becomes_full_leaves_no_half_of_a_file(
    run, done, prepared_folder, monkeypatch, name
):
    before = done(name)
    with monkeypatch.context() as patch:
        writes = refusing(patch, FULL, LATER)
        ran = run(*WRITERS[name])
    assert ran.code == 1 if len(writes) >= LATER else ran.code in (0, 3)
    assert set(state(prepared_folder)) == set(before)  # no temporary file, and none is gone


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
@pytest.mark.parametrize(("bytes_", "code"), [(0, 1), (30_000, 0)])
def test_the_system_s_own_limit_costs_the_figures_that_exceed_it_or_all(tmp_path, bytes_, code):
    """A limit on the size of files is what a full disk is to a program: the numbers come first."""
    limited = (
        "import resource, sys; from exfit.cli import main; "
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({bytes_}, {bytes_})); main()"
    )
    ran = subprocess.run(
        [sys.executable, "-c", limited, "simulate", "case.yaml", "-o", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == code, ran.stderr
    assert "Traceback" not in ran.stderr
    assert "cannot be written: File too large" in ran.stderr
    left = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert left == ({"response.csv"} if code == 0 else set())


@pytest.mark.parametrize(
    "arguments",
    [
        ("fit", TOO_LONG),
        ("inspect", TOO_LONG),
        ("report", TOO_LONG),
        ("import", "unit.dyr", "-o", TOO_LONG),
        ("simulate", "case.yaml", "--no-plots", "-o", TOO_LONG),
    ],
    ids=" ".join,
)
def test_what_the_system_refuses_of_a_name_is_a_message(run, arguments):
    ran = run(*arguments)
    assert ran.code == 1
    assert ran.err.splitlines()[-1].endswith(os.strerror(errno.ENAMETOOLONG))


def test_a_file_cannot_be_in_a_file(run):
    ran = run("import", "unit.dyr", "-o", "case.yaml/unit.yaml")
    assert ran.code == 1
    assert ran.err.endswith("case.yaml/unit.yaml: cannot be written: Not a directory\n")


@pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot be removed there")
@pytest.mark.parametrize(
    ("name", "code"), [("models", 0), ("run", 1), ("import", 1), ("simulate", 1)]
)
def test_a_working_folder_that_is_gone_is_a_message_where_it_matters(
    run, prepared_folder, tmp_path, name, code
):
    gone = tmp_path / "gone"
    gone.mkdir()
    os.chdir(gone)
    gone.rmdir()
    arguments = {
        "models": (),
        "run": (prepared_folder / "case.yaml", "--no-plots"),
        "import": (prepared_folder / "unit.dyr", "-o", "unit.yaml"),
        "simulate": (prepared_folder / "case.yaml", "--no-plots"),
    }[name]
    ran = run(name, *arguments)
    assert ran.code == code
    assert len(ran.err.splitlines()) == code
