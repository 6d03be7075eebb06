"""Static exciters with a PI by a feedback of their output: ST7B and ST7C."""

from exfit.models.blocks import Signal, clip, lag, lead_lag, limited_lag
from exfit.models.sheet import (
    FREE,
    GAIN,
    OF_A_LIST,
    POSITIVE_TIME,
    TIME,
    UP_TO_10,
    UP_TO_100,
    documented,
    limits,
    record,
    shared,
    sheet,
)


def regulated(reference: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes up to the gates at the output into d and return what they get."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vg, d.VG = lead_lag(vc, s.VG, p.TG, p.TF)
    error = clip(reference, p.VMIN, p.VMAX) + u.vs - vg
    floor, ceiling = u.vt * p.VRMIN - p.KH * s.VF, u.vt * p.VRMAX - p.KL * s.VF
    va = clip(p.KPA * error, floor, ceiling)
    vl, d.VL = lead_lag(va, s.VL, p.TC, p.TB)
    return vl + s.VF


def st7b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST7B: static exciter, PI by a feedback of its output (IEEE Std 421.5-2005, 7.7).

                        vs
           VMAX         ▼                                               VT VRMAX
    vref ─►[clip]─────►(+)─►[KPA]─►[HV]─►[LV]─►[1 + sTC]─►(+)─►[gates]─►[clip]─┬►efd
           VMIN        -▲           ▲     ▲    [1 + sTB]   ▲  VUEL VOEL        │
                        │           │     │                │          VT VRMIN │
    vc1 ►[  1  ]─►[1 + sTG]         │     │                │                   │
         [1+sTR]  [1 + sTF]         │     │             VF └──[  KIA  ]◄───────┘
                                    │     │                   [1+sTIA ]
                                    │     └─ VT VRMAX - KL VF
                                    └─────── VT VRMIN - KH VF

    The feedback adds: with KIA = 1 it makes a PI regulator, KPA (1 + 1/(sTIA)), and
    the two gates keep it from winding up. The limits are clamps, none non-windup.

    Sources disagree on the feedback. Dynawo (and InterPSS after it) subtracts VF;
    one version of InterPSS adds sKIA/(1+sTIA). The model follows the text of the
    standard, by which the regulator is a PI (with TC > TB a PID); only so do its
    data, KPA = 40 and KIA = 1, hold a voltage, and only so do the gates fit the
    clamp behind them.

    Not modelled: limiters at the reference (OEL, UEL = 1 or 2 in a PSS/E record),
    stator current limiter and droop. The gates are those of OEL, UEL = 3; without a
    limiter all are the same, and the record says 0, none. The standard's data for
    VMAX and VMIN are 1.1 and 0.9; the typical data here leave the reference of a
    test unlimited.
    """
    gated = clip(regulated(u.vref, s, u, p, d), u.vuel, u.voel)
    efd = clip(gated, u.vt * p.VRMIN, u.vt * p.VRMAX)
    _, d.VF = lag(efd, s.VF, p.KIA, p.TIA)
    return efd


def st7b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vf = p.KIA * efd
    x.VC, x.VG, x.VL, x.VF = u.vc1, u.vc1, efd - vf, vf
    return u.vc1 + (efd - vf) / p.KPA - u.vs


ST7B = documented(
    st7b,
    st7b_rest,
    sheet(
        *shared(TR=0.02),
        ("TG", 1.0, *TIME, "lead of the measured voltage"),
        ("TF", 1.0, *TIME, "lag of the measured voltage"),
        *limits("VMAX", 1.6, 0.4, "the reference"),
        ("KPA", 40.0, *GAIN, "proportional gain", FREE),
        *shared(VRMAX_OF_EFD_AT_VT=5.0, VRMIN_OF_EFD_AT_VT=-4.5),
        ("KH", 1.0, *UP_TO_100, "feedback to the high-value gate"),
        ("KL", 1.0, *UP_TO_100, "feedback to the low-value gate"),
        *shared(TC=1.0, TB=1.0),
        ("KIA", 1.0, *UP_TO_10, "feedback gain, 1 for an integral"),
        ("TIA", 3.0, *POSITIVE_TIME, "feedback time constant, that of the integral", FREE),
    ),
    "VC VG VL VF",
    aliases="ESST7B",
    records=record(
        "ST7B",
        "TR TG TF VMAX VMIN KPA VRMAX VRMIN KH KL TC TB KIA TIA",
        icons={"OEL": 0, "UEL": 0},
        places={3: "takeover"},
    ),
    pslf_records=record(
        "esst7b",
        "TR KPA KIA TIA TB TC TF TG KL KH VRMAX VRMIN VMAX VMIN UEL OEL TS",
        absent={"UEL": 0.0, "OEL": 0.0, "TS": 0.0},
        doubt=OF_A_LIST,
    ),
)


def st7c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    reference = clip(u.vref + u.vsum, u.vuel, u.voel)
    gated = clip(regulated(reference, s, u, p, d), u.vuel_out, u.voel_out)
    efd, d.VE = limited_lag(gated, s.VE, 1.0, p.TA, u.vt * p.VRMIN, u.vt * p.VRMAX)
    _, d.VF = lag(efd, s.VF, p.KIA, p.TIA)
    return efd


def st7c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE = efd
    return st7b_rest(efd, u, p, x)


ST7C = documented(
    st7c,
    st7c_rest,
    (*ST7B.sheet, *shared(TA_OF_FIRING=0.01)),
    "VC VG VL VF VE",
    aliases="ESST7C",
    records=record(
        "ST7C",
        "TR TG TF VMAX VMIN KPA VRMAX VRMIN KH KL TC TB KIA TIA TA",
        icons={"OEL": 0, "UEL": 0},
        ignored="OEL UEL",
    ),
)
