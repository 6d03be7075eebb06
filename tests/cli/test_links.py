"""No command writes through a link that leads out of the folder that it writes to."""

import shutil
import sys
from pathlib import Path

import pytest
from ended_commands import contents
from writers import EVERY, prepare

from exfit.features.start.command import keep
from exfit.util.trust import Code

FEW = ("simulate", "import", "models", "check")  # the others take longer
SILENT = {"show", "schema", "trust"}  # they write nothing, or where the user's settings are
ALL = {name: arguments for name, arguments in EVERY.items() if name not in SILENT}

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need a right there")


def run_among_links(run, name, outside):
    """Run a command and return what it said; nothing may have changed outside."""
    before = contents(outside)
    ran = run(*ALL[name])
    assert contents(outside) == before
    assert ran.code in (0, 1, 3)
    assert "Traceback" not in ran.err
    assert ran.code != 1 or "a link leads out of" in ran.err, ran.err
    return ran


@pytest.mark.parametrize(
    "name", [name if name in FEW else pytest.param(name, marks=pytest.mark.long) for name in ALL]
)
def test_nothing_is_written_through_links(run, folder_of_all, tmp_path, monkeypatch, name):
    """Links in place of each file, dangling and not, and in place of each folder below the top."""
    monkeypatch.chdir(folder_of_all)
    before = contents(folder_of_all)
    assert run(*ALL[name]).code in (0, 1, 3)
    after = contents(folder_of_all)
    written = [path for path in after if after[path] != before.get(path)]
    assert written
    outside = tmp_path / "outside"
    folders = {above for path in written for above in path.parents if len(above.parts) > 1}
    kinds = (0, 1) if len(written) == 1 else (0,)  # of several files every second link dangles
    for kind in kinds:
        shutil.rmtree(outside, ignore_errors=True)
        outside.mkdir()
        for number, path in enumerate(written, kind):
            target = outside / f"{number}{path.suffix}"
            if number % 2 == 0:
                target.write_bytes(before.get(path) or after[path])
            path.unlink(missing_ok=True)
            path.symlink_to(target)
        if path.exists() or name != "check":  # without a case there is nothing to check
            run_among_links(run, name, outside)
        for path in written:
            if path.is_symlink():
                path.unlink()
    for folder in folders:
        shutil.rmtree(outside)
        shutil.copytree(folder, outside)
        shutil.rmtree(folder)
        folder.symlink_to(outside)
        run_among_links(run, name, outside)
        folder.unlink()


@pytest.mark.parametrize("top", ["runs", "fitted"])
def test_the_folder_of_all_runs_and_what_is_named_may_be_links(run, empty_folder, tmp_path, top):
    prepare(empty_folder)
    (tmp_path / "disk").mkdir()
    Path(top).symlink_to(tmp_path / "disk")
    options = ("-o", "fitted") if top == "fitted" else ()
    assert run("simulate", "case.yaml", "--no-plots", *options).code == 0
    assert [*(tmp_path / "disk").rglob("response.csv")]


def test_a_run_below_the_folder_of_all_runs_may_not(run, empty_folder, tmp_path):
    prepare(empty_folder)
    Path("runs").mkdir()
    (tmp_path / "disk").mkdir()
    Path("runs/case-simulate").symlink_to(tmp_path / "disk")
    ran = run("simulate", "case.yaml", "--no-plots")
    assert ran.code == 1
    assert "case-simulate: not written: a link leads out of runs, to " in ran.err
    assert [*(tmp_path / "disk").iterdir()] == []


def test_answers_are_not_kept_through_a_link(empty_folder, tmp_path):
    target = tmp_path / "outside"
    Path("new.answers.yaml").symlink_to(target)
    kept = keep({"model": "SEXS"}, Path("new.answers.yaml"))
    assert not target.exists()
    assert kept.exists()


@pytest.mark.parametrize("link", ["file", "folder"])
def test_what_is_trusted_is_not_kept_through_a_link(run, empty_folder, tmp_path, monkeypatch, link):
    (tmp_path / "outside").mkdir()
    monkeypatch.setenv("EXFIT_CONFIG", str(empty_folder))
    kept = Path("trusted", f"{Code.of_folder(empty_folder).sha256}.json")
    if link == "folder":
        kept.parent.symlink_to(tmp_path / "outside")
    else:
        kept.parent.mkdir()
        kept.symlink_to(tmp_path / "outside" / "file")
    ran = run("trust", ".")
    assert [*(tmp_path / "outside").iterdir()] == []
    assert ran.code == (1 if link == "folder" else 0), ran.err
