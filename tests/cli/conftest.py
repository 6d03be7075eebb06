"""Fixtures of the tests of commands."""

import pytest
from commands import Ran
from writers import prepare

from exfit import cli


@pytest.fixture
def run(capsys):
    """Return a function that runs a command as the shell does."""

    def command(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main(args=[str(argument) for argument in arguments], prog_name="exfit")
        printed = capsys.readouterr()
        return Ran(int(ended.value.code or 0), printed.out, printed.err)

    return command


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    """Work in an empty folder, in no terminal, 80 columns wide."""
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "80")
    place = tmp_path / "work"
    place.mkdir()
    monkeypatch.chdir(place)
    return place


@pytest.fixture(scope="module")
def prepared_folder(tmp_path_factory):
    """Return a folder with all that the commands read but for a fit."""
    folder = tmp_path_factory.mktemp("place")
    prepare(folder)
    return folder


@pytest.fixture
def in_prepared_folder(prepared_folder, monkeypatch):
    """Work in that folder."""
    monkeypatch.chdir(prepared_folder)
