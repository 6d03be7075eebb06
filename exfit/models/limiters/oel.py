"""Overexcitation limiters: OEL2C, OEL3C and OEL5C."""

from exfit.models.blocks import (
    Signal,
    clip,
    lag,
    lead_lag,
    limited,
    limited_integrator,
    pi,
    where,
)
from exfit.models.limiter_blocks import (
    BEYOND,
    INVERSE_TIME,
    RATE_SWITCH,
    RATES,
    TIMER,
    counting,
    latch,
    leaky_rest,
    power,
    regulator,
    regulator_rest,
    timed_reference,
    timer,
    timers,
    waiting_integral,
)
from exfit.models.sheet import (
    LONG_TIME,
    PID_GAIN,
    TIME,
    UP_TO_1000,
    UP_TO_10000,
    WITHIN_1000,
    documented,
    limits,
    record,
    sheet,
)


def oel2c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    current, d.I = lag(u.ifd, s.I, p.KSCALE, p.TROEL)
    actual = p.KACT * current
    t, iref = timed_reference(current, s, p, d, p.TFCL)
    filtered, d.IF = lag(iref, s.IF, 1.0, p.TAOEL)
    d.OVER, d.BELOW = timers(s.OVER, s.BELOW, actual, iref, p.TEN, p)
    on, off = (t >= p.TFCL) | (s.OVER >= p.TEN), (iref >= p.IINST) & (s.BELOW > p.TOFF)
    d.ACTIVE = latch(on, off)
    error = filtered - actual + where(s.ACTIVE > 0.5, 0.0, p.IRESET)
    return regulator(error, s, p, d, "OEL")


def oel2c_rest(voel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its input to pass its limits."""
    x.I = p.KSCALE * u.ifd
    x.T = leaky_rest(counting(x.I, p), p.KFB, p.TMIN, p.TMAX)
    x.IREF = x.IF = p.IINST
    x.OVER, x.BELOW = 0.0, p.TOFF + BEYOND
    x.ACTIVE = where(p.TEN > 0.0, 0.0, 1.0)
    bias = where(p.TEN > 0.0, p.IRESET, 0.0)
    regulator_rest(p.IINST - p.KACT * x.I + bias, p, x, "OEL")


OF_OEL2C = (
    "TC1OEL TB1OEL TC2OEL TB2OEL KPOEL KIOEL KDOEL TDOEL VOELMAX3 VOELMIN3 VOELMAX2 VOELMIN2 "
    "VOELMAX1 VOELMIN1 IRESET TEN TOFF ITHOFF KSCALE TROEL KACT ITFPU IINST ILIM TAOEL C1 K1 "
    "C2 K2 VINVMAX VINVMIN FIXEDRU FIXEDRD TFCL TMAX TMIN KFB KRD KRU KZRU"
)
OEL2C = documented(
    oel2c,
    oel2c_rest,
    sheet(
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
    ),
    "I T IREF IF OVER BELOW ACTIVE INTEG DERIV V2 V1",
    places="takeover takeover-output summing",
    inputs="ifd",
    records=record(
        "OEL2C",
        OF_OEL2C,
        icons={"OELINPUT": 0},
        held={"SW1": 0.0},
        exchanged="FIXEDRU FIXEDRD",
        doubt="its order is that of PowerWorld's list, not confirmed by a file",
    )
    + record(
        "OEL2CU1",
        f"{OF_OEL2C} IFDRATED",
        icons={"OELINPUT": 2, "RAMPS": 1},
        absent={"IFDRATED": 1.0},
        held={"SW1": 0.0},
        exchanged="FIXEDRU FIXEDRD",
        user="10 0 2 41 8 8",
    ),
    aliases="OEL2CU1",
)


def oel3c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    current, d.I = lag(u.ifd, s.I, p.KSCALE, p.TF)
    error = p.KOEL * (power(p.ITFPU, p.K1) - power(current, p.K1))
    integral, d.V = limited_integrator(error, s.V, p.TOEL, p.VOELMIN1, p.VOELMAX1)
    proportional = where(integral < 0.0, p.KPOEL * error, 0.0)
    return clip(integral + proportional, p.VOELMIN2, p.VOELMAX2)


def oel3c_rest(voel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    x.I, x.V = p.KSCALE * u.ifd, p.VOELMAX1


OEL3C = documented(
    oel3c,
    oel3c_rest,
    sheet(
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
    ),
    "I V",
    doubt="rests on one public diagram, that of Dynawo, which CoLib describes",
    places="summing",
    inputs="ifd",
    records=record(
        "OEL3C",
        "ITFPU KSCALE TF K1 KOEL TOEL KPOEL VOELMAX1 VOELMIN1 VOELMAX2 VOELMIN2",
        icons={"OELINPUT": 0},
        doubt="its order is that of PowerWorld's list, not confirmed by a file",
    ),
)


def oel5c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """OEL5C: takeover overexcitation limiter with inverse time (IEEE Std 421.5-2016).

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


def oel5c_rest(voel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its input to pass its limits."""
    x.I = x.IC = p.KSCALE1 * u.ifd
    x.T = leaky_rest(power(x.I, p.K1) - p.IFDPU, p.KIFDT, 0.0, p.VOELMAX1)
    x.LATCH = where(x.T >= p.IFDLIM, 1.0, 0.0)
    x.OVER = 0.0
    x.INTEG = waiting_integral(p.IFDREF1 - p.K * x.IC, p.KIOEL, p.VOELMIN, p.VOELMAX)


OEL5C = documented(
    oel5c,
    oel5c_rest,
    sheet(
        (
            "IFDPU",
            1.02,
            "pu",
            (0.0001, 100.0),
            "field current above which the timer counts, scaled",
        ),
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
    ),
    "I IC T LATCH OVER INTEG",
    doubt="rests on one public diagram, that of Dynawo, which CoLib describes",
    places="takeover takeover-output",
    inputs="ifd",
)
