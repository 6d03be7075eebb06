"""What every stabiliser of the catalogue keeps to, and each against its transfer function."""

import re

import numpy as np
import pytest
import transfer_functions
from on_load import QUADRATIC, values_on_load
from oracle import float_run, leads_of, vector
from scipy.integrate import solve_ivp
from scipy.signal import StateSpace, tf2ss
from tiers import few_of

from exfit.engine.kernel import Kernel, Span
from exfit.engine.system import Rest, System
from exfit.models import MODELS, STABILISERS
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES
from exfit.models.sheet import crossed_limits, typical
from exfit.plants import STABILISER, Names, Stabilised, infinite_bus
from exfit.plants.parts import motion, values_named
from exfit.simulation.inputs import Inputs
from exfit.simulation.simulator import Simulator

FREQUENCIES = np.geomspace(0.01, 10.0, 61)  # Hz: from inter-area to local modes and beyond
SIGNALS = ("speed", "p", "vt")
SIDES = ("vsi1", "vsi2")

# washouts that T = 0 leaves out: there the limit is the long time constant
LEFT_OUT = {"PSS2B": ("TW2", "TW4"), "PSS3B": ("TW3",)}
# what is zero beside a time constant that shrinks: the rest of its filter, which would resonate,
# a numerator that the lag bypasses, or makes steep enough for a limit; in PSS4B the branch that
# cancels most of the other
BESIDE = {
    "PSS1A": {"A1": ("A2",)},
    "IEEEST": {"A1": ("A2",), "A3": ("A4", "A6")},
    "PSS3B": {"A3": ("A1", "A2", "A4"), "A7": ("A5", "A6", "A8")},
    "PSS4B": {f"TL{k}": ("KL2" if k <= 6 else "KL1",) for k in range(1, 13)},
}
# numerators of a washout, where 0 stands for 1 instead of s times it
WITHOUT_WASHOUT = {"IEEEST": "T5", "ST2CUT": "T3"}


@pytest.fixture(params=list(STABILISERS))
def stabiliser(request):
    return STABILISERS[request.param]


def inputs(*vsi):
    return Names(**dict(zip(SIDES, vsi, strict=False)))


def lively(model):
    """Return typical data with no block bypassed."""
    values = typical(model.sheet)
    return values | {row.symbol: values[row.symbol] or 0.04 for row in model.sheet}


def limits_of(values):
    """Return the floor and the ceiling of the output."""
    high = next(values[name] for name in ("VSTMAX", "LSMAX", "HLIM") if name in values)
    return values.get("VSTMIN", values.get("LSMIN", -high)), high


def resting(model, p, u):
    x = Names()
    assert model.rest(0.0, u, p, x) is None
    assert vars(x).keys() == set(model.states)
    return x


def motion_of(model, p, x, vsi):
    """Return the slopes of states (n) and the output."""
    d = Names()
    s = Names(**dict(zip(model.states, x, strict=True)))
    vs = model.equations(s, inputs(*vsi), p, d)
    return np.array([getattr(d, name) for name in model.states]), vs


def frequency_response(model, values):
    """Return the output per unit of each input (frequencies, inputs), from central differences.

    The equations are linear off their limits, and zero at rest: the differences err by the rounding
    of a ratio alone, however small they are.
    """
    p, h, count = Names(**values), 1e-9, len(model.inputs)
    rest = np.zeros(len(model.states) + count)
    columns = []
    for k in range(len(rest)):
        ends = []
        for side in (h, -h):
            at = rest.copy()
            at[k] += side
            slopes, vs = motion_of(model, p, at[: len(model.states)], at[len(model.states) :])
            ends.append(np.append(slopes, vs))
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    whole = np.array(columns).T
    n = len(model.states)
    A, B, C, D = whole[:n, :n], whole[:n, n:], whole[n, :n], whole[n, n:]
    return np.array(
        [C @ np.linalg.solve(2j * np.pi * f * np.eye(n) - A, B) + D for f in FREQUENCIES]
    )


# --- the transfer functions, as the block diagrams print them -------------------------------------


def lead(s, T1, T2):
    return (1.0 + s * T1) / (1.0 + s * T2) if T2 > 0.0 else 1.0


def washed(s, T):
    return s * T / (1.0 + s * T) if T > 0.0 else 1.0


def stab1(s, p):
    shaped = lead(s, p["T1_T3"] * p["T3"], p["T3"]) * lead(s, p["T2_T4"] * p["T4"], p["T4"])
    return [p["K_T"] * p["T"] * s / (1.0 + s * p["T"]) * shaped]


def pss1a(s, p):
    filtered = 1.0 / (1.0 + p["A1"] * s + p["A2"] * s * s)
    shaped = lead(s, p["T1"], p["T2"]) * lead(s, p["T3"], p["T4"])
    return [p["KS"] * washed(s, p["T5"]) / (1.0 + s * p["T6"]) * filtered * shaped]


def pss2b(s, p):
    speed = washed(s, p["TW1"]) * washed(s, p["TW2"]) / (1.0 + s * p["T6"])
    power = washed(s, p["TW3"]) * washed(s, p["TW4"]) * p["KS2"] / (1.0 + s * p["T7"])
    ramp = (1.0 + s * p["T8"]) / (1.0 + s * p["T9"]) ** p["M"]
    shaped = p["KS1"] * lead(s, p["T1"], p["T2"]) * lead(s, p["T3"], p["T4"])
    shaped *= lead(s, p["T10"], p["T11"])
    return [ramp * speed * shaped, (ramp * p["KS3"] - 1.0) * power * shaped]


def ieeest(s, p):
    numerator = 1.0 + p["A5"] * s + p["A6"] * s * s
    first, second = 1.0 + p["A1"] * s + p["A2"] * s * s, 1.0 + p["A3"] * s + p["A4"] * s * s
    shaped = lead(s, p["T1"], p["T2"]) * lead(s, p["T3"], p["T4"])
    washout = (p["T5"] * s if p["T5"] > 0.0 else 1.0) / (1.0 + p["T6"] * s)
    return [numerator / first / second * shaped * p["KS"] * washout]


def st2cut(s, p):
    washout = (p["T3"] * s if p["T3"] > 0.0 else 1.0) / (1.0 + p["T4"] * s)
    shaped = washout * lead(s, p["T5"], p["T6"]) * lead(s, p["T7"], p["T8"])
    shaped *= lead(s, p["T9"], p["T10"])
    return [p[f"K{k}"] / (1.0 + p[f"T{k}"] * s) * shaped for k in (1, 2)]


def stab2a(s, p):
    washout = (p["K2"] * p["T2"] * s / (1.0 + p["T2"] * s)) ** 3
    branches = p["K3"] / (1.0 + p["T3"] * s) + p["K4"]
    return [-washout * branches * (p["K5"] / (1.0 + p["T5"] * s)) ** 2]


def pss3b(s, p):
    shaped = washed(s, p["TW3"])
    for B1, B2, A1, A2 in (("A1", "A2", "A3", "A4"), ("A5", "A6", "A7", "A8")):
        above, below = 1.0 + p[B1] * s + p[B2] * s * s, 1.0 + p[A1] * s + p[A2] * s * s
        shaped *= above / below
    sides = (("KS1", "T1", "TW1"), ("KS2", "T2", "TW2"))
    return [p[K] / (1.0 + p[T] * s) * washed(s, p[TW]) * shaped for K, T, TW in sides]


def pss4b(s, p):
    def notch(BW, W):
        return (s * s + W * W) / (s * s + BW * s + W * W) if W > 0.0 else 1.0

    def band(letter):
        def branch(gain, coefficient, first):
            T = [p[f"T{letter}{k}"] for k in range(first, first + 6)]
            begin = (p[coefficient] + T[0] * s) / (1.0 + T[1] * s)
            return p[gain] * begin * lead(s, T[2], T[3]) * lead(s, T[4], T[5])

        upper = branch(f"K{letter}1", f"K{letter}11", 1)
        return p[f"K{letter}"] * (upper - branch(f"K{letter}2", f"K{letter}17", 7))

    low = (1.0 + p["DLI"] * s + p["CLI"] * s * s) / (1.0 + p["BLI"] * s + p["ALI"] * s * s)
    low *= notch(p["BWLI1"], p["WLI1"]) * notch(p["BWLI2"], p["WLI2"])
    high = -1.0 / (1.0 + p["TH"] * s) * s * s / (1.0 + p["BH"] * s + p["AH"] * s * s)
    high *= notch(p["BWH1"], p["WH1"]) * notch(p["BWH2"], p["WH2"]) / (p["M"] * s)
    return [low * (band("L") + band("I")), high * band("H")]


FUNCTIONS = {
    "STAB1": stab1,
    "STAB2A": stab2a,
    "PSS1A": pss1a,
    "PSS2B": pss2b,
    "PSS3B": pss3b,
    "PSS4B": pss4b,
    "IEEEST": ieeest,
    "ST2CUT": st2cut,
}


def assert_is_its_function(model, values):
    response = frequency_response(model, values)
    # rounding of the solution: its matrix holds rates from 1e-3 to 1e4 per second
    transfer_functions.assert_is_its_function(
        FUNCTIONS[model.name], response, values, FREQUENCIES, 1e-11
    )


def test_every_stabiliser_has_a_transfer_function_here():
    assert FUNCTIONS.keys() == STABILISERS.keys()


def test_the_response_is_the_product_of_the_blocks(stabiliser):
    assert_is_its_function(stabiliser, typical(stabiliser.sheet))
    assert_is_its_function(stabiliser, lively(stabiliser))


def test_the_response_is_the_product_of_the_blocks_for_drawn_values(stabiliser):
    rng = np.random.default_rng(4)
    for _ in range(20):
        values = lively(stabiliser)
        moved = {name: value * 3.0 ** rng.uniform(-1.0, 1.0) for name, value in values.items()}
        assert_is_its_function(stabiliser, moved | ({"M": 4.0} if "M" in values else {}))


@pytest.mark.parametrize("lags", [1.0, 2.0, 3.0, 4.0, 5.0])
def test_the_ramp_tracking_filter_has_as_many_lags_as_M(lags):
    assert_is_its_function(STABILISERS["PSS2B"], lively(STABILISERS["PSS2B"]) | {"M": lags})


@pytest.mark.parametrize("name", WITHOUT_WASHOUT)
def test_a_washout_without_its_numerator_is_a_lag(name):
    assert_is_its_function(
        STABILISERS[name], lively(STABILISERS[name]) | {WITHOUT_WASHOUT[name]: 0.0}
    )


@pytest.mark.parametrize(
    "without",
    ["A3 A4", "A4", "A1 A2 A6", "A2 A6", "A2 A4", "A2 A3 A4 A6", "A1 A2 A3 A4 A5 A6", "A2", ""],
)
def test_a_numerator_acts_on_the_filters_that_remain(without):
    """Each of these is proper: nothing of the numerator is left out."""
    model = STABILISERS["IEEEST"]
    assert_is_its_function(model, lively(model) | dict.fromkeys(without.split(), 0.0))


@pytest.mark.parametrize("filtered", [{"A2": 0.0}, {"A1": 0.0, "A2": 0.0}])
def test_the_filter_of_PSS1A_shrinks_with_its_coefficients(filtered):
    model = STABILISERS["PSS1A"]
    assert_is_its_function(model, typical(model.sheet) | filtered)


def test_a_filter_with_a_pole_too_fast_to_see_is_a_lag():
    model = STABILISERS["PSS1A"]
    at = [
        frequency_response(model, typical(model.sheet) | {"A2": A2})
        for A2 in (0.99 * SHORTEST * 0.061, 1.01 * SHORTEST * 0.061)
    ]
    # the lag of 0.1 ms that is left out, at 10 Hz
    assert np.abs(at[0] - at[1]).max() < 2.0 * np.pi * 10.0 * SHORTEST * np.abs(at[0]).max()


def test_a_time_constant_of_zero_is_the_limit_of_a_small_one(stabiliser):
    for row in stabiliser.sheet:
        if re.fullmatch(r"T[IH]\d+", row.symbol):
            continue  # of PSS4B: these bands have the blocks of the low one
        apart = (*LEFT_OUT.get(stabiliser.name, ()), WITHOUT_WASHOUT.get(stabiliser.name))
        if row.unit != "s" or row.low > 0.0 or row.symbol in apart:
            continue
        rows = {one.symbol: one for one in stabiliser.sheet}
        values = lively(stabiliser) | dict.fromkeys(leads_of(row.symbol, rows), 0.0)
        values |= dict.fromkeys(BESIDE.get(stabiliser.name, {}).get(row.symbol, ()), 0.0)
        none, small, twice = (
            frequency_response(stabiliser, values | {row.symbol: T})
            for T in (0.0, SHORTEST, 2.0 * SHORTEST)
        )
        # a T + b T^2 + ...: the small ones tell a; 2 (2 pi 10 Hz SHORTEST)^2 = 8e-5 remains, times
        # ten where a lead keeps its ratio to the lag
        assert np.abs(2.0 * small - twice - none).max() < 1e-3 * np.abs(none).max(), row.symbol


def test_a_washout_that_zero_leaves_out_is_the_limit_of_a_long_one(stabiliser):
    for symbol in LEFT_OUT.get(stabiliser.name, ()):
        values = lively(stabiliser)
        none, long = (frequency_response(stabiliser, values | {symbol: T}) for T in (0.0, 1e6))
        # what 1 / (2 pi 0.01 Hz 1e6 s) = 1.6e-5 leaves
        assert np.abs(long - none).max() < 2e-5 * np.abs(none).max(), symbol


# --- rest, limits, compiled code ------------------------------------------------------------------


def test_rest_is_rest_with_an_output_of_zero(stabiliser):
    for values in (typical(stabiliser.sheet), lively(stabiliser)):
        p = Names(**values)
        for vsi in ((0.0, 0.0), (0.01, 0.8), (-0.5, -3.0), (0.2, 9.0)):
            x = resting(stabiliser, p, inputs(*vsi))
            at = [getattr(x, name) for name in stabiliser.states]
            slopes, vs = motion_of(stabiliser, p, at, vsi)
            np.testing.assert_array_equal(slopes, 0.0)
            assert vs == 0.0


def test_the_output_stays_within_its_limits_and_reaches_both(stabiliser):
    values = typical(stabiliser.sheet)
    low, high = limits_of(values)
    rng = np.random.default_rng(8)
    outputs = [
        motion_of(
            stabiliser,
            Names(**values),
            rng.normal(0.0, 1.0, len(stabiliser.states)),
            rng.normal(0.0, 1.0, 2),
        )[1]
        for _ in range(200)
    ]
    assert (min(outputs), max(outputs)) == (low, high)


def test_an_input_beyond_its_limit_acts_as_the_limit_does():
    model = STABILISERS["PSS2B"]
    p, x = Names(**lively(model)), np.full(len(model.states), 0.01)
    for beyond, limit in (
        ((0.3, 0.0), (p.VSI1MAX, 0.0)),
        ((-0.3, 0.0), (p.VSI1MIN, 0.0)),
        ((0.0, 4.0), (0.0, p.VSI2MAX)),
        ((0.0, -4.0), (0.0, p.VSI2MIN)),
    ):
        np.testing.assert_array_equal(
            motion_of(model, p, x, beyond)[0], motion_of(model, p, x, limit)[0]
        )


def test_no_parameter_is_inert(stabiliser):
    rng = np.random.default_rng(2)
    values = lively(stabiliser)
    probes = [
        (size * rng.normal(size=len(stabiliser.states)), size * rng.normal(size=2))
        for size in (1e-4, 0.03, 3.0)
        for _ in range(20)
    ]

    def felt(changed):
        p = Names(**changed)
        return [np.append(*motion_of(stabiliser, p, x, vsi)) for x, vsi in probes]

    before = felt(values)
    for row in stabiliser.sheet:
        after = felt(values | {row.symbol: 0.5 * values[row.symbol]})
        assert np.abs(np.array(after) - before).max() > 1e-6, row.symbol


def as_system(model):
    """Return a stabiliser alone, driven by its inputs."""

    def rest(p):
        return Rest(vars(resting(model, Names(**p), inputs(0.0, 0.0))), {})

    def course(p, r, x, u):
        d = Names()
        seen = inputs(*(u[name] for name in SIDES))
        sheet = Names(**{row.symbol: p[row.symbol] for row in model.sheet})
        vs = model.equations(values_named(x, model.states), seen, sheet, d)
        return motion(d, model.states, {"vs": vs, **x})

    return System(
        parameters=tuple(row.symbol for row in model.sheet),
        setpoints=(),
        states=model.states,
        inputs=SIDES,
        outputs=("vs", *model.states),
        time_constants=tuple(row.symbol for row in model.sheet if row.unit == "s"),
        rest=rest,
        motion=course,
    )


def test_compiled_code_gives_what_the_plain_equations_give(stabiliser):
    system, values = as_system(stabiliser), lively(stabiliser)
    swing = np.linspace(0.0, 12.0, 1001)
    u = np.column_stack([0.02 * np.sin(swing), 0.3 * np.cos(swing) - 0.3])
    spans = [Span(u, 4e-3, 1)]
    code = Kernel(system, system.outputs)
    p = vector(system, values)[:, None]
    (got,) = code.run(p, code.start(p), spans)
    (expected,) = float_run(system, values, system.outputs, spans)
    size = np.abs(expected).max()
    assert np.abs(got[:, :, 0] - expected).max() < 1e-11 * size
    vs = got[:, 0, 0]
    assert vs.max() == limits_of(values)[1]


# --- a second typing: polynomials, integrated by another method -----------------------------------


def series(gain, *ratios):
    """Return the blocks of a chain as one state space; each is (numerator, denominator)."""
    above, below = np.array([gain]), np.array([1.0])
    for numerator, denominator in ratios:
        above, below = np.polymul(above, numerator), np.polymul(below, denominator)
    return tf2ss(above, below)


def lead_lags(p, *pairs):
    return [([p[T1], 1.0], [p[T2], 1.0]) for T1, T2 in pairs]


def chain_of_ieeest(p):
    filters = [p["A6"], p["A5"], 1.0], [p["A2"], p["A1"], 1.0]
    rest = [([1.0], [p["A4"], p["A3"], 1.0]), ([p["T5"], 0.0], [p["T6"], 1.0])]
    return series(p["KS"], filters, *rest, *lead_lags(p, ("T1", "T2"), ("T3", "T4")))


def chain_of_st2cut(p):
    blocks = ([1.0], [p["T1"], 1.0]), ([p["T3"], 0.0], [p["T4"], 1.0])
    return series(p["K1"], *blocks, *lead_lags(p, ("T5", "T6"), ("T7", "T8"), ("T9", "T10")))


def chain_of_stab2a(p):
    washout = ([p["K2"] * p["T2"], 0.0], [p["T2"], 1.0])
    branches = ([p["K4"] * p["T3"], p["K3"] + p["K4"]], [p["T3"], 1.0])
    output = ([p["K5"]], [p["T5"], 1.0])
    return series(-1.0, washout, washout, washout, branches, output, output)


def chain_of_pss3b(p):
    washouts = [([p[T], 0.0], [p[T], 1.0]) for T in ("TW1", "TW3")]
    filters = [
        ([p[B2], p[B1], 1.0], [p[A2], p[A1], 1.0])
        for B1, B2, A1, A2 in (("A1", "A2", "A3", "A4"), ("A5", "A6", "A7", "A8"))
    ]
    return series(p["KS1"], ([1.0], [p["T1"], 1.0]), *washouts, *filters)


CHAINS = {
    "IEEEST": chain_of_ieeest,
    "ST2CUT": chain_of_st2cut,
    "STAB2A": chain_of_stab2a,
    "PSS3B": chain_of_pss3b,
}


@pytest.mark.parametrize("name", CHAINS)
def test_another_typing_and_method_reach_and_leave_the_limits_together(name):
    """The first input swings by so much that the output reaches both limits, and rests between."""
    model = STABILISERS[name]
    values, step = lively(model), 1e-3
    A, B, C, D = CHAINS[name](values)
    low, high = limits_of(values)
    time = step * np.arange(4001)
    shape = np.sin(4.0 * time) * np.exp(-0.3 * time)

    def outputs(size):
        def slopes(t, x):
            return A @ x + B[:, 0] * size * np.sin(4.0 * t) * np.exp(-0.3 * t)

        span = (0.0, time[-1])
        states = solve_ivp(slopes, span, np.zeros(len(A)), "DOP853", time, rtol=1e-9, atol=1e-12).y
        return C[0] @ states + D[0, 0] * size * shape

    swing = outputs(1.0)  # linear in the size: that makes the smaller half wave 1.5 limits
    size = 1.5 * high / min(swing.max(), -swing.min())
    expected = np.clip(outputs(size), low, high)
    system = as_system(model)
    u = np.column_stack([size * shape, np.zeros(len(time))])
    code = Kernel(system, system.outputs)
    p = vector(system, values)[:, None]
    (got,) = code.run(p, code.start(p), [Span(u, step, 1)])
    vs = got[:, 0, 0]
    assert (vs.min(), vs.max()) == (low, high)
    # the input is a line between its points: (4 rad/s 1 ms)^2 / 8 = 2e-6 of a signal of a few
    # limits, times what the leads make of it
    assert np.abs(vs - expected[: len(vs)]).max() < 3e-5 * high


def values_of_pss4b(**limits):
    """Return data of PSS4B in which every block takes part, with notches at 3 to 12 Hz."""
    values = lively(STABILISERS["PSS4B"])
    for letter in "LIH":
        leads = {3: 0.05, 4: 0.03, 5: 0.02, 6: 0.04, 9: 0.03, 10: 0.06, 11: 0.05, 12: 0.02}
        values |= {f"T{letter}{k}": T for k, T in leads.items()}
    notches = {"LI1": (9.0, 20.0), "LI2": (30.0, 75.0), "H1": (12.0, 30.0), "H2": (20.0, 60.0)}
    values |= {f"BW{name}": width for name, (width, _) in notches.items()}
    values |= {f"W{name}": at for name, (_, at) in notches.items()}
    return values | {"CLI": 2e-5} | limits


def paths_of_pss4b(p):
    """Return for each band its input's number and its way there, before its limit."""

    def block(above, below):
        return StateSpace(*tf2ss(np.atleast_1d(above), np.atleast_1d(below)))

    def notch(name):
        BW, square = p[f"BW{name}"], p[f"W{name}"] ** 2
        return block([1.0, 0.0, square], [1.0, BW, square])

    def band(letter, transducer):
        def branch(gain, coefficient, first):
            T = [p[f"T{letter}{first + k}"] for k in range(6)]
            chain = block([T[0], p[coefficient]], [T[1], 1.0]) * p[gain]
            return block([T[4], 1.0], [T[5], 1.0]) * block([T[2], 1.0], [T[3], 1.0]) * chain

        upper = branch(f"K{letter}1", f"K{letter}11", 1)
        difference = upper - branch(f"K{letter}2", f"K{letter}17", 7)
        return difference * transducer * p[f"K{letter}"]

    low = block([p["CLI"], p["DLI"], 1.0], [p["ALI"], p["BLI"], 1.0])
    low = notch("LI2") * notch("LI1") * low
    # s^2 over what is integrated, 1 / (s M): one s remains
    high = block([-1.0 / p["M"], 0.0], np.polymul([p["TH"], 1.0], [p["AH"], p["BH"], 1.0]))
    high = notch("H2") * notch("H1") * high
    return {"L": (0, band("L", low)), "I": (0, band("I", low)), "H": (1, band("H", high))}


def by_another_method(path, signal, time):
    """Return the output of a state space driven by a function of time, by DOP853."""
    span, rest = (0.0, time[-1]), np.zeros(len(path.A))
    driven = solve_ivp(
        lambda t, x: path.A @ x + path.B[:, 0] * signal(t), span, rest, "DOP853", time,
        rtol=1e-9, atol=1e-12,
    )  # fmt: skip
    return (path.C @ driven.y)[0] + path.D[0, 0] * signal(time)


@pytest.mark.parametrize("limited", few_of(["bands", "output"], 1))
def test_the_bands_of_another_typing_and_method_reach_their_limits_together(limited):
    """Speed and power swing; each band, or what they make together, meets both of its limits."""
    limits = {"VSTMAX": 99.0, "VSTMIN": -99.0} if limited == "bands" else {}
    values, step = values_of_pss4b(**limits), 5e-4
    time = step * np.arange(8001)

    def speed(t):
        return 0.02 * np.sin(4.0 * t) * np.exp(-0.3 * t)

    def power(t):
        return 0.4 * np.sin(9.0 * t) * np.exp(-0.3 * t)

    total = np.zeros(len(time))
    for letter, (source, path) in paths_of_pss4b(values).items():
        band = by_another_method(path, (speed, power)[source], time)
        low, high = values[f"V{letter}MIN"], values[f"V{letter}MAX"]
        assert limited == "output" or (band.min() < low and band.max() > high), letter
        total += np.clip(band, low, high)
    expected = np.clip(total, values["VSTMIN"], values["VSTMAX"])
    assert limited == "bands" or (total.min() < -0.15 and total.max() > 0.15)
    system = as_system(STABILISERS["PSS4B"])
    code = Kernel(system, system.outputs)
    p = vector(system, values)[:, None]
    u = np.column_stack([speed(time), power(time)])
    (got,) = code.run(p, code.start(p), [Span(u, step, 1)])
    # the inputs are lines between their points: (9 rad/s 0.5 ms)^2 / 8 = 2.5e-6 of them, times what
    # the bands make of it, before their limits: 9e-6 of the output
    assert np.abs(got[:, 0, 0] - expected).max() < 3e-5 * np.abs(expected).max()


@pytest.mark.parametrize(("name", "symbol"), [("PSS3B", "A5"), ("IEEEST", "A5"), ("PSS3B", "A7")])
def test_a_coefficient_of_a_numerator_alone_asks_for_no_sub_steps(name, symbol):
    """A lag does; what is above it has no motion of its own."""
    model, machine = STABILISERS[name], MACHINES["GENROU"]
    plant = infinite_bus(
        MODELS["AC8B"], machine, QUADRATIC, ("vref",), "Q", Stabilised(model, model.inputs)
    )
    values = values_on_load(machine)
    values |= {STABILISER + key: value for key, value in typical(model.sheet).items()}
    simulator = Simulator(plant, Inputs(0.0, 1.0, ()), np.array([1.0]), 1e-3)
    parts = simulator.substeps(values | {STABILISER + symbol: 2.5e-4})
    assert parts == (4 if symbol == "A7" else 1)


# --- sheets and records ---------------------------------------------------------------------------


def test_a_sheet_names_each_parameter_once_within_its_range(stabiliser):
    for column in ("symbol", "meaning"):
        entries = [getattr(row, column) for row in stabiliser.sheet]
        assert len(set(entries)) == len(entries)
    for row in stabiliser.sheet:
        assert row.symbol.isidentifier()
        assert row.unit
        assert row.low <= row.typical <= row.high, row.symbol
    assert list(crossed_limits(typical(stabiliser.sheet))) == []


def test_a_drawing_is_narrow_and_shows_every_parameter(stabiliser):
    text = stabiliser.title + stabiliser.drawing
    assert stabiliser.title
    assert max(map(len, stabiliser.drawing.splitlines())) <= 80
    for row in stabiliser.sheet:
        assert row.symbol in text, row.symbol


def test_a_record_lists_every_parameter_once(stabiliser):
    for record in stabiliser.records:
        symbols = [row.symbol for row in stabiliser.sheet]
        integers = [name for name, _ in record.icons if name in symbols]
        listed = [*record.cons, *integers, *dict(record.held)]
        assert sorted(listed) == sorted([*symbols, *dict(record.absent)])


def test_the_inputs_are_signals_of_a_plant(stabiliser):
    assert 1 <= len(stabiliser.inputs) <= 2
    assert set(stabiliser.inputs) <= set(SIGNALS)
