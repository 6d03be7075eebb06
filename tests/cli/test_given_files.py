"""A file of another kind, or a name that is nearly right: the message says what was meant."""

import json
import os
import shutil

import pytest
from places import CONFIGS, SAMPLES


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with a case, a record, parameters and the result of a fit; work there."""
    shutil.copy(CONFIGS / "ac1a_typical.yaml", tmp_path / "t.yaml")
    shutil.copy(SAMPLES / "ac1a_up.csv", tmp_path / "up.csv")
    (tmp_path / "parameters.yaml").write_text("model: AC1A\nparameters:\n  KA: 400\n")
    (tmp_path / "unit.dyr").write_text("1 'SEXS' 1 0.1 10 100 0.1 0 5 /\n")
    (tmp_path / "fitted").mkdir()
    (tmp_path / "fitted" / "result.json").write_text(json.dumps({"version": 5}))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("fit up.csv", ("a recorder's file, not a case", "exfit new --model NAME --record up.csv")),
        ("simulate up.csv", ("a recorder's file, not a case", "exfit inspect up.csv")),
        ("check fitted", ("the result of a fit, not a case", "exfit report fitted")),
        ("fit unit.dyr", ("a planner's dynamics file, not a case", "exfit import unit.dyr")),
        ("fit parameters.yaml", ("the parameters of a fit, not a case", "--parameters")),
        ("export t.yaml", ("a case, not the result", "t.yaml, then exfit export runs/t-fit")),
        ("report t.yaml", ("a case, not the result", "exfit report runs/t-fit")),
        ("export up.csv", ("a recorder's file, not the result",)),
        ("inspect t.yaml", ("a case, not a recorder's file", "exfit fit t.yaml")),
        ("new --model AC1A --record t.yaml", ("a case, not a recorder's file",)),
        ("import t.yaml", ("a case, not a planner's dynamics file",)),
        ("compare t.yaml t.yaml", ("a case, not a recorder's file",)),
        ("simulate t.yaml --parameters up.csv", ("a recorder's file, not the parameters",)),
        ("fit t.yml", ("t.yml: cannot be read: No such file; did you mean t.yaml?",)),
        ("inspect Up.csv", ("No such file; did you mean up.csv?",)),
        ("inspect upp.csv", ("did you mean up.csv?",)),
        ("import unit.DYRE", ("did you mean unit.dyr?",)),
    ],
)  # fmt: skip
def test_the_message_says_which_command_or_file_was_meant(run, folder, command, words):
    code, out, err = run(*command.split())
    assert (code, out) == (1, "")
    for text in words:
        assert text in err


def test_the_result_of_a_case_that_was_fitted_is_pointed_at(run, folder):
    shutil.copytree(folder / "fitted", folder / "runs" / "t-fit")
    code, _, err = run("report", "t.yaml")
    assert code == 1
    assert "for the result of its fit use exfit report runs/t-fit" in err


def test_a_column_that_differs_in_capitals_alone_is_the_one_meant(run, folder):
    text = (folder / "t.yaml").read_text(encoding="utf-8").replace("../sample_data/ac1a_", "")
    (folder / "t.yaml").write_text(text.replace("vt: vt", "vt: Vt"), encoding="utf-8")
    code, _, err = run("fit", "t.yaml")
    assert code == 1
    assert "no column 'Vt'; did you mean 'vt'? The columns are" in err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes among its files")
@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("a.yaml", "simulate a.yaml"),
        ("a.yaml", "batch a.yaml -o fleet"),
        ("a.yaml", "simulate t.yaml --parameters a.yaml"),
        ("a.dyr", "import a.dyr"),
        ("a.csv", "new --model AC1A --record up.csv --tests a.csv"),
        ("a.csv", "batch a.csv -o fleet"),
        ("a.py", "new --model a.py --record up.csv"),
        ("result.json", "export ."),
    ],
)
def test_a_pipe_is_refused_at_once_whatever_it_stands_for(run, folder, name, command):
    """Nobody writes to it: a command that opened it would wait for ever."""
    os.mkfifo(name)
    ran = run(*command.split())
    assert ran.code == 1
    assert f"{name}: cannot be read: a pipe or a device, not a file" in ran.err + ran.out
