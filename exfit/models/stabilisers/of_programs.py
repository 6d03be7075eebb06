"""Stabilisers of planning programs: IEEEST, ST2CUT, STAB1, STAB2A and WSCCST."""

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    is_curved,
    lag,
    lead_lag,
    rate,
    second_order,
    washout,
    washout_or_lag,
    where,
)
from exfit.models.sheet import (
    LONG_TIME,
    SHORT_TIME,
    TIME,
    WASHOUT_TIME,
    WITHIN_1000,
    WITHIN_10000,
    documented,
    limits,
    record,
    sheet,
)
from exfit.models.stabiliser_parts import SPEED_AND_POWER, of_stabiliser

# of WSCCST: constants that PSLF reads and does not use
NOT_USED = "T1 T2 T3 KBOOST DW1 DW2 DDWT TDELAY T4"


def numerator(d: Signal, p: Signal) -> Signal:
    """Compute the part of A5 and A6 in the output of both filters, from the states' slopes."""
    lagged, curved = p.A3 >= SHORTEST, is_curved(p.A3, p.A4)
    filtered = (p.A1 >= SHORTEST) | is_curved(p.A1, p.A2)
    slope = where(curved | lagged, d.V2, d.V1)
    of_lag = where(filtered, (d.V1 - d.V2) * rate(p.A3), 0.0)
    bend = where(curved, d.DV2, where(lagged, of_lag, d.DV1))
    return p.A5 * slope + p.A6 * bend


def ieeest(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """IEEEST: single input stabiliser with two filters (PSS/E).

                                                                LSMAX
    vsi1 ─►[ F ]─►[1 + sT1]─►[1 + sT3]─►[ KS ]─►[ sT5   ]─►[clip]─► vs
                  [1 + sT2]  [1 + sT4]          [1 + sT6]   LSMIN

    F = (1 + sA5 + s²A6) / ((1 + sA1 + s²A2) (1 + sA3 + s²A4)). A2 = 0 or A4 = 0
    leaves a lag, A1 = A2 = 0 or A3 = A4 = 0 no filter; of the numerator acts what
    the filters that remain can make. T2 = 0 or T4 = 0 bypasses its block. T5 = 0
    makes 1 / (1 + sT6) of the washout, as in PSS/E; an input with a value at rest,
    as the power, is refused then. Not modelled: a switch-off at terminal voltages
    beyond VCU and VCL.
    """
    v1, d.V1, d.DV1 = second_order(u.vsi1, s.V1, s.DV1, p.A1, p.A2)
    v2, d.V2, d.DV2 = second_order(v1, s.V2, s.DV2, p.A3, p.A4)
    f = v2 + numerator(d, p)
    v3, d.V3 = lead_lag(f, s.V3, p.T1, p.T2)
    v4, d.V4 = lead_lag(v3, s.V4, p.T3, p.T4)
    v5, d.V5 = washout_or_lag(v4, s.V5, p.KS, p.T5, p.T6)
    return clip(v5, p.LSMIN, p.LSMAX)


def ieeest_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1 = x.V2 = x.V3 = x.V4 = u.vsi1
    x.DV1, x.DV2, x.V5 = 0.0, 0.0, p.KS * u.vsi1


IEEEST = documented(
    ieeest,
    ieeest_rest,
    sheet(
        ("A1", 0.061, *SHORT_TIME, "first coefficient of the first filter"),
        ("A2", 0.0017, "s2", (0.0, 10.0), "second coefficient of the first filter"),
        ("A3", 0.0, *SHORT_TIME, "first coefficient of the second filter"),
        ("A4", 0.0, "s2", (0.0, 10.0), "second coefficient of the second filter"),
        ("A5", 0.0, "s", (-10.0, 10.0), "first coefficient of the filters' numerator"),
        ("A6", 0.0, "s2", (-10.0, 10.0), "second coefficient of the filters' numerator"),
        *of_stabiliser(T1=0.15, T2=0.03, T3=0.15, T4=0.03),
        ("T5", 1.65, *LONG_TIME, "washout lead"),
        ("T6", 1.65, "s", (0.001, 1000.0), "washout lag"),
        ("KS", 6.2, *WITHIN_10000, "gain"),
        *of_stabiliser(LSMAX=0.1, LSMIN=-0.1),
    ),
    "V1 DV1 V2 DV2 V3 V4 V5",
    inputs="speed",
    records=record(
        "IEEEST",
        "A1 A2 A3 A4 A5 A6 T1 T2 T3 T4 T5 T6 KS LSMAX LSMIN VCU VCL",
        icons={"ICS": 1, "REMBUS": 0},
        absent={"VCU": 0.0, "VCL": 0.0},
    ),
    pslf_records=record(
        "ieeest",
        "ICS REMBUS A1 A2 A3 A4 A5 A6 T1 T2 T3 T4 T5 T6 KS LSMAX LSMIN VCU VCL TDELAY",
        icons={"ICS": 1, "REMBUS": 0},
        absent={"VCU": 0.0, "VCL": 0.0, "TDELAY": 0.0},
        spelled={"ICS": "j", "REMBUS": "k"},
    ),
)


def st2cut(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST2CUT: dual input stabiliser with a voltage cut-off (PSS/E).

    vsi1 ─►[  K1   ]─►(+)─►[  sT3  ]─►[1 + sT5]─►[1 + sT7]─►[1 + sT9 ]─► v
           [1 + sT1]   ▲   [1 + sT4]  [1 + sT6]  [1 + sT8]  [1 + sT10]
                       │
    vsi2 ─►[  K2   ]───┘
           [1 + sT2]
        LSMAX
    v ─►[clip]─► vs
        LSMIN

    T1, T2, T6, T8 or T10 = 0 bypasses its block. T3 = 0 makes 1 / (1 + sT4) of the
    washout, as in PSS/E; an input with a value at rest, as the power, is refused
    then. Not modelled: the cut-off where the terminal voltage leaves its initial
    value by more than VCU and VCL.
    """
    v1, d.V1 = lag(u.vsi1, s.V1, p.K1, p.T1)
    v2, d.V2 = lag(u.vsi2, s.V2, p.K2, p.T2)
    v3, d.V3 = washout_or_lag(v1 + v2, s.V3, 1.0, p.T3, p.T4)
    v4, d.V4 = lead_lag(v3, s.V4, p.T5, p.T6)
    v5, d.V5 = lead_lag(v4, s.V5, p.T7, p.T8)
    v6, d.V6 = lead_lag(v5, s.V6, p.T9, p.T10)
    return clip(v6, p.LSMIN, p.LSMAX)


def st2cut_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1, x.V2 = p.K1 * u.vsi1, p.K2 * u.vsi2
    x.V3, x.V4, x.V5, x.V6 = x.V1 + x.V2, 0.0, 0.0, 0.0


ST2CUT = documented(
    st2cut,
    st2cut_rest,
    sheet(
        ("K1", 5.0, *WITHIN_10000, "gain of the first input"),
        ("K2", 0.0, *WITHIN_10000, "gain of the second input"),
        *of_stabiliser(T1_OF_INPUT=0.02, T2_OF_INPUT=0.02),
        ("T3", 10.0, *LONG_TIME, "washout lead"),
        ("T4", 10.0, "s", (0.001, 1000.0), "washout lag"),
        ("T5", 0.3, *TIME, "first lead"),
        ("T6", 0.03, *TIME, "first lag"),
        ("T7", 0.3, *TIME, "second lead"),
        ("T8", 0.03, *TIME, "second lag"),
        ("T9", 0.0, *TIME, "third lead"),
        ("T10", 0.0, *TIME, "third lag"),
        *of_stabiliser(LSMAX=0.1, LSMIN=-0.1),
    ),
    "V1 V2 V3 V4 V5 V6",
    inputs="speed p",
    records=record(
        "ST2CUT",
        "K1 K2 T1 T2 T3 T4 T5 T6 T7 T8 T9 T10 LSMAX LSMIN VCU VCL",
        icons=SPEED_AND_POWER,
        absent={"VCU": 0.0, "VCL": 0.0},
    ),
)


def stab1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """STAB1: speed sensitive stabiliser (PSS/E).

                                                HLIM
    vsi1 ─►[  sK  ]─►[1 + sT1]─►[1 + sT2]─►[clip]─► vs
           [1 + sT]  [1 + sT3]  [1 + sT4]  -HLIM

    The data sheet gives three ratios, as PSS/E does (there K/T, T1/T3 and T2/T4):
    K = K_T T, T1 = T1_T3 T3 and T2 = T2_T4 T4. T3 = 0 or T4 = 0 bypasses its block.
    """
    v1, d.V1 = washout(u.vsi1, s.V1, p.K_T * p.T, p.T)
    v2, d.V2 = lead_lag(v1, s.V2, p.T1_T3 * p.T3, p.T3)
    v3, d.V3 = lead_lag(v2, s.V3, p.T2_T4 * p.T4, p.T4)
    return clip(v3, -p.HLIM, p.HLIM)


def stab1_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1, x.V2, x.V3 = u.vsi1, 0.0, 0.0


STAB1 = documented(
    stab1,
    stab1_rest,
    sheet(
        ("K_T", 5.0, "pu/s", (-10000.0, 10000.0), "K/T: gain over washout time constant"),
        ("T", 10.0, *WASHOUT_TIME, "washout time constant"),
        ("T1_T3", 10.0, "1", (0.0, 1000.0), "T1/T3: first lead over first lag"),
        ("T3", 0.05, *TIME, "first lag"),
        ("T2_T4", 10.0, "1", (0.0, 1000.0), "T2/T4: second lead over second lag"),
        *of_stabiliser(T4=0.05, HLIM=0.05),
    ),
    "V1 V2 V3",
    inputs="speed",
    records=record("STAB1", "K_T T T1_T3 T3 T2_T4 T4 HLIM"),
)


def stab2a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """STAB2A: power sensitive stabiliser of ASEA (PSS/E).

    vsi1 ─►[ sK2 T2]─►[ sK2 T2]─►[ sK2 T2]─┬─►[   K3  ]─►(+)─► v
           [1 + sT2]  [1 + sT2]  [1 + sT2] │  [1 + sT3]   ▲
                                           └─►[   K4  ]───┘
                                HLIM
    v ─►[  -K5  ]─►[   K5  ]─►[clip]─► vs
        [1 + sT5]  [1 + sT5]  -HLIM

    The input is the electrical power; a rise of it lowers vs. T3 = 0 or T5 = 0
    bypasses its block. Typical data are those of a unit in a public library, whose
    drawing this is (OpenIPSL); that of PSS/E was not seen.
    """
    w1, d.W1 = washout(u.vsi1, s.W1, p.K2 * p.T2, p.T2)
    w2, d.W2 = washout(w1, s.W2, p.K2 * p.T2, p.T2)
    w3, d.W3 = washout(w2, s.W3, p.K2 * p.T2, p.T2)
    v3, d.V3 = lag(w3, s.V3, p.K3, p.T3)
    v5, d.V5 = lag(v3 + p.K4 * w3, s.V5, -p.K5, p.T5)
    v6, d.V6 = lag(v5, s.V6, p.K5, p.T5)
    return clip(v6, -p.HLIM, p.HLIM)


def stab2a_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.W1, x.W2, x.W3, x.V3, x.V5, x.V6 = u.vsi1, 0.0, 0.0, 0.0, 0.0, 0.0


STAB2A = documented(
    stab2a,
    stab2a_rest,
    sheet(
        ("K2", 1.0, *WITHIN_1000, "gain of each washout"),
        ("T2", 4.4, *WASHOUT_TIME, "time constant of each washout"),
        ("K3", 10.0, *WITHIN_1000, "gain of the lagged branch"),
        ("T3", 1.8, *LONG_TIME, "lag of the lagged branch"),
        ("K4", 1.0, *WITHIN_1000, "gain of the direct branch"),
        ("K5", 1.41, *WITHIN_1000, "gain of each output lag"),
        ("T5", 0.01, *LONG_TIME, "each output lag"),
        *of_stabiliser(HLIM=0.05),
    ),
    "W1 W2 W3 V3 V5 V6",
    inputs="p",
    records=record(
        "STAB2A", "K2 T2 K3 T3 K4 K5 T5 HLIM", doubt="its order is from one public source"
    ),
)


def wsccst(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """WSCCST: single input stabiliser with three lead-lags (PSLF).

    vsi1 ─►[  KQS   ]─►[  sTQ  ]─►[1+sTPQ1]─►[1+sTPQ2]─►[1+sTPQ3]─►[clip]─► vs
           [1 + sTQS]  [1 + sTQ]  [1+sTQ1 ]  [1+sTQ2 ]  [1+sTQ3 ]
                                                             VSMAX, VSMIN

    The lists of PowerWorld and of a writer of PSLF files name each of these blocks,
    so that what can differ is their order, which only matters at the limits. VSMIN
    is Vslow there. TQS, TQ1, TQ2 or TQ3 = 0 bypasses its block. Not modelled, since
    the lists do not say how they act: the signal of the voltage (KQV), the cut-off
    (Vcutoff) and the boost (Sw1); a file that uses them is warned about. Typical
    data are those of a hydro plant in a public repository, with TQ1 = 0 for the
    lead-lag that it does not use.
    """
    v1, d.V1 = lag(u.vsi1, s.V1, p.KQS, p.TQS)
    v2, d.V2 = washout(v1, s.V2, p.TQ, p.TQ)
    v3, d.V3 = lead_lag(v2, s.V3, p.TPQ1, p.TQ1)
    v4, d.V4 = lead_lag(v3, s.V4, p.TPQ2, p.TQ2)
    v5, d.V5 = lead_lag(v4, s.V5, p.TPQ3, p.TQ3)
    return clip(v5, p.VSMIN, p.VSMAX)


def wsccst_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1 = x.V2 = p.KQS * u.vsi1
    x.V3 = x.V4 = x.V5 = 0.0


WSCCST = documented(
    wsccst,
    wsccst_rest,
    sheet(
        ("KQS", 6.0, *WITHIN_10000, "gain"),
        ("TQS", 0.05, *TIME, "transducer lag"),
        ("TQ", 27.0, *WASHOUT_TIME, "washout time constant"),
        ("TQ1", 0.0, *TIME, "first lag"),
        ("TPQ1", 0.0, *TIME, "first lead"),
        ("TQ2", 0.033, *TIME, "second lag"),
        ("TPQ2", 0.208, *TIME, "second lead"),
        ("TQ3", 0.033, *TIME, "third lag"),
        ("TPQ3", 0.208, *TIME, "third lead"),
        *limits("VSMAX", 0.07, -0.07, "the output"),
    ),
    "V1 V2 V3 V4 V5",
    inputs="speed",
    doubt="rests on two lists of parameters; its diagram was not seen",
    pslf_records=record(
        "wsccst",
        "ICS KQV TQV KQS TQS TQ TQ1 TPQ1 TQ2 TPQ2 TQ3 TPQ3 VSMAX VCUTOFF VSMIN "
        f"{NOT_USED} SW1 TD1 TD2 VTL VK",
        icons={"ICS": 1},
        absent={"KQV": 0.0, "VCUTOFF": 0.0, "SW1": 0.0},
        ignored=f"TQV {NOT_USED} TD1 TD2 VTL VK",
        spelled={"ICS": "j", "VSMIN": "vslow"},
        signals={1: "speed", 2: "pa"},
    ),
)
