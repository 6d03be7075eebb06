"""OEL2C: overexcitation limiter with selectable pick-up and limiting (IEEE Std 421.5-2016).

ifd ─►[  KSCALE  ]─┬─► i
      [1 + sTROEL] └─►[KACT]─► iact
                         VINVMAX           TMAX
(i/ITFPU)^C2 - 1 ─►[K2]─►[clip]─►(+)─►[   1   ]─► t
                         VINVMIN  ▲   [s + KFB]
                                fixed      TMIN
       IINST
rate ─►[ 1 ]─ iref ─►[    1     ]─► if
       [ s ]         [1 + sTAOEL]
       ILIM
                             VOELMAX3
if + bias - iact ─►[    KPOEL + KIOEL/s   ]─► v
                   [+ sKDOEL/(1 + sTDOEL) ]
                             VOELMIN3
       VOELMAX2       VOELMAX1
v ─►[1 + sTC2OEL]─►[1 + sTC1OEL]─► voel
    [1 + sTB2OEL]  [1 + sTB1OEL]
       VOELMIN2       VOELMIN1

fixed is FIXEDRU while i is above ITFPU, FIXEDRD below; t counts to TFCL. The
reference iref is IINST, and goes to ILIM by KRD once t reaches TFCL, back by
KRU once t is below TFCL (1 - KZRU); with SW1 = 1 both rates are
K1 ((i/ITFPU)^C1 - 1) instead. The limiter is inactive with the bias IRESET and
active with none: activated when t reaches TFCL or iact has been above iref for
TEN (TEN = 0: always), inactive again when iref is IINST and has been above iact
by ITHOFF for TOFF. At the summing point VOELMAX1 is 0.

FIXEDRU and FIXEDRD are as the lists of parameters have them ("fixed delay
time", "fixed cooling-down time", "reset delay time": PSCAD, PowerWorld,
GridKit). PSS/E has them the other way round, and so have Dynawo and InterPSS:
with FIXEDRU = 1 the timer of PSS/E 36.7 (OEL2CU1) runs at 0.9961 below the
pick-up. With the two exchanged it counts as here, within 1e-4: an export writes
them exchanged, and data of a .dyr file are to be exchanged. With the sample
data as they are PSS/E's timer never runs back. Dynawo has no memory of being
active, which InterPSS has: without either condition its bias is 0. Lists call
TC1OEL and TC2OEL lags and TB1OEL and TB2OEL leads; the letters, Dynawo and
InterPSS say the reverse, as drawn. Not modelled: the field voltage or the
exciter's field current as input. Typical data are the first set of the
standard's sample data (GridKit, PSCAD).
"""

from exfit.models.blocks import Limited, Signal, lag, where
from exfit.models.limiter_blocks import (
    BEYOND,
    INVERSE_TIME,
    RATE_SWITCH,
    RATES,
    TIMER,
    counting,
    latch,
    leaky_rest,
    regulator,
    regulator_rest,
    timed_reference,
    timers,
)
from exfit.models.sheet import (
    LONG_TIME,
    PID_GAIN,
    TIME,
    UP_TO_10000,
    WITHIN_1000,
    limits,
    record,
    sheet,
)

PLACES = ("takeover", "takeover-output", "summing")
INPUTS = ("ifd",)

SHEET = sheet(
    ("TC1OEL", 0.1, *TIME, "lead of the last block"),
    ("TB1OEL", 0.1, *TIME, "lag of the last block"),
    ("TC2OEL", 0.1, *TIME, "lead of the last but one"),
    ("TB2OEL", 0.1, *TIME, "lag of the last but one"),
    ("KPOEL", 0.5, *PID_GAIN, "proportional gain"),
    ("KIOEL", 0.0, *PID_GAIN, "integral gain"),
    ("KDOEL", 0.0, *UP_TO_10000, "derivative gain"),
    ("TDOEL", 0.1, *TIME, "derivative lag"),
    *limits("VOELMAX3", 100.0, -100.0, "the PID", WITHIN_1000),
    *limits("VOELMAX2", 100.0, -100.0, "the last block but one", WITHIN_1000),
    *limits("VOELMAX1", 10.0, -10.0, "the output", WITHIN_1000),
    ("IRESET", 100.0, *UP_TO_10000, "bias while it is inactive"),
    ("TEN", 0.2, *LONG_TIME, "activation delay"),
    ("TOFF", 5.0, *LONG_TIME, "reset delay"),
    ("ITHOFF", 0.05, "pu", (-10.0, 100.0), "distance below the reference that resets"),
    ("KSCALE", 1.0, "1", (0.0001, 1000.0), "scale of the field current"),
    ("TROEL", 0.01, *TIME, "field current transducer lag"),
    ("KACT", 1.0, "1", (0.0001, 1000.0), "scale of the current that is limited"),
    ("ITFPU", 3.0, "pu", (0.0001, 1000.0), "field current above which the timer counts"),
    ("IINST", 6.0, "pu", (0.0001, 10000.0), "instantaneous limit"),
    ("ILIM", 3.0, "pu", (0.0001, 10000.0), "thermal limit"),
    ("TAOEL", 0.04, *TIME, "lag of the reference"),
    *INVERSE_TIME,
    ("TFCL", 10.0, "s", (0.001, 10000.0), "reference of the timer"),
    *TIMER,
    *RATES,
    *RATE_SWITCH,
)

RECORDS = record(
    "OEL2C",
    "TC1OEL TB1OEL TC2OEL TB2OEL KPOEL KIOEL KDOEL TDOEL VOELMAX3 VOELMIN3 VOELMAX2 VOELMIN2 "
    "VOELMAX1 VOELMIN1 IRESET TEN TOFF ITHOFF KSCALE TROEL KACT ITFPU IINST ILIM TAOEL C1 K1 C2 K2 "
    "VINVMAX VINVMIN FIXEDRU FIXEDRD TFCL TMAX TMIN KFB KRD KRU KZRU",
    icons={"OELINPUT": 0},
    held={"SW1": 0.0},
    exchanged="FIXEDRU FIXEDRD",
    doubt="its order is that of PowerWorld's list, not confirmed by a file; another program "
    "reads SW1 as a second integer and a rated field current at the end",
)

STATES = "I T IREF IF OVER BELOW ACTIVE INTEG DERIV V2 V1"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return voel."""
    current, d.I = lag(u.ifd, s.I, p.KSCALE, p.TROEL)
    actual = p.KACT * current
    t, iref = timed_reference(current, s, p, d, p.TFCL)
    filtered, d.IF = lag(iref, s.IF, 1.0, p.TAOEL)
    d.OVER, d.BELOW = timers(s.OVER, s.BELOW, actual, iref, p.TEN, p)
    d.ACTIVE = activity(s, t, iref, p)
    error = filtered - actual + where(s.ACTIVE > 0.5, 0.0, p.IRESET)
    return regulator(error, s, p, d, "OEL")


def activity(s: Signal, t: Signal, iref: Signal, p: Signal) -> Limited:
    """Return the slope of the state that is 1 while the limiter is active."""
    return latch((t >= p.TFCL) | (s.OVER >= p.TEN), (iref >= p.IINST) & (s.BELOW > p.TOFF))


def rest(voel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its input to pass its limits."""
    x.I = p.KSCALE * u.ifd
    x.T = leaky_rest(counting(x.I, p), p.KFB, p.TMIN, p.TMAX)
    x.IREF = x.IF = p.IINST
    x.OVER, x.BELOW = 0.0, p.TOFF + BEYOND
    x.ACTIVE = where(p.TEN > 0.0, 0.0, 1.0)
    bias = where(p.TEN > 0.0, p.IRESET, 0.0)
    regulator_rest(p.IINST - p.KACT * x.I + bias, p, x, "OEL")
