"""SIGTERM ends every command as Ctrl-C does: files whole, nothing left over, its own exit code."""

import random
import signal
import sys

import pytest
from ended_commands import contents, fault_of, undisturbed
from writers import FIT_BEFORE, WRITERS

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

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX"),
    pytest.mark.usefixtures("in_prepared_folder"),
]


@pytest.fixture
def former_fit(run, prepared_folder, in_prepared_folder, request):
    """Have the fit that some commands read."""
    needed = request.node.callspec.params["name"] not in FEW
    if needed and not (prepared_folder / "fit" / "result.json").is_file():
        assert run(*FIT_BEFORE).code in (0, 3)


@pytest.mark.usefixtures("former_fit")
@pytest.mark.parametrize(
    "name",
    [name if name in FEW else pytest.param(name, marks=pytest.mark.long) for name in WRITERS],
)
def test_sigterm_while_a_file_is_written_waits_until_all_are_whole(
    run, prepared_folder, monkeypatch, name
):
    done = run(*WRITERS[name])
    before = contents(prepared_folder)
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
    assert {*contents(prepared_folder)} == {*before}


@pytest.mark.long
@pytest.mark.usefixtures("former_fit")
@pytest.mark.parametrize("name", MET)
def test_a_signal_at_any_moment_leaves_whole_files_and_the_next_run_clears_the_rest(
    prepared_folder, name
):
    moment = random.Random(f"{SEED} {name}").uniform(0.3, 1.0) * undisturbed(name, prepared_folder)
    assert fault_of(name, MET[name], moment, prepared_folder) == ""
