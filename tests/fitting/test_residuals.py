"""Residuals and their Jacobians over the scaled free parameters."""

import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import lively_values, system_of

from exfit.case.ties import Ties, parse
from exfit.dsp.noise import noise
from exfit.dsp.robust_loss import LOSSES
from exfit.errors import SimulationError
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.noise import LEAST_NOISE
from exfit.fitting.parameters import FreeParameter, Prior
from exfit.fitting.residuals import (
    CENTRAL_STEP,
    ONE_SIDED_STEP,
    Residuals,
    Robust,
    SimulationCounter,
)
from exfit.fitting.search import JACOBIANS
from exfit.models import MODELS
from exfit.plants import VT0
from exfit.simulation.inputs import Inputs, InputStep, each
from exfit.simulation.simulator import Simulator

TIMES = np.linspace(0.0, 2.0, 101)
INPUTS = Inputs(0.0, 2.0, (InputStep(0.5, 0.005),))
WEIGHTS = {"vt": 1.0, "efd": 0.01, "ifd": 0.5}


@cache
def free_names(exciter):
    """Return the five parameters of an exciter that move its vt most, no limits among them."""
    values = lively_values(exciter)
    rows = [row.symbol for row in MODELS[exciter].sheet if values[row.symbol] > 0.0]
    names = tuple(symbol for symbol in rows if not symbol.endswith(("MAX", "MIN")))
    simulator = Simulator(system_of(exciter), INPUTS, TIMES, 1e-3)
    slopes = simulator.tangents(values, ("vt",), each(names))[1]
    moved = dict(zip(names, np.abs(slopes[:, 0]).max(axis=0), strict=True))
    return sorted(names, key=lambda name: values[name] * moved[name])[-5:]


def problem(exciter, logarithmic=True, signals=("vt",), offset=0.01, **bounds):
    """Return residuals against a record that is everywhere ``offset`` above the truth."""
    values = lively_values(exciter)
    simulator = Simulator(system_of(exciter), INPUTS, TIMES, 1e-3)
    truth = simulator.samples(values, signals)[0]
    channels = [
        Channel(name, truth[:, k] + offset, WEIGHTS[name]) for k, name in enumerate(signals)
    ]
    free = [
        FreeParameter(
            name,
            values[name],
            *bounds.get(name, (values[name] / 10, values[name] * 10)),
            logarithmic,
        )
        for name in free_names(exciter)
    ]
    return Residuals([Experiment(simulator, tuple(channels))], free, values)


@pytest.mark.parametrize("logarithmic", [True, False])
def test_residuals_are_simulated_minus_measured_times_weight(exciter, logarithmic):
    signals = ("vt", "efd", "ifd")
    residuals = problem(exciter, logarithmic, signals)
    expected = np.concatenate([np.full(101, -0.01 * WEIGHTS[name]) for name in signals])
    assert residuals(residuals.start) == pytest.approx(expected, abs=1e-12)


# what differences err by: curvature times the step or its square, and rounding over the step
KINDS = (
    ("central", 1e-6, CENTRAL_STEP),
    ("forward", 1e-5, ONE_SIDED_STEP),
    ("backward", 1e-5, ONE_SIDED_STEP),
)
ROUNDING = 5e-14  # of a run of thousands of steps, pu


@pytest.mark.parametrize("logarithmic", [True, False])
@pytest.mark.parametrize("signals", [("vt",), ("efd", "vt"), ("vt", "efd", "ifd")])
def test_exact_and_difference_jacobians_agree(exciter, signals, logarithmic):
    residuals = problem(exciter, logarithmic, signals)
    theta = residuals.start
    exact = residuals.exact(theta)
    assert exact.shape == (101 * len(signals), len(theta))
    size = np.abs(exact).max(axis=0)
    for kind, tolerance, step in KINDS:
        got = JACOBIANS[kind](residuals, theta)
        error = np.abs(got - exact).max(axis=0)
        assert (error <= tolerance * size + ROUNDING / step).all(), kind


def test_a_jacobian_at_a_bound_stays_within(exciter):
    values = lively_values(exciter)
    name = free_names(exciter)[0]
    for bounds in ((values[name], values[name] * 5), (values[name] / 5, values[name])):
        residuals = problem(exciter, **{name: bounds})
        seen = []
        simulator = residuals.experiments[0].simulator
        run = simulator.samples_of_many
        simulator.samples_of_many = lambda sets, out, tests, run=run, seen=seen: (
            seen.extend(one[name] for one in sets) or run(sets, out, tests)
        )
        exact = residuals.exact(residuals.start)
        for kind, _, step in KINDS:
            got = JACOBIANS[kind](residuals, residuals.start)
            # at the bound even the central ones are one-sided
            error = np.abs(got - exact).max()
            assert error < 1e-4 * np.abs(exact).max() + ROUNDING / step, kind
        assert bounds[0] <= min(seen)
        assert max(seen) <= bounds[1]


positive = st.floats(1e-6, 1e6)


@settings(deadline=None, derandomize=True)
@given(positive, st.floats(1.01, 1e4), st.floats(0.0, 1.0), st.booleans())
def test_scaling_and_back_is_the_identity_and_bounds_are_exact(low, ratio, share, logarithmic):
    high = low * ratio
    value = low + share * (high - low)
    free = FreeParameter("X", value, low, high, logarithmic)
    assert free.value(free.scaled(value)) == pytest.approx(value, rel=1e-9)
    assert free.value(free.scaled(low)) == low
    assert free.value(free.scaled(high)) == high
    if not logarithmic:
        assert free.scaled(high) - free.scaled(low) == pytest.approx(1.0)


@pytest.mark.parametrize("logarithmic", [True, False])
def test_the_slope_of_the_scale_is_its_derivative(logarithmic):
    free = FreeParameter("X", 3.0, 0.5, 20.0, logarithmic)
    theta = free.scaled(3.0)
    expected = (free.value(theta + 1e-6) - free.value(theta - 1e-6)) / 2e-6
    assert free.slope(theta) == pytest.approx(expected, rel=1e-6)


def test_on_its_bounds_a_parameter_is_exactly_the_bound(exciter):
    residuals = problem(exciter)
    for side, theta in enumerate(residuals.bounds):
        values = residuals.values(theta)
        for one in residuals.free:
            assert values[one.name] == (one.low, one.high)[side]


def test_zero_may_be_a_bound_of_a_linear_parameter(exciter):
    free = FreeParameter("TA", 0.01, 0.0, 0.1, False)
    assert free.value(free.scaled(0.0)) == 0.0


def test_what_is_fixed_stays(exciter):
    residuals = problem(exciter)
    moved = residuals.values(residuals.start + 0.1)
    free = set(free_names(exciter))
    fixed = {name: value for name, value in lively_values(exciter).items() if name not in free}
    assert fixed.items() <= moved.items()
    assert all(moved[name] != lively_values(exciter)[name] for name in free)


def test_a_set_that_cannot_be_simulated_costs_infinity(exciter):
    whole = problem(exciter)
    residuals = replace(whole, fixed={**whole.fixed, VT0: float("nan")})
    got = residuals(residuals.start)
    assert got.shape == (101,)
    assert (got == np.inf).all()


def test_every_run_is_counted(exciter):
    counter = SimulationCounter()
    residuals = problem(exciter).counted_by(counter)
    count = len(residuals.free)
    for call, cost in (
        (residuals, 1),
        (residuals.exact, 1),
        (residuals.central, 2 * count),
        (residuals.forward, 2 * count),
    ):
        before = counter.simulations
        call(residuals.start)
        assert counter.simulations == before + cost
    assert counter.substeps >= 1


@pytest.mark.long
def test_simulations_in_many_threads_are_all_counted():
    counter = SimulationCounter()
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: counter.add(1, k), range(10_000)))
    assert (counter.simulations, counter.substeps) == (10_000, 9_999)


def with_extras(exciter, free, ties=None, robust=None):
    """Return residuals whose free parameters, ties and loss are others."""
    plain = problem(exciter)
    names = {one.name for one in free}
    fixed = {name: value for name, value in plain.fixed.items() if name not in names}
    return Residuals(plain.experiments, free, fixed, ties or Ties(), robust)


def test_a_prior_is_one_more_error_in_the_unit_of_the_noise():
    plain = problem("AC1A")
    known = Prior(plain.free[0].start * 1.1, plain.free[0].start * 0.05)
    free = [replace(plain.free[0], prior=known), *plain.free[1:]]
    residuals = with_extras("AC1A", free)
    found, theta = residuals(residuals.start), residuals.start
    assert found[:-1] == pytest.approx(plain(plain.start), rel=1e-9, abs=1e-12)
    # the start is two standard deviations below the mean
    assert found[-1] == pytest.approx(-2.0 * residuals.noise, rel=1e-12)
    exact = residuals.exact(theta)
    assert exact.shape == (len(found), len(free))
    assert exact[-1, 0] == pytest.approx(residuals.noise * np.exp(theta[0]) / known.std)
    assert np.all(exact[-1, 1:] == 0.0)


@pytest.mark.parametrize("name", ["huber", "soft-l1"])
def test_a_loss_applies_to_samples_and_not_to_priors(name):
    plain = problem("AC1A")
    known = Prior(plain.free[0].start * 1.1, plain.free[0].start * 1e-9)
    free = [replace(plain.free[0], prior=known), *plain.free[1:]]
    loss = LOSSES[name]
    residuals = with_extras("AC1A", free, robust=Robust(loss, 2.0))
    found = residuals(residuals.start)
    scale = 2.0 * max(noise(plain.channels[0].measured), LEAST_NOISE)
    assert found[:-1] == pytest.approx(loss.residual(plain(plain.start), scale), rel=1e-12)
    assert found[-1] == pytest.approx(-1e8 * residuals.noise, rel=1e-6)
    differences = residuals.central(residuals.start)
    size = np.abs(differences).max(axis=0)
    assert (np.abs(residuals.exact(residuals.start) - differences).max(axis=0) <= 1e-6 * size).all()


def test_a_tied_parameter_moves_with_what_it_follows():
    """Its column is the sum of both, each times its own slope."""
    plain = problem("AC1A")
    first, second = plain.free[0], plain.free[1]
    ties = Ties({second.name: parse(f"={second.start / first.start!r}*{first.name}")})
    tied = with_extras("AC1A", [first, *plain.free[2:]], ties)
    apart, together = plain.exact(plain.start), tied.exact(tied.start)
    # on the scale of logarithms a ratio that stays moves both alike
    assert together[:, 0] == pytest.approx(apart[:, 0] + apart[:, 1], rel=1e-9, abs=1e-12)
    assert together[:, 1:] == pytest.approx(apart[:, 2:], rel=1e-9, abs=1e-12)


def test_a_tie_without_a_value_costs_infinity_and_has_no_derivative():
    plain = problem("AC1A")
    first, second = plain.free[0], plain.free[1]
    ties = Ties({second.name: parse(f"=({first.name}-{first.start!r})**0.5")})
    residuals = with_extras("AC1A", [first, *plain.free[2:]], ties)
    below = residuals.start - np.eye(len(residuals.free))[0] * 0.1
    assert np.all(residuals(below) == np.inf)
    assert np.isinf(residuals.residuals([below])[0]).all()
    for jacobian in (residuals.exact, residuals.central):
        with pytest.raises(SimulationError, match=re.escape(f"({first.name}-")):
            jacobian(residuals.start)
