"""EXST2: compound-source exciter, its supply added (IEEE type ST2 of 1981).

           vsum    VRMAX               EFDMAX
             ▼
vref + vs ─►(+)─►[  KA  ]─►(+)─►(+)─►[  1  ]─┬─► efd
           -▲ ▲- [1+sTA]    ▲   -▲   [ sTE ] │
            │ │    VRMIN   VB    │      0    │
            │ │                  └───[ KE ]◄─┤
            │ │                              │
vc1 ►[  1  ]┘ └────────[  sKF  ]◄────────────┘
     [1+sTR]           [1 + sTF]

VB = VE FEX(KC IFD / VE) with VE = |KP VT + j KI IT|, and 1 where KP = KI = 0 as
in PSS/E. The limits of the regulator and of efd are non-windup. The current IT,
and so KI, acts on load only. ST2A multiplies by VB instead, as EXST2A does.

Two open models written after PSS/E's EXST2 agree. Typical data are those of
IEEET3, whose source is added as well, but for KP and KC. Not modelled: UEL and
OEL other than at the summing point.
"""

from exfit.engine.trace import Signal
from exfit.models.blocks import lag, limited_integrator, limited_lag, washout
from exfit.models.compound import supply
from exfit.models.sheet import EXCITER_LAG, FEEDBACK, FREE, LAG_OF_KF, REGULATOR_LAG, record, sheet

SHEET = sheet(
    ("TR", 0.0, "s", (0.0, 1.0), "voltage transducer lag"),
    ("KA", 120.0, "pu", (0.01, 100000.0), "regulator gain", FREE),
    ("TA", 0.15, "s", (0.0, 10.0), "regulator time constant", REGULATOR_LAG),
    ("VRMAX", 2.0, "pu", (-9999.0, 9999.0), "regulator ceiling"),
    ("VRMIN", -2.0, "pu", (-9999.0, 9999.0), "regulator floor"),
    ("KE", 1.0, "pu", (0.01, 10.0), "exciter constant"),
    ("TE", 0.5, "s", (0.01, 100.0), "exciter time constant", EXCITER_LAG),
    ("KF", 0.02, "pu", (0.0, 10.0), "stabilising feedback gain", FEEDBACK),
    ("TF", 0.53, "s", (0.01, 100.0), "stabilising feedback time constant", LAG_OF_KF),
    ("KP", 0.9, "pu", (0.0, 100.0), "potential source gain"),
    ("KI", 1.86, "pu", (0.0, 100.0), "current source gain, on load"),
    ("KC", 0.1, "pu", (0.0, 100.0), "rectifier loading factor"),
    ("EFDMAX", 2.8, "pu", (0.01, 9999.0), "ceiling of the field voltage"),
)

RECORDS = (record("EXST2", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX"),)

STATES = "VC VR EFD VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = u.vref + u.vs + u.vsum - vc - vf
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vb = supply(u, p)
    efd, d.EFD = limited_integrator(vr + vb - p.KE * s.EFD, s.EFD, p.TE, 0.0, p.EFDMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = p.KE * efd - supply(u, p)
    x.VC, x.VR, x.EFD, x.VF = u.vc1, vr, efd, efd
    return u.vc1 + vr / p.KA - u.vs
