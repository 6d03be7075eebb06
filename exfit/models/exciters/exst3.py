"""EXST3: controlled rectifier with a field voltage loop (IEEE type ST3 of 1981).

          vsum   VIMAX                        VRMAX           EFDMAX
            ▼
vref + vs ►(+)──►[clip]►[ KJ ]►[1 + sTC]─►(+)─►[  KA  ]─►(x)─►[clip]─┬─► efd
           -▲    VIMIN         [1 + sTB]  -▲   [1+sTA]    ▲          │
            │                              │    VRMIN    VB          │
            │                              │                         │
vc1 ►[  1  ]┘                              └─[smaller]◄────────[ KG ]┘
     [1+sTR]                                    ▲
                                              VGMAX

VB = VE FEX(KC IFD / VE) with VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|,
THETAP in degrees (OPAL-RT's model takes radians). The limits of the lag are
non-windup. The current IT, and so KI, XL and THETAP, act on load only. Two open
models written after PSS/E's EXST3 agree otherwise. ST3A is this with a lag TA
of its regulator (KJ there is KA, and KA is KM), a ceiling of VB in place of
that of efd, and a gate of the UEL, which is added to the error here.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    compound_source,
    inf,
    lag,
    lead_lag,
    limited_lag,
    rectifier,
    smaller,
)
from exfit.models.sheet import FREE, GAIN, LIMIT, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, VIMAX=0.2, VIMIN=-0.2),
    ("KJ", 200.0, *GAIN, "regulator gain", FREE),
    *shared(TC_FREE=1.0, TB_FREE=10.0),
    ("KA", 7.93, *GAIN, "gain of the field voltage loop", FREE),
    ("TA", 0.4, "s", (0.001, 10.0), "time constant of the field voltage loop", FREE),
    ("VRMAX", 1.0, *LIMIT, "ceiling of the field voltage loop"),
    ("VRMIN", 0.0, *LIMIT, "floor of the field voltage loop"),
    *shared(KG=1.0, KP=6.15, KI=0.0, EFDMAX=6.9, KC=0.2, XL=0.081, VGMAX=5.8, THETAP=0.0),
)

RECORDS = (
    record(
        "EXST3",
        "TR VIMAX VIMIN KJ TC TB KA TA VRMAX VRMIN KG KP KI EFDMAX KC XL VGMAX THETAP",
    ),
)

STATES = "VC VL VR"


def source(u: Signal, p: Signal) -> Signal:
    """Return VB, what the source gives behind its rectifier."""
    ve = compound_source(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
    return rectifier(ve, p.KC * u.ifd)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    efd = clip(clip(s.VR, p.VRMIN, p.VRMAX) * source(u, p), -inf, p.EFDMAX)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = clip(u.vref + u.vs + u.vsum - vc, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(p.KJ * vi, s.VL, p.TC, p.TB)
    vg = smaller(p.KG * efd, p.VGMAX)
    _, d.VR = limited_lag(vl - vg, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = efd / source(u, p)
    vl = vr / p.KA + smaller(p.KG * efd, p.VGMAX)
    x.VC, x.VL, x.VR = u.vc1, vl, vr
    return u.vc1 + vl / p.KJ - u.vs
