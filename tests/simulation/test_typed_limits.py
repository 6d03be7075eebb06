"""Responses that meet limits, against units typed anew and integrated by SciPy's DOP853."""

import numpy as np
import pytest
from oracle import lively_values, system_of
from typed_limits import TYPED, integrated_with_limits

from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import LARGEST_STEP, Simulator

ACCURACY = 1e-6
NARROW = {
    "AC1A": {"VRMAX": 4.0, "VRMIN": -1.0, "VAMAX": 5.0, "VAMIN": -3.0},
    "AC8B": {"VRMAX": 6.0, "VRMIN": 0.5, "VFEMAX": 1e3, "VEMIN": 0.5},
    "DC1A": {"KE": 0.1, "VRMAX": 1.5, "VRMIN": -0.9},
    "SEXS": {"EMAX": 3.0, "EMIN": 0.3},
    "ST1A": {
        "VRMAX": 4.0, "VRMIN": 0.2, "VAMAX": 5.0, "VAMIN": -2.0, "VIMAX": 0.2, "VIMIN": -0.2,
        "ILR": 2.6,
    },
    "EXST1": {"VRMAX": 4.0, "VRMIN": 0.5, "VIMAX": 0.04, "VIMIN": -0.04},
}  # fmt: skip


@pytest.mark.parametrize("name", [*TYPED])
def test_a_response_at_limits_errs_by_less_than_its_accuracy(name):
    values, times = lively_values(name, **NARROW[name]), np.arange(0.0, 8.0001, 0.01)
    steps = (InputStep(1.0, 0.08), InputStep(4.0, -0.15))
    simulator = Simulator(
        system_of(name),
        Inputs(0.0, 8.0, steps),
        times,
        LARGEST_STEP,
        located=True,
        accuracy=ACCURACY,
    ).with_enough_substeps(values, ("vt", "efd"))
    got = simulator.samples(values, ("vt", "efd"))[0]
    typed, met = integrated_with_limits(TYPED[name](values, "GENROU"), 1.0, steps, times)
    assert met > 0  # some corner
    assert np.abs(got - typed).max() < ACCURACY
