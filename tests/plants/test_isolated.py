"""A unit alone on its load, and what is done to its governor: laws, and a second typing."""

import numpy as np
import pytest
from oracle import saturated
from typed_governors import TYPICAL, TypedUnit, integrated

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.models.machines import MACHINES
from exfit.workflows import simulate

LOADS = {
    "power": {"PL": 0.5, "QL": 0.2},
    "current": {"IP": 0.5, "IQ": 0.2},
    "admittance": {"YP": 0.5, "YQ": -0.2},
    "mixed": {"PL": 0.2, "QL": 0.1, "IP": 0.2, "YP": 0.1, "YQ": -0.05},
    "none": {},
}
EXCITER = {"K": 40.0, "TE": 0.08}
CASE = """\
model: SEXS
plant:
  type: PLANT
  machine: MACHINE
  parameters: DATA
  network: NETWORK
governor: {model: GOVERNOR, parameters: VALUES}
test: {vt0: 1.0, duration: 10.0, EVENTS}
parameters: {fixed: {K: 40, TE: 0.08, TATB: 1.0, TB: 0.0, EMIN: -99, EMAX: 99}}
simulation: {output_step: 0.05, accuracy: 1e-7}
"""
STEP = "network: [{at: 1.0, YP: 0.6}]"
REFERENCE = "pref: [{at: 1.0, step: 0.002}]"
SIGNAL = "fs: [{at: 1.0, step: 0.004, ramp: 2.0}, {at: 5.0, step: -0.006}]"


def data_of(machine):
    return saturated(MACHINES[machine])


def case_of(folder, events, network, governor="TGOV1", machine="GENROU", plant="isolated"):
    """Return the case of a unit whose typical data another typing shares."""
    changes = {
        "PLANT": plant, "MACHINE": machine, "DATA": data_of(machine), "NETWORK": network,
        "GOVERNOR": governor, "VALUES": TYPICAL[governor], "EVENTS": events,
    }  # fmt: skip
    text = CASE
    for word, value in changes.items():
        text = text.replace(word, str(value).replace("'", ""))
    path = folder / "case.yaml"
    path.write_text(text)
    return load_case(path)


def simulated(*given, **kinds):
    response = simulate(case_of(*given, **kinds), {}).response
    return response.time, response.signals


def changes(events):
    """Return vref, pref and fs by time for the events of these tests; and the load."""
    ramp = lambda t: 0.004 * np.clip((t - 1.0) / 2.0, 0.0, 1.0)  # noqa: E731
    pref = 0.002 if events == REFERENCE else 0.0
    return (
        lambda t: pref * (t >= 1.0),
        lambda t: (ramp(t) - 0.006 * (t >= 5.0)) * (events == SIGNAL),
        lambda t: 0.6 if events == STEP and t >= 1.0 else 0.5,
    )


@pytest.mark.long
@pytest.mark.parametrize("machine", ["GENROU", "GENSAL"])
@pytest.mark.parametrize("governor", TYPICAL)
@pytest.mark.parametrize("events", [STEP, REFERENCE, SIGNAL])
def test_a_unit_on_its_load_moves_as_in_a_second_typing(events, governor, machine, tmp_path):
    load = {"f0": 60, "YP": 0.5, "YQ": -0.2}
    time, ours = simulated(tmp_path, events, load, governor=governor, machine=machine)
    unit = TypedUnit(machine, data_of(machine), EXCITER, governor, TYPICAL[governor])
    pref, fs, conductance = changes(events)

    def impedance(t):
        z = 1.0 / (conductance(t) - 0.2j)
        return 0.0, z.real, z.imag

    x0, vref, held = unit.start(1.0, *impedance(0.0))
    breaks = np.array([1.0, 3.0, 5.0])

    def slopes(t, x):
        return unit.slopes(x, vref, held + pref(t), fs(t), *impedance(t))

    states = integrated(slopes, x0, time, breaks)
    theirs = [unit.signals(x, *impedance(t)) for t, x in zip(time, states.T, strict=True)]
    for name in theirs[0]:
        off = ours[name] - np.array([each[name] for each in theirs])
        assert np.abs(off[time != 1.0]).max() < 1e-5, name  # there p jumps with the load


@pytest.mark.parametrize("load", LOADS)
def test_the_power_is_that_of_the_load_at_the_voltage(load, tmp_path):
    events = "vref: [{at: 1.0, step: -0.05}]"
    _, s = simulated(tmp_path, events, {"f0": 60, **LOADS[load]})
    part = {**dict.fromkeys(("PL", "QL", "IP", "IQ", "YP", "YQ"), 0.0), **LOADS[load]}
    vt = s["vt"]
    assert vt[-1] == pytest.approx(0.95, abs=5e-3)
    power = part["PL"] + part["IP"] * vt + part["YP"] * vt**2
    reactive = part["QL"] + part["IQ"] * vt - part["YQ"] * vt**2
    np.testing.assert_allclose(s["p"], power, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(s["q"], reactive, rtol=0.0, atol=1e-9)


def test_a_step_of_the_load_leaves_the_speed_below_by_its_droop(tmp_path):
    events = "network: [{at: 1.0, PL: 0.6}]"
    case = case_of(tmp_path, events, {"f0": 60, "PL": 0.5})
    values = {"governor.Dt": 0.0, "machine.D": 0.0, "governor.T3": 2.5}
    s = simulate(case, values).response.signals
    assert s["gate"][0] == pytest.approx(0.5, abs=1e-9)
    # 0.5 - dw / R is the power of the turbine, and its torque is that of the load
    assert s["speed"][-1] - 1.0 == pytest.approx(-0.1 / (1.0 / 0.05 + 0.6), rel=1e-4)


def test_a_signal_at_the_governor_moves_the_gate_of_a_unit_in_the_grid_and_hardly_its_speed(
    tmp_path,
):
    network = {"f0": 60, "X": 0.1, "P": 0.6, "Q": 0.1}
    _, s = simulated(tmp_path, "fs: [{at: 1.0, step: 0.005}]", network, plant="infinite-bus")
    assert s["gate"][-1] == pytest.approx(0.6 - 0.005 / 0.05, abs=5e-4)
    assert np.abs(s["speed"] - 1.0).max() < 5e-4


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("YP: 0.6", "X: 0.6"), r"network\[0\].X: only where plant.network gives X"),
        (("governor: {", "# {"), "test.fs: needs a governor: there is none"),
        (("T1: 0.4", "T1: 0"), "test.fs: the power of TGOV1 must wait for its gate"),
    ],
)
def test_what_acts_on_nothing_is_refused(change, says, tmp_path):
    load = {"f0": 60, "YP": 0.5}
    path = case_of(tmp_path, f"{STEP}, {SIGNAL}", load).path
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(CaseError, match=says):
        load_case(path)
