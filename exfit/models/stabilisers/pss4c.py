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
parameters; GridKit has the bands alone. M is 2 H; programs that read M = 0 as
the 2 H of the machine need its value here. Typical data of the bands are the
standard's, as GridKit has them, of the transducers PSS4B's.
"""

from exfit.models.blocks import Signal, clip
from exfit.models.sheet import Parameter, record, with_typical
from exfit.models.stabilisers import pss4b

DOUBT = "rests on one public diagram, that of InterPSS"
INPUTS = pss4b.INPUTS
SAMPLE = {
    **{"KVL": 0.5, "TVL1": 12.1, "TVL2": 14.5, "TVL7": 14.5, "TVL8": 17.4},
    **{"VVLMAX": 0.01, "VVLMIN": -0.01},
    "KL": 3.0,
    **{"KI": 20.0, "TI1": 0.2018, "TI2": 0.2421, "TI7": 0.2421, "TI8": 0.2906},
    **{"KH": 80.0, "TH1": 0.01345, "TH2": 0.01614, "TH7": 0.01614, "TH8": 0.01937},
}


def of_very_low(row: Parameter) -> Parameter:
    """Return a row of the low band as one of the band of very low frequency."""
    symbol, meaning = f"{row.symbol[0]}V{row.symbol[1:]}", row.meaning
    return row._replace(symbol=symbol, meaning=meaning.replace("the low", "the very low"))


VERY_LOW = tuple(of_very_low(row) for row in pss4b.SHEET if "the low band" in row.meaning)
SHEET = with_typical((*pss4b.SHEET, *VERY_LOW), **SAMPLE)

RECORDS = (
    record(
        "PSS4C",
        " ".join((*pss4b.RECORDS[0].cons, *(row.symbol for row in VERY_LOW))),
        doubt="PSS/E has no PSS4C: its order is that of PowerWorld's list of parameters",
    ),
)

STATES = f"{pss4b.STATES} VL1 VL2 VL3 VL4 VL5 VL6"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    low, high = pss4b.transduced(s, u, p, d)
    bands = pss4b.band("VL", low, s, p, d) + pss4b.band("L", low, s, p, d)
    bands = bands + pss4b.band("I", low, s, p, d) + pss4b.band("H", high, s, p, d)
    return clip(bands, p.VSTMIN, p.VSTMAX)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is 0 where the speed is 1."""
    pss4b.rest(vs, u, p, x)
    pss4b.band_rest("VL", u.vsi1, p, x)
