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

from exfit.models.blocks import Signal, clip, lead_lag, pi, smaller
from exfit.models.limiter_blocks import POWERS, waiting_integral
from exfit.models.phasors import modulus
from exfit.models.sheet import TIME, UP_TO_100, UP_TO_1000, UP_TO_10000, WITHIN_1000, record, sheet

PLACES = ("takeover", "takeover-output", "summing")
INPUTS = ("vt", *POWERS)

SHEET = sheet(
    ("KUR", 1.95, "pu", (0.0001, 100.0), "radius"),
    ("KUC", 1.38, *UP_TO_100, "centre"),
    ("VURMAX", 5.8, *UP_TO_1000, "ceiling of the radius"),
    ("VUCMAX", 5.8, *UP_TO_1000, "ceiling of the distance from the centre"),
    ("KUI", 0.0, *UP_TO_10000, "integral gain"),
    ("KUL", 100.0, *UP_TO_10000, "proportional gain"),
    ("VUIMAX", 18.0, *WITHIN_1000, "ceiling of the PI"),
    ("VUIMIN", -18.0, *WITHIN_1000, "floor of the PI"),
    ("TU1", 0.0, *TIME, "first lead"),
    ("TU2", 0.05, *TIME, "first lag"),
    ("TU3", 0.0, *TIME, "second lead"),
    ("TU4", 0.0, *TIME, "second lag"),
    ("VULMAX", 18.0, *WITHIN_1000, "ceiling of the output"),
    ("VULMIN", -18.0, *WITHIN_1000, "floor of the output"),
)

RECORDS = (
    record(
        "UEL1",
        "KUR KUC KUF VURMAX VUCMAX KUI KUL VUIMAX VUIMIN TU1 TU2 TU3 TU4 VULMAX VULMIN",
        absent={"KUF": 0.0},
    ),
)

STATES = "V V1 V3"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vuel."""
    v, d.V = pi(distance(u, p), s.V, p.KUL, p.KUI, p.VUIMIN, p.VUIMAX)
    v1, d.V1 = lead_lag(v, s.V1, p.TU1, p.TU2)
    v3, d.V3 = lead_lag(v1, s.V3, p.TU3, p.TU4)
    return clip(v3, p.VULMIN, p.VULMAX)


def distance(u: Signal, p: Signal) -> Signal:
    """Compute the distance of the machine from the circle, negative inside."""
    vuc = modulus(p.KUC * u.vt - u.q / u.vt, u.p / u.vt)
    return smaller(vuc, p.VUCMAX) - smaller(p.KUR * u.vt, p.VURMAX)


def rest(vuel: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x at which it waits for its inputs to pass its limits."""
    error = distance(u, p)
    x.V = waiting_integral(error, p.KUI, p.VUIMIN, p.VUIMAX)
    x.V1 = x.V3 = clip(p.KUL * error + x.V, p.VUIMIN, p.VUIMAX)
