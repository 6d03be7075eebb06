"""Alternator exciters against their block diagrams: transfer functions, ceilings, sample data.

The linear behaviour is put together here a second time, as block diagram algebra in s that knows
nothing of states; ceilings are the roots of the equations that hold where a limit acts.
"""

import numpy as np
import pytest
from diagrams import frequency_response, saturation
from oracle import rates_at_rest, system_of, typical_values
from rotating import (
    EFD,
    FREQUENCIES,
    INPUTS,
    START,
    VT,
    around,
    driven,
    efd_where,
    holding_current,
    pid,
    solved,
)
from scipy.optimize import brentq
from tiers import examples_of

from exfit.errors import SimulationError
from exfit.models import MODELS
from exfit.models.sheet import typical
from exfit.plants import SATURATION
from exfit.plants.parts import exciter_parameters
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

# no gain and no time constant is zero
LIVELY = {
    "AC7B": {"TR": 0.02, "KDR": 0.2, "TDR": 0.05, "KF2": 0.05, "KF3": 0.02},
    "ESAC8B": {"TR": 0.02, "TA": 0.03},
    "EXAC1": {"TR": 0.02, "TB": 0.5, "TC": 0.3},
    "EXAC2": {"TR": 0.02, "TB": 0.5, "TC": 0.3},
}
# the second sample of the standard for AC7B
AC7B_B = {
    "KPR": 170.0,
    "KIR": 130.0,
    "KDR": 60.0,
    "TDR": 0.03,
    "VRMAX": 10.0,
    "VRMIN": 0.0,
    "KPA": 1.0,
    "KIA": 0.0,
    "VAMAX": 10.0,
    "VAMIN": 0.0,
    "KP": 1.0,
    "KF1": 0.0,
    "TE": 1.0,
    "VFEMAX": 99.0,
    "KC": 0.0,
    "KD": 0.0,
    "E1": 4.5,
    "SE1": 1.5,
    "E2": 3.38,
    "SE2": 1.36,
}


def parameters(name, **changes):
    values = typical(MODELS[name].sheet) | LIVELY[name] | changes
    return exciter_parameters(values, MODELS[name], SATURATION["quadratic"])


# --- linear behaviour -----------------------------------------------------------------------------


def exac1(s, p):
    forward = (1.0 + s * p.TC) / (1.0 + s * p.TB) * p.KA / (1.0 + s * p.TA)
    return solved(s, p, forward, forward * s * p.KF / (1.0 + s * p.TF))


def exac2(s, p):
    regulator = p.KB * (1.0 + s * p.TC) / (1.0 + s * p.TB) * p.KA / (1.0 + s * p.TA)
    return solved(s, p, regulator, regulator * s * p.KF / (1.0 + s * p.TF) + p.KB * p.KH)


def ac7b(s, p):
    amplifier = p.KP * VT * pid(s, p.KPA, p.KIA, 0.0, 0.0)
    regulator = amplifier * pid(s, p.KPR, p.KIR, p.KDR, p.TDR)
    back = regulator * s * p.KF3 / (1.0 + s * p.TF) + amplifier * p.KF2
    return solved(s, p, regulator, back, amplifier * p.KF1, around(p).vfe / VT)


def esac8b(s, p):
    forward = pid(s, p.KP, p.KI, p.KD, p.TD) * p.KA / (1.0 + s * p.TA)
    c = p.KE + saturation(EFD, vars(p))[1]
    measured = -forward / (1.0 + s * p.TR)
    return np.array([forward, forward, 0.0, measured, 0.0]) / (s * p.TE + c)


FUNCTIONS = {"AC7B": ac7b, "ESAC8B": esac8b, "EXAC1": exac1, "EXAC2": exac2}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_linear_exciter_is_its_block_diagram(name):
    p = parameters(name)
    got = frequency_response(name, p, INPUTS, FREQUENCIES, START)
    expected = np.array([FUNCTIONS[name](2j * np.pi * f, p) for f in FREQUENCIES])
    size = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    # differences over 1e-5: rounding over it, and a third derivative times its square
    assert (np.abs(got - expected) / size).max() < 1e-8


# --- ceilings -------------------------------------------------------------------------------------


def ceiling_of_exac2(**changes):
    p = parameters("EXAC2", **changes)
    by_gate = p.VLR * p.KB * p.KL / (1.0 + p.KB * p.KL)
    by_regulator = p.KB * p.VAMAX / (1.0 + p.KB * p.KH)
    return p, efd_where(min(by_gate, by_regulator, p.VRMAX), p)


def ceiling_of_ac7b(**changes):
    p = parameters("AC7B", **changes)
    return p, efd_where(min(p.KP * VT * p.VAMAX, p.VFEMAX), p)


def ceiling_of_exac1(**changes):
    p = parameters("EXAC1", **changes)
    return p, efd_where(p.VRMAX, p)


def ceiling_of_esac8b(**changes):
    p = parameters("ESAC8B", **changes)
    return p, brentq(lambda e: holding_current(e, 0.0, p) - p.VRMAX, 0.0, 50.0, xtol=1e-13)


CEILINGS = [
    ("AC7B", ceiling_of_ac7b, {}),  # the supply of the amplifier, KP VT VAMAX
    ("AC7B", ceiling_of_ac7b, {"VFEMAX": 3.0}),
    ("ESAC8B", ceiling_of_esac8b, {}),
    ("EXAC1", ceiling_of_exac1, {}),
    ("EXAC2", ceiling_of_exac2, {}),  # the gate
    ("EXAC2", ceiling_of_exac2, {"VLR": 99.0}),  # VAMAX, by the inner loop
    ("EXAC2", ceiling_of_exac2, {"VLR": 99.0, "VRMAX": 5.0}),
]


@pytest.mark.parametrize(("name", "ceiling", "changes"), examples_of(CEILINGS, 3))
def test_a_large_step_drives_efd_to_its_ceiling_and_back(name, ceiling, changes):
    p, expected = ceiling(**changes)
    top, _, below = driven(name, p, (0.5, -0.5, -0.5))
    # twelve seconds are ten time constants of the slowest exciter here, its loops not counted
    assert top == pytest.approx(expected, rel=1e-6)
    assert below < 0.5 * EFD


def test_the_floor_of_AC7B_follows_the_field_current():
    """With KL = 0 nothing drives the exciter down but its own field current."""
    p = parameters("AC7B", KL=0.0, KD=0.0, SE1=0.0, SE2=0.0, KC=0.0)
    (_, after) = driven("AC7B", p, (0.0, -0.5), seconds=1.0)
    # from the first instant on, TE dVE/dt = -KE VE; Euler errs by a step of 1 ms over TE
    assert after == pytest.approx(EFD * np.exp(-1.0 / p.TE), rel=2e-2)


def test_a_start_beyond_the_gate_of_EXAC2_is_refused():
    simulator = Simulator(system_of("EXAC2"), Inputs(0.0, 1.0, ()), np.linspace(0.0, 1.0, 11), 1e-3)
    with pytest.raises(SimulationError, match="no state of rest"):
        simulator.samples(typical_values("EXAC2", VLR=1.0), ("vt",))


# --- sample data ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "changes"), [(name, {}) for name in FUNCTIONS] + [("AC7B", AC7B_B)]
)
def test_sample_data_give_a_stable_step_of_five_percent(name, changes):
    system, values = system_of(name), typical_values(name, **changes)
    times = np.linspace(0.0, 30.0, 601)
    simulator = Simulator(system, Inputs(0.0, 30.0, (InputStep(0.5, 0.05),)), times, 1e-3)
    vt = simulator.with_enough_substeps(values).samples(values, ("vt",))[0][:, 0]
    assert rates_at_rest(system, values).real.max() < 0.0
    assert vt.max() < 1.0 + 1.3 * 0.05  # an overshoot of at most 30 %
    assert vt[-1] == pytest.approx(1.05, abs=1e-3)  # proportional regulators leave some
