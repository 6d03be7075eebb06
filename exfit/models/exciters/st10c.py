"""ST10C: static exciter with lead-lags for each limiter (IEEE Std 421.5-2016).

     vsum   UEL OEL                VRMAX/KR          VRMAX  UEL OEL
       ▼
vref ►(+)─►[gates]─►(+)─►[1 + sTC2]─►[1 + sTC1]─►[KR]─►[clip]─►[gates]─┐ VR
      -▲             ▲   [1 + sTB2]  [1 + sTB1]        VRMIN           │
       │             │                VRMIN/KR                         │
vc1►[  1  ]          vs                VRMAX                           ▼
    [1+sTR]                efd ◄─(x)◄─[  1  ]◄────────────────────────(+)
                                  ▲   [1+sT1]                          ▲
                                  VB   VRMIN                          VRS

VB = VE FEX(KC IFD / VE), at most VBMAX. It comes from the terminals (SW1 = 1,
position A of the drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
THETAP in degrees, or does not depend on them (SW1 = 2, B), VE = KP. The current
IT, and so KI, XL and THETAP, act on load only. Between the lead-lags the signal
is at most (VRMAX - VRMIN) TB1 / (KR TC1) in size. Beside these two stand two
more pairs, with the times TUC1 TUB1 TUC2 TUB2 and TOC1 TOB1 TOC2 TOB2: KR takes
what the first of these gives while UEL has the first gate, and what the second
gives while OEL has it. All get the same signal all the time. The limit of the
lag T1 is non-windup, and those of the lead-lags follow annex E of the edition
of 2005, as in ST5C.

The limiters act at the summing point (vsum), at the gates before the lead-lags
or at those behind them. The stabiliser is added to the voltage error (VOS = 1)
or behind the first gates (VOS = 2). With VOS = 3, and with VOS = 2 while a
limiter has those gates, it passes through lead-lags of its own, with TC2, TB2,
TC1, TB1 and KR and the limits VRSMAX and VRSMIN in place of VRMAX and VRMIN,
which give VRS.

The lead-lags and their order are those of PSS/E 36.7: its states and efd agree
over a pulse of the reference to what it rounds in single precision. Gates,
limits and VOS rest on InterPSS alone, where a lead-lag at its limit holds its
state, and a stator current limiter at the first gates leaves the lead-lags as
they are. Typical data are not those of a sample.
"""

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    inf,
    lag,
    limited_lag,
    limited_lead_lag,
    where,
)
from exfit.models.exciter_parts import STATIC_SUPPLY, routed, supply
from exfit.models.sheet import (
    FREE,
    GAIN,
    LIMIT,
    SHORT_TIME,
    TIME,
    TWO_GATES,
    Row,
    SearchRange,
    record,
    shared,
    sheet,
)

ALIASES = "ESST10C"


def pair(gate: str, *typical: float) -> tuple[Row, ...]:
    """Make the rows of the times of the lead-lags while UEL, U, or OEL, O, has the gate."""
    times = {"C1": "first regulator lead", "B1": "first regulator lag"}
    times |= {"C2": "second regulator lead", "B2": "second regulator lag"}
    return tuple(
        (f"T{gate}{name}", value, *TIME, f"{meaning} while {gate}EL has the gate")
        for (name, meaning), value in zip(times.items(), typical, strict=True)
    )


SHEET = sheet(
    *shared(TR=0.01),
    ("KR", 500.0, *GAIN, "regulator gain", FREE),
    ("TC1", 1.5, *TIME, "first regulator lead", SearchRange(unlike="TB1")),
    ("TB1", 12.5, *TIME, "first regulator lag", SearchRange(unlike="TC1")),
    ("TC2", 0.1, *TIME, "second regulator lead"),
    ("TB2", 0.1, *TIME, "second regulator lag"),
    *pair("U", 2.0, 10.0, 0.1, 0.05),
    *pair("O", 0.1, 2.0, 0.08, 0.08),
    ("VOS", 1.0, "1", (1.0, 3.0), "place of the stabiliser, on load: 1 error, 2 gate, 3 output"),
    ("VRSMAX", 5.0, *LIMIT, "ceiling of VRS, while a limiter has the gate or VOS is 3"),
    ("VRSMIN", -5.0, *LIMIT, "floor of VRS, while a limiter has the gate or VOS is 3"),
    *shared(VRMAX=10.0, VRMIN=-8.7),
    ("T1", 0.004, *SHORT_TIME, "firing circuit time constant", FREE),
    *STATIC_SUPPLY,
)

RECORDS = record(
    "ST10C",
    "TR KR TC1 TB1 TC2 TB2 TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2 VRSMAX VRSMIN VRMAX VRMIN T1 "
    "KP KC KI XL THETAP VBMAX",
    icons={"VOS": 1, "OEL": 1, "UEL": 1, "SCL": 1, "SW1": 1},
    ignored="OEL UEL SCL",
    places=TWO_GATES,
)

STATES = "VC VL2 VL1 VU2 VU1 VO2 VO1 VS2 VS1 VA"


def lead_lags(
    x: Signal, of: str, low: Signal, high: Signal, s: Signal, p: Signal, d: Signal
) -> Signal:
    """Pass a signal through the lead-lags of UEL, OEL, the stabiliser, or none: U, O, S or L."""
    gate = of if of in "UO" else ""
    lead, slow = getattr(p, f"T{gate}C1"), getattr(p, f"T{gate}B1")
    none = (lead < SHORTEST) | (slow < SHORTEST)
    between = where(none, inf, (high - low) * slow / where(none, 1.0, lead))
    for k, bottom, top in ((2, -between, between), (1, low, high)):
        times = getattr(p, f"T{gate}C{k}"), getattr(p, f"T{gate}B{k}")
        x, slope = limited_lead_lag(x, getattr(s, f"V{of}{k}"), *times, bottom, top)
        setattr(d, f"V{of}{k}", slope)
    return x


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    signal, oel, uel, own = routed(vc, u, p)
    low, high = p.VRMIN / p.KR, p.VRMAX / p.KR
    vl, vu, vo = (lead_lags(signal, of, low, high, s, p, d) for of in "LUO")
    vr = clip(p.KR * where(oel, vo, where(uel, vu, vl)), p.VRMIN, p.VRMAX)
    vs = lead_lags(own, "S", p.VRSMIN / p.KR, p.VRSMAX / p.KR, s, p, d)
    vrs = clip(p.KR * vs, p.VRSMIN, p.VRSMAX)
    sent = clip(vr, u.vuel_out, u.voel_out) + vrs
    va, d.VA = limited_lag(sent, s.VA, 1.0, p.T1, p.VRMIN, p.VRMAX)
    return va * supply(p.KC * u.ifd, u, p)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VA = efd / supply(p.KC * u.ifd, u, p)
    own = where(p.VOS < 2.5, 0.0, u.vs)
    error = (x.VA - clip(p.KR * own, p.VRSMIN, p.VRSMAX)) / p.KR
    x.VL2 = x.VL1 = x.VU2 = x.VU1 = x.VO2 = x.VO1 = error
    x.VC, x.VS2, x.VS1 = u.vc1, own, own
    return u.vc1 + error - (u.vs - own)
