"""SEXS: simplified excitation system (PSS/E; AC4 of the IEEE report of 1981).

                             EMAX
vref + vs ─►(+)─►[1 + sTA]─►[  K  ]─► efd
           -▲    [1 + sTB]  [1+sTE]
vc1 ────────┘                EMIN

TA = TATB TB: the record gives the ratio TA/TB. The limits of the lag are
non-windup. Not modelled: UEL and OEL at the summing point.
"""

from exfit.models.blocks import Signal, lead_lag, limited_lag
from exfit.models.sheet import LIMIT, record, shared, sheet

SHEET = sheet(
    *shared(TATB=0.1, TB_ALONE=10.0, K=200.0, TE_OR_0=0.05),
    ("EMIN", 0.0, *LIMIT, "floor of the field voltage"),
    ("EMAX", 4.0, *LIMIT, "ceiling of the field voltage"),
)

RECORDS = record("SEXS", "TATB TB K TE EMIN EMAX")

PSLF_RECORDS = record(
    "sexs",
    "TATB TB K TE EMIN EMAX KC TC EFDMIN EFDMAX SPARE",
    absent={"TC": 0.0, "EFDMIN": -999.0, "EFDMAX": 999.0, "SPARE": 0.0},
    ignored="KC",
    doubt="the constants after EMAX are not confirmed; they are taken to have no effect",
)

STATES = "VL EFD"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vl, d.VL = lead_lag(u.vref + u.vs - u.vc1, s.VL, p.TATB * p.TB, p.TB)
    efd, d.EFD = limited_lag(vl, s.EFD, p.K, p.TE, p.EMIN, p.EMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = efd / p.K
    x.VL, x.EFD = error, efd
    return u.vc1 + error - u.vs
