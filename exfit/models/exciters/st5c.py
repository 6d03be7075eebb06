"""ST5C: static exciter with two lead-lags in series (IEEE Std 421.5-2016).

              UEL OEL       VRMAX/KR    VRMAX/KR           VRMAX
vref + vsum ►(+)─►[gates]─►(+)─►[1 + sTC1]─►[1 + sTC2]─►[KR]─►[clip]─┐ VR
             -▲             ▲   [1 + sTB1]  [1 + sTB2]        VRMIN  │
              │             │    VRMIN/KR    VRMIN/KR                │
vc1 ──►[  1  ]┘             vs             VT VRMAX                  ▼
       [1+sTR]                       efd ◄──[  1  ]◄────────────────(+)
                                            [1+sT1]                 -▲
                                           VT VRMIN                  │
                                                                  KC IFD

Beside the two lead-lags stand two more pairs, with the times TUC1 TUB1 TUC2
TUB2 and TOC1 TOB1 TOC2 TOB2: KR takes what the first of these gives while UEL
has the gate, and what the second gives while OEL has it. All get the same
signal all the time and have the same limits. The limit of the lag T1 is
non-windup, and those of the lead-lags follow annex E, as in ST5B. While no
limiter acts it is ST5B.

The limiters act at the summing point (vsum) or at the gates. Dynawo and
InterPSS draw this; on the order and the limits of the lead-lags they disagree
as they do on ST5B, which says what is followed. Typical data are those of ST5B;
the times of the limiters' pairs are the standard's sample data, as GridKit has
them.
"""

from exfit.models.blocks import Signal, lag, larger, smaller, where
from exfit.models.exciters import st5b
from exfit.models.sheet import TIME, record, sheet

ALIASES = ("ESST5C",)

SHEET = (
    *st5b.SHEET,
    *sheet(
        ("TUC1", 2.0, *TIME, "first regulator lead while UEL has the gate"),
        ("TUB1", 10.0, *TIME, "first regulator lag while UEL has the gate"),
        ("TUC2", 0.1, *TIME, "second regulator lead while UEL has the gate"),
        ("TUB2", 0.05, *TIME, "second regulator lag while UEL has the gate"),
        ("TOC1", 0.1, *TIME, "first regulator lead while OEL has the gate"),
        ("TOB1", 2.0, *TIME, "first regulator lag while OEL has the gate"),
        ("TOC2", 0.08, *TIME, "second regulator lead while OEL has the gate"),
        ("TOB2", 0.08, *TIME, "second regulator lag while OEL has the gate"),
    ),
)

RECORDS = (
    record(
        "ST5C",
        "TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
    ),
)

STATES = f"{st5b.STATES} VU1 VU2 VO1 VO2"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vsum - vc
    raised = larger(error, u.vuel)
    signal = smaller(raised, u.voel) + u.vs
    own, under = (p.TC1, p.TB1, p.TC2, p.TB2), (p.TUC1, p.TUB1, p.TUC2, p.TUB2)
    over = p.TOC1, p.TOB1, p.TOC2, p.TOB2
    vl, d.VL1, d.VL2 = st5b.lead_lags(signal, (s.VL1, s.VL2), own, p)
    vu, d.VU1, d.VU2 = st5b.lead_lags(signal, (s.VU1, s.VU2), under, p)
    vo, d.VO1, d.VO2 = st5b.lead_lags(signal, (s.VO1, s.VO2), over, p)
    chosen = where(u.voel < raised, vo, where(u.vuel > error, vu, vl))
    efd, d.VE = st5b.fired(chosen, s, u, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vref = st5b.rest(efd, u, p, x)
    x.VU1 = x.VU2 = x.VO1 = x.VO2 = x.VL1
    return vref
