"""EXAC3: alternator exciter, its own supply (IEEE type AC3 of 1981).

          vsum             VAMAX                  VE >= 0
            ▼
vref + vs ►(+)►[1 + sTC]►HV►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─ VE ─►(x)─┬► efd
          -▲ ▲-[1 + sTB] ▲  [1+sTA]    ▲   -▲   [ sTE ] │        ▲  │
           │ │           │  VAMIN      │    │           │       FEX │
           │ │  KLV (VLV - efd)     KR efd  └─── VFE ◄──┘        ▲  │
           │ │                                          KC IFD / VE │
vc1►[  1  ]┘ └─[   s   ]◄─ VN ─[ KF to EFDN, then KN ]◄─────────────┘
    [1+sTR]    [1 + sTF]

VFE = KE VE + VX(VE) + KD IFD. VN has the slope KF up to EFDN and KN beyond it.
The exciter supplies its regulator, so the gain of both grows with efd. The high
value gate HV keeps efd near VLV at least. The limits of the lag and of VE are
non-windup. AC3A, of 1992 and 2005, has a floor and a ceiling of VE in place of
the gate, and its feedback behind the lead-lag.

Two open models written after PSS/E's EXAC3 agree but for VN: in one KF and KN
are gains of all of efd, beyond EFDN and up to it, so that VN jumps there.
Typical data are those of a PSS/E record. Not modelled: UEL and OEL other than
at the summing point.
"""

from exfit.engine.trace import Signal
from exfit.models.blocks import (
    field_demand,
    lag,
    larger,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.exciters.ac3a import feedback
from exfit.models.sheet import (
    DEMAGNETISING,
    EXCITER_LAG,
    FEEDBACK,
    FREE,
    LAG_OF_KF,
    LOADING,
    REGULATOR_LAG,
    record,
    sheet,
)

SHEET = sheet(
    ("TR", 0.0, "s", (0.0, 1.0), "voltage transducer lag"),
    ("TB", 0.0, "s", (0.0, 100.0), "regulator lag"),
    ("TC", 0.0, "s", (0.0, 100.0), "regulator lead"),
    ("KA", 78.04, "pu", (0.01, 100000.0), "regulator gain", FREE),
    ("TA", 0.013, "s", (0.0, 10.0), "regulator time constant", REGULATOR_LAG),
    ("VAMAX", 1.0, "pu", (-9999.0, 9999.0), "regulator ceiling"),
    ("VAMIN", -0.95, "pu", (-9999.0, 9999.0), "regulator floor"),
    ("TE", 3.71, "s", (0.01, 100.0), "exciter time constant", EXCITER_LAG),
    ("KLV", 0.167, "pu", (0.0, 1000.0), "gain of the low voltage limiter"),
    ("KR", 6.99, "pu", (0.01, 1000.0), "gain of the regulator's supply"),
    ("KF", 0.143, "pu", (0.0, 10.0), "stabilising feedback gain up to EFDN", FEEDBACK),
    ("TF", 1.0, "s", (0.01, 100.0), "stabilising feedback time constant", LAG_OF_KF),
    ("KN", 0.05, "pu", (0.0, 10.0), "stabilising feedback gain beyond EFDN"),
    ("EFDN", 1.603, "pu", (0.0, 100.0), "field voltage where the feedback gain changes"),
    ("KC", 0.14, "pu", (0.0, 100.0), "rectifier loading factor", LOADING),
    ("KD", 1.02, "pu", (0.0, 100.0), "demagnetising factor", DEMAGNETISING),
    ("KE", 1.0, "pu", (0.0, 10.0), "exciter constant"),
    ("VLV", 0.46, "pu", (-9999.0, 9999.0), "field voltage of the low voltage limiter"),
    ("E1", 4.64, "pu", (0.0, 100.0), "first voltage of the saturation curve"),
    ("SE1", 0.186, "pu", (0.0, 100.0), "saturation at E1"),
    ("E2", 6.19, "pu", (0.0, 100.0), "second voltage of the saturation curve"),
    ("SE2", 1.391, "pu", (0.0, 100.0), "saturation at E2"),
)

RECORDS = (
    record(
        "EXAC3",
        "TR TB TC KA TA VAMAX VAMIN TE KLV KR KF TF KN EFDN KC KD KE VLV E1 SE1 E2 SE2",
    ),
)

STATES = "VC VL VA VE VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    # before the integrator that makes it: the exciter feeds its own regulator
    efd = rectifier(larger(s.VE, 0.0), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(feedback(efd, p), s.VF, 1.0, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc - vf, s.VL, p.TC, p.TB)
    gated = larger(vl, p.KLV * (p.VLV - efd))
    va, d.VA = limited_lag(gated, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    _, d.VE = limited_integrator(p.KR * efd * va - vfe, s.VE, p.TE, low=0.0)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    va = field_demand(ve, u.ifd, p) / (p.KR * efd)
    error = va / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, va, ve, feedback(efd, p)
    return u.vc1 + error - u.vs
