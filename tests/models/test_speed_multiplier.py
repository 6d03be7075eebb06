"""An exciter whose output is multiplied by the speed of its machine."""

import numpy as np
import pytest
from on_load import QUADRATIC, values_on_load
from oracle import system_of, typical_values

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.fitting.build import build_experiments
from exfit.fitting.system import system_of as system_in
from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.models.speed_multiplier import times_speed
from exfit.plants import NETWORK
from exfit.plants.infinite_bus import infinite_bus
from exfit.plants.open_circuit import open_circuit
from exfit.plants.parts import initial
from exfit.plants.playback import playback
from exfit.simulation.inputs import Inputs, InputStep, RecordedInput
from exfit.simulation.simulator import Simulator

GENROU = MACHINES["GENROU"]
END = 4.0
TIMES = np.linspace(0.0, END, 1601)
DRIVING = ("vt", "ifd", "p", "q", "speed")
OUTPUTS = (*DRIVING, "efd")
# behind its state, behind a rectifier, and of a compound source
EXCITERS = ("IEEET1", "AC1A", "IEEET3")


def values_of(name):
    return values_on_load(GENROU, exciter=name, network_Rc=0.0, network_Xc=0.0) | {
        NETWORK + "Q": 0.3,
    }


def swings(model, name, outputs=OUTPUTS, inputs=("vref", "E"), moves=(), recorded=None):
    """Return the signals of a unit whose source dips for a fifth of a second."""
    dips = (InputStep(0.5, -0.3, "E", ramp=0.05), InputStep(0.7, 0.3, "E", ramp=0.05), *moves)
    plant = infinite_bus(model, GENROU, QUADRATIC, inputs)
    simulator = Simulator(plant, Inputs(0.0, END, dips, recorded or {}), TIMES, 2.5e-3)
    return simulator.response(values_of(name), outputs).signals


@pytest.mark.parametrize("name", EXCITERS)
def test_at_rated_speed_it_changes_nothing(name):
    """To the last bit: on open circuit the speed is the number 1."""
    steps = Inputs(0.0, 2.0, (InputStep(0.5, 0.05),))
    multiplied = open_circuit(times_speed(MODELS[name]), GENROU, QUADRATIC)
    got, plain = (
        Simulator(plant, steps, np.linspace(0.0, 2.0, 201), 2.5e-3).response(typical_values(name))
        for plant in (multiplied, system_of(name))
    )
    for signal in ("vt", "efd", "ifd"):
        np.testing.assert_array_equal(got.signals[signal], plain.signals[signal])


def test_what_is_seen_is_the_state_of_the_exciter_times_the_speed():
    got = swings(times_speed(MODELS["IEEET1"]), "IEEET1", ("efd", "EFD", "speed"))
    assert np.abs(got["speed"] - 1.0).max() > 3e-3
    np.testing.assert_allclose(got["efd"], got["EFD"] * got["speed"], rtol=1e-14)


def test_the_machine_is_fed_by_the_product():
    """Its response is another one, by as much as the speed is from 1."""
    model = MODELS["IEEET1"]
    plain, multiplied = swings(model, "IEEET1"), swings(times_speed(model), "IEEET1")
    apart = {name: np.abs(multiplied[name] - plain[name]).max() for name in ("efd", "vt", "ifd")}
    assert apart["efd"] > 3e-3
    assert min(apart.values()) > 1e-4


@pytest.mark.parametrize("name", EXCITERS)
def test_what_a_unit_does_on_load_is_what_its_record_plays_back(name):
    """The states follow vt, ifd, p and q; the product follows the recorded speed."""
    model = times_speed(MODELS[name])
    record = swings(model, name)
    values = {symbol: value for symbol, value in values_of(name).items() if "." not in symbol}
    values |= {initial(signal): record[signal][0] for signal in OUTPUTS}
    recorded = {name: RecordedInput(TIMES, record[name] - record[name][0]) for name in DRIVING}
    plant = playback(model, QUADRATIC, DRIVING)
    played = Simulator(plant, Inputs(0.0, END, (), recorded), TIMES, 2.5e-3)
    got = played.response({key: values[key] for key in plant.parameters}).signals["efd"]
    # vt and ifd jump with the source, and between two samples the record is a line
    print(name, np.abs(got - record["efd"]).max() / np.ptp(record["efd"]))
    assert np.abs(got - record["efd"]).max() < 5e-3 * np.ptp(record["efd"])
    unplayed = got / record["speed"]
    assert np.abs(got - unplayed).max() > 3e-3


def test_behind_an_open_breaker_it_follows_the_recorded_speed():
    speed = RecordedInput(TIMES, np.where(TIMES > 1.0, 0.05 * (TIMES - 1.0), 0.0))
    got = swings(
        times_speed(MODELS["IEEET1"]),
        "IEEET1",
        ("efd", "EFD", "speed"),
        ("vref", "E", "breaker", "speed"),
        (InputStep(1.0, 1.0, "breaker"),),
        {"speed": speed},
    )
    assert got["speed"][-1] == pytest.approx(1.15, abs=1e-9)
    np.testing.assert_allclose(got["efd"], got["EFD"] * got["speed"], rtol=1e-14)


def case_of(text, folder):
    path = folder / "case.yaml"
    path.write_text(text)
    return load_case(path)


PLAYBACK = """\
model: IEEET1
efd_times_speed: true
plant: {type: playback}
record: {file: record.csv, time: t, channels: {vt: vt, ifd: ifd, efd: efd}}
test: {steady_until: 0.5}
"""


def test_a_case_asks_for_it_and_a_playback_then_needs_the_speed(tmp_path):
    (tmp_path / "record.csv").write_text(
        "t,vt,ifd,efd,speed\n"
        + "".join(f"{k / 100},1.0,1.1,{1.1 * (1 + k / 1e4)},{1 + k / 1e4}\n" for k in range(400))
    )
    with pytest.raises(CaseError, match=r"channels\.speed: missing; it drives IEEET1"):
        build_experiments(case_of(PLAYBACK, tmp_path))
    text = PLAYBACK.replace("efd: efd}", "efd: efd, speed: speed}")
    case = case_of(text, tmp_path)
    assert case.parts.exciter is times_speed(MODELS["IEEET1"])
    assert len(build_experiments(case)) == 1
    assert "speed" in system_in(case).inputs
    plain = case_of(text.replace("true", "false"), tmp_path)
    assert plain.parts.exciter is MODELS["IEEET1"]


def test_without_an_exciter_it_is_refused(tmp_path):
    text = PLAYBACK.replace("type: playback", "type: machine-playback, machine: ONE_AXIS")
    text = text.replace("model: IEEET1\n", "")
    with pytest.raises(CaseError, match="efd_times_speed: not allowed with plant machine-playback"):
        case_of(text, tmp_path)
