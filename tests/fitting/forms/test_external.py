"""Fits of a unit that another program simulates."""

import shutil
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

import exfit
from exfit.case.case import Case
from exfit.errors import CaseError, SimulationError
from exfit.fitting.forms.twin_descent import ProgramFunctions
from exfit.workflows import check, profile

PROGRAM = Path(__file__).parents[2] / "support" / "outside_program.py"
PLANT = {"machine": "ONE_AXIS", "parameters": {"Tpd0": 6.0, "S10": 0.0, "S12": 0.0}}
TRUTH = {"TATB": 0.1, "TB": 10.0, "K": 200.0, "TE": 0.05, "EMIN": -100.0, "EMAX": 100.0}
FREE = {
    "K": {"start": 120.0, "min": 20.0, "max": 2000.0},
    "TE": {"start": 0.1, "min": 0.005, "max": 0.5},
    "TB": {"start": 5.0, "min": 1.0, "max": 100.0},
}
NOISE = 1e-4  # pu
BUMP = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]}
SAME_COST = 1e-3  # the minimum of a program with its own integration


def case(record, plant, folder="."):
    content = {
        "model": "SEXS",
        "plant": plant,
        "test": BUMP,
        "record": {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}},
        "parameters": {"fixed": {k: v for k, v in TRUTH.items() if k not in FREE}, "free": FREE},
    }
    if plant["type"] != "external":
        content["estimate"] = {"search": "local"}
    return Case.from_dict(content, record, folder)


def external(record, *arguments, **changes):
    command = [sys.executable, str(PROGRAM), *map(str, arguments)]
    own = {"type": "external", "twin": "open-circuit", "command": command, "names": {"K": "K_A"}}
    return case(record, {**PLANT, **own, "time_limit": 20.0, **changes})


@pytest.fixture(scope="module")
def record():
    native = {
        "model": "SEXS",
        "plant": {"type": "open-circuit", **PLANT},
        "test": {**BUMP, "duration": 6.0},
        "simulation": {"output_step": 0.04},
        "parameters": {"fixed": TRUTH},
    }
    response = exfit.simulate(Case.from_dict(native)).response
    noise = NOISE * np.random.default_rng(3).standard_normal(len(response.time))
    return exfit.Record.from_arrays(response.time, {"vt": response.signals["vt"] + noise})


@pytest.fixture(scope="module")
def native(record):
    return exfit.fit(case(record, {"type": "open-circuit", **PLANT}))


def test_a_program_leads_to_the_minimum_of_its_twin_in_few_runs(record, native):
    result = exfit.fit(external(record))
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)
    assert result.success
    assert result.simulations <= 15
    for name, parameter in native.parameters.items():
        assert result.parameters[name].std_error == pytest.approx(parameter.std_error, rel=0.05)
    assert any(f": {result.simulations} runs" in note for note in result.notes)


# what hangs takes its time limit at each third run: it has a test of its own
@pytest.mark.parametrize("fault", ["error", "die", "nonsense", "short", "nan", "id"])
def test_runs_that_fail_are_rejected_steps(fault, record, native, tmp_path):
    result = exfit.fit(external(record, fault, tmp_path / "runs"))
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)
    assert result.simulations <= 25
    assert any("of which" in note and "failed" in note for note in result.notes)


def test_a_start_that_fails_once_is_run_again(record, native, tmp_path):
    result = exfit.fit(external(record, "start", tmp_path / "runs"))
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)


def test_a_program_that_always_fails_is_quoted(record):
    code = "import sys; sys.exit('the licence has expired')"
    with pytest.raises(SimulationError, match=r"plant.command: .*exit code 1: the licence has exp"):
        exfit.fit(external(record, command=[sys.executable, "-c", code]))


def test_a_twin_that_differs_leads_to_the_minimum_of_the_program(record, native):
    """Its derivatives are corrected by quotients; those of the twin alone end elsewhere."""
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    result = exfit.fit(external(record, **other, parallel=2))
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)
    assert result.parameters["TE"].value == pytest.approx(native.parameters["TE"].value, rel=0.01)
    # what is shown of start and iterations are runs of the program, which it remembers
    start = exfit.simulate(external(record, **other)).response.signals["vt"]
    assert np.array_equal(result.comparisons[0].overlays["vt"].start, start)


def test_the_hash_of_the_script_is_among_those_of_a_result(record, tmp_path):
    plant = external(record).external
    command = [sys.executable, shutil.copy(PROGRAM, tmp_path / "mine.py").name]
    own = {**PLANT, "type": "external", "twin": "open-circuit", "names": dict(plant.names)}
    result = exfit.fit(case(record, {**own, "command": command}, tmp_path))
    assert result.inputs["program"] == sha256(PROGRAM.read_bytes()).hexdigest()
    assert result.files["program"] == "mine.py"


def test_a_simulation_is_the_programs_own(record):
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    values = {name: TRUTH[name] for name in FREE}
    by_program = exfit.simulate(external(record, **other), values).response.signals["vt"]
    assert np.std(by_program - record.signals["vt"]) == pytest.approx(NOISE, rel=0.2)


def test_a_check_sets_program_and_twin_side_by_side(record):
    alike = check(external(record)).from_program["fit"]["vt"]
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    assert alike < 1e-6 < 1e-3 < check(external(record, **other)).from_program["fit"]["vt"]


def test_an_interruption_of_the_quotients_keeps_the_best_point(record, monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(ProgramFunctions, "correct", interrupted)
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    result = exfit.fit(external(record, **other))
    assert result.interrupted
    assert result.cost < 1e-2 * result.history[0].cost


def test_a_validation_is_by_the_program(record):
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    values = {name: TRUTH[name] for name in FREE}
    match = exfit.validate(external(record, **other), values, record)[-1]
    assert match.rmse == pytest.approx(NOISE, rel=0.2)


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"network": {"X": 0.1}}, "plant.network: not allowed with twin open-circuit"),
        ({"names": {"KQ": "x"}}, "plant.names.KQ: not a parameter"),
        ({"command": []}, "plant.command: 0 entries; at least 1 needed"),
        ({"twin": "playback"}, "plant.twin: 'playback' is not possible"),
    ],
)
def test_faults_of_the_section_are_named(changes, place, record):
    with pytest.raises(CaseError, match=place):
        external(record, **changes)


def test_a_global_search_and_profiles_are_refused(record):
    with pytest.raises(CaseError, match="search: global: not allowed with plant external"):
        exfit.fit(external(record), search="global")
    with pytest.raises(CaseError, match="not allowed with profile"):
        profile(external(record))
