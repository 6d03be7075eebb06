"""Multi-band stabilisers: PSS4B and PSS4C."""

from collections.abc import Callable
from functools import partial

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    lag,
    rate,
    second_order,
    second_order_lead,
    washout,
    where,
)
from exfit.models.sheet import (
    POSITIVE_TIME,
    SHORT_TIME,
    TIME,
    WITHIN_1000,
    WITHIN_10000,
    Parameter,
    Sheet,
    documented,
    limits,
    record,
    sheet,
    with_typical,
)
from exfit.models.stabiliser_parts import of_stabiliser

SLOWEST = 1e-6  # rad/s


NOTCH = ("rad/s", (0.0, 10000.0))
Pair = tuple[float, float]


def band_rows(letter: str, name: str, gain: float, most: float, upper: Pair, lower: Pair) -> Sheet:
    """Make the rows of a band; of each branch the first lead and its lag are given."""
    rows: list[Parameter] = []
    for number, first, branch, pair in ((1, 1, "upper", upper), (2, 7, "lower", lower)):
        of = f"the {name} band's {branch} branch"
        rows += sheet(
            (f"K{letter}{number}", 66.0, *WITHIN_10000, f"gain of {of}"),
            (f"K{letter}1{first}", 1.0, *WITHIN_1000, f"coefficient of {of}"),
        )
        for k, nth in enumerate(("first", "second", "third")):
            lead, slow = pair if k == 0 else (0.0, 0.0)
            rows += sheet(
                (f"T{letter}{first + 2 * k}", lead, *TIME, f"{nth} lead of {of}"),
                (f"T{letter}{first + 2 * k + 1}", slow, *TIME, f"{nth} lag of {of}"),
            )
    rows += sheet((f"K{letter}", gain, *WITHIN_10000, f"gain of the {name} band"))
    return (*rows, *limits(f"V{letter}MAX", most, -most, f"the {name} band"))


def of_swing(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Compute the speed by the standard's transducer of the power: -s^2 / (sM) behind its lags."""
    power, d.PH = lag(u.vsi2, s.PH, -1.0, p.TH)
    _, d.XH, d.YH = second_order(power, s.XH, s.YH, p.BH, p.AH)
    return d.XH / p.M


def as_in_psse(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Compute what PSS/E has in its place: s^2 / (1 + sM) behind the same lags."""
    power, d.PH = lag(u.vsi2, s.PH, 1.0, p.TH)
    _, d.XH, d.YH = second_order(power, s.XH, s.YH, p.BH, p.AH)
    steep, d.MH = washout(d.XH, s.MH, 1.0, p.M)
    return steep


def transduced(high: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> tuple[Signal, Signal]:
    """Compute the inputs of the bands: of low and intermediate frequency, and of high frequency."""
    low, d.XLI, d.YLI = second_order_lead(u.vsi1, s.XLI, s.YLI, p.DLI, p.CLI, p.BLI, p.ALI)
    low, d.XLI1, d.YLI1 = notch(low, s.XLI1, s.YLI1, p.BWLI1, p.WLI1)
    low, d.XLI2, d.YLI2 = notch(low, s.XLI2, s.YLI2, p.BWLI2, p.WLI2)
    high, d.XH1, d.YH1 = notch(high, s.XH1, s.YH1, p.BWH1, p.WH1)
    high, d.XH2, d.YH2 = notch(high, s.XH2, s.YH2, p.BWH2, p.WH2)
    return low, high


def notch(u: Signal, x: Signal, v: Signal, BW: Signal, W: Signal) -> tuple[Signal, Signal, Signal]:
    """(s^2 + W^2) / (s^2 + s BW + W^2), or 1 where W = 0; the states are ``second_order``'s."""
    square = where(W < SLOWEST, 0.0, 1.0 / where(W < SLOWEST, 1.0, W * W))
    return second_order_lead(u, x, v, 0.0, square, BW * square, square)


def band(letter: str, u: Signal, s: Signal, p: Signal, d: Signal) -> Signal:
    """Return the output of a band, the difference of its branches; its names have its letter."""

    def branch(first: int, gain: str, coefficient: str) -> Signal:
        y = getattr(p, gain) * u
        for k in range(first, first + 3):
            x = getattr(s, f"{letter}{k}")
            lead, slow = (getattr(p, f"T{letter}{n}") for n in (2 * k - 1, 2 * k))
            constant = getattr(p, coefficient) if k == first else 1.0
            y, slope = scaled_lead_lag(y, x, constant, lead, slow)
            setattr(d, f"{letter}{k}", slope)
        return y

    upper = branch(1, f"K{letter}1", f"K{letter}11")
    lower = branch(4, f"K{letter}2", f"K{letter}17")
    ceiling, floor = getattr(p, f"V{letter}MAX"), getattr(p, f"V{letter}MIN")
    return clip(getattr(p, f"K{letter}") * (upper - lower), floor, ceiling)


def scaled_lead_lag(
    u: Signal, x: Signal, K: Signal, TC: Signal, TB: Signal
) -> tuple[Signal, Signal]:
    """(K + sTC) / (1 + sTB), or K where TB = 0; the state is u seen through the lag TB."""
    slope = (u - x) * rate(TB)
    return where(TB < SHORTEST, K * u, K * x + TC * slope), slope


def band_rest(letter: str, low: Signal, p: Signal, x: Signal) -> None:
    """Write the states of a band into x that a still input leads to."""
    upper, lower = getattr(p, f"K{letter}1") * low, getattr(p, f"K{letter}2") * low
    coefficients = getattr(p, f"K{letter}11"), getattr(p, f"K{letter}17")
    for k, (gained, constant) in enumerate(zip((upper, lower), coefficients, strict=True)):
        for n in range(3):
            setattr(x, f"{letter}{3 * k + n + 1}", gained if n == 0 else constant * gained)


def pss4b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS4B: multi-band stabiliser, speed and power (IEEE Std 421.5-2005, 8.4).

                                                                       VSTMAX
    vsi1 ─►[1 + sDLI + s²CLI]─►[NLI1]─►[NLI2]─┬─►[ L ]─►(+)──────►(+)─►[clip]─► vs
           [1 + sBLI + s²ALI]                 │          ▲         ▲   VSTMIN
                                              └─►[ I ]───┘         │
                                                                   │
    vsi2 ─►[  -1   ]─►[       s²     ]─►[1 ]─►[NH1]─►[NH2]─►[ H ]──┘
           [1 + sTH]  [1 + sBH + s²AH]  [sM]

    L, I and H are the bands of low, intermediate and high frequency, NLI1, NLI2,
    NH1 and NH2 notches. The low band, and the others with I and H in place of L:

    KL1 (KL11 + sTL1)/(1 + sTL2) (1 + sTL3)/(1 + sTL4) (1 + sTL5)/(1 + sTL6)
      - KL2 (KL17 + sTL7)/(1 + sTL8) (1 + sTL9)/(1 + sTL10) (1 + sTL11)/(1 + sTL12),
      times KL, limited between VLMIN and VLMAX;
    KI KI1 KI11 TI1 TI2 TI3 TI4 TI5 TI6, KI2 KI17 TI7 TI8 TI9 TI10 TI11 TI12, VIMIN
      and VIMAX;
    KH KH1 KH11 TH1 TH2 TH3 TH4 TH5 TH6, KH2 KH17 TH7 TH8 TH9 TH10 TH11 TH12, VHMIN
      and VHMAX.

    A notch is (s² + W²) / (s² + sBW + W²), with BWLI1 and WLI1, BWLI2 and WLI2,
    BWH1 and WH1, BWH2 and WH2; W = 0 leaves it out. A lag of 0 bypasses its block,
    ALI = 0 and AH = 0 leave a lag.

    The first input is the speed, the second the electrical power. The standard of
    2005 prints PE; IEC 61970-302 says that it should read -PE, the sign of the
    swing equation, which is taken here. PSS/E 36.7 takes PE, and 1/(1 + sM) for
    1/(sM): so it is with dialect: psse (vt within 1.6e-6 pu of its curve). With
    typical data the power's transducer is -80 s² / ((s³ + 82 s² + 161 s + 80) 2 H
    s): the standard's but for the sign. M is 2 H; programs that read M = 0 as the
    2 H of the machine need its value here. Typical data are the standard's, as CIM
    has them, but for M.
    """
    return three_bands(of_swing, s, u, p, d)


def three_bands(
    transducer: Callable[..., Signal], s: Signal, u: Signal, p: Signal, d: Signal
) -> Signal:
    """PSS4B with a transducer of the power."""
    low, high = transduced(transducer(s, u, p, d), s, u, p, d)
    bands = band("L", low, s, p, d) + band("I", low, s, p, d) + band("H", high, s, p, d)
    return clip(bands, p.VSTMIN, p.VSTMAX)


def pss4b_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is 0 where the speed is 1."""
    x.XLI = x.XLI1 = x.XLI2 = u.vsi1
    x.PH = x.XH = -u.vsi2
    x.YLI = x.YLI1 = x.YLI2 = x.YH = x.XH1 = x.YH1 = x.XH2 = x.YH2 = 0.0
    for letter, low in (("L", u.vsi1), ("I", u.vsi1), ("H", 0.0)):
        band_rest(letter, low, p, x)


def pss4b_rest_in_psse(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states that PSS/E's transducer of the power has at still inputs."""
    pss4b_rest(vs, u, p, x)
    x.PH, x.XH, x.MH = u.vsi2, u.vsi2, 0.0


STATES = (
    "XLI YLI XLI1 YLI1 XLI2 YLI2 PH XH YH XH1 YH1 XH2 YH2 "
    "L1 L2 L3 L4 L5 L6 I1 I2 I3 I4 I5 I6 H1 H2 H3 H4 H5 H6"
)
PSS4B = documented(
    pss4b,
    pss4b_rest,
    sheet(
        ("CLI", 0.0, "s2", (-1.0, 1.0), "second coefficient of the speed's numerator"),
        ("DLI", -0.001759, "s", (-1.0, 1.0), "first coefficient of the speed's numerator"),
        ("ALI", 0.00012739, "s2", (0.0, 1.0), "second coefficient of the speed's filter"),
        ("BLI", 0.017823, "s", (0.0, 1.0), "first coefficient of the speed's filter"),
        ("BWLI1", 0.0, *NOTCH, "bandwidth of the speed's first notch"),
        ("WLI1", 0.0, *NOTCH, "frequency of the speed's first notch"),
        ("BWLI2", 0.0, *NOTCH, "bandwidth of the speed's second notch"),
        ("WLI2", 0.0, *NOTCH, "frequency of the speed's second notch"),
        ("TH", 0.0125, *SHORT_TIME, "transducer lag of the power"),
        ("AH", 1.0, "s2", (0.0, 1000.0), "second coefficient of the power's filter"),
        ("BH", 2.0, "s", (0.001, 1000.0), "first coefficient of the power's filter"),
        ("M", 7.0, *POSITIVE_TIME, "twice the inertia constant H"),
        ("BWH1", 0.0, *NOTCH, "bandwidth of the power's first notch"),
        ("WH1", 0.0, *NOTCH, "frequency of the power's first notch"),
        ("BWH2", 0.0, *NOTCH, "bandwidth of the power's second notch"),
        ("WH2", 0.0, *NOTCH, "frequency of the power's second notch"),
        *band_rows("L", "low", 7.5, 0.075, (1.73, 2.075), (2.075, 2.491)),
        *band_rows("I", "intermediate", 30.0, 0.6, (0.173, 0.2075), (0.2075, 0.2491)),
        *band_rows("H", "high", 120.0, 0.6, (0.01513, 0.01816), (0.01816, 0.02179)),
        *of_stabiliser(VSTMAX=0.15, VSTMIN=-0.15),
    ),
    STATES,
    inputs="speed p",
    records=record(
        "PSS4B",
        "CLI DLI ALI BLI BWLI1 WLI1 BWLI2 WLI2 TH AH BH M BWH1 WH1 BWH2 WH2 KL1 KL11 TL1 TL2 TL3 "
        "TL4 TL5 TL6 KL2 KL17 TL7 TL8 TL9 TL10 TL11 TL12 KL VLMAX VLMIN KI1 KI11 TI1 TI2 TI3 TI4 "
        "TI5 TI6 KI2 KI17 TI7 TI8 TI9 TI10 TI11 TI12 KI VIMAX VIMIN KH1 KH11 TH1 TH2 TH3 TH4 TH5 "
        "TH6 KH2 KH17 TH7 TH8 TH9 TH10 TH11 TH12 KH VHMAX VHMIN VSTMAX VSTMIN",
    ),
    dialects={
        "psse": {
            "equations": partial(three_bands, as_in_psse),
            "rest": pss4b_rest_in_psse,
            "states": (*STATES.split(), "MH"),
        }
    },
)


VERY_LOW = band_rows("VL", "very low", 0.5, 0.01, (12.1, 14.5), (14.5, 17.4))


def pss4c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PSS4C: multi-band stabiliser of four bands (IEEE Std 421.5-2016).

                                                                       VSTMAX
    vsi1 ─►[1 + sDLI + s²CLI]─►[NLI1]─►[NLI2]─┬─►[VL ]─►(+)──────►(+)─►[clip]─► vs
           [1 + sBLI + s²ALI]                 │          ▲         ▲   VSTMIN
                                              ├─►[ L ]─►(+)        │
                                              │          ▲         │
                                              └─►[ I ]───┘         │
                                                                   │
    vsi2 ─►[  -1   ]─►[       s²     ]─►[1 ]─►[NH1]─►[NH2]─►[ H ]──┘
           [1 + sTH]  [1 + sBH + s²AH]  [sM]

    PSS4B with a band VL of very low frequency. VL, L, I and H are the bands of very
    low, low, intermediate and high frequency, NLI1, NLI2, NH1 and NH2 notches. The
    low band, and the others with VL, I and H in place of L:

    KL1 (KL11 + sTL1)/(1 + sTL2) (1 + sTL3)/(1 + sTL4) (1 + sTL5)/(1 + sTL6)
      - KL2 (KL17 + sTL7)/(1 + sTL8) (1 + sTL9)/(1 + sTL10) (1 + sTL11)/(1 + sTL12),
      times KL, limited between VLMIN and VLMAX;
    KVL KVL1 KVL11 TVL1 TVL2 TVL3 TVL4 TVL5 TVL6, KVL2 KVL17 TVL7 TVL8 TVL9 TVL10
      TVL11 TVL12, VVLMIN and VVLMAX;
    KI KI1 KI11 TI1 TI2 TI3 TI4 TI5 TI6, KI2 KI17 TI7 TI8 TI9 TI10 TI11 TI12, VIMIN
      and VIMAX;
    KH KH1 KH11 TH1 TH2 TH3 TH4 TH5 TH6, KH2 KH17 TH7 TH8 TH9 TH10 TH11 TH12, VHMIN
      and VHMAX.

    A notch is (s² + W²) / (s² + sBW + W²), with BWLI1 and WLI1, BWLI2 and WLI2,
    BWH1 and WH1, BWH2 and WH2; W = 0 leaves it out. A lag of 0 bypasses its block,
    ALI = 0 and AH = 0 leave a lag.

    The first input is the speed, the second the electrical power, with the sign of
    the swing equation as in PSS4B. The drawing is InterPSS's, with PowerWorld's
    parameters; GridKit has the bands alone, which PowerWorld 24 has too (its states
    within 2e-8 pu), behind another transducer of the power. M is 2 H; programs that
    read M = 0 as the 2 H of the machine need its value here. Typical data of the
    bands are the standard's, as GridKit has them, of the transducers PSS4B's.
    """
    low, high = transduced(of_swing(s, u, p, d), s, u, p, d)
    bands = band("VL", low, s, p, d) + band("L", low, s, p, d)
    bands = bands + band("I", low, s, p, d) + band("H", high, s, p, d)
    return clip(bands, p.VSTMIN, p.VSTMAX)


def pss4c_rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is 0 where the speed is 1."""
    pss4b_rest(vs, u, p, x)
    band_rest("VL", u.vsi1, p, x)


PSS4C = documented(
    pss4c,
    pss4c_rest,
    (
        *with_typical(
            PSS4B.sheet,
            KL=3.0,
            **{"KI": 20.0, "TI1": 0.2018, "TI2": 0.2421, "TI7": 0.2421, "TI8": 0.2906},
            **{"KH": 80.0, "TH1": 0.01345, "TH2": 0.01614, "TH7": 0.01614, "TH8": 0.01937},
        ),
        *VERY_LOW,
    ),
    f"{STATES} VL1 VL2 VL3 VL4 VL5 VL6",
    doubt="rests on one public diagram, that of InterPSS, but for its bands",
    inputs="speed p",
    records=record(
        "PSS4C",
        " ".join((*PSS4B.records[0].cons, *(row.symbol for row in VERY_LOW))),
        doubt="PSS/E has no PSS4C: its order is that of PowerWorld's list of parameters",
    ),
)
