"""IEEET3: compound-source exciter, IEEE type 3 of 1968 (PSS/E IEEET3).

                 VRMAX         VBMAX
vref + vs ─►(+)─►[  KA  ]─►(+)─►[clip]─►[   1    ]─┬─► efd
           -▲ ▲- [1+sTA]    ▲     0     [KE + sTE] │
            │ │  VRMIN      V4                     │
vc1 ►[  1  ]┘ │                                    │
     [1+sTR]  └──────────[  sKF  ]◄────────────────┘
                         [1 + sTF]

V4 = sqrt(VTHEV² - (0.78 IFD)²) with VTHEV = |KP VT + j KI IT|. Where 0.78 IFD
is beyond VTHEV, what VBMAX limits is 0, as in OpenIPSL and Opal-RT (ANDES: only
V4 is). The limits of VR are non-windup, as in ANDES and Opal-RT (OpenIPSL: a
clamp). The current IT, and so KI, acts on load only.
Not modelled: UEL or OEL at the summing point.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    compound_source,
    lag,
    larger,
    limited_lag,
    sqrt,
    washout,
    where,
)
from exfit.models.sheet import record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, KA=120.0, TA=0.15, VRMAX=2.0, VRMIN=-2.0, TE=0.5, KF=0.02, TF=0.53),
    *shared(KP_OR_0=1.19, KI=1.86),
    ("VBMAX", 2.82, "pu", (0.01, 9999.0), "ceiling of the exciter's supply"),
    *shared(KE_ABOVE_0=1.0),
)

RECORDS = (record("IEEET3", "TR KA TA VRMAX VRMIN TE KF TF KP KI VBMAX KE"),)

STATES = "VC VR EFD VF"
LOADING = 0.78  # of IFD, in the report of 1968
UNLOADED = 1e-12  # pu2: less is a source whose rectifier takes all of it


def source(u: Signal, p: Signal) -> tuple[Signal, Signal]:
    """Compute V4 of the source, with whether it is above 0."""
    voltage, load = compound_source(u.vt, u.p, u.q, p.KP, p.KI), LOADING * u.ifd
    square = voltage * voltage - load * load
    return square > UNLOADED, sqrt(larger(square, UNLOADED))


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = u.vref + u.vs - vc - vf
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    supplies, v4 = source(u, p)
    vb = where(supplies, clip(vr + v4, 0.0, p.VBMAX), 0.0)
    efd, d.EFD = s.EFD, (vb - p.KE * s.EFD) / p.TE
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = p.KE * efd - source(u, p)[1]
    x.VC, x.VR, x.EFD, x.VF = u.vc1, vr, efd, efd
    return u.vc1 + vr / p.KA - u.vs
