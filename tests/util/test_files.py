"""Files are there whole or not at all, whatever comes between; what is too large is not read."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from exfit.errors import ExfitError
from exfit.util import files
from exfit.util.files import (
    ABANDONED,
    ROOT,
    below,
    on_disk,
    read_json,
    read_limited,
    remove_abandoned,
    write,
    write_together,
    write_whole,
)

OLD = {"a.csv": "old a", "b.csv": "old b", "result.json": "old result"}
NEW = {"a.csv": "new a", "c.csv": "new c", "result.json": "new result"}


@pytest.fixture
def folder(tmp_path):
    """Return a folder in which a former run left its files."""
    for name, content in OLD.items():
        (tmp_path / name).write_text(content)
    return tmp_path


@pytest.fixture
def interruptible():
    """Have interruptions raise KeyboardInterrupt, as in a program that a shell starts."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


def contents(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def failing(at, error, calls):
    """Return what does as Path.replace does, but fails at one of its calls."""
    real = Path.replace

    def replace(self, target):
        calls.append(Path(target).name)
        if len(calls) == at:
            raise error
        return real(self, target)

    return replace


def test_new_files_take_the_place_of_old_ones_and_obsolete_ones_go(folder):
    write_together(folder, NEW, ["b.csv", "never-there.png", "a.csv"])
    assert contents(folder) == NEW


def test_the_main_file_is_the_last_to_change(folder, monkeypatch):
    calls = []
    monkeypatch.setattr(Path, "replace", failing(0, None, calls))
    write_together(folder, NEW)
    assert calls == [*NEW]


def test_a_disk_that_is_full_leaves_all_as_it_was(folder, monkeypatch):
    real = files._write_new

    def full(path, data):
        if data == b"new result":
            path.write_bytes(data[:3])
            raise OSError(28, "No space left on device")
        real(path, data)

    monkeypatch.setattr(files, "_write_new", full)
    with pytest.raises(ExfitError, match="cannot be written: No space left on device"):
        write_together(folder, NEW, ["b.csv"])
    assert contents(folder) == OLD


@pytest.mark.parametrize("failed", [1, 2, 3])
def test_one_file_that_cannot_be_replaced_hinders_no_other(folder, monkeypatch, failed):
    """As on Windows, where a table is open in another program."""
    error = PermissionError(13, "Permission denied")
    monkeypatch.setattr(Path, "replace", failing(failed, error, []))
    name = [*NEW][failed - 1]
    with pytest.raises(ExfitError, match=f"{name}: cannot be written: Permission denied"):
        write_together(folder, NEW)
    expected = {**OLD, **NEW}
    expected.pop(name)
    if name in OLD:
        expected[name] = OLD[name]
    assert contents(folder) == expected


def test_a_folder_in_the_place_of_a_file_is_reported_and_stays(folder):
    (folder / "result.json").unlink()
    (folder / "result.json").mkdir()
    (folder / "b.csv").unlink()
    (folder / "b.csv").mkdir()
    with pytest.raises(ExfitError, match=r"result\.json: cannot be written"):
        write_together(folder, NEW, ["b.csv"])
    assert {path.name for path in folder.iterdir()} == {*OLD, *NEW}
    assert (folder / "c.csv").read_text() == "new c"


@pytest.mark.parametrize("name", [*NEW])
def test_an_interruption_at_any_file_comes_when_all_are_whole(
    folder, monkeypatch, interruptible, name
):
    real = files._write_new

    def interrupted(path, data):
        real(path, data)
        if data == NEW[name].encode():
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(files, "_write_new", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_together(folder, NEW, ["b.csv"])
    assert contents(folder) == NEW


def test_an_interruption_leaves_a_single_file_whole_and_nothing_beside(
    tmp_path, monkeypatch, interruptible
):
    real = files._write_new

    def interrupted(path, data):
        signal.raise_signal(signal.SIGINT)
        real(path, data)

    monkeypatch.setattr(files, "_write_new", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "table.csv", "new")
    assert contents(tmp_path) == {"table.csv": "new"}


def test_a_name_as_long_as_names_may_be_can_be_written(tmp_path):
    write(tmp_path / ("a" * 251 + ".csv"), "new")
    assert [*contents(tmp_path).values()] == ["new"]


def test_the_file_that_a_link_leads_to_is_replaced_not_the_link(tmp_path):
    (tmp_path / "folder").mkdir()
    link, target = tmp_path / "link.dyr", tmp_path / "folder" / "target.dyr"
    try:
        link.symlink_to(target)
    except OSError:
        pytest.skip("links need a right here")
    for content in ("first", "second"):  # the first makes the file
        write(link, content)
        assert link.is_symlink()
        assert contents(tmp_path / "folder") == {"target.dyr": content}


@pytest.mark.skipif(os.name == "nt", reason="no such files there")
def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    """As /dev/stdout, which a file in its place would take from all programs."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write(pipe, "new")
        assert os.read(reader, 10) == b"new"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_files_get_the_rights_that_the_user_gives_new_files(tmp_path):
    (tmp_path / "by-hand").write_text("")
    write(tmp_path / "table.csv", "new")
    write_together(tmp_path, NEW)
    assert {path.stat().st_mode for path in tmp_path.iterdir()} == {
        (tmp_path / "by-hand").stat().st_mode
    }


def ended_process():
    """Return the number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def temporary(folder, process, age=0.0, computer=None):
    """Return a temporary file as a run of a process leaves it when it is killed."""
    path = folder / f".exfit-{computer or files._computer()}-{process}-0123abcd.tmp"
    path.write_text("half")
    then = path.stat().st_mtime - age
    os.utime(path, (then, then))
    return path


@pytest.mark.skipif(os.name == "nt", reason="there a process cannot be asked whether it runs")
@pytest.mark.parametrize("writing", ["one", "several"])
def test_the_next_run_removes_what_a_killed_one_left(tmp_path, writing):
    temporary(tmp_path, ended_process())
    if writing == "one":
        write_whole(tmp_path / "result.json", b"new")
    else:
        write_together(tmp_path, {"result.json": "new"})
    assert contents(tmp_path) == {"result.json": "new"}


def test_files_of_a_run_that_goes_on_and_of_another_computer_stay(tmp_path):
    own = temporary(tmp_path, os.getpid())
    other = temporary(tmp_path, 1, computer="00000000")
    remove_abandoned(tmp_path)
    assert own.is_file()
    assert other.is_file()


def test_a_temporary_file_that_is_a_day_old_goes_whoever_left_it(tmp_path):
    temporary(tmp_path, os.getpid(), age=ABANDONED + 60.0)
    temporary(tmp_path, 1, age=ABANDONED + 60.0, computer="00000000")
    remove_abandoned(tmp_path)
    assert contents(tmp_path) == {}


@pytest.mark.parametrize(
    "name",
    [".exfit", ".exfit-notes.tmp", ".exfit-0-1-2.tmp", "exfit-0123abcd-1-0123abcd.tmp", ".a.12"],
)
def test_files_of_others_stay_however_old_they_are(tmp_path, name):
    (tmp_path / name).write_text("mine")
    os.utime(tmp_path / name, (0.0, 0.0))
    remove_abandoned(tmp_path)
    assert contents(tmp_path) == {name: "mine"}


def test_a_file_is_read_up_to_its_limit(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"x" * 100)
    assert read_limited(path, 100) == b"x" * 100
    with pytest.raises(ExfitError, match=r"larger than 9\.9e-05 MB, the limit of such a file"):
        read_limited(path, 99)


def test_a_file_that_is_too_large_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(files, "LARGEST_FILE", 1_000_000)
    path = tmp_path / "large.json"
    path.write_bytes(b" " * 1_000_001)
    with pytest.raises(ExfitError, match="larger than 1 MB"):
        read_json(path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no such file here")
def test_a_file_without_an_end_is_refused():
    with pytest.raises(ExfitError, match="a pipe or a device"):
        read_json(Path("/dev/zero"))


@pytest.mark.parametrize("name", ["missing", "a\0b", ""])
def test_a_file_that_cannot_be_read_is_named(tmp_path, name):
    with pytest.raises(ExfitError, match="cannot be read: "):
        read_json(tmp_path / name)


@pytest.mark.parametrize("text", ["[]", "1", '"text"', "null"])
def test_the_top_is_a_mapping(tmp_path, text):
    path = tmp_path / "file.json"
    path.write_text(text)
    with pytest.raises(ExfitError, match="not a mapping"):
        read_json(path)


def test_texts_of_any_language_are_read_with_a_mark_at_the_beginning_or_without(tmp_path):
    path = tmp_path / "file.json"
    for text in ('{"unit": "Höllental 😀"}', '\ufeff{"unit": "H\\u00f6llental \\ud83d\\ude00"}'):
        path.write_text(text, encoding="utf-8")
        assert read_json(path) == {"unit": "Höllental 😀"}


@pytest.mark.parametrize(
    ("encoding", "what"),
    [
        ("utf-16-le", "byte 0x00; it is UTF-16"),  # without its mark
        ("utf-16-be", "byte 0x00; it is UTF-16"),
        ("utf-16", "byte 0xff; it is UTF-16"),
        ("latin-1", "byte 0xe4"),
    ],
)
def test_a_text_that_is_not_utf_8_is_refused_with_the_remedy(tmp_path, encoding, what):
    path = tmp_path / "file.json"
    path.write_bytes('{"ä": 1}'.encode(encoding))
    with pytest.raises(ExfitError, match=f":1: not UTF-8 text: {what}: save it as UTF-8$"):
        read_json(path)


def test_without_a_root_a_file_lies_where_its_path_says(monkeypatch):
    monkeypatch.delenv(ROOT, raising=False)
    assert on_disk(Path("../a/../b.csv")) == Path("../a/../b.csv")


def test_with_a_root_every_file_lies_below_it(tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path / "home")
    monkeypatch.setenv(ROOT, str(tmp_path))
    assert on_disk(Path("b.csv")) == tmp_path / "home" / "b.csv"
    assert on_disk(Path("/data/b.csv")) == tmp_path / "data" / "b.csv"


def test_dots_above_the_root_stay_at_the_root(tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path / "home")
    assert below(tmp_path, Path("../../../a.csv")) == tmp_path / "a.csv"
    assert below(tmp_path, Path("a/../b.csv")) == tmp_path / "home" / "b.csv"
    assert below(tmp_path, Path("/data/../a.csv")) == tmp_path / "a.csv"
