"""ST2A: compound-source rectifier exciter (IEEE Std 421.5-2005, 7.2).

                                 VRMAX              EFDMAX
vref + vs ─►(+)─►[larger]─►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─► efd
           -▲ ▲-     ▲     [1+sTA]    ▲    ▲-  [ sTE ] │
            │ │     vuel     VRMIN    VB   │      0    │
            │ │                            └───[ KE ]◄─┤
            │ │                                        │
vc1 ►[  1  ]┘ └──────────[  sKF  ]◄────────────────────┘
     [1+sTR]             [1 + sTF]

VB = VE FEX(KC IFD / VE) with VE = |KP VT + j KI IT|, and 1 where KP = KI = 0 as
in PSS/E. The limits of the regulator and of efd are non-windup. The current IT,
and so KI, acts on load only. Not modelled: UEL and OEL at the summing point,
where PSS/E's EXST2A has them and no gate.
"""

from exfit.models.blocks import Signal, lag, larger, limited_integrator, limited_lag, washout
from exfit.models.compound import supply
from exfit.models.sheet import AS_IN_PSSE, record, shared, sheet

ALIASES = ("ESST2A", "EXST2A")

SHEET = sheet(
    *shared(TR=0.0, KA=120.0, TA=0.15, VRMAX=1.0, VRMIN=0.0, KE_ABOVE_0=1.0, TE=0.5, KF=0.05),
    *shared(TF=1.0, KP_OR_0=4.88, KI=8.0, KC=1.82, EFDMAX=4.5),
)

RECORDS = (
    record("ESST2A", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX"),
    record("EXST2A", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX"),
)

PSLF_RECORDS = (
    record(
        "esst2a",
        "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX",
        doubt=AS_IN_PSSE,
    ),
)

STATES = "VC VR EFD VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = larger(u.vref + u.vs - vc - vf, u.vuel)
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vb = supply(u, p)
    efd, d.EFD = limited_integrator(vr * vb - p.KE * s.EFD, s.EFD, p.TE, 0.0, p.EFDMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = p.KE * efd / supply(u, p)
    x.VC, x.VR, x.EFD, x.VF = u.vc1, vr, efd, efd
    return u.vc1 + vr / p.KA - u.vs
