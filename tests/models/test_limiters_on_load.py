"""Each limiter on load, where it takes over and lets go, against its diagram typed again."""

from typing import NamedTuple

import numpy as np
import pytest
from on_load import QUADRATIC, values_on_load
from typed_limiters import LimitedUnit

from exfit.models import LIMITERS, MODELS
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.plants import MACHINE, NETWORK, VT0, Attached
from exfit.plants.infinite_bus import infinite_bus
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import LARGEST_STEP, Simulator

ACCURACY = 1e-6  # pu, the default of a case
EXCITER = {"TR": 0.02, "TC": 0.0, "TB": 0.0, "KA": 60.0, "TA": 0.05, "KC": 0.0, "KF": 0.0}
EXCITER |= {"KLR": 0.0, "VAMAX": 8.0, "VAMIN": -6.0, "VRMAX": 99.0, "VRMIN": -99.0}
UNIT = {VT0: 1.0, NETWORK + "P": 0.6, NETWORK + "Q": 0.05, NETWORK + "X": 0.3, MACHINE + "D": 20.0}

# steps of the reference: when (s), and by how much (pu)
UP, DOWN = ((0.5, 0.12), (4.0, -0.12)), ((0.5, -0.25), (4.0, 0.25))
BOTH = (0.5, 0.16), (4.0, -0.28), (8.0, 0.12)
FAR_DOWN = (0.5, 0.12), (4.0, -0.37), (8.0, 0.25)

OEL2C = {
    **{"ITFPU": 2.0, "ILIM": 1.9, "IINST": 3.0, "K2": 1.5, "TOFF": 0.5, "FIXEDRD": -0.6},
    **{"KPOEL": 15.0, "KIOEL": 5.0, "KDOEL": 0.2, "TDOEL": 0.05, "TB1OEL": 0.1, "TC1OEL": 0.05},
    **{"TC2OEL": 0.0, "TB2OEL": 0.05, "KRD": -20.0, "KRU": 20.0, "KFB": 0.05, "FIXEDRU": 0.1},
    **{"VOELMAX1": 20.0, "VOELMIN1": -5.0, "VOELMAX2": 10.0, "VOELMIN2": -6.0},
    **{"VOELMAX3": 8.0, "VOELMIN3": -5.0, "TFCL": 1.0, "TMAX": 1.0},
}
BY_CURRENT = {"SW1": 1.0, "K1": -30.0, "C1": 2.0}
OEL3C = {
    **{"ITFPU": 2.0, "TOEL": 0.8, "VOELMAX1": 0.3, "VOELMIN1": -0.1, "K1": 1.5, "KSCALE": 1.05},
    **{"KOEL": 0.3, "KPOEL": 0.2, "VOELMIN2": -0.15},
}
OEL5C = {
    **{"KSCALE1": 0.5, "TF1": 0.02, "TCOEL": 0.1, "TBOEL": 0.05, "IFDPU": 1.02, "IFDLIM": 0.1},
    **{"VOELMAX1": 0.3, "KIFDT": 0.1, "IFDPULEV": 1.2, "TIFDLEV": 0.5, "K1": 1.5, "IFDREF1": 1.15},
    **{"IFDREF2": 0.95, "KPOEL": 10.0, "KIOEL": 15.0, "VOELMAX": 6.0, "VOELMIN": -4.0},
    "IBIAS": 12.0,
}
SOON = {"IFDLIM": 9.0, "VOELMAX1": 9.5, "TIFDLEV": 0.2}
UEL1 = {
    **{"KUR": 1.7, "KUL": 15.0, "KUI": 10.0, "VUIMIN": -2.0, "VUIMAX": 5.0, "TU1": 0.1},
    **{"TU2": 0.05, "TU3": 0.05, "TU4": 0.1, "VULMAX": 4.0, "VULMIN": -3.0},
}
UEL2C = {
    **{"TUP": 0.3, "TUQ": 0.02, "TUV": 0.2, "VBIAS": 0.98, "TQREF": 0.1, "SW1": 2.0, "TADJ": 0.2},
    **{"TU1": 0.05, "TU2": 0.1, "TU3": 0.2, "TU4": 0.15, "KUL": 15.0, "KUI": 15.0},
    **{"VUIMIN": -2.0, "VUIMAX": 5.0, "VUELMIN1": -3.0, "VUELMAX1": 4.0, "VUELMIN2": -5.0},
    **{"VUELMAX2": 5.0, "Q0": -0.2, "Q1": -0.2, "P2": 0.59, "Q2": -0.18, "Q3": -0.1, "Q4": 0.0},
}
SCL1C = {
    **{"ISCLLIM": 0.57, "TIT": 0.05, "TQSCL": 0.04, "K": 1.5, "IQMIN": 0.1, "TINV": 0.5},
    **{"TDSCL": 0.3, "KPOEX": 0.1, "KIOEX": 0.1, "KPUEX": 0.1, "KIUEX": 0.1, "VSCLDB": 0.05},
    **{"VSCLMIN": -0.01, "VSCLMAX": 0.1, "SW2": 0.0},
}
SCL2C = {
    **{"ITFPU": 0.66, "ILIM": 0.66, "IINST": 1.2, "IINSTUEL": 1.1, "K2": 1.5, "TOFF": 0.5},
    **{"FIXEDRD": -0.6, "FIXEDRU": 0.1, "KFB": 0.05, "TSCL": 0.3, "TMAX": 0.3, "KRD": -20.0},
    **{"KRU": 20.0, "TIPOEL": 0.1, "TIQOEL": 0.03, "TIPUEL": 0.1, "TIQUEL": 0.05, "KPREF": 0.1},
    **{"KIPUEL": 0.98, "KIQUEL": 1.02, "KIPOEL": 0.98, "KIQOEL": 1.02, "IQMAXUEL": -0.05},
    **{"IQMINOEL": 0.05, "VTMIN": 0.88, "VTRESET": 0.87, "ITHOFF": 0.03, "IRESET": 20.0},
    **{f"{name}{side}": value for side in ("OEL", "UEL") for name, value in (
        *(("KP", 20.0), ("KI", 20.0), ("KD", 0.3), ("TD", 0.05), ("TB1", 0.1), ("TC1", 0.05)),
        *(("TC2", 0.02), ("TB2", 0.05)),
    )},
    **{"VOELMAX1": 4.0, "VOELMIN1": -5.0, "VOELMAX2": 10.0, "VOELMIN2": -7.0, "VOELMAX3": 5.0},
    **{"VOELMIN3": -6.0, "VUELMAX1": 4.0, "VUELMIN1": -2.0, "VUELMAX2": 10.0, "VUELMIN2": -3.5},
    **{"VUELMAX3": 9.0, "VUELMIN3": -1.0},
}  # fmt: skip


class Case(NamedTuple):
    """A limiter at a place, its data, a test, and what has to begin and end in that."""

    limiter: str
    place: str
    data: dict[str, float]
    steps: tuple[tuple[float, float], ...]
    end: float
    happens: str


def at_input(data):
    """Return the data of a limiter whose output acts before the gain KA."""
    gains = ("VO", "VU", "KUL", "KUI", "IBIAS")
    gains += ("KPOEL", "KIOEL", "KDOEL", "KPUEL", "KIUEL", "KDUEL")
    return {
        name: value / EXCITER["KA"] if name.startswith(gains) else value
        for name, value in data.items()
    }


TIMED = "full, active, reference back, OEL takes over"
CASES = [
    Case("OEL2C", "takeover-output", OEL2C, UP, 8.0, TIMED),
    Case("OEL2C", "takeover", at_input(OEL2C) | {"IINST": 2.3}, UP, 8.0, "TEN, " + TIMED),
    Case(
        *("OEL2C", "summing", at_input(OEL2C) | {"VOELMAX1": 0.0, "VOELMIN1": -0.2} | BY_CURRENT),
        *(UP, 8.0, "full, active, reference back, last OEL high"),
    ),
    Case("OEL3C", "summing", OEL3C, UP, 8.0, "time over, output high"),
    Case("OEL5C", "takeover-output", OEL5C, UP, 8.0, "full, latch, OEL takes over"),
    Case(
        *("OEL5C", "takeover", at_input(OEL5C) | {"VOELMAX1": OEL5C["VOELMAX1"]}),
        *(UP, 8.0, "full, latch, OEL takes over"),
    ),
    Case("OEL5C", "takeover-output", OEL5C | SOON, UP, 8.0, "TIFDLEV, OEL takes over"),
    Case("UEL1", "takeover-output", UEL1, DOWN, 8.0, "UEL takes over, PI low"),
    Case("UEL1", "takeover", at_input(UEL1), DOWN, 8.0, "UEL takes over, PI low"),
    Case(
        *("UEL1", "summing", at_input(UEL1) | {"VUIMIN": 0.0, "VULMIN": 0.0}),
        *(DOWN, 8.0, "PI low, PI high, output high"),
    ),
    Case("UEL2C", "takeover-output", UEL2C, DOWN, 8.0, "UEL takes over, PI low"),
    Case("UEL2C", "takeover", at_input(UEL2C), DOWN, 8.0, "UEL takes over, PI low"),
    Case(
        *("UEL2C", "summing", at_input(UEL2C) | {"VUIMIN": 0.0, "VUELMIN1": 0.0}),
        *(DOWN, 8.0, "PI low, PI high, second high"),
    ),
    Case("SCL1C", "summing", SCL1C, BOTH, 12.0, "oel acts, uel acts, oel by the current"),
    Case("SCL1C", "summing", SCL1C | {"SW1": 2.0}, BOTH, 12.0, "oel acts, uel acts, TDSCL"),
    Case(
        *("SCL1C", "summing", SCL1C | {"SW1": 2.0, "SW2": 1.0, "ISCLLIM": 0.65}),
        *(FAR_DOWN, 12.0, "uel acts, TINV"),
    ),
    Case(
        *("SCL2C", "takeover-output", SCL2C, BOTH, 12.0),
        "full, active OEL, active UEL, OEL takes over, UEL takes over",
    ),
    Case(
        *("SCL2C", "takeover", at_input(SCL2C), BOTH, 12.0),
        "full, active OEL, active UEL, OEL takes over, UEL takes over",
    ),
    Case(
        *("SCL2C", "summing", at_input(SCL2C) | {"VOELMAX1": 0.0, "VUELMIN1": 0.0} | BY_CURRENT),
        *(BOTH, 12.0, "full, active OEL, active UEL, last OEL high, last UEL low"),
    ),
]
QUICK = 4  # the others take up to 30 s


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=() if number == QUICK else pytest.mark.long)
        for number, case in enumerate(CASES)
    ],
    ids=lambda case: f"{case.limiter}-{case.place}",
)
def test_efd_is_that_of_the_diagram_typed_again_while_the_limiter_takes_over_and_lets_go(case):
    limiter = Attached(LIMITERS[case.limiter], case.place)
    data = typical(limiter.model.sheet) | case.data
    values = values_on_load(MACHINES["GENROU"], exciter="ST1C", network_Rc=0.0, network_Xc=0.0)
    values |= EXCITER | UNIT | {limiter.prefix + name: value for name, value in data.items()}
    machine, network = (
        {name.removeprefix(prefix): value for name, value in values.items() if prefix in name}
        for prefix in (MACHINE, NETWORK)
    )
    # no sample lies on a step
    times = np.array([0.0, *np.arange(0.006, case.end, 0.01)])
    typed = LimitedUnit(case.limiter, case.place, values[VT0], EXCITER, machine, network, data)
    expected, choices = typed.efd(times, case.steps)
    for name in case.happens.split(", "):
        chosen = [choice for _, choice in choices.times(name)]
        assert len(chosen) > 1, name
        assert chosen[0] != chosen[-1], name

    plant = infinite_bus(MODELS["ST1C"], MACHINES["GENROU"], QUADRATIC, limiters=(limiter,))
    steps = tuple(InputStep(*step) for step in case.steps)
    inputs = Inputs(0.0, times[-1], steps)
    simulator = Simulator(plant, inputs, times, LARGEST_STEP, located=True, accuracy=ACCURACY)
    got = simulator.with_enough_substeps(values, ("efd",)).response(values, ("efd",))
    largest = np.abs(got.signals["efd"] - expected).max()
    assert largest < 1e-5
