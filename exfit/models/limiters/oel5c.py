"""OEL5C: overexcitation limiter that takes over, with inverse time (IEEE Std 421.5-2016).

ifd ─►[KSCALE1 ]─┬─► i
      [1 + sTF1] └─►[1 + sTCOEL]─► ic
                    [1 + sTBOEL]
                   VOELMAX1
i^K1 - IFDPU ─►[      1       ]─► t
               [sTOEL + KIFDT ]
                     0
               VOELMAX
ref - K ic ─►[KPOEL + KIOEL/s]─► v
               VOELMIN

t latches at IFDLIM, and the latch is released at 0: ref is IFDREF2 while it is
set, IFDREF1 otherwise. The output is v while it is set, or while i has been
above IFDPULEV for longer than TIFDLEV, and IBIAS otherwise, which has to be
above what the gate lets pass. The count t ends at 0 and VOELMAX1 (non-windup).
Not modelled: the regulator of the exciter's field current (VFE, with SW1 in
position B) in place of IBIAS, as exciters do not give that current out. The
equations are those of Dynawo, the parameters those of PSCAD's and GridKit's
lists, whose first set of typical data this is. PSS/E's record is not known.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, limited, pi, where
from exfit.models.limiter_blocks import latch, leaky_rest, power, timer, waiting_integral
from exfit.models.sheet import LONG_TIME, PID_GAIN, TIME, UP_TO_1000, WITHIN_1000, limits, sheet

DOUBT = "rests on one public diagram, that of Dynawo, which CoLib describes"
PLACES = ("takeover", "takeover-output")
INPUTS = ("ifd",)

SHEET = sheet(
    ("IFDPU", 1.02, "pu", (0.0001, 100.0), "field current above which the timer counts, scaled"),
    ("IFDLIM", 6.58, "pu s", (0.0001, 10000.0), "count at which it acts"),
    ("VOELMAX1", 9.49, "pu s", (0.0001, 10000.0), "ceiling of the count"),
    ("TOEL", 1.0, "s", (0.001, 10000.0), "time constant of the count"),
    ("KIFDT", 0.0043, "1", (0.0, 1000.0), "leak of the count"),
    ("K", 1.0, *UP_TO_1000, "gain of the lead-lag"),
    ("TCOEL", 0.0, *TIME, "lead"),
    ("TBOEL", 0.0, *TIME, "lag"),
    ("IFDPULEV", 1.4, "pu", (0.0001, 100.0), "field current above which it acts soon"),
    ("TIFDLEV", 1.0, *LONG_TIME, "time above that"),
    ("IFDREF1", 1.25, "pu", (0.0001, 100.0), "reference until the count is over"),
    ("IFDREF2", 1.0, "pu", (0.0001, 100.0), "reference once it is over"),
    ("KPOEL", 0.46, *PID_GAIN, "proportional gain"),
    ("KIOEL", 17.36, *PID_GAIN, "integral gain"),
    *limits("VOELMAX", 1.0, -0.99, "the PI", WITHIN_1000),
    ("KSCALE1", 0.295, "1", (0.0001, 1000.0), "scale of the field current"),
    ("TF1", 0.0, *TIME, "field current transducer lag"),
    ("IBIAS", 1.0, *WITHIN_1000, "output while it does not act"),
    ("K1", 1.0, "1", (0.1, 10.0), "exponent of the count"),
)

STATES = "I IC T LATCH OVER INTEG"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return voel."""
    current, d.I = lag(u.ifd, s.I, p.KSCALE1, p.TF1)
    seen, d.IC = lead_lag(current, s.IC, p.TCOEL, p.TBOEL)
    t = clip(s.T, 0.0, p.VOELMAX1)
    count = power(current, p.K1) - p.IFDPU - p.KIFDT * t
    d.T = limited(count / p.TOEL, s.T, 0.0, p.VOELMAX1)
    d.LATCH = latch(t >= p.IFDLIM, t <= 0.0)
    d.OVER = timer(current > p.IFDPULEV, s.OVER, p.TIFDLEV)
    over = s.LATCH > 0.5
    error = where(over, p.IFDREF2, p.IFDREF1) - p.K * seen
    v, d.INTEG = pi(error, s.INTEG, p.KPOEL, p.KIOEL, p.VOELMIN, p.VOELMAX)
    return where(over | (s.OVER > p.TIFDLEV), v, p.IBIAS)


def rest(voel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its input to pass its limits."""
    x.I = x.IC = p.KSCALE1 * u.ifd
    x.T = leaky_rest(power(x.I, p.K1) - p.IFDPU, p.KIFDT, 0.0, p.VOELMAX1)
    x.LATCH = where(x.T >= p.IFDLIM, 1.0, 0.0)
    x.OVER = 0.0
    x.INTEG = waiting_integral(p.IFDREF1 - p.K * x.IC, p.KIOEL, p.VOELMIN, p.VOELMAX)
