"""ST3A: controlled rectifier with a field voltage loop (IEEE Std 421.5-2005, 7.3).

              VIMAX                        VRMAX            VMMAX
vref + vs ►(+)►[clip]►[larger]►[1 + sTC]►[  KA  ]─►(+)─►[  KM  ]─►(x)─┬─► efd
           -▲  VIMIN     ▲     [1 + sTB] [1+sTA]   -▲   [1+sTM]    ▲  │
            │           vuel               VRMIN    │       VMMIN  VB │
vc1 ►[  1  ]┘                                       │                 │
     [1+sTR]                                        └[smaller]◄─[KG]◄─┘
                                                         ▲
                                                       VGMAX

VB = VE FEX(KC IFD / VE), at most VBMAX, with the source
VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|, THETAP in degrees. The limits of
both lags are non-windup. The current IT, and so KI, XL and THETAP, act on load
only. The standard has no OEL gate here.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    lag,
    larger,
    lead_lag,
    limited_lag,
    smaller,
    source_voltage,
)
from exfit.models.sheet import AS_IN_PSSE, FREE, GAIN, record, shared, sheet

ALIASES = ("ESST3A",)

SHEET = sheet(
    *shared(TR=0.0, VIMAX=0.2, VIMIN=-0.2),
    ("KM", 7.93, *GAIN, "gain of the field voltage loop", FREE),
    *shared(TC_FREE=1.0, TB_FREE=10.0, KA=200.0, TA_FIXED=0.0, VRMAX=10.0, VRMIN=-10.0, KG=1.0),
    *shared(KP=6.15, KI=0.0, VBMAX=6.9, KC=0.2, XL=0.081, VGMAX=5.8, THETAP=0.0),
    ("TM", 0.4, "s", (0.001, 10.0), "time constant of the field voltage loop", FREE),
    *shared(VMMAX=1.0, VMMIN=0.0),
)

RECORDS = (
    record(
        "ESST3A",
        "TR VIMAX VIMIN KM TC TB KA TA VRMAX VRMIN KG KP KI VBMAX KC XL VGMAX THETAP "
        "TM VMMAX VMMIN",
    ),
)

PSLF_RECORDS = (
    record(
        "esst3a",
        "TR VIMAX VIMIN KM TC TB KA TA VRMAX VRMIN KG KP KI VBMAX KC XL VGMAX THETAP TM "
        "VMMAX VMMIN",
        spelled={"THETAP": "angp"},
        doubt=AS_IN_PSSE,
    ),
)

STATES = "VC VL VR VM"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vb = source_voltage(u, p)
    vg = smaller(p.KG * vb * s.VM, p.VGMAX)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = larger(clip(u.vref + u.vs - vc, p.VIMIN, p.VIMAX), u.vuel)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vm, d.VM = limited_lag(vr - vg, s.VM, p.KM, p.TM, p.VMMIN, p.VMMAX)
    return vm * vb


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vm = efd / source_voltage(u, p)
    vr = vm / p.KM + smaller(p.KG * efd, p.VGMAX)
    vi = vr / p.KA
    x.VC, x.VL, x.VR, x.VM = u.vc1, vi, vr, vm
    return u.vc1 + vi - u.vs
