"""Cases on load: what the file may say, what it must, and what comes of it."""

from math import pi

import numpy as np
import pytest
from places import ROOT
from tiers import few_of

from exfit.case.load import load_case
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import input_steps
from exfit.fitting.system import inputs_of, system_of
from exfit.output.run_folder import PARAMETERS, write_fit
from exfit.verdict.run_quality import typical_notes
from exfit.workflows import fit, simulate
from exfit.workflows.given_values import changed_values, read_parameters

ON_LOAD = """\
model: SEXS
plant:
  type: infinite-bus
  machine: GENROU
  parameters: {Tppd0: 0.035, H: 4.0}
  free: {}
  network: {f0: 50, R: 0.01, X: 0.3, P: 0.8, Q: 0.2}
stabiliser: {model: PSS1A, inputs: [p], parameters: {KS: 0.5}}
test:
  vt0: 1.0
  duration: 5.0
  vref: [{at: 1.0, step: 0.01}]
  vs: [{at: 2.0, step: -0.005}]
  network: [{at: 3.0, X: 0.4}, {at: 4.0, X: 0.3}]
parameters: {fixed: {K: 50, EMAX: 9, EMIN: -9}}
"""


def written(folder, *input_steps):
    text = ON_LOAD
    for old, new in input_steps:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "case.yaml"
    path.write_text(text)
    return path


def test_a_case_on_load_has_the_signals_of_its_plant(tmp_path):
    case = load_case(written(tmp_path))
    response = simulate(case, {}).response
    assert {"p", "q", "it", "delta", "speed"} <= response.signals.keys()
    assert response.signals["p"][0] == pytest.approx(0.8, rel=1e-9)
    assert response.signals["q"][0] == pytest.approx(0.2, rel=1e-9)
    assert response.signals["speed"][0] == 1.0
    # what a test does not touch is no input of the machine code
    assert inputs_of(case) == ("vref", "vs", "X")


@pytest.mark.parametrize("kind", ["[infinite-bus]", "{}", "[[1, 2]]"])
def test_a_kind_of_plant_that_is_no_word_is_a_fault(tmp_path, kind):
    with pytest.raises(CaseError, match=r"plant\.type: .* is not possible; "):
        load_case(written(tmp_path, ("type: infinite-bus", f"type: {kind}")))


def test_a_switch_says_what_the_network_has_from_then_on(tmp_path):
    """There and back: the swing is left, and the voltage at rest is that before the trip."""
    steps = "  vref: [{at: 1.0, step: 0.01}]\n  vs: [{at: 2.0, step: -0.005}]\n"
    long = (("duration: 5.0", "duration: 60.0"), (steps, ""), ("H: 4.0", "H: 4.0, D: 20.0"))
    signals = simulate(load_case(written(tmp_path, *long)), {}).response.signals
    assert signals["vt"][-1] == pytest.approx(signals["vt"][0], abs=1e-5)
    stays = (*long, (", {at: 4.0, X: 0.3}", ""))
    signals = simulate(load_case(written(tmp_path, *stays)), {}).response.signals
    assert signals["delta"][-1] > signals["delta"][0] + 0.05


def test_values_of_every_part_can_be_set_by_name(tmp_path):
    case = load_case(written(tmp_path))
    given = {"network.X": 0.35, "machine.H": 5.0, "stabiliser.KS": 1.0, "K": 60.0}
    assert changed_values(case, given, "--set") == given
    one, other = simulate(case, {}).response, simulate(case, given).response
    assert one.signals["delta"][0] != other.signals["delta"][0]
    with pytest.raises(CaseError, match=r"--set: machine\.HH: not a parameter; did you mean"):
        changed_values(case, {"machine.HH": 5.0}, "--set")


def test_a_switch_goes_to_its_value_from_whatever_was_set_before(tmp_path):
    """--set changes the start, not where the switch leads to."""
    case = load_case(written(tmp_path, (", {at: 4.0, X: 0.3}", "")))
    one = simulate(case, {"network.X": 0.35}).response.signals["vt"]
    case = load_case(written(tmp_path, (", {at: 4.0, X: 0.3}", ""), ("X: 0.3,", "X: 0.35,")))
    np.testing.assert_array_equal(one, simulate(case, {}).response.signals["vt"])


def test_steps_and_switches_of_the_source_follow_each_other(tmp_path):
    """A sag, and a switch to a voltage: what holds then is what the switch says."""
    source = (("Q: 0.2", "E: 1.0"), ("  vs: [{at: 2.0, step: -0.005}]\n", ""))
    events = "  E: [{at: 1.5, step: -0.05}]\n  network: [{at: 3.0, E: 1.0}]\n"
    steps = "  network: [{at: 3.0, X: 0.4}, {at: 4.0, X: 0.3}]\n"
    case = load_case(written(tmp_path, *source, (steps, events)))
    found = input_steps(case, case.test, case.values())
    assert [(one.at, one.signal) for one in found] == [(1.0, "vref"), (1.5, "E"), (3.0, "E")]
    assert found[1].step + found[2].step == pytest.approx(0.0, abs=1e-12)
    gone = events.replace("-0.05", "-1.5")
    with pytest.raises(CaseError, match=r"at 1\.5 s the source falls to -0\.5 pu"):
        simulate(load_case(written(tmp_path, *source, (steps, gone))), {})


def test_a_source_jumps_in_angle_by_degrees_or_radians_or_a_table(tmp_path):
    steps = "  network: [{at: 3.0, X: 0.4}, {at: 4.0, X: 0.3}]\n"
    forms = {
        "deg": "[{at: 2.0, step: -9, unit: deg}, {at: 3.0, step: 18, unit: deg, ramp: 0.5}]",
        "rad": f"[{{at: 2, step: {-pi / 20}, unit: rad}}, {{at: 3, step: {pi / 10}, unit: rad, "
        "ramp: 0.5}]",
        "table": "{table: [[0, 5], [2, 5], [2, -4], [3, -4], [3.5, 14], [5, 14]], unit: deg}",
    }
    powers = []
    for angle in forms.values():
        case = load_case(written(tmp_path, (steps, f"  angle: {angle}\n")))
        assert inputs_of(case) == ("vref", "vs", "angle")
        powers.append(simulate(case, {}).response.signals["p"])
    np.testing.assert_allclose(powers[0], powers[1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(powers[0], powers[2], rtol=0, atol=1e-9)
    assert np.ptp(powers[0]) > 0.1


@pytest.mark.parametrize(
    ("angle", "says"),
    [
        ("[{at: 2, step: -9}]", "test.angle[0].unit: is missing"),
        ("[{at: 2, step: 9, unit: grad}]", "test.angle[0].unit: 'grad' is not possible"),
        ("[{at: 2, step: 0, unit: deg}]", "test.angle[0].step: 0 is not a step"),
        ("[{at: 2, step: 1, unit: deg}, {at: 1, step: 1, unit: deg}]", "1 s is not after 2 s"),
        ("{table: [[0, 1], [4, 2]], unit: deg}", "0 ... 4 s does not cover the test, 0 ... 5 s"),
        ("recorded", "test.angle: "),
    ],
)
def test_a_fault_of_the_angle_of_the_source_is_reported_with_its_place(tmp_path, angle, says):
    network = "  network: [{at: 3.0, X: 0.4}, {at: 4.0, X: 0.3}]\n"
    path = written(tmp_path, (network, f"  angle: {angle}\n"))
    with pytest.raises(CaseError) as refused:
        load_case(path)
    assert any(says in line for line in str(refused.value).splitlines()), str(refused.value)


def test_a_machine_that_falls_out_of_step_is_reported(tmp_path):
    assert not any(
        "loses synchronism" in n for n in simulate(load_case(written(tmp_path)), {}).notes
    )
    case = load_case(written(tmp_path, ("{at: 3.0, X: 0.4}, {at: 4.0, X: 0.3}", "{at: 3, X: 5}")))
    assert any("loses synchronism at" in note for note in simulate(case, {}).notes)


def test_a_stabiliser_hears_what_the_case_says(tmp_path):
    """At rest it has seen the power, the voltage, or no deviation of the speed at all."""
    most = {}
    for heard in ("p", "vt", "speed"):
        signals = simulate(
            load_case(written(tmp_path, ("inputs: [p]", f"inputs: [{heard}]"))), {}
        ).response.signals
        own = [abs(x[0]) for name, x in signals.items() if name.startswith("stabiliser.")]
        most[heard] = max(own)
    assert most["vt"] > most["p"] > most["speed"] == 0.0


def record_of(case, path):
    """Write the response of a case as a record with the noise of a recorder."""
    signals, rng = simulate(case, {}).response, np.random.default_rng(5)
    columns = [signals.signals[name] for name in ("vt", "p")]
    noisy = [column + 1e-5 * rng.standard_normal(column.size) for column in columns]
    table = np.column_stack([signals.time, *noisy])
    np.savetxt(path, table, delimiter=",", header="t,vt,p", comments="", fmt="%.7f")


FITTED = (
    ("  duration: 5.0\n", ""),
    ("  free: {}\n", "  free: {H: {start: 3, min: 1, max: 20}}\n"),
    ("{Tppd0: 0.035, H: 4.0}", "{Tppd0: 0.035}"),
    ("parameters: {KS: 0.5}}", "free: {KS: {start: 0.3, min: 0.05, max: 5}}}"),
    ("parameters: {fixed: {K: 50, EMAX: 9, EMIN: -9}}\n",
     "parameters: {fixed: {EMAX: 9, EMIN: -9}, free: {K: {start: 40, min: 5, max: 500}}}\n"
     "record: {file: record.csv, time: t, channels: {vt: vt, p: {column: p, weight: 0.3}}}\n"),
)  # fmt: skip


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fitted")
    record_of(load_case(written(folder)), folder / "record.csv")
    case = load_case(written(folder, *FITTED))
    return case, fit(case, search="local")


def test_data_of_exciter_machine_and_stabiliser_are_found_together(found):
    _, result = found
    truth = {"K": 50.0, "machine.H": 4.0, "stabiliser.KS": 0.5}
    assert {n: one.value for n, one in result.parameters.items()} == pytest.approx(truth, rel=2e-3)
    told = result.to_dict()
    assert told["machine_model"] == "GENROU"
    assert told["stabiliser_model"] == "PSS1A"
    assert told["machine"]["H"] == result.parameters["machine.H"].value
    assert "H" not in told["fixed"]
    assert told["network"]["X"] == 0.3


def test_fitted_values_of_all_parts_are_read_back(found, tmp_path):
    case, result = found
    write_fit(result, tmp_path / "run")
    back = read_parameters(case, tmp_path / "run" / PARAMETERS)
    for name, one in result.parameters.items():
        assert back[name] == one.value


def test_what_is_typical_is_named_part_by_part(tmp_path):
    case = load_case(written(tmp_path))
    told = "\n".join(typical_notes(case, case.values()))
    assert "typical values taken for GENROU: Tpd0 6.35" in told
    assert "typical values taken for PSS1A:" in told
    assert "network" not in told


def test_a_stabiliser_on_open_circuit_is_said_not_to_act(tmp_path):
    opened = (
        ("infinite-bus", "open-circuit"),
        ("  network: {f0: 50, R: 0.01, X: 0.3, P: 0.8, Q: 0.2}\n", ""),
        ("  network: [{at: 3.0, X: 0.4}, {at: 4.0, X: 0.3}]\n", ""),
    )
    case = load_case(written(tmp_path, *opened))
    assert any("PSS1A does not act" in note for note in typical_notes(case, case.values()))
    assert not any(name.startswith("stabiliser") for name in system_of(case).parameters)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("f0: 50, ", "", "plant.network.f0: is missing"),
        ("X: 0.3, P: 0.8, ", "", "plant.network.X: is missing"),
        (", Q: 0.2", "", "plant.network.Q: is missing: either Q or E"),
        ("Q: 0.2", "Q: 0.2, E: 1.0", "plant.network.Q: not allowed with E"),
        ("R: 0.01, X: 0.3", "R: 0, X: 0", "plant.network.X: 0, and R = 0 as well"),
        ("Q: 0.2", "Q: 0.2, PL: 1", "plant.network: Xs (typical): 0, and Rs = 0 as well"),
        ("Q: 0.2", "E: 1, YP: 1, Xs: 0.1", "plant.network.E: not allowed with a far bus before"),
        ("  network: [{at: 3.0, X: 0.4}, ", "  fault: [{at: 3.0, cleared: 3.1}]\n  network: [",
         "test.fault[0]: has no impedance"),
        ("  network: [{at: 3.0, X: 0.4}, ", "  fault: [{at: 3.0, cleared: 3, X: 1}]\n  network: [",
         "test.fault[0].cleared: 3 s is not after 3 s"),
        ("  network: [{at: 3.0, X: 0.4}, ", "  fault: [{at: 1, cleared: 3, X: 1}, {at: 2, "
         "cleared: 9, R: 1}]\n  network: [", "2 s: the fault before lasts until 3 s"),
        ("  network: [{at: 3.0, X: 0.4}, ", "  fault: [{at: 1, cleared: 9, X: 1}]\n  network: [",
         "test.fault[0].cleared: 9 s lies outside 0 ... 5 s"),
        ("R: 0.01, X: 0.3", "R: 0.01, XX: 0.3", "plant.network.XX: not a parameter of the net"),
        ("{at: 3.0, X: 0.4}", "{at: 3.0, E: 0.4}", "only where plant.network gives E"),
        ("{at: 3.0, X: 0.4}", "{at: 3.0}", "test.network[0]: changes nothing"),
        ("{at: 4.0, X: 0.3}", "{at: 2.0, X: 0.3}", "2 s is not after 3 s"),
        ("{at: 4.0, X: 0.3}", "{at: 4.0, X: -0.3}", "test.network[1].X: -0.3 is below 0"),
        ("Tppd0: 0.035", "Tppd0: 0", "Tppd0: 0 is for open circuit; on load it must be positive"),
        ("inputs: [p]", "inputs: [p, vt]", "stabiliser.inputs: 2 given; PSS1A takes 1"),
        ("inputs: [p]", "inputs: [w]", "stabiliser.inputs[0]: 'w' is not possible; known: speed"),
        ("PSS1A", "PSS9", "'PSS9' is not a stabiliser model; did you mean"),
        (
            "PSS1A, inputs: [p], parameters: {KS: 0.5}",
            "IEEEST, inputs: [p], parameters: {T5: 0}",
            "stabiliser.parameters: IEEEST does not rest at 0 with inputs p: its washout is left",
        ),
        ("{KS: 0.5}", "{K: 0.5}", "stabiliser.parameters.K: not a parameter of PSS1A"),
        ("free: {}", "free: {H: {start: 3, min: 1, max: 9}}", "plant.free.H: both fixed and free"),
        ("infinite-bus", "open-circuit", "test.network: not allowed with plant open-circuit"),
        ("infinite-bus", "none", "stabiliser: not allowed with plant none"),
    ],
)  # fmt: skip
def test_a_fault_on_load_is_reported_with_its_place(tmp_path, old, new, says):
    path = written(tmp_path, (old, new))
    with pytest.raises(CaseError) as refused:
        load_case(path)
    lines = str(refused.value).splitlines()
    assert any(says in line for line in lines), lines
    assert all(line.startswith(f"{path}:") for line in lines)


def test_an_impossible_start_is_refused_with_its_voltage(tmp_path):
    case = load_case(written(tmp_path, ("P: 0.8, Q: 0.2", "P: 9.0, E: 1.0")))
    with pytest.raises(SimulationError, match=r"no state of rest at vt0 = 1 pu"):
        simulate(case, {})


@pytest.mark.parametrize(
    "name", few_of(["exciter_playback", "ac8b_on_line", "machine_playback"], 1)
)
def test_the_cases_of_the_other_plants_find_what_their_records_were_made_with(name):
    truth = {
        "ac8b_on_line": {"KPR": 80.0, "KIR": 5.0, "KDR": 10.0, "TDR": 0.1, "TE": 1.2},
        "machine_playback": {"machine.Tpd0": 6.0, "machine.S10": 0.12, "machine.S12": 0.4},
        "exciter_playback": {"KA": 364.15, "TA": 0.0542, "TE": 1.6724, "KF": 0.0413, "TF": 1.458},
    }[name]
    found = fit(ROOT / "configs" / f"{name}.yaml", search="local")
    assert found.success
    for symbol, value in truth.items():
        # KIR of a record of 9 s behind noise is the least sure
        assert found.parameters[symbol].value == pytest.approx(value, rel=0.1), symbol
    if name == "machine_playback":
        assert found.parameters["machine.Tpd0"].value == pytest.approx(6.0, rel=0.01)
