"""A user's own model: the file is run only if it is the one that was fitted."""

import hashlib
import shutil

import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from places import ROOT
from tiers import few_of

import exfit
from exfit import cli
from exfit.errors import CaseError, ModelError
from exfit.models import from_file
from exfit.models.user_code import run_user_code

SOURCE = ROOT / "exfit" / "models" / "exciters" / "first_order.py"


def trap(folder):
    """Return a piece of Python that leaves a file in a folder when it is run."""
    return f"from pathlib import Path\nPath({str(folder)!r}, 'run').touch()\n"


def test_a_number_of_a_sheet_that_no_float_holds_is_refused(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(SOURCE.read_text().replace("(0.000001,", f"({10**400},", 1))
    with pytest.raises(ModelError, match=r"own\.py: OverflowError: int too large"):
        from_file(path)


@pytest.fixture
def case(tmp_path, monkeypatch):
    """A case with a model of its own and a record, in the working folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    shutil.copy(SOURCE, "mine.py")
    rows = "\n".join(f"{t:.9g},{v:.9g}" for t, v in zip(TIME, TRUTH, strict=True))
    (tmp_path / "up.csv").write_text(f"t,v\n{rows}\n")
    record = {"file": "up.csv", "time": "t", "channels": {"vt": "v"}}
    again = {"name": "again", "test": FIRST_ORDER["test"], "record": record}
    content = {**FIRST_ORDER, "model": "mine.py", "record": record, "validate": [again]}
    path = tmp_path / "case.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def run(*arguments):
    with pytest.raises(SystemExit) as ended:
        cli.main([*map(str, arguments)], prog_name="exfit")
    return ended.value.code


def test_a_file_with_another_hash_is_not_run(tmp_path):
    path = tmp_path / "trap.py"
    path.write_text(trap(tmp_path))
    with pytest.raises(ModelError, match=r"trap\.py: not run: the file has changed"):
        run_user_code(path, "0" * 64)
    assert not (tmp_path / "run").exists()
    run_user_code(path, hashlib.sha256(path.read_bytes()).hexdigest())
    assert (tmp_path / "run").exists()


def test_a_file_that_is_known_by_its_hash_is_run_once(tmp_path):
    """So that the models of many cases are one, compiled once; an edit is another file."""
    path = tmp_path / "trap.py"
    for text in ("", "# edited\n"):
        path.write_text(trap(tmp_path) + text)
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        names = run_user_code(path, sha256)
        (tmp_path / "run").unlink()
        assert run_user_code(path, sha256) is names
        assert not (tmp_path / "run").exists()
        run_user_code(path)
        (tmp_path / "run").unlink()


@pytest.mark.parametrize(
    "command",
    few_of(
        [
            ["validate", "case.yaml"],
            ["validate", "case.yaml", "--parameters", "run-1/parameters.yaml"],
            ["simulate", "case.yaml", "--parameters", "run-1/parameters.yaml"],
        ],
        1,
    ),
)
def test_a_model_that_changed_since_the_fit_is_refused_before_it_is_run(case, command, capsys):
    assert run("fit", case, "-o", "run-1", "--no-plots", "--quiet") == 0
    assert run(*command, "--no-plots", "--quiet") == 0
    (case.parent / "mine.py").write_text(SOURCE.read_text() + trap(case.parent))
    capsys.readouterr()
    assert run(*command, "--no-plots", "--quiet") == 1
    assert "mine.py: not run: the file has changed since the fit" in capsys.readouterr().err
    assert not (case.parent / "run").exists()
    # a new fit is of the new model
    assert run("fit", case, "-o", "run-1", "--no-plots", "--quiet") == 0
    assert run(*command, "--no-plots", "--quiet") == 0


@pytest.mark.parametrize("command", few_of(["validate", "simulate"], 1))
@pytest.mark.parametrize("text", [None, "model: mine.py"])
def test_a_file_without_parameters_is_refused_before_the_model_is_run(case, command, text, capsys):
    """It says nothing of the hash of the model, so nothing could be compared."""
    assert run("fit", case, "-o", "run-1", "--no-plots", "--quiet") == 0
    (case.parent / "mine.py").write_text(SOURCE.read_text() + trap(case.parent))
    (case.parent / "run-1" / "parameters.yaml").unlink()
    file, fault = "run-1/result.json", "contains no parameters.yaml of a fit"
    if text is not None:
        (case.parent / "other.yaml").write_text(text)
        file, fault = "other.yaml", "parameters: missing"
    capsys.readouterr()
    assert run(command, "case.yaml", "--parameters", file, "--no-plots", "--quiet") == 1
    assert capsys.readouterr().err == f"Error: {file}: {fault}\n"
    assert not (case.parent / "run").exists()


def test_values_of_a_fit_are_not_those_of_another_model(case):
    result = exfit.fit(case)
    (case.parent / "mine.py").write_text(SOURCE.read_text() + trap(case.parent))
    for use in (exfit.simulate, exfit.validate):
        with pytest.raises(CaseError, match="not run: the file has changed"):
            use(case, result)
    assert not (case.parent / "run").exists()


def test_names_and_records_may_be_listed_one_by_one(tmp_path):
    """As files have them that were copied from models before these were given in one text."""
    path = tmp_path / "mine.py"
    record = 'record("MINE", "TA KA")'
    path.write_text(
        f"{SOURCE.read_text()}\nfrom exfit.models.sheet import record\n"
        f'ALIASES = ("ONE", "OTHER")\nINPUTS = ("speed",)\nRECORDS = ({record},)\n'
        f"PSLF_RECORDS = {record} + {record}\n"
    )
    mine = from_file(path)
    assert (mine.aliases, mine.inputs) == (("ONE", "OTHER"), ("speed",))
    assert [each.name for each in (*mine.records, *mine.pslf_records)] == ["MINE"] * 3
