"""`exfit identify --design`: what it prints, its files, and what it refuses."""

import json

import pytest
import yaml
from click.testing import CliRunner
from places import CONFIGS

from exfit.case.load import load_case
from exfit.cli import main

OPTIONS = ("--design", "--of", "KA", "--limit", "vt=0.04", "--limit", "efd=3", "--channels", "vt")


@pytest.fixture
def case(tmp_path, monkeypatch):
    """Return a case with one free parameter on a coarse clock, in the working folder."""
    monkeypatch.chdir(tmp_path)
    content = yaml.safe_load((CONFIGS / "ac1a_typical.yaml").read_text(encoding="utf-8"))
    free = content["parameters"]["free"]
    others = {name: each["start"] for name, each in free.items() if name != "KA"}
    content["parameters"]["fixed"] |= others
    content["parameters"]["free"] = {"KA": free["KA"]}
    for key in ("record", "validate"):
        content.pop(key)
    content["test"]["duration"] = 3.5
    content["simulation"] = {"output_step": 0.05}
    path = tmp_path / "unit.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def run(*words):
    return CliRunner().invoke(main, ["identify", *map(str, words)])


@pytest.mark.pixels
@pytest.mark.long
def test_a_design_prints_its_sheet_and_leaves_it_as_files(case, tmp_path):
    result = run(case, *OPTIONS, "-o", "designed")
    assert result.exit_code == 0, result.output
    folder = tmp_path / "designed"
    sheet = (folder / "test_sheet.txt").read_text(encoding="utf-8").splitlines()
    assert max(map(len, sheet)) <= 80
    assert set(sheet[2:]) <= set(result.output.splitlines())
    figures = json.loads((folder / "designed_test.json").read_text(encoding="utf-8"))
    rows = (folder / "test_sheet.csv").read_text(encoding="utf-8").splitlines()[1:]
    steps = [(step["at"], step["step"]) for step in figures["best"]["steps"]]
    assert [tuple(map(float, row.split(",")[:2])) for row in rows] == steps
    assert (folder / "designed_test.png").is_file()
    content = yaml.safe_load(case.read_text(encoding="utf-8"))
    content |= yaml.safe_load((folder / "test_section.yaml").read_text(encoding="utf-8"))
    case.write_text(yaml.safe_dump(content), encoding="utf-8")
    assert [(step.at, step.step) for step in load_case(case).test.vref] == steps


@pytest.mark.long
def test_the_json_is_the_file(case, tmp_path):
    result = run(case, *OPTIONS, "--json", "--no-plots", "-o", "designed")
    assert result.exit_code == 0, result.output
    assert result.output == (tmp_path / "designed/designed_test.json").read_text(encoding="utf-8")


def test_options_of_a_design_need_it(case):
    for words in (("--of", "KA"), ("--limit", "vt=0.1"), ("--duration", "5"), ("--criterion", "D")):
        result = run(case, *words)
        assert result.exit_code == 2
        assert f"{words[0]} is an option of --design, which is missing" in result.output


def test_what_a_design_cannot_use_is_refused(case):
    result = run(case, "--design", "--limit", "ef=3")
    assert result.exit_code == 1
    assert "limit ef: not a limit; did you mean efd?" in result.output
