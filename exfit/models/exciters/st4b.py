"""ST4B: PI regulator with a field voltage loop (IEEE Std 421.5-2005, 7.4).

              VRMAX                           VMMAX
vref + vs ►(+)►[KPR + KIR/s]►[  1  ]─►(+)►[KPM + KIM/s]►[smaller]─►(x)─┬─► efd
           -▲      VRMIN     [1+sTA]  -▲      VMMIN         ▲       ▲  │
            │                          │                   voel     VB │
vc1 ►[  1  ]┘                          └─────────────[ KG ]◄───────────┘
     [1+sTR]

VB = VE FEX(KC IFD / VE), at most VBMAX, with the source
VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|, THETAP in degrees. An integral
is frozen while its PI is at its limit. KPM and KG close a loop without any lag;
the equations solve it. The current IT, and so KI, XL and THETAP, act on load
only. Not modelled: UEL at the summing point, and VGMAX of later editions.
"""

from exfit.models.blocks import Signal, clip, lag, pi, pi_rest, smaller, source_voltage
from exfit.models.sheet import FREE, INTEGRAL_GAIN, PID_GAIN, record, shared, sheet

ALIASES = ("ESST4B",)

# the gains are those that OpenIPSL compared with PSS/E: the samples of the standard cut a loop

SHEET = sheet(
    *shared(TR=0.0, KPR_OF_REGULATOR=2.97, KIR_OF_REGULATOR=2.97, VRMAX=1.0, VRMIN=-0.87, TA=0.02),
    ("KPM", 1.0, *PID_GAIN, "proportional gain of the field voltage loop", FREE),
    ("KIM", 0.2, *INTEGRAL_GAIN, "integral gain of the field voltage loop", FREE),
    *shared(VMMAX=1.0, VMMIN=-0.87, KG=0.1, KP=6.73, KI=0.1, VBMAX=8.41, KC=0.1, XL=0.0),
    *shared(THETAP=0.0),
)

RECORDS = (
    record("ESST4B", "TR KPR KIR VRMAX VRMIN TA KPM KIM VMMAX VMMIN KG KP KI VBMAX KC XL THETAP"),
)

PSLF_RECORDS = (
    record(
        "esst4b",
        "TR KPR KIR TA VRMAX VRMIN KPM KIM VMMAX VMMIN KG KP THETAP KI KC XL VBMAX VGMAX",
        absent={"VGMAX": 999.0},
        spelled={"THETAP": "angp"},
    ),
    record(
        "exst4b",
        "TR KPR KIR TA VRMAX VRMIN KPM KIM VMMAX VMMIN KG KP THETAP KI KC XL VBMAX",
        spelled={"THETAP": "angp"},
    ),
)

STATES = "VC VR VA VM"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vb = source_voltage(u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vr, d.VR = pi(u.vref + u.vs - vc, s.VR, p.KPR, p.KIR, p.VRMIN, p.VRMAX)
    va, d.VA = lag(vr, s.VA, 1.0, p.TA)
    # VM = KPM (VA - KG VB VM) + integral, solved for VM; its limits cut the solution
    vm = clip((p.KPM * va + s.VM) / (1.0 + p.KPM * p.KG * vb), p.VMMIN, p.VMMAX)
    efd = vb * smaller(vm, u.voel)
    _, d.VM = pi(va - p.KG * efd, s.VM, p.KPM, p.KIM, p.VMMIN, p.VMMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    inner, x.VM = pi_rest(efd / source_voltage(u, p), p.KPM, p.KIM)
    x.VA = inner + p.KG * efd
    error, x.VR = pi_rest(x.VA, p.KPR, p.KIR)
    x.VC = u.vc1
    return u.vc1 + error - u.vs
