"""Data sheets: which values are physical, and which the equations allow beyond them."""

from math import inf, nan

import numpy as np
import pytest
from oracle import lively_values, system_of

from exfit.errors import SimulationError
from exfit.models import GOVERNORS, LIMITERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.models.sheet import SHARED, contradictions, shared, typical
from exfit.simulation.inputs import Inputs, InputStep, each
from exfit.simulation.simulator import Simulator

ROWS = [
    row
    for models in (MODELS, STABILISERS, GOVERNORS, LIMITERS, MACHINES)
    for model in models.values()
    for row in model.sheet
]
TIMES = np.linspace(0.0, 1.0, 51)
INPUTS = Inputs(0.0, 1.0, (InputStep(0.2, 0.005),))
DIFFERENCE = 1e-5  # of a gain: neither rounding nor curvature reaches TOLERANCE
TOLERANCE = 1e-6  # of the largest element


def test_the_equations_allow_all_that_the_sheet_does():
    for row in ROWS:
        low, high = row.domain
        assert low <= row.low < row.high <= high, row.symbol
        assert all(row.range_fault(value) is None for value in (row.low, row.typical, row.high))


def test_no_time_constant_saturation_or_divisor_may_leave_its_sheet_downwards():
    for row in ROWS:
        if row.unit == "s" or row.low > 0.0 or row.symbol in ("SE1", "SE2", "S10", "S12"):
            assert row.domain[0] == row.low, row.symbol
            assert row.range_fault(row.low - 1.0) is not None


def test_no_number_that_is_not_finite_is_allowed():
    assert all(row.range_fault(value) for row in ROWS for value in (inf, -inf, nan))


def negative_gains(model):
    """Return the gains that may be negative, and matter to the response."""
    used = system_of(model).parameters
    rows = MODELS[model].sheet
    return [row for row in rows if row.domain[0] == -inf and row.symbol in used]


def test_derivatives_are_exact_at_gains_of_the_other_sign(model):
    """A start that is no rest is refused: what is left must be simulated rightly.

    A central difference of the same equations is the reference; the gain is a twentieth of what it
    is on the sheet, so that the loop stays calm.
    """
    simulator = Simulator(system_of(model), INPUTS, TIMES, 1e-3)
    for row in negative_gains(model):
        values = lively_values(model)
        gain = -0.05 * (values[row.symbol] or 1.0)
        values[row.symbol] = gain
        try:
            samples, slopes = simulator.tangents(values, ("vt",), each((row.symbol,)))
        except SimulationError:
            continue
        step = DIFFERENCE * abs(gain)
        sides = [
            simulator.samples({**values, row.symbol: gain + side}, ("vt",))[0]
            for side in (-step, step)
        ]
        difference = (sides[1] - sides[0]) / (2.0 * step)
        size = float(np.max(np.abs(difference)))
        rounding = 1e-13 * float(np.max(np.abs(samples))) / step
        error = np.max(np.abs(slopes[:, :, 0] - difference))
        assert error <= TOLERANCE * size + rounding, (row.symbol, error, size)


@pytest.mark.parametrize(("name", "gain"), [("AC7B", "KIR"), ("AC8B", "KIR"), ("ST4B", "KIM")])
def test_an_integral_gain_of_the_other_sign_starts_from_rest(name, gain):
    """It integrates as well: at rest its input is zero, and the integral holds its output."""
    values = lively_values(name)
    values[gain] = -0.05 * (values[gain] or 1.0)
    simulator = Simulator(system_of(name), Inputs(0.0, 0.2, ()), np.linspace(0.0, 0.2, 21), 1e-3)
    vt = simulator.samples(values, ("vt",))[0]
    # an unstable loop lets rounding grow, in 0.2 s by far less than this
    assert np.max(np.abs(vt - vt[0])) < 1e-9


@pytest.mark.parametrize("name", [row.symbol for row in SHARED])
def test_a_shared_row_is_of_several_exciters(name):
    (shared_row,) = shared(**{name: 0.0})
    same = [
        name
        for name, model in MODELS.items()
        if shared_row in [row._replace(typical=0.0) for row in model.sheet]
    ]
    assert len(same) > 1


@pytest.mark.parametrize(
    ("name", "change", "fault"),
    [
        ("PIDGOV", {"G1": 0.7}, "G2"),
        ("PIDGOV", {"P3": 0.8}, "P3"),
        ("WPIDHY", {"G2": 1.0}, "P3"),
        ("HYG3", {"PGV2": 0.05}, "GV2"),
        ("HYG3", {"GV6": 1.1}, "GV6"),
        ("H6E", {"PGV9": 0.8}, "GV9"),
        ("H6E", {"BGV10": 0.9}, "BGV10"),
    ],
)
def test_a_curve_over_the_gate_that_does_not_rise_is_a_contradiction(name, change, fault):
    values = typical(GOVERNORS[name].sheet)
    assert list(contradictions(values)) == []
    assert [symbol for symbol, _ in contradictions(values | change)] == [fault]


def test_points_of_a_curve_over_the_gate_may_coincide():
    values = typical(GOVERNORS["HYG3"].sheet)
    none = {name: 0.0 for name in values if name.startswith(("GV", "PGV"))}
    assert list(contradictions(values | none)) == []
    ten = typical(GOVERNORS["H6E"].sheet)
    assert list(contradictions(ten | {"GV10": 0.0, "BGV10": 1.2, "BGV9": ten["BGV8"]})) == []
