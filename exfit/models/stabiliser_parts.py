"""What stabilisers share: a signal of the accelerating power, a canonical form, the switch."""

from functools import partial

from exfit.models.blocks import Signal, clip, high_pass, lag, lead_lag, limited, where
from exfit.models.sheet import (
    LONG_TIME,
    MOST_LAGS,
    TIME,
    WASHOUT_TIME,
    WITHIN_10,
    WITHIN_1000,
    WITHIN_10000,
    chosen,
    limits,
    sheet,
)

SWITCHING = 0.01  # s, in which the state of the switch goes from one end to the other

# rows that stabilisers share by name
SHARED = sheet(
    ("T1", 0.0, *TIME, "first lead"),
    ("T2", 0.0, *TIME, "first lag"),
    ("T3", 0.0, *TIME, "second lead"),
    ("T4", 0.0, *TIME, "second lag"),
    *limits("LSMAX", 0.0, 0.0, "the output"),
    *limits("VSTMAX", 0.0, 0.0, "the output"),
    ("KS1", 0.0, *WITHIN_10000, "stabiliser gain"),
    ("T10", 0.0, *TIME, "third lead"),
    ("T11", 0.0, *TIME, "third lag"),
    ("T1_OF_INPUT", 0.0, *TIME, "transducer lag of the first input"),
    ("T2_OF_INPUT", 0.0, *TIME, "transducer lag of the second input"),
    ("HLIM", 0.0, "pu", (0.0001, 9999.0), "limit of the output, both ways"),
)
of_stabiliser = partial(chosen, SHARED)

ACCELERATING = sheet(
    ("TW1", 10.0, *WASHOUT_TIME, "first washout of the first input"),
    ("TW2", 10.0, *LONG_TIME, "second washout of the first input"),
    ("T6", 0.0, *TIME, "transducer lag of the first input"),
    ("TW3", 10.0, *WASHOUT_TIME, "first washout of the second input"),
    ("TW4", 0.0, *LONG_TIME, "second washout of the second input"),
    ("T7", 10.0, *LONG_TIME, "transducer lag of the second input"),
    ("KS2", 0.99, *WITHIN_1000, "gain of the second input"),
    ("KS3", 1.0, *WITHIN_1000, "share of the second input that is filtered"),
    ("T8", 0.5, *TIME, "lead of the ramp tracking filter"),
    ("T9", 0.1, *TIME, "lag of the ramp tracking filter"),
    ("M", 5.0, "1", (0.0, 8.0), "number of lags of a block of the ramp tracking filter"),
    ("N", 1.0, "1", (0.0, 8.0), "number of blocks of the ramp tracking filter"),
)


INPUT_LIMITS = sheet(
    *limits("VSI1MAX", 2.0, -2.0, "the first input"),
    *limits("VSI2MAX", 2.0, -2.0, "the second input"),
)

SWITCH = sheet(
    ("PPSSON", 0.0, *WITHIN_10, "power at which it is switched on, or 0"),
    ("PPSSOFF", 0.0, *WITHIN_10, "power at which it is switched off"),
)

COMPENSATED = sheet(
    ("XCOMP", 0.0, *WITHIN_10, "reactance of the compensated frequency"),
    ("TCOMP", 0.02, *TIME, "lag of the compensated frequency"),
)

# what flags of records say of the inputs, and the ramp tracking filter that the typical data have
SPEED_AND_POWER = {"ICS1": 1, "REMBUS1": 0, "ICS2": 3, "REMBUS2": 0}
POWER_AND_SPEED = {"ICS1": 3, "REMBUS1": 0, "ICS2": 1, "REMBUS2": 0}
FILTERED_SPEED_AND_POWER = {**SPEED_AND_POWER, "M": 5, "N": 1}
# the codes of inputs of stabilisers that have a compensated frequency
WITH_FREQUENCY = {0: "none", 1: "speed", 3: "p", 4: "pa", 5: "vt", 7: "fc"}


def limited_inputs(u: Signal, p: Signal) -> tuple[Signal, Signal]:
    """Return both inputs within their limits."""
    return clip(u.vsi1, p.VSI1MIN, p.VSI1MAX), clip(u.vsi2, p.VSI2MIN, p.VSI2MAX)


def accelerating(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Compute the integral of the accelerating power from speed and power.

    Its ramp tracking filter is N blocks (1 + sT8) / (1 + sT9)^M.
    """
    vsi1, vsi2 = limited_inputs(u, p)
    w1, d.W1 = high_pass(vsi1, s.W1, p.TW1)
    w2, d.W2 = high_pass(w1, s.W2, p.TW2)
    v6, d.V6 = lag(w2, s.V6, 1.0, p.T6)
    w3, d.W3 = high_pass(vsi2, s.W3, p.TW3)
    w4, d.W4 = high_pass(w3, s.W4, p.TW4)
    v7, d.V7 = lag(w4, s.V7, p.KS2, p.T7)
    ramp = v6 + p.KS3 * v7
    for k in range(1, MOST_LAGS + 1):
        lead, slow = where(k <= p.N, p.T8, 0.0), where(k <= p.M * p.N, p.T9, 0.0)
        ramp, slope = lead_lag(ramp, getattr(s, f"R{k}"), lead, slow)
        setattr(d, f"R{k}", slope)
    return ramp - v7


def accelerating_rest(u: Signal, p: Signal, x: Signal) -> None:
    """Write the states of ``accelerating`` into x that still inputs lead to; it is then 0."""
    x.W1, x.W3 = limited_inputs(u, p)
    x.W2 = x.V6 = x.W4 = x.V7 = 0.0
    for k in range(1, MOST_LAGS + 1):
        setattr(x, f"R{k}", 0.0)


def switched(vs: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Return vs, or 0 from where the power falls to PPSSOFF to where it rises to PPSSON.

    The state goes towards the end that the power asks for, and between both powers to the nearer
    one, in ``SWITCHING``; half way it switches. With PPSSON = 0 nothing does.
    """
    here = where(s.ON > 0.5, 1.0, -1.0)
    towards = where(u.p >= p.PPSSON, 1.0, where(u.p <= p.PPSSOFF, -1.0, here))
    d.ON = limited(towards / SWITCHING, s.ON, 0.0, 1.0)
    return where((p.PPSSON <= 0.0) | (s.ON > 0.5), vs, 0.0)


def switch_rest(u: Signal, p: Signal, x: Signal) -> None:
    """Write the state of the switch into x: on where the power is PPSSON at least."""
    x.ON = where(u.p >= p.PPSSON, 1.0, 0.0)
