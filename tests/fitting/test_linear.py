"""The linear form of residuals: the small-signal response at its full size, where it has one."""

from dataclasses import replace

import numpy as np
import pytest
from cases import FIRST_ORDER
from places import ROOT
from records import TEST, TIME, UNIT, case_of, one, synthetic, write

from exfit.case.load import load_case
from exfit.fitting.build import build_experiments
from exfit.fitting.further_starts import linear_form
from exfit.fitting.problem import compressed, residuals_of

STEPS = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}, {"at": 3.0, "step": -0.08}]}
CHANNELS = {"vt": "vt", "efd": {"column": "efd", "weight": 0.02}}
ENLARGED_ROUNDING = 1e-9  # pu: 1e-12 of a run of thousands of steps, a thousand times as large


def residuals(case):
    return residuals_of(case, build_experiments(case))


@pytest.fixture
def large_steps(tmp_path):
    """Return residuals of vt and efd, whose steps are so large that limits are met."""
    synthetic(tmp_path, STEPS, TIME, signals=("vt", "efd"))
    return residuals(case_of(one(STEPS, CHANNELS, tuple(UNIT)), tmp_path))


def with_steps(given, share):
    """Return residuals whose test has a share of each step."""
    experiment = given.experiments[0]
    inputs = experiment.simulator.inputs
    steps = tuple(step._replace(step=share * step.step) for step in inputs.steps)
    simulator = experiment.simulator.with_inputs(steps, 0.0)
    return replace(given, experiments=[replace(experiment, simulator=simulator)])


def responses(given):
    """Return the simulated signals (M, channels) at the start."""
    return given.experiments[0].samples(given.values(given.start))[0]


def test_a_model_that_is_linear_has_one_form(tmp_path):
    write(tmp_path / "record.csv", t=TIME, vt=np.zeros(len(TIME)))
    record = {"file": "record.csv", "time": "t", "channels": {"vt": "vt"}}
    whole = residuals(case_of({**FIRST_ORDER, "record": record}, tmp_path))
    linear = linear_form(whole)
    assert linear(whole.start) == pytest.approx(whole(whole.start), abs=ENLARGED_ROUNDING)
    assert linear.exact(whole.start) == pytest.approx(whole.exact(whole.start), abs=1e-8)


def test_deviations_from_the_rest_are_in_proportion_to_the_steps(large_steps):
    full, half = (responses(linear_form(with_steps(large_steps, s))) for s in (1.0, 0.5))
    rest = full[0]
    # of the second order in a share of 1e-3
    assert half - rest == pytest.approx(0.5 * (full - rest), abs=1e-3 * np.ptp(full))
    assert np.ptp(full, axis=0).min() > 0.05


def test_a_small_step_has_the_linear_response_up_to_its_square(large_steps):
    apart = []
    for share in (0.02, 0.01):
        small = with_steps(large_steps, share)
        apart.append(np.max(np.abs(responses(linear_form(small)) - responses(small))))
    assert 3.5 < apart[0] / apart[1] < 4.5


def test_no_limit_matters(large_steps):
    def linear_and_whole(ceiling):
        limited = replace(large_steps, fixed={**large_steps.fixed, "VRMAX": ceiling})
        return linear_form(limited)(limited.start), limited(limited.start)

    (linear, whole), (linear_low, whole_low) = linear_and_whole(14.5), linear_and_whole(3.0)
    assert np.max(np.abs(whole - whole_low)) > 1e-3
    assert np.array_equal(linear, linear_low)


def test_sets_side_by_side_have_the_linear_response_as_well(large_steps):
    linear = linear_form(large_steps)
    points = linear.start + np.array([[0.0], [0.1]])
    for point, errors in zip(points, linear.residuals(points), strict=True):
        assert errors == pytest.approx(linear(point), abs=ENLARGED_ROUNDING)


def test_it_can_be_compressed(tmp_path):
    dense = np.sort(np.random.default_rng(3).uniform(0.0, 3.0, 20_000))
    synthetic(tmp_path, TEST, dense)
    content = {**one(TEST, free=("KA", "TE")), "simulation": {"step": 0.01}}
    linear = linear_form(residuals(case_of(content, tmp_path)))
    few = compressed(linear)
    assert few.count < linear.count / 3
    x = linear.start + 0.1
    whole, short = linear(x), few(x)
    assert short @ short == pytest.approx(whole @ whole, rel=1e-9)
    assert few.exact(x).T @ short == pytest.approx(linear.exact(x).T @ whole, rel=1e-7)


def test_signals_that_drive_the_simulation_leave_it_without_meaning():
    reason = linear_form(residuals(load_case(ROOT / "configs" / "exciter_playback.yaml")))
    assert "recorded signals drive the simulation: vt, ifd" in reason


def test_a_network_that_is_switched_leaves_it_without_meaning():
    on_line = residuals(load_case(ROOT / "configs" / "ac8b_on_line.yaml"))
    assert not isinstance(linear_form(on_line), str)
    (experiment,) = on_line.experiments
    simulator = experiment.simulator
    switching = simulator.inputs.steps[0]._replace(signal="X")
    simulator.inputs = replace(simulator.inputs, steps=(switching,))
    assert linear_form(on_line) == "the test switches the reactance of the network"


def test_a_unit_that_rests_on_a_limit_has_none(large_steps):
    floor = responses(large_steps)[0, 1]  # efd at rest
    held = replace(large_steps, fixed={**large_steps.fixed, "VRMIN": -14.5})
    assert not isinstance(linear_form(held), str)
    demand = resting_demand(large_steps)
    held = replace(large_steps, fixed={**large_steps.fixed, "VAMIN": demand})
    assert demand > floor
    assert linear_form(held) == "before the test the unit rests on a limit: VAMIN"


def resting_demand(given):
    """Return the regulator's output before the test."""
    experiment = given.experiments[0]
    values = experiment.parameters(given.values(given.start))
    return float(experiment.simulator.run(values).outputs["VA"][0])
