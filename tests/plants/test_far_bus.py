"""A load at the far bus, a fault at the terminals: a curve of PSS/E, and laws of circuits."""

import numpy as np
import pytest
from on_load import QUADRATIC, values_on_load
from two_buses import TwoBuses, reference

from exfit.case.load import load_case
from exfit.errors import SimulationError
from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.plants import FAULT, NETWORK, VT0
from exfit.plants.infinite_bus import infinite_bus
from exfit.simulation.inputs import Inputs, InputStep, each
from exfit.simulation.simulator import Simulator
from exfit.workflows import simulate

LOADS = {
    "power": {"PL": 0.6, "QL": 0.3},
    "current": {"IP": 0.6, "IQ": 0.3},
    "admittance": {"YP": 0.6, "YQ": -0.3},
    "mixed": {"PL": 0.2, "QL": 0.1, "IP": 0.3, "IQ": -0.1, "YP": 0.2, "YQ": 0.2},
}
LINE, BEYOND, SHUNT = 0.02 + 0.1j, 0.01 + 0.3j, 1.0 / (0.05 + 0.4j)
TIMES = np.arange(0.0, 2.0, 0.01)
CASE = """\
model: IEEET4
plant:
  type: infinite-bus
  machine: GENROU
  parameters:
    {Tpd0: 6.0, Tppd0: 0.033, Tpq0: 0.54, Tppq0: 0.078, H: 6.4, D: 0.0, Xd: 0.8958, Xq: 0.8645,
     Xpd: 0.1189, Xpq: 0.1969, Xppd: 0.089, Xl: 0.0521, S10: 0.0, S12: 0.0}
  network: {f0: 60, X: 0.1, P: 0.50001, Q: 0.01251, PL: 1.0, QL: 0.5, Xs: 0.05}
test:
  vt0: 1.0
  duration: 1.0
  fault: [{at: 0.05, cleared: 0.10, X: 0.2}]
simulation: {output_step: 0.0005}
"""


def faulted(load, machine="GENROU", line=LINE, **changes):
    """Return a unit with a load at the far bus and its values, in a fault that is cleared."""
    given = frozenset(load)
    system = infinite_bus(
        MODELS["SEXS"], MACHINES[machine], QUADRATIC, ("vref", *FAULT), "Q", load=given
    )
    values = values_on_load(MACHINES[machine], exciter="SEXS", network_Q=0.2)
    own = {"R": line.real, "X": line.imag, "Rs": BEYOND.real, "Xs": BEYOND.imag, **load}
    values |= {NETWORK + name: value for name, value in own.items()} | changes
    steps = [
        InputStep(at, sign * size, name)
        for at, sign in ((0.2, 1.0), (0.3, -1.0))
        for name, size in zip(FAULT, (SHUNT.real, SHUNT.imag), strict=True)
    ]
    return system, Inputs(0.0, TIMES[-1], tuple(steps)), values


def test_a_case_with_a_fault_and_a_load_of_constant_power_moves_as_in_psse(tmp_path):
    """IEEET4 and GENROU of InterPSS's case, through the keys of a case file."""
    path = tmp_path / "case.yaml"
    told, rows = reference("psse_ieeet4")
    imported = TwoBuses(told).values
    fixed = {row.symbol: float(imported[row.symbol]) for row in MODELS["IEEET4"].sheet}
    path.write_text(f"{CASE}parameters: {{fixed: {fixed}}}\n")
    response = simulate(load_case(path), {}).response
    at = [round(row["t"] / 0.0005) for row in rows]
    for signal, most in (("vt", 5e-6), ("p", 5e-5), ("q", 5e-5)):
        theirs = [row[signal] for row in rows]
        assert np.abs(response.signals[signal][at] - theirs).max() < most, signal


@pytest.mark.parametrize("machine", ["GENROU", "ONE_AXIS"])
@pytest.mark.parametrize("load", LOADS)
def test_the_currents_at_terminals_and_far_bus_add_up_to_one_source(load, machine):
    """From vt, p and q alone the voltage of the source follows: it never moves."""
    system, inputs, values = faulted(LOADS[load], machine)
    signals = Simulator(system, inputs, TIMES, 1e-3).response(values).signals
    vt, power = signals["vt"], signals["p"] - 1j * signals["q"]
    line = power / vt - np.where((TIMES > 0.2) & (TIMES <= 0.3), SHUNT, 0.0) * vt
    far = vt - LINE * line
    n = dict.fromkeys(("PL", "QL", "IP", "IQ", "YP", "YQ"), 0.0) | LOADS[load]
    drawn = np.conj((n["PL"] + 1j * n["QL"]) / far) + (n["YP"] + 1j * n["YQ"]) * far
    drawn += (n["IP"] - 1j * n["IQ"]) * far / np.abs(far)
    source = np.abs(far - BEYOND * (line - drawn))
    assert np.ptp(vt) > 0.2
    assert np.ptp(source) < 1e-9
    assert signals["p"][0] == pytest.approx(values[NETWORK + "P"], rel=1e-12)
    assert vt[0] == pytest.approx(values[VT0], rel=1e-12)


@pytest.mark.parametrize("machine", ["GENROU", "ONE_AXIS"])
def test_without_a_load_the_impedances_are_one(machine):
    system, inputs, values = faulted({"PL": 0.0}, machine)
    apart = Simulator(system, inputs, TIMES, 1e-3).response(values).signals
    whole, _, _ = faulted({}, machine)
    both = {"R": LINE.real + BEYOND.real, "X": LINE.imag + BEYOND.imag}
    values |= {NETWORK + name: value for name, value in both.items()}
    alone = Simulator(whole, inputs, TIMES, 1e-3).response(values).signals
    for signal in ("vt", "p", "q", "delta"):
        np.testing.assert_allclose(apart[signal], alone[signal], rtol=0.0, atol=1e-11)


def test_a_fault_and_an_admittance_are_another_source_behind_another_impedance():
    """Thevenin's: a fault at the terminals is a jump of E, of its angle, of R and X."""
    load = 0.5 - 0.2j
    system, inputs, values = faulted({"YP": load.real, "YQ": load.imag})
    got = Simulator(system, inputs, TIMES, 1e-3).response(values).signals
    vt = values[VT0]
    line = (values[NETWORK + "P"] - 1j * values[NETWORK + "Q"]) / vt
    far = vt - LINE * line
    source = far - BEYOND * (line - load * far)
    share, behind = 1.0 / (1.0 + BEYOND * load), LINE + BEYOND / (1.0 + BEYOND * load)
    during = 1.0 / (1.0 + behind * SHUNT)
    turned, then = source * share, source * share * during
    jumps = {
        "E": abs(then) - abs(turned),
        "angle": np.angle(then) - np.angle(turned),
        "R": (behind * during).real - behind.real,
        "X": (behind * during).imag - behind.imag,
    }
    steps = [InputStep(t, s * x, n) for t, s in ((0.2, 1), (0.3, -1)) for n, x in jumps.items()]
    plain = infinite_bus(MODELS["SEXS"], MACHINES["GENROU"], QUADRATIC, ("vref", *jumps), "Q")
    values |= {NETWORK + "R": behind.real, NETWORK + "X": behind.imag}
    same = Simulator(plain, Inputs(0.0, TIMES[-1], tuple(steps)), TIMES, 1e-3).response(values)
    for signal in ("vt", "p", "q"):
        np.testing.assert_allclose(got[signal], same.signals[signal], rtol=0.0, atol=1e-10)


def test_exact_derivatives_reach_through_the_load_and_the_fault():
    system, inputs, values = faulted(LOADS["mixed"])
    simulator = Simulator(system, inputs, TIMES[::5], 1e-3)
    free = tuple(name for name in values if name.startswith((NETWORK, "machine.X")))
    _, slopes = simulator.tangents(values, ("vt", "p"), each(free))
    for column, name in enumerate(free):
        h = 1e-5 * max(abs(values[name]), 0.1)
        sets = [values | {name: values[name] + side * h} for side in (1, -1)]
        up, down = simulator.samples_of_many(sets, ("vt", "p"))[0]
        difference = (up - down) / (2.0 * h)
        size = max(np.abs(difference).max(), 1e-3)
        assert np.abs(slopes[:, :, column] - difference).max() < 3e-6 * size, name


def test_a_load_of_constant_power_without_a_voltage_in_a_fault_is_an_error(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(CASE.replace("Xs: 0.05", "Xs: 0.5").replace("X: 0.2}", "X: 0.001}"))
    with pytest.raises(SimulationError, match="the response does not stay finite"):
        simulate(load_case(path), {})
