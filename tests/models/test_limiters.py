"""What every limiter of the catalogue keeps to, and each against its equations typed again."""

from itertools import pairwise, product

import numpy as np
import pytest
from on_load import QUADRATIC, values_on_load
from oracle import float_run, vector
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from typed_on_load import Typed

from exfit.engine.kernel import Kernel, Span
from exfit.engine.system import Rest, System
from exfit.features.planner.fields import Field
from exfit.features.planner.records import Definition, read_values, record_fields
from exfit.models import LIMITERS, MODELS
from exfit.models.blocks import SHORTEST, Limited
from exfit.models.limiter_blocks import counting
from exfit.models.machines import MACHINES
from exfit.models.sheet import crossed_limits, typical
from exfit.plants import LIMITER_KINDS, MACHINE, NETWORK, PLACES, VT0, Attached, inputs_at
from exfit.plants.infinite_bus import infinite_bus
from exfit.plants.limiting import inputs_for_limiters
from exfit.plants.parts import Names, motion, values_named
from exfit.simulation.inputs import Inputs, InputStep, each
from exfit.simulation.limit_hits import limiter_actions
from exfit.simulation.limits import acting_at_rest, equation_limits, limiter_outputs, limits_hit
from exfit.simulation.simulator import Simulator

SIGNALS = ("ifd", "vt", "p", "q")
AT_REST = {"ifd": 1.6, "vt": 1.0, "p": 0.6, "q": 0.1}  # pu: within every characteristic
# data by which a limiter acts within some seconds, and no block is bypassed
LIVELY = {
    "OEL2C": {
        **{"ITFPU": 2.0, "ILIM": 1.9, "IINST": 3.0, "K2": 1.5, "KPOEL": 4.0, "KIOEL": 2.0},
        **{"KDOEL": 0.1, "TB1OEL": 0.2, "TC2OEL": 0.3, "TOFF": 0.5, "FIXEDRD": -0.6},
        **{"KRD": -20.0, "KRU": 20.0, "VOELMAX3": 9.0, "VOELMAX2": 8.0, "VOELMAX1": 7.0},
        **{"KFB": 0.05, "FIXEDRU": 0.1, "TFCL": 1.0, "TMAX": 1.0},
    },
    "OEL3C": {"ITFPU": 2.0, "TOEL": 0.8, "VOELMAX1": 0.3, "K1": 1.5, "KSCALE": 1.05},
    "OEL5C": {
        **{"KSCALE1": 0.5, "TF1": 0.02, "TCOEL": 0.1, "TBOEL": 0.05, "IFDLIM": 0.1},
        **{"VOELMAX1": 0.3, "KIFDT": 0.1, "IFDPULEV": 1.2, "TIFDLEV": 0.5, "K1": 1.5},
    },
    "UEL1": {"KUI": 2.0, "KUL": 3.0, "TU1": 0.1, "TU3": 0.05, "TU4": 0.1, "VUIMIN": -1.0},
    "UEL2C": {
        **{"TUP": 0.3, "TUQ": 0.02, "TUV": 0.2, "VBIAS": 0.95, "TQREF": 0.1, "SW1": 2.0},
        **{"TADJ": 0.2, "TU1": 0.05, "TU2": 0.1, "TU3": 0.2, "TU4": 0.15, "KFIX": 0.8},
        **{"VUIMIN": -0.5, "VUELMIN1": -0.5},
    },
    "SCL1C": {
        **{"ISCLLIM": 0.9, "TIT": 0.05, "TQSCL": 0.04, "K": 1.5, "IQMIN": 0.2, "TINV": 0.5},
        **{"TDSCL": 0.3, "KPOEX": 0.2, "KPUEX": 1.2, "KIUEX": 3.0, "VSCLMIN": -0.2, "VSCLMAX": 3.0},
    },
    "SCL2C": {
        **{"ITFPU": 0.8, "ILIM": 0.75, "IINST": 1.2, "IINSTUEL": 1.1, "K2": 1.5, "KPUEL": 4.0},
        **{"KIUEL": 2.0, "KPOEL": 3.0, "KIOEL": 1.0, "KDUEL": 0.1, "KDOEL": 0.1, "TB1UEL": 0.2},
        **{"TC2OEL": 0.3, "TC2UEL": 0.3, "TB1OEL": 0.2, "TOFF": 0.5, "FIXEDRD": -0.6},
        **{"FIXEDRU": 0.1, "KFB": 0.05, "TSCL": 0.3, "TMAX": 0.3, "KRD": -20.0, "KRU": 20.0},
        **{"TIPOEL": 0.02, "TIQOEL": 0.03, "TIPUEL": 0.04, "TIQUEL": 0.05, "KPREF": 0.1},
        **{"KIPUEL": 0.9, "KIQUEL": 1.1, "KIPOEL": 0.9, "KIQOEL": 1.1, "IQMAXUEL": -0.1},
        **{
            "IQMINOEL": 0.2,
            "VTMIN": 0.97,
            "VTRESET": 0.95,
            "VOELMAX1": 7.0,
            "VUELMIN1": -7.0,
            "VOELMIN3": -4.0,
            "VUELMIN3": -4.0,
        },
    },
}


@pytest.fixture(params=list(LIMITERS))
def limiter(request):
    return LIMITERS[request.param]


def lively(model):
    return typical(model.sheet) | LIVELY[model.name]


def resting(model, p, u):
    x = Names()
    model.rest(0.0, u, p, x)
    assert vars(x).keys() == set(model.states)
    return x


def each_output(output):
    """Return the outputs of a limiter, which of a stator current limiter are two."""
    return output if isinstance(output, tuple) else (output,)


def slopes_of(model, p, x, u):
    """Return the slopes of the states and the outputs."""
    d = Names()
    outputs = each_output(model.equations(x, u, p, d))
    assert vars(d).keys() == set(model.states)
    slopes = [getattr(d, name) for name in model.states]
    return [s.slope if isinstance(s, Limited) else s for s in slopes], outputs


def test_it_rests_while_its_inputs_are_within_its_characteristic(limiter):
    for values in (typical(limiter.sheet), lively(limiter)):
        p, u = Names(**values), Names(**{name: np.float64(AT_REST[name]) for name in SIGNALS})
        x = resting(limiter, p, u)
        slopes, outputs = slopes_of(limiter, p, x, u)
        assert np.abs(np.array(slopes, dtype=float)).max() < 1e-12
        assert np.all(np.isfinite(outputs))


def sides_of(model):
    """Return the sides on which the outputs of a limiter act."""
    return tuple(Attached(model, model.places[0]).signals)


def as_system(model):
    """Return a limiter alone; the inputs are changes from the start."""

    def seen(u):
        return Names(**{name: AT_REST[name] + u[name] for name in SIGNALS})

    def sheet_of(p):
        return Names(**{row.symbol: p[row.symbol] for row in model.sheet})

    def rest(p):
        x = resting(model, sheet_of(p), seen(dict.fromkeys(SIGNALS, 0.0)))
        return Rest({name: getattr(x, name) for name in model.states}, {})

    def course(p, r, x, u):
        d = Names()
        output = model.equations(values_named(x, model.states), seen(u), sheet_of(p), d)
        outputs = dict(zip(sides_of(model), each_output(output), strict=True))
        return motion(d, model.states, {**outputs, **x})

    return System(
        parameters=tuple(row.symbol for row in model.sheet),
        setpoints=(),
        states=model.states,
        inputs=SIGNALS,
        outputs=(*sides_of(model), *model.states),
        time_constants=tuple(row.symbol for row in model.sheet if row.is_time),
        rest=rest,
        motion=course,
    )


def changes(t):
    """Return how the inputs move: the current above every limit and back, Q below and back."""
    pulse = np.sin(np.pi * np.clip((t - 0.5) / 4.0, 0.0, 1.0)) ** 2
    sway = np.sin(3.0 * t) * np.exp(-0.2 * t)
    return np.stack([1.4 * pulse, 0.03 * sway - 0.04 * pulse, 0.1 * sway, -0.9 * pulse])


def run(model, values, step=5e-4, seconds=8.0):
    """Return the times and the outputs of the compiled limiter."""
    system = as_system(model)
    code, p = Kernel(system, system.outputs, 1), vector(system, values)[:, None]
    time = step * np.arange(round(seconds / step) + 1)
    (out,) = code.run(p, code.start(p), [Span(changes(time).T.copy(), step, 1)])
    return time, out[:, :, 0]


def test_compiled_code_gives_what_the_plain_equations_give(limiter):
    system, values = as_system(limiter), lively(limiter)
    time = 4e-3 * np.arange(1001)
    u = changes(time).T.copy()
    (expected,) = float_run(system, values, system.outputs, [Span(u, 4e-3, 1)])
    code, p = Kernel(system, system.outputs, 1), vector(system, values)[:, None]
    (got,) = code.run(p, code.start(p), [Span(u, 4e-3, 1)])
    assert np.abs(got[:, :, 0] - expected).max() < 1e-11 * np.abs(expected).max()


# --- a second typing, integrated by another method ------------------------------------------------


def stopped(rate, x, low, high):
    """Return the slope of a state that stops at its limits."""
    return 0.0 if (x >= high and rate > 0.0) or (x <= low and rate < 0.0) else rate


def pi(e, x, p, KP, KI, low, high):
    y = p[KP] * e + x
    rate = p[KI] * e
    held = (y >= p[high] and rate > 0.0) or (y <= p[low] and rate < 0.0)
    return min(max(y, p[low]), p[high]), 0.0 if held else rate


def typed_oel3c(x, u, p):
    i, v = x
    e = p["KOEL"] * (p["ITFPU"] ** p["K1"] - i ** p["K1"])
    v = min(max(v, p["VOELMIN1"]), p["VOELMAX1"])
    rate = stopped(e / p["TOEL"], v, p["VOELMIN1"], p["VOELMAX1"])
    output = v + (p["KPOEL"] * e if v < 0.0 else 0.0)
    slopes = [(p["KSCALE"] * u[0] - i) / p["TF"], rate]
    return slopes, min(max(output, p["VOELMIN2"]), p["VOELMAX2"])


def typed_uel1(x, u, p):
    _, vt, P, Q = u
    it = complex(P, -Q) / vt
    e = abs(p["KUC"] * vt - 1j * it) - p["KUR"] * vt  # VUCMAX and VURMAX stand far away
    v, d_v = pi(e, x[0], p, "KUL", "KUI", "VUIMIN", "VUIMAX")
    d_1 = (v - x[1]) / p["TU2"]
    v1 = x[1] + p["TU1"] * d_1
    d_3 = (v1 - x[2]) / p["TU4"]
    output = x[2] + p["TU3"] * d_3
    return [d_v, d_1, d_3], min(max(output, p["VULMIN"]), p["VULMAX"])


def typed_uel2c(x, u, p):
    _, vt, P, Q = u
    v, active, qref, q, kadj, integral, x1, x3 = x
    f = v if v > 1.0 else v / p["VBIAS"] if v <= p["VBIAS"] else 1.0
    points = [(p[f"P{k}"], p[f"Q{k}"]) for k in range(5)]
    k = max(1, sum(active > point[0] for point in points[1:-1]) + 1)
    (p0, q0), (p1, q1) = points[k - 1 : k + 1]
    limit = q0 + (q1 - q0) / (p1 - p0) * (active - p0)
    reach = vt**2 / p["XQ"] + Q
    y, d_i = pi(kadj * (qref - q), integral, p, "KUL", "KUI", "VUIMIN", "VUIMAX")
    d_1 = (y - x1) / p["TU2"]
    y1 = x1 + p["TU1"] * d_1
    # the second block has more lead than lag: at a limit its state follows its output by the lead
    y3 = x3 + p["TU3"] / p["TU4"] * (y1 - x3)
    held = min(max(y3, p["VUELMIN1"]), p["VUELMAX1"])
    return [
        (vt - v) / p["TUV"],
        (P / f ** p["K1"] - active) / p["TUP"],
        (limit * f ** p["K2"] - qref) / p["TQREF"],
        (Q - q) / p["TUQ"],
        (reach / np.hypot(reach, P) - kadj) / p["TADJ"],
        d_i,
        d_1,
        (held - x3) / p["TU3"],
    ], held


def typed_scl1c(x, u, p):
    _, vt, P, Q = u
    i, late, iq, _, oex, uex = x
    it, error = abs(complex(P, Q)) / vt, i ** p["K"] - p["ISCLLIM"]
    reactive = np.sign(iq) * abs(iq) ** p["K"]
    limits = "VSCLMIN", "VSCLMAX"
    o, d_o = pi(min(reactive - p["IQMIN"], error), oex, p, "KPOEX", "KIOEX", *limits)
    v, d_v = pi(min(-reactive - p["IQMIN"], error), uex, p, "KPUEX", "KIUEX", *limits)
    lags = [(it - i) / p["TIT"], (it - late) / p["TINV"], (Q / vt - iq) / p["TQSCL"]]
    return [*lags, 0.0, d_o, d_v], np.array([-max(o, 0.0), max(v, 0.0)])


SMOOTH = {"OEL3C": typed_oel3c, "UEL1": typed_uel1, "UEL2C": typed_uel2c, "SCL1C": typed_scl1c}


def test_another_typing_and_method_reach_and_leave_the_limits_together(limiter):
    if limiter.name not in SMOOTH:
        pytest.skip("switches on the grid: see the tests of its switching")
    typed, values = SMOOTH[limiter.name], lively(limiter)
    time, got = run(limiter, values)
    first = np.array([AT_REST[name] for name in SIGNALS])
    x = resting(limiter, Names(**values), Names(**AT_REST))
    solved = solve_ivp(
        lambda t, x: typed(x, first + changes(t), values)[0],
        (0.0, time[-1]),
        [float(getattr(x, name)) for name in limiter.states],
        "DOP853",
        time[::20],
        rtol=1e-9,
        atol=1e-11,
        max_step=2e-3,
    )
    expected = np.array(
        [typed(x, first + changes(t), values)[1] for t, x in zip(solved.t, solved.y.T, strict=True)]
    ).reshape(len(solved.t), -1)
    assert np.ptp(expected) > 0.2
    # a limit is met within a step: the square of its length, times what the slope jumps by
    assert np.abs(got[::20, : expected.shape[1]] - expected).max() < 2e-6


# --- switching ------------------------------------------------------------------------------------


def at_instants(flags):
    """Return where a row of truth values changes."""
    return np.flatnonzero(np.diff(flags.astype(int))) + 1


def test_OEL2C_counts_acts_and_is_reset():
    """Its timer is an integral typed again; it acts when that is full, until the reset delay."""
    model = LIMITERS["OEL2C"]
    p = lively(model) | {"KFB": 0.0}
    time, got = run(model, p, seconds=12.0)
    states = dict(zip(model.states, got[:, 1:].T, strict=True))
    ratio = np.maximum(states["I"] / p["ITFPU"], 1e-6)
    inverse = np.clip(p["K2"] * (ratio ** p["C2"] - 1.0), p["VINVMIN"], p["VINVMAX"])
    rate = inverse + np.where(ratio > 1.0, p["FIXEDRU"], p["FIXEDRD"])
    t = np.zeros(len(time))
    for k, (a, b) in enumerate(pairwise(rate)):
        t[k + 1] = np.clip(t[k] + 5e-4 * (a + b) / 2.0, p["TMIN"], p["TMAX"])
    # where the rate jumps, a step of it
    assert np.abs(states["T"] - t).max() < 5e-4 * 2.0
    on, off = at_instants(states["ACTIVE"] > 0.5)
    full = np.argmax(t >= p["TFCL"])
    assert abs(on - full) <= 3
    released = (states["IREF"] >= p["IINST"]) & (states["BELOW"] > p["TOFF"])
    assert released[off]
    assert not released[off - 1]
    # at work it brings the reference down to the thermal limit, by the ramp
    assert states["IREF"][on + round((p["IINST"] - p["ILIM"]) / 20.0 / 5e-4) + 2] == p["ILIM"]
    assert states["IREF"][-1] == p["IINST"]
    assert got[-1, 0] == p["VOELMAX1"]


# OEL2CU1 in PSS/E 36.7 (InterPSS-Project/ipss-plugin, EmbeddedNativeTrajectoryValues.java at
# f727fb59): its constants without the last one, the rated field current; t, current and timer
OF_PSSE = """
    0.015 0.08 0.02 0.1 0.35 0.8 0.01 0.08 0 -1 0 -1 0 -1 0 0.12 0.4 0.04 0.7 0.02 1.02 0.9 1.45 1.1
    0.05 1.8 0.2 2 0.05 0.5 -0.5 1 -1 0.2 1 0 0 -2 2 0.1
"""
TIMER_OF_PSSE = (
    (0.572498738766, 0.864291489124, 0.280472099781),
    (0.580999135971, 0.862973809242, 0.288938462734),
    (0.769007921219, 0.836122572422, 0.475910454988),
    (0.789008855820, 0.833166480064, 0.495770514011),
    (0.932515561581, 0.812548458576, 0.638089656830),
    (0.951516449451, 0.810221195221, 0.656911790371),
)


def test_OEL2C_counts_as_in_PSSE_with_two_values_exchanged():
    """A record does that; from one instant to the next the rate hardly bends."""
    model = LIMITERS["OEL2C"]
    definition = Definition("limiter", model, model.records[0])
    fields = tuple(Field(text, 1) for text in ("1", *OF_PSSE.split()))
    read = read_values(definition, 1, fields)
    p = Names(**read.values)
    assert (p.ITFPU, p.C2, p.K2, p.KFB, p.FIXEDRU, p.FIXEDRD) == (0.9, 2.0, 0.05, 0.0, -1.0, 1.0)
    for first, second in pairwise(TIMER_OF_PSSE):
        (t1, i1, timer1), (t2, i2, timer2) = first, second
        rate = 0.5 * (counting(i1, p) + counting(i2, p))
        assert abs((timer2 - timer1) / (t2 - t1) - rate) < 1e-4
    written = [float(text) for text in record_fields(definition, read.values)[1:]]
    assert written == [float(text) for text in OF_PSSE.split()]


# of the same run: t, efd, which is its input there, and its states but for the timer, three rows at
# a time, while its PID is at the ceiling of 0
STATES_OF_OEL2C = (
    ((0.3084978163, 1.18483412266, 0.862198233604, 1.45, -0.00392908649519, 0.0417256765068,
      -0.010411622934, -0.0146577171981),
     (0.3089978099, 1.18443226814, 0.861384570599, 1.45, -0.00392908649519, 0.0419103913009,
      -0.0103596961126, -0.0146181574091),
     (0.3094978035, 1.18404436111, 0.860584199429, 1.45, -0.00392908649519, 0.0420945957303,
      -0.0103080272675, -0.0145785864443)),
    ((0.3279975653, 1.17820549011, 0.839474380016, 1.45, -0.00392908649519, 0.0484939627349,
      -0.00856706500053, -0.0131175043061),
     (0.3284975588, 1.17824339867, 0.839111089706, 1.45, -0.00392908649519, 0.0486543774605,
      -0.00852433685213, -0.0130783701316),
     (0.3289975524, 1.17829028989, 0.838757455349, 1.45, -0.00392908649519, 0.0488140769303,
      -0.0084818219766, -0.0130392676219)),
)  # fmt: skip


@pytest.mark.parametrize("rows", STATES_OF_OEL2C)
def test_OEL2C_moves_as_in_PSSE_from_one_step_to_the_next(rows):
    """By its rule x + h (3 f - f of the step before) / 2; its derivative there has the gain."""
    model = LIMITERS["OEL2C"]
    definition = Definition("limiter", model, model.records[0])
    fields = tuple(Field(text, 1) for text in ("1", *OF_PSSE.split()))
    p, slopes = Names(**read_values(definition, 1, fields).values), []
    names, gain = ("I", "IF", "INTEG", "DERIV", "V2", "V1"), p.KDOEL / p.TDOEL
    for _, efd, *states in rows:
        waiting = {"T": 0.0, "IREF": p.IINST, "OVER": 0.0, "BELOW": 0.0, "ACTIVE": 0.0}
        s, d = Names(**waiting, **dict(zip(names, states, strict=True))), Names()
        s.DERIV /= gain
        model.equations(s, Names(ifd=efd), p, d)
        d.DERIV *= gain
        written = [getattr(d, name) for name in names]
        slopes.append([f.slope if isinstance(f, Limited) else f for f in written])
    _, (t, _, *now), (end, _, *then) = rows
    for x, f, before, found in zip(now, slopes[1], slopes[0], then, strict=True):
        assert abs(x + (end - t) * (1.5 * f - 0.5 * before) - found) < 1e-7


# UEL1 in PSS/E 36.7, from the same file, where it does not act: t, the distance from the circle,
# and its states, three rows at a time: at the ceiling of the PI, below it, and at its floor
UEL1_OF_PSSE = """KUR KUC VURMAX VUCMAX KUI KUL VUIMAX VUIMIN TU1 TU2 TU3 TU4 VULMAX VULMIN
    1.72 1.29 6.1 6.0 0.10 3.0 0.25 0.0 0.02 0.08 0.015 0.06 0.10 0.0"""
STATES_OF_UEL1 = (
    ((0.05350001902, 0.173318624496, 0.0, 0.00996080692858, 0.00349128688686),
     (0.05400002003, 0.169433116913, 0.0, 0.0114563489333, 0.00404768576846),
     (0.05450002104, 0.16562128067, 0.0, 0.0129425730556, 0.00460874615237)),
    ((0.06950005144, 0.0786634683609, 1.0214818758e-05, 0.0533963292837, 0.0231436789036),
     (0.07000005245, 0.0765333175659, 1.40937490869e-05, 0.0545136369765, 0.0237704142928),
     (0.07050005347, 0.0744469165802, 1.78671616595e-05, 0.055584564805, 0.0243856273592)),
    ((0.07450006157, 0.0591689348221, 4.45022815256e-05, 0.0626076459885, 0.0289017017931),
     (0.07500006258, 0.0574281215668, 4.74162661703e-05, 0.0633070766926, 0.0294166076928),
     (0.07550006360, 0.0557225942612, 5.02441507706e-05, 0.0639699846506, 0.0299207661301)),
    ((0.62850135565, -0.373650670052, 1.14034104627e-4, 9.02444880921e-05, 2.47286312515e-4),
     (0.62900137901, -0.373618483543, 1.14034104627e-4, 8.96822311915e-05, 2.4579410092e-4),
     (0.62950140238, -0.373588681221, 1.14034104627e-4, 8.91234813025e-05, 2.44310795097e-4)),
)  # fmt: skip


@pytest.mark.parametrize("rows", STATES_OF_UEL1)
def test_UEL1_moves_as_in_PSSE_from_one_step_to_the_next(rows):
    """By its rule x + h (3 f - f of the step before) / 2."""
    names, values = (line.split() for line in UEL1_OF_PSSE.split("\n"))
    p, slopes = Names(**dict(zip(names, map(float, values), strict=True))), []
    for _, distance, *states in rows:
        u, d = Names(vt=1.0, p=0.0, q=p.KUC - p.KUR - distance), Names()
        LIMITERS["UEL1"].equations(
            Names(**dict(zip(["V", "V1", "V3"], states, strict=True))), u, p, d
        )
        slopes.append((d.V, d.V1, d.V3))
    _, (t, _, *now), (end, _, *then) = rows
    for x, f, before, found in zip(now, slopes[1], slopes[0], then, strict=True):
        # single precision of the states; a step moves them by 1e-6 to 1e-3
        assert abs(x + (end - t) * (1.5 * f - 0.5 * before) - found) < 1e-8


def test_OEL5C_acts_by_its_count_or_soon_and_lets_go_when_the_count_is_empty():
    model = LIMITERS["OEL5C"]
    p = lively(model)
    time, got = run(model, p, seconds=12.0)
    states = dict(zip(model.states, got[:, 1:].T, strict=True))
    on, off = at_instants(states["LATCH"] > 0.5)
    assert abs(states["T"][on] - p["IFDLIM"]) < 2e-3
    assert states["T"][off] == 0.0
    inactive = (states["LATCH"] < 0.5) & (states["OVER"] <= p["TIFDLEV"])
    assert np.all(got[inactive, 0] == p["IBIAS"])
    # while the current is high the timer runs, and is back at zero at once when it is not
    assert np.all(states["OVER"][states["I"] < p["IFDPULEV"]] == 0.0)
    alone, soon = run(model, p | {"IFDLIM": 9.0, "VOELMAX1": 9.5})[1], states["I"] > p["IFDPULEV"]
    first = np.argmax(soon)
    acts = np.argmax(alone[:, 0] != p["IBIAS"])
    assert time[acts] - time[first] == pytest.approx(p["TIFDLEV"], abs=2e-3)


@pytest.mark.parametrize("limiter", ["SCL1C"], indirect=True)
def test_mirrored_in_Q_one_side_of_SCL1C_does_what_the_other_did(limiter):
    rng = np.random.default_rng(5)
    for switches in ({"SW1": 1.0}, {"SW1": 2.0, "SW2": 0.0}, {"SW1": 2.0, "SW2": 1.0}):
        p = lively(limiter) | {"KPUEX": 0.2, "KIUEX": 0.2} | switches
        for _ in range(30):
            x = {name: rng.uniform(0.0, 1.5) for name in limiter.states}
            u = {"vt": 1.0, "p": 0.6, "q": rng.uniform(-1.0, 1.0)}
            oel, uel = limiter.equations(Names(**x), Names(**u), Names(**p), Names())
            x |= {"IQ": -x["IQ"], "OEX": x["UEX"], "UEX": x["OEX"]}
            u |= {"q": -u["q"]}
            mirrored = limiter.equations(Names(**x), Names(**u), Names(**p), Names())
            assert mirrored == (-uel, -oel)


@pytest.mark.parametrize("limiter", ["SCL2C"], indirect=True)
def test_SCL2C_counts_acts_and_is_reset_and_leaves_Q_between_its_limits(limiter):
    p = lively(limiter) | {"KFB": 0.0, "KPREF": 0.0}
    time, got = run(limiter, p, seconds=10.0)
    x = dict(zip(limiter.states, got[:, 2:].T, strict=True))
    ratio = np.maximum(x["I"] / p["ITFPU"], 1e-6)
    counting = p["K2"] * (ratio ** p["C2"] - 1.0)
    rate = np.clip(counting, 0.0, 100.0) + np.where(ratio > 1.0, p["FIXEDRU"], p["FIXEDRD"])
    t = np.zeros(len(time))
    for k, (a, b) in enumerate(pairwise(rate)):
        t[k + 1] = np.clip(t[k] + 5e-4 * (a + b) / 2.0, p["TMIN"], p["TMAX"])
    # where the rate jumps, a step of it
    assert np.abs(x["T"] - t).max() < 5e-4 * 2.0
    for side in ("OEL", "UEL"):
        on, off = at_instants(x["ACTIVE" + side] > 0.5)[[0, -1]]
        assert abs(on - np.argmax(t >= p["TSCL"])) <= 3
        assert x["BELOW" + side][off] > p["TOFF"]
        assert x["IREF"][off] == p["IINST"]
    # with Q far below, the underexcited side raises
    assert got[x["IQUEL"] < -0.5, 1].max() > 0.5
    # while the reactive current is above IQMAXUEL the error of the underexcited side lets go
    assert got[0, 1] < 0.0
    assert got[-1, 1] < 0.0


# --- on load --------------------------------------------------------------------------------------

UP, DOWN = 0.12, -0.37  # pu of the reference: into overexcitation, then into underexcitation
STEPS = (InputStep(0.5, UP), InputStep(4.0, DOWN), InputStep(8.0, -UP - DOWN))
END = 12.0
KA, TA = 60.0, 0.05
OEL = {"TEN": 0.0, "IINST": 1.85, "ILIM": 0.1, "ITFPU": 99.0, "TROEL": 0.02, "KPOEL": 15.0}
OEL |= {"VOELMAX1": 40.0, "TB1OEL": 0.1, "TC1OEL": 0.1, "TAOEL": 0.04}
UEL = {"KUR": 1.7, "KUL": 20.0}


def limited_unit(data=None):
    """Return a unit on load with limiters at the gates of a static exciter, and its values.

    ``data`` are what each limiter has beside its typical data, by its name.
    """
    machine = MACHINES["GENROU"]
    data = {"OEL2C": OEL, "UEL1": UEL} if data is None else data
    attached = tuple(Attached(LIMITERS[name], "takeover") for name in data)
    plant = infinite_bus(MODELS["ST1A"], machine, QUADRATIC, limiters=attached)
    values = values_on_load(machine, exciter="ST1A", network_Rc=0.0, network_Xc=0.0)
    values |= {"TR": 0.0, "TC": 0.0, "TB": 0.0, "KA": KA, "TA": TA, "KC": 0.0, "KF": 0.0}
    values |= {"KLR": 0.0, "VAMAX": 99.0, "VAMIN": -99.0, "VRMAX": 99.0, "VRMIN": -99.0}
    values |= {VT0: 1.0, NETWORK + "P": 0.6, NETWORK + "Q": 0.05, NETWORK + "X": 0.3}
    for limiter, changed in zip(attached, data.values(), strict=True):
        of_limiter = typical(limiter.model.sheet) | changed
        values |= {limiter.prefix + symbol: value for symbol, value in of_limiter.items()}
    return plant, values


def typed_unit(values):
    """Return slopes and signals of the same unit, typed again, and its start by a root search."""
    m = {k.removeprefix(MACHINE): v for k, v in values.items() if k.startswith(MACHINE)}
    n = {k.removeprefix(NETWORK): v for k, v in values.items() if k.startswith(NETWORK)}
    typed = Typed("GENROU", m, n)
    E = abs(values[VT0] - (n["R"] + 1j * n["X"]) * (n["P"] - 1j * n["Q"]) / values[VT0])
    kur, kuc, kul = (values["uel." + name] for name in ("KUR", "KUC", "KUL"))

    def signals(x):
        vd, vq, i_d, i_q = typed.stator(x[:6], E, n["R"], n["X"])
        vt, P, Q = np.hypot(vd, vq), vd * i_d + vq * i_q, vq * i_d - vd * i_q
        va, i_oel, v_uel = x[6:]
        voel = min(max(OEL["KPOEL"] * (OEL["IINST"] - i_oel), -10.0), OEL["VOELMAX1"])
        efd = min(max(va, min(max(v_uel, -18.0), 18.0)), voel)
        distance = abs(kuc * vt - 1j * complex(P, -Q) / vt) - kur * vt
        return vt, efd, min(max(kul * distance, -18.0), 18.0), va

    def slopes(x, vref):
        vt, efd, uel, va = signals(x)
        moved, ifd = typed.slopes(x[:6], efd, n["P"], E, n["R"], n["X"])
        return [
            *moved,
            (KA * (vref - vt) - va) / TA,
            (ifd - x[7]) / values["oel.TROEL"],
            (uel - x[8]) / values["uel.TU2"],
        ]

    def unknown(z):
        vref = z[9]
        vt = signals(z[:9])[0]
        return [*slopes(z[:9], vref), vt - values[VT0]]

    guess = [1.0, 0.9, 0.3, 0.5, 0.8, 0.0, 1.6, 1.6, -5.0, 1.03]
    start, _, converged, _ = fsolve(unknown, guess, full_output=True, xtol=1e-13)
    assert converged == 1
    return slopes, signals, start[:9], start[9]


@pytest.mark.long
def test_both_limiters_are_reached_held_and_left_on_load_as_typed_again():
    plant, values = limited_unit()
    times = np.linspace(0.0, END, 1201)
    simulator = Simulator(plant, Inputs(0.0, END, STEPS), times, 2.5e-4)
    got = simulator.response(values).signals
    slopes, signals, x, vref = typed_unit(values)
    rows, edges = [x], [0.0, *(step.at for step in STEPS), END]
    for begin, end in pairwise(edges):
        vref += sum(step.step for step in STEPS if step.at == begin)
        inside = times[(times > begin) & (times <= end)]
        solved = solve_ivp(
            lambda t, x, vref=vref: slopes(x, vref),
            (begin, end),
            x,
            "DOP853",
            inside,
            rtol=1e-9,
            atol=1e-11,
            max_step=5e-3,
        )
        rows += list(solved.y.T)
        x = solved.y[:, -1]
    theirs = np.array([signals(x)[:2] for x in rows])
    assert np.abs(got["vt"] - theirs[:, 0]).max() < 1e-6
    # beside a step of the reference efd jumps within a sample: it is compared one later
    assert np.abs(got["efd"] - theirs[:, 1]).max() < 1e-5
    # held: the field current at the limit, the machine on its circle, each but for its gain
    held = (times > 3.5) & (times < 4.0)
    assert np.abs(got["ifd"][held] - (OEL["IINST"] - got["efd"][held] / OEL["KPOEL"])).max() < 2e-3
    oel, uel = limits_hit(simulator, values)
    assert (oel.limit, uel.limit) == ("oel.OEL2C", "uel.UEL1")
    assert 0.5 < oel.first < 1.5
    assert 4.0 < uel.first < 6.0
    # left without delay: a sample after the step the gates are the regulator's again
    for name, step in (("oel.OEL2C", 4.0), ("uel.UEL1", 8.0)):
        before, after = np.searchsorted(times, step - 0.005), np.searchsorted(times, step + 0.3)
        assert got["efd"][before] == pytest.approx(got[name][before], abs=1e-12)
        assert abs(got["efd"][after] - got[name][after]) > 0.1


@pytest.mark.long
def test_derivatives_are_those_of_the_response_while_the_limiters_act():
    plant, values = limited_unit()
    free = ("oel.IINST", "oel.KPOEL", "oel.TROEL", "uel.KUR", "uel.KUL", "uel.TU2", "KA")
    simulator = Simulator(plant, Inputs(0.0, END, STEPS), np.linspace(0.0, END, 241), 5e-4)
    _, slopes = simulator.tangents(values, ("vt",), each(free))
    for k, name in enumerate(free):
        sides = [values | {name: values[name] * (1.0 + side)} for side in (1e-5, -1e-5)]
        up, down = (simulator.response(side, ("vt",)).signals["vt"] for side in sides)
        difference = (up - down) / (2e-5 * values[name])
        # the instant at which a limiter takes over moves within a step
        most = 1e-3 * np.abs(difference).max()
        assert most > 0.0, name
        assert np.abs(slopes[:, 0, k] - difference).max() < most, name


def test_a_limiter_that_acts_at_the_start_is_refused_with_what_it_lacks():
    plant, values = limited_unit()
    assert acting_at_rest(plant, values) == ""
    beyond = values | {"oel.IINST": 1.4}
    text = acting_at_rest(plant, beyond)
    assert text.startswith("oel.OEL2C acts at the start already, at ")
    assert "where its gate has 1.65" in text


SCL = {"TENOEL": 0.0, "TENUEL": 0.0, "IINST": 0.75, "ILIM": 0.1, "ITFPU": 99.0, "KPOEL": 15.0}
SCL |= {"VOELMAX1": 40.0, "VTMIN": 0.5, "VTRESET": 0.4, "IQMINOEL": -9.0}
OF_OEL, OF_SCL = "oel.OEL2C", "scl.SCL2C.oel"


def stepped_up(**currents):
    """Return when limiters act after a step into overexcitation, and all signals.

    ``currents`` are the limits of a limiter of the field current and of one of the stator's.
    """
    data = {"OEL2C": OEL, "SCL2C": SCL}
    limiters = {name: data[name] | {"IINST": limit} for name, limit in currents.items()}
    plant, values = limited_unit(limiters)
    inputs = Inputs(0.0, 3.0, (InputStep(0.5, UP),))
    simulator = Simulator(plant, inputs, np.linspace(0.0, 3.0, 301), 1e-3)
    actions = limiter_actions(simulator, values)
    return {action.name: action.spans for action in actions}, simulator.response(values).signals


@pytest.mark.long
@pytest.mark.parametrize(
    ("oel", "scl", "acting"),
    # the one that waits is far from its limit, or would act if it were alone
    [(1.85, 9.0, OF_OEL), (9.0, 0.75, OF_SCL), (1.85, 0.85, OF_OEL), (2.2, 0.75, OF_SCL)],
)
def test_of_two_limiters_at_one_gate_the_lower_one_acts_as_if_alone(oel, scl, acting):
    spans, got = stepped_up(OEL2C=oel, SCL2C=scl)
    alone = {"OEL2C": oel} if acting == OF_OEL else {"SCL2C": scl}
    spans_alone, expected = stepped_up(**alone)
    assert spans == spans_alone
    assert spans.keys() == {acting}
    assert spans[acting][-1][1] == 3.0
    for name in ("vt", "efd", "ifd", "q"):
        assert np.abs(got[name] - expected[name]).max() < 1e-9, name


def test_two_limiters_at_one_gate_are_noted_from_when_each_is_the_lower():
    spans, got = stepped_up(OEL2C=2.2, SCL2C=0.8)
    ((begin, handed),), ((taken, end),) = spans[OF_SCL], spans[OF_OEL]
    # held first by the stator current, since the field current follows efd later
    assert 0.5 < begin < handed < taken < end == 3.0
    assert taken - handed == pytest.approx(1e-3)
    lower = np.minimum(got["VA"], np.minimum(got[OF_OEL], got[OF_SCL]))
    assert np.abs(got["efd"] - lower).max() < 1e-12
    time = np.linspace(0.0, 3.0, 301)
    for name, since, until in ((OF_SCL, begin, handed), (OF_OEL, taken, end)):
        during = (time > since) & (time < until)
        assert np.array_equal(got[name][during], got["efd"][during])
    # until then the other one changes nothing
    first = stepped_up(SCL2C=0.8)[1]
    assert np.abs(got["vt"] - first["vt"])[time < taken].max() < 1e-9
    assert np.abs(got["vt"] - first["vt"])[-1] > 0.01


# what an exciter has for limiters, each with the place that uses it
AT_INPUT = {"vuel": "takeover", "voel": "takeover", "vsum": "summing"}
AT_INPUT |= {"vuel_out": "takeover-output", "voel_out": "takeover-output"}


def test_a_limiter_is_found_at_each_gate_and_sum_of_an_exciter(exciter):
    """A gate that was taken for a sum would act at any output, and be refused at the start."""
    model = MODELS[exciter]
    for name in inputs_for_limiters(model):
        attached = Attached(LIMITERS["UEL1" if "uel" in name else "OEL2C"], AT_INPUT[name])
        plant = infinite_bus(model, MACHINES["GENROU"], QUADRATIC, limiters=(attached,))
        limits = [
            limit for limit in equation_limits(plant) if limit.limit in attached.signals.values()
        ]
        assert limits, name
        (output,) = limiter_outputs(plant).values()
        for limit in limits:
            at_sum = limit.value is output
            assert at_sum == (name == "vsum"), name


def test_the_flags_of_an_exciter_s_record_are_of_its_gates_and_sums(exciter):
    """A flag without its input would place a limiter where the model does not see it."""
    model = MODELS[exciter]
    for record in model.records:
        flags = {"OEL", "UEL"} & dict(record.icons).keys()
        assert flags or not record.places
        places = [place for _, place in record.places]
        assert len({*places}) == len(places)
        for kind, place in product(flags, places):
            limiter = LIMITERS[f"{kind}2C"]
            needed = {*inputs_at(Attached(limiter, place)).values()}
            assert needed <= inputs_for_limiters(model), place


# --- sheets and records ---------------------------------------------------------------------------


def test_a_sheet_names_each_parameter_once_within_its_range(limiter):
    for column in ("symbol", "meaning"):
        entries = [getattr(row, column) for row in limiter.sheet]
        assert len(set(entries)) == len(entries)
    for row in limiter.sheet:
        assert row.symbol.isidentifier()
        assert row.unit
        assert row.low <= row.typical <= row.high, row.symbol
    assert list(crossed_limits(typical(limiter.sheet))) == []


def test_a_drawing_is_narrow_and_shows_every_parameter(limiter):
    text = limiter.title + limiter.drawing
    assert max(map(len, limiter.drawing.splitlines())) <= 80
    for row in limiter.sheet:
        sides = row.symbol, row.symbol.replace("UEL", "OEL")  # drawn once for both
        ours = any(symbol in text for symbol in sides) or (
            row.symbol[0] in "PQ" and row.symbol[1:].isdigit()
        )
        assert ours, row.symbol


def test_a_record_lists_every_parameter_once(limiter):
    for record in limiter.records:
        symbols = [row.symbol for row in limiter.sheet]
        integers = [symbol for symbol, _ in record.icons if symbol in symbols]
        listed = [*integers, *record.cons, *dict(record.held)]
        assert sorted(listed) == sorted([*symbols, *dict(record.absent), *record.ignored])


def test_it_says_what_it_sees_and_where_it_acts(limiter):
    assert limiter.name[:3].lower() in LIMITER_KINDS
    assert set(limiter.inputs) <= set(SIGNALS)
    assert limiter.places
    assert set(limiter.places) <= set(PLACES)


@pytest.mark.long
def test_no_parameter_is_inert(limiter):
    values, away = (
        lively(limiter),
        {"SW1": 1.0, "TEN": 2.0, "TOFF": 0.1, "ITHOFF": 9.0, "VURMAX": 1.0, "VUCMAX": 1.0}
        | {"VSCLDB": 99.0, "TENOEL": 2.0, "TENUEL": 2.0},
    )
    fixed = {
        "UEL2C": {"SW1": 1.0},
        "SCL1C": {"SW1": 2.0, "SW2": 0.0},
        **{name: {"SW1": 1.0, "K1": -5.0, "C1": 1.0} for name in ("OEL2C", "SCL2C")},
    }

    def felt(changed):
        rng = np.random.default_rng(3)
        motions = []
        for size in (0.3, 3.0, 300.0):
            for k in range(25):
                q = size if k % 2 else -size
                x = Names(**{name: size * rng.normal() for name in limiter.states})
                u = Names(ifd=size, vt=rng.uniform(0.8, 1.2), p=rng.uniform(-1.0, 1.3), q=q)
                d = Names()
                outputs = each_output(limiter.equations(x, u, Names(**changed), d))
                slopes = [s if isinstance(s, Limited) else (s,) for s in vars(d).values()]
                motions.append([*outputs, *(float(part) for slope in slopes for part in slope)])
        return np.array(motions)

    bases = [values, values | fixed.get(limiter.name, {})]
    starts = [felt(base) for base in bases]
    for row in limiter.sheet:
        if limiter.name == "UEL2C" and row.symbol[0] in "PQ" and int(row.symbol[1:]) > 4:
            continue  # points that are not in use
        largest = 0.0
        for base, start in zip(bases, starts, strict=True):
            moved = away.get(row.symbol, 0.5 * base[row.symbol] or 1.0)
            with np.errstate(all="ignore"):
                change = np.abs(felt(base | {row.symbol: moved}) - start)
            largest = max(largest, float(np.nanmax(change)))
        assert largest > 1e-9, row.symbol


def test_a_time_constant_below_the_shortest_is_bypassed(limiter):
    p = lively(limiter) | {row.symbol: 0.0 for row in limiter.sheet if row.is_time and row.low == 0}
    u = Names(**{name: np.float64(AT_REST[name]) for name in SIGNALS})
    x = resting(limiter, Names(**p), u)
    slopes, _ = slopes_of(limiter, Names(**p), x, u)
    assert np.abs(np.array(slopes, dtype=float)).max() < 1e-12
    assert SHORTEST > 0.0
