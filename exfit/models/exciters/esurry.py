"""ESURRY: alternator exciter with feedback of its field current (PSS/E ESURRY).

          vsum                              VRMAX        VE >= 0
            ▼
vref + vs ►(+)►[1+sTA]►[1+sTC]►[K10]─►(+)──►[clip]─►(+)─►[  1  ]─┬─ VE ►(x)►efd
           -▲  [1+sTB] [1+sTD]        ▲ ▲-  VRMIN   -▲   [ sTE ] │       ▲
            │                   IREF ─┘ │            │           │      FEX
vc1 ►[  1  ]┘                           │            └─── VFE ◄──┘       ▲
     [1+sTR]                            │                           KC IFD / VE
                                        └─[K16 + sKF/(1+sTF)]◄─[  1  ]◄─ VFE
                                                               [1+sT1]

VFE = KE VE + VX(VE) + KD IFD. IREF is K16 VFE of the start (setpoint IREF0),
so that the feedback K16 begins at nothing. The limit of VE is non-windup; the
clamp has no state. TB = 0 bypasses TA with it, TD = 0 TC.

OpenIPSL's and InterPSS's models, written after PSS/E's, agree; WECC's EXAC1M is
another name. Typical data are those of a record but for KC. Not modelled: UEL
other than at the summing point (PSS/E adds it to IREF).
"""

from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    lead_lag,
    limited_integrator,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.sheet import (
    FREE,
    GAIN,
    TIME,
    UP_TO_100,
    UP_TO_1000,
    SearchRange,
    record,
    shared,
    sheet,
)

ALIASES = "EXAC1M"

SHEET = sheet(
    *shared(TR=0.016668),
    ("TA", 0.8, *TIME, "first regulator lead", SearchRange(unlike="TB")),
    ("TB", 0.1, *TIME, "first regulator lag", SearchRange(unlike="TA")),
    ("TC", 0.6, *TIME, "second regulator lead", SearchRange(unlike="TD")),
    ("TD", 19.0, *TIME, "second regulator lag", SearchRange(unlike="TC")),
    ("K10", 400.0, *GAIN, "regulator gain", FREE),
    ("T1", 1.0, *TIME, "lag of the exciter's field current"),
    ("K16", 1.0, *UP_TO_1000, "feedback gain of the lagged field current"),
    ("KF", 20.0, *UP_TO_1000, "stabilising feedback gain", FREE),
    *shared(TF=1.6, VRMAX=14.0, VRMIN=-12.6, TE=2.0, E1=3.01, SE1=0.01, E2=5.01, SE2=0.2),
    *shared(KC_FREE=0.1),
    ("KD", 0.0, *UP_TO_100, "demagnetising factor"),
    *shared(KE=0.8),
)

RECORDS = record("ESURRY", "TR TA TB TC TD K10 T1 K16 KF TF VRMAX VRMIN TE E1 SE1 E2 SE2 KC KD KE")

STATES = "VC VL1 VL2 VF VS VE"
SETPOINTS = "IREF0"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vf, d.VF = lag(vfe, s.VF, 1.0, p.T1)
    vs, d.VS = washout(vf, s.VS, p.KF, p.TF)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl1, d.VL1 = lead_lag(u.vref + u.vs + u.vsum - vc, s.VL1, p.TA, p.TB)
    vl2, d.VL2 = lead_lag(vl1, s.VL2, p.TC, p.TD)
    vr = clip(p.K10 * vl2 + s.IREF0 - p.K16 * vf - vs, p.VRMIN, p.VRMAX)
    ve, d.VE = limited_integrator(vr - vfe, s.VE, p.TE, low=0.0)
    return rectifier(ve, p.KC * u.ifd)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    error = vfe / p.K10
    x.VC, x.VL1, x.VL2, x.VF, x.VS, x.VE = u.vc1, error, error, vfe, vfe, ve
    x.IREF0 = p.K16 * vfe
    return u.vc1 + error - u.vs
