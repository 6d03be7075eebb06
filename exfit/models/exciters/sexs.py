"""SEXS: simplified excitation system (PSS/E; AC4 of the IEEE report of 1981).

                             EMAX
vref + vs ─►(+)─►[1 + sTA]─►[  K  ]─► efd
           -▲    [1 + sTB]  [1+sTE]
vc1 ────────┘                EMIN

TA = TATB TB: the record gives the ratio TA/TB. The limits of the lag are
non-windup. Not modelled: UEL and OEL at the summing point.
"""

from exfit.engine.trace import Signal
from exfit.models.blocks import lead_lag, limited_lag
from exfit.models.sheet import EXCITER_LAG, FREE, record, sheet

SHEET = sheet(
    ("TATB", 0.1, "1", (0.0, 100.0), "regulator lead, as a share of its lag", FREE),
    ("TB", 10.0, "s", (0.0, 100.0), "regulator lag", FREE),
    ("K", 200.0, "pu", (0.01, 100000.0), "regulator gain", FREE),
    ("TE", 0.05, "s", (0.0, 10.0), "exciter time constant", EXCITER_LAG),
    ("EMIN", 0.0, "pu", (-9999.0, 9999.0), "floor of the field voltage"),
    ("EMAX", 4.0, "pu", (-9999.0, 9999.0), "ceiling of the field voltage"),
)

RECORDS = (record("SEXS", "TATB TB K TE EMIN EMAX"),)

PSLF_RECORDS = (
    record(
        "sexs",
        "TATB TB K TE EMIN EMAX KC TC EFDMIN EFDMAX SPARE",
        absent={"TC": 0.0, "EFDMIN": -999.0, "EFDMAX": 999.0, "SPARE": 0.0},
        ignored="KC",
        doubt="what stands behind EMAX is not confirmed; it is taken to be without effect",
    ),
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
