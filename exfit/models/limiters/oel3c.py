"""OEL3C: overexcitation limiter at the summing point, with an integral (IEEE Std 421.5-2016).

ifd ─►[KSCALE ]─► i
      [1 + sTF]
                            VOELMAX1          VOELMAX2
ITFPU^K1 - i^K1 ─►[KOEL]─┬─►[  1  ]───►(+)─►[clip]─► voel
                         │  [sTOEL]     ▲   VOELMIN2
                         │  VOELMIN1    │
                         └─►[KPOEL]─────┘

The integral begins at VOELMAX1 and descends while the scaled field current is
above ITFPU, and the branch of KPOEL acts only while the integral is negative:
VOELMAX1 sets how long the limiter waits. With VOELMAX2 = 0 the output, which is
added to the voltage error, only lowers the voltage. Dynawo, of which the
equations are, lets the integral begin at 0, which leaves no time to wait; no
public source says where it begins. Not modelled: the field voltage or the
exciter's field current as input. Typical data are those of CoLib.
"""

from exfit.models.blocks import Signal, clip, lag, limited_integrator, where
from exfit.models.limiter_blocks import power
from exfit.models.sheet import TIME, UP_TO_1000, UP_TO_10000, WITHIN_1000, limits, record, sheet

DOUBT = "rests on one public diagram, that of Dynawo, which CoLib describes"
PLACES = ("summing",)
INPUTS = ("ifd",)

SHEET = sheet(
    ("ITFPU", 3.7, "pu", (0.001, 100.0), "field current above which it acts, scaled"),
    ("KSCALE", 1.0, "1", (0.0001, 1000.0), "scale of the field current"),
    ("TF", 0.02, *TIME, "field current transducer lag"),
    ("K1", 1.0, "1", (0.1, 10.0), "exponent of the error"),
    ("KOEL", 1.0, "pu", (0.0001, 10000.0), "gain"),
    ("TOEL", 24.0, "s", (0.001, 10000.0), "integral time constant"),
    ("KPOEL", 1.0, *UP_TO_10000, "proportional gain"),
    ("VOELMAX1", 0.66, *UP_TO_1000, "ceiling of the integral"),
    ("VOELMIN1", -1.0, "pu", (-1000.0, 0.0), "floor of the integral"),
    *limits("VOELMAX2", 0.0, -1.0, "the output", WITHIN_1000),
)

RECORDS = record(
    "OEL3C",
    "ITFPU KSCALE TF K1 KOEL TOEL KPOEL VOELMAX1 VOELMIN1 VOELMAX2 VOELMIN2",
    icons={"OELINPUT": 0},
    doubt="its order is that of PowerWorld's list, not confirmed by a file",
)

STATES = "I V"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return voel."""
    current, d.I = lag(u.ifd, s.I, p.KSCALE, p.TF)
    error = p.KOEL * (power(p.ITFPU, p.K1) - power(current, p.K1))
    integral, d.V = limited_integrator(error, s.V, p.TOEL, p.VOELMIN1, p.VOELMAX1)
    proportional = where(integral < 0.0, p.KPOEL * error, 0.0)
    return clip(integral + proportional, p.VOELMIN2, p.VOELMAX2)


def rest(voel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    x.I, x.V = p.KSCALE * u.ifd, p.VOELMAX1
