"""CONTRIBUTING.md: its steps lead where it says, its commands are those of the gate."""

import re
import shutil
import tomllib

import yaml
from places import ROOT
from test_features import MAIN, PACKAGE, run

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
FILES = re.findall(r"<!-- (\S+) -->\n```python\n(.*?)```", PAGE, re.DOTALL)


def test_a_feature_made_by_its_steps_is_a_command_that_shows_its_table(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "exfit", ignore=shutil.ignore_patterns("__pycache__"))
    for name, content in FILES:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(content, encoding="utf-8")
    assert "List the limits of a model's parameters." in run(MAIN, tmp_path, "--help").stdout
    done = run(MAIN, tmp_path, "limits", "AC1A")
    assert done.returncode == 0, done.stderr
    assert re.search(r"^\W*KA\s+\S+\s+\S+$", done.stdout, re.MULTILINE)


def test_the_page_is_one_page_and_its_files_are_there():
    assert len(PAGE.splitlines()) < 120
    named = re.findall(r"`((?:tests|docs|exfit|configs|\.ci)/[\w./-]+)`", PAGE)
    made = {name for name, _ in FILES} | {"exfit/models/exciters/my_exciter.py"}
    assert [name for name in named if name not in made and not (ROOT / name).exists()] == []


def test_what_runs_before_a_commit_is_what_the_gate_runs_and_what_is_installed():
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    hooks = config["repos"][0]["hooks"]
    entries = [hook["entry"].removesuffix(" --force-exclude") for hook in hooks]
    gate = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert all(re.search(rf"^ *{entry}\b", gate, re.MULTILINE) for entry in entries)
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "optional-dependencies"
    ]
    (installed,) = re.findall(r'pip install -e "\.\[(.*)\]"', PAGE)
    packages = " ".join(name for extra in installed.split(",") for name in extras[extra])
    assert all(tool in packages for tool in ("ruff", "mypy", "pytest", "pre-commit"))
