"""Alternator exciters with a PID: AC8B, AC8C and ESAC8B."""

from exfit.models.blocks import (
    Signal,
    exciter,
    exciter_demand,
    field_demand,
    lag,
    limited_lag,
    pi_rest,
    pid,
)
from exfit.models.exciter_parts import (
    ALTERNATOR_SUPPLY,
    Gate,
    alternator_rest,
    gated,
    limited_alternator,
    supply,
)
from exfit.models.sheet import (
    OF_A_LIST,
    TWO_GATES,
    documented,
    record,
    record_of_2016,
    shared,
    sheet,
)


def regulated(
    at_error: Gate, at_output: Gate, vb: Signal, s: Signal, u: Signal, p: Signal, d: Signal
) -> Signal:
    """Write the slopes into d and return efd.

    Limiters hold the error and the PID's output at two gates;
    ``vb`` is the supply of the power stage.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = gated(u.vref + u.vs + u.vsum - vc, at_error)
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    vr, d.VR = limited_lag(gated(vpid, at_output), s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    efd, d.VE = limited_alternator(vr * vb, vfe, s, u, p)
    return efd


def at_rest(efd: Signal, vb: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd with a supply ``vb`` into x and return vref."""
    x.VE, vfe = alternator_rest(efd, u, p)
    x.VC, x.VR = u.vc1, vfe / vb
    x.VD, x.VI = pi_rest(x.VR / p.KA, p.KPR, p.KIR)
    return u.vc1 + x.VD - u.vs


def ac8b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC8B: alternator exciter with PID regulator (IEEE Std 421.5-2005, 6.8).

               vsum     VPIDMAX            VRMAX         VE <= VEMAX
                 ▼
    vref + vs ─►(+)─►[KPR + KIR/s   ]─►[  KA  ]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
               -▲    [+ sKDR/(1+sTDR)] [1+sTA]   -▲   [ sTE ] │        ▲
                │       VPIDMIN            VRMIN  │    VEMIN  │       FEX
    vc1 ►[  1  ]┘                                 │           │        ▲
         [1+sTR]                                  └── VFE ◄───┘   KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
    limits of the lag and of VE are non-windup; the integral is frozen while the PID
    is at its limit. UEL and OEL are added at the summing point. PSS/E's ESAC8B is
    another model.
    """
    return regulated(None, None, 1.0, s, u, p, d)


def ac8b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    return at_rest(efd, 1.0, u, p, x)


AC8B = documented(
    ac8b,
    ac8b_rest,
    sheet(
        *shared(TR=0.0, KPR=80.0, KIR=5.0, KDR=10.0, TDR=0.1, VPIDMAX=999.0, VPIDMIN=-999.0),
        *shared(KA_FIXED=1.0, TA_FIXED=0.0, VRMAX=35.0, VRMIN=0.0, TE=1.2, VFEMAX=6.0, VEMIN=0.0),
        *shared(KC_FREE=0.55, KD=1.1, KE=1.0, E1=9.0, SE1=3.0, E2=6.5, SE2=0.3),
    ),
    "VC VI VD VR VE",
    records=(
        record(
            "AC8B",
            "TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN KC KD KE TE VFEMAX VEMIN E1 SE1 "
            "E2 SE2",
            doubt="its order is that of OPAL-RT's library and of PSS/E's AC8C; ANDES and InterPSS "
            "have VRMAX VRMIN VFEMAX VEMIN TA KA TE KC KD KE behind VPIDMIN",
        )
        + record("ESAC8B", "TR KPR KIR KDR TDR KA TA VRMAX VRMIN TE KE E1 SE1 E2 SE2")
    ),
    pslf_records=(
        record(
            "esac8b",
            "TR KPR KIR KDR TDR VRMAX VRMIN KA TA TE VFEMAX VEMIN KE KC KD E1 SE1 E2 SE2 VTMULT "
            "SPDMLT",
            absent={"VTMULT": 0.0},
            ignored="SPDMLT",
            held={"VPIDMAX": 999.0, "VPIDMIN": -999.0},
            doubt=OF_A_LIST,
        )
        + record(
            "exac8b",
            "TR KPR KIR KDR TDR VIMAX TA VRMAX VRMIN KE TE KC KD E1 SE1 E2 SE2 LIMFLG",
            absent={"VIMAX": 999.0, "LIMFLG": 0.0},
            held={"KA": 1.0, "VPIDMAX": 999.0, "VPIDMIN": -999.0, "VFEMAX": 999.0, "VEMIN": 0.0},
            spelled={"KPR": "kvp", "KIR": "kvi", "KDR": "kvd", "TDR": "tvd"},
        )
    ),
)


def ac8c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC8C: alternator exciter with PID and power stage supply (IEEE Std 421.5-2016).

             vsum        VPIDMAX                   VRMAX         VE <= VEMAX
               ▼ UEL OEL                UEL OEL
    vref + vs►(+)►[gates]►[KPR + KIR/s  ]►[gates]►[  KA  ]►(x)─►(+)►[  1  ]┬►(x)►efd
              -▲          [+sKDR/(1+sTDR)]        [1+sTA]   ▲   -▲  [ sTE ]│  ▲
               │           VPIDMIN                 VRMIN    │    │    VEMIN│ FEX
    vc1►[  1  ]┘                                            VB   └── VFE ◄─┘  ▲
        [1+sTR]                                                          KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX.
    VB = VE1 FEX(KC1 VFE / VE1), at most VBMAX, is the supply of the power stage. It
    comes from the terminals (SW1 = 1, position A of the drawing),
    VE1 = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with THETAP in degrees, or does
    not depend on them (SW1 = 2, B), VE1 = KP. The current IT, and so KI, XL and
    THETAP, act on load only. The limits of the lag and of VE are non-windup; the
    integral is frozen while the PID is at its limit. With VB = 1 (SW1 = 2, KP = 1,
    KC1 = 0) it is AC8B.

    The limiters act at the summing point (vsum), at the gates before the PID or at
    those behind it. Dynawo and InterPSS draw the same, with these differences:
    Dynawo limits the PID by VRMAX and VRMIN, here it has its own limits, as in
    InterPSS; both let the integral track the limited output. The stabiliser may
    also be added behind the first gate (VOS = 2 in a PSS/E record): not modelled,
    and the same where no limiter acts. The supply's data are not those of a sample.
    """
    vb = supply(p.KC1 * field_demand(s.VE, u.ifd, p), u, p)
    return regulated((u.vuel, u.voel), (u.vuel_out, u.voel_out), vb, s, u, p, d)


def ac8c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    _, vfe = alternator_rest(efd, u, p)
    return at_rest(efd, supply(p.KC1 * vfe, u, p), u, p, x)


OF_AC8C = (
    "TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN KC KD KE TE VFEMAX VEMIN E1 SE1 E2 SE2 "
    "KP KI XL THETAP KC1 VBMAX"
)
AC8C = documented(
    ac8c,
    ac8c_rest,
    (*AC8B.sheet, *ALTERNATOR_SUPPLY),
    "VC VI VD VR VE",
    aliases="ESAC8C AC8CU1",
    records=(
        *record_of_2016(
            "AC8C",
            OF_AC8C,
            switches="VOS SW1",
            places=TWO_GATES,
            doubt="PSS/E 36 reads constants in this order as AC8CU1",
        ),
        *record_of_2016(
            "AC8CU1",
            OF_AC8C,
            flags="OEL UEL SCL",
            switches="VOS SW1",
            places=TWO_GATES,
            user="2 0 5 27 5 3",
        ),
    ),
)


def esac8b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ESAC8B: Basler DECS, a PID regulator on a simple exciter (PSS/E).

                                         VRMAX
    vref + vs ─►(+)─►[KP + KI/s    ]─►[  KA  ]─►(+)─►[  1  ]─┬─► efd
               -▲    [+ sKD/(1+sTD)]  [1+sTA]  -▲    [ sTE ] │
    vc1 ►[  1  ]┘                        VRMIN  │            │
         [1+sTR]                                └──── VFE ◄──┘

    VFE = KE efd + VX(efd). The limits of the lag are non-windup; the PID has none,
    so that its integral runs on while the lag is at its limit. No rectifier and no
    demagnetisation: efd is the exciter voltage itself, without limits of its own.
    AC8B (2005) is another model, with KC, KD and limits of the PID and of VE.
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs - vc
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KP, p.KI, p.KD, p.TD)
    vr, d.VR = limited_lag(vpid, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    efd, d.VE = exciter(vr, s.VE, p.KE, p)
    return efd


def esac8b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = exciter_demand(efd, p.KE, p)
    error, x.VI = pi_rest(vr / p.KA, p.KP, p.KI)
    x.VC, x.VD, x.VR, x.VE = u.vc1, error, vr, efd
    return u.vc1 + error - u.vs


ESAC8B = documented(
    esac8b,
    esac8b_rest,
    sheet(
        *shared(TR=0.0, KP_OF_PID=40.0, KI_OF_PID=10.0, KD_OF_PID=15.0, TD=0.02, KA_FIXED=1.0),
        *shared(TA_FIXED=0.0, VRMAX=35.0, VRMIN=0.0, TE=1.2, KE=1.0, E1=9.0, SE1=3.0, E2=6.5),
        *shared(SE2=0.3),
    ),
    "VC VI VD VR VE",
    records=record("ESAC8B", "TR KP KI KD TD KA TA VRMAX VRMIN TE KE E1 SE1 E2 SE2"),
)
