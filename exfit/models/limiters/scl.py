"""Stator current limiters: SCL1C and SCL2C."""

from exfit.models.blocks import Signal, lag, larger, pi, smaller, sqrt, where
from exfit.models.limiter_blocks import (
    BEYOND,
    INVERSE_TIME,
    LEAST_CURRENT,
    POWERS,
    RATE_SWITCH,
    RATES,
    TIMER,
    counting,
    latch,
    leaky_rest,
    magnitude,
    power,
    regulator,
    regulator_rest,
    stator_current,
    timed_reference,
    timer,
    timers,
    waiting_integral,
)
from exfit.models.sheet import (
    LONG_TIME,
    PID_GAIN,
    TIME,
    UP_TO_10,
    UP_TO_100,
    UP_TO_1000,
    UP_TO_10000,
    WITHIN_1000,
    Sheet,
    documented,
    limits,
    sheet,
)


def acting(error: Signal, over: Signal, iq: Signal, q: Signal, p: Signal) -> Signal:
    """Return the error that one side acts on, whose reactive current and power are positive."""
    reactive = iq * power(larger(iq, -iq), p.K - 1.0)
    delayed = where((over > 0.0) & (q > p.VSCLDB), error, smaller(error, 0.0))
    return where(p.SW1 < 1.5, smaller(reactive - p.IQMIN, error), delayed)


def scl1c(s: Signal, u: Signal, p: Signal, d: Signal) -> tuple[Signal, Signal]:
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


def scl1c_rest(scl: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    x.I = x.LATE = stator_current(u)
    x.IQ, x.OVER = u.q / u.vt, 0.0
    error = power(x.I, p.K) - p.ISCLLIM
    over = x.LATE - p.ISCLLIM
    limits = p.VSCLMIN, p.VSCLMAX
    x.OEX = waiting_integral(acting(error, over, x.IQ, u.q, p), p.KIOEX, *limits)
    x.UEX = waiting_integral(acting(error, over, -x.IQ, -u.q, p), p.KIUEX, *limits)


SCL1C = documented(
    scl1c,
    scl1c_rest,
    sheet(
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
    ),
    "I LATE IQ OVER OEX UEX",
    doubt="rests on one public diagram, that of Dynawo",
    places="summing",
    inputs="vt p q",
)


def side_rows(side: str, when: str) -> Sheet:
    """Make the rows of the regulator of one side."""
    return sheet(
        (f"TB1{side}", 0.1, *TIME, f"lag of the last block, {when}"),
        (f"TC1{side}", 0.1, *TIME, f"lead of the last block, {when}"),
        (f"TB2{side}", 0.1, *TIME, f"lag of the last but one, {when}"),
        (f"TC2{side}", 0.1, *TIME, f"lead of the last but one, {when}"),
        (f"KP{side}", 0.5, *PID_GAIN, f"proportional gain, {when}"),
        (f"KI{side}", 0.0, *PID_GAIN, f"integral gain, {when}"),
        (f"KD{side}", 0.0, *UP_TO_10000, f"derivative gain, {when}"),
        (f"TD{side}", 0.1, *TIME, f"derivative lag, {when}"),
        *limits(f"V{side}MAX3", 100.0, -100.0, f"the PID, {when}", WITHIN_1000),
        *limits(f"V{side}MAX2", 100.0, -100.0, f"the last but one, {when}", WITHIN_1000),
        *limits(f"V{side}MAX1", 10.0, -10.0, f"the output, {when}", WITHIN_1000),
    )


def current_rows(side: str, when: str) -> Sheet:
    """Make the rows of what one side sees of the stator current."""
    return sheet(
        (f"TIQ{side}", 0.0, *TIME, f"reactive current lag, {when}"),
        (f"KIQ{side}", 1.0, "1", (0.0, 1000.0), f"scale of the reactive current, {when}"),
        (f"TIP{side}", 0.0, *TIME, f"active current lag, {when}"),
        (f"KIP{side}", 1.0, "1", (0.0, 1000.0), f"scale of the active current, {when}"),
    )


def reference(
    s: Signal, u: Signal, p: Signal, d: Signal, v: Signal
) -> tuple[Signal, Signal, Signal]:
    """Compute the state of the timer, the reference of the current, the inputs of both sides."""
    current, d.I = lag(stator_current(u), s.I, 1.0, p.TITSCL)
    t, iref = timed_reference(current, s, p, d, p.TSCL, v < p.VTRESET)
    active, d.IPREF = lag(u.p / u.vt, s.IPREF, p.KPREF, p.TIPOEL)
    filtered, d.IF = lag(beside(iref, active), s.IF, 1.0, p.TAOEL)
    return t >= p.TSCL, iref, filtered


def beside(iref: Signal, active: Signal) -> Signal:
    """Return the current that a reference leaves beside an active one."""
    return sqrt(larger(iref * iref - active * active, LEAST_CURRENT * LEAST_CURRENT))


def scaled(s: Signal, u: Signal, p: Signal, side: str) -> tuple[Signal, Signal, Signal, Signal]:
    """Return the current that one side sees, its reactive part, and the slopes of both parts."""
    parts = ((x, f"I{x.upper()}{side}") for x in POWERS)
    (ip, d_ip), (iq, d_iq) = (
        lag(getattr(u, x) / u.vt, getattr(s, name), getattr(p, "K" + name), getattr(p, "T" + name))
        for x, name in parts
    )
    return magnitude(ip, iq), iq, d_ip, d_iq


def scl2c(s: Signal, u: Signal, p: Signal, d: Signal) -> tuple[Signal, Signal]:
    """SCL2C: stator current limiter with selectable pick-up and limiting (IEEE Std 421.5-2016).

    it ─►[    1     ]─► i        vt ─►[    1     ]─► v
         [1 + sTITSCL]                [1 + sTVTSCL]
                             VINVMAX           TMAX
    (i/ITFPU)^C2 - 1 ─►[K2]─►[clip]─►(+)─►[   1   ]─► t
                             VINVMIN  ▲   [s + KFB]
                                    fixed      TMIN
           IINST
    rate ─►[ 1 ]─► iref        √(iref² - ipref²) ─►[    1     ]─► ref
           [ s ]                                   [1 + sTAOEL]
           ILIM
    p/vt ─►[   KIPOEL  ]─► ip      q/vt ─►[   KIQOEL  ]─► iq
           [1 + sTIPOEL]                  [1 + sTIQOEL]

                    VOELMAX3              VOELMAX2       VOELMAX1
    e ─►[KPOEL + KIOEL/s        ]─►[1 + sTC2OEL]─►[1 + sTC1OEL]─► voel
        [ + sKDOEL/(1 + sTDOEL) ]  [1 + sTB2OEL]  [1 + sTB1OEL]
                    VOELMIN3              VOELMIN2       VOELMIN1

    iact = √(ip² + iq²), and the error e is the largest of ref + bias - iact,
    IQMINOEL - iq and VTMIN - v. vuel is of the same blocks with UEL in their names,
    its reference the smaller of ref and IINSTUEL, its error min(iact - ref - bias,
    IQMAXUEL - iq). ipref is the active current behind KPREF and the lag TIPOEL.

    fixed is FIXEDRU while i is above ITFPU, FIXEDRD below; t counts to TSCL. The
    current iref is IINST, and goes to ILIM by KRD once t reaches TSCL or v is below
    VTRESET, back by KRU once t is below TSCL (1 - KZRU); with SW1 = 1 both rates
    are K1 ((i/ITFPU)^C1 - 1) instead. A side is inactive with the bias IRESET and
    active with none: activated when t reaches TSCL or iact has been above its
    reference for TENOEL or TENUEL (0: always), inactive again when iref is back and
    the reference has been above iact by ITHOFF for TOFF. The OEL side is not
    activated while v is below VTMIN, and is inactive below VTRESET. At the summing
    point VOELMAX1 and VUELMIN1 are 0.

    The equations are Dynawo's, the parameters those of GridKit's and PowerWorld's
    lists (there under SCL1C). As in OEL2C are FIXEDRU and FIXEDRD, and the memory
    of being active, which Dynawo has not. Where ipref is above iref Dynawo's
    reference jumps to iref; here it is continuous, 0. PSS/E's record is not known.
    Typical data are no sample: C1, C2, FIXEDRU, FIXEDRD and IINST are CoLib's, the
    limit is that of SCL1C, timer and regulators as in OEL2C, and all else is chosen
    so that it waits at rated current: take the plant's own.
    """
    v, d.VT = lag(u.vt, s.VT, 1.0, p.TVTSCL)
    full, iref, filtered = reference(s, u, p, d, v)
    oel, iq_oel, d.IPOEL, d.IQOEL = scaled(s, u, p, "OEL")
    uel, iq_uel, d.IPUEL, d.IQUEL = scaled(s, u, p, "UEL")
    limit = smaller(filtered, p.IINSTUEL)
    d.OVEROEL, d.BELOWOEL = timers(s.OVEROEL, s.BELOWOEL, oel, filtered, p.TENOEL, p)
    d.OVERUEL, d.BELOWUEL = timers(s.OVERUEL, s.BELOWUEL, uel, limit, p.TENUEL, p)
    acts = (v > p.VTMIN) & (full | (s.OVEROEL >= p.TENOEL))
    waits = (iref >= p.IINST) & (s.BELOWOEL > p.TOFF)
    d.ACTIVEOEL = latch(acts | (p.TENOEL <= 0.0), waits | (v < p.VTRESET))
    waits = (iref >= smaller(p.IINST, p.IINSTUEL)) & (s.BELOWUEL > p.TOFF)
    d.ACTIVEUEL = latch(full | (s.OVERUEL >= p.TENUEL), waits)
    error = filtered - oel + where(s.ACTIVEOEL > 0.5, 0.0, p.IRESET)
    error = larger(larger(error, p.IQMINOEL - iq_oel), p.VTMIN - v)
    voel = regulator(error, s, p, d, "OEL", "OEL")
    error = uel - limit - where(s.ACTIVEUEL > 0.5, 0.0, p.IRESET)
    vuel = regulator(smaller(error, p.IQMAXUEL - iq_uel), s, p, d, "UEL", "UEL")
    return voel, vuel


def scl2c_rest(scl: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    active, reactive = u.p / u.vt, u.q / u.vt
    x.I, x.VT, x.IREF = stator_current(u), u.vt, p.IINST
    x.T = leaky_rest(counting(x.I, p), p.KFB, p.TMIN, p.TMAX)
    x.IPREF = p.KPREF * active
    x.IF = beside(p.IINST, x.IPREF)
    x.IPOEL, x.IQOEL = p.KIPOEL * active, p.KIQOEL * reactive
    x.IPUEL, x.IQUEL = p.KIPUEL * active, p.KIQUEL * reactive
    x.OVEROEL = x.OVERUEL = 0.0
    x.BELOWOEL = x.BELOWUEL = p.TOFF + BEYOND
    x.ACTIVEOEL = where(p.TENOEL > 0.0, 0.0, 1.0)
    x.ACTIVEUEL = where(p.TENUEL > 0.0, 0.0, 1.0)
    bias = p.IRESET * (1.0 - x.ACTIVEOEL)
    error = larger(x.IF - magnitude(x.IPOEL, x.IQOEL) + bias, p.IQMINOEL - x.IQOEL)
    regulator_rest(larger(error, p.VTMIN - u.vt), p, x, "OEL", "OEL")
    bias = p.IRESET * (1.0 - x.ACTIVEUEL)
    error = magnitude(x.IPUEL, x.IQUEL) - smaller(x.IF, p.IINSTUEL) - bias
    regulator_rest(smaller(error, p.IQMAXUEL - x.IQUEL), p, x, "UEL", "UEL")


SCL2C = documented(
    scl2c,
    scl2c_rest,
    sheet(
        *side_rows("OEL", "overexcited"),
        *side_rows("UEL", "underexcited"),
        ("IRESET", 100.0, *UP_TO_10000, "bias while it is inactive"),
        ("TENOEL", 0.2, *LONG_TIME, "activation delay, overexcited"),
        ("TENUEL", 0.2, *LONG_TIME, "activation delay, underexcited"),
        ("TOFF", 5.0, *LONG_TIME, "reset delay"),
        ("ITHOFF", 0.05, "pu", (-10.0, 100.0), "distance below the reference that resets"),
        *current_rows("OEL", "overexcited"),
        *current_rows("UEL", "underexcited"),
        ("TITSCL", 0.005, *TIME, "stator current transducer lag"),
        ("ITFPU", 1.05, "pu", (0.0001, 100.0), "stator current above which the timer counts"),
        ("IINST", 5.0, "pu", (0.0001, 10000.0), "instantaneous limit"),
        ("IINSTUEL", 5.0, "pu", (0.0001, 10000.0), "instantaneous limit, underexcited"),
        ("ILIM", 1.05, "pu", (0.0001, 10000.0), "thermal limit"),
        ("TAOEL", 0.04, *TIME, "lag of the reference"),
        *INVERSE_TIME,
        ("TSCL", 10.0, "s", (0.001, 10000.0), "reference of the timer"),
        *TIMER,
        *RATE_SWITCH,
        *RATES,
        ("TVTSCL", 0.005, *TIME, "terminal voltage transducer lag"),
        ("VTMIN", 0.9, *UP_TO_10, "voltage that the overexcited side leaves"),
        ("VTRESET", 0.8, *UP_TO_10, "voltage below which that side is inactive"),
        (
            "IQMINOEL",
            0.0,
            "pu",
            (-100.0, 100.0),
            "reactive current that the overexcited side leaves",
        ),
        ("IQMAXUEL", 0.0, "pu", (-100.0, 100.0), "reactive current that the other side leaves"),
        ("KPREF", 0.0, "1", (0.0, 1000.0), "scale of the active current in the reference"),
    ),
    """I VT T IREF IPREF IF
    IPOEL IQOEL OVEROEL BELOWOEL ACTIVEOEL INTEGOEL DERIVOEL V2OEL V1OEL
    IPUEL IQUEL OVERUEL BELOWUEL ACTIVEUEL INTEGUEL DERIVUEL V2UEL V1UEL""",
    doubt="rests on one public diagram, that of Dynawo",
    places="takeover takeover-output summing",
    inputs="vt p q",
)
