"""What limiters share: timers, latches, powers of a current, where a regulator waits.

A timer and a latch are states that are put back after each step of a simulation, so that they
switch on its grid: a parameter that acts through the instant alone has no derivative.
"""

from exfit.engine.trace import Signal, clip, exp, larger, log, sqrt, where
from exfit.models.blocks import Limited, limited, limited_lead_lag, pid, zero
from exfit.models.sheet import INTEGRAL_GAIN, limits, sheet

POWERS = ("p", "q")  # what a limiter sees of the stator current, beside the voltage
LEAST_CURRENT = 1e-6  # pu; a power of less is that of this
BEYOND = 1.0  # s by which a timer passes what it is compared with


INVERSE_TIME = sheet(
    ("C1", 0.0, "1", (0.0, 100.0), "exponent of the rate with SW1 = 1"),
    ("K1", 0.0, "pu/s", (-10000.0, 10000.0), "gain of the rate with SW1 = 1"),
    ("C2", 2.0, "1", (0.0, 100.0), "exponent of the inverse time"),
    ("K2", 0.0296, "1", (-10000.0, 10000.0), "gain of the inverse time"),
    *limits("VINVMAX", 100.0, 0.0, "the inverse time", ("1", (-1000.0, 1000.0))),
    ("FIXEDRU", 0.0, "1", (-1000.0, 1000.0), "fixed count above the pick-up"),
    ("FIXEDRD", -0.001, "1", (-1000.0, 1000.0), "fixed count below the pick-up"),
)
TIMER = sheet(
    ("TMAX", 10.0, "s", (0.0, 10000.0), "ceiling of the timer"),
    ("TMIN", 0.0, "s", (-10000.0, 1000.0), "floor of the timer"),
    ("KFB", 0.0, "1/s", (0.0, 1000.0), "feedback of the timer"),
)
RATES = sheet(
    ("KRD", -1000.0, "pu/s", (-100000.0, 0.0), "rate of the reference down"),
    ("KRU", 1000.0, *INTEGRAL_GAIN, "rate of the reference up"),
    ("KZRU", 0.99, "1", (0.0, 1.0), "share of the timer at which the reference rises"),
)
RATE_SWITCH = sheet(
    ("SW1", 0.0, "1", (0.0, 1.0), "rates of the reference: 0 fixed, 1 by the current")
)


def power(x: Signal, exponent: Signal) -> Signal:
    """Return x to a power, of a current or voltage, which is not negative."""
    return exp(exponent * log(larger(x, LEAST_CURRENT)))


def magnitude(ip: Signal, iq: Signal) -> Signal:
    """Return the magnitude of a current, which is never quite zero."""
    return sqrt(larger(ip * ip + iq * iq, LEAST_CURRENT * LEAST_CURRENT))


def stator_current(u: Signal) -> Signal:
    """Return the magnitude of the stator current, which is never quite zero."""
    return magnitude(u.p, u.q) / u.vt


def timer(runs: Signal, x: Signal, most: Signal) -> Limited:
    """Return the slope of a timer: it counts seconds, up to ``most``, and is 0 unless it runs."""
    return limited(where(runs, 1.0, 0.0), x, 0.0, where(runs, most + BEYOND, 0.0))


def timers(
    over: Signal, below: Signal, actual: Signal, limit: Signal, delay: Signal, p: Signal
) -> tuple[Signal, Signal]:
    """Return the slopes of the timers above and below a limit."""
    return (timer(actual > limit, over, delay), timer(limit > actual + p.ITHOFF, below, p.TOFF))


def latch(sets: Signal, resets: Signal) -> Limited:
    """Return the slope of a state that is 1 once it is set, and 0 once it is reset."""
    return Limited(0.0, where(sets, 1.0, 0.0), where(sets, 1.0, where(resets, 0.0, 1.0)))


def waiting_integral(u: Signal, KI: Signal, low: Signal, high: Signal) -> Signal:
    """Rest the integral of a PI or PID whose input is not zero at a limit."""
    return where(zero(KI), 0.0, where(KI * u > 0.0, high, low))


def leaky_rest(u: Signal, leak: Signal, low: Signal, high: Signal) -> Signal:
    """Rest an integral of ``u - leak x`` between its limits; at the floor for 0."""
    none = zero(leak)
    still = clip(u / where(none, 1.0, leak), low, high)
    return where(none, where(u > 0.0, high, low), still)


def counting(current: Signal, p: Signal) -> Signal:
    """Compute the rate of a timer of inverse time, without its feedback."""
    ratio = current / p.ITFPU
    inverse = clip(p.K2 * (power(ratio, p.C2) - 1.0), p.VINVMIN, p.VINVMAX)
    return inverse + where(ratio > 1.0, p.FIXEDRU, p.FIXEDRD)


def rate_of_reference(current: Signal, up_when: Signal, down_when: Signal, p: Signal) -> Signal:
    """Compute the rate of the reference: down when the time is over, up when it is released."""
    by_current = p.K1 * (power(current / p.ITFPU, p.C1) - 1.0)
    up, down = (where(p.SW1 > 0.5, by_current, fixed) for fixed in (p.KRU, p.KRD))
    return where(up_when, up, where(down_when, down, 0.0))


def timed_reference(
    current: Signal, s: Signal, p: Signal, d: Signal, time: Signal, at_once: Signal = False
) -> tuple[Signal, Signal]:
    """Write the slopes of a timer T and of a reference IREF and return T and the reference.

    The reference goes down once T reaches ``time``, or ``at_once``.
    """
    t = clip(s.T, p.TMIN, p.TMAX)
    d.T = limited(counting(current, p) - p.KFB * t, s.T, p.TMIN, p.TMAX)
    iref = clip(s.IREF, p.ILIM, p.IINST)
    left = time - t
    rate = rate_of_reference(current, left >= p.KZRU * time, (left <= 0.0) | at_once, p)
    d.IREF = limited(rate, s.IREF, p.ILIM, p.IINST)
    return t, iref


def regulator(error: Signal, s: Signal, p: Signal, d: Signal, side: str, own: str = "") -> Signal:
    """Write the slopes of a PID and its two lead-lags and return their output.

    ``side``, OEL or UEL, is in the names of their parameters, ``own`` in those of their states.
    """
    KP, KI, KD, TD = (getattr(p, name + side) for name in ("KP", "KI", "KD", "TD"))
    integral, steep = getattr(s, "INTEG" + own), getattr(s, "DERIV" + own)
    v, d_integral, d_steep = pid(error, integral, steep, KP, KI, KD, TD, *_limits(p, side, 3))
    setattr(d, "INTEG" + own, d_integral)
    setattr(d, "DERIV" + own, d_steep)
    for k in (2, 1):
        lead, lag = getattr(p, f"TC{k}{side}"), getattr(p, f"TB{k}{side}")
        v, slope = limited_lead_lag(v, getattr(s, f"V{k}{own}"), lead, lag, *_limits(p, side, k))
        setattr(d, f"V{k}{own}", slope)
    return v


def regulator_rest(error: Signal, p: Signal, x: Signal, side: str, own: str = "") -> None:
    """Write the states of a PID and its two lead-lags that wait at an error."""
    integral = waiting_integral(error, getattr(p, "KI" + side), *_limits(p, side, 3))
    setattr(x, "DERIV" + own, error)
    setattr(x, "INTEG" + own, integral)
    v = clip(getattr(p, "KP" + side) * error + integral, *_limits(p, side, 3))
    for k in (2, 1):
        v = clip(v, *_limits(p, side, k))
        setattr(x, f"V{k}{own}", v)


def _limits(p: Signal, side: str, k: int) -> tuple[Signal, Signal]:
    return getattr(p, f"V{side}MIN{k}"), getattr(p, f"V{side}MAX{k}")
