"""Fits of a unit that another program simulates."""

import shutil
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from tiers import few_of

import exfit
from exfit.case.case import Case
from exfit.errors import CaseError, SimulationError
from exfit.features.design.experiment_design import identify
from exfit.features.external.case_program import ProgramFunctions
from exfit.results.tables import parameter_file
from exfit.workflows import check, profile, validation_result

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
        "given": "exact",
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
        "given": "exact",
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
@pytest.mark.parametrize("fault", few_of(["error", "die", "nonsense", "short", "nan", "id"], 2))
def test_runs_that_fail_are_made_again(fault, record, native, tmp_path):
    result = exfit.fit(external(record, fault, tmp_path / "runs"))
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)
    assert result.simulations <= 12
    assert any("of which" in note and "failed" in note for note in result.notes)


def test_a_start_that_fails_once_is_run_again(record, native, tmp_path):
    result = exfit.fit(external(record, "start", tmp_path / "runs"))
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)


def test_a_program_that_always_fails_is_quoted(record):
    code = "import sys; sys.exit('the licence has expired')"
    with pytest.raises(SimulationError, match=r"plant.command: .*exit code 1: the licence has exp"):
        exfit.fit(external(record, command=[sys.executable, "-c", code]))


@pytest.mark.long
def test_a_twin_that_differs_leads_to_the_minimum_of_the_program(record, native):
    """Its derivatives are corrected by quotients; those of the twin alone end elsewhere."""
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    result = exfit.fit(external(record, **other, parallel=2))
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)
    assert result.parameters["TE"].value == pytest.approx(native.parameters["TE"].value, rel=0.01)
    # the result is not the minimum of the corrected twin, which has the intervals nevertheless
    for name, parameter in native.parameters.items():
        low, high = result.parameters[name].interval
        own_low, own_high = parameter.interval
        assert high - low == pytest.approx(own_high - own_low, rel=0.3)
        assert low < parameter.value < high
    # what is shown of start and iterations are runs of the program, which it remembers
    start = exfit.simulate(external(record, **other)).response.signals["vt"]
    assert np.array_equal(result.comparisons[0].overlays["vt"].start, start)


def test_the_hash_of_the_script_is_among_those_of_a_result(record, tmp_path):
    plant = external(record).external
    command = [sys.executable, shutil.copy(PROGRAM, tmp_path / "mine.py").name]
    own = {**PLANT, "type": "external", "twin": "open-circuit", "names": dict(plant.names)}
    of_script = case(record, {**own, "command": command}, tmp_path)
    result = exfit.fit(of_script)
    assert result.inputs["program"] == sha256(PROGRAM.read_bytes()).hexdigest()
    assert result.files["program"] == "mine.py"
    assert f"program_sha256: {result.inputs['program']}" in parameter_file(result)
    # as with a model in Python, values of a fit are taken with the fitted program alone
    exfit.simulate(of_script, result)
    (tmp_path / "mine.py").write_text("raise SystemExit('this was run')")
    for again in (exfit.simulate, exfit.validate):
        with pytest.raises(
            CaseError, match=r"mine.py: not run: the file has changed since the fit"
        ):
            again(of_script, result)


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
    match = exfit.validate(external(record, **other), values, record, step=0.05, at=1.0)[-1]
    assert match.rmse == pytest.approx(NOISE, rel=0.2)


def without_twin(record, arguments=(), **changes):
    command = [sys.executable, str(PROGRAM), *arguments]
    own = {"type": "external", "command": command, "names": {"K": "K_A", "T": "machine.Tpd0"}}
    content = {
        "given": "exact",
        "plant": {**own, "parallel": 1 if arguments else 2, "time_limit": 20.0},
        "test": BUMP,
        "record": {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}},
        "parameters": {"fixed": {"TATB": 0.1, "T": 6.0}, "free": FREE},
    }
    return Case.from_dict({**content, **changes}, record)


@pytest.mark.long
def test_without_a_twin_quotients_of_the_programs_runs_lead_to_the_same_minimum(record, native):
    case = without_twin(record)
    result = exfit.fit(case)
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)
    assert result.simulations <= 25
    for name, parameter in native.parameters.items():
        own = result.parameters[name]
        # a quotient over 1e-3 of its parameter is wrong by about as much
        assert own.value == pytest.approx(parameter.value, abs=0.1 * parameter.std_error)
        assert own.std_error == pytest.approx(parameter.std_error, rel=0.02)
    (start,) = result.comparisons
    assert np.array_equal(start.overlays["vt"].start, exfit.simulate(case).response.signals["vt"])


@pytest.mark.long
def test_without_a_twin_every_third_run_may_fail(record, native):
    """Its period is that of a trial with its quotients: it would reject every trial."""
    case = without_twin(record, arguments=["error"])
    result = exfit.fit(case)
    assert result.cost == pytest.approx(native.cost, rel=SAME_COST)
    assert result.simulations <= 70
    assert exfit.fit(case).parameters == result.parameters


@pytest.mark.long
def test_without_a_twin_what_a_record_leaves_open_is_found_by_the_program(record):
    shifted = exfit.Record.from_arrays(record.time + 0.13, dict(record.signals))
    test = {"vt0": 1.0, "vref": [{"at": {"start": 1.05, "min": 1.0, "max": 1.4}, "step": 0.05}]}
    file = {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}}
    validate = [{"name": "later", "test": test, "record": file}]
    case = without_twin(record, validate=validate)
    result = exfit.fit(case.with_record(shifted, "later"))
    (later,) = result.validation
    assert later.rmse == pytest.approx(NOISE, rel=0.2)
    assert [*later.of_record.values()] == pytest.approx([1.13], abs=2e-3)


@pytest.mark.long
def test_without_a_twin_profiles_are_the_programs_own(record, native):
    (found,) = profile(without_twin(record), "K").profiles
    interval = native.parameters["K"].interval
    assert found.low == pytest.approx(interval[0], abs=0.1)
    assert found.high == pytest.approx(interval[1], abs=0.1)


def test_profiles_are_those_of_the_corrected_twin(record, native):
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    profiles = profile(external(record, **other), "K")
    interval = native.parameters["K"].interval
    assert profiles.profiles[0].low == pytest.approx(interval[0], abs=0.2)
    assert profiles.profiles[0].high == pytest.approx(interval[1], abs=0.2)
    assert any("profiles are by the twin, corrected" in note for note in profiles.notes)


def test_without_a_twin_a_check_compares_the_start_with_the_record(record):
    shown = check(without_twin(record))
    assert not shown.has_equations
    assert shown.deviations == {}
    assert 1e-3 < shown.from_program["fit"]["vt"] < 0.05
    with pytest.raises(CaseError, match=r"plant.twin: missing; identify needs the equations"):
        identify(without_twin(record))


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"model": "SEXS"}, "model: only with plant.twin"),
        ({"parameters": {"fixed": {"vt0": 1.0}, "free": FREE}}, "parameters.fixed.vt0: not a name"),
        ({"parameters": {"free": {"machine.H": {"start": 1.0}}}}, "free.machine.H: not a name"),
        ({"parameters": {"free": {"K": {"start": 1.0}}}}, "parameters.free.K.min: is missing"),
        ({"as_found": {"model": "SEXS"}}, "as_found.model: only with plant.twin"),
    ],
)
def test_faults_without_a_twin_are_named(changes, place, record):
    with pytest.raises(CaseError, match=place):
        without_twin(record, **changes)


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"network": {"X": 0.1}}, "plant.network: not allowed with twin open-circuit"),
        ({"names": {"KQ": "x"}}, "plant.names.KQ: not a parameter"),
        ({"machine": None}, "plant.machine: has no value"),
        ({"command": []}, "plant.command: 0 entries; at least 1 needed"),
        ({"twin": "playback"}, "plant.twin: 'playback' is not possible"),
    ],
)
def test_faults_of_the_section_are_named(changes, place, record):
    with pytest.raises(CaseError, match=place):
        external(record, **changes)


def test_what_only_shows_the_twin_does_not_start_the_program(record, tmp_path):
    code = f"open({str(tmp_path / 'started')!r}, 'w'); raise SystemExit"
    of_marker = external(record, command=[sys.executable, "-c", code])
    identify(of_marker)
    with pytest.raises(CaseError, match="not allowed with rank: the program has one exciter"):
        exfit.rank(of_marker, ["SEXS"])
    assert not (tmp_path / "started").exists()
    with pytest.raises(SimulationError):
        check(of_marker)
    assert (tmp_path / "started").exists()


def test_a_global_search_is_refused(record):
    with pytest.raises(CaseError, match="search: global: not allowed with plant external"):
        exfit.fit(external(record), search="global")


AS_FOUND = {"source": "base.dyr", "parameters": {"K": 120.0, "TE": 0.1, "TB": 5.0}}


def as_found_case(record, **as_found):
    """Return a case whose twin differs, with a model as found."""
    other = {"machine": "GENSAL", "parameters": {**PLANT["parameters"], "Tppd0": 0.2}}
    plain = external(record, **other)
    section = type(plain).from_dict(
        {
            "model": "SEXS",
            "plant": {**PLANT, "type": "external", "twin": "open-circuit", **other,
                      "command": [sys.executable, str(PROGRAM)], "names": {"K": "K_A"}},
            "test": BUMP,
            "record": {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}},
            "parameters": {"fixed": {k: v for k, v in TRUTH.items() if k not in FREE},
                           "free": FREE},
            "as_found": as_found,
        },
        record,
    )  # fmt: skip
    return plain, section


@pytest.mark.long
def test_the_model_as_found_is_run_by_the_program(record):
    plain, stated = as_found_case(record, **AS_FOUND)
    by_program = exfit.simulate(plain, AS_FOUND["parameters"]).response.signals["vt"]
    result = exfit.fit(stated)
    (match,) = result.as_found.comparisons
    assert np.array_equal(match.overlays["vt"].simulated, by_program)
    validated = validation_result(stated, None)
    assert np.array_equal(validated.matches[0].overlays["vt"].simulated, by_program)
    assert validated.other_program.runs == 1
    fitted = {name: TRUTH[name] for name in FREE}
    (match, _) = validation_result(stated, fitted, record).as_found.comparisons
    assert np.array_equal(match.overlays["vt"].simulated, by_program)


@pytest.mark.long
def test_another_exciter_as_found_is_not_compared(record):
    _, stated = as_found_case(record, source="base.dyr", model="AC4A")
    with pytest.raises(CaseError, match=r"as_found.model: AC4A: the program simulates SEXS only"):
        validation_result(stated, None)
    assert "the program simulates SEXS only" in exfit.fit(stated).as_found.why


def test_what_the_twin_alone_shows_is_named(record):
    shown = exfit.simulate(external(record))
    (note,) = [note for note in shown.notes if "not corrected" in note]
    assert note.endswith(
        "gives vt; all other signals are those of the twin open-circuit, not corrected"
    )
    assert identify(external(record)).notes[0].startswith("these are the standard errors of the tw")
    assert not any("twin" in note for note in exfit.simulate(without_twin(record)).notes)
