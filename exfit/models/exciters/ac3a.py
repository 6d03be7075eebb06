"""AC3A: alternator exciter, its own supply (IEEE Std 421.5-2005, 6.3).

          vsum           UEL       VAMAX               VE <= VEMAX
            ▼
vref + vs ►(+)►[1 + sTC]─►HV─►(+)─►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─ VE ─►(x)─┬►efd
          -▲   [1 + sTB]     -▲    [1+sTA]    ▲  -▲    [ sTE ] │        ▲  │
           │                  │    VAMIN      │   │    VEMIN   │       FEX │
           │                  │            KR efd └─── VFE ◄───┘        ▲  │
vc1►[  1  ]┘            ┌─────┘                                KC IFD / VE │
    [1+sTR]             │  [   s   ]                                       │
                        └──[1 + sTF]◄─ VN ─[ KF to EFDN, then KN ]◄────────┘

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. VN has
the slope KF up to EFDN and KN beyond it. The exciter supplies its regulator, so
the gain of both grows with efd. The limits of the lag and of VE are non-windup.

VF is subtracted behind the lead-lag, as in the models written after PSS/E's
ESAC3A. Not modelled: the low voltage limiter (KLV, VLV) of the model of 1981,
which IEEE Std 421.5 and ESAC3A replaced by VEMIN. An OEL is added to vs.
VEMIN is 0.1 here; with 0, as in some copies of the sample data, VE stays at 0
once it is there, since the regulator then has no supply.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    field_ceiling,
    field_demand,
    lag,
    larger,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    washout,
    where,
)
from exfit.models.sheet import OF_A_LIST, record, shared, sheet

ALIASES = ("ESAC3A",)

SHEET = sheet(
    *shared(TR=0.0, TB=0.0, TC=0.0, KA=45.62, TA=0.013, VAMAX=1.0, VAMIN=-0.95, TE=1.17, VEMIN=0.1),
    *shared(KR=3.77, KF_TO_EFDN=0.143, TF=1.0, KN=0.05, EFDN=2.36, KC_FREE=0.104, KD=0.499, KE=1.0),
    *shared(VFEMAX=16.0, E1=6.24, SE1=1.143, E2=4.68, SE2=0.1),
)

RECORDS = (
    record(
        "ESAC3A",
        "TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2",
    ),
)

PSLF_RECORDS = (
    record(
        "esac3a",
        "TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)

STATES = "VC VL VA VE VF"


def feedback(efd: Signal, p: Signal) -> Signal:
    """Return VN, the field voltage through a gain that changes at EFDN."""
    return where(efd < p.EFDN, p.KF * efd, p.KF * p.EFDN + p.KN * (efd - p.EFDN))


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vemax = field_ceiling(s.VE, vfe, p)
    # before the integrator that makes it: the exciter feeds its own regulator
    efd = rectifier(clip(s.VE, p.VEMIN, vemax), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(feedback(efd, p), s.VF, 1.0, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(larger(vl, u.vuel) - vf, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    _, d.VE = limited_integrator(p.KR * efd * va - vfe, s.VE, p.TE, p.VEMIN, vemax)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    va = field_demand(ve, u.ifd, p) / (p.KR * efd)
    error = va / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, va, ve, feedback(efd, p)
    return u.vc1 + error - u.vs
