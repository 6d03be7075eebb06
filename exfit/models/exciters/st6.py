"""Static exciters with a PID and a field voltage loop: ST6B and ST6C."""

from exfit.models.blocks import Signal, clip, lag, larger, limited_lag, pi_rest, pid, smaller
from exfit.models.exciter_parts import STATIC_SUPPLY, supply
from exfit.models.sheet import (
    FREE,
    INTEGRAL_GAIN,
    PID_GAIN,
    SHORT_TIME,
    UP_TO_1000,
    SearchRange,
    documented,
    limits,
    record,
    record_of_2016,
    shared,
    sheet,
)


def st6b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = larger(u.vref - vc, u.vuel) + u.vs
    va, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPA, p.KIA, p.KDA, p.TDA, p.VAMIN, p.VAMAX)
    vr = clip(p.KFF * va + p.KM * (va - s.VG), p.VRMIN, p.VRMAX)
    field_limit = larger(p.KLR * (p.KCI * p.ILR - u.ifd), p.VRMIN)
    efd = smaller(vr, field_limit) * u.vt
    _, d.VG = lag(efd, s.VG, p.KG, p.TG)
    return efd


def st6b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vg = p.KG * efd
    va = (efd / u.vt + p.KM * vg) / (p.KFF + p.KM)
    error, x.VI = pi_rest(va, p.KPA, p.KIA)
    x.VC, x.VD, x.VG = u.vc1, error, vg
    return u.vc1 + error - u.vs


ST6B = documented(
    st6b,
    st6b_rest,
    sheet(
        *shared(TR=0.012),
        ("KPA", 18.038, *PID_GAIN, "proportional gain", FREE),
        ("KIA", 45.094, *INTEGRAL_GAIN, "integral gain", FREE),
        ("KDA", 0.1, "pu s", (0.0, 100000.0), "derivative gain", SearchRange(needs="TDA")),
        ("TDA", 0.1, *SHORT_TIME, "lag of the derivative", SearchRange(needs="KDA")),
        *limits("VAMAX", 4.81, -3.85, "the PID"),
        ("KFF", 1.0, *UP_TO_1000, "feedforward gain"),
        ("KM", 1.0, *UP_TO_1000, "gain of the field voltage loop", FREE),
        ("KCI", 1.0577, *UP_TO_1000, "factor on the field current limit"),
        *shared(KLR=17.33),
        ("ILR", 4.164, "pu", (0.0, 9999.0), "field current limit"),
        *shared(VRMAX_OF_EFD_AT_VT=4.81, VRMIN_OF_EFD_AT_VT=-3.85, KG=1.0),
        ("TG", 0.02, "s", (0.001, 10.0), "feedback lag of the field voltage loop", FREE),
    ),
    "VC VI VD VG",
    aliases="ESST6B",
    records=record(
        "ST6B",
        "TR KPA KIA KDA TDA VAMAX VAMIN KFF KM KCI KLR ILR VRMAX VRMIN KG TG",
        icons={"OEL": 1},
    ),
)


def st6c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST6C: static exciter, PID with a field voltage loop (IEEE Std 421.5-2016).

                    UEL OEL      VAMAX, ILIM                      VRMAX  UEL OEL
    vref + vsum ►(+)►[gates]─►(+)─►[KPA + KIA/s   ]─┬─►[KFF]─►(+)─►[clip]─►[gates]─┐
                 -▲            ▲   [+ sKDA/(1+sTDA)]│          ▲    VRMIN          │
                  │            vs  VAMIN            └►(+)─►[KM]┘                   │
    vc1 ──►[  1  ]┘                                   -▲            VMMAX          │
           [1+sTR]                 efd ◄┬─(x)◄─────────┼───────────[  1  ]◄─[LV]◄──┘
                                        │  ▲           │           [1+sTA]   ▲
                                        │  VB          │            VMMIN    │
                                        └─────────►[  KG  ]                 ILIM
                                                   [1+sTG]

    ILIM = KLR (KCI ILR - IFD), at least VRMIN, limits the field current: at the
    gate LV as in ST6B, and as the ceiling of the PID where it is below VAMAX.
    VB = VE FEX(KC IFD / VE), at most VBMAX. It comes from the terminals (SW1 = 1,
    position A of the drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
    THETAP in degrees, or does not depend on them (SW1 = 2, B), VE = KP. The current
    IT, and so KI, XL and THETAP, act on load only. The integral is frozen while the
    PID is at its limit, and the limit of the lag TA is non-windup. With VB = VT
    (KP = 1, KC = 0) and TA = 0 it is ST6B as long as the field current is small.

    The limiters act at the summing point (vsum), at the gates behind it or at those
    of the regulator's output; they may also be added behind the first gates (3 in a
    PSS/E record), which is the same where no gate acts. Dynawo and InterPSS draw
    this; Dynawo has no derivative, and a lag of ILIM that the others do not have.
    Typical data are those of ST6B, with a supply from the terminals and a lag.
    """
    current = larger(p.KLR * (p.KCI * p.ILR - u.ifd), p.VRMIN)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref + u.vsum - vc, u.vuel, u.voel) + u.vs
    ceiling = smaller(p.VAMAX, current)
    va, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPA, p.KIA, p.KDA, p.TDA, p.VAMIN, ceiling)
    vr = clip(p.KFF * va + p.KM * (va - s.VG), p.VRMIN, p.VRMAX)
    least = smaller(clip(vr, u.vuel_out, u.voel_out), current)
    vm, d.VM = limited_lag(least, s.VM, 1.0, p.TA, p.VMMIN, p.VMMAX)
    efd = vm * supply(p.KC * u.ifd, u, p)
    _, d.VG = lag(efd, s.VG, p.KG, p.TG)
    return efd


def st6c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VM, x.VG = efd / supply(p.KC * u.ifd, u, p), p.KG * efd
    va = (x.VM + p.KM * x.VG) / (p.KFF + p.KM)
    x.VD, x.VI = pi_rest(va, p.KPA, p.KIA)
    x.VC = u.vc1
    return u.vc1 + x.VD - u.vs


ST6C = documented(
    st6c,
    st6c_rest,
    sheet(
        *ST6B.sheet,
        *shared(TA_OF_FIRING=0.02),
        *limits("VMMAX", 4.5, -3.6, "the lag before the rectifier"),
        *STATIC_SUPPLY,
    ),
    "VC VI VD VM VG",
    aliases="ESST6C",
    records=record_of_2016(
        "ST6C",
        "TR KPA KIA KDA TDA VAMAX VAMIN KFF KM KCI KLR ILR VRMAX VRMIN KG TG VMMAX VMMIN TA KP KI "
        "XL THETAP KC VBMAX",
        flags="OEL UEL SCL",
        switches="SW1",
    ),
)
