"""AC11C: alternator exciter, UEL and OEL with regulators of their own (IEEE Std 421.5-2016).

           vs vsum                               VRMAX               VAMAX
              ▼       UEL OEL                            UEL OEL
vref ───────►(+)─ VERR►[gates]►(+)─►[regulator]─► VR ─►[gates]─►(+)──────► VA
             -▲                 ▲                VRMIN           ▲   VAMIN
vc1 ─►[  1  ]─┘                 vs                              VRS
      [1+sTR]

                         VE <= VEMAX
VA ─►(x)─►(+)─────►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
      ▲    ▲       -▲   [ sTE ] │        ▲
     VB1  VB2 or 0  │   VEMIN   │       FEX
                    └─── VFE ◄──┘        ▲
                                 KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
regulator is a PI, KPA (1 + 1/(sTIA)), and a derivative, 1 + sTB/(1 + sTB/KB).
While UEL has the first gate it is KPU (1 + 1/(sTIU)) with this derivative, and
while OEL has it KPO (1 + 1/(sTIO)) alone. All three get the same signal all the
time, from one integral, which is frozen while that in command is at its limit.

VB1 = VE1 FEX(KC1 VFE / VE1), at most VBMAX1. It comes from the terminals (SW1 =
1, position A of the drawing), VE1 = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|
with THETAP in degrees, or does not depend on them (SW1 = 2, B), VE1 = KP. Where
VT is at most VBOOST, VB2 = VE2 FEX(KC2 VFE / VE2), at most VBMAX2, with VE2 =
KI2 IT + KBOOST, is added. The current IT, and so KI, XL, THETAP and KI2, act on
load only. The limit of VE is non-windup.

The limiters act at the summing point (vsum), at the gates before the regulator
or at those behind it. The stabiliser is added to the voltage error (VOS = 1) or
behind the first gates (VOS = 2). With VOS = 3, and with VOS = 2 while a limiter
has those gates, it has a regulator of its own, with KPA, TIA, TB and KB and the
limits VRSMAX and VRSMIN, which gives VRS; it must then be 0 at rest.

The path of the signal, with VB2, is that of PowerWorld 24 (vt 1.2e-6 pu over a
fault). Gates, limits and VOS rest on InterPSS alone, where each regulator has
an integral that stops at its own limit, and a stator current limiter at the
first gates leaves the regulator as it is. Typical data are not those of a
sample.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    lead_lag,
    modulus,
    where,
)
from exfit.models.exciter_parts import (
    alternator_rest,
    bridge,
    first_source,
    limited_alternator,
    routed,
)
from exfit.models.sheet import (
    FREE,
    GAIN,
    LIMIT,
    POSITIVE_TIME,
    TWO_GATES,
    UP_TO_100,
    limits,
    record_of_2016,
    shared,
    sheet,
)

ALIASES = "ESAC11C"

SHEET = sheet(
    *shared(TR=0.01),
    ("KPA", 8.0, *GAIN, "proportional gain of the regulator", FREE),
    ("TIA", 2.0, *POSITIVE_TIME, "integral time of the regulator", FREE),
    ("KPU", 5.0, *GAIN, "proportional gain of the regulator while UEL has the gate"),
    ("TIU", 1.0, *POSITIVE_TIME, "integral time of the regulator while UEL has the gate"),
    ("KB", 10.0, *GAIN, "gain of the derivative", FREE),
    ("TB", 0.2, *POSITIVE_TIME, "time constant of the derivative", FREE),
    ("KPO", 4.0, *GAIN, "proportional gain of the regulator while OEL has the gate"),
    ("TIO", 0.5, *POSITIVE_TIME, "integral time of the regulator while OEL has the gate"),
    ("VOS", 1.0, "1", (1.0, 3.0), "place of the stabiliser, on load: 1 error, 2 gate, 3 output"),
    ("VRSMAX", 1.0, *LIMIT, "ceiling of VRS, while a limiter has the gate or VOS is 3"),
    ("VRSMIN", -1.0, *LIMIT, "floor of VRS, while a limiter has the gate or VOS is 3"),
    *shared(VRMAX=10.0, VRMIN=-10.0),
    *limits("VAMAX", 10.0, -10.0, "the control signal"),
    *shared(KC_FREE=0.2, KD=0.4, KE=1.0, TE=1.0, VFEMAX=12.0, VEMIN=0.0),
    *shared(E1=9.0, SE1=3.0, E2=6.5, SE2=0.3, SW1=1.0, KP=1.0, KI=0.0, XL=0.0, THETAP=0.0),
    *shared(KC1=0.05, VBMAX1=1.5),
    ("KI2", 0.2, *UP_TO_100, "current gain of the boost, on load"),
    ("KC2", 0.01, *UP_TO_100, "loading factor of the boost's rectifier"),
    ("VBMAX2", 0.5, "pu", (0.01, 9999.0), "ceiling of the boost"),
    ("KBOOST", 0.3, *UP_TO_100, "constant voltage of the boost"),
    ("VBOOST", 0.8, "pu", (0.0, 10.0), "terminal voltage up to which the boost is added"),
)

RECORDS = record_of_2016(
    "AC11C",
    "TR KPA TIA KPU TIU KB TB KPO TIO VRSMAX VRSMIN VRMAX VRMIN VAMAX VAMIN TE KC KD KE VFEMAX "
    "VEMIN E1 SE1 E2 SE2 KP KI XL THETAP KC1 VBMAX1 KI2 KC2 VBMAX2 KBOOST VBOOST",
    switches="VOS SW1",
    places=TWO_GATES,
    doubt="its order is as InterPSS reads it; PowerWorld has a fifth integer, SCL, before SW1",
)

STATES = "VC VI VD VU VS VSD VE"

SETPOINTS = "VA0"


def sources(vfe: Signal, u: Signal, p: Signal) -> tuple[Signal, Signal]:
    """Return VB1, and what the boost adds."""
    vb1 = bridge(first_source(p.KI, u, p), p.KC1 * vfe, p.VBMAX1)
    ve2 = p.KI2 * modulus(u.p / u.vt, u.q / u.vt) + p.KBOOST
    return vb1, where(u.vt <= p.VBOOST, bridge(ve2, p.KC2 * vfe, p.VBMAX2), 0.0)


def pushes(y: Signal, signal: Signal, low: Signal, high: Signal) -> Signal:
    """Test for a signal that drives an output further beyond its limit."""
    return ((y >= high) & (signal > 0.0)) | ((y <= low) & (signal < 0.0))


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vb1, boost = sources(vfe, u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    signal, oel, uel, own = routed(vc, u, p)
    lead = p.TB + p.TB / p.KB
    vl, d.VD = lead_lag(s.VA0 + p.KPA * (signal + s.VI / p.TIA), s.VD, lead, p.TB / p.KB)
    vu, d.VU = lead_lag(s.VA0 + p.KPU * (signal + s.VI / p.TIU), s.VU, lead, p.TB / p.KB)
    vo = s.VA0 + p.KPO * (signal + s.VI / p.TIO)
    chosen = where(oel, vo, where(uel, vu, vl))
    d.VI = where(pushes(chosen, signal, p.VRMIN, p.VRMAX), 0.0, signal)
    vsl, d.VSD = lead_lag(p.KPA * (own + s.VS / p.TIA), s.VSD, lead, p.TB / p.KB)
    d.VS = where(pushes(vsl, own, p.VRSMIN, p.VRSMAX), 0.0, own)
    vr = clip(clip(chosen, p.VRMIN, p.VRMAX), u.vuel_out, u.voel_out)
    va = clip(vr + clip(vsl, p.VRSMIN, p.VRSMAX), p.VAMIN, p.VAMAX)
    efd, d.VE = limited_alternator(va * vb1 + boost, vfe, s, u, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE, vfe = alternator_rest(efd, u, p)
    vb1, boost = sources(vfe, u, p)
    x.VA0 = x.VD = x.VU = (vfe - boost) / vb1
    x.VC, x.VI, x.VS, x.VSD = u.vc1, 0.0, 0.0, 0.0
    return u.vc1 - where(p.VOS < 2.5, u.vs, 0.0)
