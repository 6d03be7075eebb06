"""ST3C: controlled rectifier with a field voltage loop (IEEE Std 421.5-2016).

          vsum  VIMAX   UEL OEL      VPIDMAX                   VRMAX
            ▼
vref + vs ►(+)─►[clip]─►[gates]─►[KPR + KIR/s   ]─►[1 + sTC]─►[  KA  ]─┐ VR
           -▲   VIMIN            [+ sKDR/(1+sTDR)] [1 + sTB]  [1+sTA]  │
            │                      VPIDMIN                     VRMIN   │
vc1 ►[  1  ]┘                                          VMMAX           ▼
     [1+sTR]                      efd ◄─┬─(x)◄───────[  KM  ]◄────────(+)
                                        │  ▲         [1+sTM]          -▲
                                        │  VB         VMMIN            │
                                        └──[KG]──►[smaller]────────────┘
                                                      ▲
                                                    VGMAX

VB = VE FEX(KC IFD / VE), at most VBMAX. It comes from the terminals (SW1 = 1,
position A of the drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
THETAP in degrees, or does not depend on them (SW1 = 2, B), VE = KP. The current
IT, and so KI, XL and THETAP, act on load only. The limits of both lags are
non-windup; the integral is frozen while the PID is at its limit. With KPR = 1,
no integral and no derivative it is ST3A.

The limiters act at the summing point (vsum) or at the gates behind VIMAX.
InterPSS writes this; the parameters and limits that PowerWorld lists agree, but
for the derivative, which the standard does not have and the record of PSS/E
has. PSS/E and PowerWorld 24 read TA and do without it (with 0 vt is that of
PowerWorld within 1e-6 pu over a fault, with 0.4 within 4e-3): here it acts, as
in ST3A, and a unit of a .dyr file has 0. Typical data are those of ST3A, which
are the first set of the standard's sample data in GridKit; the PID is not that
of a sample: GridKit lists none.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, limited_lag, pi_rest, pid, smaller
from exfit.models.exciters import st3a
from exfit.models.sheet import OF_TWO_PROGRAMS, not_searched, record
from exfit.models.static import PID, SUPPLY_SWITCH, supply

ALIASES = ("ESST3C",)

SHEET = (*not_searched(st3a.SHEET, "KA"), *PID, *SUPPLY_SWITCH)

RECORDS = (
    record(
        "ST3C",
        "TR VIMAX VIMIN KPR KIR KDR TDR VPIDMAX VPIDMIN TC TB KA TA VRMAX VRMIN KM TM VMMAX "
        "VMMIN KG VGMAX KP KI XL THETAP KC VBMAX",
        icons={"OEL": 1, "UEL": 1, "SCL": 1, "SW1": 1},
        ignored="OEL UEL SCL",
        doubt=OF_TWO_PROGRAMS,
        unused={"TA": ""},
    ),
)

STATES = "VC VI VD VL VR VM"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vb = supply(u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref + u.vs + u.vsum - vc, p.VIMIN, p.VIMAX)
    vi = clip(error, u.vuel, u.voel)
    vpid, d.VI, d.VD = pid(vi, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    vl, d.VL = lead_lag(vpid, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vg = smaller(p.KG * vb * s.VM, p.VGMAX)
    vm, d.VM = limited_lag(vr - vg, s.VM, p.KM, p.TM, p.VMMIN, p.VMMAX)
    return vm * vb


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VM = efd / supply(u, p)
    x.VR = x.VM / p.KM + smaller(p.KG * efd, p.VGMAX)
    x.VL = x.VR / p.KA
    x.VD, x.VI = pi_rest(x.VL, p.KPR, p.KIR)
    x.VC = u.vc1
    return u.vc1 + x.VD - u.vs
