"""Which commands run the program of a case, and with which of its values."""

import pytest
import yaml
from outside_cases import PROGRAM, written_case
from programmes import written

pytestmark = pytest.mark.long  # fits by a program

MARKER = "from pathlib import Path\nPath(__file__).with_name('started').touch()\n"
CHANGED = "not run: the file has changed since the fit"


@pytest.fixture
def fitted(run, tmp_path):
    """Fit a program; return the case, whose program then leaves a mark when it is started."""
    case = written_case(tmp_path)
    assert run("fit", case, "-o", tmp_path / "run").code in (0, 3)
    program = tmp_path / "program.py"
    program.write_text(MARKER + program.read_text(encoding="utf-8"), encoding="utf-8")
    return case


def is_started(case):
    return (case.parent / "started").exists()


def test_a_fit_from_fitted_values_refuses_a_changed_program(run, fitted):
    values = ("--parameters", fitted.parent / "run" / "parameters.yaml")
    for command in ("fit", "simulate", "validate"):
        ended = run(command, fitted, *values, "-o", fitted.parent / "again")
        assert ended.code == 1
        assert CHANGED in " ".join(ended.err.split())
    assert not is_started(fitted)
    # without them it is another fit, of the program that there is now
    assert run("fit", fitted, "-o", fitted.parent / "again").code in (0, 3)
    assert is_started(fitted)


def test_an_export_and_a_report_do_not_start_the_program(run, fitted):
    result = fitted.parent / "run"
    assert run("export", result, "-o", fitted.parent / "unit.dyr").code == 0
    assert run("report", result).code == 0
    assert "SEXS" in (fitted.parent / "unit.dyr").read_text(encoding="utf-8")
    assert not is_started(fitted)


def test_a_script_by_its_absolute_path_has_its_hash(run, tmp_path):
    case = written_case(tmp_path)
    script = tmp_path / "elsewhere" / "mine.py"
    script.parent.mkdir()
    script.write_text(PROGRAM.read_text(encoding="utf-8"), encoding="utf-8")
    text = case.read_text(encoding="utf-8").replace("program.py", str(script))
    case.write_text(text, encoding="utf-8")
    assert run("fit", case, "-o", tmp_path / "run").code in (0, 3)
    script.write_text("raise SystemExit", encoding="utf-8")
    values = ("--parameters", tmp_path / "run" / "parameters.yaml")
    ended = run("simulate", case, *values, "-o", tmp_path / "again")
    assert ended.code == 1
    assert CHANGED in " ".join(ended.err.split())


def test_a_programme_runs_a_changed_program_again(run, tmp_path):
    case = written_case(tmp_path)
    content = yaml.safe_load(case.read_text(encoding="utf-8"))
    tests = [{"name": "up", "test": content.pop("test"), "record": content.pop("record")}]
    programme = written({**content, "tests": tests}, tmp_path, "programme.yaml")
    command = ("run", programme, "-o", tmp_path / "run")
    assert run(*command).code in (0, 3)
    program = tmp_path / "program.py"
    former = program.read_text(encoding="utf-8")
    program.write_text(MARKER + former, encoding="utf-8")
    assert run(*command).code in (0, 3)
    assert is_started(case)
    # what is as it was is kept: no program is started for it
    (tmp_path / "started").unlink()
    assert run(*command).code in (0, 3)
    assert not is_started(case)
