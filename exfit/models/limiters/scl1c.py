"""SCL1C: stator current limiter at the summing point (IEEE Std 421.5-2016).

it ─►[   1   ]─► i      it ─►[   1    ]─► late
     [1 + sTIT]              [1 + sTINV]
i^K - ISCLLIM ─► error  q/vt ─►[    1    ]─► iq
                               [1 + sTQSCL]
                      VSCLMAX
oex ─►[KPOEX + KIOEX/s]─►[max 0]─►[-1]─► voel
                      VSCLMIN

                      VSCLMAX
uex ─►[KPUEX + KIUEX/s]─►[max 0]─► vuel
                      VSCLMIN

it is the magnitude of the stator current. With SW1 = 1 (position A, reactive
current) oex is the smaller of iq^K - IQMIN and error, uex that of -iq^K - IQMIN
and error, without a delay. With SW1 = 2 (B, reactive power) they are the error:
above zero it counts in oex only while q is above VSCLDB, in uex only while q is
below -VSCLDB, and only after the delay: it has been positive for TDSCL with
SW2 = 0, or late is above ISCLLIM with SW2 = 1. Both outputs are added to the
voltage error.

The equations are Dynawo's, parameters and typical data those of GridKit, CoLib
and PowerWorld (there under SCL2C). Where the sources leave something open: the
power of a negative current has its sign, -|iq|^K (Dynawo takes whole powers as
they come); a negative error with SW1 = 2 always acts, so that the integrals go
back with the current (at fixed time Dynawo holds them). CoLib calls the outputs
a takeover, but they are 0 while it waits: at the gates of most exciters that
would act at once. PSS/E's record is not known.
"""

from exfit.models.blocks import Signal, lag, larger, pi, smaller, where
from exfit.models.limiter_blocks import POWERS, power, stator_current, timer, waiting_integral
from exfit.models.sheet import TIME, UP_TO_100, UP_TO_1000, UP_TO_10000, sheet

DOUBT = "rests on one public diagram, that of Dynawo"
PLACES = ("summing",)
INPUTS = ("vt", *POWERS)

SHEET = sheet(
    ("ISCLLIM", 1.05, "pu", (0.0001, 100.0), "stator current above which it acts"),
    ("TIT", 0.005, *TIME, "stator current transducer lag"),
    ("K", 1.0, "1", (0.1, 10.0), "exponent of the currents"),
    ("TQSCL", 0.0, *TIME, "reactive current transducer lag"),
    ("IQMIN", 0.0, *UP_TO_100, "reactive current that it leaves"),
    ("VSCLDB", 0.1, *UP_TO_100, "dead band of the reactive power"),
    ("TINV", 30.0, "s", (0.0, 10000.0), "lag of the current that starts it at inverse time"),
    ("TDSCL", 0.0, "s", (0.0, 10000.0), "fixed delay"),
    ("SW1", 1.0, "1", (1.0, 2.0), "1 reactive current, 2 reactive power"),
    ("SW2", 1.0, "1", (0.0, 1.0), "0 fixed time, 1 inverse time"),
    ("KPOEX", 0.0, *UP_TO_10000, "proportional gain, overexcited"),
    ("KIOEX", 0.2, *UP_TO_10000, "integral gain, overexcited"),
    ("KPUEX", 0.0, *UP_TO_10000, "proportional gain, underexcited"),
    ("KIUEX", 0.2, *UP_TO_10000, "integral gain, underexcited"),
    ("VSCLMAX", 1.0, *UP_TO_1000, "ceiling of each PI"),
    ("VSCLMIN", 0.0, "pu", (-1000.0, 0.0), "floor of each PI"),
)

STATES = "I LATE IQ OVER OEX UEX"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> tuple[Signal, Signal]:
    """Write the slopes of the states into d and return voel and vuel."""
    it = stator_current(u)
    current, d.I = lag(it, s.I, 1.0, p.TIT)
    late, d.LATE = lag(it, s.LATE, 1.0, p.TINV)
    iq, d.IQ = lag(u.q / u.vt, s.IQ, 1.0, p.TQSCL)
    error = power(current, p.K) - p.ISCLLIM
    d.OVER = timer(error > 0.0, s.OVER, p.TDSCL)
    over = where(p.SW2 > 0.5, late - p.ISCLLIM, s.OVER - p.TDSCL)
    limits = p.VSCLMIN, p.VSCLMAX
    oex, d.OEX = pi(acting(error, over, iq, u.q, p), s.OEX, p.KPOEX, p.KIOEX, *limits)
    uex, d.UEX = pi(acting(error, over, -iq, -u.q, p), s.UEX, p.KPUEX, p.KIUEX, *limits)
    return -larger(oex, 0.0), larger(uex, 0.0)


def acting(error: Signal, over: Signal, iq: Signal, q: Signal, p: Signal) -> Signal:
    """Return the error that one side acts on, whose reactive current and power are positive."""
    reactive = iq * power(larger(iq, -iq), p.K - 1.0)
    delayed = where((over > 0.0) & (q > p.VSCLDB), error, smaller(error, 0.0))
    return where(p.SW1 < 1.5, smaller(reactive - p.IQMIN, error), delayed)


def rest(scl: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    x.I = x.LATE = stator_current(u)
    x.IQ, x.OVER = u.q / u.vt, 0.0
    error = power(x.I, p.K) - p.ISCLLIM
    over = x.LATE - p.ISCLLIM
    limits = p.VSCLMIN, p.VSCLMAX
    x.OEX = waiting_integral(acting(error, over, x.IQ, u.q, p), p.KIOEX, *limits)
    x.UEX = waiting_integral(acting(error, over, -x.IQ, -u.q, p), p.KIUEX, *limits)
