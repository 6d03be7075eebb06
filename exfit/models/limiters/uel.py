"""Underexcitation limiters: UEL1 and UEL2C."""

from itertools import pairwise

from exfit.models.blocks import (
    Signal,
    clip,
    inf,
    lag,
    lead_lag,
    limited_lag,
    limited_lead_lag,
    modulus,
    pi,
    smaller,
    where,
)
from exfit.models.limiter_blocks import power, waiting_integral
from exfit.models.sheet import (
    LONG_TIME,
    TIME,
    UP_TO_100,
    UP_TO_1000,
    UP_TO_10000,
    WITHIN_1000,
    documented,
    limits,
    record,
    sheet,
    with_typical,
)

REGULATOR = sheet(
    ("KUI", 0.0, *UP_TO_10000, "integral gain"),
    ("KUL", 100.0, *UP_TO_10000, "proportional gain"),
    *limits("VUIMAX", 18.0, -18.0, "the PI", WITHIN_1000),
    ("TU1", 0.0, *TIME, "first lead"),
    ("TU2", 0.05, *TIME, "first lag"),
    ("TU3", 0.0, *TIME, "second lead"),
    ("TU4", 0.0, *TIME, "second lag"),
)


def distance(u: Signal, p: Signal) -> Signal:
    """Compute the distance of the machine from the circle, negative inside."""
    vuc = modulus(p.KUC * u.vt - u.q / u.vt, u.p / u.vt)
    return smaller(vuc, p.VUCMAX) - smaller(p.KUR * u.vt, p.VURMAX)


def uel1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """UEL1: underexcitation limiter with a circular characteristic (IEEE Std 421.5-2005, 10.1).

    |KUC vt - j it| ─►[clip]─► vuc
                      VUCMAX
    KUR vt ─►[clip]─► vur
             VURMAX
                   VUIMAX                           VULMAX
    vuc - vur ─►[KUL + KUI/s]─►[1 + sTU1]─►[1 + sTU3]─►[clip]─► vuel
                   VUIMIN      [1 + sTU2]  [1 + sTU4]  VULMIN

    vt and it are phasors: the limit is a circle of radius KUR around the reactive
    power KUC, at 1 pu of voltage, and the output rises once Q is below it. TU2 = 0
    or TU4 = 0 bypasses its block. For the summing point VUIMIN and VULMIN are 0.
    Not modelled: KUF, by which the stabilising signal VF of the excitation system
    is subtracted, as exciters do not give it out; so a record has to have KUF = 0,
    though the sample data have 3.3. It damps: without it the gain KUL of 100 makes
    a unit oscillate at the limit. Dynawo and InterPSS agree, but that Dynawo gives
    the output the limits of the PI. Typical data are the standard's sample data
    (PSCAD, IEC 61970-302) but for KUF.
    """
    v, d.V = pi(distance(u, p), s.V, p.KUL, p.KUI, p.VUIMIN, p.VUIMAX)
    v1, d.V1 = lead_lag(v, s.V1, p.TU1, p.TU2)
    v3, d.V3 = lead_lag(v1, s.V3, p.TU3, p.TU4)
    return clip(v3, p.VULMIN, p.VULMAX)


def uel1_rest(vuel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    error = distance(u, p)
    x.V = waiting_integral(error, p.KUI, p.VUIMIN, p.VUIMAX)
    x.V1 = x.V3 = clip(p.KUL * error + x.V, p.VUIMIN, p.VUIMAX)


UEL1 = documented(
    uel1,
    uel1_rest,
    sheet(
        ("KUR", 1.95, "pu", (0.0001, 100.0), "radius"),
        ("KUC", 1.38, *UP_TO_100, "centre"),
        ("VURMAX", 5.8, *UP_TO_1000, "ceiling of the radius"),
        ("VUCMAX", 5.8, *UP_TO_1000, "ceiling of the distance from the centre"),
        *REGULATOR,
        *limits("VULMAX", 18.0, -18.0, "the output", WITHIN_1000),
    ),
    "V V1 V3",
    places="takeover takeover-output summing",
    inputs="vt p q",
    records=record(
        "UEL1",
        "KUR KUC KUF VURMAX VUCMAX KUI KUL VUIMAX VUIMIN TU1 TU2 TU3 TU4 VULMAX VULMIN",
        absent={"KUF": 0.0},
    ),
)


POINTS = ((0.0, -0.31), (0.3, -0.31), (0.6, -0.28), (0.9, -0.21), (1.02, 0.0), *((0.0, 0.0),) * 6)


LEAST_GAIN = 0.1  # of kadj


def biased(v: Signal, p: Signal) -> Signal:
    """Return the voltage by which the characteristic is scaled."""
    return where(v > 1.0, v, where(v <= p.VBIAS, v / p.VBIAS, 1.0))


def characteristic(active: Signal, p: Signal) -> Signal:
    """Return the least reactive power at an active one, on the line through the points."""
    points = [(getattr(p, f"P{k}"), getattr(p, f"Q{k}")) for k in range(len(POINTS))]
    segments = list(pairwise(points))
    used, q = segments[0][0][0] < segments[0][1][0], points[0][1]
    for k, ((P, Q), (P_end, Q_end)) in enumerate(segments):
        further = k + 1 < len(segments) and (used & (segments[k + 1][0][0] < segments[k + 1][1][0]))
        width = where(used, P_end - P, 1.0)
        along = clip(active - P, -inf if k == 0 else 0.0, where(further, width, inf))
        q = q + where(used, (Q_end - Q) / width * along, 0.0)
        used = further
    return q


def reduction(u: Signal, p: Signal) -> Signal:
    """Return the adjustable gain reduction, before its lag."""
    reach = u.vt * u.vt / p.XQ + u.q
    return reach / modulus(reach, u.p)


def uel2c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """UEL2C: underexcitation limiter with a piecewise-linear characteristic (IEEE Std 421.5-2016).

    vt ─►[   1    ]─► v
         [1 + sTUV]
    p/f^K1 ─►[   1    ]─►[Q of P]─►(x)─►[    1     ]─► qref
             [1 + sTUP]             ▲   [1 + sTQREF]
                                   f^K2
    q ─►[   1    ]─► qm
        [1 + sTUQ]
                          VUIMAX       VUELMAX2   VUELMAX1
    qref - qm ─►(x)─►[KUL + KUI/s]─►[1 + sTU1]─►[1 + sTU3]─► vuel
                 ▲        VUIMIN    [1 + sTU2]  [1 + sTU4]
                kadj                 VUELMIN2   VUELMIN1

    f is v above 1, v / VBIAS below VBIAS, 1 between. Q of P is the line through the
    points P0, Q0 to P10, Q10; its ends go on straight, as Dynawo's do, and it ends
    with the last point whose P is above that before. kadj is KFIX with SW1 = 1
    (position A); with SW1 = 2 it is a / sqrt(a² + p²) of a = vt²/XQ + q through the
    lag TADJ, between 0.1 and 1. Not modelled: the stabilising signal VF (KUF) and,
    for ST7C, the reference fed back (KFB, TUL). The limits of the two last blocks
    are non-windup. Dynawo and InterPSS agree but for kadj, by which InterPSS
    divides and which it does not limit; here it reduces the gain, as its name says
    and PSS/E 36.7 does (UEL2CU1: its states within 7e-5 pu, V within 4e-5: while
    the PI is clipped to y, PSS/E lets V follow it by KUI/KUL (y - V)). UEL2CU1 has
    limits of the output beside those of the last block, which are not modelled.
    Typical data are the standard's sample data (PSCAD, GridKit).
    """
    v, d.VT = lag(u.vt, s.VT, 1.0, p.TUV)
    f = biased(v, p)
    active, d.P = lag(u.p / power(f, p.K1), s.P, 1.0, p.TUP)
    qref, d.QREF = lag(characteristic(active, p) * power(f, p.K2), s.QREF, 1.0, p.TQREF)
    reactive, d.Q = lag(u.q, s.Q, 1.0, p.TUQ)
    adjusted, d.KADJ = limited_lag(reduction(u, p), s.KADJ, 1.0, p.TADJ, LEAST_GAIN, 1.0)
    kadj = where(p.SW1 > 1.5, adjusted, p.KFIX)
    v, d.V = pi(kadj * (qref - reactive), s.V, p.KUL, p.KUI, p.VUIMIN, p.VUIMAX)
    v1, d.V1 = limited_lead_lag(v, s.V1, p.TU1, p.TU2, p.VUELMIN2, p.VUELMAX2)
    v3, d.V3 = limited_lead_lag(v1, s.V3, p.TU3, p.TU4, p.VUELMIN1, p.VUELMAX1)
    return v3


def uel2c_rest(vuel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    x.VT, x.Q = u.vt, u.q
    f = biased(u.vt, p)
    x.P = u.p / power(f, p.K1)
    x.QREF = characteristic(x.P, p) * power(f, p.K2)
    x.KADJ = clip(reduction(u, p), LEAST_GAIN, 1.0)
    error = where(p.SW1 > 1.5, x.KADJ, p.KFIX) * (x.QREF - x.Q)
    x.V = waiting_integral(error, p.KUI, p.VUIMIN, p.VUIMAX)
    v = clip(p.KUL * error + x.V, p.VUIMIN, p.VUIMAX)
    x.V1 = clip(v, p.VUELMIN2, p.VUELMAX2)
    x.V3 = clip(x.V1, p.VUELMIN1, p.VUELMAX1)


UEL2C = documented(
    uel2c,
    uel2c_rest,
    sheet(
        ("TUP", 5.0, *LONG_TIME, "active power filter lag"),
        ("TUQ", 0.0, *LONG_TIME, "reactive power filter lag"),
        ("TUV", 5.0, *LONG_TIME, "voltage filter lag"),
        ("VBIAS", 1.0, "pu", (0.01, 10.0), "voltage bias"),
        ("K1", 2.0, "1", (0.0, 10.0), "exponent of the voltage at P of the points"),
        ("K2", 2.0, "1", (0.0, 10.0), "exponent of the voltage at Q of the points"),
        ("TQREF", 0.0, *LONG_TIME, "lag of the reference of Q"),
        ("KFIX", 1.0, "pu", (0.0001, 1000.0), "fixed gain reduction"),
        ("TADJ", 3.0, *LONG_TIME, "lag of the adjustable gain reduction"),
        ("SW1", 1.0, "1", (1.0, 2.0), "gain reduction: 1 fixed, 2 adjustable"),
        ("XQ", 0.6, "pu", (0.01, 10.0), "q-axis reactance of the machine, for SW1 = 2"),
        *with_typical(REGULATOR, KUI=0.5, KUL=0.8, VUIMAX=0.25, VUIMIN=0.0, TU2=0.0),
        *limits("VUELMAX1", 0.25, 0.0, "the output", WITHIN_1000),
        *limits("VUELMAX2", 99.0, -99.0, "the first lead-lag", WITHIN_1000),
        *(
            row
            for k, (P, Q) in enumerate(POINTS)
            for row in (
                (f"P{k}", P, "pu", (-10.0, 10.0), f"active power of point {k}"),
                (f"Q{k}", Q, "pu", (-10.0, 10.0), f"reactive power of point {k}"),
            )
        ),
    ),
    "VT P QREF Q KADJ V V1 V3",
    places="summing takeover takeover-output",
    inputs="vt p q",
    records=record(
        "UEL2C",
        "TUP TUQ TUV VBIAS K1 K2 KUF TQREF KFIX TADJ SW1 KUI KUL VUIMAX VUIMIN TU1 TU2 TU3 TU4 "
        "VUELMAX1 VUELMIN1 VUELMAX2 VUELMIN2 KFB TUL XQ P0 Q0 P1 Q1 P2 Q2 P3 Q3 P4 Q4 P5 Q5 P6 Q6 "
        "P7 Q7 P8 Q8 P9 Q9 P10 Q10",
        absent={"KUF": 0.0, "KFB": 0.0},
        ignored="TUL",
        doubt="its order is that of PowerWorld's list; PSS/E 36 has another in its UEL2CU1",
    )
    + record(
        "UEL2CU1",
        "TUV TUP TUQ KUI KUL VUIMAX VUIMIN KUF KFB TUL TU1 TU2 TU3 TU4 P0 Q0 P1 Q1 P2 Q2 P3 Q3 P4 "
        "Q4 P5 Q5 P6 Q6 P7 Q7 P8 Q8 P9 Q9 P10 Q10 VULMAX VULMIN VBIAS KFIX TADJ TQREF VUELMAX2 "
        "VUELMIN2 VUELMAX1 VUELMIN1 XQ",
        icons={"K1": 2, "K2": 2, "QUADRANT": 1, "SW1": 1},
        absent={"KUF": 0.0, "KFB": 0.0, "VULMAX": 99.0, "VULMIN": -99.0},
        ignored="TUL",
        user="9 0 4 47 9 2",
    ),
    aliases="UEL2CU1",
)
