"""SIGTERM ends every command as Ctrl-C does: files whole, nothing left over, its own exit code."""

import random
import signal
import sys

import pytest
from ended_commands import contents, fault_of, undisturbed
from writers import FIT_BEFORE, WRITERS, prepare

from exfit.util import files

FEW = ("simulate", "import")  # the others take longer
SEED = 16
MET = {  # tests/studies/interrupts.py sends each of these commands hundreds of all
    "fit": "SIGTERM",
    "run": "SIGTERM",
    "report": "SIGINT",
    "simulate": "SIGKILL",
    "export": "SIGKILL",
}

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Return a folder with all that the commands read but for a fit."""
    place = tmp_path_factory.mktemp("place")
    prepare(place)
    return place


@pytest.fixture(autouse=True)
def there(place, monkeypatch):
    """Work in that folder, with the fit that some commands read."""
    monkeypatch.chdir(place)


@pytest.fixture
def former_fit(run, place, request):
    """Have the fit that some commands read."""
    needed = request.node.callspec.params["name"] not in FEW
    if needed and not (place / "fit" / "result.json").is_file():
        assert run(*FIT_BEFORE).code in (0, 3)


@pytest.mark.usefixtures("former_fit")
@pytest.mark.parametrize(
    "name",
    [name if name in FEW else pytest.param(name, marks=pytest.mark.long) for name in WRITERS],
)
def test_sigterm_while_a_file_is_written_waits_until_all_are_whole(run, place, monkeypatch, name):
    done = run(*WRITERS[name])
    before = contents(place)
    real, raised = files._write_new, []

    def terminated(path, data):
        if not raised:
            raised.append(path)
            path.write_bytes(data[: len(data) // 2])
            signal.raise_signal(signal.SIGTERM)
            path.unlink()
        real(path, data)

    monkeypatch.setattr(files, "_write_new", terminated)
    ran = run(*WRITERS[name])
    assert done.code in (0, 3)
    assert ran.code == 128 + signal.SIGTERM
    assert "Traceback" not in ran.err
    assert {*contents(place)} == {*before}


@pytest.mark.long
@pytest.mark.usefixtures("former_fit")
@pytest.mark.parametrize("name", MET)
def test_a_signal_at_any_moment_leaves_whole_files_and_the_next_run_clears_the_rest(place, name):
    moment = random.Random(f"{SEED} {name}").uniform(0.3, 1.0) * undisturbed(name, place)
    assert fault_of(name, MET[name], moment, place) == ""
