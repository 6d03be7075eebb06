"""AC2A: alternator exciter with high initial response (IEEE Std 421.5-2005, 6.2).

                              VAMAX                UEL  OEL  VRMAX
vref + vs ──►(+)─►[1 + sTC]──►[  KA  ]─►(+)─►[KB]─►HV──►LV─►[clip]─┐
           -▲   ▲-[1 + sTB]   [1+sTA]  -▲                   VRMIN  │ VR
            │   │             VAMIN     │            VE <= VEMAX   ▼
vc1 ►[  1  ]┘   │                       │    ┌─ VE ─┬─[  1  ]◄────(+)
     [1+sTR]    │                       │    ▼      │ [ sTE ]     -▲
                │                efd ◄──┼───(x)     │ VE >= 0      │
                │                       │    ▲      │              │
                │                       │   FEX     └──► VFE ──────┤
                │                       │    ▲                     │
                │ [  sKF  ]             │   KC IFD / VE            │
                └─[1 + sTF]◄──────┐     └─[KH]◄────────────────────┤
                                  └────────────────────────────────┘

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX,
(VFEMAX - KD IFD) / (KE + SE(VE)): the limit of the exciter's field current. The
limits of the lag and of VE are non-windup; the clamp to VRMAX, VRMIN is not. KH
closes a loop that shortens the exciter's time constant, so at rest
VA = VFE / KB + KH VFE.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    field_ceiling,
    field_demand,
    lag,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.sheet import AS_IN_PSSE, record, shared, sheet

ALIASES = ("ESAC2A",)

SHEET = sheet(
    *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.02, VAMAX=8.0, VAMIN=-8.0, KB=25.0),
    *shared(VRMAX_OF_EXCITER=105.0, VRMIN_OF_EXCITER=-95.0, TE=0.6, VFEMAX=4.4, KH=1.0, KF=0.03),
    *shared(TF=1.0, KC_FREE=0.28, KD=0.35, KE=1.0, E1=4.4, SE1=0.037, E2=3.3, SE2=0.012),
)

RECORDS = (
    record(
        "ESAC2A",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 E2 SE2",
    ),
)

PSLF_RECORDS = (
    record(
        "esac2a",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 "
        "E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=AS_IN_PSSE,
    ),
)

STATES = "VC VL VA VE VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vemax = field_ceiling(s.VE, vfe, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs - vc - vf, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(vl, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    gated = clip(p.KB * (va - p.KH * vfe), u.vuel, u.voel)
    vr = clip(gated, p.VRMIN, p.VRMAX)
    ve, d.VE = limited_integrator(vr - vfe, s.VE, p.TE, 0.0, vemax)
    return rectifier(ve, p.KC * u.ifd)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    va = vfe / p.KB + p.KH * vfe
    error = va / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, va, ve, vfe
    return u.vc1 + error - u.vs
