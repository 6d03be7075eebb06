"""Code that a case names runs only once its user has trusted it, whichever command meets it."""

import contextlib
import json
import shutil
import signal
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from commands import COMMANDS
from places import ROOT, SAMPLES

from exfit.cli import trusting
from exfit.util import trust

MODEL = ROOT / "exfit" / "models" / "exciters" / "first_order.py"
RECORD = {"file": "up.csv", "time": "t", "channels": {"vt": "v"}}
NAMED = {"model": "own.py", "plant": {"type": "none"}}
PROGRAM = {
    "plant": {"type": "external", "command": [sys.executable, "starts.py"]},
    "test": {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]},
}
FMU = {**PROGRAM, "plant": {"type": "fmu", "file": "unit.fmu"}}
OPTIONS = ("--no-plots", "-q")
# of each command, with each case {} that names code
COMMANDS_OF_CASES = {
    "fit": ("{}.yaml", *OPTIONS),
    "batch": ("{}.yaml", "-o", "fleet", "--workers", "1", "-q"),
    "run": ("{}.yaml", *OPTIONS),
    "simulate": ("{}.yaml", *OPTIONS),
    "validate": ("{}.yaml", "--parameters", "{}-values.yaml", *OPTIONS),
    "profile": ("{}.yaml", *OPTIONS),
    "check": ("{}.yaml",),
    "identify": ("{}.yaml", *OPTIONS),
    "rank": ("{}.yaml", "--models", "AC1A", *OPTIONS),
    "app": ("{}.yaml", "--no-browser"),
}
# of the others, with a result whose case and model are a stranger's
OTHERS = {
    "inspect": [("up.csv", *OPTIONS)],
    "import": [("unit.dyr", "-o", "imported.yaml")],
    "new": [
        ("--record", "bump.csv", "--model", "own.py", "--step", "0.05", "-o", "new.yaml"),
        ("--record", "bump.csv", "--model", "AC1A", "--machine-from", "unit.yaml", "--step", "0.05",
         "-o", "other.yaml"),
    ],
    "verify": [("bump.csv", "--model", "own.py", "--step", "0.05")],
    "show": [("fitted",)],
    "compare": [("fitted", "fitted", *OPTIONS)],
    "export": [("fitted", "-o", "unit2.dyr"), ("fitted", "--plb", "unit.plb")],
    "report": [("fitted",)],
    "translate": [("fitted", "--model", model, *OPTIONS) for model in ("own.py", "AC1A")],
    "models": [("own.py",)],
    "trust": [()],
    "schema": [()],
}  # fmt: skip


@pytest.fixture
def stranger(run, empty_folder, monkeypatch):
    """Work in a folder that somebody else has made: code that leaves a canary, a result with it."""
    place = empty_folder / "canary"
    code = f"from pathlib import Path\nPath({str(place)!r}).touch()\n"
    (empty_folder / "own.py").write_text(MODEL.read_text(encoding="utf-8") + code, encoding="utf-8")
    (empty_folder / "starts.py").write_text(code, encoding="utf-8")
    (empty_folder / "unit.fmu").write_bytes(b"PK")
    rows = "".join(f"{t},{v}\n" for t, v in zip(TIME, TRUTH, strict=True))
    (empty_folder / "up.csv").write_text("t,v\n" + rows, encoding="utf-8")
    shutil.copy(SAMPLES / "ac1a_up.csv", empty_folder / "bump.csv")
    shutil.copy(SAMPLES / "unit.dyr", empty_folder)
    outside = {"parameters": {"free": {"K": {"start": 1.0, "min": 0.1, "max": 9.0}}}}
    unit = {"plant": {"type": "open-circuit", "machine": "GENROU", "parameters": {"Tpd0": 5.5}}}
    for name, own in {
        "own": NAMED, "program": {**PROGRAM, **outside}, "fmu": {**FMU, **outside},
        "unit": {**NAMED, **unit, "test": {"vt0": 1.0}},
    }.items():  # fmt: skip
        content = {**FIRST_ORDER, "record": RECORD, "given": "exact", **own}
        if name in ("program", "fmu"):
            del content["model"]
        (empty_folder / f"{name}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
        values = "k: 3.0, a: 2.0" if "model" in content else "K: 2.0"
        (empty_folder / f"{name}-values.yaml").write_text(f"parameters: {{{values}}}\n")
    assert run("fit", "own.yaml", *OPTIONS, "-o", "fitted").code == 0
    assert place.exists()
    place.unlink()
    monkeypatch.setenv("EXFIT_CONFIG", str(empty_folder.parent / "configuration"))
    return place


def test_every_command_is_tried():
    assert {*COMMANDS_OF_CASES, *OTHERS} == {*COMMANDS}


@pytest.mark.parametrize("case", ["own", "program", "fmu"])
def test_no_command_runs_what_a_stranger_s_case_names(run, stranger, case):
    for name, arguments in COMMANDS_OF_CASES.items():
        ran = run(name, *(word.replace("{}", case) for word in arguments))
        assert not stranger.exists(), name
        assert "Traceback" not in ran.err
        starts = case == "own" or name not in ("identify", "rank")  # which start no program
        if starts:
            assert ran.code == 1, (name, ran)
            assert "exfit trust" in " ".join(ran.err.split()), (name, ran.err)


def test_no_command_runs_what_a_stranger_s_result_names(run, stranger):
    for name, tries in OTHERS.items():
        for arguments in tries:
            ran = run(name, *arguments)
            assert not stranger.exists(), (name, arguments)
            assert ran.code in (0, 1, 3), (name, ran.err)
            if "own.py" in arguments:
                assert ran.code == 1
                assert "exfit trust" in ran.err
            if "--machine-from" in arguments:
                assert ran.code == 0, ran.err
                assert yaml.safe_load(Path("other.yaml").read_text())["plant"]["parameters"]["Tpd0"]


def test_what_is_trusted_once_runs_until_it_changes(run, stranger):
    ran = run("simulate", "own.yaml", *OPTIONS, "--trust")
    assert ran.code == 0
    assert "runs own.py, trusted from now on" in ran.err
    assert stranger.exists()
    assert run("simulate", "own.yaml", *OPTIONS) == (0, "", "")
    assert "own.py" in run("trust").out
    with Path("own.py").open("a", encoding="utf-8") as file:
        file.write("# changed\n")
    assert run("simulate", "own.yaml", *OPTIONS).code == 1
    assert run("trust", "own.py").code == 0
    assert run("simulate", "own.yaml", *OPTIONS).code == 0
    assert run("trust", "--withdraw", "own.py").out == ""
    assert run("simulate", "own.yaml", *OPTIONS).code == 1


def test_a_trusted_folder_is_not_asked_for_again_and_can_be_withdrawn(run, stranger):
    assert run("trust", ".").code == 0
    for text in ("# one\n", "# two\n"):
        with Path("own.py").open("a", encoding="utf-8") as file:
            file.write(text)
        assert run("simulate", "own.yaml", *OPTIONS).code == 0
    Path("link.py").symlink_to("/dev/null")  # what lies elsewhere is not below it
    assert run("models", "link.py").code == 1
    assert run("trust", "--withdraw", ".").code == 0
    assert run("simulate", "own.yaml", *OPTIONS).code == 1
    assert run("trust", "--withdraw", ".").code == 1


def test_a_batch_takes_the_same_trust(run, stranger):
    arguments = ("batch", "own.yaml", "-o", "fleet", "--workers", "1", "-q")
    assert run(*arguments, "--trust").code in (0, 3)
    assert stranger.exists()


def test_a_command_of_the_same_words_in_another_folder_is_another():
    one, other = (trust.Code.of_command(["make"], ROOT / name, ()) for name in ("exfit", "tests"))
    assert one.sha256 != other.sha256


@pytest.mark.parametrize("answer", [True, False])
def test_a_terminal_is_asked(run, stranger, monkeypatch, answer):
    stream = SimpleNamespace(isatty=lambda: True)
    monkeypatch.setattr(trusting, "sys", SimpleNamespace(stdin=stream, stderr=stream))
    monkeypatch.setattr(click, "confirm", lambda *_, **__: answer)
    ran = run("simulate", "own.yaml", *OPTIONS)
    assert f"  own.py\n  in {Path.cwd()}\n  SHA-256 " in ran.err
    assert ran.code == (0 if answer else 1)
    assert stranger.exists() == answer


@pytest.mark.parametrize("interrupted", [True, False])
def test_ctrl_c_at_the_question_is_an_interruption_and_ctrl_d_a_no(
    run, stranger, monkeypatch, interrupted
):
    def ended(*_, **__):
        with contextlib.suppress(KeyboardInterrupt):  # which click turns into the other
            if interrupted:
                signal.raise_signal(signal.SIGINT)
        raise click.Abort

    stream = SimpleNamespace(isatty=lambda: True)
    monkeypatch.setattr(trusting, "sys", SimpleNamespace(stdin=stream, stderr=stream))
    monkeypatch.setattr(click, "confirm", ended)
    ran = run("simulate", "own.yaml", *OPTIONS)
    assert ran.code == (130 if interrupted else 1)
    assert ("Interrupted" if interrupted else "not run: you do not trust it") in ran.err
    assert not stranger.exists()


def test_events_for_programs_stay_json(run, stranger):
    ran = run("fit", "own.yaml", *OPTIONS, "--trust", "--progress", "json")
    assert ran.code == 0
    assert all(json.loads(line)["event"] for line in ran.err.splitlines())


@pytest.mark.skipif(sys.platform == "win32", reason="rights of POSIX")
def test_what_others_could_have_written_trusts_nothing(run, stranger):
    run("trust", "own.py")
    folder = stranger.parents[1] / "configuration" / "trusted"
    (file,) = folder.iterdir()
    file.chmod(0o666)
    assert run("simulate", "own.yaml", *OPTIONS).code == 1
    assert run("trust").out == ""
