"""The static exciters of IEEE Std 421.5-2016 against their block diagrams, limits and gates."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagrams import (
    Transfer,
    alone,
    assert_is_diagram,
    lag,
    lead_lag,
    pid,
    rectified,
    standing,
    washout,
)
from oracle import drawn_values, lively_values, typical_values
from tiers import examples_of

from exfit.models import MODELS
from exfit.plants.parts import Names

EFD, IFD, VT = 1.3, 1.1, 0.9


# --- transfer functions ---------------------------------------------------------------------------


def bridge(p):
    """Return VB, on the first arc of the rectifier or at its ceiling."""
    source = p.KP * VT if p.SW1 < 1.5 else p.KP
    return min(rectified(source, p.KC * IFD), p.VBMAX)


# each gives the way from the voltage error to efd, and that of the measured voltage to the error


def st1c(p):
    forward = lead_lag(p.TC, p.TB) * lead_lag(p.TC1, p.TB1) * lag(p.KA, p.TA)
    return forward.fed_back(washout(p.KF, p.TF)), lag(1.0, p.TR)


def st2c(p):
    regulator = pid(p.KPR, p.KIR, p.KDR, p.TDR) * lag(p.KA, p.TA)
    vb = min(rectified(p.KP * VT, p.KC * IFD), p.VBMAX)
    forward = regulator * Transfer([vb], [p.TE, p.KE])
    return forward.fed_back(washout(p.KF, p.TF)), lag(1.0, p.TR)


def st3c(p):
    regulator = pid(p.KPR, p.KIR, p.KDR, p.TDR) * lead_lag(p.TC, p.TB) * lag(p.KA, p.TA)
    inner = lag(p.KM * bridge(p), p.TM)
    return regulator * inner.fed_back(p.KG if p.KG * EFD < p.VGMAX else 0.0), lag(1.0, p.TR)


def st4c(p):
    inner = pid(p.KPM, p.KIM) * lag(bridge(p), p.TA)
    feedback = lag(p.KG, p.TG) if p.KG * EFD < p.VGMAX else 0.0
    return pid(p.KPR, p.KIR) * inner.fed_back(feedback), lag(1.0, p.TR)


def st5c(p):
    chain = lead_lag(p.TC1, p.TB1) * lead_lag(p.TC2, p.TB2) * lag(p.KR, p.T1)
    return chain, lag(1.0, p.TR)


def st6c(p):
    # VR = (KFF + KM) VA - KM KG/(1+sTG) EFD
    inner = lag(bridge(p), p.TA).fed_back(lag(p.KM * p.KG, p.TG))
    return pid(p.KPA, p.KIA, p.KDA, p.TDA) * (p.KFF + p.KM) * inner, lag(1.0, p.TR)


def st7c(p):
    fired = lag(1.0, p.TA)
    chain = p.KPA * lead_lag(p.TC, p.TB) * fired.fed_back(lag(-p.KIA, p.TIA))
    return chain, lag(1.0, p.TR) * lead_lag(p.TG, p.TF)


def st8c(p):
    source = p.KP * VT if p.SW1 < 1.5 else p.KP
    vb1 = min(rectified(source, p.KC1 * IFD), p.VB1MAX)
    return pid(p.KPR, p.KIR) * pid(p.KPA, p.KIA) * lag(p.KA * vb1, p.TA), lag(1.0, p.TR)


def st9c(p):
    derivative = washout(p.TCD, p.TBD) if p.ZA == 0.0 else 0.0
    chain = pid(p.KA, p.KA / p.TA) * lag(p.KAS * bridge(p), p.TAS)
    return chain, lag(1.0, p.TR) * (lag(1.0, 0.0) + derivative)


def st10c(p):
    chain = lead_lag(p.TC1, p.TB1) * lead_lag(p.TC2, p.TB2) * lag(p.KR * bridge(p), p.T1)
    return chain, lag(1.0, p.TR)


DIAGRAMS = {
    "ST1C": st1c,
    "ST2C": st2c,
    "ST3C": st3c,
    "ST4C": st4c,
    "ST5C": st5c,
    "ST6C": st6c,
    "ST7C": st7c,
    "ST8C": st8c,
    "ST9C": st9c,
    "ST10C": st10c,
}
INDEPENDENT = {"SW1": 2.0}
CASES = [
    *((name, {}) for name in DIAGRAMS),
    *((name, INDEPENDENT) for name in ("ST3C", "ST4C", "ST6C", "ST8C", "ST9C", "ST10C")),
    ("ST3C", {"VGMAX": 0.5, "KA": 5.0}),  # nothing is fed back
    ("ST9C", {"ZA": 0.0}),
    ("ST10C", {"VOS": 3.0}),
    ("ST4C", {"TA": 0.0}),
    ("ST4C", {"TG": 0.0}),
    ("ST4C", {"TA": 0.0, "TG": 0.0}),
    ("ST4C", {"TA": 0.0, "TG": 0.0, "VGMAX": 0.05}),  # nothing is fed back
]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(("name", "changes"), CASES)
def test_the_linear_exciter_is_its_block_diagram(name, changes, seed):
    values = drawn_values(name, seed) | changes
    forward, measured = DIAGRAMS[name](SimpleNamespace(**values))
    ways = {"vref": forward, "vc1": -1.0 * measured * forward}
    assert_is_diagram(name, values, ways, vt=VT)


# --- ceilings and floors --------------------------------------------------------------------------


def limits(name, p):
    """Return the floor and the ceiling of efd by the diagram."""
    if name == "ST1C":
        return VT * p.VRMIN, VT * p.VRMAX - p.KC * IFD
    if name == "ST2C":
        return 0.0, p.EFDMAX
    if name == "ST3C":
        return bridge(p) * p.VMMIN, bridge(p) * p.VMMAX
    if name == "ST8C":
        vb1 = rectified(p.KP * VT, p.KC1 * IFD)
        return vb1 * p.VRMIN, vb1 * p.VRMAX
    if name == "ST5C":  # KC IFD is taken before, the supply limits behind
        return max(p.VRMIN - p.KC * IFD, VT * p.VRMIN), min(p.VRMAX - p.KC * IFD, VT * p.VRMAX)
    if name == "ST7C":
        return VT * p.VRMIN, VT * p.VRMAX
    if name == "ST9C":
        return bridge(p) * p.KAS * p.VRMIN, bridge(p) * p.KAS * p.VRMAX
    if name == "ST10C":
        return bridge(p) * p.VRMIN, bridge(p) * p.VRMAX
    if name == "ST6C":
        return bridge(p) * max(p.VRMIN, p.VMMIN), bridge(p) * min(p.VRMAX, p.VMMAX)
    return bridge(p) * max(p.VMMIN, p.VAMIN), bridge(p) * min(p.VMMAX, p.VAMAX)


LARGE = {
    "ST1C": {"VAMAX": 99.0, "VAMIN": -99.0},
    "ST2C": {"EFDMAX": 2.5, "KF": 0.0, "VRMIN": -1.0},
    "ST3C": {"VMMAX": 0.5},
    "ST4C": {"VRMAX": 9.0, "VRMIN": -9.0, "KIM": 20.0},
    "ST5C": {},
    "ST6C": {"KG": 0.1},
    "ST7C": {"VMAX": 9.0, "VMIN": -9.0},
    "ST8C": {},
    "ST9C": {},
    "ST10C": {},
}


@pytest.mark.parametrize(("name", "changes"), examples_of(LARGE.items(), 3))
def test_a_large_step_reaches_the_limits_of_the_diagram_and_never_passes_them(name, changes):
    values = lively_values(name) | changes
    floor, ceiling = limits(name, SimpleNamespace(**values))
    _, efd = alone(name, values, vref=[3.0, -3.0], vt=VT, time=3.0, step=1e-3)
    assert efd[-1] == pytest.approx([ceiling, floor], rel=1e-9)
    assert efd.max() <= ceiling + 1e-9
    assert efd.min() >= floor - 1e-9


# --- limiters and the stabiliser ------------------------------------------------------------------


@pytest.mark.parametrize("name", DIAGRAMS)
def test_what_limiters_add_is_a_step_of_the_reference(name):
    values = lively_values(name)
    _, by_limiter = alone(name, values, held={"vsum": 0.01}, step=1e-3)
    _, by_reference = alone(name, values, vref=0.01, step=1e-3)
    assert by_limiter == pytest.approx(by_reference, abs=1e-12)
    assert np.ptp(by_limiter) > 1e-3


def gate_of(name, error, p, u):
    """Return the value of a gate that stands for a voltage error."""
    if name == "ST7C":
        return u.vc1 + error
    return p.KA * error if name == "ST9C" else error


# nothing is in the way of the gate, and what it has of its own is that of the regulator
OPEN = {"VIMAX": 9.0, "VIMIN": -9.0, "VMAX": 9.0, "VMIN": -9.0, "TR": 0.0, "KF": 0.0, "KU": 0.0}
SWITCHED = ("TC1", "TB1", "TC2", "TB2")


@pytest.mark.parametrize("name", [name for name in DIAGRAMS if name != "ST8C"])
def test_a_gate_at_the_input_replaces_the_error(name):
    """The step of the reference that gives this error does the same; OEL has the last word."""
    values = lively_values(name)
    values |= {symbol: value for symbol, value in OPEN.items() if symbol in values}
    if name in ("ST5C", "ST10C"):
        values |= {f"T{gate}{time[1:]}": values[time] for gate in "UO" for time in SWITCHED}
    if name == "ST2C":  # its gates are behind the PID
        values |= {"KPR": 1.0, "KIR": 0.0, "KDR": 0.0}
    u, p, _ = standing(name, values)
    cases = [({"vuel": 0.08}, 0.08), ({"voel": -0.03}, -0.03)]
    cases += [({"vuel": 0.08, "voel": 0.02}, 0.02)]
    # OEL of ST9C is at the output
    for errors, error in cases[:1] if name == "ST9C" else cases:
        held = {gate: gate_of(name, value, p, u) for gate, value in errors.items()}
        _, gated = alone(name, values, held=held, time=0.2, step=1e-3)
        _, stepped = alone(name, values, vref=error - (u.vref - u.vc1), time=0.2, step=1e-3)
        assert gated == pytest.approx(stepped, abs=1e-9)
        assert np.ptp(gated) > 1e-3


@pytest.mark.long
@pytest.mark.parametrize(("limiter", "gate"), [("vuel", "U"), ("voel", "O")])
@pytest.mark.parametrize("name", ["ST5C", "ST10C"])
def test_other_lead_lags_take_over_while_a_limiter_has_the_gate(name, limiter, gate):
    values = lively_values(name)
    _, p, x = standing(name, values)
    change = 1e-6 if limiter == "vuel" else -1e-6
    TC1, TB1, TC2, TB2 = (getattr(p, f"T{gate}{time[1:]}") for time in SWITCHED)
    gain = p.KR * (rectified(p.KP, p.KC * IFD) if name == "ST10C" else 1.0)
    chain = lead_lag(TC1, TB1) * lead_lag(TC2, TB2) * lag(gain, p.T1)
    times, efd = alone(name, values, held={limiter: x.VL1 + change}, step=2.5e-4)
    expected = change * chain.step(times)
    assert np.abs(efd - EFD - expected).max() < 1e-6 * np.abs(expected).max() + 1e-12


@pytest.mark.long
def test_st9c_changes_the_time_of_its_integral_while_uel_has_the_gate():
    """To the share KU times what UEL adds."""
    for KU, share in ((1e5, 1.0), (10.0, 0.5), (0.0, 0.0)):
        values = lively_values("ST9C") | {"KU": KU, "TAS": 0.0, "VRMAX": 9.0}
        times, efd = alone("ST9C", values, held={"vuel": 0.05}, vt=VT, time=0.2, step=1e-3)
        p = SimpleNamespace(**values)
        rise = 0.05 * (1.0 + times * ((1.0 - share) / p.TA + share / p.TAUEL))
        assert efd - EFD == pytest.approx(p.KAS * bridge(p) * rise, abs=1e-9)


@pytest.mark.parametrize("name", ["ST1C", "ST4C", "ST6C", "ST7C", "ST10C"])
def test_a_gate_at_the_output_is_the_output(name):
    values = lively_values(name) | {"T1" if name == "ST10C" else "TA": 0.0}
    vb = bridge(SimpleNamespace(**values)) if "SW1" in values else 1.0
    for held, output in (
        ({"vuel_out": 0.5}, 0.5),
        ({"voel_out": 0.1}, 0.1),
        ({"vuel_out": 0.5, "voel_out": 0.1}, 0.1),
    ):
        _, efd = alone(name, values, held=held, efd=0.3 * vb, vt=VT, time=0.1, step=1e-3)
        assert efd == pytest.approx(vb * output)


@pytest.mark.long
def test_oel_takes_the_output_of_the_regulator_of_st9c():
    values = lively_values("ST9C") | {"TAS": 0.0}
    p = SimpleNamespace(**values)
    _, efd = alone("ST9C", values, held={"voel": 0.1}, vt=VT, time=0.1, step=1e-3)
    assert efd == pytest.approx(0.1 * p.KAS * bridge(p))


@pytest.mark.long
def test_the_field_current_loop_of_st8c_feeds_the_current_back_and_has_the_gates():
    """A step of the current is taken through KF / (1 + sTF), and a gate holds what is left."""
    values = drawn_values("ST8C", 3) | {"KC1": 0.0}
    p = SimpleNamespace(**values)
    loop = pid(p.KPA, p.KIA) * lag(p.KA * p.KP * VT, p.TA)
    times, efd = alone("ST8C", values, held={"ifd": IFD + 1e-6}, vt=VT, step=2.5e-4)
    expected = -1e-6 * (lag(p.KF, p.TF) * loop).step(times)
    assert np.abs(efd - EFD - expected).max() < 1e-6 * np.abs(expected).max() + 1e-12
    for gate, value in (("vuel", 1e-6), ("voel", -1e-6)):
        times, efd = alone("ST8C", values, held={gate: value}, vt=VT, step=2.5e-4)
        expected = value * loop.step(times)
        assert np.abs(efd - EFD - expected).max() < 1e-6 * np.abs(expected).max() + 1e-12


@pytest.mark.long
def test_the_second_source_of_st8c_is_added_on_load():
    values = lively_values("ST8C")
    u, p, x = standing("ST8C", values, efd=2.0, vt=0.97, ifd=2.1, p=0.8, q=0.35)
    current = abs(complex(0.8, -0.35) / 0.97)
    vb2 = min(rectified(p.KI2 * current, p.KC2 * u.ifd), p.VB2MAX)
    vb1 = rectified(p.KP * u.vt, p.KC1 * u.ifd)
    assert x.VR * vb1 + vb2 == pytest.approx(2.0, rel=1e-12)
    assert vb2 > 0.1


@pytest.mark.long
def test_the_field_current_limit_of_st6c_holds_its_output_and_its_pid():
    """17.33 (KCI ILR - IFD) of the standard's data; the PID does not wind up beyond it."""
    values = lively_values("ST6C") | {"TG": 0.02, "KG": 0.0, "TA": 0.0, "VMMAX": 99.0, "KFF": 0.5}
    p = SimpleNamespace(**values)
    ifd = p.KCI * p.ILR - 0.05
    level = p.KLR * 0.05
    _, up = alone("ST6C", values, vref=0.5, ifd=ifd, vt=VT, efd=0.5, time=2.0, step=1e-3)
    # VR = (KFF + KM) VA would be 1.5 times as high
    assert up[-1] == pytest.approx(level * rectified(p.KP * VT, p.KC * ifd), rel=1e-9)

    def back(t):
        return 0.5 if t < 2.0 else -0.5

    _, returned = alone("ST6C", values, vref=back, ifd=ifd, vt=VT, efd=0.5, time=2.2, step=1e-3)
    assert returned[-1] < up[-1]


@pytest.mark.long
def test_the_stabiliser_of_st1c_is_added_where_vos_says():
    """At the error it is a step of the reference; behind it it is added to VA."""
    values = lively_values("ST1C")
    _, by_reference = alone("ST1C", values, vref=0.01, step=1e-3)
    _, at_error = alone("ST1C", values, held={"vs": 0.01}, step=1e-3)
    assert at_error == pytest.approx(by_reference, abs=1e-12)
    _, behind = alone("ST1C", values | {"VOS": 2.0}, held={"vs": 0.01}, step=1e-3)
    assert behind[0] - EFD == pytest.approx(0.01, abs=1e-12)


@pytest.mark.long
def test_the_stabiliser_of_st10c_acts_where_vos_says():
    """By lead-lags of its own it does the same; a limiter sends it there from behind its gates."""
    values = lively_values("ST10C") | {"TR": 0.0, "VRSMAX": 0.2}
    vb = rectified(values["KP"], values["KC"] * IFD)
    u, _, _ = standing("ST10C", values)
    gate = {"vuel": u.vref - u.vc1}
    _, expected = alone("ST10C", values, vref=1e-5)
    for VOS in (1.0, 2.0, 3.0):
        placed = values | {"VOS": VOS}
        _, got = alone("ST10C", placed, held={"vs": 1e-5})
        assert got == pytest.approx(expected, abs=1e-12)
        _, gated = alone("ST10C", placed, vref=-0.01, held={"vs": 1e-5} | gate)
        # at the error it is part of what the gate replaces
        apart = gated - alone("ST10C", placed, vref=-0.01, held=gate)[1]
        assert apart == pytest.approx(0.0 if VOS == 1.0 else expected - EFD, abs=1e-12)
    _, got = alone("ST10C", values | {"VOS": 3.0}, held={"vs": 1.0})
    assert got.max() - EFD == pytest.approx(0.2 * vb)


@pytest.mark.long
def test_the_field_voltage_loop_of_st4c_closes_on_itself():
    """The PI sees the very field voltage that it gives, whatever limit or gate cuts it."""
    rng = np.random.default_rng(11)
    values = typical_values("ST4C") | {"TA": 0.0, "TG": 0.0, "VMMAX": 0.5, "VMMIN": -0.3}
    for _ in range(300):
        u, p, x = standing("ST4C", values | {"VGMAX": rng.choice([0.05, 9.0])}, efd=EFD)
        p.KPM, p.KG, x.VR, x.VM = rng.uniform([0.0, 0.0, -3.0, -0.5], [5.0, 2.0, 3.0, 0.5])
        u.voel_out, u.vuel_out = rng.choice([np.inf, 0.1]), rng.choice([-np.inf, 0.05])
        d = Names()
        efd = MODELS["ST4C"].equations(x, u, p, d)
        vr = np.clip(p.KPR * (u.vref - u.vc1) + x.VR, p.VRMIN, p.VRMAX)
        inner = p.KPM * (vr - min(p.KG * efd, p.VGMAX)) + x.VM
        vm = min(max(np.clip(inner, p.VMMIN, p.VMMAX), u.vuel_out), u.voel_out)
        vb = min(rectified(p.KP * u.vt, p.KC * u.ifd), p.VBMAX)
        assert efd == pytest.approx(vb * np.clip(vm, p.VAMIN, p.VAMAX), abs=1e-12)


# --- records --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DIAGRAMS)
def test_a_record_lists_every_parameter_once(name):
    own = {row.symbol for row in MODELS[name].sheet}
    for record in MODELS[name].records:
        integers = [symbol for symbol, _ in record.icons]
        listed = [*integers, *record.cons]
        assert len(set(listed)) == len(listed)
        assert own <= set(listed)
        assert set(listed) - own <= {*integers, *record.ignored, *dict(record.absent)}
