"""ST7C: static exciter, PI by a feedback of its output (IEEE Std 421.5-2016).

                                vs
             UEL OEL    VMAX    ▼
vref + vsum ─►[gates]─►[clip]─►(+)─►[KPA]─►[HV]─►[LV]─►[1 + sTC]──►(+)─┐
                        VMIN   -▲           ▲     ▲    [1 + sTB]    ▲  │
                                │           │     │                 │  │
            vc1 ►[  1  ]─►[1 + sTG]         │     └ VT VRMAX - KL VF│  │
                 [1+sTR]  [1 + sTF]         └─ VT VRMIN - KH VF     │  │
                                         VT VRMAX   UEL OEL         │  │
                     efd ◄─┬─────────────[  1  ]◄───[gates]◄────────┼──┘
                           │             [1+sTA]                    │
                           │            VT VRMIN                    │
                           └────────────►[  KIA  ]───── VF ─────────┘
                                         [1+sTIA ]

ST7B with the gates of its reference and a lag of the firing control: with TA =
0 it is ST7B. The feedback adds: with KIA = 1 it makes a PI regulator, KPA (1 +
1/(sTIA)), and the two gates HV and LV keep it from winding up. The limits are
clamps but for that of the lag TA, which is non-windup.

The limiters act at the reference, added to it (vsum) or at gates (UEL or OEL 2
in a PSS/E record), or at the gates of the output (3). Dynawo and InterPSS draw
this, and subtract VF; why it is added here, ST7B says. Dynawo clamps behind the
lag TA, InterPSS limits its state, which is followed. InterPSS applies OEL
before UEL. Typical data are those of ST7B.
"""

from exfit.models.blocks import Signal, clip, lag, limited_lag
from exfit.models.exciters import st7b
from exfit.models.sheet import record, shared

ALIASES = ("ESST7C",)

SHEET = (
    *st7b.SHEET,
    *shared(TA_OF_FIRING=0.01),
)

RECORDS = (
    record(
        "ST7C",
        "TR TG TF VMAX VMIN KPA VRMAX VRMIN KH KL TC TB KIA TIA TA",
        icons={"OEL": 0, "UEL": 0},
        ignored="OEL UEL",
    ),
)

STATES = f"{st7b.STATES} VE"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    reference = clip(u.vref + u.vsum, u.vuel, u.voel)
    gated = clip(st7b.regulated(reference, s, u, p, d), u.vuel_out, u.voel_out)
    efd, d.VE = limited_lag(gated, s.VE, 1.0, p.TA, u.vt * p.VRMIN, u.vt * p.VRMAX)
    _, d.VF = lag(efd, s.VF, p.KIA, p.TIA)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE = efd
    return st7b.rest(efd, u, p, x)
