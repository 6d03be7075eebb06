"""Potential-source rectifiers: ST1A, ST1C and EXST1."""

from exfit.models.blocks import (
    Signal,
    clip,
    inf,
    lag,
    larger,
    lead_lag,
    limited_lag,
    regulator_output,
    washout,
    where,
)
from exfit.models.sheet import (
    LIMIT,
    POSITIVE_TIME,
    TIME,
    TWO_GATES,
    UP_TO_10,
    SearchRange,
    documented,
    record,
    shared,
    sheet,
)

# the feedback is an alternative to the reduction of the gain by the lag and its lead
KF_ALONE = SearchRange(high=1.0, instead_of=("TB", "TC"))


TF_ALONE = SearchRange(needs="KF", instead_of=("TB", "TC"))


Gate = tuple[Signal, Signal]  # the value of UEL that a signal is at least, of OEL at most


def leads(vi: Signal, first: Signal, second: Signal, p: Signal) -> Signal:
    """Return the output of both lead-lags, whose states are given."""
    return lead_lag(lead_lag(vi, first, p.TC, p.TB)[0], second, p.TC1, p.TB1)[0]


def excess(u: Signal, p: Signal) -> Signal:
    """Compute the part of the regulator's output that the field current limiter takes away."""
    return p.KLR * larger(u.ifd - p.ILR, 0.0)


def gated(va: Signal, taken: Signal, gate: Gate, p: Signal) -> Signal:
    """Limit the regulator's output, less ``taken``, and pass it through the gate."""
    return clip(clip(va, p.VAMIN, p.VAMAX) - taken, *gate)


def regulated(
    error: Signal,
    taken: Signal,
    gates: tuple[Gate, Gate],
    s: Signal,
    u: Signal,
    p: Signal,
    d: Signal,
) -> Signal:
    """Write the slopes behind the summing point into d and return efd.

    ``taken`` is subtracted from the regulator's output; limiters hold its input and its output
    between the two ``gates``.
    """
    at_input, at_output = gates
    vl, gain = leads(error, s.VL, s.VL1, p), leads(1.0, 0.0, 0.0, p)
    fed_back = gated(regulator_output(s, p, vl, gain, taken), taken, at_output, p)
    vf, _ = washout(fed_back, s.VF, p.KF, p.TF)
    vi = clip(clip(error - vf, p.VIMIN, p.VIMAX), *at_input)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    vl1, d.VL1 = lead_lag(vl, s.VL1, p.TC1, p.TB1)
    va, d.VA = limited_lag(vl1, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    vr = gated(va, taken, at_output, p)
    _, d.VF = washout(vr, s.VF, p.KF, p.TF)
    return clip(vr, u.vt * p.VRMIN, u.vt * p.VRMAX - p.KC * u.ifd)


def at_rest(efd: Signal, taken: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref without a stabiliser."""
    va = efd + taken
    error = va / p.KA
    x.VC, x.VL, x.VL1, x.VA, x.VF = u.vc1, error, error, va, efd
    return u.vc1 + error


def st1a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST1A: potential-source controlled rectifier (IEEE Std 421.5-2005, 7.1).

                      VIMAX                               VAMAX
    vref + vs ──►(+)─►[clip]─►[1 + sTC]─►[1 + sTC1]─►[  KA  ]─┐ VA
               -▲   ▲-VIMIN   [1 + sTB]  [1 + sTB1]  [1+sTA]  │
                │   │                                 VAMIN   ▼
    vc1 ►[  1  ]┘   └──[  sKF  ]◄──────────────┐             (+)
         [1+sTR]       [1 + sTF]               │             -▲
                                               │              │
                       VT VRMAX - KC IFD       │              │
               efd ◄────────[clip]◄────────────┴──[gates]◄────┤
                           VT VRMIN                           │
                                                              │
                            KLR (IFD - ILR), where positive ──┘

    The limits of the lag are non-windup; the two clamps are not. The gates are the
    higher of the signal and VUEL, then the lower of that and VOEL. The rate
    feedback is taken before the last clamp (as ANDES, OpenIPSL and Dynawo do, and
    the figure).

    In a PSS/E record UEL = 1 and VOS = 1: limiter and stabiliser act on the error.
    Not modelled: UEL = 2 (a gate behind VIMAX), UEL = 3 (the gate drawn here, with
    a limiter) and VOS = 2 (a stabiliser added to VA). Typical data are the
    standard's (its KF = 0 and its limiter's KLR and ILR come from other sets of
    it).
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    gates = (-inf, inf), (u.vuel, u.voel)
    return regulated(u.vref + u.vs - vc, excess(u, p), gates, s, u, p, d)


def st1a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    return at_rest(efd, excess(u, p), u, p, x) - u.vs


ST1A = documented(
    st1a,
    st1a_rest,
    sheet(
        *shared(TR=0.04, VIMAX=99.0, VIMIN=-99.0, TC_FREE=1.0, TB_FREE=10.0),
        ("TC1", 0.0, *TIME, "second regulator lead"),
        ("TB1", 0.0, *TIME, "second regulator lag"),
        *shared(KA=190.0, TA_FIXED=0.0, VAMAX=14.5, VAMIN=-14.5, VRMAX_OF_EFD_AT_VT=7.8),
        *shared(VRMIN_OF_EFD_AT_VT=-6.7, KC=0.08),
        ("KF", 0.001, *UP_TO_10, "stabilising feedback gain", KF_ALONE),
        ("TF", 1.0, *POSITIVE_TIME, "stabilising feedback time constant", TF_ALONE),
        *shared(KLR=4.54),
        ("ILR", 4.4, *LIMIT, "field current limit"),
    ),
    "VC VL VL1 VA VF",
    aliases="ESST1A",
    records=record(
        "ESST1A",
        "TR VIMAX VIMIN TC TB TC1 TB1 KA TA VAMAX VAMIN VRMAX VRMIN KC KF TF KLR ILR",
        icons={"UEL": 1, "VOS": 1},
        places={3: "takeover"},
    ),
    pslf_records=(
        record(
            "esst1a",
            "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF TC1 TB1 VAMAX VAMIN ILR KLR UELIN "
            "PSSIN",
            absent={"PSSIN": 0.0},
            ignored="UELIN",
        )
        + record(
            "exst1",
            "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF TC1 TB1 VAMAX VAMIN XE ILR KLR",
            absent={"XE": 0.0},
        )
    ),
)


def stabiliser_at_error(u: Signal, p: Signal) -> Signal:
    """Compute the stabiliser's part in the voltage error; the rest it adds to VA."""
    return where(p.VOS < 1.5, u.vs, 0.0)


def st1c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST1C: potential-source controlled rectifier (IEEE Std 421.5-2016).

                             VIMAX    UEL OEL                             VAMAX
    vref + vs + vsum ──►(+)─►[clip]─►[gates]─►[1 + sTC]─►[1 + sTC1]─►[  KA  ]─┐ VA
                      -▲   ▲-VIMIN            [1 + sTB]  [1 + sTB1]  [1+sTA]  │
                       │   │                                          VAMIN   │
           vc1 ►[  1  ]┘   └──[  sKF  ]◄──────────────┐                       │
                [1+sTR]       [1 + sTF]               │                       │
                              VT VRMAX - KC IFD       │   UEL OEL             ▼
                      efd ◄────────[clip]◄────────────┴──[gates]◄────────────(+)◄ vs
                                  VT VRMIN                                   -▲
                                                                              │
                                            KLR (IFD - ILR), where positive ──┘

    ST1A with further places for limiters and stabiliser. The limiters act at the
    summing point (vsum), at the gates behind VIMAX, or at those of the regulator's
    output; the stabiliser is added to the voltage error (VOS = 1) or to VA (VOS =
    2). The limits of the lag are non-windup; the two clamps are not. Gates are the
    higher of the signal and UEL, then the lower of that and OEL.

    Dynawo and InterPSS draw this. Both take the rate feedback before the last
    clamp, as ST1A here does. PowerWorld lists the places in another order than
    InterPSS's record of PSS/E: OEL, UEL, VOS. Typical data are those of ST1A.
    """
    vs = stabiliser_at_error(u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    taken = excess(u, p) - (u.vs - vs)
    gates = (u.vuel, u.voel), (u.vuel_out, u.voel_out)
    return regulated(u.vref + vs + u.vsum - vc, taken, gates, s, u, p, d)


def st1c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vs = stabiliser_at_error(u, p)
    return at_rest(efd, excess(u, p) - (u.vs - vs), u, p, x) - vs


ST1C = documented(
    st1c,
    st1c_rest,
    sheet(
        *ST1A.sheet,
        ("VOS", 1.0, "1", (1.0, 2.0), "place of the stabiliser, on load: 1 error, 2 VA"),
    ),
    "VC VL VL1 VA VF",
    aliases="ESST1C",
    records=record(
        "ST1C",
        "TR VIMAX VIMIN TC TB TC1 TB1 KA TA VAMAX VAMIN VRMAX VRMIN KC KF TF KLR ILR",
        icons={"UEL": 1, "VOS": 1, "OEL": 1},
        ignored="UEL OEL",
        places=TWO_GATES,
    ),
)


def exst1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXST1: potential-source controlled rectifier (IEEE type ST1 of 1981).

                      VIMAX                         VT VRMAX - KC IFD
    vref + vs ──►(+)─►[clip]─►[1 + sTC]─►[  KA  ]─┬─►[clip]─► efd
               -▲   ▲-VIMIN   [1 + sTB]  [1+sTA]  │ VT VRMIN - KC IFD
                │   │                             │
    vc1 ►[  1  ]┘   └─────────[  sKF  ]◄── VA ────┘
         [1+sTR]              [1 + sTF]

    No limit is non-windup: the output is clamped behind the lag, whose state VA
    runs on, and the rate feedback is taken before that clamp. The floor falls with
    KC IFD as the ceiling does, as in PSS/E according to OpenIPSL and ANDES (ANDES
    leaves VT out); the floor of ST1A, VT VRMIN, is another. Not modelled: UEL and
    OEL, which here are added to the error.
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs - vc
    vl, gain = lead_lag(error, s.VL, p.TC, p.TB)[0], lead_lag(1.0, 0.0, p.TC, p.TB)[0]
    vf, _ = washout(regulator_output(s, p, vl, gain), s.VF, p.KF, p.TF)
    vi = clip(error - vf, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    va, d.VA = lag(vl, s.VA, p.KA, p.TA)
    _, d.VF = washout(va, s.VF, p.KF, p.TF)
    drop = p.KC * u.ifd
    return clip(va, u.vt * p.VRMIN - drop, u.vt * p.VRMAX - drop)


def exst1_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = efd / p.KA
    x.VC, x.VL, x.VA, x.VF = u.vc1, error, efd, efd
    return u.vc1 + error - u.vs


EXST1 = documented(
    exst1,
    exst1_rest,
    sheet(
        *shared(TR=0.02, VIMAX=0.2, VIMIN=-0.2, TC=1.0, TB=1.0, KA=80.0, TA=0.05),
        *shared(VRMAX_OF_EFD_AT_VT=8.0, VRMIN_OF_EFD_AT_VT=-3.0, KC=0.2, KF=0.1, TF=1.0),
    ),
    "VC VL VA VF",
    records=record("EXST1", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF"),
)
