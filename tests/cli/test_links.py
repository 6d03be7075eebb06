"""No command writes through a link that leads out of the folder that it writes to."""

import shutil
import sys
from pathlib import Path

import pytest
from commands import COMMANDS
from ended_commands import contents
from writers import FIT_BEFORE, WRITERS, prepare

FEW = ("simulate", "import", "models", "check")  # the others take longer
ALL = WRITERS | {
    "batch": (*WRITERS["batch"], "--reports"),
    "verify": ("verify", "record.csv", "--model", "AC1A", "--step", "0.05", "--force",
               "-o", "verified.html"),
    "models": ("models", "AC1A", "--plot", "drawn"),
    "check": ("check", "old.yaml", "--write"),
}  # fmt: skip
OLD = "model: FIRST_ORDER\nplant: {type: none}\nparameters: {fixed: {k: 1}, sources: {k: test}}\n"
SILENT = {"show", "schema", "trust"}  # they write nothing, or where the user's settings are

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need a right there")


def test_every_command_that_writes_is_tried():
    assert {arguments[0] for arguments in ALL.values()} == set(COMMANDS) - SILENT


def run_among_links(run, name, outside):
    """Run a command and return what it said; nothing may have changed outside."""
    before = contents(outside)
    ran = run(*ALL[name])
    assert contents(outside) == before
    assert ran.code in (0, 1, 3)
    assert "Traceback" not in ran.err
    assert ran.code != 1 or "a link leads out of" in ran.err, ran.err
    return ran


@pytest.mark.usefixtures("in_prepared_folder")
@pytest.mark.parametrize(
    "name", [name if name in FEW else pytest.param(name, marks=pytest.mark.long) for name in ALL]
)
def test_nothing_is_written_through_links(run, prepared_folder, tmp_path, name):
    """Links in place of each file, dangling and not, and in place of each folder below the top."""
    if "fit/parameters.yaml" in ALL[name] or "fit" in ALL[name][1:]:
        assert Path("fit").is_dir() or run(*FIT_BEFORE).code in (0, 3)
    Path("old.yaml").write_text(OLD, encoding="utf-8")
    before = contents(prepared_folder)
    assert run(*ALL[name]).code in (0, 1, 3)
    after = contents(prepared_folder)
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
