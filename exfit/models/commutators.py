"""What DC1 and DC2 of all years share: a continuous regulator on a commutator exciter."""

from math import inf

from exfit.models.blocks import (
    Signal,
    commutator_start,
    exciter,
    lag,
    lead_lag,
    limited_lag,
    washout,
)

COMMUTATOR_STATES = "VC VL VR EFD VF"
COMMUTATOR_SETPOINTS = "KE0 VRMAX0 VRMIN0"


def regulator_input(s: Signal, u: Signal, p: Signal, d: Signal, limiters: Signal = 0.0) -> Signal:
    """Return the voltage error, with what limiters add, behind the lead TC and the lag TB."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + limiters - vc - vf, s.VL, p.TC, p.TB)
    return vl


def excited(
    gated: Signal,
    supply: Signal,
    s: Signal,
    p: Signal,
    d: Signal,
    low: Signal = 0.0,
    high: Signal = inf,
) -> Signal:
    """Return EFD between ``low`` and ``high``; VR is limited in proportion to ``supply``."""
    floor, ceiling = supply * s.VRMIN0, supply * s.VRMAX0
    vr, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, floor, ceiling)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p, low, high)
    return efd


def commutator_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    start = commutator_start(efd, p)
    x.KE0, x.VRMAX0, x.VRMIN0 = start.KE, start.VRMAX, start.VRMIN
    error = start.vr / p.KA
    x.VC, x.VL, x.VR, x.EFD, x.VF = u.vc1, error, start.vr, efd, efd
    return u.vc1 + error - u.vs
