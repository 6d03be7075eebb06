"""DC3A: commutator exciter, non-continuous regulator (421.5-2005, 5.3).

                 ┌──────────────────────────────► VRMAX where VERR >= KV ─┐
vref ─►(+)─ VERR ┤ VRMAX                                                  │
       -▲        ├─►[VRMAX - VRMIN]─ VRH ───────► VRH elsewhere ──────────┼─ VR
        │        │  [   sKV TRH   ]                                       │
vc1 ►[  1  ]     │ VRMIN                                                  │
     [1+sTR]     └──────────────────────────────► VRMIN where VERR <= -KV ┘

VR ─►(+)─►[  1  ]─┬─► efd
     -▲   [ sTE ] │
      │    VEMIN  │
      └── VFE ◄───┘

VFE = KE EFD + VX(EFD). The limits of the rheostat VRH and of EFD are non-
windup; the rheostat keeps moving while a contact bypasses it. The contacts make
VR jump: on a literal grid the derivatives of the response do not include the
shift of the jumps. KE is used as given, also 0 (the standard computes none).
Not modelled: stabiliser, OEL and UEL, which are not in the drawing of the
standard. PSLF's ESDC3A has another record; IEEET4 has no lag TR, and a dead
band. The typical data are not the standard's sample (KV .05, TRH 20, KE .05, VR
1/0): with those the rheostat hunts on open circuit.
"""

from exfit.models.blocks import Signal, exciter, exciter_demand, lag, limited_integrator, where
from exfit.models.sheet import FREE, LIMIT, WASHOUT_TIME, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0),
    ("KV", 0.1, "pu", (0.001, 10.0), "setting of the fast raise and lower contacts"),
    ("VRMAX", 4.0, *LIMIT, "voltage of the raise contact"),
    ("VRMIN", -0.9, *LIMIT, "voltage of the lower contact"),
    ("TRH", 60.0, *WASHOUT_TIME, "travel time of the rheostat", FREE),
    *shared(TE=0.5, KE_SIGNED=1.0, VEMIN=0.0, E1=3.375, SE1=0.267, E2=3.15, SE2=0.068),
)

ALIASES = "ESDC3A"
RECORDS = record(
    "DC3A",
    "TR KV VRMAX VRMIN TRH TE KE VEMIN E1 SE1 E2 SE2",
    doubt="the order of DC3A is that of PowerWorld's list, not confirmed by a record",
)

STATES = "VC VRH EFD"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref - vc
    travel = (p.VRMAX - p.VRMIN) * error
    vrh, d.VRH = limited_integrator(travel, s.VRH, p.KV * p.TRH, p.VRMIN, p.VRMAX)
    vr = where(error >= p.KV, p.VRMAX, where(error <= -p.KV, p.VRMIN, vrh))
    efd, d.EFD = exciter(vr, s.EFD, p.KE, p, p.VEMIN)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VC, x.VRH, x.EFD = u.vc1, exciter_demand(efd, p.KE, p), efd
    return u.vc1
