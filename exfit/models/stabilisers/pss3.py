"""Dual input stabilisers of power and speed: PSS3B and PSS3C."""

from exfit.models.blocks import Signal, clip, high_pass, lag, second_order_lead
from exfit.models.sheet import (
    LONG_TIME,
    TIME,
    WASHOUT_TIME,
    WITHIN_10000,
    documented,
    record,
    sheet,
)
from exfit.models.stabiliser_parts import (
    COMPENSATED,
    POWER_AND_SPEED,
    SWITCH,
    WITH_FREQUENCY,
    of_stabiliser,
    switch_rest,
    switched,
)


def pss3b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS3B: dual input stabiliser, power and speed (IEEE Std 421.5-2005, 8.3).

    vsi1 ─►[  KS1  ]─►[ sTW1  ]─►(+)─►[ sTW3  ]─►[1 + sA1 + s²A2]─► v
           [1 + sT1]  [1 + sTW1]  ▲   [1 + sTW3] [1 + sA3 + s²A4]
                                  │
    vsi2 ─►[  KS2  ]─►[ sTW2  ]───┘
           [1 + sT2]  [1 + sTW2]
                             VSTMAX
    v ─►[1 + sA5 + s²A6]─►[clip]─► vs
        [1 + sA7 + s²A8]   VSTMIN

    The first input is the electrical power (KS1 is negative), the second the speed,
    as Dynawo has it (cf. IEC 61970-302, which names them the other way round).
    T1 or T2 = 0 bypasses its block, TW3 = 0 leaves out its washout. A4 = 0 leaves a
    lag, without A2, and A3 = A4 = 0 no filter; so do A7 and A8.
    """
    v1, d.V1 = lag(u.vsi1, s.V1, p.KS1, p.T1)
    w1, d.W1 = high_pass(v1, s.W1, p.TW1)
    v2, d.V2 = lag(u.vsi2, s.V2, p.KS2, p.T2)
    w2, d.W2 = high_pass(v2, s.W2, p.TW2)
    w3, d.W3 = high_pass(w1 + w2, s.W3, p.TW3)
    v3, d.V3, d.DV3 = second_order_lead(w3, s.V3, s.DV3, p.A1, p.A2, p.A3, p.A4)
    v4, d.V4, d.DV4 = second_order_lead(v3, s.V4, s.DV4, p.A5, p.A6, p.A7, p.A8)
    return clip(v4, p.VSTMIN, p.VSTMAX)


def pss3b_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1 = x.W1 = p.KS1 * u.vsi1
    x.V2 = x.W2 = p.KS2 * u.vsi2
    x.W3 = x.V3 = x.DV3 = x.V4 = x.DV4 = 0.0


PSS3B = documented(
    pss3b,
    pss3b_rest,
    sheet(
        ("KS1", -0.602, *WITHIN_10000, "gain of the first input"),
        *of_stabiliser(T1_OF_INPUT=0.012),
        ("TW1", 0.3, *WASHOUT_TIME, "washout of the first input"),
        ("KS2", 30.12, *WITHIN_10000, "gain of the second input"),
        *of_stabiliser(T2_OF_INPUT=0.012),
        ("TW2", 0.3, *WASHOUT_TIME, "washout of the second input"),
        ("TW3", 0.6, *LONG_TIME, "washout of the sum"),
        ("A1", 0.359, "s", (-100.0, 100.0), "first coefficient of the first numerator"),
        ("A2", 0.586, "s2", (-100.0, 100.0), "second coefficient of the first numerator"),
        ("A3", 0.429, *TIME, "first coefficient of the first filter"),
        ("A4", 0.564, "s2", (0.0, 100.0), "second coefficient of the first filter"),
        ("A5", 0.001, "s", (-100.0, 100.0), "first coefficient of the second numerator"),
        ("A6", 0.0, "s2", (-100.0, 100.0), "second coefficient of the second numerator"),
        ("A7", 0.031, *TIME, "first coefficient of the second filter"),
        ("A8", 0.0, "s2", (0.0, 100.0), "second coefficient of the second filter"),
        *of_stabiliser(VSTMAX=0.1, VSTMIN=-0.1),
    ),
    "V1 W1 V2 W2 W3 V3 DV3 V4 DV4",
    inputs="p speed",
    records=record(
        "PSS3B",
        "KS1 T1 TW1 KS2 T2 TW2 TW3 A1 A2 A3 A4 A5 A6 A7 A8 VSTMAX VSTMIN",
        icons=POWER_AND_SPEED,
    ),
)


def pss3c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS3C: dual input stabiliser, power and speed (IEEE Std 421.5-2016).

    vsi1 ─►[  KS1  ]─►[ sTW1  ]─►(+)─►[ sTW3  ]─►[1 + sA1 + s²A2]─► v
           [1 + sT1]  [1 + sTW1]  ▲   [1 + sTW3] [1 + sA3 + s²A4]
                                  │
    vsi2 ─►[  KS2  ]─►[ sTW2  ]───┘
           [1 + sT2]  [1 + sTW2]
                             VSTMAX
    v ─►[1 + sA5 + s²A6]─►[clip]─►[switch]─► vs
        [1 + sA7 + s²A8]   VSTMIN

    PSS3B with a switch. The first input is the electrical power (KS1 is negative),
    the second the speed, as Dynawo has it. T1 or T2 = 0 bypasses its block, TW3 = 0
    leaves out its washout. A4 = 0 leaves a lag, without A2, and A3 = A4 = 0 no
    filter; so do A7 and A8.

    The switch makes vs 0 from where the power p of the machine falls to PPSSOFF to
    where it rises to PPSSON; it goes over 5 ms after the power has passed. It is on
    at the start where p is PPSSON or more (as in InterPSS; Dynawo: more than
    PPSSOFF). PPSSON = 0 leaves it out (as in PSS/E). The switching makes vs jump:
    derivatives of a response do not include the shift of the jumps. Not modelled:
    TPGFILT, a lag of the power before the switch. XCOMP and TCOMP make the
    compensated frequency of an input fc. With it vt is that of PSS/E 36.7 over a
    fault. Typical data are PSS3B's.
    """
    return switched(pss3b(s, u, p, d), s, u, p, d)


def pss3c_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    pss3b_rest(vs, u, p, x)
    switch_rest(u, p, x)


PSS3C = documented(
    pss3c,
    pss3c_rest,
    (*PSS3B.sheet, *SWITCH, *COMPENSATED),
    "V1 W1 V2 W2 W3 V3 DV3 V4 DV4 ON",
    inputs="p speed",
    records=record(
        "PSS3C",
        "KS1 T1 TW1 KS2 T2 TW2 TW3 A1 A2 A3 A4 A5 A6 A7 A8 VSTMAX VSTMIN PPSSON PPSSOFF XCOMP "
        "TCOMP TPGFILT",
        icons=POWER_AND_SPEED,
        absent={"TPGFILT": 0.0},
        signals={**WITH_FREQUENCY, 6: "fc"},
    ),
)
