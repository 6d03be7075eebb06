"""What limiters share: timers, latches, powers of a current, where a regulator waits.

A timer and a latch are states that are put back after each step of a simulation, so that they
switch on its grid: a parameter that acts through the instant alone has no derivative.
"""

from exfit.engine.trace import Signal, clip, exp, larger, log, where
from exfit.models.blocks import Limited, limited, zero

POWERS = ("p", "q")  # what a limiter sees of the stator current, beside the voltage
LEAST_CURRENT = 1e-6  # pu; a power of less is that of this
BEYOND = 1.0  # s by which a timer passes what it is compared with


def power(x: Signal, exponent: Signal) -> Signal:
    """Return x to a power, of a current or voltage, which is not negative."""
    return exp(exponent * log(larger(x, LEAST_CURRENT)))


def timer(runs: Signal, x: Signal, most: Signal) -> Limited:
    """Return the slope of a timer: it counts seconds, up to ``most``, and is 0 unless it runs."""
    return limited(where(runs, 1.0, 0.0), x, 0.0, where(runs, most + BEYOND, 0.0))


def latch(sets: Signal, resets: Signal) -> Limited:
    """Return the slope of a state that is 1 once it is set, and 0 once it is reset."""
    return Limited(0.0, where(sets, 1.0, 0.0), where(sets, 1.0, where(resets, 0.0, 1.0)))


def waiting_integral(u: Signal, KI: Signal, low: Signal, high: Signal) -> Signal:
    """Return where the integral of a PI or PID waits whose input is not zero: at a limit."""
    return where(zero(KI), 0.0, where(KI * u > 0.0, high, low))


def leaky_rest(u: Signal, leak: Signal, low: Signal, high: Signal) -> Signal:
    """Return where an integral of ``u - leak x`` waits between its limits; at the floor for 0."""
    none = zero(leak)
    still = clip(u / where(none, 1.0, leak), low, high)
    return where(none, where(u > 0.0, high, low), still)
