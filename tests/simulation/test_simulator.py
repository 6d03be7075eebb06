"""The grid, the samples, the sub-steps and what cannot be simulated."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import (
    drawn_values,
    fastest_rate,
    lively_values,
    system_of,
    typical_values,
)
from scipy.integrate import solve_ivp

from exfit.engine.system import Motion, Rest, System, parameters_used, trace
from exfit.errors import SimulationError
from exfit.models import MODELS
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES
from exfit.plants import SATURATION, VT0
from exfit.plants.open_circuit import open_circuit
from exfit.simulation.inputs import (
    Direction,
    Inputs,
    InputStep,
    RecordedInput,
    each,
    grid_segments,
)
from exfit.simulation.interpolation import GridSegment, Interpolation
from exfit.simulation.simulator import Simulator
from exfit.simulation.substeps import MOST_SUBSTEPS

UP = Inputs(0.0, 2.0, (InputStep(0.5, 3e-4),))  # off the limits
AT_REST = Inputs(0.0, 2.0, ())
CLOCK = np.linspace(0.0, 2.0, 201)
ANSWERING = [name for name in MODELS if name != "IEEET4"]  # whose dead band hears no small step
laws = settings(deadline=None, derandomize=True, max_examples=25)


def samples(name, values, inputs=UP, times=CLOCK, step=1e-3, outputs=("vt",)):
    return Simulator(system_of(name), inputs, times, step).samples(values, outputs)[0]


ROUNDING = 2e-12  # pu, of a run of thousands of steps


def short_step(model, values, share):
    """Return a step (s) that is short beside the model: a share of 1 / its fastest rate."""
    return share / fastest_rate(system_of(model), values)


# --- grid and samples -----------------------------------------------------------------------------


@laws
@given(st.lists(st.floats(0.0, 3.0), max_size=4, unique=True), st.floats(1e-3, 0.5))
def test_the_grid_is_gapless_and_every_change_lies_on_it(instants, step):
    changes = tuple(InputStep(at, 0.1) for at in sorted(instants))
    grid = grid_segments(Inputs(0.0, 3.0, changes), step)
    ends = [part.start + part.step * part.steps for part in grid]
    assert grid[0].start == 0.0
    assert ends == pytest.approx([part.start for part in grid[1:]] + [3.0], abs=1e-12)
    inside = [at for at in sorted(instants) if 0.0 < at < 3.0]
    assert [part.start for part in grid[1:]] == inside
    assert all(part.step <= step * (1.0 + 1e-5) for part in grid)
    inputs = Inputs(0.0, 3.0, changes)
    level = inputs.level("vref", grid[-1].start)
    assert level == pytest.approx(0.1 * sum(at < 3.0 for at in instants))


def test_at_the_instant_of_a_step_the_value_is_that_before_it(model):
    for at in (0.5, 0.50037):
        inputs = Inputs(0.0, 1.0, (InputStep(at, 0.02),))
        times = np.array([at - 1e-3, at, at + 1e-3])
        vref = samples(model, lively_values(model), inputs, times, outputs=("vref",))[:, 0]
        assert vref[1] == pytest.approx(vref[0], abs=1e-12)  # a mean of equal values
        assert vref[2] - vref[1] == pytest.approx(0.02)


def test_a_step_between_grid_points_is_the_same_step_later(model):
    """Two grids of one response: they differ by the method's error alone."""
    values, delay = lively_values(model), 0.00037
    later = Inputs(0.0, 2.0, (InputStep(0.5 + delay, UP.steps[0].step),))
    got = samples(model, values, later, CLOCK[:-1] + delay)
    assert np.abs(got - samples(model, values)[:-1]).max() < 1e-9


def test_steps_add_up(model):
    values = lively_values(model)
    several = Inputs(0.0, 2.0, (InputStep(0.5, 0.03), InputStep(1.0, -0.02), InputStep(1.2, 0.01)))
    vref = samples(model, values, several, outputs=("vref",))[:, 0]
    levels = vref - vref[0]
    assert levels[[49, 51, 99, 101, 119, 121, 200]] == pytest.approx(
        [0.0, 0.03, 0.03, 0.01, 0.01, 0.02, 0.02]
    )


def test_a_step_up_and_back_returns_to_rest():
    values = typical_values("AC1A")
    inputs = Inputs(0.0, 60.0, (InputStep(1.0, 0.05), InputStep(20.0, -0.05)))
    vt = samples("AC1A", values, inputs, np.array([0.0, 20.0, 60.0]))[:, 0]
    assert vt[2] == pytest.approx(vt[0], abs=1e-6)
    assert vt[1] - vt[0] > 0.04


def test_the_response_to_a_small_bump_scales_and_mirrors(model):
    values = lively_values(model)

    def moved(size):
        vt = samples(model, values, Inputs(0.0, 2.0, (InputStep(0.5, size),)))
        return (vt - vt[0]) / size

    assert moved(1e-5) == pytest.approx(moved(-1e-5), abs=1e-3)
    assert moved(1e-5) == pytest.approx(moved(2e-5), abs=1e-3)


def test_samples_at_uneven_times_err_as_little_as_the_method(model):
    """Halving the step divides the error of samples between grid points by sixteen."""
    values, rng = lively_values(model), np.random.default_rng(4)
    times = np.sort(rng.uniform(0.01, 2.0, 200))
    inputs, step = Inputs(0.0, 2.0, (InputStep(0.0, 3e-4),)), short_step(model, values, 0.2)
    finest, *ends = (samples(model, values, inputs, times, h) for h in (step / 32, step, step / 2))
    errors = [np.abs(end - finest).max() for end in ends]
    assert errors[0] / errors[1] > 11.0 or errors[1] < ROUNDING
    assert errors[1] < 1e-8


def test_a_sample_on_the_grid_is_the_computed_value(model):
    values = lively_values(model)
    fine = samples(model, values, times=np.linspace(0.0, 2.0, 2001))
    rng = np.random.default_rng(5)
    some = np.sort(rng.choice(2001, 50, replace=False))
    got = samples(model, values, times=np.append(some * 1e-3, 1.99951))
    np.testing.assert_allclose(got[:-1], fine[some], rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("steps", range(1, 9))
def test_a_line_is_read_as_it_is_however_short_the_last_stretch(steps):
    """Between grid points, on them, and behind the end, where the last value holds."""
    grid = [GridSegment(0.0, 0.01, 20), GridSegment(0.2, 0.01, steps)]
    end = grid[-1].end
    times = np.sort(np.append(np.linspace(0.003, end + 0.02, 50), [0.0, 0.2, end]))
    read = Interpolation(grid, times)([part.times[:, None] for part in grid])[:, 0]
    np.testing.assert_allclose(read, np.minimum(times, end), rtol=0.0, atol=1e-12)


def test_a_response_has_every_signal_and_state_on_its_clock(model):
    system = system_of(model)
    response = Simulator(system, UP, CLOCK, 1e-3).response(lively_values(model))
    assert tuple(response.signals) == system.outputs
    assert response.time is CLOCK
    assert all(signal.shape == CLOCK.shape for signal in response.signals.values())


def test_many_sets_give_what_each_gives(model):
    simulator = Simulator(system_of(model), UP, CLOCK, 1e-3)
    sets = [drawn_values(model, seed) for seed in range(19)]
    together, parts = simulator.samples_of_many(sets, ("vt",))
    assert together.shape == (19, 201, 1)
    for samples, substeps, values in zip(together, parts, sets, strict=True):
        expected, own_substeps = simulator.samples(values, ("vt",))
        assert substeps == own_substeps
        assert np.abs(samples - expected).max() < 1e-12  # rounding


# --- what a fit may move --------------------------------------------------------------------------

SMOOTH = InputStep(0.50037, 3e-4, smooth=True)
BETWEEN = (np.arange(75) * 26 + 0.5) * 1e-3  # s, in the middle of steps of 1 ms
FIVE_POINTS = {1: 8.0, -1: -8.0, 2: -1.0, -2: 1.0}  # the difference that is exact up to quartics
MOVED = 1e-4  # of a direction; of an instant or a delay, in s, within its step
# of a difference of two runs, pu: some dozen units in the last place of vt
DIFFERENCE_ROUNDING = 2e-14


def along(simulator, values, direction, far, outputs=("vt",)):
    """Return the samples when what a direction names has moved ``far`` along it."""
    steps = list(simulator.inputs.steps)
    for index, (at, step) in direction.steps.items():
        old = steps[index]
        steps[index] = old._replace(at=old.at + far * at, step=old.step + far * step)
    values = values | {name: values[name] + far * v for name, v in direction.parameters.items()}
    moved = simulator.with_inputs(tuple(steps), simulator.delay + far * direction.delay)
    return moved.samples(values, outputs)[0]


def assert_exact(simulator, values, directions, outputs=("vt",), h=MOVED):
    """Assert that tangents equal differences, to 1e-7 of the largest and to rounding."""
    got, slopes = simulator.tangents(values, outputs, directions)
    assert got == pytest.approx(simulator.samples(values, outputs)[0], abs=1e-12)
    for column, direction in enumerate(directions):
        ends = {k: along(simulator, values, direction, k * h, outputs) for k in FIVE_POINTS}
        expected = sum(weight * ends[k] for k, weight in FIVE_POINTS.items()) / (12.0 * h)
        error = np.abs(slopes[:, :, column] - expected).max(axis=0)
        size = np.abs(slopes[:, :, column]).max(axis=0)
        rounding = DIFFERENCE_ROUNDING * np.maximum(1.0, np.abs(got).max(axis=0)) / h
        assert (error <= 1e-7 * size + rounding).all(), direction


def test_tangents_are_the_slopes_of_the_samples(model):
    """Of parameters, a tie of two, instant and size of a smooth step, another's size, a delay."""
    system, values = system_of(model), lively_values(model)
    inputs = Inputs(0.0, 2.0, (SMOOTH._replace(at=0.20037), InputStep(0.9, -3e-4)))
    simulator = Simulator(system, inputs, BETWEEN, 1e-3)
    free = (system.parameters[-1], *sorted(parameters_used(system))[:4])
    rates = {name: max(values[name], 0.1) for name in free}
    directions = (
        *(Direction({name: rate}) for name, rate in rates.items()),
        Direction({free[0]: 0.1 * rates[free[0]], free[1]: -rates[free[1]]}),
        Direction(steps={0: (1.0, 0.0)}),
        Direction(steps={0: (0.0, 0.1)}),
        Direction(steps={1: (0.0, 0.1)}),
        Direction(delay=1.0),
    )
    assert_exact(simulator, values, directions)


def test_tangents_are_exact_with_sub_steps_two_smooth_steps_and_two_inputs():
    """All of it moving at once, too; what one direction moves, others leave."""
    system = open_circuit(
        MODELS["AC8B"], MACHINES["GENROU"], SATURATION["quadratic"], ("vref", "vs")
    )
    values = lively_values("AC8B")
    steps = (
        SMOOTH,
        InputStep(0.8, -2e-4, "vs"),
        InputStep(0.80052, 1e-4, smooth=True),
        InputStep(1.2, 1e-4, "vs", smooth=True),
    )
    simulator = Simulator(system, Inputs(0.0, 2.0, steps), BETWEEN, 1e-3, least=3)
    assert simulator.substeps(values) == 3
    directions = (
        *(Direction(steps={k: (1.0, 0.0)}) for k in (0, 2, 3)),
        *(Direction(steps={k: (0.0, 0.1)}) for k in range(4)),
        Direction({"TE": 0.5}, {0: (0.5, 0.01), 1: (0.0, 0.02), 3: (-1.0, 0.01)}, delay=-0.7),
        Direction(delay=1.0),
    )
    # the third one's instant lies on the grid, where only the first derivative is continuous
    off_grid = simulator.with_inputs((*steps[:3], steps[3]._replace(at=1.20037)), 0.00113)
    assert_exact(off_grid, values, directions, ("vt", "efd", "vref"))


def test_tangents_are_exact_with_a_smooth_ramp_and_an_exact_one(model):
    steps = (InputStep(0.50037, 3e-4, smooth=True, ramp=0.4), InputStep(1.2, -1e-4, ramp=0.1))
    simulator = Simulator(system_of(model), Inputs(0.0, 2.0, steps), BETWEEN, 1e-3)
    name = sorted(parameters_used(simulator.system))[0]
    directions = (
        Direction(steps={0: (1.0, 0.0)}),
        Direction(steps={0: (0.0, 0.1)}),
        Direction(steps={1: (0.0, 0.1)}),
        Direction({name: 0.1}, {0: (0.5, 0.01), 1: (0.0, 0.02)}, delay=-0.7),
    )
    assert_exact(simulator, lively_values(model), directions)


def test_derivatives_asked_again_are_the_same_whatever_was_made_of_the_first():
    """Of fewer directions too; and those of other values, outputs or inputs are their own."""
    values, (first, second) = lively_values("AC1A"), each(("KA", "TE"))
    simulator = Simulator(system_of("AC1A"), UP, CLOCK, 1e-3)
    expected = [array.copy() for array in simulator.tangents(values, ("vt",), (first, second))]
    for array in simulator.tangents(values, ("vt",), (first, second)):
        array *= 2.0
    samples, slopes = simulator.tangents(values, ("vt",), (second,))
    assert np.array_equal(samples, expected[0])
    assert np.array_equal(slopes[..., 0], expected[1][..., 1])
    for other, at, outputs in (
        (simulator, values | {"KA": 1.01 * values["KA"]}, ("vt",)),
        (simulator, values, ("efd",)),
        (simulator.with_inputs(simulator.inputs.steps, 0.1), values, ("vt",)),
    ):
        assert not np.array_equal(other.tangents(at, outputs, (second,))[1], slopes)


def test_a_direction_that_moves_several_parameters_is_the_sum_of_theirs():
    values, names = lively_values("AC1A"), ("KA", "TE", "machine.Tpd0")
    simulator = Simulator(system_of("AC1A"), UP, CLOCK, 1e-3)
    rates = dict(zip(names, (3.0, -0.1, 2.0), strict=True))
    _, slopes = simulator.tangents(values, ("vt",), (*each(names), Direction(rates)))
    expected = slopes[:, :, :3] @ list(rates.values())
    assert slopes[:, :, 3] == pytest.approx(expected, rel=1e-10, abs=1e-12)


def test_the_derivative_to_an_instant_adds_up_across_grid_points():
    """By Gauss's rule on each side: the derivative is continuous, and all but linear there."""
    values, inputs = lively_values("AC1A"), Inputs(0.0, 2.0, (SMOOTH,))
    simulator = Simulator(system_of("AC1A"), inputs, CLOCK, 1e-3)

    def at(instant):
        return simulator.with_inputs((SMOOTH._replace(at=instant),), 0.0)

    total = 0.0
    nodes, weights = np.polynomial.legendre.leggauss(3)
    for low, high in ((0.4994, 0.5), (0.5, 0.501), (0.501, 0.5017)):
        for node, weight in zip(nodes, weights, strict=True):
            here = at((low + high + (high - low) * node) / 2.0)
            _, slopes = here.tangents(values, ("vt",), (Direction(steps={0: (1.0, 0.0)}),))
            total = total + slopes[:, :, 0] * weight * (high - low) / 2.0
    moved = at(0.5017).samples(values, ("vt",))[0] - at(0.4994).samples(values, ("vt",))[0]
    assert np.abs(moved).max() > 1e-6
    assert np.abs(total - moved).max() < 1e-7 * np.abs(moved).max() + DIFFERENCE_ROUNDING


@laws
@given(
    st.floats(0.1, 2.3),
    st.floats(-0.1, 0.1),
    st.sampled_from([0.05, 0.01, 1e-3]),
    st.sampled_from([0.0, 1e-6, 1e-3, 0.0123, 0.6]),
)
def test_the_area_under_a_smooth_step_is_that_of_the_exact_one(at, size, step, ramp):
    inputs = Inputs(0.0, 3.0, (InputStep(at, size, smooth=True, ramp=ramp),))
    (part,) = grid_segments(inputs, step)
    u = inputs.input("vref", part)
    area = part.step * (u.sum() - (u[0] + u[-1]) / 2.0)
    assert area == pytest.approx(size * (3.0 - at - ramp / 2.0), abs=1e-12)
    near = 1.001 * part.step
    before, behind = part.times < at - near, part.times > at + ramp + near
    assert (u[before] == 0.0).all()
    assert (u[behind] == size).all()
    within = (part.times > at + near) & (part.times < at + ramp - near)
    assert u[within] == pytest.approx(size * (part.times[within] - at) / ramp, abs=1e-12)
    assert (np.diff(u) * size >= -1e-18).all()


@pytest.mark.parametrize("at", [-5.0, -0.01, 3.01, 9.0])
def test_a_smooth_step_outside_the_test_is_over_or_never_comes(at):
    change = InputStep(at, 0.05, smooth=True)
    inputs = Inputs(0.0, 3.0, (change,))
    (part,) = grid_segments(inputs, 1e-3)
    assert (inputs.input("vref", part) == (0.05 if at < 0.0 else 0.0)).all()
    assert (change.share_slope(part) == 0.0).all()
    assert inputs.level("vref", 10.0) == 0.0


@pytest.mark.each_model
@pytest.mark.parametrize("name", ANSWERING)
def test_a_ramp_is_the_limit_of_many_small_steps(name):
    """Each in the middle of its share of the ramp: they miss it by the square of its length."""
    values = lively_values(name)
    ramp = samples(name, values, Inputs(0.0, 2.0, (InputStep(0.5, 3e-4, ramp=0.4),)))
    errors = []
    for count in (16, 32):  # short beside the loop of EXELI, too
        middles = 0.5 + 0.4 * (np.arange(count) + 0.5) / count
        stairs = Inputs(0.0, 2.0, tuple(InputStep(float(at), 3e-4 / count) for at in middles))
        errors.append(np.abs(samples(name, values, stairs) - ramp)[CLOCK > 1.0].max())
    assert errors[0] > 1e-10
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_the_response_to_a_ramp_is_the_integral_of_that_to_a_step():
    """k/(s + a) in closed form, the corners between grid points of 1 ms, exact and smooth."""
    k, a, at, ramp = 4.0, 2.0, 0.50037, 0.5
    integral = [np.maximum(CLOCK - corner, 0.0) for corner in (at, at + ramp)]
    ways = [k / a * (t - (1.0 - np.exp(-a * t)) / a) for t in integral]
    expected = (ways[0] - ways[1]) / ramp
    for smooth, error in ((False, 1e-12), (True, 2e-6)):
        inputs = Inputs(0.0, 2.0, (InputStep(at, 1.0, smooth=smooth, ramp=ramp),))
        got = samples("FIRST_ORDER", {"k": k, "a": a, "vt0": 0.0}, inputs)[:, 0]
        assert np.abs(got - expected).max() < error


def test_what_follows_without_a_pause_is_one_move():
    steps = (
        InputStep(0.5, 0.02, ramp=0.5),
        InputStep(0.8, 0.1, "vs"),
        InputStep(1.0, -0.05),
        InputStep(1.0, 0.01, ramp=0.2),
        InputStep(1.5, 0.03),
    )
    first, second = Inputs(0.0, 2.0, steps).moves("vref")
    assert first == pytest.approx((0.5, 1.2, -0.02, 0.03))
    assert second == pytest.approx((1.5, 1.5, 0.03, 0.03))


@pytest.mark.each_model
@pytest.mark.parametrize("name", ANSWERING)
def test_a_smooth_step_nears_the_exact_one_with_the_square_of_the_step(name):
    """It is spread with the variance h^2 / 3: half of that times the response's own curvature."""
    values, clock = lively_values(name), CLOCK[np.abs(CLOCK - SMOOTH.at) > 0.01]
    sharp = Inputs(0.0, 2.0, (SMOOTH._replace(smooth=False),))
    errors = []
    for step in (2e-3, 1e-3):
        smooth, exact = (
            samples(name, values, inputs, clock, step)
            for inputs in (Inputs(0.0, 2.0, (SMOOTH,)), sharp)
        )
        errors.append(np.abs(smooth - exact).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    dense = np.arange(SMOOTH.at + 0.009, 2.0, 1e-3)
    curvature = np.abs(np.diff(samples(name, values, sharp, dense)[:, 0], 2)).max() / 1e-3**2
    assert errors[1] < 1e-3**2 / 6.0 * curvature * 1.01


def test_a_later_instant_is_a_later_recorder_for_a_plant_at_rest(model):
    """To rounding by whole steps; else by what the step's second moment moves within a step."""
    values, inputs = lively_values(model), Inputs(0.0, 2.0, (SMOOTH,))
    simulator = Simulator(system_of(model), inputs, CLOCK[CLOCK < 1.9], 1e-3)
    late, early = SMOOTH.at + 0.013, SMOOTH.at - 0.02
    for at, least in ((late, 1e-13), (early, 1e-13), (late + 0.0004, 2e-5 * SMOOTH.step)):
        delay = at - SMOOTH.at
        moved = simulator.with_inputs((SMOOTH._replace(at=at),), 0.0).samples(values, ("vt",))[0]
        delayed = simulator.with_inputs((SMOOTH,), delay).samples(values, ("vt",))[0]
        # around the bend at the step itself a cubic cannot follow
        away = np.abs(simulator.times - at) > 0.005
        assert np.abs(moved - delayed)[away].max() < least + 1e-11


def test_a_recorder_with_a_delay_shows_what_was(model):
    """Before the start it shows the start, after the end the end, and neither has a slope."""
    values = lively_values(model)
    simulator = Simulator(system_of(model), Inputs(0.0, 2.0, (SMOOTH,)), CLOCK, 1e-3)
    undelayed = simulator.samples(values, ("vt",))[0]
    delay = Direction(delay=1.0)
    late, slopes = simulator.with_inputs((SMOOTH,), 0.25).tangents(values, ("vt",), (delay,))
    assert np.abs(late[25:] - undelayed[:-25]).max() < 1e-13
    assert (late[:25] == undelayed[0]).all()
    assert (slopes[:25] == 0.0).all()
    early, slopes = simulator.with_inputs((SMOOTH,), -0.25).tangents(values, ("vt",), (delay,))
    assert np.abs(early[:-25] - undelayed[25:]).max() < 1e-13
    assert early[-25:] == pytest.approx(np.full((25, 1), undelayed[-1, 0]), abs=1e-13)
    assert (slopes[-24:] == 0.0).all()
    assert (slopes[60:-26] != 0.0).all()


@pytest.mark.parametrize("spacing", [2.7e-4, 1e-3, 1.3e-3])
def test_the_area_under_a_recorded_input_stays(spacing):
    """Samples closer than the grid are averaged over it; a line between others stays a line."""
    (part,) = grid_segments(Inputs(0.2, 1.7, ()), 1e-3)
    times = np.arange(0.0, 2.0, spacing)
    line = RecordedInput(times, 2.0 + 3.0 * times).on(part)
    assert line == pytest.approx(2.0 + 3.0 * part.times, abs=1e-11)
    noise = np.random.default_rng(1).standard_normal(len(times))
    noise[(times < 0.25) | (times > 1.65)] = 0.0
    got = RecordedInput(times, noise).on(part)
    if spacing < part.step:
        assert part.step * got.sum() == pytest.approx(spacing * noise.sum(), abs=1e-13)
    else:
        assert (got == np.interp(part.times, times, noise)).all()


def test_a_moved_simulator_is_the_one_built_so():
    values, played = lively_values("AC1A"), {"vref": RecordedInput(CLOCK, 1e-3 * np.sin(CLOCK))}
    steps = (SMOOTH, InputStep(0.7, 1e-4), InputStep(1.3, 2e-4, smooth=True))
    inputs = Inputs(0.0, 2.0, steps, played)
    simulator = Simulator(system_of("AC1A"), inputs, BETWEEN, 1e-3)
    before = simulator.samples(values, ("vt",))[0]
    others = (steps[0]._replace(at=0.9), InputStep(0.7, 0.0), steps[2])
    moved = simulator.with_inputs(others, 0.0123)
    new = Simulator(
        system_of("AC1A"), Inputs(0.0, 2.0, others, played), BETWEEN, 1e-3, delay=0.0123
    )
    expected = new.samples(values, ("vt",))[0]
    np.testing.assert_array_equal(moved.samples(values, ("vt",))[0], expected)
    np.testing.assert_array_equal(simulator.samples(values, ("vt",))[0], before)
    back = moved.with_inputs(steps, 0.0)
    np.testing.assert_array_equal(back.samples(values, ("vt",))[0], before)


def test_only_what_is_smooth_may_change_its_instant():
    exact, smooth = UP.steps[0], SMOOTH
    simulator = Simulator(system_of("AC1A"), Inputs(0.0, 2.0, (exact, smooth)), CLOCK, 1e-3)
    wrong = (
        (exact._replace(at=0.6), smooth),
        (exact, smooth._replace(smooth=False)),
        (exact, smooth._replace(signal="vs")),
        (exact,),
    )
    for steps in wrong:
        with pytest.raises(ValueError, match="times of smooth ones"):
            simulator.with_inputs(steps, 0.0)
    values, moving = lively_values("AC1A"), Direction(steps={0: (1.0, 0.0)})
    with pytest.raises(ValueError, match=r"the step of vref at 0\.5 s is not smooth"):
        simulator.tangents(values, ("vt",), (moving,))


def test_a_simulator_made_from_another_keeps_its_steps_and_its_delay():
    """With finer steps a smooth step is sharper: the step error tells of it."""
    end = 33.0**0.5
    inputs = Inputs(0.0, 1.0, (InputStep(0.3, end + end**3, smooth=True),))
    times, values = np.linspace(0.0, 1.0, 51), {VT0: 0.0}
    start = Simulator(STIFFENING, inputs, times, 0.02)
    moved = start.with_inputs((inputs.steps[0]._replace(at=0.1),), 0.11)
    resolved = moved.with_enough_substeps(values)
    assert resolved is not moved
    assert (resolved.delay, resolved.inputs) == (0.11, moved.inputs)
    parts = moved.substeps(values)
    coarse, fine = (
        Simulator(STIFFENING, moved.inputs, times, 0.02 / n, parts).samples(values, ("x",))[0]
        for n in (1, 2)
    )
    assert moved.step_errors(values, ("x",))["x"] == np.abs(coarse - fine).max() > 0.0


# --- limits ---------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_lag_meets_and_leaves_its_limits_when_a_run_of_tiny_steps_does():
    """The lag of AC1A, driven by what it saw, against Euler's method with tiny steps.

    The loop is cut by KF = 0 and an exciter that is too slow to answer.
    """
    changes = {"KA": 40.0, "TA": 0.1, "VAMAX": 5.0, "VAMIN": -1.0, "KF": 0.0, "TE": 99.0}
    values = typical_values("AC1A", **changes, VRMAX=99.0, VRMIN=-99.0)
    inputs = Inputs(0.0, 2.0, (InputStep(0.2, 0.5), InputStep(0.9, -1.0), InputStep(1.4, 0.52)))
    got = samples("AC1A", values, inputs, outputs=("VA", "vref", "vt"))
    start, vt = got[0, 0], got[:, 2]
    vref = got[0, 1]

    def free(t, x, level):
        return (40.0 * (vref + level - np.interp(t, CLOCK, vt)) - x) / 0.1

    x, expected = start, [start]
    fine = np.arange(0.0, 2.0, 1e-5)
    for k, t in enumerate(fine):
        level = sum(change.step for change in inputs.steps if t >= change.at - 1e-9)
        x = min(max(x + 1e-5 * free(t, x, level), -1.0), 5.0)
        if (k + 1) % 1000 == 0:
            expected.append(x)
    assert max(expected) == 5.0
    assert min(expected) == -1.0
    # Euler's error at 10 us, 40 / 0.1 * 1e-5 / 2 of a pu
    assert np.abs(got[:, 0] - expected).max() < 4e-3


def test_halving_the_step_hardly_moves_a_response_that_meets_limits(exciter):
    values = lively_values(exciter)
    inputs = Inputs(0.0, 2.0, (InputStep(0.3, 0.3), InputStep(1.1, -0.4)))
    step = min(1e-3, short_step(exciter, values, 0.05))
    fine, *ends = (samples(exciter, values, inputs, step=h) for h in (step / 32, step, step / 4))
    errors = [np.abs(end - fine).max() for end in ends]
    # a state may be held a part of a step too early: what follows it errs by the step squared;
    # an integral is frozen a part of a step too early, and misses that part
    most, order = (8e-5, 1.0) if freezes(exciter, values, inputs) else (3e-5, 1.5)
    assert errors[0] < most
    assert errors[1] < most / 4.0**order


def freezes(exciter, values, inputs):
    """Return whether a state that has no limits of its own stands still for a while."""
    system = system_of(exciter)
    states = samples(exciter, values, inputs, outputs=system.states)
    still = (np.diff(states[inputs.steps[0].at < CLOCK], axis=0) == 0.0).any(axis=0)
    limited = [node.op == "clip" for node in trace(system, ("vt",)).clamped]
    return bool((still & ~np.array(limited)).any())


# how far beyond a limit a start may lie, and far enough for some
TRIED = {"MAX": ("above", (0.5, 0.1, 0.05, 1e-3)), "MIN": ("below", (0.1, 0.9, 1.3, 9.0))}
# what bounds a signal that other signals make up for, or that no start needs
WIDE = ("VBMAX", "VB1MAX", "VB2MAX", "VGMAX", "VHMAX", "VFWMAX", "VFWMIN")
# whose input is zero at rest
AT_A_PI = {
    "REXS": "VIMAX", "ST3C": "VIMAX", "AC11C": "VRSMAX", "ST10C": "VRSMAX", "EXELI": "SMAX"
}  # fmt: skip


def limits_of(exciter):
    """Return the limits that a start may lie beyond."""
    symbols = [row.symbol for row in MODELS[exciter].sheet]
    return [
        s for s in symbols if s.endswith(("MAX", "MIN")) and s not in (*WIDE, AT_A_PI.get(exciter))
    ]


def refusal(exciter, values):
    """Return what is said of values that have no start, or None where they have one."""
    try:
        samples(exciter, values, AT_REST, np.array([0.0, 0.01]))
    except SimulationError as error:
        return str(error)
    return None


@pytest.mark.parametrize("bypassed", [True, False])
def test_a_start_beyond_a_limit_names_it_with_both_values(exciter, bypassed):
    values = lively_values(exciter)
    if bypassed:
        lags = system_of(exciter).time_constants
        values |= {T: value for T, value in typical_values(exciter).items() if T in lags}
    for symbol in limits_of(exciter):
        side, tried = TRIED[symbol[-3:]]
        told = []
        for limit in tried:
            said = refusal(exciter, values | {symbol: limit}) or ""
            told += re.findall(rf"start needs (\S+), {side} {symbol}0? = ([^,; ]+)", said)[:1]
        assert told, symbol
        for number, bound in told:
            assert (float(number) > float(bound)) == (side == "above")
        # what follows from a limit is told, such as VRMAX - KC IFD: it moves with it
        bounds = [float(bound) for _, bound in told]
        assert bounds == sorted(bounds, reverse=side == "above")
        assert len(set(bounds)) == len(bounds)


def test_a_start_exactly_on_a_limit_is_a_start(exciter):
    """What holds the start is allowed; a hair less is not."""
    lively, system, met = lively_values(exciter), system_of(exciter), []
    # what a load takes from a ceiling is left out too
    for values in (lively, lively | {"KC": 0.0} if "KC" in lively else lively):
        start = Simulator(system, AT_REST, np.array([0.0]), 1e-3).response(values).signals
        for ceiling in (symbol for symbol in limits_of(exciter) if symbol.endswith("MAX")):
            for needed in (start[name][0] for name in (*system.states, "efd")):
                # which signal stands at which ceiling is found by trying
                less = refusal(exciter, values | {ceiling: needed * (1 - 1e-3)}) or ""
                more = refusal(exciter, values | {ceiling: needed * (1 + 1e-12)})
                met += [ceiling] if f"above {ceiling}" in less and more is None else []
    assert met


def test_values_that_define_no_start_are_refused(exciter):
    values, nan = lively_values(exciter), float("nan")
    wrong = {"KA": 0.0, "K": 0.0, "TE": nan, "TA": nan, "KC": float("inf"), VT0: nan}
    if exciter == "EXST2":  # whose source is added: a start needs none
        del wrong["KC"]
    if exciter == "ST9C":  # a PI, of whatever gain: a start has no error
        del wrong["KA"]
    for symbol in wrong.keys() & values.keys():
        with pytest.raises(SimulationError):
            samples(exciter, values | {symbol: wrong[symbol]})


# --- sub-steps ------------------------------------------------------------------------------------


def stiff_values(name, seed):
    """Return values whose gains and times lie anywhere within a factor of ten."""
    return drawn_values(name, seed, spread=10.0)


def sampled(name, values, inputs, times, step):
    """Return vt with sub-steps that are enough all along, as every run of a case has them."""
    simulator = Simulator(system_of(name), inputs, times, step)
    return simulator.with_enough_substeps(values).samples(values, ("vt",))[0]


@pytest.mark.parametrize("step", [pytest.param(1e-3, marks=pytest.mark.long), 2e-2])
def test_no_response_is_unstable_without_a_word(model, step):
    """Either a set cannot be simulated, or a four times smaller step gives the same response.

    But for a set that swings from limit to limit for good at any step: each turn moves the next.
    """
    inputs = Inputs(0.0, 4.0, (InputStep(0.5, 0.05), InputStep(2.0, -0.05)))
    times = np.linspace(0.0, 4.0, 201)
    simulated = 0
    for seed in range(40):
        if simulated == 12:
            break
        values = stiff_values(model, seed)
        try:
            coarse, fine = (sampled(model, values, inputs, times, h) for h in (step, step / 4))
        except SimulationError:
            continue
        # where a limit holds a step of a fast loop, or a contact closes, its instant is known to a
        # sub-step: should that show, it shrinks with the sub-step, which no instability does
        error = np.abs(coarse - fine).max()
        if error >= 2e-2 * np.ptp(fine) + 1e-4:
            finer, finest = (sampled(model, values, inputs, times, step / n) for n in (16, 64))
            swings = np.ptp(finest[-50:]) > 0.1 * np.ptp(finest)
            assert np.abs(finer - finest).max() < 0.5 * error or swings, seed
        simulated += 1
    assert simulated > 5


def test_sub_steps_follow_the_shortest_time_constant(exciter):
    for T in (1e-2, 2e-4):
        simulator = Simulator(system_of(exciter), UP, CLOCK, 1e-2)
        values = lively_values(exciter)
        values[next(lag for lag in ("TR", "TFV", "TE") if lag in values)] = T
        parts = simulator.substeps(values)
        assert parts >= np.ceil(1e-2 / T)
        assert simulator.samples(values, ("vt",))[1] == parts


@pytest.mark.parametrize("name", ["AC1A", "AC8B"])
def test_the_error_of_a_step_is_that_of_a_finer_run(name):
    """Halving a step takes fifteen sixteenths of its error; sub-steps are halved with it."""
    values, step = lively_values(name), 0.05
    simulator = Simulator(system_of(name), UP, CLOCK, step)
    assert simulator.substeps(values) > 1
    times = np.linspace(0.0, 2.0, 41)
    coarse, fine = (samples(name, values, UP, times, h) for h in (step, 1e-3))
    error = np.abs(coarse - fine).max()
    assert simulator.step_errors(values, ("vt",))["vt"] == pytest.approx(error, rel=0.15)


def test_sub_steps_along_a_response_are_at_least_those_of_its_start(exciter):
    simulator = Simulator(system_of(exciter), UP, CLOCK, 1e-2)
    values = lively_values(exciter)
    parts, required = simulator.substeps_along(values)
    assert parts == simulator.response(values).substeps == simulator.substeps(values)
    assert required >= 0.5 * parts


def test_too_many_sub_steps_are_an_error_that_names_the_time_constant(exciter):
    times = {T for T in system_of(exciter).time_constants if T in ("TA", "TR")}
    times -= {"TA"} if exciter == "EXST3" else set()  # of its field voltage loop, a rate by itself
    for symbol in times:
        values = lively_values(exciter) | {symbol: 1.5 * SHORTEST}
        with pytest.raises(SimulationError, match=f"{symbol} = 0.00015 s") as caught:
            samples(exciter, values, step=0.5)
        assert str(MOST_SUBSTEPS) in str(caught.value)
        assert "simulation.step: 0.5 s" in str(caught.value)
        samples(exciter, values, step=0.01)


def test_a_parameter_that_matters_nowhere_costs_no_sub_steps():
    simulator = Simulator(system_of("AC1A"), UP, CLOCK, 1e-3)
    values = typical_values("AC1A")
    without = simulator.substeps(values)
    assert simulator.substeps(values | {"machine.Tppq0": 2e-4}) == without


def test_a_fast_pole_without_a_time_constant_is_seen_too():
    """FIRST_ORDER has its rate as a parameter: the spectral radius finds it."""
    values = {"k": 900.0, "a": 900.0, VT0: 0.0}
    inputs = Inputs(0.0, 0.1, (InputStep(0.0, 1.0),))
    times = np.linspace(0.0, 0.1, 11)
    simulator = Simulator(system_of("FIRST_ORDER"), inputs, times, 1e-2)
    got, parts = simulator.samples(values, ("vt",))
    assert parts == 9
    exact = solve_ivp(lambda t, x: 900.0 * (1.0 - x), (0.0, 0.1), [0.0], "LSODA", times, rtol=1e-9)
    assert got[:, 0] == pytest.approx(exact.y[0], abs=1e-3)


# --- sub-steps where a response gets faster than it was at rest -----------------------------------

STIFFENING = System(
    parameters=(VT0,),
    setpoints=("vref",),
    states=("x",),
    inputs=("vref",),
    outputs=("vref", "x"),
    time_constants=(),
    rest=lambda p: Rest({"x": p[VT0]}, {"vref": p[VT0] + p[VT0] * p[VT0] * p[VT0]}),
    motion=lambda p, r, x, u: Motion(
        {"x": r["vref"] + u["vref"] - x["x"] - x["x"] * x["x"] * x["x"]},
        {},
        {"vref": r["vref"] + u["vref"], "x": x["x"]},
    ),
)


def test_a_response_that_gets_faster_on_its_way_is_simulated_with_more_sub_steps():
    """dx/dt = vref - x - x^3 has the rate 1 at rest, and 1 + 3 x^2 = 100 where the step ends."""
    end = 33.0**0.5
    inputs = Inputs(0.0, 1.0, (InputStep(0.1, end + end**3),))
    times, values = np.linspace(0.0, 1.0, 51), {VT0: 0.0}
    plain = Simulator(STIFFENING, inputs, times, 0.02)
    resolved = plain.with_enough_substeps(values)
    assert plain.substeps(values) == 1
    assert resolved.substeps(values) >= 2  # 0.02 s at 100 1/s
    fine = Simulator(STIFFENING, inputs, times, 0.02 / 16.0).samples(values, ("x",))[0]
    assert fine[-1] == pytest.approx([end])
    errors = [np.abs(s.samples(values, ("x",))[0] - fine).max() for s in (plain, resolved)]
    assert errors[1] < 1e-2 * end
    assert errors[1] < errors[0] / 4.0  # two sub-steps of an order of four: 16, less at the edge


def test_a_response_that_stays_as_fast_as_at_rest_needs_no_more_sub_steps(model):
    simulator = Simulator(system_of(model), AT_REST, CLOCK, 1e-2)
    assert simulator.with_enough_substeps(lively_values(model)) is simulator
