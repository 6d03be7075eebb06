"""The README says what is so: its commands, its cases, its model, its tables."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

from exfit import workflows
from exfit.case.load import load_case
from exfit.cli import main
from exfit.fitting.recordings import measured
from exfit.models import MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.output import run_folder

README = (ROOT / "README.md").read_text(encoding="utf-8")
OWN_CASE = """\
model: my_exciter.py
plant: {type: open-circuit, machine: GENROU}
test: {vt0: 1.0, duration: 5.0, vref: [{at: 1.0, step: 0.02}]}
"""


def block(language, number=0):
    """Return a block of the README in a language, by default the first."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)[number]


def first_column(after):
    """Return the first cells of the first table behind some words, without its head."""
    lines = iter(README.partition(after)[2].splitlines())
    table = []
    for line in lines:
        if line.startswith("|"):
            table.append(line.split("|")[1].strip())
        elif table:
            break
    return table[2:]


@pytest.fixture
def folder(tmp_path):
    """Return a folder for cases, beside a copy of the records."""
    shutil.copytree(ROOT / "sample_data", tmp_path / "sample_data")
    (tmp_path / "configs").mkdir()
    return tmp_path / "configs"


def test_two_commands_install_and_run_and_test():
    lines = [line for line in README.splitlines() if line.startswith("$ pip install")]
    assert len(lines) == 2


def test_the_case_of_the_readme_is_valid_and_its_records_can_be_read(folder):
    path = folder / "case.yaml"
    path.write_text(block("yaml"), encoding="utf-8")
    case = load_case(path)
    assert measured(case, case.test, case.record).time.size > 1
    for one in case.validations:
        assert measured(case, one.test, one.record).time.size > 1


def test_the_record_of_the_readme_is_read_in_the_recorders_units(folder):
    head = block("yaml").partition("record:")[0]
    (folder / "case.yaml").write_text(head + block("yaml", 1), encoding="utf-8")
    case = load_case(folder / "case.yaml")
    record = measured(case, case.test, case.record)
    assert record.signals["vt"][0] == pytest.approx(1.0, abs=0.01)
    assert record.signals["ifd"][0] == pytest.approx(1.12, abs=0.01)


def test_the_records_of_the_readme_are_a_valid_part_of_a_case(folder):
    machine = "model: AC1A\nplant: {type: open-circuit, machine: GENROU}\n"
    (folder / "case.yaml").write_text(machine + block("yaml", 2), encoding="utf-8")
    case = load_case(folder / "case.yaml")
    assert [one.name for one in case.recordings] == ["up", "on-line"]
    assert case.on_load


def test_the_unit_on_load_of_the_readme_can_be_simulated(folder):
    (folder / "case.yaml").write_text("model: AC1A\n" + block("yaml", 3), encoding="utf-8")
    response = workflows.simulate(load_case(folder / "case.yaml"), {}).response
    assert response.signals["p"][0] == pytest.approx(0.8, rel=1e-9)
    assert response.signals["vt"][0] == pytest.approx(1.0, rel=1e-9)
    assert np.ptp(response.signals["delta"]) > 0.05


def test_the_readme_names_every_model():
    words = set(re.findall(r"\w+", README))
    assert {*MODELS, *MACHINES, *STABILISERS} <= words


def test_the_model_of_the_readme_starts_at_rest_and_follows_a_step(folder):
    (folder / "my_exciter.py").write_text(block("python"), encoding="utf-8")
    (folder / "case.yaml").write_text(OWN_CASE, encoding="utf-8")
    response = workflows.simulate(load_case(folder / "case.yaml"), {}).response
    vt = response.signals["vt"]
    assert vt[response.time <= 1.0] == pytest.approx(1.0, abs=1e-9)
    assert np.all(np.isfinite(vt))
    # a static exciter, without an integral: the loop leaves 1 / (1 + KA) and saturation
    assert vt[-1] == pytest.approx(1.02, abs=2e-3)


def test_the_table_of_commands_names_every_command_and_no_other():
    told = [re.match(r"`exfit (\w+)", cell)[1] for cell in first_column("## Commands")]
    assert sorted(told) == sorted(main.commands)


def test_a_fit_leaves_the_files_of_the_table_and_no_others(tmp_path, monkeypatch):
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "cache"))
    result = workflows.fit(load_case(ROOT / "configs" / "first_order.yaml"))
    run_folder.write_fit(result, tmp_path / "run", figures=True)
    told = re.findall(r"`([^`]+)`", " ".join(first_column("A fit leaves")))
    (validation,) = result.validation
    named = {name.replace("NAME", validation.name) for name in told}
    assert {path.name for path in (tmp_path / "run").iterdir()} == named


def test_the_unit_of_the_readme_becomes_a_case_as_it_says(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder.parent)
    session = re.search(r"^\$ exfit (import .*?)\n(.*?)^\$", README, re.DOTALL | re.MULTILINE)
    with pytest.raises(SystemExit) as ended:
        main(session[1].split(), prog_name="exfit")
    shown = capsys.readouterr()
    assert (ended.value.code or 0, shown.err + shown.out) == (0, session[2])
    assert load_case(Path("unit.yaml")).model == "AC1A"
