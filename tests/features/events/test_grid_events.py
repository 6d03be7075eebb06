"""Several grid events of one unit: each has its own operating point, all share the parameters."""

import pytest
import yaml
from grid_events import SIGNALS, TRUTH, event_case, recorded
from places import CONFIGS, REFERENCE

from exfit import cli
from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.fitting.build import build_experiments
from exfit.workflows import fit, simulate, validate

POINTS = {
    "trip": {"P": 0.8, "Q": 0.1, "vt0": 1.0},
    "night": {"P": 0.4, "Q": -0.15, "vt0": 1.02},
    "peak": {"P": 0.95, "Q": 0.3, "vt0": 1.01},
}
NOISE = 1e-4
VS = [[0, 0], [5, 0], [5.3, 0.03], [6, -0.02], [7, 0], [12, 0]]


@pytest.fixture(scope="module")
def events(tmp_path_factory):
    """Write the records of three events."""
    folder = tmp_path_factory.mktemp("events")
    for seed, (name, point) in enumerate(POINTS.items()):
        recorded(folder / f"{name}.csv", noise=NOISE, seed=seed, **point)
    recorded(folder / "other.csv", noise=NOISE, seed=9, K=125.0)
    return folder


@pytest.fixture(scope="module")
def fitted(events):
    path = event_case(events, "trip", "night", validate=["peak"])
    return path, fit(path)


def test_each_event_starts_from_its_own_operating_point(events):
    case = load_case(event_case(events, "trip", "night", free=False))
    for setup in build_experiments(case):
        point = POINTS[setup.name]
        own = setup.experiment.own
        # means of 120 samples before the event
        for name, level in (("p0", point["P"]), ("q0", point["Q"]), ("vt0", point["vt0"])):
            assert own[name] == pytest.approx(level, abs=5e-5), name
        assert setup.test.steady == pytest.approx(2.0, abs=0.1)


@pytest.mark.long
def test_events_share_the_parameters_and_a_third_one_is_met(fitted):
    """The noise that drives biases slightly: K by less than 3 %, TE, the least sure, by 10 %."""
    _, result = fitted
    assert result.success
    assert result.parameters["K"].value == pytest.approx(TRUTH["K"], rel=0.03)
    assert result.parameters["TE"].value == pytest.approx(TRUTH["TE"], rel=0.1)
    (peak,) = result.validation
    assert peak.accepted
    assert peak.is_event
    assert set(peak.played.driving) == {"vt", "frequency"}
    assert {signal: error.at_rest for signal, error in peak.played.errors.items()} == (
        pytest.approx({"p": 0.0, "q": 0.0}, abs=5e-5)
    )


@pytest.mark.long
def test_an_event_by_hand_finds_its_own_rest(events, fitted):
    """Of a unit with another gain Q is not accepted, while P would be."""
    path, result = fitted
    peak = validate(path, result, events / "peak.csv")[-1]
    assert peak.rmse == pytest.approx(result.validation[0].rmse, rel=1e-6)
    assert peak.steps == ()
    other = validate(path, result, events / "other.csv")[-1]
    assert not other.accepted
    assert "on other the error of q is" in other.reason


@pytest.mark.long
def test_steps_are_none_of_an_event_by_hand(events, fitted):
    path, result = fitted
    with pytest.raises(CaseError, match=r"step and at: not allowed with plant grid-playback"):
        validate(path, result, events / "peak.csv", at=2.0)


def test_a_recorded_stabiliser_drives_the_unit_in_its_place(tmp_path):
    """The corners of its lines lie between samples of the record: they cost 1e-4."""
    recorded(tmp_path / "pss.csv", vs=VS)
    case = event_case(tmp_path, "pss", free=False, signals=(*SIGNALS, "vs"))
    driven = simulate(case).comparison
    assert driven.channels["q"].rmse < 2e-4
    assert "vs" in driven.played.driving
    alone = simulate(event_case(tmp_path, "pss", free=False)).comparison
    assert alone.channels["q"].rmse > 10.0 * driven.channels["q"].rmse


def test_the_recorded_output_of_a_stabiliser_is_not_added_to_it(tmp_path):
    stabiliser = {"model": "STAB1"}
    path = event_case(tmp_path, "pss", signals=(*SIGNALS, "vs"), stabiliser=stabiliser)
    with pytest.raises(CaseError, match=r"channels\.vs: not allowed with a stabiliser, whose"):
        load_case(path)


@pytest.mark.long
def test_a_model_as_it_is_is_verified_without_a_fit(events, tmp_path, capsys):
    """A planner's data, nothing of it free: each event is validated."""
    path = event_case(events, "trip", "night", free=False)
    trip, night = validate(path, {})
    assert trip.validation
    assert trip.accepted
    assert night.accepted
    with pytest.raises(SystemExit) as ended:
        cli.main(args=["validate", str(path), "-o", str(tmp_path / "run")], prog_name="exfit")
    assert not ended.value.code
    assert "values of the case, which has no free parameter" in capsys.readouterr().out


@pytest.mark.long
def test_governor_regulator_and_inertia_are_found_in_one_event_of_another_simulator(tmp_path):
    """Without noise; the other one rounds the rectifier's constants, which costs 0.2 %."""
    content = yaml.safe_load((CONFIGS / "grid_event.yaml").read_text())
    content["governor"] = {
        "model": "TGOV1",
        "parameters": {"VMAX": 1.2, "VMIN": 0.0, "T2": 2.1, "Dt": 0.0},
        "free": {
            "R": {"start": 0.04, "min": 0.02, "max": 0.2},
            "T1": {"start": 0.3, "min": 0.05, "max": 2.0},
            "T3": {"start": 5.0, "min": 1.0, "max": 20.0},
        },
    }
    channels = {signal: signal for signal in ("vt", "angle", "p", "q")}
    file = str(REFERENCE / "playback_ac8b_tgov1.csv")
    content["record"] = {"file": file, "time": "t", "channels": channels}
    content["estimate"] = {"search": "local"}
    path = tmp_path / "case.yaml"
    path.write_text(yaml.safe_dump(content))
    found = fit(path, given="exact").parameters
    truth = {"KPR": 80.0, "KIR": 5.0, "TE": 1.2, "machine.H": 4.471}
    truth |= {"governor.R": 0.05, "governor.T1": 0.4, "governor.T3": 7.0}
    assert {name: found[name].value for name in truth} == pytest.approx(truth, rel=3e-3)
