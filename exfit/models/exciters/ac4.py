"""Alternator exciters with a controlled rectifier: AC4A, AC4C and EXAC4."""

from exfit.models.blocks import Signal, clip, lag, larger, lead_lag, limited_lag
from exfit.models.sheet import (
    AS_IN_PSSE,
    OF_TWO_PROGRAMS,
    ONE_GATE,
    documented,
    record,
    record_of_2016,
    shared,
    sheet,
)


def limited_error(limiters: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Return the voltage error, with what limiters add, between its limits behind a lead-lag."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = clip(u.vref + u.vs + limiters - vc, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    return vl


def ac4a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC4A: alternator with a controlled rectifier (IEEE Std 421.5-2005, 6.4).

               vsum  VIMAX             UEL  VRMAX - KC IFD
                 ▼
    vref + vs ─►(+)─►[clip]─►[1 + sTC]─►HV─►[  KA  ]─► efd
               -▲    VIMIN   [1 + sTB]      [1+sTA]
                │                           VRMIN
    vc1 ►[  1  ]┘
         [1+sTR]

    The limits of the lag are non-windup, and only the upper one falls with the
    field current. An OEL is added to vs. The alternator's own regulator is left
    out, as in the standard. PSS/E's older EXAC4 differs in its limits and is a
    separate model.
    """
    vl = limited_error(u.vsum, s, u, p, d)
    ceiling = p.VRMAX - p.KC * u.ifd
    efd, d.VR = limited_lag(larger(vl, u.vuel), s.VR, p.KA, p.TA, p.VRMIN, ceiling)
    return efd


def ac4a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = efd / p.KA
    x.VC, x.VL, x.VR = u.vc1, error, efd
    return u.vc1 + error - u.vs


AC4A = documented(
    ac4a,
    ac4a_rest,
    sheet(
        *shared(TR=0.0, VIMAX=10.0, VIMIN=-10.0, TC_FREE=1.0, TB_FREE=10.0, KA=200.0, TA=0.015),
        *shared(VRMAX_OF_EFD=5.64, VRMIN_OF_EFD=-4.53, KC=0.0),
    ),
    "VC VL VR",
    aliases="ESAC4A",
    records=record("ESAC4A", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC"),
    pslf_records=record("esac4a", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC", doubt=AS_IN_PSSE),
)


def ac4c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC4C: alternator with a controlled rectifier (IEEE Std 421.5-2016).

               vsum  VIMAX            UEL OEL  VRMAX - KC IFD
                 ▼
    vref + vs ─►(+)─►[clip]─►[1 + sTC]─►[gates]─►[  KA  ]─► efd
               -▲    VIMIN   [1 + sTB]           [1+sTA]
                │                                VRMIN
    vc1 ►[  1  ]┘
         [1+sTR]

    The limits of the lag are non-windup, and only the upper one falls with the
    field current. The alternator's own regulator is left out, as in the standard.
    Without limiters it is AC4A.

    The limiters act at the summing point (vsum) or at the gates. The sources are
    the drawing of 2005 and the program InterPSS, which adds the gate of the OEL and
    where the limit of the lag winds up.
    """
    vl = limited_error(u.vsum, s, u, p, d)
    gated, ceiling = clip(vl, u.vuel, u.voel), p.VRMAX - p.KC * u.ifd
    efd, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, p.VRMIN, ceiling)
    return efd


AC4C = documented(
    ac4c,
    ac4a_rest,
    AC4A.sheet,
    "VC VL VR",
    aliases="ESAC4C",
    records=record_of_2016(
        "AC4C", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC", places=ONE_GATE, doubt=OF_TWO_PROGRAMS
    ),
)


def exac4(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXAC4: alternator with a controlled rectifier (IEEE type AC4 of 1981).

                     VIMAX                       VRMAX - KC IFD
    vref + vs ─►(+)─►[clip]─►[1 + sTC]─►[  KA  ]─►[clip]─► efd
               -▲    VIMIN   [1 + sTB]  [1+sTA]  VRMIN - KC IFD
                │
    vc1 ►[  1  ]┘
         [1+sTR]

    AC4A with other limits: the clamp is behind the lag, which can run beyond it
    (windup), and the field current lowers both of its limits. Two models written
    after PSS/E's EXAC4 agree; a third has the same limits, but non-windup. Not
    modelled: UEL and OEL, which are added to vs.
    """
    vr, d.VR = lag(limited_error(0.0, s, u, p, d), s.VR, p.KA, p.TA)
    drop = p.KC * u.ifd
    return clip(vr, p.VRMIN - drop, p.VRMAX - drop)


EXAC4 = documented(
    exac4,
    ac4a_rest,
    AC4A.sheet,
    "VC VL VR",
    records=record("EXAC4", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC"),
    pslf_records=record("exac4", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC"),
)
