"""Terminals of any size and kind get all that is printed, and end no command."""

import os
import subprocess
import sys

import pytest
from places import CONFIGS

CASE = CONFIGS / "first_order.yaml"
SIZES = ["0", "1", "20", "10000", "-5", "many", ""]
KINDS = {
    "dumb": {"TERM": "dumb"},
    "unknown": {"TERM": "no-such-terminal"},
    "without a name": {"TERM": ""},
    "without colour": {"NO_COLOR": "1"},
    "of a CI": {"CI": "true"},
    "coloured": {"FORCE_COLOR": "1"},
    "of one line": {"LINES": "1"},
    "of no lines": {"LINES": "0"},
}
LAST = "free in the case of `exfit new`: KA, TA, TE, KF, TF, KC, KD"
PATIENCE = 60  # s


@pytest.mark.parametrize("columns", SIZES)
def test_a_terminal_of_any_width_shows_all_words(run, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    ran = run("models", "AC1A")
    assert (ran.code, ran.err) == (0, "")
    assert " ".join(ran.out.split()).endswith(LAST)


@pytest.mark.parametrize("kind", KINDS)
def test_a_terminal_of_any_kind_ends_no_command(run, monkeypatch, kind):
    for name, value in KINDS[kind].items():
        monkeypatch.setenv(name, value)
    ran = run("check", CASE)
    assert (ran.code, ran.err) == (0, "")
    assert "halving the steps" in ran.out


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="terminals of POSIX")
@pytest.mark.parametrize(
    "settings",
    [
        {"TERM": "dumb"},
        {"TERM": "no-such-terminal", "COLUMNS": "20", "LINES": "1"},
        {"COLUMNS": "0", "LINES": "0", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": ""},
    ],
    ids=str,
)
def test_a_fit_on_a_real_terminal_ends_well(tmp_path, settings):
    """A terminal shows iterations while they run, which a pipe does not."""
    import pty

    terminal, end = pty.openpty()
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "exfit",
            "fit",
            str(CASE),
            "--search=local",
            "--no-plots",
            "-o",
            "out",
        ],
        cwd=tmp_path,
        env={**os.environ, "PYTHONCOERCECLOCALE": "0", **settings},
        stdin=end,
        stdout=end,
        stderr=end,
    )
    os.close(end)
    printed = b""
    try:
        while part := os.read(terminal, 100_000):
            printed += part
    except OSError:  # what Linux has for the end of a terminal
        pass
    finally:
        os.close(terminal)
    assert process.wait(PATIENCE) == 0, printed
    assert b"Traceback" not in printed
    assert b"verdict:" in printed
    assert (tmp_path / "out" / "result.json").is_file()
