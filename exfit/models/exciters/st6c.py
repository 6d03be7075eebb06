"""ST6C: static exciter, PID with a field voltage loop (IEEE Std 421.5-2016).

                UEL OEL      VAMAX, ILIM                      VRMAX  UEL OEL
vref + vsum ►(+)►[gates]─►(+)─►[KPA + KIA/s   ]─┬─►[KFF]─►(+)─►[clip]─►[gates]─┐
             -▲            ▲   [+ sKDA/(1+sTDA)]│          ▲    VRMIN          │
              │            vs  VAMIN            └►(+)─►[KM]┘                   │
vc1 ──►[  1  ]┘                                   -▲            VMMAX          │
       [1+sTR]                 efd ◄┬─(x)◄─────────┼───────────[  1  ]◄─[LV]◄──┘
                                    │  ▲           │           [1+sTA]   ▲
                                    │  VB          │            VMMIN    │
                                    └─────────►[  KG  ]                 ILIM
                                               [1+sTG]

ILIM = KLR (KCI ILR - IFD), at least VRMIN, limits the field current: at the
gate LV as in ST6B, and as the ceiling of the PID where it is below VAMAX.
VB = VE FEX(KC IFD / VE), at most VBMAX. It comes from the terminals (SW1 = 1,
position A of the drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
THETAP in degrees, or does not depend on them (SW1 = 2, B), VE = KP. The current
IT, and so KI, XL and THETAP, act on load only. The integral is frozen while the
PID is at its limit, and the limit of the lag TA is non-windup. With VB = VT
(KP = 1, KC = 0) and TA = 0 it is ST6B as long as the field current is small.

The limiters act at the summing point (vsum), at the gates behind it or at those
of the regulator's output; they may also be added behind the first gates (3 in a
PSS/E record), which is the same where no gate acts. Dynawo and InterPSS draw
this; Dynawo has no derivative, and a lag of ILIM that the others do not have.
Typical data are those of ST6B, with a supply from the terminals and a lag.
"""

from exfit.models.blocks import Signal, clip, lag, larger, limited_lag, pi_rest, pid, smaller, where
from exfit.models.exciters import st6b
from exfit.models.sheet import LIMIT, record, shared, sheet
from exfit.models.static import SUPPLY, supply

ALIASES = ("ESST6C",)

SHEET = (
    *st6b.SHEET,
    *sheet(
        *shared(TA_OF_FIRING=0.02),
        ("VMMAX", 4.5, *LIMIT, "ceiling of the lag before the rectifier"),
        ("VMMIN", -3.6, *LIMIT, "floor of the lag before the rectifier"),
    ),
    *SUPPLY,
)

RECORDS = (
    record(
        "ST6C",
        "TR KPA KIA KDA TDA VAMAX VAMIN KFF KM KCI KLR ILR VRMAX VRMIN KG TG VMMAX VMMIN TA "
        "KP KI XL THETAP KC VBMAX",
        icons={"OEL": 1, "UEL": 1, "SCL": 1, "SW1": 1},
        ignored="OEL UEL SCL",
    ),
)

STATES = "VC VI VD VM VG"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    current = larger(p.KLR * (p.KCI * p.ILR - u.ifd), p.VRMIN)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref + u.vsum - vc, u.vuel, u.voel) + u.vs
    va, slope, d.VD = pid(error, s.VI, s.VD, p.KPA, p.KIA, p.KDA, p.TDA, p.VAMIN, p.VAMAX)
    d.VI = where((va >= current) & (slope > 0.0), 0.0, slope)
    va = smaller(va, current)
    vr = clip(p.KFF * va + p.KM * (va - s.VG), p.VRMIN, p.VRMAX)
    least = smaller(clip(vr, u.vuel_out, u.voel_out), current)
    vm, d.VM = limited_lag(least, s.VM, 1.0, p.TA, p.VMMIN, p.VMMAX)
    efd = vm * supply(u, p)
    _, d.VG = lag(efd, s.VG, p.KG, p.TG)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VM, x.VG = efd / supply(u, p), p.KG * efd
    va = (x.VM + p.KM * x.VG) / (p.KFF + p.KM)
    x.VD, x.VI = pi_rest(va, p.KPA, p.KIA)
    x.VC = u.vc1
    return u.vc1 + x.VD - u.vs
