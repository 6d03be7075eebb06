"""translate: what it prints, what it leaves, how it ends."""

import json
from pathlib import Path

import pytest
from places import ROOT

from exfit import workflows
from exfit.case.load import load_case
from exfit.features.planner.units import read_unit
from exfit.output.run_folder import write_fit

WIDTH = 80
FILES = {"ac1a_good-EXAC1.yaml", "ac1a_good-EXAC1.dyr", "translation.csv", "translation.json"}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Return the folder of a fit of AC1A."""
    folder = tmp_path_factory.mktemp("fit")
    write_fit(workflows.fit(ROOT / "configs" / "ac1a_good.yaml", search="local"), folder)
    return folder


@pytest.fixture(autouse=True)
def workplace(empty_folder):
    """Work in an empty folder."""
    return empty_folder


@pytest.mark.pixels
def test_it_leaves_a_case_and_records_of_the_other_model(run, fitted):
    code, out, err = run("translate", fitted, "--model", "EXAC1", "--step", "0.01")
    assert (code, err) == (0, "")
    assert out.lstrip().startswith("exact: EXAC1 responds like AC1A in all steps")
    assert max(map(len, out.splitlines()[:-1])) <= WIDTH
    folder = Path("runs/ac1a_good-EXAC1")
    assert f"\n\nwritten to {folder}\n  translation.png  the responses of both" in out
    assert {path.name for path in folder.iterdir()} == {*FILES, "translation.png"}
    figures = json.loads((folder / "translation.json").read_text())
    case = load_case(folder / "ac1a_good-EXAC1.yaml")
    values = {name: entry["value"] for name, entry in figures["parameters"].items()}
    assert {name: case.values()[name] for name in values} == values
    unit = read_unit((folder / "ac1a_good-EXAC1.dyr").read_text(), "unit.dyr")
    assert unit.exciter.definition.record.name == "EXAC1"
    assert unit.exciter.values["KA"] == values["KA"]
    header = (folder / "translation.csv").read_text().splitlines()[0].split(",")
    assert header[:2] == ["t", "vt AC1A +1 % open circuit"]


@pytest.mark.long
def test_a_poor_one_ends_with_3_and_says_why_first(run, fitted):
    code, out, _ = run("translate", fitted, "--model", "sexs", "--no-plots", "-o", "poor")
    assert code == 3
    lines = [line for line in out.splitlines() if line and not line.startswith(("scree", "refin"))]
    assert lines[0].startswith("poor, beyond 5 %: SEXS differs from AC1A by up to")
    assert "no counterpart in SEXS:" in out
    assert max(map(len, out.splitlines())) <= WIDTH


def test_json_is_all_that_is_printed(run, fitted):
    printed = run(
        "translate", fitted, "--model", "EXAC1", "--step", "0.01", "--json", "--no-plots", "-o", "x"
    )
    assert json.loads(printed.out) == json.loads(Path("x/translation.json").read_text())
    assert printed.err == ""


def test_a_result_with_a_machine_that_is_none_is_refused(run, fitted):
    result = json.loads((Path(fitted) / "result.json").read_text())
    Path("result.json").write_text(json.dumps({**result, "machine_model": "GENABC"}))
    code, _, err = run("translate", "result.json", "--model", "EXAC1")
    assert code == 1
    assert "GENABC is not a machine model" in err


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--model", "EXAC9"], "EXAC9 is not in the catalogue"),
        (["--model", "EXAC1", "--step", "3"], "step: 3 pu: lies outside 1e-06 ... 0.5"),
    ],
)
def test_what_is_wrong_is_refused(run, fitted, arguments, text):
    code, out, err = run("translate", fitted, *arguments)
    assert (code, out.strip()) == (1, "")
    assert text in err


def test_export_points_to_it_where_a_record_is_of_another_model(run, fitted):
    code, _, err = run("export", fitted, "--model", "EXAC1")
    assert code == 1
    assert "not a record of AC1A; `exfit translate RESULT --model EXAC1` finds" in err
    assert "known: ESAC1A" in run("export", fitted, "--model", "XYZ").err
