"""Static exciters with two lead-lags in series: ST5B, ST5C and URST5T."""

from exfit.models.blocks import (
    Limited,
    Signal,
    clip,
    lag,
    larger,
    limited_lag,
    limited_lead_lag,
    smaller,
    where,
)
from exfit.models.sheet import (
    FREE,
    GAIN,
    LIMIT,
    SHORT_TIME,
    TIME,
    SearchRange,
    documented,
    record,
    record_of_2016,
    shared,
    sheet,
)


def lead_lags(u: Signal, gate: str, s: Signal, p: Signal, d: Signal) -> Signal:
    """Pass a signal through two limited lead-lags: while a ``gate``, U or O, is had, by its own."""
    low, high = p.VRMIN / p.KR, p.VRMAX / p.KR
    for k in (1, 2):
        lead, slow, state = (f"T{gate}C{k}", f"T{gate}B{k}", f"V{gate or 'L'}{k}")
        times = getattr(p, lead), getattr(p, slow)
        u, slope = limited_lead_lag(u, getattr(s, state), *times, low, high)
        setattr(d, state, slope)
    return u


def fired(vl: Signal, s: Signal, u: Signal, p: Signal) -> tuple[Signal, Limited]:
    """Return efd of what the lead-lags give, and the slope of its lag."""
    loaded = clip(p.KR * vl, p.VRMIN, p.VRMAX) - p.KC * u.ifd
    return limited_lag(loaded, s.VE, 1.0, p.T1, u.vt * p.VRMIN, u.vt * p.VRMAX)


def st5b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref - vc, u.vuel, u.voel) + u.vs
    efd, d.VE = fired(lead_lags(error, "", s, p, d), s, u, p)
    return efd


def st5b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = (efd + p.KC * u.ifd) / p.KR
    x.VC, x.VL1, x.VL2, x.VE = u.vc1, error, error, efd
    return u.vc1 + error - u.vs


ST5B = documented(
    st5b,
    st5b_rest,
    sheet(
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
    ),
    "VC VL1 VL2 VE",
    aliases="ESST5B",
    records=record(
        "ST5B",
        "TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2",
        ignored="TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2",
    ),
    pslf_records=record(
        "esst5b",
        "TR KR T1 KC VRMAX VRMIN TC1 TB1 TC2 TB2 TOC1 TOB1 TOC2 TOB2 TUC1 TUB1 TUC2 TUB2",
        ignored="TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2",
    ),
)


def st5c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vsum - vc
    raised = larger(error, u.vuel)
    signal = smaller(raised, u.voel) + u.vs
    vl, vu, vo = (lead_lags(signal, gate, s, p, d) for gate in ("", "U", "O"))
    chosen = where(u.voel < raised, vo, where(u.vuel > error, vu, vl))
    efd, d.VE = fired(chosen, s, u, p)
    return efd


def st5c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vref = st5b_rest(efd, u, p, x)
    x.VU1 = x.VU2 = x.VO1 = x.VO2 = x.VL1
    return vref


ST5C = documented(
    st5c,
    st5c_rest,
    sheet(
        *ST5B.sheet,
        ("TUC1", 2.0, *TIME, "first regulator lead while UEL has the gate"),
        ("TUB1", 10.0, *TIME, "first regulator lag while UEL has the gate"),
        ("TUC2", 0.1, *TIME, "second regulator lead while UEL has the gate"),
        ("TUB2", 0.05, *TIME, "second regulator lag while UEL has the gate"),
        ("TOC1", 0.1, *TIME, "first regulator lead while OEL has the gate"),
        ("TOB1", 2.0, *TIME, "first regulator lag while OEL has the gate"),
        ("TOC2", 0.08, *TIME, "second regulator lead while OEL has the gate"),
        ("TOB2", 0.08, *TIME, "second regulator lag while OEL has the gate"),
    ),
    "VC VL1 VL2 VE VU1 VU2 VO1 VO2",
    aliases="ESST5C",
    records=record_of_2016(
        "ST5C", "TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2"
    ),
)


def urst5t(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """URST5T: static exciter with two lead-lags in series (PSS/E URST5T).

          vsum    UEL OEL         VRMAX/KR    VRMAX/KR        VRMAX
            ▼
    vref ─►(+)───►[gates]──►(+)─►[1 + sTC1]─►[1 + sTC2]─►[KR]─►[clip]─┐ VR
           -▲                ▲   [1 + sTB1]  [1 + sTB2]       VRMIN   │
            │                │    VRMIN/KR    VRMIN/KR                │
    vc1 ►[  1  ]             vs             VT VRMAX                  │
         [1+sTR]              efd ◄──(+)◄──[  1  ]◄───────────────────┘
                                     -▲    [1+sT1]
                                      │    VT VRMIN
                                   KC IFD

    The proposal from which ST5B came: KC IFD is taken behind the lag T1 and its
    limits, and there are no lead-lags of limiters. Otherwise it is ST5B; OpenIPSL's
    and OPAL-RT's models, written after PSS/E's, agree. Typical data are ST5B's.
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref + u.vsum - vc, u.vuel, u.voel) + u.vs
    vr = clip(p.KR * lead_lags(error, "", s, p, d), p.VRMIN, p.VRMAX)
    ve, d.VE = limited_lag(vr, s.VE, 1.0, p.T1, u.vt * p.VRMIN, u.vt * p.VRMAX)
    return ve - p.KC * u.ifd


def urst5t_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vref = st5b_rest(efd, u, p, x)
    x.VE = efd + p.KC * u.ifd
    return vref


URST5T = documented(
    urst5t,
    urst5t_rest,
    ST5B.sheet,
    "VC VL1 VL2 VE",
    records=record("URST5T", "TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC"),
)
