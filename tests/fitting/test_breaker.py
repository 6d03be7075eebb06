"""Machine data from a breaker that opens: what a fit finds, how sure it is, and what it is not."""

import numpy as np
import pytest
from places import CONFIGS
from rejection_cases import (
    D_AXIS,
    OPENS,
    Q_AXIS,
    REACTIVE,
    TRUE,
    case_of,
    content_of,
    of_machine,
    on_the_q_axis,
)
from rejection_record import FILE, UNIT, rejection_record
from rejection_record import OPENS as OPENS_IN_SAMPLE
from tiers import few_of
from typed_rejection import Load, recorded_rejection

import exfit
from exfit.case.case import Case
from exfit.case.load import load_case
from exfit.errors import RecordError
from exfit.fitting.build import build_experiments
from exfit.fitting.nuisances import names_of
from exfit.records.record import Record


@pytest.mark.long
def test_a_reactive_rejection_determines_the_d_axis_and_says_what_it_does_not():
    """X'd and T'd0 to 2 %, X''d to 5 %; nothing of the q axis nor of the inertia acts."""
    free = D_AXIS | {"Xq": 0.9, "H": 1.2}
    result = exfit.fit(case_of(REACTIVE, free, seed=3, opens={"start": "auto"}))
    found = of_machine(result)
    for name, within in (("Xpd", 0.02), ("Tpd0", 0.02), ("Xppd", 0.05), ("Xd", 0.02)):
        assert found[name].value == pytest.approx(TRUE[name], rel=within), name
        low, high = found[name].interval
        assert high - low < within * TRUE[name], name
    for name in ("Xq", "H"):
        assert found[name].interval is None
        assert found[name].why == "has no effect on the record"
    assert found["breaker.opens"].value == pytest.approx(OPENS, abs=2e-4)
    assert result.verdict.verdict == "matches, not all determined"


def test_a_rejection_on_the_q_axis_determines_that_axis():
    """X''d counts on both axes of a GENROU; the speed is compared: its slope is P / 2H."""
    load = on_the_q_axis(0.25)
    result = exfit.fit(case_of(load, Q_AXIS, ("vt", "ifd"), end=3.0, seed=5))
    for name, parameter in of_machine(result).items():
        if name in TRUE:
            assert parameter.value == pytest.approx(TRUE[name], rel=0.02), name
            assert abs(parameter.value - TRUE[name]) < 4.0 * parameter.std_error, name


@pytest.mark.long
def test_the_intervals_of_a_rejection_hold_the_truth():
    """Of 20 records, with the instant to be found: 95 % intervals; 16 of 20 is 2.9 sigma below."""
    held = dict.fromkeys((*D_AXIS, "breaker.opens", "vt0"), 0)
    truth = TRUE | {"breaker.opens": OPENS, "vt0": 1.0}
    for seed in range(20):
        result = exfit.fit(case_of(REACTIVE, D_AXIS, end=6.0, seed=seed, opens={"start": "auto"}))
        for name, parameter in of_machine(result).items():
            low, high = parameter.interval
            held[name] += low <= truth[name] <= high
    assert min(held.values()) >= 16, held


def test_the_sample_of_a_rejection_gives_back_the_data_of_its_unit():
    """Another integrator computed it; the default search, and intervals of all that is found."""
    found = of_machine(exfit.fit(load_case(CONFIGS / "rejection.yaml")))
    for name, true in {**UNIT, "breaker.opens": OPENS_IN_SAMPLE, "vt0": 1.0}.items():
        if name in found:
            low, high = found[name].interval
            assert low < true < high, name
    assert {*D_AXIS} < found.keys()


def test_that_record_is_what_its_script_makes():
    made = np.loadtxt(rejection_record().splitlines(), delimiter=",", skiprows=1)
    kept = np.loadtxt(FILE, delimiter=",", skiprows=1)
    assert np.abs(made - kept).max() < 1.1e-5  # a digit may round the other way


def test_the_level_before_the_opening_is_found_with_the_rest():
    """A jump is no surer than the level that it leaves; with a given vt0 that level is sure."""
    case = case_of(REACTIVE, D_AXIS)
    (setup,) = build_experiments(case)
    assert [parameter.name for parameter in setup.free] == ["vt0"]
    assert tuple(names_of(case.recordings[0])) == ("vt0",)


def test_the_instant_is_found_between_the_samples_of_the_jump():
    case = case_of(REACTIVE, D_AXIS, opens={"start": "auto"})
    (setup,) = build_experiments(case)
    opens = next(p for p in setup.free if p.name == "breaker.opens")
    assert 1.0 < opens.low < opens.start < opens.high < 1.001
    assert {*names_of(case.recordings[0])} == {"vt0", "breaker.opens"}
    assert setup.test.steady == opens.low


def test_where_the_recorder_averages_vt_another_signal_shows_the_instant():
    case = case_of(REACTIVE, D_AXIS, opens={"start": "auto"})
    record = case.given_records["fit"]
    window = np.ones(21) / 21.0
    smeared = np.convolve(record.signals["vt"], window, mode="same")
    signals = {"vt": smeared, "ifd": record.signals["ifd"]}
    inside = (record.time > 0.5) & (record.time < 9.0)
    signals = {name: samples[inside] for name, samples in signals.items()}
    (setup,) = build_experiments(case.with_record(Record.from_arrays(record.time[inside], signals)))
    opens = next(p for p in setup.free if p.name == "breaker.opens")
    assert opens.low < OPENS < opens.high
    assert opens.high - opens.low < 1e-3


def test_bounds_say_where_the_jump_is_looked_for():
    case = case_of(REACTIVE, D_AXIS, opens={"start": "auto", "min": 3.0, "max": 5.0})
    with pytest.raises(RecordError, match="no jump stands out"):
        build_experiments(case)


def with_exciter(case):
    """Return a case on load with an exciter in service, of which a parameter is free."""
    (recording,) = case.recordings
    content = content_of(Load(0.3, -0.2), D_AXIS | Q_AXIS, ("vt", "ifd"), opens={"start": "auto"})
    content["plant"] |= {
        "type": "infinite-bus",
        "network": {"f0": 50, "X": 0.3, "P": 0.3, "Q": -0.2},
    }
    content |= {"model": "SEXS", "parameters": {"fixed": {"EMAX": 99.0, "EMIN": -99.0}}}
    content["parameters"]["free"] = {"K": {"start": 30.0, "min": 3.0, "max": 300.0}}
    return Case.from_dict(content, case.given_records[recording.name])


@pytest.mark.parametrize("plant", few_of([lambda case: case, with_exciter], 1))
def test_derivatives_to_all_that_a_rejection_finds_are_exact(plant):
    """Beside central differences of the response, to the instant among them."""
    case = plant(case_of(Load(0.3, -0.2), D_AXIS | Q_AXIS, end=2.0, opens={"start": "auto"}))
    (setup,) = build_experiments(case)
    experiment = setup.experiment
    at = setup.with_start_values(case.values())
    names = [*case.free(), "vt0", "breaker.opens"]
    _, slopes = experiment.response_with_derivatives(at, [{name: 1.0} for name in names])
    for k, name in enumerate(names):
        step = 1e-5 * max(abs(at[name]), 1.0)
        step = min(step, 1e-5) if name == "breaker.opens" else step
        above = experiment.samples({**at, name: at[name] + step})[0]
        below = experiment.samples({**at, name: at[name] - step})[0]
        size = np.abs(slopes[:, :, k]).max()
        error = np.abs((above - below) / (2.0 * step) - slopes[:, :, k]).max()
        assert error < 1e-5 * max(size, 1.0), name


def test_a_record_without_a_jump_gives_no_instant():
    time = np.linspace(0.0, 5.0, 501)
    smooth = 1.0 - 0.1 * np.clip(time - 1.0, 0.0, 1.0)
    record = Record.from_arrays(time, {"vt": smooth, "ifd": smooth})
    content = content_of(REACTIVE, {}, ("vt", "ifd"), opens={"start": "auto"})
    with pytest.raises(RecordError, match=r"no jump stands out.*give start, min and max"):
        build_experiments(Case.from_dict(content, record))


@pytest.mark.long
def test_a_recorded_speed_drives_vt_and_a_simulated_one_is_compared():
    load = Load(0.4, -0.1)
    driven = case_of(load, {"Tpd0": 1.1}, driving=("speed",), end=3.0)
    (setup,) = build_experiments(driven)
    assert setup.experiment.signals == ("vt", "ifd")
    assert {*setup.experiment.simulator.inputs.recorded} == {"speed"}
    signals = ("vt", "ifd", "speed")
    compared = case_of(load, {"H": 1.2}, signals, end=3.0, speed="simulated")
    (setup,) = build_experiments(compared)
    assert setup.experiment.signals == signals
    result = exfit.fit(compared)
    assert of_machine(result)["H"].value == pytest.approx(3.5, rel=1e-3)
    assert any("constant mechanical power, 0.4 pu" in note for note in result.notes)
    noted = exfit.simulate(driven, {}).notes
    assert not any("mechanical power" in note for note in noted)


def test_a_rejection_may_be_a_record_of_a_case_with_an_exciter():
    """The machine alone in one record, the exciter on the same machine in another one."""
    time = np.arange(0.0, 3.0, 0.005)
    shown = recorded_rejection("GENROU", TRUE, REACTIVE, OPENS, time)
    rejection = Record.from_arrays(time, {"vt": shown["vt"], "ifd": shown["ifd"]})
    bump = Record.from_arrays(time, {"vt": np.full(len(time), 1.0)})
    alone = {"type": "machine-on-load", "network": {"P": 0.0, "Q": -0.3}}
    channels = {"channels": {"vt": {}, "ifd": {}}}
    content = {
        "model": "SEXS",
        "plant": {"type": "open-circuit", "machine": "GENROU", "parameters": TRUE},
        "parameters": {"fixed": {"K": 30.0}},
        "records": [
            {"name": "up", "test": {"vref": [{"at": 1.0, "step": 0.01}]}, "record": {}},
            {
                "name": "rejection",
                "plant": alone,
                "test": {"breaker": {"opens": OPENS}},
                "record": channels,
            },
        ],
    }
    content["records"][0]["record"] = {"channels": {"vt": {}}}
    case = Case.from_dict(content, {"up": bump, "rejection": rejection})
    step, opening = build_experiments(case)
    opening = opening.with_enough_substeps(case.values())
    assert "breaker" not in step.experiment.simulator.system.inputs
    response = opening.response(case.values()).signals
    assert np.abs(response["vt"] - shown["vt"]).max() < 1e-6
    assert np.abs(response["ifd"] - shown["ifd"]).max() < 1e-6
