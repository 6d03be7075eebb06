"""The grid, the samples, the sub-steps and what cannot be simulated."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import drawn_values, fastest_rate, lively_values, system_of, typical_values
from scipy.integrate import solve_ivp

from exfit.engine.system import Motion, Rest, System, trace
from exfit.errors import SimulationError
from exfit.models import MODELS
from exfit.models.blocks import SHORTEST
from exfit.plant import VT0
from exfit.simulate import (
    MOST_SUBSTEPS,
    Change,
    Course,
    Simulator,
    parameters_used,
    stretches,
)

UP = Course(0.0, 2.0, (Change(0.5, 0.005),))  # off the limits
AT_REST = Course(0.0, 2.0, ())
CLOCK = np.linspace(0.0, 2.0, 201)
laws = settings(deadline=None, derandomize=True, max_examples=25)


def samples(name, values, course=UP, times=CLOCK, step=1e-3, outputs=("vt",)):
    return Simulator(system_of(name), course, times, step).samples(values, outputs)[0]


ROUNDING = 1e-12  # pu, of a run of thousands of steps


def fastest(name, values):
    """Return the largest of all 1/T, at least 50 1/s."""
    return max([50.0, *(1.0 / values[T] for T in system_of(name).time_constants)])


# --- grid and samples -----------------------------------------------------------------------------


@laws
@given(st.lists(st.floats(0.0, 3.0), max_size=4, unique=True), st.floats(1e-3, 0.5))
def test_the_grid_is_gapless_and_every_change_lies_on_it(instants, step):
    changes = tuple(Change(at, 0.1) for at in sorted(instants))
    grid = stretches(Course(0.0, 3.0, changes), step)
    ends = [part.start + part.step * part.steps for part in grid]
    assert grid[0].start == 0.0
    assert ends == pytest.approx([part.start for part in grid[1:]] + [3.0], abs=1e-12)
    inside = [at for at in sorted(instants) if 0.0 < at < 3.0]
    assert [part.start for part in grid[1:]] == inside
    assert all(part.step <= step * (1.0 + 1e-5) for part in grid)
    course = Course(0.0, 3.0, changes)
    level = course.level("vref", grid[-1].start)
    assert level == pytest.approx(0.1 * sum(at < 3.0 for at in instants))


def test_at_the_instant_of_a_step_the_value_is_that_before_it(model):
    for at in (0.5, 0.50037):
        course = Course(0.0, 1.0, (Change(at, 0.02),))
        times = np.array([at - 1e-3, at, at + 1e-3])
        vref = samples(model, lively_values(model), course, times, outputs=("vref",))[:, 0]
        assert vref[1] == pytest.approx(vref[0], abs=1e-14)
        assert vref[2] - vref[1] == pytest.approx(0.02)


def test_a_step_between_grid_points_is_the_same_step_later(model):
    """Two grids of one response: they differ by the method's error alone."""
    values, delay = lively_values(model), 0.00037
    # so small that no loop of any gain meets a limit
    sooner, later = (Course(0.0, 2.0, (Change(0.5 + d, 0.002),)) for d in (0.0, delay))
    got = samples(model, values, later, CLOCK[:-1] + delay)
    assert np.abs(got - samples(model, values, sooner)[:-1]).max() < 1e-9


def test_steps_add_up(model):
    values = lively_values(model)
    several = Course(0.0, 2.0, (Change(0.5, 0.03), Change(1.0, -0.02), Change(1.2, 0.01)))
    vref = samples(model, values, several, outputs=("vref",))[:, 0]
    levels = vref - vref[0]
    assert levels[[49, 51, 99, 101, 119, 121, 200]] == pytest.approx(
        [0.0, 0.03, 0.03, 0.01, 0.01, 0.02, 0.02]
    )


def test_a_step_up_and_back_returns_to_rest():
    values = typical_values("AC1A")
    course = Course(0.0, 60.0, (Change(1.0, 0.05), Change(20.0, -0.05)))
    vt = samples("AC1A", values, course, np.array([0.0, 20.0, 60.0]))[:, 0]
    assert vt[2] == pytest.approx(vt[0], abs=1e-6)
    assert vt[1] - vt[0] > 0.04


def test_the_response_to_a_small_bump_scales_and_mirrors(model):
    values = lively_values(model)

    def moved(size):
        vt = samples(model, values, Course(0.0, 2.0, (Change(0.5, size),)))
        return (vt - vt[0]) / size

    assert moved(1e-5) == pytest.approx(moved(-1e-5), abs=1e-3)
    assert moved(1e-5) == pytest.approx(moved(2e-5), abs=1e-3)


def test_samples_at_uneven_times_err_as_little_as_the_method(model):
    """Halving the step divides the error of samples between grid points by sixteen."""
    values, rng = lively_values(model), np.random.default_rng(4)
    times = np.sort(rng.uniform(0.01, 2.0, 200))
    course = Course(0.0, 2.0, (Change(0.0, 3e-4),))
    finest = samples(model, values, course, times, 1.25e-4)
    step = 0.2 / fastest(model, values)
    errors = [
        np.abs(samples(model, values, course, times, h) - finest).max() for h in (step, step / 2)
    ]
    assert errors[0] / errors[1] > 11.0 or errors[0] < ROUNDING
    assert errors[1] < 1e-8


def test_a_sample_on_the_grid_is_the_computed_value(model):
    values = lively_values(model)
    fine = samples(model, values, times=np.linspace(0.0, 2.0, 2001))
    rng = np.random.default_rng(5)
    some = np.sort(rng.choice(2001, 50, replace=False))
    got = samples(model, values, times=np.append(some * 1e-3, 1.99951))
    np.testing.assert_allclose(got[:-1], fine[some], rtol=0.0, atol=1e-15)


def test_a_response_has_every_signal_and_state_on_its_clock(model):
    system = system_of(model)
    response = Simulator(system, UP, CLOCK, 1e-3).response(lively_values(model))
    assert tuple(response.signals) == system.outputs
    assert response.time is CLOCK
    assert all(signal.shape == CLOCK.shape for signal in response.signals.values())


def test_many_sets_give_what_each_gives(model):
    simulator = Simulator(system_of(model), UP, CLOCK, 1e-3)
    sets = [drawn_values(model, seed) for seed in range(19)]
    together = simulator.samples_of_many(sets, ("vt",))
    assert together.shape == (201, 1, 19)
    for lane, values in enumerate(sets):
        # all take the most sub-steps that any of them needs
        expected, _ = simulator.samples(values, ("vt",))
        assert np.abs(together[:, :, lane] - expected).max() < 1e-7


def test_tangents_are_the_slopes_of_the_samples(model):
    """By differences at the times of the samples, off the grid and past a step."""
    system, values = system_of(model), lively_values(model)
    times = np.linspace(0.0, 2.0, 77)
    simulator = Simulator(system, Course(0.0, 2.0, (Change(0.20037, 0.002),)), times, 1e-3)
    free = (system.parameters[-1], *sorted(parameters_used(system))[:4])
    got, slopes = simulator.tangents(values, ("vt",), free)
    assert got == pytest.approx(simulator.samples(values, ("vt",))[0], abs=1e-12)
    for column, name in enumerate(free):
        h = 1e-4 * max(values[name], 0.1)
        sets = [values | {name: values[name] + side * h} for side in (1, -1)]
        ends = simulator.samples_of_many(sets, ("vt",))
        expected = (ends[:, :, 0] - ends[:, :, 1]) / (2 * h)
        size = np.abs(slopes[:, :, column]).max()
        assert np.abs(slopes[:, :, column] - expected).max() < 1e-6 * size + 1e-8, name


# --- limits ---------------------------------------------------------------------------------------


def test_a_lag_meets_and_leaves_its_limits_when_a_run_of_tiny_steps_does():
    """The lag of AC1A, driven by what it saw, against Euler's method with tiny steps.

    The loop is cut by KF = 0 and an exciter that is too slow to answer.
    """
    changes = {"KA": 40.0, "TA": 0.1, "VAMAX": 5.0, "VAMIN": -1.0, "KF": 0.0, "TE": 99.0}
    values = typical_values("AC1A", **changes, VRMAX=99.0, VRMIN=-99.0)
    course = Course(0.0, 2.0, (Change(0.2, 0.5), Change(0.9, -1.0), Change(1.4, 0.52)))
    got = samples("AC1A", values, course, outputs=("VA", "vref", "vt"))
    start, vt = got[0, 0], got[:, 2]
    vref = got[0, 1]

    def free(t, x, level):
        return (40.0 * (vref + level - np.interp(t, CLOCK, vt)) - x) / 0.1

    x, expected = start, [start]
    fine = np.arange(0.0, 2.0, 1e-5)
    for k, t in enumerate(fine):
        level = sum(change.step for change in course.steps if t >= change.at - 1e-9)
        x = min(max(x + 1e-5 * free(t, x, level), -1.0), 5.0)
        if (k + 1) % 1000 == 0:
            expected.append(x)
    assert max(expected) == 5.0
    assert min(expected) == -1.0
    # Euler's error at 10 us, 40 / 0.1 * 1e-5 / 2 of a pu
    assert np.abs(got[:, 0] - expected).max() < 4e-3


def test_halving_the_step_hardly_moves_a_response_that_meets_limits(exciter):
    values = lively_values(exciter)
    course = Course(0.0, 2.0, (Change(0.3, 0.3), Change(1.1, -0.4)))
    fine = samples(exciter, values, course, step=3.125e-5)
    errors = [np.abs(samples(exciter, values, course, step=h) - fine).max() for h in (1e-3, 2.5e-4)]
    # a state may be held a part of a step too early: what follows it errs by the step squared;
    # an integral is frozen a part of a step too early, and misses that part
    most, order = (3e-5, 1.0) if freezes(exciter, values, course) else (2e-5, 1.5)
    assert errors[0] < most
    assert errors[1] < most / 4.0**order


def freezes(exciter, values, course):
    """Tell whether a state that has no limits of its own stands still for a while."""
    system = system_of(exciter)
    states = samples(exciter, values, course, outputs=system.states)
    still = (np.diff(states[course.steps[0].at < CLOCK], axis=0) == 0.0).any(axis=0)
    limited = [node.op == "clip" for node in trace(system, ("vt",)).clamped]
    return bool((still & ~np.array(limited)).any())


REGULATOR = {"VRMAX": 0.05, "VRMIN": 9.0}
BEYOND = {
    **dict.fromkeys(("DC1A", "DC2A", "IEEET1", "IEEEX1", "EXDC2"), REGULATOR),
    **dict.fromkeys(("DC3A", "DC4B"), REGULATOR | {"VEMIN": 9.0}),
    "AC1A": {"VAMAX": 0.5, "VAMIN": 9.0, "VRMAX": 0.5, "VRMIN": 9.0},
    "AC2A": {"VAMAX": 0.5, "VAMIN": 9.0, "VRMAX": 0.5, "VRMIN": 9.0, "VFEMAX": 0.5},
    "AC3A": {"VAMAX": 0.1, "VAMIN": 9.0, "VEMIN": 9.0, "VFEMAX": 0.5},
    "AC4A": {"VIMAX": 1e-3, "VIMIN": 0.1, "VRMAX": 0.5, "VRMIN": 9.0},
    "AC5A": {"VRMAX": 0.5, "VRMIN": 9.0},
    "AC6A": {"VAMAX": 0.5, "VAMIN": 9.0, "VRMAX": 0.5, "VRMIN": 9.0},
    "EXAC4": {"VIMAX": 1e-3, "VIMIN": 0.1, "VRMAX": 0.5, "VRMIN": 9.0},
    "AC8B": {
        "VPIDMAX": 0.5,
        "VPIDMIN": 9.0,
        "VRMAX": 0.5,
        "VRMIN": 9.0,
        "VFEMAX": 0.5,
        "VEMIN": 9.0,
    },
    "ST2A": {"VRMAX": 0.1, "VRMIN": 0.9, "EFDMAX": 0.5},
    "ST3A": {
        "VIMAX": 0.001,
        "VIMIN": 0.1,
        "VRMAX": 0.5,
        "VRMIN": 9.0,
        "VMMAX": 0.05,
        "VMMIN": 0.9,
    },
    "ST4B": {"VRMAX": 0.05, "VRMIN": 0.9, "VMMAX": 0.05, "VMMIN": 0.9},
    "SCRX": {"EMAX": 0.5, "EMIN": 3.0},
    "SEXS": {"EMAX": 0.5, "EMIN": 3.0},
}
CUT = ("VBMAX", "VGMAX")  # what they cut, other signals make up for: a start may lie beyond them
CASES = [(name, symbol) for name in BEYOND for symbol in BEYOND[name]]


OF_A_LIMITER = ("VHMAX",)  # what bounds a limiter's own signal bounds no start


def test_every_limit_is_tried(exciter):
    limits = [s for s in system_of(exciter).parameters if s.endswith(("MAX", "MIN"))]
    assert sorted(BEYOND[exciter]) == sorted(set(limits) - set(CUT))


@pytest.mark.parametrize("bypassed", [True, False])
@pytest.mark.parametrize(("name", "symbol"), CASES)
def test_a_start_beyond_a_limit_names_it_with_both_values(name, symbol, bypassed):
    values = lively_values(name)
    if bypassed:
        lags = system_of(name).time_constants
        values |= {T: value for T, value in typical_values(name).items() if T in lags}
    limit = BEYOND[name][symbol]
    side = "above" if symbol.endswith("MAX") else "below"
    with pytest.raises(SimulationError, match=f"{side} {symbol}") as caught:
        samples(name, values | {symbol: limit})
    told = str(caught.value)
    assert told.startswith("no state of rest at vt0 = 1 pu: the start needs ")
    if symbol != "VFEMAX":  # the limit of VE that follows from it is told
        assert f"{symbol} = {limit:g}" in told
    number = float(told.split("needs ")[1].split(",")[0])
    bound = float(re.search(rf"{symbol} = (-?\d+(\.\d+)?(e[+-]\d+)?)", told)[1])
    meaning = next(row.meaning for row in MODELS[name].sheet if row.symbol == symbol)
    # what follows from a limit is told: that of VE, or one that moves with the voltage
    if symbol != "VFEMAX" and "at rated voltage" not in meaning:
        assert bound == limit
    if symbol in ("VFEMAX", "VEMIN"):
        simulator = Simulator(system_of(name), UP, CLOCK, 1e-3)
        needed = simulator.response(values, ("VE", "vt")).signals["VE"][0]
        assert number == pytest.approx(needed, rel=1e-5)
    else:
        assert (number > limit) == symbol.endswith("MAX")


ON_ITS_LIMIT = {
    "AC1A": ("VA", "VRMAX"),
    "AC8B": ("VR", "VRMAX"),
    "ST2A": ("VR", "VRMAX"),
    "ST3A": ("VR", "VRMAX"),
    "ST4B": ("VM", "VMMAX"),
    "SCRX": ("EB", "EMAX"),
    "SEXS": ("EFD", "EMAX"),
}


def test_a_start_exactly_on_a_limit_is_a_start(exciter):
    """What holds the start is allowed; a hair less is not."""
    values = lively_values(exciter)
    state, limit = ON_ITS_LIMIT[exciter]
    simulator = Simulator(system_of(exciter), AT_REST, CLOCK, 1e-3)
    needed = simulator.response(values, (state,)).signals[state][0]
    vt = simulator.response(values | {limit: needed * (1 + 1e-12)}, ("vt",)).signals["vt"]
    assert vt == pytest.approx(1.0, abs=1e-9)
    with pytest.raises(SimulationError, match=limit):
        simulator.response(values | {limit: needed * (1 - 1e-3)})


def test_values_that_define_no_start_are_refused(exciter):
    values, nan = lively_values(exciter), float("nan")
    wrong = {"KA": 0.0, "K": 0.0, "TE": nan, "TA": nan, "KC": float("inf"), VT0: nan}
    for symbol in wrong.keys() & values.keys():
        with pytest.raises(SimulationError):
            samples(exciter, values | {symbol: wrong[symbol]})


# --- sub-steps ------------------------------------------------------------------------------------


def secured(name, values, course, times, step):
    """Return vt with sub-steps that are enough all along, as every run of a case has them."""
    simulator = Simulator(system_of(name), course, times, step)
    return simulator.secured(values).samples(values, ("vt",))[0]


def stiff_values(name, seed):
    """Return values whose gains and times lie anywhere within a factor of ten.

    But for what may cut a feedback at rest: such a loop closes on its way, faster than anything
    that the start shows.
    """
    values = drawn_values(name, seed, spread=10.0)
    return values | dict.fromkeys(values.keys() & set(CUT), 9999.0)


def growth_at_rest(model, values):
    """Return how fast (1/s) the fastest growing mode grows at the start."""
    system = system_of(model)
    code, p = LinearKernel(system), np.array([values[name] for name in system.parameters])
    rest = code.rest(p)
    _, jacobian = code.motion(p, rest.r, rest.x, np.zeros(len(system.inputs)))
    return np.linalg.eigvals(jacobian).real.max()


@pytest.mark.parametrize("step", [1e-3, 2e-2])
def test_no_response_is_unstable_without_a_word(model, step):
    """Either a set cannot be simulated, or a four times smaller step gives the same response."""
    course = Course(0.0, 4.0, (Change(0.5, 0.05), Change(2.0, -0.05)))
    times = np.linspace(0.0, 4.0, 201)
    simulated = 0
    for seed in range(40):
        values = stiff_values(model, seed)
        try:
            coarse, fine = (secured(model, values, course, times, h) for h in (step, step / 4))
        except SimulationError:
            continue
        if growth_at_rest(model, values) > 0.0:
            continue  # it swings between its limits, and tells every step from every other
        fine = samples(model, values, course, times, step / 4)
        if np.ptp(fine) > 1.0:  # it swings from limit to limit, and each turn moves the next
            assert np.isfinite(coarse).all()
            continue
        # where a limit holds a step of a fast loop, its end is known to a sub-step
        # contacts close a part of a step late, and the later ones follow the earlier ones
        late = 8.0 * np.abs(fine - finer).max()
        assert np.abs(coarse - fine).max() < 2e-2 * np.ptp(fine) + 1e-4 + late, seed
        simulated += 1
    assert simulated > 10


def test_sub_steps_follow_the_shortest_time_constant(exciter):
    for T in (1e-2, 2e-4):
        simulator = Simulator(system_of(exciter), UP, CLOCK, 1e-2)
        values = lively_values(exciter)
        values["TR" if "TR" in values else "TE"] = T
        parts = simulator.substeps(values)
        assert parts >= np.ceil(1e-2 / T)
        assert simulator.samples(values, ("vt",))[1] == parts


def test_sub_steps_along_a_response_are_at_least_those_of_its_start(exciter):
    simulator = Simulator(system_of(exciter), UP, CLOCK, 1e-2)
    values = lively_values(exciter)
    response = simulator.response(values)
    assert response.substeps == simulator.substeps(values)
    assert simulator.substeps_along(values, response) >= 0.5 * response.substeps


def test_too_many_sub_steps_are_an_error_that_names_the_time_constant(exciter):
    times = [T for T in system_of(exciter).time_constants if T in ("TA", "TR")]
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
    course = Course(0.0, 0.1, (Change(0.0, 1.0),))
    times = np.linspace(0.0, 0.1, 11)
    simulator = Simulator(system_of("FIRST_ORDER"), course, times, 1e-2)
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


def test_a_response_that_gets_faster_on_its_way_is_secured_by_more_sub_steps():
    """dx/dt = vref - x - x^3 has the rate 1 at rest, and 1 + 3 x^2 = 100 where the step ends."""
    end = 33.0**0.5
    course = Course(0.0, 1.0, (Change(0.1, end + end**3),))
    times, values = np.linspace(0.0, 1.0, 51), {VT0: 0.0}
    plain = Simulator(STIFFENING, course, times, 0.02)
    secured = plain.secured(values)
    assert plain.substeps(values) == 1
    assert secured.substeps(values) >= 2  # 0.02 s at 100 1/s
    fine = Simulator(STIFFENING, course, times, 0.02 / 16.0).samples(values, ("x",))[0]
    assert fine[-1] == pytest.approx([end])
    errors = [np.abs(s.samples(values, ("x",))[0] - fine).max() for s in (plain, secured)]
    assert errors[1] < 1e-2 * end
    assert errors[1] < errors[0] / 4.0  # two sub-steps of an order of four: 16, less at the edge


def test_a_response_that_stays_as_fast_as_at_rest_is_secured_as_it_is(model):
    simulator = Simulator(system_of(model), AT_REST, CLOCK, 1e-2)
    assert simulator.secured(lively_values(model)) is simulator
