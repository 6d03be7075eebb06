"""What exciters of several types share: regulator, alternator, supplies and PID."""

from typing import NamedTuple

from exfit.models.blocks import (
    Limited,
    Signal,
    clip,
    compound_source,
    field_ceiling,
    field_demand,
    inf,
    lag,
    larger,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    smaller,
    washout,
    where,
)
from exfit.models.sheet import shared

# the source of a regulator's power stage: terminal voltage alone, and a ceiling 1.5 times that
SOURCE = shared(SW1=1.0, KP=1.0, KI=0.0, XL=0.0, THETAP=0.0)
STATIC_SUPPLY = (*SOURCE, *shared(KC=0.05, VBMAX=1.5))
ALTERNATOR_SUPPLY = (*SOURCE, *shared(KC1=0.05, VBMAX=1.5))
# a PI with a small derivative, in front of the gain of the edition of 2005, which then stays fixed
PID = shared(KPR=1.0, KIR=0.5, KDR=0.02, TDR=0.1, VPIDMAX=1.0, VPIDMIN=-1.0)


Gate = tuple[Signal, Signal] | None  # its lower and upper limit


def gated(x: Signal, gate: Gate) -> Signal:
    """Hold a signal between the limits of a gate, where there is one."""
    return x if gate is None else clip(x, *gate)


class Routed(NamedTuple):
    """What passes the first gates, which limiter has them, and what the stabiliser keeps of vs."""

    signal: Signal
    by_oel: Signal
    by_uel: Signal
    own: Signal


def routed(vc: Signal, u: Signal, p: Signal) -> Routed:
    """Send vs to the voltage error (VOS = 1) or behind its gates (2); 3, or a limiter, keeps it."""
    at_error = where(p.VOS < 1.5, u.vs, 0.0)
    error = u.vref + u.vsum + at_error - vc
    raised = larger(error, u.vuel)
    free = (p.VOS < 2.5) & (u.voel >= raised) & (u.vuel <= error)
    at_gate = where(free, u.vs - at_error, 0.0)
    signal = smaller(raised, u.voel) + at_gate
    return Routed(signal, u.voel < raised, u.vuel > error, u.vs - at_error - at_gate)


def regulated(
    vfe: Signal, s: Signal, u: Signal, p: Signal, d: Signal, limiters: Signal = 0.0
) -> Signal:
    """Return VA: the error, less the rate feedback of VFE, behind a lead-lag and the lag KA."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + limiters - vc - vf, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(vl, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    return va


def error_less_feedback(
    TF: Signal, s: Signal, u: Signal, p: Signal, d: Signal, limiters: Signal = 0.0
) -> Signal:
    """Return the voltage error, with what limiters add, less the rate feedback of EFD."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, TF)
    return u.vref + u.vs + limiters - vc - vf


def alternator(
    drive: Signal,
    vfe: Signal,
    s: Signal,
    u: Signal,
    p: Signal,
    low: Signal = 0.0,
    high: Signal = inf,
) -> tuple[Signal, Limited]:
    """Return efd and the slope of VE: 1 / sTE between two limits, and a rectifier."""
    ve, slope = limited_integrator(drive - vfe, s.VE, p.TE, low, high)
    return rectifier(ve, p.KC * u.ifd), slope


def limited_alternator(
    drive: Signal, vfe: Signal, s: Signal, u: Signal, p: Signal
) -> tuple[Signal, Limited]:
    """Return efd and the slope of VE of an alternator between VEMIN and where VFE = VFEMAX."""
    return alternator(drive, vfe, s, u, p, p.VEMIN, field_ceiling(s.VE, vfe, p))


def alternator_rest(efd: Signal, u: Signal, p: Signal) -> tuple[Signal, Signal]:
    """Return the VE and the VFE of an alternator that holds efd."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    return ve, field_demand(ve, u.ifd, p)


def bridge(ve: Signal, load: Signal, ceiling: Signal) -> Signal:
    """Return what a loaded rectifier behind a source of VE gives, at most a ceiling."""
    return smaller(rectifier(ve, load), ceiling)


def first_source(KI: Signal, u: Signal, p: Signal) -> Signal:
    """Return the VE of a source: of the terminals (SW1 = 1), or independent of them (SW1 = 2)."""
    terminals = compound_source(u.vt, u.p, u.q, p.KP, KI, p.XL, p.THETAP)
    return where(p.SW1 < 1.5, terminals, p.KP)


def supply(load: Signal, u: Signal, p: Signal) -> Signal:
    """Return VB, what a loaded rectifier behind the source gives, at most VBMAX."""
    return bridge(first_source(p.KI, u, p), load, p.VBMAX)


def compound_supply(u: Signal, p: Signal) -> Signal:
    """Return VB, the voltage behind the rectifier of KP VT + j KI IT, and 1 where KP = KI = 0."""
    ve = compound_source(u.vt, u.p, u.q, p.KP, p.KI)
    return where((p.KP <= 0.0) & (p.KI <= 0.0), 1.0, rectifier(ve, p.KC * u.ifd))
