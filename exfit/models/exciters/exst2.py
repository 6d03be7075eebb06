"""EXST2: compound-source exciter, its supply added (IEEE type ST2 of 1981).

           vsum    VRMAX               EFDMAX
             ▼
vref + vs ─►(+)─►[  KA  ]─►(+)─►(+)─►[  1  ]─┬─► efd
           -▲ ▲- [1+sTA]    ▲   -▲   [ sTE ] │
            │ │    VRMIN   VB    │      0    │
            │ │                  └───[ KE ]◄─┤
            │ │                              │
vc1 ►[  1  ]┘ └────────[  sKF  ]◄────────────┘
     [1+sTR]           [1 + sTF]

VB = VE FEX(KC IFD / VE) with VE = |KP VT + j KI IT|, and 1 where KP = KI = 0 as
in PSS/E. The limits of the regulator and of efd are non-windup. The current IT,
and so KI, acts on load only. ST2A multiplies by VB instead, as EXST2A does.

Two open models written after PSS/E's EXST2 agree. Typical data are those of
IEEET3, whose source is added as well, but for KP and KC. Not modelled: UEL and
OEL other than at the summing point.
"""

from exfit.models.blocks import Signal, lag, limited_integrator, limited_lag, washout
from exfit.models.compound import supply
from exfit.models.sheet import record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, KA=120.0, TA=0.15, VRMAX=2.0, VRMIN=-2.0, KE_ABOVE_0=1.0, TE=0.5, KF=0.02),
    *shared(TF=0.53, KP_OR_0=0.9, KI=1.86, KC=0.1, EFDMAX=2.8),
)

RECORDS = (record("EXST2", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX"),)

STATES = "VC VR EFD VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = u.vref + u.vs + u.vsum - vc - vf
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vb = supply(u, p)
    efd, d.EFD = limited_integrator(vr + vb - p.KE * s.EFD, s.EFD, p.TE, 0.0, p.EFDMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = p.KE * efd - supply(u, p)
    x.VC, x.VR, x.EFD, x.VF = u.vc1, vr, efd, efd
    return u.vc1 + vr / p.KA - u.vs
