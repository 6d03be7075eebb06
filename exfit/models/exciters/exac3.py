"""EXAC3: alternator exciter, its own supply (IEEE type AC3 of 1981).

          vsum             VAMAX                  VE >= 0
            ▼
vref + vs ►(+)►[1 + sTC]►HV►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─ VE ─►(x)─┬► efd
          -▲ ▲-[1 + sTB] ▲  [1+sTA]    ▲   -▲   [ sTE ] │        ▲  │
           │ │           │  VAMIN      │    │           │       FEX │
           │ │  KLV (VLV - efd)     KR efd  └─── VFE ◄──┘        ▲  │
           │ │                                          KC IFD / VE │
vc1►[  1  ]┘ └─[   s   ]◄─ VN ─[ KF to EFDN, then KN ]◄─────────────┘
    [1+sTR]    [1 + sTF]

VFE = KE VE + VX(VE) + KD IFD. VN has the slope KF up to EFDN and KN beyond it.
The exciter supplies its regulator, so the gain of both grows with efd. The high
value gate HV keeps efd near VLV at least. The limits of the lag and of VE are
non-windup. AC3A, of 1992 and 2005, has a floor and a ceiling of VE in place of
the gate, and its feedback behind the lead-lag.

Two open models written after PSS/E's EXAC3 agree but for VN: in one KF and KN
are gains of all of efd, beyond EFDN and up to it, so that VN jumps there.
Typical data are those of a PSS/E record. Not modelled: UEL and OEL other than
at the summing point.
"""

from exfit.models.blocks import (
    Signal,
    field_demand,
    lag,
    larger,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.exciters.ac3a import feedback
from exfit.models.sheet import LIMIT, UP_TO_1000, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, TB=0.0, TC=0.0, KA=78.04, TA=0.013, VAMAX=1.0, VAMIN=-0.95, TE=3.71),
    ("KLV", 0.167, *UP_TO_1000, "gain of the low voltage limiter"),
    *shared(KR=6.99, KF_TO_EFDN=0.143, TF=1.0, KN=0.05, EFDN=1.603, KC_FREE=0.14, KD=1.02, KE=1.0),
    ("VLV", 0.46, *LIMIT, "field voltage of the low voltage limiter"),
    *shared(E1=4.64, SE1=0.186, E2=6.19, SE2=1.391),
)

RECORDS = (
    record(
        "EXAC3",
        "TR TB TC KA TA VAMAX VAMIN TE KLV KR KF TF KN EFDN KC KD KE VLV E1 SE1 E2 SE2",
    ),
)

STATES = "VC VL VA VE VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    # before the integrator that makes it: the exciter feeds its own regulator
    efd = rectifier(larger(s.VE, 0.0), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(feedback(efd, p), s.VF, 1.0, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc - vf, s.VL, p.TC, p.TB)
    gated = larger(vl, p.KLV * (p.VLV - efd))
    va, d.VA = limited_lag(gated, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    _, d.VE = limited_integrator(p.KR * efd * va - vfe, s.VE, p.TE, low=0.0)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    va = field_demand(ve, u.ifd, p) / (p.KR * efd)
    error = va / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, va, ve, feedback(efd, p)
    return u.vc1 + error - u.vs
