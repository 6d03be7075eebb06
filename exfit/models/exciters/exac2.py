"""EXAC2: high initial response alternator exciter (IEEE type AC2 of 1981).

                             VAMAX                        VRMAX
vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[ LV ]─►[ KB ]─►[clip]─► VR
           -▲   ▲-[1 + sTB]  [1+sTA]  -▲    [gate]           VRMIN
            │   │            VAMIN     │      ▲
            │   │                   KH VFE   KL (VLR - VFE)
            │   │
            │   │  [  sKF  ]                  VE >= 0
            │   └──[1 + sTF]◄─┐   VR ─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
            │                 │        -▲   [ sTE ] │        ▲
vc1 ►[  1  ]┘                 └─────────┴── VFE ◄───┘       FEX
     [1+sTR]                                                 ▲
                                                        KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD. The limits of the lag and of VE are non-windup;
the clamp behind KB is not. The low value gate limits the exciter's field
current, in the end to VFE = VLR KB KL / (1 + KB KL). A start beyond the gate is
refused; some programs raise VLR without a message instead. The AC2A of 1992 and
2005 is another model, with a ceiling of VE and no such gate. Not modelled: the
UEL and OEL inputs, which some programs add at the first summing point.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    smaller,
    washout,
)
from exfit.models.sheet import LIMIT, OF_A_LIST, PID_GAIN, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.01, VAMAX=8.0, VAMIN=-8.0, KB=25.0),
    *shared(VRMAX_OF_EXCITER=105.0, VRMIN_OF_EXCITER=-95.0, TE=0.6),
    ("KL", 10.0, *PID_GAIN, "gain of the field current limiter"),
    *shared(KH=1.0, KF=0.03, TF=1.0, KC_FREE=0.28, KD=0.35, KE=1.0),
    ("VLR", 4.4, *LIMIT, "limit of the exciter's field current"),
    *shared(E1=4.4, SE1=0.037, E2=3.3, SE2=0.012),
)

RECORDS = (
    record(
        "EXAC2",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE KL KH KF TF KC KD KE VLR E1 SE1 E2 SE2",
    ),
)

PSLF_RECORDS = (
    record(
        "exac2",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE KL KH KF TF KC KD KE VLR E1 SE1 "
        "E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)

STATES = "VC VL VA VE VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs - vc - vf, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(vl, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    gated = smaller(va - p.KH * vfe, p.KL * (p.VLR - vfe))
    vr = clip(p.KB * gated, p.VRMIN, p.VRMAX)
    ve, d.VE = limited_integrator(vr - vfe, s.VE, p.TE, low=0.0)
    return rectifier(ve, p.KC * u.ifd)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    va = vfe / p.KB + p.KH * vfe
    error = va / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, va, ve, vfe
    return u.vc1 + error - u.vs
