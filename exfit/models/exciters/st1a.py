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
)
from exfit.models.sheet import (
    LIMIT,
    POSITIVE_TIME,
    TIME,
    UP_TO_10,
    SearchRange,
    record,
    shared,
    sheet,
)

ALIASES = ("ESST1A",)

# the feedback is an alternative to the reduction of the gain by the lag and its lead
KF_ALONE = SearchRange(high=1.0, instead_of=("TB", "TC"))
TF_ALONE = SearchRange(needs="KF", instead_of=("TB", "TC"))

SHEET = sheet(
    *shared(TR=0.04, VIMAX=99.0, VIMIN=-99.0, TC_FREE=1.0, TB_FREE=10.0),
    ("TC1", 0.0, *TIME, "second regulator lead"),
    ("TB1", 0.0, *TIME, "second regulator lag"),
    *shared(KA=190.0, TA_FIXED=0.0, VAMAX=14.5, VAMIN=-14.5, VRMAX_OF_EFD_AT_VT=7.8),
    *shared(VRMIN_OF_EFD_AT_VT=-6.7, KC=0.08),
    ("KF", 0.001, *UP_TO_10, "stabilising feedback gain", KF_ALONE),
    ("TF", 1.0, *POSITIVE_TIME, "stabilising feedback time constant", TF_ALONE),
    *shared(KLR=4.54),
    ("ILR", 4.4, *LIMIT, "field current limit"),
)

RECORDS = (
    record(
        "ESST1A",
        "TR VIMAX VIMIN TC TB TC1 TB1 KA TA VAMAX VAMIN VRMAX VRMIN KC KF TF KLR ILR",
        icons={"UEL": 1, "VOS": 1},
        places={3: "takeover"},
    ),
)

PSLF_RECORDS = (
    record(
        "esst1a",
        "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF TC1 TB1 VAMAX VAMIN ILR KLR UELIN PSSIN",
        absent={"PSSIN": 0.0},
        ignored="UELIN",
    ),
    record(
        "exst1",
        "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF TC1 TB1 VAMAX VAMIN XE ILR KLR",
        absent={"XE": 0.0},
    ),
)

STATES = "VC VL VL1 VA VF"

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


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    gates = (-inf, inf), (u.vuel, u.voel)
    return regulated(u.vref + u.vs - vc, excess(u, p), gates, s, u, p, d)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    return at_rest(efd, excess(u, p), u, p, x) - u.vs


def at_rest(efd: Signal, taken: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref without a stabiliser."""
    va = efd + taken
    error = va / p.KA
    x.VC, x.VL, x.VL1, x.VA, x.VF = u.vc1, error, error, va, efd
    return u.vc1 + error
