"""AC7C: alternator exciter, inner field loop, supply (IEEE Std 421.5-2016).

          vsum  UEL OEL   VRMAX        UEL OEL        VAMAX
            ▼
vref + vs ►(+)►[gates]►[KPR + KIR/s   ]►[gates]►(+)►[KPA + KIA/s]─ VA ►(x)► VFD
           -▲▲-        [+ sKDR/(1+sTDR)]         -▲                     ▲
            ││            VRMIN                   │   VAMIN             VS
            ││                             KF1 efd + KF2 VFE
            ││ [  sKF3 ]                       VE <= VEMAX
            │└─[1 + sTF]◄──┐ VFD ─►[HV]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
            │              │        ▲    -▲   [ sTE ] │        ▲
vc1►[  1  ]─┘              │     -KL VFE  │    VEMIN  │       FEX
    [1+sTR]                └──────────────┴─── VFE ◄──┘        ▲
                                                          KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
supply VS of the amplifier is VB (SW2 = 1, position A of the drawing) or KR efd
(SW2 = 2, B). VB = VE1 FEX(KC1 VFE / VE1), at most VBMAX, comes from the
terminals (SW1 = 1, A), VE1 = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
THETAP in degrees, or does not depend on them (SW1 = 2, B), VE1 = KP. The
current IT, and so KI, XL and THETAP, act on load only. The limits of VE are
non-windup; the integrals of the PID and of the PI are frozen while they would
drive their output further beyond its limit. With VB = KP VT (KC1 = 0, VBMAX out
of reach) it is AC7B.

The limiters act at the summing point (vsum), at the gates before the PID or at
those behind it. Dynawo and InterPSS draw the same. Not modelled: a gate of the
OEL behind the PI, and a stabiliser that is added behind the first gate (VOS = 2
in a PSS/E record). The data of the supply, but for KP, are not those of a
sample.
"""

from exfit.models.alternators import SUPPLY, alternator, supply
from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    larger,
    pi,
    pi_rest,
    pid,
    rectifier,
    rectifier_supply,
    washout,
    where,
)
from exfit.models.exciters import ac7b
from exfit.models.sheet import OF_TWO_PROGRAMS, TWO_GATES, UP_TO_100, record, shared, sheet

ALIASES = ("ESAC7C",)

SHEET = (
    *ac7b.SHEET,
    *(row for row in SUPPLY if row.symbol not in ("KP", "KC1", "VBMAX")),
    *sheet(
        ("KC1", 0.2, *UP_TO_100, "loading factor of the supply's rectifier"),
        *shared(VBMAX=7.0),
        ("SW2", 1.0, "1", (1.0, 2.0), "supply of the amplifier: 1 VB, 2 field voltage"),
        *shared(KR=4.0),
    ),
)

RECORDS = (
    record(
        "AC7C",
        "TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL KF1 KF2 KF3 TF KC KD KE TE "
        "VFEMAX VEMIN E1 SE1 E2 SE2 KI XL THETAP KC1 VBMAX KR",
        icons={"OEL": 1, "UEL": 1, "VOS": 1, "SW1": 1, "SW2": 1},
        ignored="OEL UEL",
        places=TWO_GATES,
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES = ac7b.STATES


def amplifier_supply(efd: Signal, u: Signal, vfe: Signal, p: Signal) -> Signal:
    """Return VS, what the amplifier gets: of a source of its own, or of the exciter."""
    return where(p.SW2 < 1.5, supply(u, vfe, p), p.KR * efd)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    fed_back = rectifier(s.VE, p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF3, p.TF)
    error = clip(u.vref + u.vs + u.vsum - vc - vf, u.vuel, u.voel)
    vr, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VRMIN, p.VRMAX)
    inner = clip(vr, u.vuel_out, u.voel_out) - p.KF1 * fed_back - p.KF2 * vfe
    va, d.VA = pi(inner, s.VA, p.KPA, p.KIA, p.VAMIN, p.VAMAX)
    vfd = larger(amplifier_supply(fed_back, u, vfe, p) * va, -p.KL * vfe)
    efd, d.VE = alternator(vfd, vfe, s, u, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(x.VE, u.ifd, p)
    inner, x.VA = pi_rest(vfe / amplifier_supply(efd, u, vfe, p), p.KPA, p.KIA)
    x.VD, x.VI = pi_rest(inner + p.KF1 * efd + p.KF2 * vfe, p.KPR, p.KIR)
    x.VC, x.VF = u.vc1, vfe
    return u.vc1 + x.VD - u.vs
