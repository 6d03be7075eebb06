"""new: a case for any model of the catalogue that runs as it stands, or says what to fill in."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from columns import Columns
from places import SAMPLES
from step_records import step_record
from tiers import few_of

from exfit.case.case_draft import LONGEST
from exfit.case.load import load_case
from exfit.case.other_model import bounds_of, free_of
from exfit.case.stated_values import taken_apart
from exfit.errors import CaseError, ExfitError
from exfit.features.start.answers import checked
from exfit.features.start.making import new_case
from exfit.features.start.starting_case import PartData, UnitData, starting_case
from exfit.features.start.starting_tests import starting_tests
from exfit.fitting.build import build_experiments
from exfit.models import MODELS
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES
from exfit.records.formats import open_table
from exfit.records.inspection import inspect
from exfit.workflows import fit, simulate

NOISE = 1e-4  # pu
STEP = 0.05  # pu
AT = 1.0  # s
PLANTS = {"FIRST_ORDER": {"type": "none"}}
FIELD_RECORD = SAMPLES / "field_record.csv"
OPEN = {"type": "open-circuit", "machine": "GENROU"}


@pytest.fixture
def record(tmp_path):
    """Return a function that writes the record of a model with its typical values."""

    def made(name):
        case = {
            "model": name,
            "plant": PLANTS.get(name, OPEN),
            "test": {"vt0": 1.0, "vref": [{"at": AT, "step": STEP}], "duration": 10.0},
            "simulation": {"output_step": 0.01},
        }
        path = tmp_path / "made.yaml"
        path.write_text(yaml.safe_dump(case))
        response = simulate(load_case(path), {}).response
        vt = response.signals["vt"]
        vt = vt + np.random.default_rng(len(name)).normal(0.0, NOISE, vt.size)
        lines = [f"{t:.4f},{v:.6f}" for t, v in zip(response.time, vt, strict=True)]
        file = tmp_path / "record.csv"
        file.write_text("\n".join(["t,vt", *lines]) + "\n")
        return Columns({"t": response.time, "vt": vt}, path=file)

    return made


def text_of(name, inspection, folder, machine="GENROU", sizes=None):
    """Return the text of the case that a model with typical data and a record begin with."""
    exciter, around = PartData.typical(MODELS[name]), PartData.typical(MACHINES[machine])
    return starting_case(
        UnitData(name, exciter, around), starting_tests([inspection], sizes or {}), folder
    ).text


def started(name, table, folder, machine="GENROU", step=STEP):
    """Write the case that a model and a record begin with, the step filled in; return its path."""
    text = text_of(name, inspect(table), folder, machine)
    path = folder / "case.yaml"
    path.write_text(text.replace('step: "?"', f"step: {step}"), encoding="utf-8")
    return path


def test_every_model_becomes_a_case_that_loads_as_it_stands(model, record, tmp_path):
    path = started(model, record(model), tmp_path)
    assert [line for line in path.read_text().splitlines() if len(line) > LONGEST] == []
    case = load_case(path)
    assert case.parts.exciter.name == model
    values = case.values()
    for row in MODELS[model].sheet:
        assert values[row.symbol] == pytest.approx(row.typical, rel=1e-6)
    others = [name for name in case.rows() if name not in case.free()]
    assert case.typical() == tuple(others)
    step, *others = case.test.vref
    assert not others or model == "IEEET4"  # its contact opens as quickly as it closes
    assert step.at.start == pytest.approx(AT, abs=0.05)
    assert step.at.min < AT < step.at.max
    assert case.record.channels["vt"].noise is None  # the residuals show what counts


def test_what_is_free_is_a_gain_or_a_time_and_starts_between_its_bounds(model):
    free = free_of(MODELS[model])
    assert free
    for row in free:
        low, high = bounds_of(row)
        assert row.low <= low < row.typical < high <= row.high
        assert low >= 0.1 * row.typical
        assert high <= 10.0 * row.typical
        assert low > 0.0
        assert row.unit != "s" or low >= SHORTEST
        assert not row.symbol.endswith(("MAX", "MIN"))
        assert row.symbol not in ("TR", "KE", "E1", "E2", "SE1", "SE2")
        assert "limit" not in row.meaning


def test_what_the_collection_fits_of_ac1a_and_ac8b_is_free():
    assert [row.symbol for row in free_of(MODELS["AC1A"])] == [
        "KA", "TA", "TE", "KF", "TF", "KC", "KD"
    ]  # fmt: skip
    assert [row.symbol for row in free_of(MODELS["AC8B"])] == [
        "KPR", "KIR", "KDR", "TDR", "TE", "KC", "KD"
    ]  # fmt: skip


@pytest.mark.parametrize("name", few_of(["AC1A", "AC8B", "SEXS", "FIRST_ORDER"], 2))
def test_the_case_is_fitted_as_it_stands(name, record, tmp_path):
    """The record is that of the start values: the fit may not leave more than its noise."""
    found = fit(load_case(started(name, record(name), tmp_path)), search="local")
    assert found.comparison.rmse == pytest.approx(NOISE, rel=0.1)
    assert found.parameters["vref.at"].value == pytest.approx(AT, abs=0.02)


def test_a_recorded_reference_is_used_in_place_of_steps(tmp_path):
    file = SAMPLES / "ac1a_ramp.csv"
    (tmp_path / "case.yaml").write_text(text_of("AC1A", inspect(open_table(file)), tmp_path))
    case = load_case(tmp_path / "case.yaml")
    (recording,), (validation,) = case.records, case.validations
    for each in (recording, validation):
        assert each.test.vref == "recorded"
        assert each.record.channels.keys() == {"vt", "vref"}
    assert recording.record.window[1] < 9.0 < validation.record.window[1]  # the second ramp
    (setup,) = build_experiments(case)
    assert [parameter.name for parameter in setup.free] == [
        f"{recording.name}.vt0"
    ]  # a ramp jumps nowhere


@pytest.mark.parametrize("machine", MACHINES)
def test_the_data_of_any_machine_stand_with_unit_and_meaning(machine, record, tmp_path):
    path = started("SEXS", record("SEXS"), tmp_path, machine)
    text = path.read_text()
    assert load_case(path).parts.machine.name == machine
    for row in MACHINES[machine].sheet:
        assert f"    {row.symbol}: {{value: {float(row.typical)!r}, source: typical}}" in text
        assert row.meaning in text


def test_what_the_record_does_not_tell_is_refused_by_place(tmp_path):
    time = np.arange(0.0, 5.0, 0.01)
    rng = np.random.default_rng(3)
    columns = {
        "t": time,
        "Ugen (kV)": 15.75 * (1.0 + rng.normal(0.0, NOISE, time.size)),
        "P (MW)": 120.0 + rng.normal(0.0, 0.1, time.size),
    }
    path = started("ST1A", Columns(columns, path=tmp_path / "record.csv"), tmp_path)
    with pytest.raises(CaseError) as caught:
        load_case(path)
    faults = str(caught.value)
    for place in ("plant.network.f0", "plant.network.X", "plant.network.P", "test.vref[0].at"):
        assert f"{place}: '?'" in faults
    assert "record.channels.vt" in faults


def test_a_plants_record_leaves_the_base_of_its_voltage_and_the_step_open(tmp_path):
    path = started("AC1A", open_table(FIELD_RECORD), tmp_path, step='"?"')
    with pytest.raises(CaseError) as caught:
        load_case(path)
    open_ = [line.partition(": ")[2] for line in str(caught.value).splitlines()]
    assert sorted(open_) == [
        "record.channels.vt.base: '?' is to be filled in",
        "test.vref[0].step: '?' is to be filled in",
    ]
    text = path.read_text(encoding="utf-8").replace('base: "?"', "base: 15.75")
    path.write_text(text.replace('step: "?"', "step: 0.05"))
    assert load_case(path).test.vref[0].at.start == pytest.approx(2.137, abs=0.02)
    assert load_case(path).record.channels["vt"].outliers == 6


def test_on_load_the_record_gives_power_and_the_network_is_required(tmp_path):
    time = np.arange(0.0, 5.0, 0.01)
    rng = np.random.default_rng(4)
    levels = {"vt": 1.0, "p": 0.8, "q": 0.1}
    columns = {name: level + rng.normal(0.0, NOISE, time.size) for name, level in levels.items()}
    path = started("ST1A", Columns({"t": time, **columns}, path=tmp_path / "r.csv"), tmp_path)
    plant = taken_apart(yaml.safe_load(path.read_text())).content["plant"]
    network = plant["network"]
    assert {symbol: plant["sources"].get(symbol) for symbol in network} == {
        "f0": None, "R": "typical", "X": None, "P": "measured", "Q": "measured"
    }  # fmt: skip
    assert network == {
        "f0": "?", "R": 0.0, "X": "?", "P": pytest.approx(0.8, abs=1e-3),
        "Q": pytest.approx(0.1, abs=1e-3),
    }  # fmt: skip


def test_findings_of_the_record_stand_at_the_top_of_the_case(record, tmp_path):
    table = record("SEXS")
    vt = table.content["vt"].copy()
    vt[600] += 0.1
    path = started("SEXS", Columns({**table.content, "vt": vt}, path=table.path), tmp_path)
    assert "# note: vt: 1 spike, at 6 s." in path.read_text()


def test_a_path_leads_from_the_case_to_the_record(record, tmp_path):
    folder = tmp_path / "cases" / "new"
    folder.mkdir(parents=True)
    case = load_case(started("SEXS", record("SEXS"), folder))
    assert (folder / case.record.file).resolve() == (tmp_path / "record.csv").resolve()
    assert Path(case.record.file).is_absolute() is False


def test_a_field_voltage_that_rests_where_the_model_does_not_is_noted(tmp_path):
    content = dict(step_record(1, length=6.0).table.content)
    sound = {"t": content["t"], "vt": content["vt"], "efd": content["efd"]}
    for scale in (1.0, 1.0 / 3.0):
        inspection = inspect(Columns({**sound, "efd": scale * sound["efd"]}))
        text = text_of("AC1A", inspection, tmp_path)
        notes = " ".join(line.lstrip("# ") for line in text.splitlines() if line.startswith("#"))
        assert ("efd: rests at 0.373" in notes) == (scale != 1.0)
        assert ("the machine with the breaker open at 0.95 to 1.6 pu" in notes) == (scale != 1.0)
        assert max(map(len, text.splitlines())) <= 100


def test_a_record_of_a_governors_test_becomes_a_case_that_fits_the_governor(tmp_path):
    answers = {"plant.network.f0": 60, "plant.network.YQ": -0.15, "test.vt0": 1.0}
    given = {"record": str(SAMPLES / "hydro_unit_load.csv"), "model": "SEXS", "open": answers}
    made = new_case(checked({**given, "governor": "hygov"}), tmp_path, {})
    assert made.open == ()
    path = tmp_path / "case.yaml"
    path.write_text(made.draft.text, encoding="utf-8")
    case = load_case(path)
    assert case.kind.name == "isolated"
    assert {"governor.R", "governor.r", "governor.Tr", "governor.TW"} <= set(case.free())
    assert all(name.startswith("governor.") for name in case.free())
    assert {*case.record.channels} == {"p", "speed", "gate"}
    with pytest.raises(ExfitError, match="governor: HYGOVX: no governor of exfit"):
        new_case(checked({**given, "governor": "HYGOVX"}), tmp_path, {})
