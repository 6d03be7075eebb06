"""Alternator exciters with an inner field loop: AC7B and AC7C."""

from exfit.models.blocks import (
    Signal,
    field_demand,
    lag,
    larger,
    pi,
    pi_rest,
    pid,
    rectifier,
    washout,
    where,
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
    FREE,
    INTEGRAL_GAIN,
    LIMIT,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    PID_GAIN,
    POSITIVE_TIME,
    TWO_GATES,
    UP_TO_100,
    SearchRange,
    documented,
    record,
    record_of_2016,
    shared,
    sheet,
    with_typical,
)


def inner_loop(
    at_error: Gate, at_output: Gate, vs: Signal, s: Signal, u: Signal, p: Signal, d: Signal
) -> Signal:
    """Write the slopes into d and return efd.

    Limiters hold the error and the PID's output at two gates; ``vs`` is the supply of
    the amplifier.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF3, p.TF)
    error = gated(u.vref + u.vs + u.vsum - vc - vf, at_error)
    vr, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VRMIN, p.VRMAX)
    inner = gated(vr, at_output) - p.KF1 * rectifier(s.VE, p.KC * u.ifd) - p.KF2 * vfe
    va, d.VA = pi(inner, s.VA, p.KPA, p.KIA, p.VAMIN, p.VAMAX)
    efd, d.VE = limited_alternator(larger(vs * va, -p.KL * vfe), vfe, s, u, p)
    return efd


def at_rest(efd: Signal, vs: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd with a supply ``vs`` into x and return vref."""
    x.VE, vfe = alternator_rest(efd, u, p)
    inner, x.VA = pi_rest(vfe / vs, p.KPA, p.KIA)
    x.VD, x.VI = pi_rest(inner + p.KF1 * efd + p.KF2 * vfe, p.KPR, p.KIR)
    x.VC, x.VF = u.vc1, vfe
    return u.vc1 + x.VD - u.vs


def ac7b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC7B: alternator exciter with an inner field loop (IEEE Std 421.5-2005, 6.7).

               vsum       VRMAX              VAMAX
                 ▼
    vref + vs ─►(+)─►[KPR + KIR/s    ]─►(+)─►[KPA + KIA/s]─ VA ─►(x)─►[ HV ]─► VFD
               -▲ ▲- [+ sKDR/(1+sTDR)]  -▲       VAMIN            ▲   [gate]
                │ │       VRMIN          │                        │     ▲
                │ │           KF1 efd + KF2 VFE                 KP VT  -KL VFE
                │ │
                │ │  [  sKF3 ]                    VE <= VEMAX
                │ └──[1 + sTF]◄──┐   VFD ─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
                │                │         -▲   [ sTE ] │        ▲
    vc1 ►[  1  ]┘                │          │    VEMIN  │       FEX
         [1+sTR]                 └──────────┴─── VFE ◄──┘        ▲
                                                            KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
    limits of VE are non-windup; the integrals of the PID and of the PI are frozen
    while they would drive their output further beyond its limit. KP VT is the
    supply of the amplifier, with VT the terminal voltage itself. The exciter
    integrates, 1/sTE: the 1/(1+sTE) in the figure of 2005 is a misprint. An UEL is
    added at the first summing point.
    """
    return inner_loop(None, None, p.KP * u.vt, s, u, p, d)


def ac7b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    return at_rest(efd, p.KP * u.vt, u, p, x)


AC7B = documented(
    ac7b,
    ac7b_rest,
    sheet(
        *shared(TR=0.0, KPR_OF_REGULATOR=4.24, KIR_OF_REGULATOR=4.24),
        ("KDR", 0.0, "pu s", (0.0, 100000.0), "derivative gain of the regulator"),
        *shared(TDR=0.03, VRMAX=5.79, VRMIN=-5.79),
        ("KPA", 65.36, *PID_GAIN, "proportional gain of the amplifier"),
        ("KIA", 59.69, *INTEGRAL_GAIN, "integral gain of the amplifier", FREE),
        ("VAMAX", 1.0, *LIMIT, "amplifier ceiling"),
        ("VAMIN", -0.95, *LIMIT, "amplifier floor"),
        *shared(KP=4.96),
        ("KL", 10.0, "pu", (0.0, 9999.0), "lower limit of the field voltage per field current"),
        ("KF1", 0.212, *UP_TO_100, "feedback gain of the generator field voltage", FREE),
        ("KF2", 0.0, *UP_TO_100, "feedback gain of the exciter field current"),
        ("KF3", 0.0, *UP_TO_100, "stabilising feedback gain"),
        ("TF", 1.0, *POSITIVE_TIME, "stabilising feedback time constant", SearchRange(needs="KF3")),
        *shared(KC_FREE=0.18, KD=0.02, KE=1.0, TE=1.1, VFEMAX=6.9, VEMIN=0.0, E1=6.3, SE1=0.44),
        *shared(E2=4.725, SE2=0.075),
    ),
    "VC VI VD VF VA VE",
    aliases="ESAC7B",
    records=record(
        "AC7B",
        "TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL KF1 KF2 KF3 TF KC KD KE TE "
        "VFEMAX VEMIN E1 SE1 E2 SE2",
    ),
    pslf_records=record(
        "esac7b",
        "TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL TE VFEMAX VEMIN KE KC KD KF1 KF2 "
        "KF3 TF E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)


def amplifier_supply(efd: Signal, vfe: Signal, u: Signal, p: Signal) -> Signal:
    """Return VS, what the amplifier gets: of a source of its own, or of the exciter."""
    return where(p.SW2 < 1.5, supply(p.KC1 * vfe, u, p), p.KR * efd)


def ac7c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC7C: alternator exciter, inner field loop, supply (IEEE Std 421.5-2016).

              vsum  UEL OEL   VRMAX        UEL OEL        VAMAX
                ▼
    vref + vs ►(+)►[gates]►[KPR + KIR/s   ]►[gates]►(+)►[KPA + KIA/s]─ VA ►(x)► VFD
               -▲▲-        [+ sKDR/(1+sTDR)]         -▲                     ▲
                ││            VRMIN                   │   VAMIN             VS
                ││                             KF1 efd + KF2 VFE
                ││ [  sKF3 ]                       VE <= VEMAX
                │└─[1 + sTF]◄──┐ VFD ─►[HV]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
                │              │        ▲    -▲   [ sTE ] │        ▲
    vc1►[  1  ]─┘              │     -KL VFE  │    VEMIN  │       FEX
        [1+sTR]                └──────────────┴─── VFE ◄──┘        ▲
                                                              KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
    supply VS of the amplifier is VB (SW2 = 1, position A of the drawing) or KR efd
    (SW2 = 2, B). VB = VE1 FEX(KC1 VFE / VE1), at most VBMAX, comes from the
    terminals (SW1 = 1, A), VE1 = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
    THETAP in degrees, or does not depend on them (SW1 = 2, B), VE1 = KP. The
    current IT, and so KI, XL and THETAP, act on load only. The limits of VE are
    non-windup; the integrals of the PID and of the PI are frozen while they would
    drive their output further beyond its limit. With VB = KP VT (KC1 = 0, VBMAX out
    of reach) it is AC7B.

    The limiters act at the summing point (vsum), at the gates before the PID or at
    those behind it. Dynawo and InterPSS draw the same. Not modelled: a gate of the
    OEL behind the PI, and a stabiliser that is added behind the first gate (VOS = 2
    in a PSS/E record). The data of the supply, but for KP, are not those of a
    sample.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    vs = amplifier_supply(rectifier(s.VE, p.KC * u.ifd), vfe, u, p)
    return inner_loop((u.vuel, u.voel), (u.vuel_out, u.voel_out), vs, s, u, p, d)


def ac7c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    _, vfe = alternator_rest(efd, u, p)
    return at_rest(efd, amplifier_supply(efd, vfe, u, p), u, p, x)


AC7C = documented(
    ac7c,
    ac7c_rest,
    sheet(
        *AC7B.sheet,
        *(row for row in with_typical(ALTERNATOR_SUPPLY, KC1=0.2, VBMAX=7.0) if row.symbol != "KP"),
        ("SW2", 1.0, "1", (1.0, 2.0), "supply of the amplifier: 1 VB, 2 field voltage"),
        *shared(KR=4.0),
    ),
    "VC VI VD VF VA VE",
    aliases="ESAC7C",
    records=record_of_2016(
        "AC7C",
        "TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL KF1 KF2 KF3 TF KC KD KE TE "
        "VFEMAX VEMIN E1 SE1 E2 SE2 KI XL THETAP KC1 VBMAX KR",
        switches="VOS SW1 SW2",
        places=TWO_GATES,
        doubt=OF_TWO_PROGRAMS,
    ),
)
