"""ST6B: static exciter, PID with a field voltage loop (IEEE Std 421.5-2005, 7.6).

              VUEL        VAMAX                             VRMAX
vref ─►(+)─►[HV gate]─►(+)─►[KPA + KIA/s   ]─┬─►[KFF]─►(+)─►[clip]─►[LV]─┐ VR
       -▲               ▲   [+ sKDA/(1+sTDA)]│          ▲   VRMIN    ▲   │
        │               vs  VAMIN            └►(+)─►[KM]┘            │   ▼
vc1 ►[  1  ]                                  -▲                     │  (x)◄ VT
     [1+sTR]                                   └──[  KG  ]◄──────────┼───┤
                                                  [1 + sTG]          │   ▼
                         KLR (KCI ILR - IFD), at least VRMIN ────────┘  efd

The integral is frozen while the PID is at its limit; the other limits are plain
clamps. VR multiplies the terminal voltage VT: a supply from the terminals, as
in PSS/E; PSLF lets VRMULT choose, and Dynawo has a whole potential circuit. VS
acts behind the gate. In the standard the regulator is a PI (KDA = 0); the
record of PSS/E has the derivative, and so has the typical data, a small one.

Not modelled: the overexcitation limiter, which is added to the error before the
gate (OEL = 1 in a PSS/E record) or behind it (OEL = 2).
"""

from exfit.models.blocks import Signal, clip, lag, larger, pi_rest, pid, smaller
from exfit.models.sheet import (
    FREE,
    INTEGRAL_GAIN,
    LIMIT,
    PID_GAIN,
    SHORT_TIME,
    UP_TO_1000,
    SearchRange,
    record,
    shared,
    sheet,
)

SHEET = sheet(
    *shared(TR=0.012),
    ("KPA", 18.038, *PID_GAIN, "proportional gain", FREE),
    ("KIA", 45.094, *INTEGRAL_GAIN, "integral gain", FREE),
    ("KDA", 0.1, "pu s", (0.0, 100000.0), "derivative gain", SearchRange(needs="TDA")),
    ("TDA", 0.1, *SHORT_TIME, "lag of the derivative", SearchRange(needs="KDA")),
    ("VAMAX", 4.81, *LIMIT, "ceiling of the PID"),
    ("VAMIN", -3.85, *LIMIT, "floor of the PID"),
    ("KFF", 1.0, *UP_TO_1000, "feedforward gain"),
    ("KM", 1.0, *UP_TO_1000, "gain of the field voltage loop", FREE),
    ("KCI", 1.0577, *UP_TO_1000, "factor on the field current limit"),
    *shared(KLR=17.33),
    ("ILR", 4.164, "pu", (0.0, 9999.0), "field current limit"),
    *shared(VRMAX_OF_EFD_AT_VT=4.81, VRMIN_OF_EFD_AT_VT=-3.85, KG=1.0),
    ("TG", 0.02, "s", (0.001, 10.0), "feedback lag of the field voltage loop", FREE),
)

RECORDS = (
    record(
        "ST6B",
        "TR KPA KIA KDA TDA VAMAX VAMIN KFF KM KCI KLR ILR VRMAX VRMIN KG TG",
        icons={"OEL": 1},
    ),
)

STATES = "VC VI VD VG"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = larger(u.vref - vc, u.vuel) + u.vs
    va, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPA, p.KIA, p.KDA, p.TDA, p.VAMIN, p.VAMAX)
    vr = clip(p.KFF * va + p.KM * (va - s.VG), p.VRMIN, p.VRMAX)
    field_limit = larger(p.KLR * (p.KCI * p.ILR - u.ifd), p.VRMIN)
    efd = smaller(vr, field_limit) * u.vt
    _, d.VG = lag(efd, s.VG, p.KG, p.TG)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vg = p.KG * efd
    va = (efd / u.vt + p.KM * vg) / (p.KFF + p.KM)
    error, x.VI = pi_rest(va, p.KPA, p.KIA)
    x.VC, x.VD, x.VG = u.vc1, error, vg
    return u.vc1 + error - u.vs
