"""The exciters IEEET2 and IEEET3 on load, typed a second time for another integrator.

A voltage dip at the source drives a unit; what its exciter saw there drives the second typing.
"""

import numpy as np
import pytest
from on_load import system, values_on_load
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from typed_units import two_points

from exfit.models.machines import MACHINES
from exfit.plants import NETWORK
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

STEP, AT, BACK, END = 2.5e-4, 0.5, 0.9, 4.0
SEEN = ("vref", "vt", "ifd", "p", "q", "efd", "it")


class Type2:
    """A regulator whose output, through two lags, is its own rate feedback; an exciter behind."""

    def __init__(self, p):
        self.p = p

    def rest(self, u):
        p, efd = self.p, u["efd"]
        vr = p["KE"] * efd + two_points(efd, p["E2"], p["SE2"], p["E1"], p["SE1"])
        return [u["vt"], vr, efd, vr, 0.0, vr / p["KA"]]

    def slopes(self, x, u):
        p, (seen, vr, efd, slow, fed, late) = self.p, x
        field = p["KE"] * efd + two_points(efd, p["E2"], p["SE2"], p["E1"], p["SE1"])
        rate = (vr - slow) / p["TF1"]
        lead = (u["vref"] - seen - fed - late) / p["TB"]
        drive = p["KA"] * (late + p["TC"] * lead)
        return [
            (u["vt"] - seen) / p["TR"],
            (drive - vr) / p["TA"],
            (vr - field) / p["TE"],
            rate,
            (p["KF"] * rate - fed) / p["TF2"],
            lead,
        ]


class Type3:
    """A regulator that adds to what a source of voltage and current leaves beside IFD."""

    def __init__(self, p):
        self.p = p

    def supply(self, u):
        current = (u["p"] - 1j * u["q"]) / u["vt"]
        source = abs(self.p["KP"] * u["vt"] + 1j * self.p["KI"] * current)
        loaded = 1.0 - (0.78 * u["ifd"] / source) ** 2
        return source * np.sqrt(loaded) if loaded > 0.0 else None

    def rest(self, u):
        vr = self.p["KE"] * u["efd"] - self.supply(u)
        return [u["vt"], vr, u["efd"], u["efd"]]

    def slopes(self, x, u):
        p, (seen, vr, efd, slow) = self.p, x
        rate, supply = (efd - slow) / p["TF"], self.supply(u)
        vb = 0.0 if supply is None else min(max(vr + supply, 0.0), p["VBMAX"])
        drive = p["KA"] * (u["vref"] - seen - p["KF"] * rate)
        return [
            (u["vt"] - seen) / p["TR"],
            (drive - vr) / p["TA"],
            (vb - p["KE"] * efd) / p["TE"],
            rate,
        ]


VR, EFD = 1, 2
CASES = {
    "IEEET2": (Type2, {"TR": 0.02, "TB": 0.5, "TC": 0.2, "KF": 0.05, "VRMAX": 6.0, "VRMIN": 1.5}),
    "IEEET3": (Type3, {"TR": 0.02, "VRMAX": 1.0, "VRMIN": 0.2, "KP": 1.5, "VBMAX": 3.6}),
}


def driven(unit, signals, low, high):
    """Return the states (t, n) by DOP853, which stops where VR reaches or leaves a limit."""
    splines = {name: CubicSpline(signals["t"], signals[name]) for name in SEEN}

    def slopes(t, x):
        return unit.slopes(x, {name: spline(t) for name, spline in splines.items()})

    def held(t, x, side):
        return slopes(t, x)[VR] * side

    def motion(t, x, side):
        return [0.0 if side and n == VR else slope for n, slope in enumerate(slopes(t, x))]

    reach_high, reach_low = (lambda t, x, side, at=at: x[VR] - at for at in (high, low))
    reach_high.direction, reach_low.direction = 1.0, -1.0
    held.direction = -1.0  # the slope turns away from the limit
    for event in (reach_high, reach_low, held):
        event.terminal = True
    times, states, visited, side = [], [], set(), 0
    now, x = signals["t"][0], unit.rest({name: signals[name][0] for name in SEEN})
    while now < END:
        events = [held] if side else [reach_high, reach_low]
        part = signals["t"][signals["t"] >= now]
        run = solve_ivp(
            motion, (now, END), x, "DOP853", part,
            events=events, args=(side,), rtol=1e-9, atol=1e-11, max_step=0.02,
        )  # fmt: skip
        times.extend(run.t)
        states.extend(run.y.T)
        if run.status == 0:
            break
        hits = [index for index, at in enumerate(run.t_events) if len(at)]
        now, x = run.t_events[hits[0]][0], run.y_events[hits[0]][0].copy()
        side = 0 if side else (1, -1)[hits[0]]
        x[VR] = {1: high, -1: low}.get(side, x[VR])
        visited.add(side)
    assert visited == {0, 1, -1}
    return np.array(times), np.array(states)


@pytest.mark.parametrize("name", CASES)
def test_another_typing_and_method_reach_and_leave_the_limits_together(name):
    typed, changes = CASES[name]
    machine = MACHINES["GENROU"]
    values = values_on_load(machine, exciter=name, network_Rc=0.0, network_Xc=0.0) | changes
    values |= {NETWORK + "Q": 0.3}
    dip = (InputStep(AT, -0.2, "E", ramp=0.05), InputStep(BACK, 0.2, "E", ramp=0.05))
    times = np.linspace(0.0, END, round(END / STEP) + 1)
    got = Simulator(system(machine, exciter=name), Inputs(0.0, END, dip), times, STEP)
    signals = got.response(values, SEEN).signals | {"t": times}
    unit = typed({name: value for name, value in values.items() if "." not in name})
    at, states = driven(unit, signals, changes["VRMIN"], changes["VRMAX"])
    expected = np.interp(times, at, states[:, EFD])
    assert np.ptp(expected) > 0.5
    # 1.3e-6 and 1.7e-7: the corner where a limit is met lies inside a step, and so do those of the
    # ramps; at a step of 1 ms it is 3e-5
    assert np.abs(signals["efd"] - expected).max() < 4e-6
