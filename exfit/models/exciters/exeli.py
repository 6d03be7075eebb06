"""EXELI: static exciter that controls its field current (ELIN; PSS/E EXELI).

                                                           EFMAX
vref + vs + vsum ►(+)►[VPU]─┬──────────────►(+)►(+)►[VPI]►(+)►[clip]► efd
                 -▲ ▲-      │                ▲   ▲-        ▲-  EFMIN
vc1 ►[   1   ]────┘ │       └►(+)►[  1  ]─VN─┤   │        XE IFD
     [1 + sTFV]   VPSS         ▲  [ sTNU]   -▼   │
                               └─[VPNF]◄─DB◄(+)◄─┴─ IF
IFD ►[   1   ]─ IF
     [1 + sTFI]

p ►[  sTW  ]►[  sTW  ]►[  sTW  ]─┬►[KS1]──────►(+)►[ sTS2  ]►[clip]► VPSS
   [1 + sTW] [1 + sTW] [1 + sTW] │              ▲  [1+sTS2]   -SMAX
                                 └►[  KS2  ]────┘
                                   [1 + sTS1]

A PI with VPU and TNU sets the field current that VPI controls; its integral VN
follows the field current. The dead band DB passes IF - VN as it is beyond DPNF,
and 0 up to it: so PSS/E 36.7 rests, whose curve over a step of vref this gives
(vt 2e-6 pu; InterPSS takes DPNF off, and has the other sign of VPSS). The
stabiliser hears the power, and acts on load only. TFV, TFI or TS1 = 0 bypasses
its lag. That the limits, which no curve reaches, stand behind XE IFD rests on
InterPSS alone. Typical data are CIM's (ExcELIN1) but for KS1 and KS2 (0). Not
modelled: UEL and OEL other than at the summing point.
"""

from exfit.models.blocks import Signal, clip, high_pass, integrator, lag, where
from exfit.models.sheet import (
    FREE,
    GAIN,
    OF_A_LIST,
    POSITIVE_TIME,
    TIME,
    UP_TO_10,
    UP_TO_100,
    WASHOUT_TIME,
    WITHIN_1000,
    limits,
    record,
    sheet,
)

SHEET = sheet(
    ("TFV", 0.05, "s", (0.0, 1.0), "voltage transducer lag"),
    ("TFI", 0.0, "s", (0.0, 1.0), "field current transducer lag"),
    ("TNU", 2.0, *POSITIVE_TIME, "reset time of the voltage controller", FREE),
    ("VPU", 34.5, *GAIN, "gain of the voltage controller", FREE),
    ("VPI", 12.45, *GAIN, "gain of the current controller", FREE),
    ("VPNF", 2.0, *UP_TO_100, "gain of the integral's follow-up"),
    ("DPNF", 0.0, *UP_TO_10, "dead band of the integral's follow-up"),
    *limits("EFMAX", 5.0, -5.0, "the field voltage"),
    ("XE", 0.06, *UP_TO_10, "reactance of the excitation transformer"),
    ("TW", 3.0, *WASHOUT_TIME, "washouts of the stabiliser, on load"),
    ("KS1", 0.1, *WITHIN_1000, "direct gain of the stabiliser, on load"),
    ("KS2", 0.1, *WITHIN_1000, "lagged gain of the stabiliser, on load"),
    ("TS1", 1.0, *TIME, "lag of the stabiliser, on load"),
    ("TS2", 1.0, *WASHOUT_TIME, "last washout of the stabiliser, on load"),
    ("SMAX", 0.1, "pu", (0.0001, 9999.0), "limit of the stabiliser, both ways, on load"),
)

ORDER = "TFV TFI TNU VPU VPI VPNF DPNF EFMIN EFMAX XE TW KS1 KS2 TS1 TS2 SMAX"
RECORDS = record("EXELI", ORDER)

PSLF_RECORDS = record("exeli", ORDER, doubt=OF_A_LIST)

STATES = "VC IF VN W1 W2 W3 VS VW"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TFV)
    current, d.IF = lag(u.ifd, s.IF, 1.0, p.TFI)
    w1, d.W1 = high_pass(u.p, s.W1, p.TW)
    w2, d.W2 = high_pass(w1, s.W2, p.TW)
    w3, d.W3 = high_pass(w2, s.W3, p.TW)
    lagged, d.VS = lag(w3, s.VS, p.KS2, p.TS1)
    vw, d.VW = high_pass(p.KS1 * w3 + lagged, s.VW, p.TS2)
    vpss = clip(vw, -p.SMAX, p.SMAX)
    asked = p.VPU * (u.vref + u.vs + u.vsum - vc - vpss)
    apart = current - s.VN
    follows = where((apart > p.DPNF) | (apart < -p.DPNF), apart, 0.0)
    vn, d.VN = integrator(asked + p.VPNF * follows, s.VN, p.TNU)
    return clip(p.VPI * (asked + vn - current) - p.XE * u.ifd, p.EFMIN, p.EFMAX)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = (efd + p.XE * u.ifd) / p.VPI
    followed = (error > p.DPNF) | (error < -p.DPNF)
    above = where(followed, error / (1.0 + p.VPNF), error)
    x.VC, x.IF, x.VN = u.vc1, u.ifd, u.ifd + above
    x.W1, x.W2, x.W3, x.VS, x.VW = u.p, 0.0, 0.0, 0.0, 0.0
    return u.vc1 + (error - above) / p.VPU - u.vs
