"""What runs by hand keeps up with the package: benchmarks, studies, and the shell of examples/."""

import ast
import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
import yaml
from places import CONFIGS, ROOT, SAMPLES

SCRIPTS = sorted(
    path for room in ("benchmarks", "studies") for path in (ROOT / "tests" / room).glob("*.py")
)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_imports_what_the_package_has(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "exfit":
            module = import_module(node.module)
            assert [alias.name for alias in node.names if not hasattr(module, alias.name)] == []


EXAMPLES = sorted((ROOT / "examples").glob("*.sh"))
LOCAL = ("--search", "local")
needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")


@pytest.fixture
def shell(tmp_path, monkeypatch):
    """Return a function that runs an example in an empty folder, with this Python's exfit."""
    monkeypatch.chdir(tmp_path)
    places = [str(Path(sys.executable).parent), os.environ["PATH"]]
    environment = {**os.environ, "PATH": os.pathsep.join(places), "COLUMNS": "80"}

    def command(name, *arguments):
        return subprocess.run(
            ["bash", ROOT / "examples" / name, *arguments],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )

    return command


def case_in(folder, name, **changes):
    """Write a case of AC1A with its records into a folder; return its path."""
    content = yaml.safe_load((CONFIGS / "ac1a_typical.yaml").read_text()) | changes
    content["record"]["file"] = str(SAMPLES / "ac1a_up.csv")
    del content["validate"]
    folder.mkdir(exist_ok=True)
    file = folder / f"{name}.yaml"
    file.write_text(yaml.safe_dump(content))
    return file


@pytest.mark.skipif(shutil.which("shellcheck") is None, reason="needs shellcheck")
def test_no_shell_script_has_a_fault_that_shellcheck_knows():
    command = [
        "shellcheck",
        "--severity=style",
        "--exclude=SC1091",
        *EXAMPLES,
        ROOT / ".ci" / "run",
    ]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.stdout == ""
    assert found.returncode == 0
    for file in EXAMPLES:
        assert os.access(file, os.X_OK)


@needs_bash
@pytest.mark.parametrize("name", [path.name for path in EXAMPLES if "compare" not in path.name])
def test_a_script_refuses_what_it_cannot_use(shell, name):
    for arguments in ((), ("nowhere", "nowhere")):
        ran = shell(name, *arguments)
        assert (ran.returncode, ran.stdout) == (2, "")
        assert ran.stderr.startswith(f"usage: {name} ")


@needs_bash
def test_a_folder_is_fitted_and_sorted_by_exit_codes(shell, tmp_path):
    case_in(tmp_path / "cases", "a good one")
    (tmp_path / "cases" / "bad.yaml").write_text("model: none\n")
    ran = shell("fit_all.sh", "cases", "results", *LOCAL)
    good, bad = ran.stdout.splitlines()
    assert good.split()[:4] == ["a", "good", "one", "matches,"]
    assert bad.split()[:3] == ["bad", "not", "fitted,"]
    assert ran.returncode == 1
    assert ran.stderr.startswith("Error: cases/bad.yaml")
    assert (tmp_path / "results" / "a good one" / "result.json").exists()


@pytest.mark.long
@needs_bash
def test_a_folder_with_a_fit_that_does_not_match_ends_with_3(shell, tmp_path):
    case_in(tmp_path / "cases", "poor", estimate={"strategy": "gn"})
    case_in(tmp_path / "cases", "sound")
    ran = shell("fit_all.sh", tmp_path / "cases", "results", *LOCAL)
    assert [line.split()[:2] for line in ran.stdout.splitlines()] == [
        ["poor", "not"],
        ["sound", "matches,"],
    ]
    assert (ran.returncode, ran.stderr) == (3, "")
    (tmp_path / "empty").mkdir()
    assert shell("fit_all.sh", "empty").returncode == 1


@pytest.mark.long
@needs_bash
def test_the_script_of_the_readme_branches_on_exit_codes(shell, tmp_path):
    script = re.search(r"^```sh\n(.*?)^```$", (ROOT / "README.md").read_text(), re.DOTALL | re.M)[1]
    assert 6 <= len(script.splitlines()) <= 10
    (tmp_path / "readme.sh").write_text(script)
    case_in(tmp_path / "cases", "1 sound")
    case_in(tmp_path / "cases", "2 poor", estimate={"strategy": "gn", "search": "local"})
    (tmp_path / "cases" / "3 bad.yaml").write_text("model: none\n")
    words = [line.partition(": ")[2] for line in shell(tmp_path / "readme.sh").stdout.splitlines()]
    assert words == ["matches", "look at the causes", "cannot be used"]


@pytest.mark.long
@needs_bash
def test_a_fit_is_validated_on_a_further_record(shell, tmp_path):
    file, record = case_in(tmp_path, "case"), SAMPLES / "ac1a_down.csv"
    ran = shell("fit_then_validate.sh", file, record, "results", *LOCAL)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.splitlines()[0] == "the fit matches"
    assert ran.stdout.splitlines()[-1].endswith("; accepted")
    poor = shell("fit_then_validate.sh", file, record, "poor", *LOCAL, "--strategy", "gn")
    assert poor.returncode == 3
    assert "verdict: not converged" in poor.stderr


@pytest.mark.long
@needs_bash
def test_strategies_are_compared_case_by_case(shell, tmp_path):
    ran = shell("compare_strategies.sh", "results", case_in(tmp_path, "case"))
    assert (ran.returncode, ran.stderr) == (0, "")
    rows = [line.split() for line in ran.stdout.splitlines()[1:]]
    assert [row[:2] for row in rows] == [
        ["case", name] for name in ("gn", "dgn", "lm", "lm-then-dgn")
    ]
    assert float(rows[0][3]) > 10 * float(rows[1][3])  # gn ends early from typical values
    for row in rows[1:]:
        assert row[5] == "matches,"
    assert (tmp_path / "results" / "fits.csv").exists()


@pytest.mark.long
@needs_bash
def test_a_report_is_written_for_a_fit(shell, tmp_path):
    ran = shell("report.sh", case_in(tmp_path, "case"), "results", *LOCAL, "--no-plots")
    assert ran.returncode == 0
    assert "verdict: matches, not all determined" in ran.stdout
    assert (tmp_path / "results" / "report.html").exists()
    assert (tmp_path / "results" / "report.pdf").exists() == (ran.stderr == "")
