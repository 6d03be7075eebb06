"""Commutator exciters with a continuous regulator: DC1, DC2 and what came before them."""

from exfit.models.blocks import (
    Signal,
    clip,
    commutator_start,
    exciter,
    inf,
    lag,
    larger,
    lead_lag,
    limited_lag,
    washout,
)
from exfit.models.exciter_parts import error_less_feedback
from exfit.models.sheet import (
    LAG_OF_KF,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    POSITIVE_TIME,
    Records,
    documented,
    record,
    record_of_2016,
    renamed,
    shared,
    sheet,
    with_typical,
)

STATES, SETPOINTS = "VC VL VR EFD VF", "KE0 VRMAX0 VRMIN0"


def record_of_psse(name: str, TF: str, times_speed: bool = False, doubt: str = "") -> Records:
    """Return PSS/E's record of an exciter with a lead-lag; Switch is not used there."""
    order = f"TR KA TA TB TC VRMAX VRMIN KE TE KF {TF} Switch E1 SE1 E2 SE2"
    return record(name, order, absent={"Switch": 0.0}, times_speed=times_speed, doubt=doubt)


def record_of_pslf(name: str) -> Records:
    """Return PSLF's record of an exciter of 2005."""
    return record(
        name,
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF SPDMLT E1 SE1 E2 SE2 UELIN EXCLIM",
        ignored="SPDMLT UELIN",
        absent={"EXCLIM": 1.0},
        spelled={"TF": "tf1"},
        doubt=OF_A_LIST,
    )


def with_limits(name: str) -> Records:
    """Return the record of an exciter of 2016."""
    order = "TR KA TA TB TC VRMAX VRMIN KE TE KF TF E1 SE1 E2 SE2 VEMAX VEMIN"
    return record_of_2016(name, order, doubt=OF_TWO_PROGRAMS)


def excited(
    regulated: Signal,
    supply: Signal,
    s: Signal,
    p: Signal,
    d: Signal,
    low: Signal = -inf,
    high: Signal = inf,
) -> Signal:
    """Return EFD between ``low`` and ``high``; VR is limited in proportion to ``supply``."""
    floor, ceiling = supply * s.VRMIN0, supply * s.VRMAX0
    vr, d.VR = limited_lag(regulated, s.VR, p.KA, p.TA, floor, ceiling)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p, low, high)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = commutator_start(efd, p, x)
    error = vr / p.KA
    x.VC, x.VL, x.VR, x.EFD, x.VF = u.vc1, error, vr, efd, efd
    return u.vc1 + error - u.vs


def dc1a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """DC1A: commutator exciter, continuous regulator (IEEE Std 421.5-2005, 5.1).

                                      VRMAX          EFD >= 0
    vref + vs ─►(+)─►[1 + sTC]─►HV───►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
               -▲ ▲- [1 + sTB]  ▲     [1+sTA]   -▲   [ sTE ] │
                │ │             │     VRMIN      │           │
    vc1 ►[  1  ]┘ │            VUEL              └── VFE ◄───┤
         [1+sTR]  └─────────[  sKF  ]◄───────────────────────┘
                            [1 + sTF]

    VFE = KE EFD + VX(EFD). The limits are non-windup; EFD >= 0 is PSS/E's
    (the standard is not clear there; ANDES has no such limit).
    KE = 0 is self-excited: KE is computed at the start so that VR starts at
    VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
    VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
    (SE(E) E where KE < 0), VRMIN = -VRMAX (ANDES: 999). The values in use are the
    setpoints KE0, VRMAX0, VRMIN0.
    Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
    """
    vl, d.VL = lead_lag(error_less_feedback(p.TF, s, u, p, d), s.VL, p.TC, p.TB)
    return excited(larger(vl, u.vuel), 1.0, s, p, d, 0.0)


DC1A = documented(
    dc1a,
    rest,
    sheet(
        *shared(TR=0.0, KA=46.0, TA=0.06, TB=0.0, TC=0.0, VRMAX_OR_0=1.0, VRMIN=-0.9, KE_OR_0=0.0),
        *shared(TE=0.46, KF=0.1, TF=1.0, E1=3.1, SE1=0.33, E2=2.3, SE2=0.1),
    ),
    STATES,
    aliases="ESDC1A",
    records=record_of_psse("ESDC1A", "TF"),
    pslf_records=record_of_pslf("esdc1a"),
    setpoints=SETPOINTS,
)


def dc1c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """DC1C: commutator exciter, continuous regulator (IEEE Std 421.5-2016).

                                     UEL   OEL     VRMAX           VEMAX
    vref + vs + vsum ─►(+)─►[1 + sTC]─►HV───►LV──►[  KA  ]─►(+)─►[  1  ]─┬─► efd
                      -▲ ▲- [1 + sTB]             [1+sTA]   -▲   [ sTE ] │
                       │ │                         VRMIN     │    VEMIN  │
           vc1 ►[  1  ]┘ │                                   └── VFE ◄───┤
                [1+sTR]  └────────────[  sKF  ]◄─────────────────────────┘
                                      [1 + sTF]

    VFE = KE EFD + VX(EFD). DC1A with the places of the limiters of 2016: they act
    at the summing point (vsum) or at the gates. The limits are non-windup. EFD is
    limited as in PSS/E, with VEMAX and VEMIN; Dynawo has the floor alone, and the
    sample data neither. Of the signs at the sum Dynawo adds OEL and SCL, PowerWorld
    subtracts them: here vsum is what is added. KE = 0 is self-excited: KE is
    computed at the start so that VR starts at VRMAX / 10, as in PSS/E (IEEE 421.5:
    at VR = 0). VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of
    E1, E2 (SE(E) E where KE < 0), VRMIN = -VRMAX. The values in use are the
    setpoints KE0, VRMAX0, VRMIN0. Typical data are the standard's, as GridKit has
    them.
    """
    vl, d.VL = lead_lag(error_less_feedback(p.TF, s, u, p, d, u.vsum), s.VL, p.TC, p.TB)
    return excited(clip(vl, u.vuel, u.voel), 1.0, s, p, d, p.VEMIN, p.VEMAX)


DC1C = documented(
    dc1c,
    rest,
    (*DC1A.sheet, *shared(VEMAX=99.0, VEMIN=0.0)),
    STATES,
    aliases="ESDC1C",
    records=with_limits("DC1C"),
    setpoints=SETPOINTS,
)


def dc2a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """DC2A: commutator exciter, bus-fed regulator (IEEE Std 421.5-2005, 5.2).

                                      VT VRMAX       EFD >= 0
    vref + vs ─►(+)─►[1 + sTC]─►HV───►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
               -▲ ▲- [1 + sTB]  ▲     [1+sTA]   -▲   [ sTE ] │
                │ │             │     VT VRMIN   │           │
    vc1 ►[  1  ]┘ │            VUEL              └── VFE ◄───┤
         [1+sTR]  └─────────[  sKF  ]◄───────────────────────┘
                            [1 + sTF]

    VFE = KE EFD + VX(EFD). As DC1A, but the regulator's limits are
    proportional to the terminal voltage VT. They are non-windup; EFD >= 0 is
    PSS/E's (ANDES has no such limit, and ignores TR).
    KE = 0 is self-excited: KE is computed at the start so that VR starts at
    VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
    VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
    (SE(E) E where KE < 0), VRMIN = -VRMAX (ANDES: 999). The values in use are the
    setpoints KE0, VRMAX0, VRMIN0.
    Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
    """
    vl, d.VL = lead_lag(error_less_feedback(p.TF, s, u, p, d), s.VL, p.TC, p.TB)
    return excited(larger(vl, u.vuel), u.vt, s, p, d, 0.0)


DC2A = documented(
    dc2a,
    rest,
    sheet(
        *shared(TR=0.0, KA=300.0, TA=0.01, TB=0.0, TC=0.0, VRMAX_AT_VT_OR_0=4.95, VRMIN_AT_VT=-4.9),
        *shared(KE_OR_0=1.0, TE=1.33, KF=0.02, TF=0.675, E1=3.05, SE1=0.279, E2=2.29, SE2=0.117),
    ),
    STATES,
    aliases="ESDC2A",
    records=record_of_psse("ESDC2A", "TF"),
    pslf_records=record_of_pslf("esdc2a"),
    setpoints=SETPOINTS,
)


def dc2c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """DC2C: commutator exciter, bus-fed regulator (IEEE Std 421.5-2016).

                                     UEL   OEL    VT VRMAX         VEMAX
    vref + vs + vsum ─►(+)─►[1 + sTC]─►HV───►LV──►[  KA  ]─►(+)─►[  1  ]─┬─► efd
                      -▲ ▲- [1 + sTB]             [1+sTA]   -▲   [ sTE ] │
                       │ │                        VT VRMIN   │    VEMIN  │
           vc1 ►[  1  ]┘ │                                   └── VFE ◄───┤
                [1+sTR]  └────────────[  sKF  ]◄─────────────────────────┘
                                      [1 + sTF]

    VFE = KE EFD + VX(EFD). As DC1C, but the regulator's limits are proportional to
    the terminal voltage VT. It is DC2A with the places of the limiters of 2016:
    they act at the summing point (vsum) or at the gates. The limits are non-windup.
    EFD is limited as in PSS/E, with VEMAX and VEMIN. KE = 0 is self-excited: KE is
    computed at the start so that VR starts at VRMAX / 10, as in PSS/E (IEEE 421.5:
    at VR = 0). VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of
    E1, E2 (SE(E) E where KE < 0), VRMIN = -VRMAX. The values in use are the
    setpoints KE0, VRMAX0, VRMIN0. Typical data are the standard's, as GridKit has
    them.
    """
    vl, d.VL = lead_lag(error_less_feedback(p.TF, s, u, p, d, u.vsum), s.VL, p.TC, p.TB)
    return excited(clip(vl, u.vuel, u.voel), u.vt, s, p, d, p.VEMIN, p.VEMAX)


DC2C = documented(
    dc2c,
    rest,
    (*DC2A.sheet, *shared(VEMAX=99.0, VEMIN=0.0)),
    STATES,
    aliases="ESDC2C",
    records=with_limits("DC2C"),
    setpoints=SETPOINTS,
)


def ieeet1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """IEEET1: commutator exciter, IEEE type 1 of 1968 (PSS/E IEEET1).

                     VRMAX
    vref + vs ─►(+)─►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
               -▲ ▲- [1+sTA]   -▲   [ sTE ] │
                │ │  VRMIN      │           │
    vc1 ►[  1  ]┘ │             └── VFE ◄───┤
         [1+sTR]  └──[  sKF ]◄──────────────┘
                     [1+sTF]

    VFE = KE EFD + VX(EFD). The limits are non-windup; EFD may be negative.
    KE = 0 is self-excited: KE is computed at the start so that VR starts at
    VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
    VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
    (SE(E) E where KE < 0), VRMIN = -VRMAX (ANDES: 999). The values in use are the
    setpoints KE0, VRMAX0, VRMIN0.
    Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
    """
    return excited(error_less_feedback(p.TF, s, u, p, d), 1.0, s, p, d)


def ieeet1_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = commutator_start(efd, p, x)
    x.VC, x.VR, x.EFD, x.VF = u.vc1, vr, efd, efd
    return u.vc1 + vr / p.KA - u.vs


IEEET1 = documented(
    ieeet1,
    ieeet1_rest,
    sheet(
        *shared(TR=0.02, KA=50.0, TA=0.06, VRMAX_OR_0=7.3, VRMIN=-7.3, KE_OR_0=1.0, TE=0.5),
        *shared(KF=0.08, TF=1.0, E1=3.1, SE1=0.33, E2=2.3, SE2=0.1),
    ),
    "VC VR EFD VF",
    records=record(
        "IEEET1", "TR KA TA VRMAX VRMIN KE TE KF TF Switch E1 SE1 E2 SE2", absent={"Switch": 0.0}
    ),
    setpoints=SETPOINTS,
)


def ieeex1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """IEEEX1: commutator exciter, type 1 of 1979, DC1 of 1981 (PSS/E IEEEX1).

                                VRMAX
    vref + vs ─►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
               -▲ ▲- [1 + sTB]  [1+sTA]   -▲   [ sTE ] │
                │ │             VRMIN      │           │
    vc1 ►[  1  ]┘ │                        └── VFE ◄───┤
         [1+sTR]  └──────[  sKF  ]◄────────────────────┘
                         [1 + sTF1]

    VFE = KE EFD + VX(EFD). The limits are non-windup; EFD may be negative.
    The limits do not follow VT, as in OpenIPSL and the DC1 of 1981 (ANDES has them
    proportional to VT here, and not in EXDC2: the two are interchanged).
    KE = 0 is self-excited: KE is computed at the start so that VR starts at
    VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
    VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
    (SE(E) E where KE < 0), VRMIN = -VRMAX. The values in use are the setpoints
    KE0, VRMAX0, VRMIN0.
    Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
    """
    vl, d.VL = lead_lag(error_less_feedback(p.TF1, s, u, p, d), s.VL, p.TC, p.TB)
    return excited(vl, 1.0, s, p, d)


IEEEX1 = documented(
    ieeex1,
    rest,
    sheet(
        *shared(TR=0.0, KA=40.0, TA=0.04, TB=0.0, TC=0.0, VRMAX_OR_0=7.3, VRMIN=-7.3, KE_OR_0=1.0),
        *shared(TE=0.8, KF=0.03, TF1=1.0, E1=2.4, SE1=0.03, E2=5.0, SE2=0.5),
    ),
    STATES,
    aliases="EXDC1",
    records=(
        *record_of_psse("IEEEX1", "TF1"),
        *record_of_psse("EXDC1", "TF1", doubt="PSS/E has it as IEEEX1, whose order is taken"),
    ),
    pslf_records=record(
        "exdc1", "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 E1 SE1 E2 SE2", doubt=OF_A_LIST
    ),
    setpoints=SETPOINTS,
)


def exdc2(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXDC2: commutator exciter, bus-fed regulator, DC2 of 1981 (PSS/E EXDC2).

                                VT VRMAX
    vref + vs ─►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
               -▲ ▲- [1 + sTB]  [1+sTA]   -▲   [ sTE ] │
                │ │             VT VRMIN   │           │
    vc1 ►[  1  ]┘ │                        └── VFE ◄───┤
         [1+sTR]  └──────[  sKF  ]◄────────────────────┘
                         [1 + sTF1]

    VFE = KE EFD + VX(EFD). The limits are non-windup; EFD may be negative.
    The limits are proportional to VT, as in the DC2 of 1981, Opal-RT and InterPSS
    (ANDES and GridPACK hold them constant). InterPSS and ANDES multiply efd by the
    speed, Opal-RT does not; import takes it as multiplied (efd_times_speed).
    KE = 0 is self-excited: KE is computed at the start so that VR starts at
    VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
    VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
    (SE(E) E where KE < 0), VRMIN = -VRMAX. The values in use are the setpoints
    KE0, VRMAX0, VRMIN0.
    Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
    """
    vl, d.VL = lead_lag(error_less_feedback(p.TF1, s, u, p, d), s.VL, p.TC, p.TB)
    return excited(vl, u.vt, s, p, d)


EXDC2 = documented(
    exdc2,
    rest,
    renamed(DC2A.sheet, TF="TF1"),
    STATES,
    records=record_of_psse("EXDC2", "TF1", times_speed=True),
    pslf_records=record(
        "exdc2",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2",
        absent={"TF2": 0.0},
        doubt=OF_A_LIST,
    ),
    setpoints=SETPOINTS,
)


def exdc2a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXDC2A: commutator exciter, bus-fed regulator with a feedback of its own (PSLF exdc2a).

                                        VT VRMAX
    vref + vs ─►(+)─►[1 + sTC]─►[  KA  ]──┬──►(+)─►[  1  ]─┬─► efd
               -▲ ▲- [1 + sTB]  [1+sTA]   │   -▲   [ sTE ] │
                │ │             VT VRMIN  │    └── VFE ◄───┘
    vc1 ►[  1  ]┘ │                       │
         [1+sTR]  └─[   1   ]◄─[  sKF  ]◄─┘
                    [1 + sTF2] [1 + sTF1]

    VFE = KE EFD + VX(EFD). The limits are non-windup; EFD may be negative. KE = 0
    and VRMAX = 0 are computed at the start as for EXDC2; the values in use are the
    setpoints KE0, VRMAX0, VRMIN0.

    InterPSS writes this: EXDC2 with the rate feedback of VR, as in IEEET2. CIM's
    ExcDC2A has one more block in the feedback, too, but PowerWorld says that with
    TF2 = 0 it is EXDC2, whose feedback is of EFD: TF2 = 0 is refused. No curve
    decides. InterPSS multiplies efd by the speed, which a case does with
    efd_times_speed. Typical data are DC2A's but for KA, TA, KF, TF1 and TF2, which
    are those of a record of InterPSS. Not modelled: UEL or OEL.
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(u.vref + u.vs - vc - s.VF2, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, u.vt * s.VRMIN0, u.vt * s.VRMAX0)
    vf, d.VF1 = washout(vr, s.VF1, p.KF, p.TF1)
    _, d.VF2 = lag(vf, s.VF2, 1.0, p.TF2)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p)
    return efd


def exdc2a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = commutator_start(efd, p, x)
    error = vr / p.KA
    x.VC, x.VL, x.VR, x.EFD, x.VF1, x.VF2 = u.vc1, error, vr, efd, vr, 0.0
    return u.vc1 + error - u.vs


OF_EXDC2A = "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2"
EXDC2A = documented(
    exdc2a,
    exdc2a_rest,
    sheet(
        *with_typical(renamed(DC2A.sheet, TF="TF1"), KA=40.0, TA=0.02, KF=0.03, TF1=1.0),
        ("TF2", 0.25, *POSITIVE_TIME, "second stabilising feedback time constant", LAG_OF_KF),
    ),
    "VC VL VR EFD VF1 VF2",
    records=record("EXDC2A", OF_EXDC2A, doubt="its order is InterPSS's"),
    pslf_records=record("exdc2a", OF_EXDC2A, doubt=OF_A_LIST),
    setpoints=SETPOINTS,
    doubt="rests on one public program, InterPSS; no other source says that VR is fed back",
)
