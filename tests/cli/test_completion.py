"""Completion in bash, zsh and fish: the script of each loads, and gives the right answers."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from commands import COMMANDS

import exfit
from exfit.models import (
    GOVERNORS,
    LIMITERS,
    LOAD_CONTROLLERS,
    MACHINE_NAMES,
    MODELS,
    STABILISERS,
)
from exfit.models.machines import MACHINES
from exfit.util.vocabulary import STRATEGIES

pytestmark = pytest.mark.long  # a shell is started for each answer

SHELLS = ("bash", "zsh", "fish")
CASE = {
    "given": "exact",
    "plant": {"type": "open-circuit", "machine": "GENROU", "free": {"Tpd0": {}}},
    "parameters": {"free": {"KA": {}, "KF": {}, "TE": {}}, "fixed": {"KE": 1.0}},
}
HEAVY = ("numpy", "scipy", "pydantic", "rich", "llvmlite", "matplotlib")

# each runs the function that the script of exfit defines, as its shell does, and prints the answers
BASH = """
source {script}
compopt() {{ local IFS=' '; echo "compopt $*"; }}
COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
_exfit_completion exfit
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
ZSH = """
typeset -A _comps
compdef() {{ _comps[$2]=$1 }}
source {script}
(( $+_comps[exfit] )) || echo "not registered"
compadd() {{ print -rl -- ${{(P)@[-1]}} }}
_describe() {{ print -rl -- ${{(P)@[-2]}} }}
_path_files() {{ print -r -- files }}
words=({words}); CURRENT=$#words
_exfit_completion
"""
FISH = """
source {script}
complete -C {line}
"""


@pytest.fixture(params=SHELLS)
def shell(request):
    """Skip a shell that is not installed."""
    if shutil.which(request.param) is None:
        pytest.skip(f"{request.param} is not installed")
    return request.param


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Work in a folder with a case and a record, with exfit on the way of the shell."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(CASE, sort_keys=False))
    (tmp_path / "faulty.yaml").write_text("parameters: [")
    (tmp_path / "record.csv").write_text("t,v\n0,1\n")
    program = tmp_path / "bin" / "exfit"
    program.parent.mkdir()
    program.write_text(
        f"#!/bin/sh\nexec '{sys.executable}' -c "
        '\'from exfit.cli import main; main(prog_name="exfit")\' "$@"\n'
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)
    monkeypatch.setenv("PYTHONPATH", str(Path(exfit.__file__).parent.parent))
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


def ran(*command, **environment):
    found = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env={**os.environ, **environment},
    )
    assert found.stderr == ""
    return found.stdout


def completed(shell, *words):
    """Return what a shell completes where the last word has been begun."""
    Path("script").write_text(ran("exfit", _EXFIT_COMPLETE=f"{shell}_source"))
    quoted = " ".join(f"'{word}'" for word in ("exfit", *words))
    line = f"'{' '.join(('exfit', *words))}'"
    template = {"bash": BASH, "zsh": ZSH, "fish": FISH}[shell]
    program = template.format(script="./script", words=quoted, line=line)
    bare = {"bash": ["--norc"], "zsh": ["-f"], "fish": ["--no-config"]}[shell]
    answers = ran(shell, *bare, "-c", program).splitlines()
    # behind the answers there may be a description
    return [answer.split("\t")[0].split(":")[0] for answer in answers if answer]


def test_commands_are_completed(place, shell):
    assert completed(shell, "mod") == ["models"]
    assert set(completed(shell, "")) == {*COMMANDS}


def test_options_and_strategies_are_completed(place, shell):
    assert "--strategy" in completed(shell, "fit", "--s")
    assert set(completed(shell, "fit", "--strategy", "")) == set(STRATEGIES)


def test_names_of_models_are_completed(place, shell):
    assert sorted(completed(shell, "models", "AC1")) == ["AC11C", "AC1A", "AC1C"]
    assert set(completed(shell, "models", "ac")) == {name for name in MODELS if name[:2] == "AC"}
    assert completed(shell, "models", "PSS2") == ["PSS2B", "PSS2C"]
    assert set(completed(shell, "models", "genro")) == {"GENROU", "GENROE"}
    assert sorted(completed(shell, "new", "--model", "ac1")) == ["AC11C", "AC1A", "AC1C"]
    assert set(completed(shell, "new", "--machine", "GENRO")) == {"GENROU", "GENROE"}


def test_free_parameters_of_the_case_are_completed_once(place, shell):
    assert completed(shell, "profile", "case.yaml", "K") == ["KA", "KF"]
    assert completed(shell, "profile", "case.yaml", "KA", "K") == ["KF"]
    assert completed(shell, "profile", "case.yaml", "machine") == ["machine.Tpd0"]
    assert completed(shell, "profile", "faulty.yaml", "K") == []


def test_parameters_to_set_are_completed_up_to_their_value(place, shell):
    found = completed(shell, "simulate", "case.yaml", "--set", "K")
    assert sorted(found) == ["KA=", "KE=", "KF="]
    assert completed(shell, "simulate", "none.yaml", "--set", "K") == []
    assert completed(shell, "identify", "case.yaml", "--noise", "v") == ["vt="]


@pytest.mark.parametrize("words", [("fit", "ca"), ("validate", "case.yaml", "--record", "re")])
def test_cases_and_records_are_completed_as_files(place, shell, words):
    shown = {
        "bash": ["compopt -o default"],
        "zsh": ["files"],
        "fish": ["case.yaml"] if words[0] == "fit" else ["record.csv"],
    }
    assert completed(shell, *words) == shown[shell]


def test_the_names_of_machines_are_known_without_their_files():
    assert (*MACHINES,) == MACHINE_NAMES


@pytest.mark.parametrize(
    "line", ["exfit ", "exfit models AC", "exfit profile case.yaml K", "exfit fit ~nobody/c K"]
)
def test_an_answer_waits_for_nothing_heavy(place, line):
    code = (
        "import sys\n"
        "from exfit.cli import main\n"
        "try:\n    main(prog_name='exfit')\n"
        "finally:\n    print(*sys.modules, file=sys.stderr)\n"
    )
    words = line.split(" ")
    found = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={
            **os.environ,
            "_EXFIT_COMPLETE": "bash_complete",
            "COMP_WORDS": line,
            "COMP_CWORD": str(len(words) - 1),
        },
    )
    assert "Traceback" not in found.stderr
    loaded = {name.partition(".")[0] for name in found.stderr.split()}
    assert "exfit" in loaded
    assert not loaded & set(HEAVY)


def test_every_model_of_the_catalogue_is_offered(place):
    found = ran(
        "exfit", _EXFIT_COMPLETE="bash_complete", COMP_WORDS="exfit models ", COMP_CWORD="2"
    )
    names = {line.partition(",")[2] for line in found.splitlines()}
    assert names == {*MODELS, *MACHINES, *STABILISERS, *GOVERNORS, *LOAD_CONTROLLERS, *LIMITERS}
