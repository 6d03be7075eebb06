"""Commutator exciters with a PID: DC4B and DC4C."""

from collections.abc import Callable
from functools import partial
from typing import Any

from exfit.models.blocks import (
    Signal,
    clip,
    commutator_start,
    exciter,
    exciter_demand,
    limited_lag,
    pi_and_derivative,
    pi_rest,
    pid,
)
from exfit.models.exciter_parts import ALTERNATOR_SUPPLY, error_less_feedback, supply
from exfit.models.sheet import documented, record, record_of_2016, shared, sheet


def dc4b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """DC4B: commutator exciter, PID regulator (IEEE Std 421.5-2005, 5.4).

                      VRMAX/KA           VUEL  VOEL
    vref + vs ─►(+)─►[KP + KI/s      ]───►HV───►LV──────┐
               -▲ ▲- [+ sKD/(1 + sTD)]                  │
    vc1 ►[  1  ]┘ │   VRMIN/KA                          │
         [1+sTR]  │                                     │
                  │      VT VRMAX                       │
                  │   ┌─[   KA   ]◄─────(x)◄────────────┘
                  │   │ [1 + sTA ]       ▲
                  │   │  VT VRMIN       VT
                  │   └►(+)─►[  1  ]─┬──────────────────► efd
                  │     -▲   [ sTE ] │
                  │      │    VEMIN  │
                  │      └── VFE ◄───┤
                  └──────[   sKF  ]◄─┘
                         [1 + sTF ]

    VFE = KE EFD + VX(EFD). The limits of the lag and of EFD are non-windup;
    the integral is frozen while the PID is at its limit. The regulator is fed
    from the terminals: gain and limits are proportional to VT, as in the
    standard's drawing, OpenIPSL and InterPSS. The standard's sample data have
    KF = 0: the rate feedback is an alternative to the derivative.
    KE = 0 is self-excited: KE is computed at the start so that VR starts at
    VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
    VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
    (SE(E) E where KE < 0), VRMIN = -VRMAX (ANDES: 999). The values in use are the
    setpoints KE0, VRMAX0, VRMIN0.
    (For DC4B that is OpenIPSL's KE and InterPSS's KE and VRMAX; the standard
    computes neither.) PowerWorld 24 limits P + I by itself, and its sum with the
    derivative again: so it is with dialect: powerworld (vt within 6e-6 pu over a
    fault, otherwise 2e-4). Not modelled: UEL or OEL at the summing point.
    """
    return dc4b_limiting(pid, s, u, p, d)


def dc4b_limiting(
    limited: Callable[..., Any], s: Signal, u: Signal, p: Signal, d: Signal
) -> Signal:
    """DC4B with a form of its PID that says what VRMAX / KA and VRMIN / KA limit."""
    error = error_less_feedback(p.TF, s, u, p, d)
    low, high = s.VRMIN0 / p.KA, s.VRMAX0 / p.KA
    vpid, d.VI, d.VD = limited(error, s.VI, s.VD, p.KP, p.KI, p.KD, p.TD, low, high)
    fed = u.vt * clip(vpid, u.vuel, u.voel)
    vr, d.VR = limited_lag(fed, s.VR, p.KA, p.TA, u.vt * s.VRMIN0, u.vt * s.VRMAX0)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p, p.VEMIN)
    return efd


def dc4b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = commutator_start(efd, p, x)
    error, x.VI = pi_rest(vr / (p.KA * u.vt), p.KP, p.KI)
    x.VC, x.VD, x.VR, x.EFD, x.VF = u.vc1, error, vr, efd, efd
    return u.vc1 + error - u.vs


DC4B = documented(
    dc4b,
    dc4b_rest,
    sheet(
        *shared(TR=0.0, KP_OF_PID=80.0, KI_OF_PID=20.0, KD_OF_PID=20.0, TD=0.01),
        *shared(VRMAX_AT_VT_OR_0=2.7, VRMIN_AT_VT=0.0, KA_FIXED=1.0, TA=0.2, KE_OR_0=1.0, TE=0.8),
        *shared(KF_FIXED=0.0, TF=1.0, VEMIN=0.0, E1=2.33, SE1=0.27, E2=1.75, SE2=0.08),
    ),
    "VC VI VD VR EFD VF",
    aliases="ESDC4B",
    records=record(
        "DC4B",
        "TR KP KI KD TD VRMAX VRMIN KA TA KE TE KF TF VEMIN E1 SE1 E2 SE2",
        icons={"OEL": 2, "UEL": 2},
        places={2: "takeover"},
    ),
    setpoints="KE0 VRMAX0 VRMIN0",
    dialects={"powerworld": {"equations": partial(dc4b_limiting, pi_and_derivative)}},
)


def dc4c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """DC4C: commutator exciter, PID regulator with supply (IEEE Std 421.5-2016).

                             VRMAX/KA             UEL   OEL
    vref + vs + vsum ─►(+)─►[KPR + KIR/s      ]───►HV───►LV────┐
                      -▲ ▲- [+ sKDR/(1 + sTDR)]                │
           vc1 ►[  1  ]┘ │   VRMIN/KA                          │
                [1+sTR]  │                                     │
                         │         VRMAX                       │
                         │   ┌─[   KA   ]◄─────────────────────┘
                         │   │ [1 + sTA ]
                         │   │     VRMIN
                         │   └►(x)─►(+)─►[  1  ]─┬─────────────► efd
                         │      ▲   -▲   [ sTE ] │
                         │      VB   │    VEMIN  │
                         │           └── VFE ◄───┤
                         └──────[   sKF  ]◄──────┘
                                [1 + sTF ]

    VFE = KE EFD + VX(EFD). VB = VE FEX(KC1 VFE / VE), at most VBMAX, is the supply
    of the regulator. It comes from the terminals (SW1 = 1, position A of the
    drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with THETAP in degrees,
    or does not depend on them (SW1 = 2, B), VE = KP. The current IT, and so KI, XL
    and THETAP, act on load only. The limiters act at the summing point (vsum) or at
    the gates. The limits of the lag and of EFD are non-windup; the integral is
    frozen while the PID is at its limit. DC4B multiplies with VT before the lag TA:
    with TA = 0 and VB = VT they are one model. KE and VRMAX are used as given, also
    0. The drawing is PowerWorld's and InterPSS's, and vt that of PowerWorld 24
    (1e-6 pu over a fault, without KC1 and saturation); VFE as the current of the
    rectifier is InterPSS's. Typical data are the standard's, as GridKit has them,
    but for saturation (DC4B's; the SE of 1.54 at 4.8 lets no EFD pass 1.5) and KC1.
    """
    error = error_less_feedback(p.TF, s, u, p, d, u.vsum)
    low, high = p.VRMIN / p.KA, p.VRMAX / p.KA
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, low, high)
    gated = clip(vpid, u.vuel, u.voel)
    vr, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vb = supply(p.KC1 * exciter_demand(s.EFD, p.KE, p), u, p)
    efd, d.EFD = exciter(vr * vb, s.EFD, p.KE, p, p.VEMIN)
    return efd


def dc4c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vfe = exciter_demand(efd, p.KE, p)
    x.VR = vfe / supply(p.KC1 * vfe, u, p)
    error, x.VI = pi_rest(x.VR / p.KA, p.KPR, p.KIR)
    x.VC, x.VD, x.EFD, x.VF = u.vc1, error, efd, efd
    return u.vc1 + error - u.vs


OF_DC4C = (
    "TR KPR KIR KDR TDR VRMAX VRMIN KA TA KE TE KF TF VEMIN E1 SE1 E2 SE2 KP KI XL THETAP KC1 VBMAX"
)
DC4C = documented(
    dc4c,
    dc4c_rest,
    sheet(
        *shared(TR=0.0, KPR=80.0, KIR=20.0, KDR=20.0, TDR=0.01, VRMAX=2.7, VRMIN=-2.7),
        *shared(KA_FIXED=1.0, TA=0.02, KE_SIGNED=1.0, TE=0.8, KF_FIXED=0.0, TF=1.0, VEMIN=0.0),
        *shared(E1=2.33, SE1=0.27, E2=1.75, SE2=0.08),
        *ALTERNATOR_SUPPLY,
    ),
    "VC VI VD VR EFD VF",
    doubt="rests on one public diagram for the load of its supply (KC1), that of InterPSS",
    aliases="ESDC4C DC4CU1",
    records=(
        *record_of_2016(
            "DC4C",
            OF_DC4C,
            flags="OEL UEL SCL",
            switches="SW1",
            doubt="PSS/E 36 reads constants in this order as DC4CU1",
        ),
        *record_of_2016(
            "DC4CU1", OF_DC4C, flags="OEL UEL SCL", switches="SW1", user="2 0 4 24 6 6"
        ),
    ),
)
