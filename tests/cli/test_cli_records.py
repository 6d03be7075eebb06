"""inspect and new: what they print, what they leave, what they refuse, how they end."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from places import ROOT

from exfit.output import figures as plots

SAMPLE = ROOT / "sample_data" / "ac1a_up.csv"
WIDTH = 80
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(autouse=True)
def workplace(empty_folder, monkeypatch):
    """Work in a folder that holds nothing but up.csv, in no terminal; draw with few dots."""
    monkeypatch.setattr(plots.style, "DPI", 40)
    shutil.copy(SAMPLE, "up.csv")
    return empty_folder


def suggested(out):
    """Return the sections that inspect printed, as YAML reads them."""
    lines = out.splitlines()
    start = lines.index("record:")
    return yaml.safe_load("\n".join(lines[start:-1]))


def test_inspect_shows_the_record_and_leaves_its_files(run):
    code, out, err = run("inspect", "up.csv")
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= WIDTH
    for words in ("1001 samples", "100 Hz", "vt is vt: sure", "+0.04949", "runs/up.csv-inspect"):
        assert words in out
    folder = Path("runs/up.csv-inspect")
    assert sorted(path.name for path in folder.iterdir()) == ["inspect.json", "inspect.png"]
    assert (folder / "inspect.png").read_bytes().startswith(PNG)
    content = json.loads((folder / "inspect.json").read_text())
    assert [step["at"] for step in content["steps"]] == pytest.approx([1.0], abs=0.02)


def test_of_many_channels_the_foremost_are_shown_and_the_others_counted(run):
    record = np.genfromtxt(SAMPLE, delimiter=",", names=True)
    many = 1000 * np.eye(2, 60)[np.arange(len(record)) % 2]  # 58 of them constant
    columns = np.column_stack([record["t"], many, record["vt"]])
    names = ["t", *(f"c{k}" for k in range(60)), "vt"]
    np.savetxt("many.csv", columns, delimiter=",", header=",".join(names), comments="")
    code, out, err = run("inspect", "many.csv", "--no-plots")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    table = lines[next(k for k, line in enumerate(lines) if line.startswith("channel ")) + 1 :]
    assert [line.split()[0] for line in table[:3]] == ["vt", "c0", "c1"]
    assert table.index("... and 21 more in inspect.json") == 41  # behind a blank line
    assert "c11, ... and 48 more in inspect.json" in " ".join(out.split())
    content = json.loads(Path("runs/many.csv-inspect/inspect.json").read_text())
    assert [channel["name"] for channel in content["channels"]] == names[1:]


def test_what_inspect_suggests_makes_a_case(run):
    """The sections are pasted behind a model and a plant, and the case is checked."""
    sections = suggested(run("inspect", "up.csv", "--no-plots")[1])
    case = {"model": "AC1A", "plant": {"type": "open-circuit", "machine": "GENROU"}, **sections}
    Path("case.yaml").write_text(yaml.safe_dump(case))
    code, _, err = run("check", "case.yaml")
    assert (code, err.count("\n")) == (1, 1)
    assert "test.vref[0].step: '?' is to be filled in" in err
    fill_in("case.yaml")
    assert run("check", "case.yaml")[0] == 0


def fill_in(case):
    """Write the size of the step into a case."""
    text = Path(case).read_text()
    Path(case).write_text(
        text.replace('step: "?"', "step: 0.05").replace("step: '?'", "step: 0.05")
    )


def test_inspect_as_json_prints_what_it_writes(run):
    code, out, err = run("inspect", "up.csv", "--json", "--no-plots", "-o", "there")
    assert (code, err) == (0, "")
    assert out == Path("there/inspect.json").read_text()
    assert not Path("there/inspect.png").exists()
    assert run("inspect", "up.csv", "-q", "--no-plots") == (0, "", "")


def test_a_column_of_time_can_be_named(run):
    rows = [f"{k % 7},{k * 0.01:.2f},{1 + 1e-4 * np.sin(9 * k):.6f}" for k in range(50)]
    Path("odd.csv").write_text("\n".join(["tap,clock,vt", *rows]) + "\n")
    code, _, err = run("inspect", "odd.csv", "--no-plots")
    assert code == 1
    assert "--time" in err
    code, out, _ = run("inspect", "odd.csv", "--no-plots", "--time", "clock")
    assert code == 0
    assert "50 samples by clock, 0 ... 0.49 s" in out
    assert "time: clock" in out


def test_the_unit_of_the_time_can_be_given(run):
    rows = [f"{10 * k},{1 + 1e-4 * np.sin(9 * k):.6f}" for k in range(50)]
    Path("ms.csv").write_text("\n".join(["t,vt", *rows]) + "\n")
    code, out, _ = run("inspect", "ms.csv", "--no-plots", "--time-unit", "ms")
    assert code == 0
    assert "50 samples by t, 0 ... 0.49 s" in out
    assert suggested(out)["record"]["time"] == {"column": "t", "unit": "ms"}
    Path("said.csv").write_text("\n".join(["t [ms],vt", *rows]) + "\n")
    code, _, err = run("inspect", "said.csv", "--no-plots", "--time-unit", "s")
    assert code == 1
    assert "in ms as the file says, not in s" in err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("t,vt\n0,1\n", "1 samples; at least 2"),
        ("t,vt\n0,1\nx,1\n", "bad.csv:3: column 't': 'x' is not a number"),
        ("t,state\n0,on\n1,off\n", "no column of numbers"),
    ],
)
def test_a_record_that_cannot_be_read_is_refused_in_one_line(text, words, run):
    Path("bad.csv").write_text(text)
    code, out, err = run("inspect", "bad.csv")
    assert (code, out) == (1, "")
    assert words in err
    assert len(err.splitlines()) == 1


def test_new_makes_a_case_that_checks_and_fits(run):
    code, out, err = run("new", "--model", "SEXS", "--record", "up.csv", "-o", "cases/case.yaml")
    assert (code, err) == (0, "")
    written, step = out.splitlines()
    assert written == "written to cases/case.yaml; next: exfit check cases/case.yaml"
    assert step.startswith("to be filled in: test.vref[0].step (pu, as keyed in; vt changed")
    content = yaml.safe_load(Path("cases/case.yaml").read_text())
    assert content["record"]["file"] == "../up.csv"
    fill_in("cases/case.yaml")
    assert run("check", "cases/case.yaml")[0] == 0


def test_new_takes_an_alias_and_any_case_of_letters(run):
    code, out, _ = run("new", "--model", "esac1a", "--record", "up.csv", "--machine", "gensal")
    assert code == 0
    content = yaml.safe_load(out)
    assert (content["model"], content["plant"]["machine"]) == ("AC1A", "GENSAL")


def test_new_takes_a_model_of_ones_own(run):
    shutil.copy(ROOT / "exfit" / "models" / "exciters" / "sexs.py", "mine.py")
    code, _, err = run("new", "--model", "mine.py", "--record", "up.csv", "-o", "cases/case.yaml")
    assert (code, err) == (0, "")
    assert yaml.safe_load(Path("cases/case.yaml").read_text())["model"] == "../mine.py"
    fill_in("cases/case.yaml")
    assert run("check", "cases/case.yaml")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--model", "AC1B", "--record", "up.csv"), "did you mean"),
        (("--model", "AC1A", "--record", "none.csv"), "none.csv: cannot be read"),
        (("--model", "AC1A", "--machine", "GENX", "--record", "up.csv"), "GENX is not a machine"),
        (("--model", "AC1A", "--record", "up.csv", "-o", "up.csv"), "exists already; --force"),
    ],
)
def test_new_refuses_what_it_cannot_use(arguments, words, run):
    before = Path("up.csv").read_bytes()
    code, out, err = run("new", *arguments)
    assert (code, out) == (1, "")
    assert words in err
    assert Path("up.csv").read_bytes() == before
