"""ST5B: static exciter with two lead-lags in series (IEEE Std 421.5-2005, 7.5).

              VUEL VOEL       VRMAX/KR    VRMAX/KR        VRMAX
vref ─►(+)───►[gates]──►(+)─►[1 + sTC1]─►[1 + sTC2]─►[KR]─►[clip]─┐ VR
       -▲                ▲   [1 + sTB1]  [1 + sTB2]       VRMIN   │
        │                │    VRMIN/KR    VRMIN/KR                │
vc1 ►[  1  ]             vs             VT VRMAX                  ▼
     [1+sTR]                      efd ◄──[  1  ]◄────────────────(+)
                                         [1+sT1]                 -▲
                                        VT VRMIN                  │
                                                               KC IFD

The limit of the lag T1 is non-windup, and those of the lead-lags follow annex
E: at a limit the state follows the limited output with the lag TC. Sources
disagree on the chain. The model follows PowerWorld and InterPSS, whose order is
that of the PSS/E record, with the limits on both; Dynawo takes TC2/TB2 first
and limits TC1/TB1 only. While no limit is met these are the same. A PSS/E run
at the ceiling during a fault leaves it 6 % of efd above this model.

Not modelled: the lead-lags TUC, TUB and TOC, TOB that take over while a limiter
has the gate; while none acts they have no effect.
"""

from exfit.models.blocks import Limited, Signal, clip, lag, limited_lag, limited_lead_lag
from exfit.models.sheet import (
    FREE,
    GAIN,
    LIMIT,
    SHORT_TIME,
    TIME,
    SearchRange,
    record,
    shared,
    sheet,
)

SHEET = sheet(
    *shared(TR=0.02),
    ("TC1", 0.8, *TIME, "first regulator lead", SearchRange(unlike="TB1")),
    ("TB1", 6.0, *TIME, "first regulator lag", SearchRange(unlike="TC1")),
    ("TC2", 0.08, *TIME, "second regulator lead", SearchRange(unlike="TB2")),
    ("TB2", 0.01, *TIME, "second regulator lag", SearchRange(unlike="TC2")),
    ("KR", 200.0, *GAIN, "regulator gain", FREE),
    ("VRMAX", 5.0, *LIMIT, "regulator ceiling, and at rated voltage"),
    ("VRMIN", -4.0, *LIMIT, "regulator floor, and at rated voltage"),
    ("T1", 0.004, *SHORT_TIME, "firing circuit time constant", FREE),
    *shared(KC=0.004),
)

RECORDS = (
    record(
        "ST5B",
        "TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2",
        ignored="TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2",
    ),
)

STATES = "VC VL1 VL2 VE"

Times = tuple[Signal, Signal, Signal, Signal]  # TC1 TB1 TC2 TB2


def lead_lags(
    error: Signal, states: tuple[Signal, Signal], times: Times, p: Signal
) -> tuple[Signal, Limited, Limited]:
    """Return the output of two limited lead-lags in series, and the slopes of their states."""
    low, high = p.VRMIN / p.KR, p.VRMAX / p.KR
    TC1, TB1, TC2, TB2 = times
    vl1, first = limited_lead_lag(error, states[0], TC1, TB1, low, high)
    vl2, second = limited_lead_lag(vl1, states[1], TC2, TB2, low, high)
    return vl2, first, second


def fired(vl: Signal, s: Signal, u: Signal, p: Signal) -> tuple[Signal, Limited]:
    """Return efd of what the lead-lags give, and the slope of its lag."""
    loaded = clip(p.KR * vl, p.VRMIN, p.VRMAX) - p.KC * u.ifd
    return limited_lag(loaded, s.VE, 1.0, p.T1, u.vt * p.VRMIN, u.vt * p.VRMAX)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref - vc, u.vuel, u.voel) + u.vs
    times = p.TC1, p.TB1, p.TC2, p.TB2
    vl, d.VL1, d.VL2 = lead_lags(error, (s.VL1, s.VL2), times, p)
    efd, d.VE = fired(vl, s, u, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = (efd + p.KC * u.ifd) / p.KR
    x.VC, x.VL1, x.VL2, x.VE = u.vc1, error, error, efd
    return u.vc1 + error - u.vs
