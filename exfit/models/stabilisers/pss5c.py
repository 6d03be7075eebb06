"""PSS5C: multi-band stabiliser of speed alone (IEEE Std 421.5-2016).

                                      VVLMAX
vsi1 ─┬─►[  1 + sD   ]─┬──►[VL]─►[KVL]─►[clip]─►(+)
      │  [1 + sB+s²A ] │                VVLMIN   │
      │                │                VLMAX    ▼
      │                ├──►[L ]─►[KL ]─►[clip]─►(+)
      │                │                VLMIN    │
      │                │                VIMAX    ▼      VSTMAX
      │                └──►[I ]─►[KI ]─►[clip]─►(+)────►[clip]─► vs
      │                                 VIMIN    ▲      VSTMIN
      │                                 VHMAX    │
      └─►[    80 s²    ]──►[H ]─►[KH ]─►[clip]───┘
         [(s+80)(s+1)² ]                VHMIN

VL, L, I and H are the bands of very low, low, intermediate and high frequency.
The low band, with its central frequency FL (Hz), is

66 ((1 + s/(K3 FL))/(1 + s/(K2 FL)) - (1 + s/(K2 FL))/(1 + s/(K1 FL))),

and so are the others with FVL, FI and FH. K1, K2 and K3 are 2 pi over sqrt(R),
times sqrt(R) and times R sqrt(R), with R = 1.2; 66 is (R² + R)/(R - 1)², with
which a band passes its central frequency as it is. D, B and A are 0.001759 s,
0.017823 s and 0.00012739 s².

The speed alone: behind the swing equation it stands for PSS4C's power. The
drawing is InterPSS's, the factor 66 that of PowerWorld 24, with whose curve it
agrees (vt 1e-6 pu over a fault). It is PSS4C with its sample data, without
notches and but for the sign of D (-0.001759 in CIM's PSS4B). Typical data are
the standard's, as GridKit has them.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, second_order, second_order_lead
from exfit.models.sheet import WITHIN_10000, Sheet, limits, record, sheet
from exfit.models.stabiliser_parts import of_stabiliser

INPUTS = "speed"


def band_rows(letter: str, name: str, gain: float, frequency: float, most: float) -> Sheet:
    """Make the rows of a band: its gain, its frequency and its limits."""
    return sheet(
        (f"K{letter}", gain, *WITHIN_10000, f"gain of the {name} band"),
        (f"F{letter}", frequency, "Hz", (0.0001, 100.0), f"central frequency of the {name} band"),
        *limits(f"V{letter}MAX", most, -most, f"the {name} band"),
    )


SHEET = sheet(
    *band_rows("VL", "very low", 0.5, 0.01, 0.01),
    *band_rows("L", "low", 3.0, 0.07, 0.075),
    *band_rows("I", "intermediate", 20.0, 0.6, 0.6),
    *band_rows("H", "high", 80.0, 9.0, 0.6),
    ("K1", 5.736, "1", (0.001, 1000.0), "rate of the slowest lag over the central frequency"),
    ("K2", 6.883, "1", (0.001, 1000.0), "rate of a lead and a lag over the central frequency"),
    ("K3", 8.259, "1", (0.001, 1000.0), "rate of the fastest lead over the central frequency"),
    *of_stabiliser(VSTMAX=0.15, VSTMIN=-0.15),
)

RECORDS = record(
    "PSS5C",
    "KVL FVL VVLMAX VVLMIN KL FL VLMAX VLMIN KI FI VIMAX VIMIN KH FH VHMAX VHMIN K1 K2 K3 VSTMAX "
    "VSTMIN",
    doubt="PSS/E has no PSS5C: its order is that of PowerWorld's list of parameters",
)

STATES = "XLI YLI PH XH YH VL1 VL2 L1 L2 I1 I2 H1 H2"
D, B, A = 0.001759, 0.017823, 0.00012739  # s, s, s^2: the transducer of low frequencies
TH, BH, AH = 1.0 / 80.0, 2.0, 1.0  # s, s, s^2: that of high ones
R = 1.2  # of the frequencies of a band, by which K1 to K3 are made
PEAK = R * (R + 1.0) / ((R - 1.0) * (R - 1.0))  # 66, over that of a difference of leads and lags


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    low, d.XLI, d.YLI = second_order_lead(u.vsi1, s.XLI, s.YLI, D, 0.0, B, A)
    lagged, d.PH = lag(u.vsi1, s.PH, 1.0, TH)
    _, d.XH, d.YH = second_order(lagged, s.XH, s.YH, BH, AH)
    bands = band("VL", low, s, p, d) + band("L", low, s, p, d)
    bands = bands + band("I", low, s, p, d) + band("H", d.YH, s, p, d)
    return clip(bands, p.VSTMIN, p.VSTMAX)


def band(letter: str, u: Signal, s: Signal, p: Signal, d: Signal) -> Signal:
    """Return the output of a band, the difference of two leads and lags; its names have VL to H."""
    f = getattr(p, f"F{letter}")
    first, second = f"{letter}1", f"{letter}2"
    upper, slope = lead_lag(u, getattr(s, first), 1.0 / (p.K3 * f), 1.0 / (p.K2 * f))
    setattr(d, first, slope)
    lower, slope = lead_lag(u, getattr(s, second), 1.0 / (p.K2 * f), 1.0 / (p.K1 * f))
    setattr(d, second, slope)
    ceiling, floor = getattr(p, f"V{letter}MAX"), getattr(p, f"V{letter}MIN")
    return clip(PEAK * getattr(p, f"K{letter}") * (upper - lower), floor, ceiling)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.XLI = x.PH = x.XH = x.VL1 = x.VL2 = x.L1 = x.L2 = x.I1 = x.I2 = u.vsi1
    x.YLI = x.YH = x.H1 = x.H2 = 0.0
