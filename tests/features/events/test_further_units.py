"""Several units at one point of measurement: their sum is played, compared and fitted."""

import numpy as np
import pytest
import yaml
from grid_events import FIXED, TRUTH, UNIT, event_case, recorded
from on_load import QUADRATIC, values_on_load

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.features.events.grid_playback import TRANSFORMER, grid_playback
from exfit.models import GOVERNORS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.plants import GOVERNOR, NETWORK, STABILISER, VT0, Stabilised
from exfit.plants.further import FurtherUnit
from exfit.plants.unit import UnitOnLoad
from exfit.simulation.inputs import Inputs, InputStep, each
from exfit.simulation.simulator import Simulator
from exfit.workflows import fit, simulate

BASE, POWERS = 0.6, ((0.7, 0.2), (0.9, -0.1))  # of each unit, pu of its own base
TIMES = np.arange(0.0, 3.0, 0.02)
PLAYED = Inputs(
    0.0, TIMES[-1], (InputStep(0.2, -0.1, "vt", ramp=0.1), InputStep(0.5, 0.3, "angle", ramp=0.5))
)


def two_units(power_at="recorded-voltage"):
    """Return two different units, each alone and both together, with their values."""
    pss = Stabilised(STABILISERS["PSS1A"], ("speed",))
    parts = [
        UnitOnLoad(MODELS["SEXS"], MACHINES["GENROU"], QUADRATIC),
        UnitOnLoad(
            MODELS["EXST1"], MACHINES["GENSAL"], QUADRATIC, pss, governor=GOVERNORS["TGOV1"]
        ),
    ]
    alone, values = [], []
    for unit, (P, Q) in zip(parts, POWERS, strict=True):
        own = values_on_load(unit.machine, exciter=unit.exciter.name)
        own = {name: x for name, x in own.items() if not name.startswith(NETWORK)}
        network = typical(TRANSFORMER) | {"X": 0.1 + 0.1 * P, "R": 0.01}
        own |= {NETWORK + name: x for name, x in network.items()}
        own |= {"p0": P, "q0": Q, "speed0": 1.0}
        for prefix, model in unit.added:
            own |= {prefix + name: x for name, x in typical(model.sheet).items()}
        alone.append(grid_playback(unit, power_at=power_at))
        values.append({name: own[name] for name in alone[-1].parameters})
    first, second = parts
    further = FurtherUnit(second.exciter, second.machine, pss, second.governor, "unit2.")
    both = grid_playback(first, power_at=power_at, further=(further,))
    P, Q = (a + BASE * b for a, b in zip(*POWERS, strict=True))
    shares = {"base": BASE, "share_P": BASE * POWERS[1][0] / P, "share_Q": BASE * POWERS[1][1] / Q}
    joint = {"unit2." + name: x for name, x in values[1].items()} | values[0] | {"p0": P, "q0": Q}
    joint |= {f"unit2.{NETWORK}{name}": x for name, x in shares.items()}
    return alone, values, both, {name: joint[name] for name in both.parameters}


@pytest.mark.parametrize("power_at", ["recorded-voltage", "terminals"])
def test_the_sum_is_that_of_units_played_alone(power_at):
    alone, values, both, joint = two_units(power_at)
    one, two = (
        Simulator(system, PLAYED, TIMES, 1e-3).response(own).signals
        for system, own in zip(alone, values, strict=True)
    )
    got = Simulator(both, PLAYED, TIMES, 1e-3).response(joint).signals
    for signal in ("p", "q"):
        theirs = one[signal] + BASE * two[signal]
        np.testing.assert_allclose(got[signal], theirs, rtol=0.0, atol=1e-12)
    for name in {*alone[1].states} - {"delta"}:
        np.testing.assert_allclose(got[f"unit2.{name}"], two[name], rtol=0.0, atol=1e-12)
    assert np.ptp(two["governor.V1"]) > 1e-4
    assert np.ptp(one["efd"] - got["efd"]) < 1e-12
    if power_at == "recorded-voltage":
        apparent = np.hypot(got["p"], got["q"])
        np.testing.assert_allclose(got["it"] * got["vt"], apparent, rtol=0.0, atol=1e-12)


def test_exact_derivatives_reach_all_units():
    _, _, both, joint = two_units()
    simulator = Simulator(both, PLAYED, TIMES[::10], 1e-3)
    free = ("K", "machine.H", "unit2.KA", "unit2.machine.H", f"unit2.{GOVERNOR}R")
    free += (f"unit2.{STABILISER}KS", f"unit2.{NETWORK}share_P", f"unit2.{NETWORK}base", VT0)
    _, slopes = simulator.tangents(joint, ("p", "q"), each(free))
    for column, name in enumerate(free):
        h = 1e-5 * max(abs(joint[name]), 0.1)
        up, down = simulator.samples_of_many(
            [joint | {name: joint[name] + side * h} for side in (1, -1)], ("p", "q")
        )[0]
        difference = (up - down) / (2.0 * h)
        size = max(np.abs(difference).max(), 1e-4)
        assert np.abs(slopes[:, :, column] - difference).max() < 1e-5 * size, name


NOISE = 5e-5  # pu of p and q
SECOND = {"K": 150.0, "TE": 0.03}
OTHER = {**UNIT, "H": 3.0, "Tpd0": 5.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two events of the sum of two units that are loaded alike."""
    folder = tmp_path_factory.mktemp("sums")
    for name, P, Q, seed in (("one", 0.8, 0.1, 3), ("two", 0.6, 0.3, 4)):
        columns = recorded(folder / f"{name}.csv", P=P, Q=Q)
        path = event_case(folder, name, free=False)
        first = yaml.safe_load(path.read_text())
        second = first | {"parameters": {"fixed": FIXED | SECOND}}
        second["plant"] = first["plant"] | {"parameters": OTHER, "network": {"f0": 60, "X": 0.1}}
        responses = []
        for content in (first, second):
            path.write_text(yaml.safe_dump(content))
            responses.append(simulate(load_case(path), {}).response.signals)
        rng = np.random.default_rng(seed)
        for signal in ("p", "q"):
            both = responses[0][signal] + BASE * responses[1][signal]
            columns[signal] = both + NOISE * rng.standard_normal(both.size)
        header = ",".join(columns)
        rows = np.transpose([*columns.values()])
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=header, comments="")
    return folder


def summed(folder, *names, **changes):
    """Write the case of the sum, where both exciters are unknown; its second unit with changes."""
    share = BASE / (1.0 + BASE)
    starts = {"K": 90.0, "TE": 0.1}
    free = {name: {"start": x, "min": x / 10, "max": x * 10} for name, x in starts.items()}
    unit = {
        "exciter": {"model": "SEXS", "parameters": FIXED, "free": free},
        "machine": {"model": "GENROU", "parameters": OTHER},
        "network": {"X": 0.1, "base": BASE, "share_P": share, "share_Q": share},
    }
    return event_case(folder, *names, further_units=[unit | changes])


@pytest.mark.long
def test_exciters_of_two_units_are_found_from_their_sums(folder):
    case = load_case(summed(folder, "one", "two"))
    assert case.free().keys() == {"unit2.K", "unit2.TE", "K", "TE"}
    result = fit(case)
    truth = TRUTH | {f"unit2.{name}": value for name, value in SECOND.items()}
    for name, value in truth.items():
        parameter = result.parameters[name]
        assert abs(parameter.value - value) < 3.0 * parameter.std_error, name
        assert parameter.std_error < 0.01 * value, name
    assert not any("apparent power" in str(cause) for cause in result.verdict.causes)
    assert result.to_dict()["units"]["unit2.machine"]["H"] == OTHER["H"]
    assert result.values_of("unit2.").keys() == {"K", "TE", *FIXED}
    assert result.values_of("").keys() == {"K", "TE", *FIXED}
    assert {part.heading for part in result.parts if part.further} == {
        "Exciter SEXS of unit2",
        "Machine GENROU of unit2",
        "Network of unit2",
    }


def test_a_load_controller_of_a_further_unit_does_what_that_of_the_first_does(tmp_path):
    """Of two equal units, which share the power, it does not matter which one has it."""
    recorded(tmp_path / "one.csv")
    governor = {"model": "TGOV1", "parameters": {"R": 0.05}}
    free = {"start": 0.5, "min": 0.05, "max": 5.0}
    controller = {"model": "LCFB1", "parameters": {"Kp": 1.0}, "free": {"Ki": free}}
    moved, powers = governor | {"load_controller": controller}, []
    equal = {
        "exciter": {"model": "SEXS", "parameters": FIXED | TRUTH},
        "machine": {"model": "GENROU", "parameters": UNIT},
        "network": {"base": 1.0, "share_P": 0.5, "share_Q": 0.5},
    }
    for first, second in ((moved, governor), (governor, moved)):
        units = {"governor": first, "further_units": [equal | {"governor": second}]}
        case = load_case(event_case(tmp_path, "one", free=False, **units))
        powers.append(simulate(case, {}).response.signals["p"])
    assert case.free().keys() == {"unit2.governor.load_controller.Ki"}
    idle = simulate(case, {"unit2.governor.load_controller.Irmax": 0.0}).response.signals["p"]
    assert np.abs(idle - powers[0]).max() > 1e-3
    np.testing.assert_allclose(powers[0], powers[1], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"network": {"base": 0.6, "share_P": 0.4}}, "[0].network.share_Q: is missing"),
        ({"network": {"base": 0.6, "P": 0.4}}, "[0].network.P: not a parameter of the network"),
        ({"machine": {"model": "GENRUO"}}, "[0].machine.model: 'GENRUO' is not a machine model"),
        ({"exciter": {"model": "SEXS", "parameters": {"KK": 1}}}, "exciter.parameters.KK: not a"),
        (
            {"stabiliser": {"model": "PSS1A", "inputs": ["p", "vt"]}},
            "[0].stabiliser.inputs: 2 given; PSS1A takes 1",
        ),
        ({"governor": {"model": "TGOV1", "parameters": {"R": -1}}}, "governor.parameters.R: -1"),
        (
            {"governor": {"model": "TGOV1", "load_controller": {"model": "LCFB2"}}},
            "[0].governor.load_controller.model: 'LCFB2' is not a load controller model",
        ),
        ({"limiters": []}, "further_units[0].limiters: "),
    ],
)
def test_a_fault_of_a_further_unit_is_reported_with_its_place(tmp_path, changes, says):
    with pytest.raises(CaseError) as refused:
        load_case(summed(tmp_path, "one", **changes))
    assert says in str(refused.value), str(refused.value)


def test_a_plant_without_a_sum_has_no_further_units(tmp_path):
    path = summed(tmp_path, "one")
    content = yaml.safe_load(path.read_text())
    content["plant"] = {"type": "playback"}
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(CaseError, match="further_units: not allowed with plant playback"):
        load_case(path)


def test_a_record_is_not_named_as_a_further_unit(tmp_path):
    with pytest.raises(CaseError, match="'unit2' is taken"):
        load_case(summed(tmp_path, "one", "unit2"))
