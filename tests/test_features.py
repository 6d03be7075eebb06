"""Features stand beside the core: known without being imported, and free to be deleted."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from commands import COMMANDS
from places import ROOT

import exfit
from exfit import registry
from exfit.cli import OF_CORE

PACKAGE = Path(exfit.__file__).parent
CASE = ROOT / "configs" / "ac1a_typical.yaml"
EVENT = ROOT / "configs" / "grid_event.yaml"


def run(code, place, *arguments, package=None):
    """Run Python in a folder, with the exfit that lies there or in another one."""
    environment = {**os.environ, "PYTHONPATH": str(package or place)}
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd=place, check=False
    )


MAIN = "from exfit.cli import main; main(prog_name='exfit')"


@pytest.mark.parametrize("feature", registry.features())
def test_whatever_a_feature_names_is_there(feature):
    module = registry.features()[feature]
    plugs = [name for name in vars(module) if name.isupper()]
    for plug in plugs:
        if plug != "COMMANDS":
            assert all(part.load() is not None for part in registry.parts(plug).values()), plug


def test_every_command_stands_in_one_group_with_the_help_that_it_has_itself():
    known = {**OF_CORE, **registry.commands()}
    assert known.keys() == COMMANDS.keys()
    assert {name: each.help for name, each in known.items()} == {
        name: command.get_short_help_str(200) for name, command in COMMANDS.items()
    }


@pytest.mark.parametrize(
    "arguments", [["--help"], ["simulate", CASE, "--no-plots", "-q", "-o", "x"]]
)
def test_help_and_a_simulation_import_nothing_of_a_feature_but_its_tables(arguments, tmp_path):
    code = f"import atexit, sys; atexit.register(lambda: print(*sys.modules)); {MAIN}"
    done = run(code, tmp_path, *arguments, package=PACKAGE.parent)
    loaded = {name for name in done.stdout.split() if name.startswith("exfit.features.")}
    assert done.returncode == 0, done.stderr
    assert loaded <= {f"exfit.features.{name}" for name in registry.features()}


def test_without_features_the_core_fits_simulates_and_validates(tmp_path):
    shutil.copytree(
        PACKAGE, tmp_path / "exfit", ignore=shutil.ignore_patterns("features", "__pycache__")
    )
    for arguments in (
        ["--help"],
        ["fit", CASE, "--search", "local", "--no-plots", "-q", "-o", "fit"],
        ["simulate", CASE, "--no-plots", "-q", "-o", "simulated"],
        ["validate", CASE, "--parameters", "fit", "--no-plots", "-q", "-o", "validated"],
    ):
        done = run(MAIN, tmp_path, *arguments)
        assert done.returncode == 0, (arguments, done.stdout, done.stderr)
    assert (tmp_path / "fit" / "parameters.yaml").is_file()
    unknown = run(MAIN, tmp_path, "batch", CASE)
    assert unknown.returncode == 2
    assert "No such command 'batch'" in unknown.stderr
    event = run(MAIN, tmp_path, "validate", EVENT, "--as-found", "--no-plots")
    assert event.returncode == 1
    assert "grid-playback: this installation of exfit has no such plant" in event.stderr
    programme = tmp_path / "programme.yaml"
    programme.write_text(Path(CASE).read_text("utf-8") + "\ntests: [{name: up}]\n", "utf-8")
    refused = run(MAIN, tmp_path, "simulate", str(programme), "--no-plots")
    assert refused.returncode == 1
    assert "tests: unknown key" in refused.stderr
