"""EXAC1A: alternator exciter with feedback of its field voltage (PSS/E EXAC1A).

                             VRMAX          VE >= 0
vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─ VE ─►(x)─┬─► efd
           -▲   ▲-[1 + sTB]  [1+sTA]  -▲    [ sTE ] │        ▲  │
            │   │            VRMIN     │            │       FEX │
vc1 ►[  1  ]┘   │                      └─── VFE ◄───┘        ▲  │
     [1+sTR]    │                                  KC IFD / VE  │
                └────────────[  sKF  ]◄─────────────────────────┘
                             [1 + sTF]

EXAC1 with the rate feedback of efd, not of VFE = KE VE + VX(VE) + KD IFD. The
limits of the lag and of VE are non-windup. Two open models written after
PSS/E's EXAC1A agree, but one of them takes the saturation SE at efd instead of
VE. Typical data are those of EXAC1.
"""

from exfit.models.blocks import Signal, larger, rectifier, washout
from exfit.models.exciters import exac1
from exfit.models.exciters.exac1 import SHEET, STATES, regulated
from exfit.models.sheet import record

__all__ = ["RECORDS", "SHEET", "STATES", "equations", "rest"]

RECORDS = (record("EXAC1A", "TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2"),)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    efd = rectifier(larger(s.VE, 0.0), p.KC * u.ifd)
    vf, d.VF = washout(efd, s.VF, p.KF, p.TF)
    return regulated(vf, s, u, p, d)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vref = exac1.rest(efd, u, p, x)
    x.VF = efd
    return vref
