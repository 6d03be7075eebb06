"""ST9C: static exciter with a PI that tracks its limits (IEEE Std 421.5-2016).

                             UEL         VRMAX   OEL
vref + vs + vsum ─►(+)─►[KA]─►[HV]─►(+)─►[clip]─►[LV]─┬─►[ KAS  ]─►(x)─► efd
                  -▲ ▲-              ▲   VRMIN        │  [1+sTAS]   ▲
                   │ │               └──[  1  ]◄──────┘             VB
                   │ │                  [1+sTA]
                   │ └─[beyond ZA]◄─┐
                   │                │
      vc1 ─►[  1  ]┴────►[ sTCD  ]──┘
            [1+sTR]      [1+sTBD ]

VB = VE FEX(KC IFD / VE), at most VBMAX. It comes from the terminals (SW1 = 1,
position A of the drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
THETAP in degrees, or does not depend on them (SW1 = 2, B), VE = KP. The current
IT, and so KI, XL and THETAP, act on load only. The derivative of the voltage
acts by what it has beyond the dead band of ZA on either side. The lag TA of the
limited output adds to the amplifier's: a PI regulator, KA (1 + 1/(sTA)), that
does not wind up. While UEL has the gate TAUEL takes the place of TA, to the
share KU times what UEL adds, at most all of it.

The limiters act at the summing point (vsum) or at the gates HV and LV. Dynawo
and InterPSS draw this; Dynawo has no KU and changes to TAUEL at once, as KU
without bounds does. Both subtract a stator current limiter at the summing
point, which here is added, as others are. Typical data are the standard's
sample data, as GridKit has them, but for TR, KU, TAUEL, TAS, KC and VBMAX,
which are 0, 10000, 2, 0.0018, 0 and 1.2 there: most leave out what they act on.
"""

from exfit.models.blocks import Signal, clip, lag, larger, smaller, washout
from exfit.models.exciter_parts import STATIC_SUPPLY, supply
from exfit.models.sheet import (
    FREE,
    ONE_GATE,
    POSITIVE_TIME,
    SHORT_TIME,
    record_of_2016,
    shared,
    sheet,
)

ALIASES = "ESST9C"

SHEET = sheet(
    *shared(TR=0.02),
    ("TCD", 0.06, *SHORT_TIME, "time constant of the derivative"),
    ("TBD", 0.03, *SHORT_TIME, "lag of the derivative"),
    ("ZA", 0.036, "pu", (0.0, 9999.0), "dead band of the derivative"),
    *shared(KA=12.0),
    ("KU", 100.0, "1", (0.0, 1e6), "gain of the change to TAUEL while UEL has the gate"),
    ("TA", 2.0, *POSITIVE_TIME, "time constant of the integral", FREE),
    ("TAUEL", 3.0, *POSITIVE_TIME, "that of the integral while UEL has the gate"),
    *shared(VRMAX=1.0, VRMIN=-0.866),
    ("KAS", 6.1, "pu", (0.01, 1000.0), "gain of the power converter"),
    ("TAS", 0.01, *SHORT_TIME, "firing circuit time constant", FREE),
    *STATIC_SUPPLY,
)

RECORDS = record_of_2016(
    "ST9C",
    "TR TCD TBD ZA KA KU TA TAUEL VRMAX VRMIN KAS TAS KP THETAP KI XL KC VBMAX",
    flags="OEL UEL SCL",
    switches="SW1",
    places=ONE_GATE,
)

STATES = "VC VD VI VA"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    steep, d.VD = washout(vc, s.VD, p.TCD, p.TBD)
    beyond = steep - clip(steep, -p.ZA, p.ZA)
    amplified = p.KA * (u.vref + u.vs + u.vsum - vc - beyond)
    raised = larger(amplified, u.vuel)
    vr = smaller(clip(raised + s.VI, p.VRMIN, p.VRMAX), u.voel)
    share = clip(p.KU * (raised - amplified), 0.0, 1.0)
    d.VI = (vr - s.VI) * ((1.0 - share) / p.TA + share / p.TAUEL)
    va, d.VA = lag(vr, s.VA, p.KAS, p.TAS)
    return va * supply(p.KC * u.ifd, u, p)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VA = efd / supply(p.KC * u.ifd, u, p)
    x.VI = x.VA / p.KAS
    x.VC = x.VD = u.vc1
    return u.vc1 - u.vs
