"""Dual input stabilisers of speed and power: PSS2B, PSS2C and PSSSB."""

from exfit.models.blocks import Signal, clip, lead_lag, where
from exfit.models.sheet import TIME, documented, limits, record, sheet
from exfit.models.stabiliser_parts import (
    ACCELERATING,
    COMPENSATED,
    FILTERED_SPEED_AND_POWER,
    INPUT_LIMITS,
    SWITCH,
    WITH_FREQUENCY,
    accelerating,
    accelerating_rest,
    of_stabiliser,
    switch_rest,
    switched,
)

NO_LIMIT = 9999.0  # pu


PSS2A_HELD = {
    **{"T10": 0.0, "T11": 0.0},
    **{"VSI1MAX": NO_LIMIT, "VSI1MIN": -NO_LIMIT},
    **{"VSI2MAX": NO_LIMIT, "VSI2MIN": -NO_LIMIT},
}


def shaped(v: Signal, s: Signal, p: Signal, d: Signal) -> Signal:
    """Pass the signal through the gain and three leads and lags."""
    v1, d.V1 = lead_lag(p.KS1 * v, s.V1, p.T1, p.T2)
    v3, d.V3 = lead_lag(v1, s.V3, p.T3, p.T4)
    v10, d.V10 = lead_lag(v3, s.V10, p.T10, p.T11)
    return v10


def pss2b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS2B: dual input stabiliser, speed and power (IEEE Std 421.5-2005, 8.2).

          VSI1MAX                               ramp tracking
    vsi1 ─►[clip]─►[ sTW1 ]─►[ sTW2 ]─►[  1  ]─►(+)─►[ 1 + sT8  ]─►(+)─► v
           VSI1MIN [1+sTW1]  [1+sTW2]  [1+sT6]   ▲   [(1+sT9)^M ]  -▲
                                                 │                  │
                                                [KS3]               │
          VSI2MAX                                ▲                  │
    vsi2 ─►[clip]─►[ sTW3 ]─►[ sTW4 ]─►[ KS2 ]───┴──────────────────┘
           VSI2MIN [1+sTW3]  [1+sTW4]  [1+sT7]
                                                  VSTMAX
    v ─►[KS1]─►[1 + sT1]─►[1 + sT3]─►[1 + sT10]─►[clip]─► vs
               [1 + sT2]  [1 + sT4]  [1 + sT11]   VSTMIN

    The first input is the speed, the second the electrical power (KS2 = T7 / 2H).
    TW2 = 0 and TW4 = 0 leave out their washouts; T6, T7, T2, T4 or T11 = 0 bypass
    their blocks. The ramp tracking filter is N of the blocks that are drawn; M and
    N are whole numbers, M N at most 8; T9, M or N = 0 bypass it, as in files of
    planners. With T10 = T11 = 0 and input limits out of reach this is PSS2A, whose
    record has no such rows: it is read as PSS2B with these values.
    """
    v10 = shaped(accelerating(s, u, p, d), s, p, d)
    return clip(v10, p.VSTMIN, p.VSTMAX)


def pss2b_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    accelerating_rest(u, p, x)
    x.V1 = x.V3 = x.V10 = 0.0


PSS2B = documented(
    pss2b,
    pss2b_rest,
    sheet(
        *ACCELERATING,
        *of_stabiliser(KS1=20.0, T1=0.15, T2=0.025, T3=0.15, T4=0.025, T10=0.0, T11=0.033),
        *limits("VSI1MAX", 0.08, -0.08, "the first input"),
        *limits("VSI2MAX", 1.25, -1.25, "the second input"),
        *of_stabiliser(VSTMAX=0.1, VSTMIN=-0.1),
    ),
    "W1 W2 V6 W3 W4 V7 R1 R2 R3 R4 R5 R6 R7 R8 V1 V3 V10",
    inputs="speed p",
    aliases="PSS2A",
    records=(
        record(
            "PSS2B",
            "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 T10 T11 VSI1MAX VSI1MIN VSI2MAX "
            "VSI2MIN VSTMAX VSTMIN",
            icons=FILTERED_SPEED_AND_POWER,
        )
        + record(
            "PSS2A",
            "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 VSTMAX VSTMIN",
            icons=FILTERED_SPEED_AND_POWER,
            held=PSS2A_HELD,
        )
    ),
    pslf_records=(
        record(
            "pss2b",
            "ICS1 REMBUS1 ICS2 REMBUS2 VSI1MAX VSI1MIN TW1 TW2 VSI2MAX VSI2MIN TW3 TW4 T6 T7 KS2 "
            "KS3 T8 T9 N M KS1 T1 T2 T3 T4 T10 T11 VSTMAX VSTMIN A TA TB KS4",
            icons=FILTERED_SPEED_AND_POWER,
            absent={"KS4": 1.0, "A": 1.0, "TA": 0.0, "TB": 0.0},
            spelled={"ICS1": "j1", "REMBUS1": "k1", "ICS2": "j2", "REMBUS2": "k2"},
        )
        + record(
            "pss2a",
            "ICS1 REMBUS1 ICS2 REMBUS2 TW1 TW2 TW3 TW4 T6 T7 KS2 KS3 KS4 T8 T9 N M KS1 T1 T2 T3 T4 "
            "VSTMAX VSTMIN A TA TB",
            icons=FILTERED_SPEED_AND_POWER,
            absent={"KS4": 1.0, "A": 1.0, "TA": 0.0, "TB": 0.0},
            held=PSS2A_HELD,
            spelled={"ICS1": "j1", "REMBUS1": "k1", "ICS2": "j2", "REMBUS2": "k2"},
        )
    ),
)


def pss2c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS2C: dual input stabiliser, speed and power (IEEE Std 421.5-2016).

          VSI1MAX                               ramp tracking
    vsi1 ─►[clip]─►[ sTW1 ]─►[ sTW2 ]─►[  1  ]─►(+)─►[ 1 + sT8  ]─►(+)─► v
           VSI1MIN [1+sTW1]  [1+sTW2]  [1+sT6]   ▲   [(1+sT9)^M ]  -▲
                                                 │                  │
                                                [KS3]               │
          VSI2MAX                                ▲                  │
    vsi2 ─►[clip]─►[ sTW3 ]─►[ sTW4 ]─►[ KS2 ]───┴──────────────────┘
           VSI2MIN [1+sTW3]  [1+sTW4]  [1+sT7]
                                                             VSTMAX
    v ─►[KS1]─►[1 + sT1]─►[1 + sT3]─►[1 + sT10]─►[1 + sT12]─►[clip]─►[switch]─► vs
               [1 + sT2]  [1 + sT4]  [1 + sT11]  [1 + sT13]  VSTMIN

    PSS2B with a fourth lead and lag, and a switch. The first input is the speed,
    the second the electrical power (KS2 = T7 / 2H). TW2 = 0 and TW4 = 0 leave out
    their washouts; T6, T7, T2, T4, T11 or T13 = 0 bypass their blocks. The ramp
    tracking filter is N of the blocks that are drawn; M and N are whole numbers,
    M N at most 8.

    The switch makes vs 0 from where the power p of the machine falls to PPSSOFF to
    where it rises to PPSSON; it goes over 5 ms after the power has passed. It is on
    at the start where p is PPSSON or more (as in InterPSS; Dynawo: more than
    PPSSOFF). PPSSON = 0 leaves it out (as in PSS/E). The switching makes vs jump:
    derivatives of a response do not include the shift of the jumps. Not modelled:
    a lag of the power before the switch (PowerWorld). XCOMP and TCOMP make the
    compensated frequency of an input fc. Typical data are a sample of the standard,
    as GridKit has them, with KS2 for H = 5.05 s.
    """
    v10 = shaped(accelerating(s, u, p, d), s, p, d)
    v12, d.V12 = lead_lag(v10, s.V12, p.T12, p.T13)
    return switched(clip(v12, p.VSTMIN, p.VSTMAX), s, u, p, d)


def pss2c_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    accelerating_rest(u, p, x)
    x.V1 = x.V3 = x.V10 = x.V12 = 0.0
    switch_rest(u, p, x)


PSS2C = documented(
    pss2c,
    pss2c_rest,
    sheet(
        *ACCELERATING,
        *of_stabiliser(KS1=5.0, T1=0.16, T2=0.04, T3=0.16, T4=0.04, T10=0.18, T11=0.03),
        ("T12", 0.0, *TIME, "fourth lead"),
        ("T13", 0.0, *TIME, "fourth lag"),
        *of_stabiliser(VSTMAX=0.1, VSTMIN=-0.1),
        *INPUT_LIMITS,
        *SWITCH,
        *COMPENSATED,
    ),
    "W1 W2 V6 W3 W4 V7 R1 R2 R3 R4 R5 R6 R7 R8 V1 V3 V10 V12 ON",
    inputs="speed p",
    records=record(
        "PSS2C",
        "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 T10 T11 VSI1MAX VSI1MIN VSI2MAX "
        "VSI2MIN VSTMAX VSTMIN T12 T13 PPSSON PPSSOFF XCOMP TCOMP",
        icons=FILTERED_SPEED_AND_POWER,
        signals=WITH_FREQUENCY,
    ),
)


def psssb(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSSSB: dual input stabiliser with a voltage cut-off (PSLF, PowerWorld).

          VSI1MAX                               ramp tracking
    vsi1 ─►[clip]─►[ sTW1 ]─►[ sTW2 ]─►[  1  ]─►(+)─►[ 1 + sT8  ]─►(+)─► v
           VSI1MIN [1+sTW1]  [1+sTW2]  [1+sT6]   ▲   [(1+sT9)^M ]  -▲
                                                 │                  │
                                                [KS3]               │
          VSI2MAX                                ▲                  │
    vsi2 ─►[clip]─►[ sTW3 ]─►[ sTW4 ]─►[ KS2 ]───┴──────────────────┘
           VSI2MIN [1+sTW3]  [1+sTW4]  [1+sT7]
                                      VSTMAX
    v ─►[KS1]─►[1 + sT1]─►[1 + sT3]─►[clip]─►[cut-off]─► vs
               [1 + sT2]  [1 + sT4]  VSTMIN

    PSS2C without its third and fourth pair. vs is 0 while the terminal voltage is
    more than VCUTOFF below that of the start. The ramp tracking filter is N of the
    blocks that are drawn, M N at most 8. Its record has no limits of the inputs.
    With the boost added it gives the curve of PowerWorld 24 over a fault that cuts
    it off (vt 2e-6 pu).

    Not modelled: the boost of SW1 (TD1, TD2, VTL, VK), a signal that an operator
    gives by hand, and PowerWorld at the start of a simulation: at rest it is over.
    Typical data are PSS2B's; VCUTOFF is that of a record of InterPSS.
    """
    v1, d.V1 = lead_lag(p.KS1 * accelerating(s, u, p, d), s.V1, p.T1, p.T2)
    v3, d.V3 = lead_lag(v1, s.V3, p.T3, p.T4)
    d.VT0 = 0.0
    return where(s.VT0 - u.vt > p.VCUTOFF, 0.0, clip(v3, p.VSTMIN, p.VSTMAX))


def psssb_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    accelerating_rest(u, p, x)
    x.V1 = x.V3 = 0.0
    x.VT0 = u.vt


PSSSB = documented(
    psssb,
    psssb_rest,
    sheet(
        *ACCELERATING,
        *of_stabiliser(KS1=20.0, T1=0.15, T2=0.025, T3=0.15, T4=0.025, VSTMAX=0.1, VSTMIN=-0.1),
        *INPUT_LIMITS,
        ("VCUTOFF", 0.2, "pu", (0.0001, 10.0), "fall of the terminal voltage that cuts it off"),
    ),
    "W1 W2 V6 W3 W4 V7 R1 R2 R3 R4 R5 R6 R7 R8 V1 V3 VT0",
    inputs="speed p",
    records=record(
        "PSSSB",
        "TW1 TW2 TW3 TW4 T6 T7 KS2 KS3 KS4 T8 T9 KS1 T1 T2 T3 T4 VSTMAX VSTMIN SW1 TD1 TD2 VTL VK "
        "VCUTOFF",
        icons=FILTERED_SPEED_AND_POWER,
        absent={"KS4": 1.0},
        ignored="SW1 TD1 TD2 VTL VK",
        held={name: PSS2A_HELD[name] for name in ("VSI1MAX", "VSI1MIN", "VSI2MAX", "VSI2MIN")},
        doubt="PSS/E has no PSSSB: its order is that of a record that PowerWorld 24 ran",
    ),
)
