"""AC8B: alternator exciter with PID regulator (IEEE Std 421.5-2005, 6.8).

           vsum     VPIDMAX            VRMAX         VE <= VEMAX
             ▼
vref + vs ─►(+)─►[KPR + KIR/s   ]─►[  KA  ]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
           -▲    [+ sKDR/(1+sTDR)] [1+sTA]   -▲   [ sTE ] │        ▲
            │       VPIDMIN            VRMIN  │    VEMIN  │       FEX
vc1 ►[  1  ]┘                                 │           │        ▲
     [1+sTR]                                  └── VFE ◄───┘   KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
limits of the lag and of VE are non-windup; the integral is frozen while the PID
is at its limit. UEL and OEL are added at the summing point. PSS/E's ESAC8B is
another model.
"""

from exfit.models.blocks import (
    Signal,
    field_ceiling,
    field_demand,
    lag,
    limited_integrator,
    limited_lag,
    pi_rest,
    pid,
    rectifier,
    rectifier_supply,
)
from exfit.models.sheet import OF_A_LIST, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, KPR=80.0, KIR=5.0, KDR=10.0, TDR=0.1, VPIDMAX=999.0, VPIDMIN=-999.0),
    *shared(KA_FIXED=1.0, TA_FIXED=0.0, VRMAX=35.0, VRMIN=0.0, TE=1.2, VFEMAX=6.0, VEMIN=0.0),
    *shared(KC_FREE=0.55, KD=1.1, KE=1.0, E1=9.0, SE1=3.0, E2=6.5, SE2=0.3),
)

RECORDS = (
    record(
        "AC8B",
        "TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN KC KD KE TE VFEMAX VEMIN "
        "E1 SE1 E2 SE2",
        doubt="its order is that of OPAL-RT's library and of PSS/E's AC8C; ANDES and InterPSS have "
        "VRMAX VRMIN VFEMAX VEMIN TA KA TE KC KD KE behind VPIDMIN",
    ),
    record("ESAC8B", "TR KPR KIR KDR TDR KA TA VRMAX VRMIN TE KE E1 SE1 E2 SE2"),
)

PSLF_RECORDS = (
    record(
        "esac8b",
        "TR KPR KIR KDR TDR VRMAX VRMIN KA TA TE VFEMAX VEMIN KE KC KD E1 SE1 E2 SE2 VTMULT SPDMLT",
        absent={"VTMULT": 0.0},
        ignored="SPDMLT",
        held={"VPIDMAX": 999.0, "VPIDMIN": -999.0},
        doubt=OF_A_LIST,
    ),
    record(
        "exac8b",
        "TR KPR KIR KDR TDR VIMAX TA VRMAX VRMIN KE TE KC KD E1 SE1 E2 SE2 LIMFLG",
        absent={"VIMAX": 999.0, "LIMFLG": 0.0},
        held={"KA": 1.0, "VPIDMAX": 999.0, "VPIDMIN": -999.0, "VFEMAX": 999.0, "VEMIN": 0.0},
        spelled={"KPR": "kvp", "KIR": "kvi", "KDR": "kvd", "TDR": "tvd"},
    ),
)

STATES = "VC VI VD VR VE"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vemax = field_ceiling(s.VE, vfe, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs + u.vsum - vc
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    vr, d.VR = limited_lag(vpid, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    ve, d.VE = limited_integrator(vr - vfe, s.VE, p.TE, p.VEMIN, vemax)
    return rectifier(ve, p.KC * u.ifd)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    error, x.VI = pi_rest(vfe / p.KA, p.KPR, p.KIR)
    x.VC, x.VD, x.VR, x.VE = u.vc1, error, vfe, ve
    return u.vc1 + error - u.vs
