"""What every stabiliser of the catalogue keeps to, and each against its transfer function."""

import csv
import re

import numpy as np
import pytest
import transfer_functions
from on_load import QUADRATIC, values_on_load
from oracle import float_run, leads_of, vector
from places import REFERENCE
from scipy.integrate import solve_ivp
from scipy.signal import StateSpace, tf2ss
from tiers import few_of

from exfit.engine.kernel import Kernel, Span
from exfit.engine.system import Rest, System
from exfit.models import MODELS, STABILISERS
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES
from exfit.models.sheet import contradictions, crossed_limits, typical
from exfit.models.stabiliser_parts import COMPENSATED
from exfit.models.stabilisers.pss4 import band
from exfit.plants import STABILISER, Stabilised
from exfit.plants.infinite_bus import infinite_bus
from exfit.plants.parts import Names, motion, values_named
from exfit.simulation.inputs import Inputs
from exfit.simulation.simulator import Simulator

FREQUENCIES = np.geomspace(0.01, 10.0, 61)  # Hz: from inter-area to local modes and beyond
SIGNALS = ("speed", "p", "vt")
SIDES = ("vsi1", "vsi2")

# washouts that T = 0 leaves out: there the limit is the long time constant
ACCELERATING = ("TW2", "TW4")
LEFT_OUT = {
    **dict.fromkeys(("PSS2B", "PSS2C", "PSSSB", "PSS7C"), ACCELERATING),
    **dict.fromkeys(("PSS3B", "PSS3C"), ("TW3",)),
}
# what is zero beside a time constant that shrinks: the rest of its filter, which would resonate,
# a numerator that the lag bypasses, or makes steep enough for a limit; in PSS4B the branch that
# cancels most of the other
FILTERS = {"A3": ("A1", "A2", "A4"), "A7": ("A5", "A6", "A8")}
BRANCHES = {f"TL{k}": ("KL2" if k <= 6 else "KL1",) for k in range(1, 13)}
BESIDE = {
    "PSS1A": {"A1": ("A2",)},
    "IEEEST": {"A1": ("A2",), "A3": ("A4", "A6")},
    **dict.fromkeys(("PSS3B", "PSS3C"), FILTERS),
    **dict.fromkeys(("PSS4B", "PSS4C"), BRANCHES),
}
# numerators of a washout, where 0 stands for 1 instead of s times it
WITHOUT_WASHOUT = {"IEEEST": "T5", "ST2CUT": "T3"}


@pytest.fixture(params=list(STABILISERS))
def stabiliser(request):
    return STABILISERS[request.param]


def inputs(*vsi, p=1.0):
    """Return what a stabiliser sees of a unit with a power: of those with a switch, it is on."""
    return Names(p=p, vt=1.0, **dict(zip(SIDES, vsi, strict=False)))


def lively(model):
    """Return typical data with no block bypassed, and a switch that acts."""
    values = typical(model.sheet)
    values |= {row.symbol: values[row.symbol] or 0.04 for row in model.sheet}
    return values | ({"PPSSON": 0.05, "PPSSOFF": 0.04} if "PPSSON" in values else {})


def limits_of(values):
    """Return the floor and the ceiling of the output."""
    high = next(values[name] for name in ("VSTMAX", "LSMAX", "VSMAX", "HLIM") if name in values)
    floors = [values[name] for name in ("VSTMIN", "LSMIN", "VSMIN") if name in values]
    return (floors or [-high])[0], high


def resting(model, p, u):
    x = Names()
    assert model.rest(0.0, u, p, x) is None
    assert vars(x).keys() == set(model.states)
    return x


def motion_of(model, p, x, vsi, power=1.0):
    """Return the slopes of states (n) and the output."""
    d = Names()
    s = Names(**dict(zip(model.states, x, strict=True)))
    vs = model.equations(s, inputs(*vsi, p=power), p, d)
    slopes = [getattr(d, name) for name in model.states]
    return np.array([getattr(slope, "slope", slope) for slope in slopes]), vs


def frequency_response(model, values):
    """Return the output per unit of each input (frequencies, inputs), from central differences.

    The equations are linear off their limits, and zero at rest: the differences err by the rounding
    of a ratio alone, however small they are.
    """
    p, h, count = Names(**values), 1e-9, len(model.inputs)
    x = resting(model, p, inputs(0.0, 0.0))
    rest = np.array([*(getattr(x, name) for name in model.states), *[0.0] * count])
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


def accelerating(s, p):
    speed = washed(s, p["TW1"]) * washed(s, p["TW2"]) / (1.0 + s * p["T6"])
    power = washed(s, p["TW3"]) * washed(s, p["TW4"]) * p["KS2"] / (1.0 + s * p["T7"])
    ramp = ((1.0 + s * p["T8"]) / (1.0 + s * p["T9"]) ** p["M"]) ** p.get("N", 1.0)
    return np.array([ramp * speed, (ramp * p["KS3"] - 1.0) * power])


def pss2b(s, p):
    shaped = p["KS1"] * lead(s, p["T1"], p["T2"]) * lead(s, p["T3"], p["T4"])
    return accelerating(s, p) * shaped * lead(s, p["T10"], p["T11"])


def psssb(s, p):
    shaped = p["KS1"] * lead(s, p["T1"], p["T2"]) * lead(s, p["T3"], p["T4"])
    return accelerating(s, p) * shaped


def pss2c(s, p):
    return pss2b(s, p) * lead(s, p["T12"], p["T13"])


def canonical(s, p):
    """Return y / u: e is u over 1 and all that the integrators make of e."""
    powers = np.cumprod(
        [
            1.0 / (s * p["TI1"]),
            1.0 / (s * p["TI2"]),
            p["KI3"] / (s * p["TI3"]),
            p["KI4"] / (s * p["TI4"]),
        ]
    )
    gains = np.array([p["K1"], p["K2"], p["K3"], p["K4"]])
    return (p["K0"] + gains @ powers) / (1.0 + powers.sum())


def pss7c(s, p):
    return p["KS1"] * canonical(s, p) * accelerating(s, p)


def pss6c(s, p):
    shaped = washed(s, p["TD"]) * canonical(s, p) * p["KS"]
    power = (p["KS1"] / (1.0 + s * p["T3"]) - 1.0) / (1.0 + s * p["T1"])
    speed = p["KS2"] / (1.0 + s * p["T2"]) * s * p["MACC"] / (1.0 + s * p["T4"])
    return [power * shaped, speed * shaped]


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


def pss4b(s, p, letters="LIH"):
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
    return [low * sum(band(letter) for letter in letters if letter != "H"), high * band("H")]


def pss4c(s, p):
    return pss4b(s, p, ("VL", "L", "I", "H"))


def pss5c(s, p):
    def band(letter):
        f = p[f"F{letter}"]
        slow, middle, fast = (1.0 + s / (p[k] * f) for k in ("K1", "K2", "K3"))
        return 66.0 * p[f"K{letter}"] * (fast / middle - middle / slow)

    low = (1.0 + 1.759e-3 * s) / (1.0 + 1.7823e-2 * s + 1.2739e-4 * s * s)
    high = 80.0 * s * s / (s**3 + 82.0 * s**2 + 161.0 * s + 80.0)
    return [low * (band("VL") + band("L") + band("I")) + high * band("H")]


def wsccst(s, p):
    shaped = [lead(s, p[f"TPQ{k}"], p[f"TQ{k}"]) for k in (1, 2, 3)]
    return [p["KQS"] / (1.0 + s * p["TQS"]) * washed(s, p["TQ"]) * np.prod(shaped)]


FUNCTIONS = {
    "STAB1": stab1,
    "STAB2A": stab2a,
    "PSS1A": pss1a,
    "PSS2B": pss2b,
    "PSS2C": pss2c,
    "PSSSB": psssb,
    "PSS3B": pss3b,
    "PSS3C": pss3b,
    "PSS4B": pss4b,
    "PSS4C": pss4c,
    "PSS5C": pss5c,
    "PSS6C": pss6c,
    "PSS7C": pss7c,
    "IEEEST": ieeest,
    "ST2CUT": st2cut,
    "WSCCST": wsccst,
}


def assert_is_its_function(model, values, function=None):
    response, function = frequency_response(model, values), function or FUNCTIONS[model.name]
    # rounding of the solution: its matrix holds rates from 1e-3 to 1e4 per second
    transfer_functions.assert_is_its_function(function, response, values, FREQUENCIES, 1e-11)


def test_every_stabiliser_has_a_transfer_function_here():
    assert FUNCTIONS.keys() == STABILISERS.keys()


def test_the_response_is_the_product_of_the_blocks(stabiliser):
    assert_is_its_function(stabiliser, typical(stabiliser.sheet))
    assert_is_its_function(stabiliser, lively(stabiliser))


def test_in_psse_pss4b_turns_no_sign_and_has_a_lag_for_the_integrator():
    """Its states that InterPSS keeps (psse_pss4b) show both."""

    def in_psse(s, p):
        low, high = pss4b(s, p)
        return [low, -high * p["M"] * s / (1.0 + p["M"] * s)]

    model = STABILISERS["PSS4B"].in_dialect("psse")
    for values in (typical(model.sheet), lively(model)):
        assert_is_its_function(model, values, in_psse)


def test_the_response_is_the_product_of_the_blocks_for_drawn_values(stabiliser):
    rng = np.random.default_rng(4)
    for _ in range(20):
        values = lively(stabiliser)
        moved = {name: value * 3.0 ** rng.uniform(-1.0, 1.0) for name, value in values.items()}
        whole = {"M": 4.0, "N": 2.0} if "N" in values else {"M": 4.0}
        assert_is_its_function(stabiliser, moved | (whole if "M" in values else {}))


@pytest.mark.parametrize(("M", "N"), [(1, 1), (5, 1), (2, 4), (4, 2), (2, 3), (1, 4)])
@pytest.mark.parametrize("name", ["PSS2B", "PSS7C"])
def test_the_ramp_tracking_filter_is_as_many_blocks_as_N(name, M, N):
    values = lively(STABILISERS[name]) | {"M": float(M), "N": float(N)}
    assert_is_its_function(STABILISERS[name], values)


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
        # ten where a lead keeps its ratio to the lag; of T9 there are M N lags
        lags = values["M"] * values["N"] if row.symbol == "T9" else 1.0
        remains = 1e-3 * lags * np.abs(none).max()
        assert np.abs(2.0 * small - twice - none).max() < remains, row.symbol


@pytest.mark.parametrize("name", ["PSS2B", "PSS2C", "PSSSB", "PSS7C"])
def test_a_ramp_tracking_filter_without_order_or_lag_is_bypassed(name):
    """What is filtered and what is not of the second input cancel then, with KS3 = 1."""
    model = STABILISERS[name]
    values = lively(model) | {"KS3": 1.0}
    bypassed = [
        frequency_response(model, values | zero | {"KS2": KS2})
        for zero in ({"M": 0.0}, {"N": 0.0}, {"T9": 0.0})
        for KS2 in (0.1, 0.9)
    ]
    for other in bypassed[1:]:
        np.testing.assert_allclose(other, bypassed[0], rtol=0.0, atol=1e-9)
    filtered = frequency_response(model, values | {"KS2": 0.9})
    assert np.abs(filtered - bypassed[0]).max() > 0.1 * np.abs(bypassed[0]).max()


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
            power = vsi[1]  # below the switch, between its powers, above
            x = resting(stabiliser, p, inputs(*vsi, p=power))
            at = [getattr(x, name) for name in stabiliser.states]
            slopes, vs = motion_of(stabiliser, p, at, vsi, power)
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


@pytest.mark.parametrize("name", ["PSS2B", "PSS2C", "PSS6C", "PSS7C"])
def test_an_input_beyond_its_limit_acts_as_the_limit_does(name):
    model = STABILISERS[name]
    p, x = Names(**lively(model)), np.full(len(model.states), 0.01)
    for beyond, limit in (
        ((2.3, 0.0), (p.VSI1MAX, 0.0)),
        ((-2.3, 0.0), (p.VSI1MIN, 0.0)),
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
        (size * rng.normal(size=len(stabiliser.states)), size * rng.normal(size=2), size)
        for size in (1e-4, 0.03, 3.0)
        for _ in range(20)
    ]
    if "ON" in stabiliser.states:  # the last state: on its way, or there
        for k, (x, _, _) in enumerate(probes):
            x[-1] = 0.3 if k % 2 else 1.0
    if "VT0" in stabiliser.states:  # the last state: at the start vt was higher, or as it is
        for k, (x, _, _) in enumerate(probes):
            x[-1] = 1.15 if k % 2 else 1.0

    def felt(changed):
        p = Names(**changed)
        return [np.append(*motion_of(stabiliser, p, *probe)) for probe in probes]

    before = felt(values)
    of_input = {row.symbol for row in COMPENSATED}  # of fc, which the plant makes
    for row in (row for row in stabiliser.sheet if row.symbol not in of_input):
        after = felt(values | {row.symbol: 0.5 * values[row.symbol]})
        assert np.abs(np.array(after) - before).max() > 1e-6, row.symbol


def as_system(model):
    """Return a stabiliser alone, driven by its inputs."""

    def rest(p):
        return Rest(vars(resting(model, Names(**p), inputs(0.0, 0.0))), {})

    def course(p, r, x, u):
        d = Names()
        seen = inputs(*(u[name] for name in SIDES), p=1.0 + u["vsi2"])
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


def canonical_ratio(p):
    """Return y / u of the canonical form as two polynomials."""
    s = np.array([1.0, 0.0])
    steps = [p["TI1"] * s, p["TI2"] * s, p["TI3"] / p["KI3"] * s, p["TI4"] / p["KI4"] * s]
    behind = [np.array([1.0])]  # what is left of the product behind each integrator
    for step in reversed(steps):
        behind.append(np.polymul(step, behind[-1]))
    gains = (p["K4"], p["K3"], p["K2"], p["K1"], p["K0"])
    above = below = np.array([0.0])
    for gain, product in zip(gains, behind, strict=True):
        above, below = np.polyadd(above, gain * product), np.polyadd(below, product)
    return above, below


def chain_of_pss6c(p):
    """Of the power, whose own share of the sum is (KS1 - 1 - sT3) / (1 + sT3)."""
    blocks = ([1.0], [p["T1"], 1.0]), ([-p["T3"], p["KS1"] - 1.0], [p["T3"], 1.0])
    return series(p["KS"], *blocks, ([p["TD"], 0.0], [p["TD"], 1.0]), canonical_ratio(p))


def chain_of_pss7c(p):
    washouts = [([p[T], 0.0], [p[T], 1.0]) for T in ("TW1", "TW2")]
    ramp = [([p["T8"], 1.0], np.array([p["T9"], 1.0]))] + [([1.0], [p["T9"], 1.0])] * 4
    return series(p["KS1"], *washouts, ([1.0], [p["T6"], 1.0]), *ramp, canonical_ratio(p))


CHAINS = {
    "IEEEST": chain_of_ieeest,
    "ST2CUT": chain_of_st2cut,
    "STAB2A": chain_of_stab2a,
    "PSS3B": chain_of_pss3b,
    "PSS3C": chain_of_pss3b,
    "PSS6C": chain_of_pss6c,
    "PSS7C": chain_of_pss7c,
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


@pytest.mark.long
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


# --- the edition of 2016 --------------------------------------------------------------------------

# the form of 2005, values that make the new one equal to it, and what then makes that one so
FORMS = {
    "PSS2C": ("PSS2B", {"N": 1.0, "T12": 0.3, "T13": 0.3, "PPSSON": 0.0}),
    "PSS3C": ("PSS3B", {"PPSSON": 0.0}),
    "PSS4C": ("PSS4B", {"KVL": 0.0}),
}


def outputs_over_a_swing(model, values, swing=lambda t: 0.02 * np.sin(4.0 * t)):
    """Return vs every 2 ms of 4 s; the power swings too, and stays above 0.5."""
    time = 2e-3 * np.arange(2001)
    u = np.column_stack([swing(time), 0.3 * np.cos(9.0 * time) - 0.2])
    system = as_system(model)
    code, p = Kernel(system, system.outputs), vector(system, values)[:, None]
    (got,) = code.run(p, code.start(p), [Span(u, 2e-3, 2)])
    return time, got[:, 0, 0]


@pytest.mark.parametrize("name", FORMS)
def test_a_stabiliser_of_2016_is_that_of_2005_while_what_is_new_does_nothing(name):
    old, held = FORMS[name]
    values = lively(STABILISERS[old])
    new = lively(STABILISERS[name]) | values | held
    _, expected = outputs_over_a_swing(STABILISERS[old], values)
    _, got = outputs_over_a_swing(STABILISERS[name], new)
    low, high = limits_of(values)
    assert (expected.min(), expected.max()) == (low, high)
    assert np.abs(got - expected).max() < 1e-9  # rounding


def test_the_stabiliser_of_speed_alone_is_that_of_four_bands_of_which_the_power_follows_it():
    """Behind the swing equation s M dw = -P; K1 to K3 and the gains are those of the branches."""
    short, long = STABILISERS["PSS5C"], STABILISERS["PSS4C"]
    values = typical(short.sheet)
    same = typical(long.sheet) | {"DLI": 0.001759, "VSTMAX": 0.15, "VSTMIN": -0.15}
    for letter in ("VL", "L", "I", "H"):
        f = values[f"F{letter}"]
        slow, middle, fast = (1.0 / (values[k] * f) for k in ("K1", "K2", "K3"))
        same |= {f"T{letter}1": fast, f"T{letter}2": middle}
        same |= {f"T{letter}7": middle, f"T{letter}8": slow}
        same |= {f"K{letter}1": 66.0, f"K{letter}2": 66.0, f"K{letter}": values[f"K{letter}"]}
    expected = frequency_response(long, same)
    of_power = -same["M"] * 2j * np.pi * FREQUENCIES
    together = expected[:, 0] + expected[:, 1] * of_power
    got = frequency_response(short, values)[:, 0]
    assert np.abs(got - together).max() < 1e-9 * np.abs(got).max()  # rounding


# PSS6C in PSS/E 36.7: KS1, KS2 ... of its record, and how its states are named here
OF_PSSE = {
    **{"KS1": 0.5, "KS2": 0.2, "MACC": 0.5, "T4": 0.6, "KS": 0.5, "VSTMAX": 0.1, "VSTMIN": -0.1},
    **{"K0": 0.714, "K1": 0.6875, "K2": 0.1, "K3": 0.05, "K4": 0.02, "KI3": 0.1, "KI4": 0.1},
    **{"TI1": 1.375, "TI2": 6.4, "TI3": 0.2, "TI4": 0.3, "PPSSON": 0.0},
}


def test_from_the_states_of_psse_its_output_and_its_integrators_are_those_of_pss6c():
    """Simpson's rule over three rows bears 2 %; with e in it an integrator runs 50 times as far."""
    with (REFERENCE / "psse_pss6c_states.csv").open() as file:
        rows = [{k: float(x) for k, x in row.items()} for row in csv.DictReader(file)]
    model = STABILISERS["PSS6C"]
    p, slopes = Names(**typical(model.sheet) | OF_PSSE), []
    for row in rows:
        x, d = [row[f"s{k}"] for k in range(1, 10)], Names()
        held = {"V1": x[0], "V3": x[1], "V2": x[2], "W4": x[3] * p.T4 / p.MACC, "WD": -x[4]}
        s = Names(**held, **dict(zip(("X1", "X2", "X3", "X4"), x[5:], strict=True)), ON=1.0)
        assert abs(model.equations(s, inputs(0.0, 0.0), p, d) - row["vs"]) < 1e-7
        slopes.append(d)
    for name, state in (("X2", "s7"), ("X3", "s8"), ("X4", "s9")):
        first, second, third = (getattr(d, name) for d in slopes[:3])
        moved = (rows[2]["t"] - rows[0]["t"]) * (first + 4.0 * second + third) / 6.0
        assert abs(rows[2][state] - rows[0][state] - moved) < 0.02 * abs(moved)


OF_POWERWORLD = {  # InterPSS's record of PSS4C: the bands' gains, leads and lags
    "VL": (0.4, 0.8, 0.1, (0.05, 0.2, 0.1, 0.3, 0.2, 0.5)),
    "L": (0.3, 0.1, 0.1, (0.02, 0.05, 0.03, 0.06, 0.04, 0.08)),
    "I": (0.2, 0.05, 0.1, (0.01, 0.03, 0.02, 0.04, 0.03, 0.06)),
    "H": (0.2, 0.05, 0.01, (0.005, 0.02, 0.01, 0.03, 0.02, 0.04)),
}


def seen_through_its_lags(row, letter, p, source):
    """Return the states of a band whose outputs of lead-lags a row has, in the units of exfit."""
    states = {}
    for first, gain in ((1, "1"), (4, "2")):
        u = getattr(p, f"K{letter}{gain}") * source
        for k in range(first, first + 3):
            share = getattr(p, f"T{letter}{2 * k - 1}") / getattr(p, f"T{letter}{2 * k}")
            states[f"{letter}{k}"] = (row[f"{letter}{k}"] - share * u) / (1.0 - share)
            u = row[f"{letter}{k}"]
    return states


def test_the_bands_of_pss4c_move_as_in_powerworld():
    """Its output at each row, and each lead-lag from a row to the next, half a millisecond on."""
    with (REFERENCE / "powerworld_pss4c_bands.csv").open() as file:
        rows = [{k: float(x) for k, x in row.items()} for row in csv.DictReader(file)]
    own = {}
    for letter, (upper, lower, gain, times) in OF_POWERWORLD.items():
        own |= {f"K{letter}1": upper, f"K{letter}2": lower, f"K{letter}": gain}
        own |= {f"T{letter}{n}": T for n, T in enumerate(2 * times, start=1)}
    p, moved = Names(**typical(STABILISERS["PSS4C"].sheet) | own), []
    for row in rows:
        heard = {letter: row["high" if letter == "H" else "low"] for letter in OF_POWERWORLD}
        states = {}
        for letter, source in heard.items():
            states |= seen_through_its_lags(row, letter, p, source)
        s, d = Names(**states), Names()
        vs = sum(band(letter, source, s, p, d) for letter, source in heard.items())
        assert abs(vs - row["vs"]) < 1e-10
        moved.append((row["t"], states, vars(d)))
    for (t1, before, d1), (t2, behind, d2) in zip(moved[::2], moved[1::2], strict=True):
        for name, x in before.items():
            assert abs(behind[name] - x - (t2 - t1) * 0.5 * (d1[name] + d2[name])) < 2e-8


def test_a_fall_of_the_voltage_beyond_its_setting_cuts_PSSSB_off():
    model = STABILISERS["PSSSB"]
    p = Names(**typical(model.sheet))
    x = resting(model, p, inputs(0.0, 0.0))
    x.V1 = x.V3 = 0.01
    seen = {vt: Names(vsi1=0.0, vsi2=0.0, vt=vt) for vt in (1.3, 0.801, 0.799)}
    above, near, below = (model.equations(x, u, p, Names()) for u in seen.values())
    assert above == near != 0.0
    assert below == 0.0


SWITCHED = ("PSS2C", "PSS3C", "PSS6C", "PSS7C")


@pytest.mark.parametrize("name", SWITCHED)
def test_the_power_switches_a_stabiliser_off_and_on_and_between_both_it_stays(name):
    """Down through the upper power, the lower one, and up again; vs is what it is without one."""
    model = STABILISERS[name]
    values = typical(model.sheet) | {"PPSSON": 0.4, "PPSSOFF": 0.2}
    time = 1e-3 * np.arange(4001)
    power = np.interp(time, [0.0, 0.5, 1.5, 2.5, 3.5, 4.0], [0.9, 0.9, 0.1, 0.1, 0.9, 0.9])
    u = np.column_stack([0.001 * np.sin(7.0 * time), power - 1.0])
    system = as_system(model)
    code = Kernel(system, system.outputs)

    def response(changes):
        p = vector(system, values | changes)[:, None]
        (got,) = code.run(p, code.start(p), [Span(u, 1e-3, 1)])
        return got[:, 0, 0]

    got, without = response({}), response({"PPSSON": 0.0})
    falls, rises = 0.5 + 0.7 / 0.8, 2.5 + 0.3 / 0.8  # where the power passes them
    off = (time > falls + 0.0065) & (time < rises + 0.0045)  # half of SWITCHING, and a step
    on = (time < falls + 0.0045) | (time > rises + 0.0065)
    assert np.abs(without[off]).max() > 1e-4
    assert (got[off] == 0.0).all()
    np.testing.assert_array_equal(got[on], without[on])


@pytest.mark.parametrize("name", SWITCHED)
def test_a_start_is_on_from_the_upper_power_up(name):
    model = STABILISERS[name]
    p = Names(**typical(model.sheet) | {"PPSSON": 0.4, "PPSSOFF": 0.2})
    starts = [resting(model, p, inputs(0.0, 0.0, p=power)).ON for power in (0.1, 0.3, 0.4, 0.7)]
    assert starts == [0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize("changes", [{"M": 5.0, "N": 2.0}, {"PPSSON": 0.2, "PPSSOFF": 0.3}])
def test_a_filter_too_long_and_powers_of_the_switch_in_the_wrong_order_are_faults(changes):
    values = typical(STABILISERS["PSS2C"].sheet)
    assert [*contradictions(values)] == []
    ((symbol, text),) = contradictions(values | changes)
    assert symbol in changes
    assert "exceed 8" in text or "above PPSSON = 0.2" in text


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
        assert sorted(listed) == sorted([*symbols, *dict(record.absent), *record.ignored])


def test_the_inputs_are_signals_of_a_plant(stabiliser):
    assert 1 <= len(stabiliser.inputs) <= 2
    assert set(stabiliser.inputs) <= set(SIGNALS)
