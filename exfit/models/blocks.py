"""The blocks of IEEE Std 421.5, and what the families of exciters share.

A block with one state x reads ``y, d.X = block(u, x, ...)``: its output and the slope of its state.
A time constant below ``SHORTEST`` bypasses a block: it leaves the gain, and a state that stays put.
A block with a non-windup limit returns its slope as ``Limited``: held at the limit, and the state
put back on it after every step, so that a response has no jags where a step ends beyond the limit.
"""

from math import inf as inf
from math import radians
from math import sqrt as root
from typing import NamedTuple

from exfit.engine.trace import Signal as Signal
from exfit.engine.trace import clip as clip
from exfit.engine.trace import cos as cos
from exfit.engine.trace import exp as exp
from exfit.engine.trace import is_zero
from exfit.engine.trace import larger as larger
from exfit.engine.trace import log as log
from exfit.engine.trace import sin as sin
from exfit.engine.trace import smaller as smaller
from exfit.engine.trace import sqrt as sqrt
from exfit.engine.trace import where as where

SHORTEST = 1e-4  # s; a faster lag is invisible in any record, and costs only sub-steps
SQRT3 = root(3.0)
RADIANS = radians(1.0)  # per degree


class Limited(NamedTuple):
    """The slope of a state that stops at its limits."""

    slope: Signal
    low: Signal
    high: Signal


def modulus(a: Signal, b: Signal) -> Signal:
    """Return sqrt(a^2 + b^2); where b is not there at all, a, which is then positive."""
    return a if is_zero(b) else sqrt(a * a + b * b)


def rate(T: Signal) -> Signal:
    """Return 1 / T, zero for a bypassed block."""
    return where(T < SHORTEST, 0.0, 1.0 / where(T < SHORTEST, 1.0, T))


def lag(u: Signal, x: Signal, K: Signal, T: Signal) -> tuple[Signal, Signal]:
    """K / (1 + sT)."""
    return where(T < SHORTEST, K * u, x), (K * u - x) * rate(T)


def lead_lag(u: Signal, x: Signal, TC: Signal, TB: Signal) -> tuple[Signal, Signal]:
    """(1 + sTC) / (1 + sTB); the state is u seen through the lag TB."""
    slope = (u - x) * rate(TB)
    return where(TB < SHORTEST, u, x + TC * slope), slope


def washout(u: Signal, x: Signal, K: Signal, T: Signal) -> tuple[Signal, Signal]:
    """sK / (1 + sT); the state is u seen through the lag T, so at rest x = u."""
    slope = (u - x) * rate(T)
    return K * slope, slope


def high_pass(u: Signal, x: Signal, T: Signal) -> tuple[Signal, Signal]:
    """sT / (1 + sT), or 1 where T = 0: a washout that is left out; at rest x = u."""
    return where(T < SHORTEST, u, u - x), (u - x) * rate(T)


def washout_or_lag(
    u: Signal, x: Signal, K: Signal, TN: Signal, TD: Signal
) -> tuple[Signal, Signal]:
    """sK TN / (1 + sTD), or K / (1 + sTD) where TN = 0; the state is K u through the lag TD."""
    slope = (K * u - x) * rate(TD)
    return where(TN < SHORTEST, x, TN * slope), slope


def is_curved(A1: Signal, A2: Signal) -> Signal:
    """Test that neither pole of 1 / (1 + s A1 + s^2 A2) is faster than ``SHORTEST``."""
    return SHORTEST * larger(A1, SHORTEST) < A2


def second_order(
    u: Signal, x: Signal, v: Signal, A1: Signal, A2: Signal
) -> tuple[Signal, Signal, Signal]:
    """1 / (1 + s A1 + s^2 A2); v is the slope of x; return the output and both slopes.

    Where A2 is so small that one of its poles is faster than ``SHORTEST``, it is the lag A1.
    """
    curved = is_curved(A1, A2)
    bend = (u - x - A1 * v) / where(curved, A2, 1.0)
    y = where(curved | (A1 >= SHORTEST), x, u)
    return y, where(curved, v, (u - x) * rate(A1)), where(curved, bend, 0.0)


def second_order_lead(
    u: Signal, x: Signal, v: Signal, B1: Signal, B2: Signal, A1: Signal, A2: Signal
) -> tuple[Signal, Signal, Signal]:
    """(1 + s B1 + s^2 B2) / (1 + s A1 + s^2 A2), with the states of ``second_order``.

    Where A2 = 0 leaves the lag A1, B2 is left out; where A1 = A2 = 0 the whole block is.
    """
    y, slope, bend = second_order(u, x, v, A1, A2)
    return y + B1 * slope + B2 * bend, slope, bend


def integrator(u: Signal, x: Signal, T: Signal = 1.0) -> tuple[Signal, Signal]:
    """1 / sT; T is never zero."""
    return x, u / T


def limited(slope: Signal, x: Signal, low: Signal, high: Signal) -> Limited:
    """Hold a slope while it would push x beyond a limit that it has reached."""
    outward = ((x >= high) & (slope > 0.0)) | ((x <= low) & (slope < 0.0))
    return Limited(where(outward, 0.0, slope), low, high)


def limited_lag(
    u: Signal, x: Signal, K: Signal, T: Signal, low: Signal, high: Signal
) -> tuple[Signal, Limited]:
    """K / (1 + sT) with a non-windup limit."""
    y = clip(where(T < SHORTEST, K * u, x), low, high)
    return y, limited((K * u - x) * rate(T), x, low, high)


def limited_lead_lag(
    u: Signal, x: Signal, TC: Signal, TB: Signal, low: Signal, high: Signal
) -> tuple[Signal, Limited]:
    """(1 + sTC) / (1 + sTB) with the non-windup limit of IEEE Std 421.5-2005, annex E.

    The state is that of ``lead_lag`` between the limits; at a limit it follows the limited output
    with the lag TC, so that it never runs away. With TC = 0 this is ``limited_lag``.
    """
    lead = TC * rate(TB)
    y = clip(where(TB < SHORTEST, u, x + lead * (u - x)), low, high)
    at_once = TC < SHORTEST
    follows = where(TB < SHORTEST, 0.0, (y - x) * rate(TC))
    slope = where(at_once, (u - x) * rate(TB), follows)
    return y, limited(slope, x, where(at_once, low, -inf), where(at_once, high, inf))


def limited_integrator(
    u: Signal, x: Signal, T: Signal, low: Signal = -inf, high: Signal = inf
) -> tuple[Signal, Limited]:
    """1 / sT with a non-windup limit; T is never zero."""
    return clip(x, low, high), limited(u / T, x, low, high)


def pid(
    u: Signal,
    integral: Signal,
    derivative: Signal,
    KP: Signal,
    KI: Signal,
    KD: Signal,
    TD: Signal,
    low: Signal = -inf,
    high: Signal = inf,
) -> tuple[Signal, Signal, Signal]:
    """KP + KI / s + sKD / (1 + sTD), limited; return the output and the slopes of both states.

    Without a lag, TD = 0, there is no derivative: it is a PI. The integral is frozen while it would
    push the output further beyond its limit.
    """
    steep, washed = washout(u, derivative, KD, TD)
    y = KP * u + integral + steep
    slope = KI * u
    outward = ((y >= high) & (slope > 0.0)) | ((y <= low) & (slope < 0.0))
    return clip(y, low, high), where(outward, 0.0, slope), washed


def pi_and_derivative(
    u: Signal,
    integral: Signal,
    derivative: Signal,
    KP: Signal,
    KI: Signal,
    KD: Signal,
    TD: Signal,
    low: Signal,
    high: Signal,
) -> tuple[Signal, Signal, Signal]:
    """Do as a PID that limits KP + KI / s by itself, and its sum with the derivative again."""
    steep, washed = washout(u, derivative, KD, TD)
    y, slope = pi(u, integral, KP, KI, low, high)
    return clip(y + steep, low, high), slope, washed


def pi(
    u: Signal, integral: Signal, KP: Signal, KI: Signal, low: Signal = -inf, high: Signal = inf
) -> tuple[Signal, Signal]:
    """KP + KI / s, limited as a PID is; return the output and the slope of the integral."""
    y, slope, _ = pid(u, integral, 0.0, KP, KI, 0.0, 1.0, low, high)
    return y, slope


def pi_rest(y: Signal, KP: Signal, KI: Signal) -> tuple[Signal, Signal]:
    """Return the input and the integral that hold a PI at y, whichever of its gains is zero."""
    idle = zero(KI)
    return where(idle, y / where(idle, KP, 1.0), 0.0), where(idle, 0.0, y)


def regulator_output(s: Signal, p: Signal, vl: Signal, gain: Signal, taken: Signal = 0.0) -> Signal:
    """Return the output of KA / (1 + sTA), before any limit, from which a rate feedback is taken.

    With TA = 0 output and feedback wait for each other; that loop is solved here: ``vl`` is what
    the regulator would get without the feedback, ``gain`` how much of a step gets there at once,
    ``taken`` what is subtracted from the output before the feedback takes it. A limit in the loop
    may be put on the result: the loop is monotonous, so that a limit holds there as it does here.
    """
    loop = p.KA * gain * p.KF * rate(p.TF)
    prompt = (p.KA * vl + loop * (s.VF + taken)) / (1.0 + loop)
    return where(p.TA < SHORTEST, prompt, s.VA)


def closed(error: Signal, gain: Signal, held: Signal, back: Signal) -> Signal:
    """Close a loop without a lag: the error less ``back`` y.

    ``gain`` times what is left, plus ``held``, is y. A limit of either may be put on the result,
    since the loop is monotonous.
    """
    return (error - back * held) / (1.0 + back * gain)


def rectifier(ve: Signal, load: Signal) -> Signal:
    """Return VE FEX(IN), the voltage behind a rectifier that is loaded with IN = load / VE.

    IEEE Std 421.5-2005, annex D, multiplied out: there is nothing to divide by at VE = 0. The exact
    constants 1/sqrt(3), sqrt(3)/4 and sqrt(3) make the arcs meet; with the printed 0.577, 0.433 and
    1.732 they miss each other by 1.6e-4, which a derivative sees.
    """
    sloping = where(
        load < 0.75 * ve, sqrt(0.75 * ve * ve - load * load), larger(SQRT3 * (ve - load), 0.0)
    )
    loaded = where(load <= SQRT3 / 4.0 * ve, ve - load / SQRT3, sloping)
    return where(load < 0.0, ve, loaded)


def rectifier_supply(efd: Signal, load: Signal) -> Signal:
    """Return the VE that gives ``efd = rectifier(VE, load)``, arc by arc in closed form."""
    first = efd + load / SQRT3
    second = sqrt((efd * efd + load * load) / 0.75)
    loaded = where(
        load <= SQRT3 / 4.0 * first, first, where(load < 0.75 * second, second, efd / SQRT3 + load)
    )
    return where(load < 0.0, efd, loaded)


class Saturation(NamedTuple):
    """VX = E SE(E) of an exciter or a machine, and its slope dVX/dE."""

    vx: Signal
    slope: Signal


def quadratic(e: Signal, E1: Signal, SE1: Signal, E2: Signal, SE2: Signal) -> Saturation:
    """VX = B (E - A)^2 through two points, zero below the knee A (as in PSS/E).

    The points may come in either order; both SE zero is a machine without saturation, wherever
    they lie.
    """
    none = (SE1 <= 0.0) & (SE2 <= 0.0)
    swapped = E1 > E2
    low, high = where(swapped, E2, E1), where(swapped, E1, E2)
    vx_low, vx_high = where(swapped, E2 * SE2, E1 * SE1), where(swapped, E1 * SE1, E2 * SE2)
    ratio = sqrt(vx_low / where(vx_high > 0.0, vx_high, 1.0))
    knee = (low - ratio * high) / (1.0 - ratio)
    gain = vx_high / where(none, 1.0, (high - knee) * (high - knee))
    above = larger(e - knee, 0.0)
    return Saturation(gain * above * above, 2.0 * gain * above)


def growth(E1: Signal, y1: Signal, E2: Signal, y2: Signal) -> Signal:
    """Return B of y = A exp(B E) through two points, zero where both lie at zero."""
    none = (y1 <= 0.0) & (y2 <= 0.0)
    return log(where(none, 1.0, y2) / where(none, 1.0, y1)) / where(none, 1.0, E2 - E1)


def exponential(e: Signal, E1: Signal, SE1: Signal, E2: Signal, SE2: Signal) -> Saturation:
    """VX = A exp(B E) through two points; note that it is not zero at E = 0."""
    B = growth(E1, E1 * SE1, E2, E2 * SE2)
    vx = E1 * SE1 * exp(B * (e - E1))
    return Saturation(vx, B * vx)


def exponential_se(e: Signal, E1: Signal, SE1: Signal, E2: Signal, SE2: Signal) -> Saturation:
    """VX = E SE with SE = A exp(B E) through two points."""
    B = growth(E1, SE1, E2, SE2)
    se = SE1 * exp(B * (e - E1))
    return Saturation(e * se, se * (1.0 + B * e))


def exciter_demand(efd: Signal, KE: Signal, p: Signal) -> Signal:
    """Return KE EFD + VX(EFD), the field signal that holds an exciter without rectifier at EFD."""
    return KE * efd + p.saturation(efd).vx


def exciter(
    vr: Signal, efd: Signal, KE: Signal, p: Signal, low: Signal = -inf, high: Signal = inf
) -> tuple[Signal, Limited]:
    """1 / sTE with KE EFD + VX(EFD) fed back: an exciter without a rectifier."""
    return limited_integrator(vr - exciter_demand(efd, KE, p), efd, p.TE, low, high)


def field_demand(ve: Signal, ifd: Signal, p: Signal) -> Signal:
    """Return VFE, the field signal that holds an alternator at VE while its rectifier gives IFD."""
    return exciter_demand(ve, p.KE, p) + p.KD * ifd


def field_ceiling(ve: Signal, vfe: Signal, p: Signal) -> Signal:
    """Return the VE at which VFE reaches VFEMAX, seen from a VE near it.

    The standard writes (VFEMAX - KD IFD) / (KE + SE(VE)); both are VE exactly where VFE = VFEMAX.
    This one is a Newton step, so that a state put back on it does not hunt around the limit.
    """
    # inverted apart: that is done while IFD, and with it VFE, is still being computed
    inverse = 1.0 / (p.KE + p.saturation(ve).slope)
    return ve + (p.VFEMAX - vfe) * inverse


def zero(x: Signal) -> Signal:
    """Test for a value of 0, which in some data means: to be computed."""
    return (x <= 0.0) & (x >= 0.0)


def commutator_start(efd: Signal, p: Signal, x: Signal) -> Signal:
    """Write KE0, VRMAX0 and VRMIN0, the values in use, into x and return the VR that holds EFD.

    They are computed as PSS/E does where KE and VRMAX are given as 0.

    VRMAX = 0: the VR that holds the higher of E1, E2 (with KE only where KE > 0), and
    VRMIN = -VRMAX. KE = 0, self-excited: such that VR starts at VRMAX / 10.
    """
    high = larger(p.E1, p.E2)
    computed = zero(p.VRMAX)
    x.VRMAX0 = where(computed, exciter_demand(high, larger(p.KE, 0.0), p), p.VRMAX)
    x.VRMIN0 = where(computed, -x.VRMAX0, p.VRMIN)
    x.KE0 = where(zero(p.KE), (x.VRMAX0 / 10.0 - p.saturation(efd).vx) / efd, p.KE)
    return exciter_demand(efd, x.KE0, p)


def compound_source(
    vt: Signal, p: Signal, q: Signal, KP: Signal, KI: Signal, XL: Signal = 0.0, THETAP: Signal = 0.0
) -> Signal:
    """Return VE = |KP VT + j (KI + KP XL) IT|, where KP is at THETAP degrees.

    IT = (p - j q) / VT, with VT on the real axis. Everything is turned back by THETAP, so that on
    open circuit no angle is left and VE = KP VT.
    """
    theta = THETAP * RADIANS
    active, reactive = p / vt, q / vt
    cosine, sine = cos(theta), sin(theta)
    along = KP * (vt + XL * reactive) + KI * (cosine * reactive + sine * active)
    across = KP * XL * active + KI * (cosine * active - sine * reactive)
    return modulus(along, across)


def source_voltage(u: Signal, p: Signal) -> Signal:
    """Return VB, what a compound source gives behind its rectifier, at most VBMAX."""
    ve = compound_source(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
    return smaller(rectifier(ve, p.KC * u.ifd), p.VBMAX)
