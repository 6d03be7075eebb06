"""Fits of a unit that is an FMU, which the tests build."""

from hashlib import sha256
from itertools import product

import numpy as np
import pytest
from fmus import NAMES, OUTPUTS, built_fmu, needs_fmus
from tiers import few_of

import exfit
from exfit.case.case import Case
from exfit.errors import CaseError, SimulationError
from exfit.features.external.case_program import CaseProgram
from exfit.features.external.fmu import FmuDescription, FmuVariable
from exfit.features.external.program import ExternalProgram
from exfit.workflows import check

PLANT = {"machine": "ONE_AXIS", "parameters": {"Tpd0": 6.0, "S10": 0.0, "S12": 0.0}}
TRUTH = {"TATB": 0.1, "TB": 10.0, "K": 200.0, "TE": 0.05, "EMIN": -100.0, "EMAX": 100.0}
FREE = {
    "K": {"start": 120.0, "min": 20.0, "max": 1000.0},
    "TE": {"start": 0.1, "min": 0.005, "max": 0.5},
}
BUMP = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]}
FOUND = 1e-4  # relative
LIMITED = 1e-5  # pu: its co-simulation passes a limit within a step of 0.5 ms
SAME = 1e-6  # pu: the integration of an FMU is its own


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """Return an FMU for each version of FMI."""
    needs_fmus()
    folder = tmp_path_factory.mktemp("fmus")
    return {version: built_fmu(folder, version) for version in (2, 3)}


@pytest.fixture(scope="module")
def record():
    native = case(None, {"type": "open-circuit", **PLANT})
    response = exfit.simulate(native).response
    return exfit.Record.from_arrays(response.time, {"vt": response.signals["vt"]})


def case(record, plant, folder="."):
    content = {
        "model": "SEXS",
        "given": "exact",
        "plant": plant,
        "test": BUMP,
        "record": {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}},
        "parameters": {"fixed": {k: v for k, v in TRUTH.items() if k not in FREE}, "free": FREE},
    }
    if record is None:
        del content["record"]
        content |= {"test": {**BUMP, "duration": 5.0}, "simulation": {"output_step": 0.04}}
        content["parameters"] = {"fixed": TRUTH}
    return Case.from_dict(content, record, folder)


def of_fmu(record, unit, **changes):
    own = {"type": "fmu", "file": str(unit), "twin": "open-circuit", "time_limit": 30.0}
    return case(record, {**PLANT, **own, "names": NAMES, "outputs": OUTPUTS, **changes})


@pytest.mark.long
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("interface", ["co-simulation", "model-exchange"])
def test_two_parameters_of_an_fmu_are_found(version, interface, units, record):
    result = exfit.fit(of_fmu(record, units[version], interface=interface))
    for name in FREE:
        assert result.parameters[name].value == pytest.approx(TRUTH[name], rel=FOUND)
    assert result.simulations <= 10
    assert any(f"unit{version}.fmu: {result.simulations} runs" in note for note in result.notes)
    assert result.inputs["program"] == sha256(units[version].read_bytes()).hexdigest()


@pytest.mark.long
@pytest.mark.parametrize("interface", ["co-simulation", "model-exchange"])
def test_two_parameters_of_an_fmu_without_a_twin_are_found(interface, units, record):
    named = Case.from_dict(
        {
            "plant": {
                "type": "fmu",
                "file": str(units[3]),
                "interface": interface,
                "parallel": 2,
                "names": {**NAMES, "Tpd0": "machine.Tpd0"},
                "outputs": OUTPUTS,
            },
            "test": BUMP,
            "record": {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}},
            "parameters": {"fixed": {"TATB": 0.1, "TB": 10.0, "Tpd0": 6.0}, "free": FREE},
        },
        record,
    )
    result = exfit.fit(named)
    for name in FREE:
        assert result.parameters[name].value == pytest.approx(TRUTH[name], rel=FOUND)


@pytest.mark.long
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("interface", ["co-simulation", "model-exchange"])
def test_a_check_sets_the_fmu_and_its_twin_side_by_side(version, interface, units, record):
    unit = of_fmu(record, units[version], interface=interface)
    result = check(unit)
    assert result.from_program["fit"]["vt"] < SAME
    unset = f"no parameters of unit{version}.fmu, which uses its values: EMIN, machine.H"
    assert any(unset in note for note in result.notes)


@pytest.mark.parametrize(
    ("version", "interface", "fixed_step"),
    few_of(
        [
            (3, "model-exchange", False),
            (2, "model-exchange", False),
            *product((2, 3), ["co-simulation"], (False, True)),
        ],
        1,
    ),
)
def test_steps_and_ramps_reach_the_fmu_when_they_are(version, interface, fixed_step, tmp_path):
    """A co-simulation holds its inputs, so that a ramp is one of steps, of which 1 ms is seen."""
    needs_fmus()
    moves = [{"at": 1.0123, "step": 0.05}, {"at": 2.0, "step": -0.04, "ramp": 0.5}]
    content = {
        "model": "SEXS",
        "test": {"vt0": 1.0, "vref": moves, "duration": 3.0},
        "simulation": {"output_step": 0.04},
        "parameters": {"fixed": TRUTH},
    }
    own = {
        "type": "fmu",
        "file": str(built_fmu(tmp_path, version, fixed_step)),
        "twin": "open-circuit",
        "names": NAMES,
        "outputs": OUTPUTS,
        "interface": interface,
    }
    of_unit, native = (
        exfit.simulate(Case.from_dict({**content, "plant": {**PLANT, **plant}})).response
        for plant in (own, {"type": "open-circuit"})
    )
    late = 2e-5 if fixed_step else SAME
    difference = of_unit.signals["vt"] - native.signals["vt"]
    assert np.max(np.abs(difference)) < late


@pytest.mark.long
@pytest.mark.parametrize("version", [2, 3])
def test_both_interfaces_pass_the_limits_of_an_fmu_alike(version, units, record):
    """In a model exchange a limit is an event, in this co-simulation a branch."""
    by_branch, by_event, free = (
        exfit.simulate(of_fmu(None, units[version], interface=interface), values).response
        for interface, values in (
            ("co-simulation", {"EMAX": 1.3}),
            ("model-exchange", {"EMAX": 1.3}),
            ("model-exchange", {}),
        )
    )
    difference = by_event.signals["vt"] - by_branch.signals["vt"]
    assert np.max(np.abs(difference)) < LIMITED
    assert np.max(np.abs(by_event.signals["vt"] - free.signals["vt"])) > 100.0 * LIMITED


@pytest.mark.long
def test_a_crash_of_the_machine_code_is_a_rejected_step(record, tmp_path):
    """From this start the search tries TE = 0.034, where the FMU ends its process."""
    needs_fmus()
    crashing = of_fmu(record, built_fmu(tmp_path, shortest=0.04))
    with pytest.raises(SimulationError, match=r"plant.file: the program was ended by SIGABRT"):
        exfit.simulate(crashing, {"TE": 0.03})
    result = exfit.fit(crashing, values={"K": 900.0})
    assert any("failed; it was restarted" in note for note in result.notes)
    for name in FREE:
        assert result.parameters[name].value == pytest.approx(TRUTH[name], rel=FOUND)


@pytest.mark.long
def test_nothing_is_left_of_an_fmu_that_was_run(units, record, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    exfit.simulate(of_fmu(record, units[2]))
    assert [*tmp_path.iterdir()] == []


def variable(kind, *uses):
    return FmuVariable(f"{kind}, Real", uses)


DESCRIPTION = FmuDescription(
    ("co-simulation",),
    {
        "avr.K": variable("fixed parameter", "parameter"),
        "avr.TE": variable("fixed calculatedParameter"),
        "dVref": variable("continuous input", "input"),
        "gen.V": variable("continuous output", "output"),
    },
)


def test_all_that_an_fmu_has_no_variable_for_is_reported_together(record, tmp_path):
    unit = of_fmu(record, "unit.fmu", names={"K": "avr.k_", "TE": "avr.TE"}, outputs={"vt": "V"})
    never_run = ExternalProgram(["none"], tmp_path, 1, 1.0)
    with pytest.raises(CaseError) as faults:
        CaseProgram(unit, unit.external, never_run, DESCRIPTION).simulator(_test_of(unit))
    text = str(faults.value)
    assert "plant.names.K: unit.fmu has no variable avr.k_; did you mean avr.K?" in text
    assert "plant.names.TE: avr.TE is not a parameter that can be set but fixed calc" in text
    assert "plant.inputs.vref: unit.fmu has no variable vref; did you mean dVref?" in text
    assert "plant.outputs.vt: unit.fmu has no variable V; known: gen.V" in text


def _test_of(unit):
    from exfit.fitting.build import build_experiments

    return build_experiments(unit)[0].experiment.simulator


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        (
            {"inputs": {"verf": "x"}},
            "plant.inputs.verf: not an input of open-circuit; did you",
        ),
        ({"outputs": {"p": "x"}}, "plant.outputs.p: not a signal of open-circuit"),
        ({"command": ["x"]}, "plant.command: not allowed with this type"),
        ({"interface": "both"}, "plant.interface: 'both' is not possible"),
    ],
)
def test_faults_of_the_section_are_named(changes, place, record):
    with pytest.raises(CaseError, match=place):
        of_fmu(record, "unit.fmu", **changes)


def test_a_file_that_is_no_fmu_is_named(record, tmp_path):
    pytest.importorskip("fmpy")
    (tmp_path / "unit.fmu").write_bytes(b"PK")
    for unit, reason in ((tmp_path / "unit.fmu", "is not an FMU"), (tmp_path / "no", "No such")):
        with pytest.raises(CaseError, match=reason):
            exfit.fit(of_fmu(record, unit))


def test_the_package_that_is_missing_is_named(record, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "fmpy", None)
    with pytest.raises(CaseError, match=r'needs the package FMPy: pip install "exfit\[fmu\]"'):
        exfit.fit(of_fmu(record, tmp_path / "unit.fmu"))
