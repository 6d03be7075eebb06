"""Machine code: what it computes equals the float run of the same equations; the cache is safe."""

import os
import re
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from new_process import NothingLoaded
from oracle import drawn_values, float_run, levels, system_of, tangent_run, vector

from exfit.engine import emit
from exfit.engine import kernel as engine
from exfit.engine.emit import simulation_with_tangents
from exfit.engine.kernel import Kernel, LinearKernel, Span
from exfit.engine.system import Motion, Rest, System, trace
from exfit.engine.tangents import TangentKernel, differentiate
from exfit.engine.trace import clip, cos, exp, larger, log, sin, smaller, sqrt, where
from exfit.plants import VT0

STEP = 1e-3
LANES = engine.SIDE_BY_SIDE


def compiled(system, outputs, lanes=1, known={}):  # noqa: B006
    """Return the kernel of a system, compiled once."""
    key = (system, tuple(outputs), lanes)
    if key not in known:
        known[key] = Kernel(system, outputs, lanes)
    return known[key]


def run(system, values, outputs, spans):
    """Return what the kernel gives, (n + 1, outputs) for each span."""
    code = compiled(system, outputs)
    p = vector(system, values)[:, None]
    return [out[:, :, 0] for out in code.run(p, code.start(p), spans)]


def bump(size):
    """Return spans with a flat part, a step within sub-steps, a ramp, and a step back."""
    ramp = np.linspace(size, size / 2, 11)[:, None]
    return [
        Span(levels(5), STEP, 1),
        Span(levels(40, (0, size)), STEP, 2),
        Span(ramp, STEP, 3),
        Span(levels(30, (0, -size)), STEP, 1),
    ]


def size_of(got):
    """Return how large each output gets; what is nearly zero counts as 1e-3."""
    return np.maximum(np.abs(np.concatenate(got)).max(axis=0), 1e-3)


# a b + c is rounded once, which moves a result by some 1e-16 per step
AS_FLOATS = 1e-10


@settings(deadline=None, max_examples=min(5, settings.default.max_examples // 10), derandomize=True)
@given(seed=st.integers(0, 10**6), size=st.sampled_from([0.002, 0.05, 0.5]))
def test_machine_code_gives_what_the_float_run_gives(model, seed, size):
    system, values = system_of(model), drawn_values(model, seed)
    got = run(system, values, system.outputs, bump(size))
    expected = float_run(system, values, system.outputs, bump(size))
    for one, other in zip(got, expected, strict=True):
        assert (np.abs(one - other) / size_of(expected)).max() < AS_FLOATS


def test_so_it_does_for_every_machine_and_saturation(surrounded):
    exciter, machine, saturation = surrounded
    system, values = system_of(exciter, machine, saturation), drawn_values(exciter, 7, machine)
    spans = [Span(levels(60, (0, 0.1)), STEP, 2)]
    expected = float_run(system, values, system.outputs, spans)
    got = run(system, values, system.outputs, spans)
    assert (np.abs(got[0] - expected[0]) / size_of(expected)).max() < AS_FLOATS


def test_sets_side_by_side_give_what_each_gives_alone_to_the_last_bit(model):
    """With derivatives as well: a fit goes the same way whatever runs beside it."""
    system = system_of(model)
    sets = [drawn_values(model, seed) for seed in range(LANES)]
    p = np.ascontiguousarray(np.stack([vector(system, one) for one in sets], axis=1))
    code = compiled(system, system.outputs, LANES)
    together = code.run(p, code.start(p), bump(0.05))
    derived = TangentKernel(system, system.outputs, system.parameters[-1:])
    for lane, one in enumerate(sets):
        p = vector(system, one)
        alone = run(system, one, system.outputs, bump(0.05))
        directions = seeds(system, system.parameters[-1:])
        with_tangents, _ = tangent_run(derived, p, directions, bump(0.05))
        for a, b, c in zip(together, alone, with_tangents, strict=True):
            np.testing.assert_array_equal(a[:, :, lane], b)
            np.testing.assert_array_equal(c, b)


@pytest.mark.long
def test_arrays_of_sets_give_what_each_set_gives(model):
    system = system_of(model)
    sets = [drawn_values(model, seed) for seed in range(5)]
    spans = [Span(levels(30, (0, 0.1)), STEP, 2)]
    arrays = {name: np.array([one[name] for one in sets]) for name in system.parameters}
    together = float_run(system, arrays, system.outputs, spans)[0]
    for lane, one in enumerate(sets):
        alone = float_run(system, one, system.outputs, spans)
        assert (np.abs(together[:, :, lane] - alone[0]) / size_of(alone)).max() < 1e-12


# --- functions ------------------------------------------------------------------------------------


def function_system(function, arguments):
    """Return a system at rest whose setpoint is a function of its parameters."""
    names = tuple(f"a{k}" for k in range(arguments))

    def rest(p):
        return Rest({"x": 0.0}, {"y": function(*(p[name] for name in names))})

    def motion(p, r, x, u):
        return Motion({"x": 0.0 * x["x"]}, {}, {})

    return System(names, ("y",), ("x",), ("u",), (), (), rest, motion)


def apply(function, *arguments, lanes=LANES):
    """Return the function as machine code computes it, elementwise."""
    code = Kernel(function_system(function, len(arguments)), (), lanes)
    columns = np.array(np.broadcast_arrays(*arguments), dtype=float)
    whole = -(-columns.shape[1] // lanes) * lanes
    padded = np.pad(columns, ((0, 0), (0, whole - columns.shape[1])), mode="edge")
    blocks = np.split(padded, whole // lanes, axis=1)
    results = [code.start(np.ascontiguousarray(block)).r[0] for block in blocks]
    return np.concatenate(results)[: columns.shape[1]]


def ulps(got, expected):
    return np.abs(got - expected) / np.spacing(np.abs(expected))


@pytest.mark.parametrize("lanes", [1, LANES])
def test_the_exponential_is_right_to_a_few_last_bits(lanes):
    rng = np.random.default_rng(1)
    x = np.concatenate([rng.uniform(-700.0, 700.0, 5000), rng.uniform(-1.0, 1.0, 5000)])
    x = np.concatenate([x, [0.0, -0.0, 1e-300, 700.0, -700.0], np.log(2.0) * np.arange(-9.5, 9.5)])
    assert ulps(apply(exp, x, lanes=lanes), np.exp(x)).max() < 4.0
    assert apply(exp, np.array([0.0]), lanes=lanes)[0] == 1.0


def test_the_exponential_stays_finite_and_positive_beyond_what_it_can_hold():
    far = apply(exp, np.array([-np.inf, -1e9, -701.0, 701.0, 1e9, np.inf]))
    assert (far[:3] == far[0]).all()
    assert (far[3:] == far[5]).all()
    assert 0.0 < far[0] < 1e-300
    assert 1e300 < far[5] < np.inf


@pytest.mark.parametrize("lanes", [1, LANES])
@pytest.mark.parametrize(("ours", "numpys"), [(sin, np.sin), (cos, np.cos)])
def test_sine_and_cosine_are_right_over_many_turns(ours, numpys, lanes):
    rng = np.random.default_rng(2)
    x = np.concatenate([rng.uniform(-10.0, 10.0, 5000), rng.uniform(-3000.0, 3000.0, 5000)])
    x = np.concatenate([x, [0.0, -0.0, 1e-300], np.pi / 4.0 * np.arange(-9.0, 10.0)])
    # next to a zero the rounding of the angle remains
    assert np.abs(apply(ours, x, lanes=lanes) - numpys(x)).max() < 5e-16
    assert np.isnan(apply(ours, np.array([np.nan]), lanes=lanes)).all()


@pytest.mark.parametrize("lanes", [1, LANES])
def test_logarithm_and_root_are_those_of_numpy(lanes):
    x = np.geomspace(1e-300, 1e300, 2001)
    assert ulps(apply(log, x, lanes=lanes), np.log(x)).max() < 4.0
    assert (apply(sqrt, x, lanes=lanes) == np.sqrt(x)).all()


@pytest.mark.parametrize("lanes", [1, LANES])
@pytest.mark.parametrize(
    "function",
    [
        lambda a, b, c: where(a < b, c, b),
        lambda a, b, c: where((a <= b) & (b > c) | (a >= c), a, b),
        lambda a, b, c: clip(a, b, c),
        lambda a, b, c: larger(a, b) + smaller(a, c),
        lambda a, b, c: clip(a, -np.inf, c),
    ],
)
def test_conditions_and_limits_treat_every_number_as_floats_do(function, lanes):
    special = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 1e-310]
    a, b, c = (grid.ravel() for grid in np.meshgrid(special, special, special))
    with np.errstate(invalid="ignore"):
        expected = [function(*values) for values in zip(a, b, c, strict=True)]
    np.testing.assert_array_equal(apply(function, a, b, c, lanes=lanes), expected)


@pytest.mark.parametrize("lanes", [1, LANES])
def test_no_function_makes_a_number_of_what_is_none(lanes):
    for function in (exp, log, sqrt, lambda x: clip(x, -1.0, 1.0), lambda x: larger(x, 0.0)):
        assert np.isnan(apply(function, np.array([np.nan, np.nan]), lanes=lanes)).all()
    for function in (log, sqrt):
        assert np.isnan(apply(function, np.array([-1.0, -1e-300]), lanes=lanes)).all()


def test_a_parameter_that_is_not_a_number_spoils_its_own_set_alone(model):
    system = system_of(model)
    good = vector(system, drawn_values(model, 3))
    code = compiled(system, ("vt",), LANES)
    p = np.ascontiguousarray(np.tile(good[:, None], LANES))
    expected = code.run(p, code.start(p), bump(0.05))
    p[0, 5] = np.nan
    got = code.run(p, code.start(p), bump(0.05))
    others = [lane for lane in range(LANES) if lane != 5]
    for a, b in zip(got, expected, strict=True):
        assert (a[:, :, others] == b[:, :, others]).all()
    assert np.isnan(got[-1][-1, 0, 5])


# what only a limiter at its gate lets through
BEHIND_A_GATE = {
    "AC11C": ("VU",),
    **dict.fromkeys(("ST5C", "ST10C"), ("VU1", "VU2", "VO1", "VO2")),
}


def test_a_state_that_is_not_a_number_is_seen_at_the_terminals(model):
    system = system_of(model)
    p = vector(system, drawn_values(model, 3))[:, None]
    code = compiled(system, ("vt",))
    for state in range(len(system.states)):
        start = code.start(p)
        start.x[state] = np.nan
        (out,) = code.run(p, start, [Span(levels(50), STEP, 1)])
        unseen = system.states[state] in BEHIND_A_GATE.get(model, ())
        assert unseen or np.isnan(out[-1]).all(), system.states[state]


# --- sub-steps and spans --------------------------------------------------------------------------


def test_sub_steps_equal_a_finer_grid_also_while_the_input_moves(model):
    system, values = system_of(model), drawn_values(model, 11)
    parts, coarse = 4, np.array([0.0, 0.02, 0.05, 0.01, 0.01, -0.03])[:, None]
    fine = np.interp(np.arange(0, 5.01, 1 / parts), np.arange(6), coarse[:, 0])[:, None]
    (got,) = run(system, values, system.outputs, [Span(coarse, 4 * STEP, parts)])
    (expected,) = run(system, values, system.outputs, [Span(fine, STEP, 1)])
    difference = np.abs(got - expected[::parts])
    assert (difference / size_of([expected])).max() < 1e-12


def test_a_run_in_two_spans_equals_the_run_in_one(model):
    system, values = system_of(model), drawn_values(model, 12)
    u = levels(20, (0, 0.05))
    (whole,) = run(system, values, system.outputs, [Span(u, STEP, 2)])
    parts = [Span(u[:8], STEP, 2), Span(u[7:], STEP, 2)]
    first, second = run(system, values, system.outputs, parts)
    np.testing.assert_array_equal(np.concatenate([first, second[1:]]), whole)


def test_an_array_of_another_kind_is_refused(model):
    code = compiled(system_of(model), ("vt",))
    with pytest.raises(TypeError, match="float64"):
        code.start(np.zeros((len(code.system.parameters), 1), dtype=np.float32))


# --- derivatives ----------------------------------------------------------------------------------


CENTRAL = {1: 8.0, -1: -8.0, 2: -1.0, -2: 1.0}
INWARD = {0: -25.0, 1: 48.0, 2: -36.0, 3: 16.0, 4: -3.0}


def differences(system, values, outputs, spans, name, h, shares=None):
    """Return the derivative to one parameter by differences (of 12 h), with an error of order h^4.

    They are central ones unless a value is at zero, an edge: beyond it the response may be another.
    """
    scale = max(abs(values[name]), 0.1) * h
    shares = shares or CENTRAL
    sets = [values | {name: values[name] + k * scale} for k in shares]
    code = compiled(system, outputs, LANES)
    columns = [vector(system, one) for one in sets]
    p = np.stack(columns + columns[:1] * (LANES - len(sets)), axis=1)
    out = np.concatenate(code.run(p, code.start(p), spans))
    return out[:, :, : len(sets)] @ np.array(list(shares.values())) / (12.0 * scale)


def seeds(system, free):
    """Return the directions in which each of some parameters moves alone, (np, free)."""
    return np.stack([np.array(system.parameters) == name for name in free], axis=1) * 1.0


def exact(system, values, outputs, spans, free):
    code = TangentKernel(system, outputs, free)
    samples, slopes = tangent_run(code, vector(system, values), seeds(system, free), spans)
    return np.concatenate(samples), np.concatenate(slopes)


def small_bump(size=0.002):
    """Return a bump that stays off every limit: the response is smooth in all parameters."""
    return [
        Span(levels(10), 2 * STEP, 1),
        Span(levels(400, (0, size)), 2 * STEP, 1),
        Span(levels(100, (0, -size)), 2 * STEP, 2),
    ]


def smooth_bump(system, values):
    """Return the larger bump that a derivative in front of a limit lets through."""

    def moved(size):
        return np.concatenate(run(system, values, ("vt",), small_bump(size))) - values[VT0]

    sizes = (0.002, 1e-4)
    linear = [s for s in sizes if np.abs(moved(s) - 2.0 * moved(s / 2)).max() < 1e-2 * s]
    return small_bump(linear[0])


@pytest.mark.each_model
def test_tangents_equal_central_differences_for_every_parameter(saturated):
    name, saturation = saturated
    system, outputs = system_of(name, saturation=saturation), ("vt", system_of(name).outputs[-1])
    values = drawn_values(name, 21)
    free = system.parameters  # more than fit into one block of directions
    spans = smooth_bump(system, values)
    _, slopes = exact(system, values, outputs, spans, free)
    for column, symbol in enumerate(free):
        # the differences err by 1e-12 (h^4) and by rounding, 1e-14 over h
        expected = differences(system, values, outputs, spans, symbol, 1e-3)
        error = np.abs(slopes[:, :, column] - expected).max(axis=0)
        size = np.abs(expected).max(axis=0)
        assert (error <= 1e-6 * size + 3e-10 / max(abs(values[symbol]), 0.1)).all(), symbol


LIMIT = re.compile("MAX|MIN|LR|LIM")


def test_tangents_equal_differences_where_limits_act(exciter):
    """The response has kinks where a limit is met; so short a difference stays between them.

    Where a kink, or the end of a frozen integral, lies within the longer one, a shorter one tells.
    At a parameter of zero, the edge of its range, the derivative is the one into the range.
    """
    system, met = system_of(exciter), set()
    spans = [Span(levels(500, (0, 0.3)), STEP, 1), Span(levels(500, (0, -0.3)), STEP, 1)]
    for seed in range(22, 32):
        values = drawn_values(exciter, seed)
        _, slopes = exact(system, values, ("vt",), spans, system.parameters)
        moved = dict(zip(system.parameters, np.abs(slopes).max(axis=(0, 1)), strict=True))
        met = {symbol for symbol in moved if LIMIT.search(symbol) and moved[symbol] > 1e-3}
        if met:
            break
    assert met
    for column, symbol in enumerate(system.parameters):
        shares = CENTRAL if values[symbol] else INWARD
        for h in (1e-5, 1e-6, 1e-7):
            expected = differences(system, values, ("vt",), spans, symbol, h, shares)
            error = np.abs(slopes[:, :, column] - expected).max()
            # rounding, 1e-14 over a step of h / 10 at least, is all that these differences err by
            rounding = 1e-13 / h * (1.0 if values[symbol] else 10.0)
            agrees = error < 1e-6 * np.abs(expected).max() + rounding
            if agrees:
                break
        assert agrees, symbol


def test_the_tangent_run_gives_the_values_of_the_plain_run(model):
    system, values = system_of(model), drawn_values(model, 23)
    got, _ = exact(system, values, system.outputs, bump(0.05), system.parameters[:3])
    expected = run(system, values, system.outputs, bump(0.05))
    assert (np.abs(got - np.concatenate(expected)) / size_of(expected)).max() < AS_FLOATS


def test_a_derivative_does_not_depend_on_what_else_is_free(model):
    system, values = system_of(model), drawn_values(model, 24)
    free = system.parameters
    _, all_of_them = exact(system, values, ("vt",), bump(0.05), free)
    for some in (free[-2:], free[:1]):
        _, slopes = exact(system, values, ("vt",), bump(0.05), some)
        columns = [free.index(name) for name in some]
        expected = all_of_them[:, :, columns]
        scale = np.maximum(np.abs(expected).max(axis=(0, 1)), 1e-12)
        assert (np.abs(slopes - expected) / scale).max() < 1e-9


def test_the_linearisation_equals_differences_of_the_float_slopes(model):
    system, values = system_of(model), drawn_values(model, 25)
    code = LinearKernel(system)
    p = vector(system, values)
    rest = code.rest(p)
    x = rest.x * 1.001 + 1e-4
    slopes, jacobian = code.motion(p, rest.r, x, np.array([0.001]))
    states = dict(zip(system.states, x, strict=True))
    setpoints = dict(zip(system.setpoints, rest.r, strict=True))

    def plain(states):
        told = system.motion(values, setpoints, states, {"vref": 0.001}).slopes
        return np.array([told[name] for name in system.states])

    assert slopes == pytest.approx(plain(states), rel=1e-10, abs=1e-9)
    for column, name in enumerate(system.states):
        h = 1e-6
        up, down = (plain(states | {name: states[name] + side * h}) for side in (1, -1))
        expected = (up - down) / (2 * h)
        error = np.abs(jacobian[:, column] - expected).max()
        assert error < 1e-6 * np.abs(jacobian).max()  # rounding of slopes, 1e-12 over 1e-6


DRIVEN = System(
    parameters=("a", "b"),
    setpoints=("r",),
    states=("x", "y"),
    inputs=("u", "v", "w"),
    outputs=("x", "y", "uw"),
    time_constants=(),
    rest=lambda p: Rest({"x": p["a"], "y": p["b"]}, {"r": p["a"] * p["b"]}),
    motion=lambda p, r, x, u: Motion(
        {
            "x": r["r"] + u["u"] * u["v"] - p["a"] * x["x"],
            "y": sin(u["w"] * x["x"]) - p["b"] * x["y"] + u["u"],
        },
        {},
        {"x": x["x"], "y": x["y"], "uw": u["u"] * u["w"]},
    ),
)


@pytest.mark.parametrize("count", [1, 8, 19])
def test_tangents_of_moving_inputs_equal_differences_in_every_direction(count):
    """Of drawn courses of two of three inputs, beside a parameter, over spans with sub-steps."""
    rng, h, p = np.random.default_rng(8), 1e-4, np.array([0.7, 1.3])
    code = TangentKernel(DRIVEN, DRIVEN.outputs, ("b",), ("u", "w"))
    dp = seeds(DRIVEN, ("b",)) @ rng.normal(size=(1, count))
    sizes = ((30, 1), (45, 3))
    drawn = [(rng.normal(size=(n + 1, 3)), rng.normal(size=(n + 1, 2, count))) for n, _ in sizes]
    spans = [Span(u, 0.05, parts) for (u, _), (_, parts) in zip(drawn, sizes, strict=True)]
    du = [moves for _, moves in drawn]
    runs = tangent_run(code, p, dp, spans, du)
    samples, slopes = (np.concatenate(of_spans) for of_spans in runs)
    assert slopes.shape == (*samples.shape, count)

    def moved(column, side):
        there = (p + side * h * dp[:, column])[:, None]
        ends = [span._replace(u=span.u.copy()) for span in spans]
        for end, moves in zip(ends, du, strict=True):
            end.u[:, [0, 2]] += side * h * moves[:, :, column]
        plain = compiled(DRIVEN, DRIVEN.outputs)
        return np.concatenate(plain.run(there, plain.start(there), ends))[:, :, 0]

    assert samples == pytest.approx(moved(0, 0.0), abs=1e-12)
    for column in range(count):
        expected = (moved(column, 1) - moved(column, -1)) / (2.0 * h)
        assert slopes[:, :, column] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_code_that_moves_no_input_takes_no_array_of_them():
    system = system_of("AC8B")
    codes = []
    for moving in ((), ("vref",)):
        traced = trace(system, ("vt",))
        derived = differentiate(traced, system, ("TE",), moving)
        codes.append(simulation_with_tangents(traced, derived, engine.DIRECTIONS))
    assert ["%du" in code for code in codes] == [False, True]


# --- threads --------------------------------------------------------------------------------------


@pytest.mark.long
def test_threads_give_the_same_to_the_last_bit(model):
    system, outputs = system_of(model), ("vt",)
    code = compiled(system, outputs)
    vectors = [vector(system, drawn_values(model, seed))[:, None] for seed in range(24)]

    def simulate(p):
        return np.concatenate(code.run(p, code.start(p), bump(0.05)))

    expected = [simulate(p) for p in vectors]
    with ThreadPoolExecutor(8) as pool:
        np.testing.assert_array_equal(list(pool.map(simulate, vectors)), expected)


def test_tangents_in_several_threads_are_the_same_to_the_last_bit(model):
    system = system_of(model)
    code = TangentKernel(system, ("vt",), system.parameters)
    vectors = [vector(system, drawn_values(model, seed)) for seed in range(8)]

    def simulate(p):
        return np.concatenate(tangent_run(code, p, np.eye(len(p)), bump(0.05))[1])

    expected = [simulate(p) for p in vectors]
    with ThreadPoolExecutor(4) as pool:
        np.testing.assert_array_equal(list(pool.map(simulate, vectors)), expected)


# --- the cache ------------------------------------------------------------------------------------


def square(x):
    return x * x


def nine():
    return apply(square, np.array([3.0]), lanes=1)[0]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """Point the cache at an empty folder, and let each kernel look there as a new process does."""
    monkeypatch.setattr(engine, "_loaded", NothingLoaded())
    monkeypatch.setenv("EXFIT_CACHE", str(tmp_path / "kept"))
    return tmp_path / "kept"


def codes(cache):
    """Return the files of machine code, beside which each trace has one that names its code."""
    return list(cache.glob("*.code"))


@pytest.fixture
def builds(monkeypatch):
    """Count what is compiled."""
    counted, build = [], engine._build
    monkeypatch.setattr(
        engine, "_build", lambda ir, machine: counted.append(ir) or build(ir, machine)
    )
    return counted


def test_what_was_compiled_once_is_read_the_next_time(cache, builds):
    assert (nine(), nine()) == (9.0, 9.0)
    assert len(builds) == len(codes(cache)) == 1


def test_code_is_loaded_once_in_a_process_however_many_systems_have_its_trace():
    """Each loading takes areas of memory, of which a process has 65,530 on Linux, then it dies."""
    nine()
    loaded = dict(engine._loaded)
    assert nine() == 9.0
    assert engine._loaded == loaded


def test_no_ir_is_written_for_code_that_is_kept(cache, monkeypatch):
    nine()
    monkeypatch.setattr(emit, "simulation", None)
    assert nine() == 9.0


@pytest.mark.parametrize("damage", [lambda key: b"", lambda key: key[:-1], lambda key: key[::-1]])
def test_a_trace_whose_code_is_not_known_is_compiled_again(cache, builds, damage):
    nine()
    (place,) = (cache / "traces").iterdir()
    sound = place.read_bytes()
    place.write_bytes(damage(sound))
    assert nine() == 9.0
    assert len(builds) == 1  # the code itself is there
    assert place.read_bytes() == sound


def test_each_trace_names_the_code_of_its_own_equations(cache, builds):
    assert (nine(), apply(lambda x: x * x + 1.0, np.array([3.0]), lanes=1)[0]) == (9.0, 10.0)
    named = {engine._cached(place).decode() for place in (cache / "traces").iterdir()}
    assert named == {path.stem for path in codes(cache)}
    assert len(named) == len(builds) == 2


def test_other_equations_are_other_code(cache, builds):
    assert nine() == 9.0
    assert apply(lambda x: x * x + 1.0, np.array([3.0]), lanes=1)[0] == 10.0
    assert apply(square, np.array([3.0]), lanes=LANES)[0] == 9.0
    assert len(builds) == len(codes(cache)) == 3


def test_code_for_another_processor_is_other_code_that_gives_the_same(cache, builds, monkeypatch):
    monkeypatch.delenv("EXFIT_CPU", raising=False)
    own = nine()
    monkeypatch.setenv("EXFIT_CPU", "x86-64")
    assert engine.target() == ("x86-64", "")
    assert nine() == own
    assert len(builds) == len(codes(cache)) == 2


@pytest.mark.parametrize(
    "damage",
    [
        lambda code: b"",
        lambda code: code[:10],
        lambda code: code[:-1],
        lambda code: code + b"x",
        lambda code: code[:100] + bytes([code[100] ^ 1]) + code[101:],
        lambda code: b"\0" * len(code),
    ],
    ids=["empty", "cut short", "one byte missing", "one byte more", "one bit wrong", "zeros"],
)
def test_a_damaged_cache_is_rebuilt_in_silence(cache, builds, damage, capfd):
    nine()
    (path,) = codes(cache)
    sound = path.read_bytes()
    path.write_bytes(damage(sound))
    assert nine() == 9.0
    assert len(builds) == 2
    assert path.read_bytes() == sound
    assert codes(cache) == [path]
    assert capfd.readouterr() == ("", "")


def test_code_under_the_name_of_other_code_is_not_run(cache, builds):
    """A digest of the code alone would let it run: it was a crash of the process."""
    nine()
    apply(lambda x: x * x + 1.0, np.array([3.0]), lanes=1)
    for files in (codes(cache), [*(cache / "traces").iterdir()]):
        first, second = files
        sound = first.read_bytes()
        first.write_bytes(second.read_bytes())
        second.write_bytes(sound)
        assert nine() == 9.0
        assert apply(lambda x: x * x + 1.0, np.array([3.0]), lanes=1)[0] == 10.0
    assert len(builds) == 4


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of POSIX")
@pytest.mark.parametrize("mask", [0o000, 0o002, 0o022])
def test_what_is_kept_is_for_the_user_alone_whatever_the_mask(cache, builds, mask):
    former = os.umask(mask)
    try:
        nine()
    finally:
        os.umask(former)
    assert {path.stat().st_mode & 0o777 for path in (cache, cache / "traces")} == {0o700}
    kept = [*codes(cache), *(cache / "traces").iterdir()]
    assert {path.stat().st_mode & 0o777 for path in kept} == {0o600}
    nine()
    assert len(builds) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of POSIX")
@pytest.mark.parametrize("mode", [0o770, 0o702, 0o777])
def test_a_folder_that_others_can_write_to_is_not_used_and_that_is_reported_once(
    cache, builds, caplog, mode
):
    cache.mkdir()
    cache.chmod(mode)
    assert (nine(), nine()) == (9.0, 9.0)
    assert len(builds) == 2
    assert [*cache.iterdir()] == []
    (message,) = caplog.messages
    assert message == (
        f"Warning: {cache}: not used for compiled code: others can write to it (mode {mode:o}): "
        "chmod go-w"
    )


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of POSIX")
def test_a_folder_of_another_user_is_not_used(cache, builds, caplog, monkeypatch):
    cache.mkdir()
    monkeypatch.setattr("os.geteuid", lambda: os.getuid() + 1)
    assert (nine(), nine()) == (9.0, 9.0)
    assert len(builds) == 2
    assert [*cache.iterdir()] == []
    (message,) = caplog.messages
    assert message.endswith(f"it belongs to another user (number {os.getuid()})")


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of POSIX")
def test_a_file_that_others_could_write_is_not_run(cache, builds):
    nine()
    (path,) = codes(cache)
    path.chmod(0o666)
    assert nine() == 9.0
    assert len(builds) == 2
    assert path.stat().st_mode & 0o777 == 0o600


@pytest.mark.skipif(sys.platform == "win32", reason="links need a right there")
def test_nothing_is_kept_outside_the_cache_which_may_be_a_link_itself(cache, builds, tmp_path):
    disk, outside = tmp_path / "disk", tmp_path / "outside"
    disk.mkdir(0o700)
    outside.mkdir(0o700)
    cache.symlink_to(disk, target_is_directory=True)
    (cache / "traces").symlink_to(outside, target_is_directory=True)
    assert nine() == 9.0
    assert [*outside.iterdir()] == []
    assert len(builds) == len(codes(cache)) == 1


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path, monkeypatch, builds):
    monkeypatch.setattr(engine, "_loaded", NothingLoaded())
    (tmp_path / "file").write_text("not a folder")
    for place in (tmp_path / "file", tmp_path / "file" / "below"):
        monkeypatch.setenv("EXFIT_CACHE", str(place))
        assert nine() == 9.0
    assert len(builds) == 2
    assert (tmp_path / "file").read_text() == "not a folder"


def test_a_folder_in_the_place_of_a_cache_file_is_left_alone(cache, builds):
    nine()
    (path,) = codes(cache)
    path.unlink()
    path.mkdir()
    assert nine() == 9.0
    assert path.is_dir()
    assert codes(cache) == [path]
