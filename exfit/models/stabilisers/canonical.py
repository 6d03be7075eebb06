"""Stabilisers of the canonical form: PSS6C and PSS7C."""

from exfit.models.blocks import Signal, clip, high_pass, lag, washout
from exfit.models.sheet import (
    DIVIDING_TIME,
    TIME,
    WASHOUT_TIME,
    WITHIN_1000,
    WITHIN_10000,
    documented,
    record,
    sheet,
    with_typical,
)
from exfit.models.stabiliser_parts import (
    ACCELERATING,
    COMPENSATED,
    FILTERED_SPEED_AND_POWER,
    INPUT_LIMITS,
    POWER_AND_SPEED,
    SWITCH,
    WITH_FREQUENCY,
    accelerating,
    accelerating_rest,
    limited_inputs,
    of_stabiliser,
    switch_rest,
    switched,
)

CANONICAL = sheet(
    ("K0", 1.0, *WITHIN_1000, "gain of the input of the first integrator"),
    ("K1", 1.0, *WITHIN_1000, "gain of the output of the first integrator"),
    ("K2", 1.0, *WITHIN_1000, "gain of the output of the second integrator"),
    ("K3", 1.0, *WITHIN_1000, "gain of the output of the third integrator"),
    ("K4", 0.0, *WITHIN_1000, "gain of the output of the fourth integrator"),
    ("KI3", 1.0, *WITHIN_1000, "gain of the third integrator"),
    ("KI4", 0.0, *WITHIN_1000, "gain of the fourth integrator"),
    ("TI1", 0.1, "s", (0.001, 1000.0), "time constant of the first integrator"),
    ("TI2", 0.1, "s", (0.001, 1000.0), "time constant of the second integrator"),
    ("TI3", 1.0, "s", (0.001, 1000.0), "time constant of the third integrator"),
    ("TI4", 1.0, "s", (0.001, 1000.0), "time constant of the fourth integrator"),
)


def canonical(u: Signal, s: Signal, p: Signal, d: Signal) -> Signal:
    """Return a weighted sum of a signal, less what four integrators in a row give, and of these."""
    e = u - (s.X1 + s.X2 + s.X3 + s.X4)
    d.X1 = e / p.TI1
    d.X2 = s.X1 / p.TI2
    d.X3 = p.KI3 * s.X2 / p.TI3
    d.X4 = p.KI4 * s.X3 / p.TI4
    return p.K0 * e + p.K1 * s.X1 + p.K2 * s.X2 + p.K3 * s.X3 + p.K4 * s.X4


def pss6c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS6C: dual input stabiliser, power and speed (IEEE Std 421.5-2016).

          VSI1MAX
    vsi1 ─►[clip]─►[   1   ]─┬─►[  KS1  ]─►(+)─►(+)─►[ sTD   ]─► v
           VSI1MIN [1 + sT1] │  [1 + sT3]  -▲    ▲   [1 + sTD]
                             └──────────────┘    │
          VSI2MAX                                │
    vsi2 ─►[clip]─►[  KS2  ]─►[ sMACC ]──────────┘
           VSI2MIN [1 + sT2]  [1 + sT4]
                                        VSTMAX
    v ─►(+)─ e ─►[form]─ y ──────►[KS]─►[clip]─►[switch]─► vs
        -▲         │                    VSTMIN
         └── f ◄───┘

    The canonical form has four integrators in a row: sTI1 x1 = e, sTI2 x2 = x1,
    sTI3 x3 = KI3 x2, sTI4 x4 = KI4 x3; f = x1 + x2 + x3 + x4 is fed back, and
    y = K0 e + K1 x1 + K2 x2 + K3 x3 + K4 x4.

    The first input is the electrical power, the second the speed. The signs are
    Dynawo's: MACC and KS1 make of power and speed the accelerating power, and the
    sample data damp a swing, which they do not with the other sign. PSS/E 36.7 has
    them too, and the same integrators: from its own states this is its output,
    within 1e-7 pu. InterPSS takes the whole sum with the other sign.

    The switch makes vs 0 from where the power p of the machine falls to PPSSOFF to
    where it rises to PPSSON; it goes over 5 ms after the power has passed. It is on
    at the start where p is PPSSON or more (as in InterPSS; Dynawo: more than
    PPSSOFF). PPSSON = 0 leaves it out. The switching makes vs jump: derivatives of
    a response do not include the shift of the jumps. T1, T2 or T3 = 0 bypasses its
    block. XCOMP and TCOMP make the compensated frequency of an input fc. Typical
    data are the standard's, as GridKit has them.
    """
    vsi1, vsi2 = limited_inputs(u, p)
    v1, d.V1 = lag(vsi1, s.V1, 1.0, p.T1)
    v3, d.V3 = lag(v1, s.V3, p.KS1, p.T3)
    v2, d.V2 = lag(vsi2, s.V2, p.KS2, p.T2)
    w4, d.W4 = washout(v2, s.W4, p.MACC, p.T4)
    v, d.WD = high_pass(v3 - v1 + w4, s.WD, p.TD)
    y = canonical(v, s, p, d)
    return switched(clip(p.KS * y, p.VSTMIN, p.VSTMAX), s, u, p, d)


def pss6c_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1, vsi2 = limited_inputs(u, p)
    x.V3 = p.KS1 * x.V1
    x.V2 = x.W4 = p.KS2 * vsi2
    x.WD = x.V3 - x.V1
    x.X1 = x.X2 = x.X3 = x.X4 = 0.0
    switch_rest(u, p, x)


PSS6C = documented(
    pss6c,
    pss6c_rest,
    sheet(
        ("KS1", 1.0, *WITHIN_1000, "gain of the first input"),
        *of_stabiliser(T1_OF_INPUT=0.01),
        ("T3", 0.4405, *TIME, "lag of the first input"),
        ("KS2", 1.0, *WITHIN_1000, "gain of the second input"),
        ("MACC", 20.6838, "s", (-1000.0, 1000.0), "lead of the second input"),
        *of_stabiliser(T2_OF_INPUT=0.01),
        ("T4", 0.4405, *DIVIDING_TIME, "lag of the second input"),
        ("TD", 1.7809, *WASHOUT_TIME, "washout of the sum"),
        ("KS", 1.0, *WITHIN_10000, "stabiliser gain"),
        *of_stabiliser(VSTMAX=0.05, VSTMIN=-0.05),
        *with_typical(
            CANONICAL,
            **{"K0": 1.3322, "K1": 0.2903, "K2": 0.7371, "K3": 0.0813},
            **{"TI1": 0.06, "TI2": 0.5794, "TI3": 3.5414},
        ),
        *INPUT_LIMITS,
        *with_typical(SWITCH, PPSSON=0.21, PPSSOFF=0.19),
        *COMPENSATED,
    ),
    "V1 V3 V2 W4 WD X1 X2 X3 X4 ON",
    inputs="p speed",
    records=record(
        "PSS6C",
        "T1 KS2 T2 KS1 T3 MACC T4 TD K0 K1 K2 K3 K4 TI1 TI2 KI3 TI3 KI4 TI4 KS VSI1MAX VSI1MIN "
        "VSI2MAX VSI2MIN VSTMAX VSTMIN PPSSON PPSSOFF XCOMP TCOMP",
        icons=POWER_AND_SPEED,
        signals=WITH_FREQUENCY,
    ),
)


def pss7c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS7C: dual input stabiliser, speed and power (IEEE Std 421.5-2016).

          VSI1MAX                               ramp tracking
    vsi1 ─►[clip]─►[ sTW1 ]─►[ sTW2 ]─►[  1  ]─►(+)─►[ 1 + sT8  ]─►(+)─► v
           VSI1MIN [1+sTW1]  [1+sTW2]  [1+sT6]   ▲   [(1+sT9)^M ]  -▲
                                                 │                  │
                                                [KS3]               │
          VSI2MAX                                ▲                  │
    vsi2 ─►[clip]─►[ sTW3 ]─►[ sTW4 ]─►[ KS2 ]───┴──────────────────┘
           VSI2MIN [1+sTW3]  [1+sTW4]  [1+sT7]
                                       VSTMAX
    v ─►[KS1]─►(+)─ e ─►[form]─ y ─────►[clip]─►[switch]─► vs
               -▲         │            VSTMIN
                └── f ◄───┘

    PSS2C with the canonical form of PSS6C in place of its leads and lags: four
    integrators in a row, sTI1 x1 = e, sTI2 x2 = x1, sTI3 x3 = KI3 x2, sTI4 x4 = KI4
    x3; f = x1 + x2 + x3 + x4 is fed back, and y = K0 e + K1 x1 + K2 x2 + K3 x3 + K4
    x4. The first input is the speed, the second the electrical power (KS2 = T7 /
    2H). TW2 = 0 and TW4 = 0 leave out their washouts; T6 or T7 = 0 bypasses its
    block. The ramp tracking filter is N of the blocks that are drawn; M and N are
    whole numbers, M N at most 8. vt with it is that of PSS/E 36.7 (1e-5 pu over a
    fault, with KS3 = 1). InterPSS, which draws it, multiplies both signals before
    the filter with KS3, here it is as in PSS2C; where KS3 = 1 there is no
    difference.

    The switch makes vs 0 from where the power p of the machine falls to PPSSOFF to
    where it rises to PPSSON; it goes over 5 ms after the power has passed. It is on
    at the start where p is PPSSON or more. PPSSON = 0 leaves it out (as in PSS/E).
    The switching makes vs jump: derivatives of a response do not include the shift
    of the jumps. XCOMP and TCOMP make the compensated frequency of an input fc.
    Typical data are the standard's, as GridKit has them, but for KS2, which is that
    of H = 5.05 s as in PSS2C (there 0.7052).
    """
    v = accelerating(s, u, p, d)
    y = canonical(p.KS1 * v, s, p, d)
    return switched(clip(y, p.VSTMIN, p.VSTMAX), s, u, p, d)


def pss7c_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    accelerating_rest(u, p, x)
    x.X1 = x.X2 = x.X3 = x.X4 = 0.0
    switch_rest(u, p, x)


PSS7C = documented(
    pss7c,
    pss7c_rest,
    sheet(
        *ACCELERATING,
        *of_stabiliser(KS1=50.0, VSTMAX=0.05, VSTMIN=-0.05),
        *with_typical(
            CANONICAL,
            **{"K0": 0.399, "K1": 1.8462, "K2": 0.4231, "K3": 0.2104},
            **{"TI1": 0.03, "TI2": 0.0293, "TI3": 0.2804},
        ),
        *INPUT_LIMITS,
        *with_typical(SWITCH, PPSSON=0.21, PPSSOFF=0.19),
        *COMPENSATED,
    ),
    "W1 W2 V6 W3 W4 V7 R1 R2 R3 R4 R5 R6 R7 R8 X1 X2 X3 X4 ON",
    inputs="speed p",
    records=record(
        "PSS7C",
        "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 K0 K1 K2 K3 K4 TI1 TI2 KI3 TI3 KI4 TI4 VSI1MAX "
        "VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN PPSSON PPSSOFF XCOMP TCOMP",
        icons=FILTERED_SPEED_AND_POWER,
        signals=WITH_FREQUENCY,
    ),
)
