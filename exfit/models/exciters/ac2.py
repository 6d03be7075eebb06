"""Alternator exciters with high initial response: AC2A, AC2C and EXAC2."""

from exfit.models.blocks import Signal, clip, field_ceiling, field_demand, smaller
from exfit.models.exciter_parts import alternator, alternator_rest, limited_alternator, regulated
from exfit.models.sheet import (
    AS_IN_PSSE,
    LIMIT,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    PID_GAIN,
    documented,
    record,
    record_of_2016,
    renamed,
    shared,
    sheet,
)


def ac2a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC2A: alternator exciter with high initial response (IEEE Std 421.5-2005, 6.2).

                                  VAMAX                UEL  OEL  VRMAX
    vref + vs ──►(+)─►[1 + sTC]──►[  KA  ]─►(+)─►[KB]─►HV──►LV─►[clip]─┐
               -▲   ▲-[1 + sTB]   [1+sTA]  -▲                   VRMIN  │ VR
                │   │             VAMIN     │            VE <= VEMAX   ▼
    vc1 ►[  1  ]┘   │                       │    ┌─ VE ─┬─[  1  ]◄────(+)
         [1+sTR]    │                       │    ▼      │ [ sTE ]     -▲
                    │                efd ◄──┼───(x)     │ VE >= 0      │
                    │                       │    ▲      │              │
                    │                       │   FEX     └──► VFE ──────┤
                    │                       │    ▲                     │
                    │ [  sKF  ]             │   KC IFD / VE            │
                    └─[1 + sTF]◄──────┐     └─[KH]◄────────────────────┤
                                      └────────────────────────────────┘

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX,
    (VFEMAX - KD IFD) / (KE + SE(VE)): the limit of the exciter's field current. The
    limits of the lag and of VE are non-windup; the clamp to VRMAX, VRMIN is not. KH
    closes a loop that shortens the exciter's time constant, so at rest
    VA = VFE / KB + KH VFE.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    va = regulated(vfe, s, u, p, d)
    vr = clip(clip(p.KB * (va - p.KH * vfe), u.vuel, u.voel), p.VRMIN, p.VRMAX)
    efd, d.VE = alternator(vr, vfe, s, u, p, 0.0, field_ceiling(s.VE, vfe, p))
    return efd


def ac2a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve, vfe = alternator_rest(efd, u, p)
    va = vfe / p.KB + p.KH * vfe
    error = va / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, va, ve, vfe
    return u.vc1 + error - u.vs


AC2A = documented(
    ac2a,
    ac2a_rest,
    sheet(
        *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.02, VAMAX=8.0, VAMIN=-8.0, KB=25.0),
        *shared(VRMAX_OF_EXCITER=105.0, VRMIN_OF_EXCITER=-95.0, TE=0.6, VFEMAX=4.4, KH=1.0),
        *shared(KF=0.03, TF=1.0, KC_FREE=0.28, KD=0.35, KE=1.0, E1=4.4, SE1=0.037, E2=3.3),
        *shared(SE2=0.012),
    ),
    "VC VL VA VE VF",
    aliases="ESAC2A",
    records=record(
        "ESAC2A",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 E2 SE2",
    ),
    pslf_records=record(
        "esac2a",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 E2 SE2 "
        "SPDMLT",
        ignored="SPDMLT",
        doubt=AS_IN_PSSE,
    ),
)


def ac2c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC2C: alternator exciter with high initial response (IEEE Std 421.5-2016).

              vsum              VAMAX              UEL OEL   EFEMAX
                ▼
    vref + vs ►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[KB]─►[gates]─►[clip]─┐
              -▲ ▲- [1 + sTB]  [1+sTA]  -▲                   EFEMIN │ EFE
               │ │              VAMIN    └─[KH]◄──┐                 │
    vc1►[  1  ]┘ │                                │   VE <= VEMAX   ▼
        [1+sTR]  │          efd ◄─(x)◄─ VE ──┬────┼─────[  1  ]◄───(+)
                 │                 ▲         │    │     [ sTE ]    -▲
                 │                FEX        │    │      VEMIN      │
                 │                 ▲         └────┼─────► VFE ──────┤
                 │            KC IFD / VE         │                 │
                 │  [  sKF  ]                     │                 │
                 └──[1 + sTF]◄────────────────────┴─────────────────┘

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
    limits of the lag and of VE are non-windup; the clamp behind the gates is not.
    KH closes a loop that shortens the exciter's time constant, so at rest
    VA = VFE / KB + KH VFE. With VEMIN = 0 it is AC2A, whose VRMAX and VRMIN are
    EFEMAX and EFEMIN here.

    The limiters act at the summing point (vsum) or at the gates. The sources are
    the drawing of 2005, which differs in nothing else, the program InterPSS and the
    parameters that PowerWorld lists.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    va = regulated(vfe, s, u, p, d, u.vsum)
    efe = clip(clip(p.KB * (va - p.KH * vfe), u.vuel, u.voel), p.EFEMIN, p.EFEMAX)
    efd, d.VE = limited_alternator(efe, vfe, s, u, p)
    return efd


AC2C = documented(
    ac2c,
    ac2a_rest,
    (*renamed(AC2A.sheet, VRMAX="EFEMAX", VRMIN="EFEMIN"), *shared(VEMIN=0.0)),
    "VC VL VA VE VF",
    aliases="ESAC2C",
    records=record_of_2016(
        "AC2C",
        "TR TB TC KA TA VAMAX VAMIN KB EFEMAX EFEMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 E2 SE2 "
        "VEMIN",
        doubt=OF_TWO_PROGRAMS,
    ),
)


def exac2(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXAC2: high initial response alternator exciter (IEEE type AC2 of 1981).

                                 VAMAX                        VRMAX
    vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[ LV ]─►[ KB ]─►[clip]─► VR
               -▲   ▲-[1 + sTB]  [1+sTA]  -▲    [gate]           VRMIN
                │   │            VAMIN     │      ▲
                │   │                   KH VFE   KL (VLR - VFE)
                │   │
                │   │  [  sKF  ]                  VE >= 0
                │   └──[1 + sTF]◄─┐   VR ─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
                │                 │        -▲   [ sTE ] │        ▲
    vc1 ►[  1  ]┘                 └─────────┴── VFE ◄───┘       FEX
         [1+sTR]                                                 ▲
                                                            KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD. The limits of the lag and of VE are non-windup;
    the clamp behind KB is not. The low value gate limits the exciter's field
    current, in the end to VFE = VLR KB KL / (1 + KB KL). A start beyond the gate is
    refused; some programs raise VLR without a message instead. The AC2A of 1992 and
    2005 is another model, with a ceiling of VE and no such gate. Not modelled: the
    UEL and OEL inputs, which some programs add at the first summing point.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    va = regulated(vfe, s, u, p, d)
    gated = smaller(va - p.KH * vfe, p.KL * (p.VLR - vfe))
    vr = clip(p.KB * gated, p.VRMIN, p.VRMAX)
    efd, d.VE = alternator(vr, vfe, s, u, p)
    return efd


EXAC2 = documented(
    exac2,
    ac2a_rest,
    sheet(
        *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.01, VAMAX=8.0, VAMIN=-8.0, KB=25.0),
        *shared(VRMAX_OF_EXCITER=105.0, VRMIN_OF_EXCITER=-95.0, TE=0.6),
        ("KL", 10.0, *PID_GAIN, "gain of the field current limiter"),
        *shared(KH=1.0, KF=0.03, TF=1.0, KC_FREE=0.28, KD=0.35, KE=1.0),
        ("VLR", 4.4, *LIMIT, "limit of the exciter's field current"),
        *shared(E1=4.4, SE1=0.037, E2=3.3, SE2=0.012),
    ),
    "VC VL VA VE VF",
    records=record(
        "EXAC2",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE KL KH KF TF KC KD KE VLR E1 SE1 E2 SE2",
    ),
    pslf_records=record(
        "exac2",
        "TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE KL KH KF TF KC KD KE VLR E1 SE1 E2 SE2 "
        "SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)
