"""Alternator exciters that supply their own regulator: AC3A, AC3C and EXAC3."""

from exfit.models.blocks import (
    Signal,
    clip,
    field_ceiling,
    field_demand,
    lag,
    larger,
    lead_lag,
    limited_integrator,
    limited_lag,
    pi_rest,
    pid,
    rectifier,
    washout,
    where,
)
from exfit.models.exciter_parts import alternator_rest
from exfit.models.sheet import (
    LIMIT,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    ONE_GATE,
    PID_GAIN,
    UP_TO_1000,
    documented,
    record,
    record_of_2016,
    shared,
    sheet,
)


def feedback(efd: Signal, p: Signal) -> Signal:
    """Return VN, the field voltage through a gain that changes at EFDN."""
    return where(efd < p.EFDN, p.KF * efd, p.KF * p.EFDN + p.KN * (efd - p.EFDN))


def ac3a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC3A: self-excited alternator exciter (IEEE Std 421.5-2005, 6.3).

              vsum           UEL       VAMAX               VE <= VEMAX
                ▼
    vref + vs ►(+)►[1 + sTC]─►HV─►(+)─►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─ VE ─►(x)─┬►efd
              -▲   [1 + sTB]     -▲    [1+sTA]    ▲  -▲    [ sTE ] │        ▲  │
               │                  │    VAMIN      │   │    VEMIN   │       FEX │
               │                  │            KR efd └─── VFE ◄───┘        ▲  │
    vc1►[  1  ]┘            ┌─────┘                                KC IFD / VE │
        [1+sTR]             │  [   s   ]                                       │
                            └──[1 + sTF]◄─ VN ─[ KF to EFDN, then KN ]◄────────┘

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. VN has
    the slope KF up to EFDN and KN beyond it. The exciter supplies its regulator, so
    the gain of both grows with efd. The limits of the lag and of VE are non-windup.

    VF is subtracted behind the lead-lag, as in the models written after PSS/E's
    ESAC3A. Not modelled: the low voltage limiter (KLV, VLV) of the model of 1981,
    which IEEE Std 421.5 and ESAC3A replaced by VEMIN. An OEL is added to vs.
    VEMIN is 0.1 here; with 0, as in some copies of the sample data, VE stays at 0
    once it is there, since the regulator then has no supply.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    vemax = field_ceiling(s.VE, vfe, p)
    # before the integrator that makes it: the exciter feeds its own regulator
    efd = rectifier(clip(s.VE, p.VEMIN, vemax), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(feedback(efd, p), s.VF, 1.0, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(larger(vl, u.vuel) - vf, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    _, d.VE = limited_integrator(p.KR * efd * va - vfe, s.VE, p.TE, p.VEMIN, vemax)
    return efd


def ac3a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve, vfe = alternator_rest(efd, u, p)
    va = vfe / (p.KR * efd)
    error = va / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, va, ve, feedback(efd, p)
    return u.vc1 + error - u.vs


AC3A = documented(
    ac3a,
    ac3a_rest,
    sheet(
        *shared(TR=0.0, TB=0.0, TC=0.0, KA=45.62, TA=0.013, VAMAX=1.0, VAMIN=-0.95, TE=1.17),
        *shared(VEMIN=0.1, KR=3.77, KF_TO_EFDN=0.143, TF=1.0, KN=0.05, EFDN=2.36, KC_FREE=0.104),
        *shared(KD=0.499, KE=1.0, VFEMAX=16.0, E1=6.24, SE1=1.143, E2=4.68, SE2=0.1),
    ),
    "VC VL VA VE VF",
    aliases="ESAC3A",
    records=record(
        "ESAC3A",
        "TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2",
    ),
    pslf_records=record(
        "esac3a",
        "TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)


def ac3c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC3C: self-excited alternator exciter with a PID (IEEE Std 421.5-2016).

              vsum     VPIDMAX                   UEL OEL      VAMAX
                ▼
    vref + vs ►(+)─►[KPR + KIR/s   ]─►[1 + sTC]─►[gates]►(+)─►[  KA  ]─┐
              -▲    [+ sKDR/(1+sTDR)] [1 + sTB]         -▲    [1+sTA]  │ VA
               │     VPIDMIN                             │     VAMIN   ▼
    vc1►[  1  ]┘                                         │   KR efd ─►(x)
        [1+sTR]                                          │             │
                ┌────────────────────────────────────────┘ VE <= VEMAX ▼
                │                        efd ◄──(x)◄─ VE ─┬─[  1  ]◄──(+)
                │                                ▲        │ [ sTE ]   -▲
                │                               FEX       │   VEMIN    │
                │  [   s   ]                     ▲        └───► VFE ───┘
                └──[1 + sTF]◄─ VN         KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. VN is
    efd through a gain KF up to EFDN and KN beyond it. The exciter supplies its
    regulator, so the gain of both grows with efd. The limits of the lag and of VE
    are non-windup; the integral is frozen while the PID is at its limit. With a
    PID of 1 (KPR = 1, KIR = KDR = 0) it is AC3A, whose sample data it has. The PID
    is not that of a sample: GridKit, with the standard's sample data, has it at 1.

    The limiters act at the summing point (vsum) or at the gates. The sources are
    the drawing of 2005, the program InterPSS, which adds the PID and the gates, and
    the parameters that PowerWorld lists. The PID is that of PowerWorld 24 (vt 1e-6
    pu over a fault, KC = KD = 0); the gates rest on InterPSS alone. VEMIN is 0.1
    here; with 0 VE stays at 0 once it is there, since the regulator then has no
    supply.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    vemax = field_ceiling(s.VE, vfe, p)
    # before the integrator that makes it: the exciter feeds its own regulator
    efd = rectifier(clip(s.VE, p.VEMIN, vemax), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(feedback(efd, p), s.VF, 1.0, p.TF)
    error = u.vref + u.vs + u.vsum - vc
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    vl, d.VL = lead_lag(vpid, s.VL, p.TC, p.TB)
    gated = clip(vl, u.vuel, u.voel)
    va, d.VA = limited_lag(gated - vf, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    _, d.VE = limited_integrator(p.KR * efd * va - vfe, s.VE, p.TE, p.VEMIN, vemax)
    return efd


def ac3c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ac3a_rest(efd, u, p, x)
    x.VD, x.VI = pi_rest(x.VL, p.KPR, p.KIR)
    return u.vc1 + x.VD - u.vs


AC3C = documented(
    ac3c,
    ac3c_rest,
    sheet(
        *AC3A.sheet,
        ("KPR", 1.0, *PID_GAIN, "proportional gain"),
        *shared(KIR=0.5),
        ("KDR", 0.0, "pu s", (0.0, 100000.0), "derivative gain"),
        *shared(TDR=0.1, VPIDMAX=1.0, VPIDMIN=-1.0),
    ),
    "VC VL VA VE VF VI VD",
    aliases="ESAC3C",
    records=record_of_2016(
        "AC3C",
        "TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2 KPR "
        "KIR KDR TDR VPIDMAX VPIDMIN",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)


def exac3(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXAC3: self-excited alternator exciter (IEEE type AC3 of 1981).

              vsum             VAMAX                  VE >= 0
                ▼
    vref + vs ►(+)►[1 + sTC]►HV►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─ VE ─►(x)─┬► efd
              -▲ ▲-[1 + sTB] ▲  [1+sTA]    ▲   -▲   [ sTE ] │        ▲  │
               │ │           │  VAMIN      │    │           │       FEX │
               │ │  KLV (VLV - efd)     KR efd  └─── VFE ◄──┘        ▲  │
               │ │                                          KC IFD / VE │
    vc1►[  1  ]┘ └─[   s   ]◄─ VN ─[ KF to EFDN, then KN ]◄─────────────┘
        [1+sTR]    [1 + sTF]

    VFE = KE VE + VX(VE) + KD IFD. VN has the slope KF up to EFDN and KN beyond it.
    The exciter supplies its regulator, so the gain of both grows with efd. The high
    value gate HV keeps efd near VLV at least. The limits of the lag and of VE are
    non-windup. AC3A, of 1992 and 2005, has a floor and a ceiling of VE in place of
    the gate, and its feedback behind the lead-lag.

    Two open models written after PSS/E's EXAC3 agree but for VN: in one KF and KN
    are gains of all of efd, beyond EFDN and up to it, so that VN jumps there.
    Typical data are those of a PSS/E record. Not modelled: UEL and OEL other than
    at the summing point.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    # before the integrator that makes it: the exciter feeds its own regulator
    efd = rectifier(larger(s.VE, 0.0), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(feedback(efd, p), s.VF, 1.0, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc - vf, s.VL, p.TC, p.TB)
    gated = larger(vl, p.KLV * (p.VLV - efd))
    va, d.VA = limited_lag(gated, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    _, d.VE = limited_integrator(p.KR * efd * va - vfe, s.VE, p.TE, low=0.0)
    return efd


EXAC3 = documented(
    exac3,
    ac3a_rest,
    sheet(
        *shared(TR=0.0, TB=0.0, TC=0.0, KA=78.04, TA=0.013, VAMAX=1.0, VAMIN=-0.95, TE=3.71),
        ("KLV", 0.167, *UP_TO_1000, "gain of the low voltage limiter"),
        *shared(KR=6.99, KF_TO_EFDN=0.143, TF=1.0, KN=0.05, EFDN=1.603, KC_FREE=0.14, KD=1.02),
        *shared(KE=1.0),
        ("VLV", 0.46, *LIMIT, "field voltage of the low voltage limiter"),
        *shared(E1=4.64, SE1=0.186, E2=6.19, SE2=1.391),
    ),
    "VC VL VA VE VF",
    records=record(
        "EXAC3", "TR TB TC KA TA VAMAX VAMIN TE KLV KR KF TF KN EFDN KC KD KE VLV E1 SE1 E2 SE2"
    ),
)
