"""AC6C: alternator exciter, field current limiter (IEEE Std 421.5-2016).

          vsum                VAMAX   UEL OEL    VT EFEMAX     VE <= VEMAX
            ▼
vref + vs ►(+)►[KA(1+sTK)]►[1 + sTC]►[gates]►(+)►[clip]►(+)►[  1  ]─┬─►(x)► efd
          -▲   [ 1 + sTA ] [1 + sTB]        -▲          -▲  [ sTE ] │   ▲
           │                  VAMIN          │ VT EFEMIN │   VEMIN  │  FEX
vc1►[  1  ]┘                                 │           │          │   ▲
    [1+sTR]                                  │           ├─ VFE ◄VE─┘   │
                        ┌────────────────────┘           │        KC IFD / VE
                        │  [1 + sTJ]     VHMAX           ▼
                        └──[1 + sTH]◄────[ KH ]◄────────(+)
                                           0            -▲
                                                         └─── VFELIM

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
field current limiter acts above VFELIM; at rest VA = VFE + KH (VFE - VFELIM)
there. The limit of the second lead-lag is non-windup as in annex E of the
edition of 2005: at the limit its state follows the limited output with the lag
TC. The limits of VE are non-windup; the clamps of EFE and of the field current
limiter are not. TB = 0 bypasses TC with it, TA = 0 TK, TH = 0 TJ. With VFEMAX
out of reach and VEMIN = 0 it is AC6A, whose VRMAX and VRMIN are EFEMAX and
EFEMIN here.

The limiters act at the summing point (vsum) or at the gates. Dynawo and
InterPSS draw the same; InterPSS clamps the output of the second lead-lag, whose
state runs on.
"""

from exfit.models.alternators import FIELD_LIMITS, alternator
from exfit.models.blocks import Signal, clip, field_demand, lag, lead_lag, limited_lead_lag
from exfit.models.exciters import ac6a
from exfit.models.sheet import OF_TWO_PROGRAMS, ONE_GATE, record, renamed

ALIASES = ("ESAC6C",)

SHEET = (*renamed(ac6a.SHEET, VRMAX="EFEMAX", VRMIN="EFEMIN"), *FIELD_LIMITS)

RECORDS = (
    record(
        "AC6C",
        "TR KA TA TK TB TC VAMAX VAMIN EFEMAX EFEMIN TE VFELIM KH VHMAX TH TJ KC KD KE E1 SE1 "
        "E2 SE2 VFEMAX VEMIN",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES, rest = ac6a.STATES, ac6a.rest


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vk, d.VK = lead_lag(p.KA * (u.vref + u.vs + u.vsum - vc), s.VK, p.TK, p.TA)
    va, d.VA = limited_lead_lag(vk, s.VA, p.TC, p.TB, p.VAMIN, p.VAMAX)
    vf, d.VH = lead_lag(ac6a.limiter(vfe, p), s.VH, p.TJ, p.TH)
    gated = clip(va, u.vuel, u.voel)
    efe = clip(gated - vf, u.vt * p.EFEMIN, u.vt * p.EFEMAX)
    efd, d.VE = alternator(efe, vfe, s, u, p)
    return efd
