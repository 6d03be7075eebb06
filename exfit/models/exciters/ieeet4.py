"""IEEET4: commutator exciter, IEEE type 4 of 1968, non-continuous (PSS/E IEEET4).

                 ┌──────────────────────────────► VRMAX where VERR >= KV ─┐
vref ─►(+)─ VERR ┤                  VRMAX                                 │
       -▲        ├─►[dead band KR]─►[  1   ]─ VRH ──► VRH elsewhere ──────┼─ VR
        │        │                  [ sTRH ]                              │
vc1 ────┘        │                  VRMIN                                 │
                 └──────────────────────────────► VRMIN where VERR <= -KV ┘

VR ─►(+)─►[  1  ]─┬─► efd
     -▲   [ sTE ] │
      └── VFE ◄───┘

VFE = KE EFD + VX(EFD). The dead band gives 1 where VERR > KR, -1 where VERR <
-KR and 0 between: the motor of the rheostat VRH runs at full speed, 1 pu in
TRH, or stands still. The limits of VRH are non-windup; the rheostat keeps
moving while a contact bypasses it. Motor and contacts jump: on a literal grid
the derivatives of the response do not include the shift of the jumps. KE is
used as given.

The dead band is PowerWorld's and CIM's, and gives the curve of PSS/E 36.7 (vt
3e-6 pu over a fault); InterPSS takes KR for a gain. Typical data are CIM's
(ExcDC3A) but for KR and KV (0, .05). Not modelled: KR = 0, with which the error
drives the rheostat in PowerWorld; stabiliser, OEL and UEL, which the drawings
do not have.
"""

from exfit.models.blocks import Signal, exciter, exciter_demand, limited_integrator, where
from exfit.models.sheet import FREE, LIMIT, OF_A_LIST, WASHOUT_TIME, record, shared, sheet

SHEET = sheet(
    ("TRH", 20.0, *WASHOUT_TIME, "time in which the rheostat travels 1 pu", FREE),
    ("KR", 0.01, "pu", (0.0001, 10.0), "dead band of the rheostat's motor, each way"),
    ("KV", 0.048, "pu", (0.001, 10.0), "setting of the fast raise and lower contacts"),
    ("VRMAX", 5.0, *LIMIT, "voltage of the raise contact"),
    ("VRMIN", 0.0, *LIMIT, "voltage of the lower contact"),
    *shared(TE=1.83, KE_SIGNED=1.0, E1=2.6, SE1=0.1, E2=3.45, SE2=0.35),
)

ALIASES = "EXDC4"
RECORDS = record("IEEET4", "KR TRH KV VRMAX VRMIN TE KE E1 SE1 E2 SE2")

PSLF_RECORDS = record("exdc4", "KR TRH KV VRMAX VRMIN TE KE E1 SE1 E2 SE2", doubt=OF_A_LIST)

STATES = "VRH EFD"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    error = u.vref - u.vc1
    motor = where(error > p.KR, 1.0, where(error < -p.KR, -1.0, 0.0))
    vrh, d.VRH = limited_integrator(motor, s.VRH, p.TRH, p.VRMIN, p.VRMAX)
    vr = where(error >= p.KV, p.VRMAX, where(error <= -p.KV, p.VRMIN, vrh))
    efd, d.EFD = exciter(vr, s.EFD, p.KE, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VRH, x.EFD = exciter_demand(efd, p.KE, p), efd
    return u.vc1
