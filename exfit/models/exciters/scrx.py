"""SCRX: bus-fed or solid-fed rectifier exciter (PSS/E).

                             EMAX
vref + vs ─►(+)─►[1 + sTA]─►[  K  ]─►(x)─► efd
           -▲    [1 + sTB]  [1+sTE]   ▲
vc1 ────────┘                EMIN     │
                                      └─ VT where CSWITCH = 0, 1 where it is 1

TA = TATB TB: the record gives the ratio TA/TB. The limits of the lag are
non-windup. Not modelled: UEL and OEL at the summing point, and a bridge that
carries no negative field current (rc/rfd > 0), where OpenIPSL and Dynawo
disagree; a voltage step on open circuit hardly ever reaches this state.
"""

from exfit.models.blocks import Signal, lead_lag, limited_lag, where
from exfit.models.sheet import LIMIT, record, shared, sheet

SHEET = sheet(
    *shared(TATB=0.1, TB_ALONE=10.0, K=200.0, TE_OR_0=0.02),
    ("EMIN", 0.0, *LIMIT, "floor of the bridge voltage"),
    ("EMAX", 5.0, *LIMIT, "ceiling of the bridge voltage"),
    ("CSWITCH", 0.0, "1", (0.0, 1.0), "feed of the bridge: 0 bus, 1 solid"),
)

# rc/rfd = 0 is a bridge that carries negative field current
RECORDS = record("SCRX", "TATB TB K TE EMIN EMAX CSWITCH RCRFD", absent={"RCRFD": 0.0})

STATES = "VL EB"


def supply(u: Signal, p: Signal) -> Signal:
    """Return the voltage that feeds the bridge."""
    return where(p.CSWITCH > 0.5, 1.0, u.vt)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vl, d.VL = lead_lag(u.vref + u.vs - u.vc1, s.VL, p.TATB * p.TB, p.TB)
    eb, d.EB = limited_lag(vl, s.EB, p.K, p.TE, p.EMIN, p.EMAX)
    return eb * supply(u, p)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    eb = efd / supply(u, p)
    error = eb / p.K
    x.VL, x.EB = error, eb
    return u.vc1 + error - u.vs
