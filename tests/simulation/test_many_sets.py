"""Many parameter sets in one call: each is what it is alone, to the last bit."""

import numpy as np
import pytest
from oracle import drawn_values, lively_values, system_of

from exfit.engine.kernel import linear_kernel
from exfit.engine.system import parameters_used, time_constants
from exfit.errors import SimulationError
from exfit.models.blocks import SHORTEST
from exfit.simulation.inputs import Direction, Inputs, InputStep, each
from exfit.simulation.simulator import Simulator
from exfit.simulation.substeps import NO_SUBSTEPS, spectral_radii, substeps_at_rest, too_fast

CLOCK = np.linspace(0.0, 1.0, 101)
UP = Inputs(0.0, 1.0, (InputStep(0.1, 0.05),))
SMOOTH = Inputs(0.0, 1.0, (InputStep(0.10037, 3e-3, smooth=True), InputStep(0.6, -1e-3)))


@pytest.mark.parametrize("count", [1, 2, 5, 19])
def test_each_set_has_its_own_substeps_and_samples(count):
    """Between grid points as well; of the first set the time constants need three times as many."""
    times = CLOCK + 3.7e-4
    simulator = Simulator(system_of("AC1A"), UP, times, 1e-2)
    sets = [drawn_values("AC1A", seed) for seed in range(count)]
    sets[0] |= {"TE": sets[0]["TE"] / 10.0}
    samples, parts = simulator.samples_of_many(sets, ("vt", "efd"))
    for together, own, values in zip(samples, parts, sets, strict=True):
        alone, substeps = simulator.samples(values, ("vt", "efd"))
        assert own == substeps
        np.testing.assert_array_equal(together, alone)


def test_tangents_of_many_sets_are_those_of_each(model):
    """With directions of their own, each with its own steps and delay."""
    system = system_of(model)
    simulator = Simulator(system, SMOOTH, CLOCK, 1e-3)
    names = sorted(parameters_used(system))[:7]
    sets = [drawn_values(model, seed) for seed in range(4)]
    tests, directions = [], []
    for k in range(len(sets)):
        smooth, exact = SMOOTH.steps
        moved = (smooth._replace(at=smooth.at + 3e-4 * k), exact._replace(step=-1e-3 * k))
        tests.append(simulator.with_inputs(moved, 1e-3 * k))
        along = Direction({names[0]: 0.1 * (k + 1)}, {0: (1.0, 0.1 * k), 1: (0.0, 1.0)}, 0.5 * k)
        directions.append((*each(names), along, Direction(delay=1.0)))
    together = simulator.tangents_of_many(sets, ("vt",), directions, tests)
    plain, parts = simulator.samples_of_many(sets, ("vt",), tests)
    for k, (test, values, own) in enumerate(zip(tests, sets, directions, strict=True)):
        samples, slopes = test.tangents(values, ("vt",), own)
        assert together[2][k] == parts[k] == test.substeps(values)
        np.testing.assert_array_equal(plain[k], samples)
        np.testing.assert_array_equal(together[0][k], samples)
        np.testing.assert_array_equal(together[1][k], slopes)


def test_a_set_without_a_start_at_rest_fails_alone():
    simulator = Simulator(system_of("AC1A"), UP, CLOCK, 1e-3)
    values = lively_values("AC1A")
    without, too_fast = values | {"VAMAX": 0.1}, values | {"TE": 1e-9}
    sets = [values, without, values | {"KA": 300.0}, too_fast]
    with pytest.raises(SimulationError, match="no state of rest"):
        simulator.samples(without, ("vt",))
    with pytest.raises(SimulationError, match="sub-steps"):
        simulator.tangents(too_fast, ("vt",), each(("KA",)))
    samples, parts = simulator.samples_of_many(sets, ("vt",))
    _, slopes, of_tangents = simulator.tangents_of_many(sets, ("vt",), [each(("KA",))] * 4)
    assert list(parts == NO_SUBSTEPS) == list(of_tangents == NO_SUBSTEPS)
    assert list(parts == NO_SUBSTEPS) == [False, True, False, True]
    assert np.isnan(samples[1::2]).all()
    assert np.isnan(slopes[1::2]).all()
    for k in (0, 2):
        alone, _ = simulator.samples(sets[k], ("vt",))
        np.testing.assert_array_equal(samples[k], alone)


@pytest.mark.parametrize("step", [1e300, 1e308])
def test_a_message_of_too_many_substeps_is_short_however_many_they_are(step):
    fault = str(too_fast(system_of("AC1A"), step, lively_values("AC1A"), 1e10))
    assert fault.startswith(f"simulation.step: {step:g} s would need ")
    assert len(fault) < 200


def test_the_substeps_are_those_of_the_largest_rate(model):
    """By a bound of the spectral radius or by eigenvalues: at steps on both sides of a limit."""
    system = system_of(model)
    values = [drawn_values(model, seed) for seed in range(6)]
    p = np.array([[own[name] for name in system.parameters] for own in values])
    radii = spectral_radii(linear_kernel(system).at_rest(p).jacobian)
    lags = [
        [own[name] for name in time_constants(system) if own[name] >= SHORTEST] for own in values
    ]
    rates = np.maximum(radii, [1.0 / min(own, default=np.inf) for own in lags])
    for share in (0.1, 0.6, 0.999, 1.001, 2.3, 40.0):
        step = share / rates[0]
        expected = np.maximum(np.ceil(step * rates), 1.0)
        np.testing.assert_array_equal(substeps_at_rest(system, step, p), expected)
