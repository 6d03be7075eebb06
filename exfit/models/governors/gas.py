"""Governors of gas turbines: GAST and GGOV1."""

from typing import Any

from exfit.models.blocks import (
    Signal,
    clip,
    exp,
    lag,
    larger,
    lead_lag,
    limited,
    limited_integrator,
    limited_lag,
    log,
    rate,
    smaller,
    washout,
    where,
)
from exfit.models.governor_parts import (
    BAND,
    ON_RATING,
    PLAIN,
    banded,
    delayed,
    governor,
    in_use,
    outside_band,
)
from exfit.models.sheet import (
    DIVIDING_TIME,
    LONG_TIME,
    OF_TWO_PROGRAMS,
    SHORT_TIME,
    TIME,
    UP_TO_10,
    UP_TO_100,
    WITHIN_10,
    limits,
    record,
    sheet,
)


def gast(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """GAST: gas turbine governor (PSS/E).

                                       VMAX
    pref ─────────►(+)─►[lower of]─►[   1   ]─►[   1   ]─┬─►(+)─► Pm
                 -▲     [the two ]  [1 + sT1]  [1 + sT2] │-▲
    dw ─►[  1/R  ]┘         ▲          VMIN              │ │
                      AT ─►(+)◄─[KT]◄─(+)◄── AT          │ │
                                       ▲-                │ │
                                       └─[   1   ]◄──────┘ │
                                         [1 + sT3]         │
    dw ─►[Dturb]───────────────────────────────────────────┘

    pref is a power. The limits are non-windup. AT is the load that the ambient
    temperature allows. Typical data are those of IEC 61970-302 (GovGAST).
    """
    low, high, allowed = (
        in_use(s.VMIN0, p.VMIN),
        in_use(s.VMAX0, p.VMAX),
        in_use(s.AT0, p.AT),
    )
    demand = smaller(u.pref - outside_band(u.dw, p) / p.R, allowed + p.KT * (allowed - s.V3))
    v1, d.V1 = limited_lag(demand, s.V1, 1.0, p.T1, low, high)
    v2, d.V2 = lag(v1, s.V2, 1.0, p.T2)
    _, d.V3 = lag(v2, s.V3, 1.0, p.T3)
    return v2 - p.Dturb * u.dw


def gast_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1 = x.V2 = x.V3 = pm
    x.VMAX0, x.VMIN0, x.AT0 = larger(p.VMAX, pm), smaller(p.VMIN, pm), larger(p.AT, pm)
    return pm


GAST = governor(
    gast,
    gast_rest,
    sheet(
        ("R", 0.04, "pu", (0.001, 10.0), "permanent droop"),
        ("T1", 0.5, *TIME, "fuel valve lag"),
        ("T2", 0.5, *TIME, "turbine lag"),
        ("T3", 3.0, *DIVIDING_TIME, "exhaust temperature lag"),
        ("AT", 1.0, "pu", (0.001, 10.0), "load limit by the ambient temperature"),
        ("KT", 3.0, "1", (0.0, 1000.0), "temperature limiter gain"),
        *limits("VMAX", 1.0, 0.0, "the valve", WITHIN_10),
        ("Dturb", 0.18, *UP_TO_100, "turbine damping"),
        *BAND,
    ),
    "V1 V2 V3",
    aliases="GASTD",
    records=banded("GAST", "R T1 T2 T3 AT KT VMAX VMIN Dturb"),
    setpoints="VMAX0 VMIN0 AT0",
)


STEP = 0.01  # s, in which fsra follows fsr


NEVER = 9999.0  # pu, of a limiter that is left out


def droop(pe: Signal, valve: Signal, p: Signal) -> Signal:
    """Return the signal of the droop, 0 where that is fsr: ``fuel_demand`` closes its loop."""
    of_valve = where((p.Rselect < -0.5) & (p.Rselect > -1.5), valve, 0.0)
    return where(p.Rselect > 0.5, pe, of_valve)


def fuel_demand(
    error: Signal, least: Signal, low: Signal, high: Signal, s: Signal, p: Signal
) -> tuple[Signal, Signal, Signal]:
    """Return the demand for fuel, at most ``least``, that of the PID alone, and its error.

    ``low`` and ``high`` are the limits of the valve; ``error`` is that before its dead band.

    With Rselect = -2 demand and error wait for each other; that loop is solved here: it is
    monotonous, so that a limit holds there as it does here.
    """
    steep = p.Kdgov * rate(p.Tdgov)
    gain, held = p.Kpgov + steep, s.INTEG - steep * s.DERIV
    loop = where(p.Rselect < -1.5, p.R, 0.0)
    alone = dead_band(error - loop * held, p) / (1.0 + loop * gain)
    free = held + gain * clip(alone, p.minerr, p.maxerr)
    fsr = clip(smaller(free, least), low, high)
    seen = clip(dead_band(error - loop * fsr, p), p.minerr, p.maxerr)
    return fsr, held + gain * seen, seen


def dead_band(error: Signal, p: Signal) -> Signal:
    """Take the dead band off an error."""
    return error - clip(error, -p.db, p.db)


def fully_open(p: Signal, high: Signal) -> Signal:
    """Largest fsrt: 1, or where a unit starts above a VMAX of 1, that start."""
    return where(p.VMAX > 1.0, 1.0, larger(1.0, high))


def ggov1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """GGOV1: general governor of a gas turbine, with load and acceleration limiter.

                             maxerr
    pref + mw ─►(+)─►[dead]─►[clip]─►[    Kpgov + Kigov/s    ]─► fsrn
              -▲   ▲-[band]  minerr  [+ sKdgov/(1 + sTdgov)]
    dw ────────┘   └──[R]◄── droop

                                 VMAX
    fsrn, fsrt, fsra ─►[least]─►[clip]─► fsr
                                 VMIN

                       Ropen   VMAX
    fsr ─►(+)─►[ 1  ]─►[clip]─►[ 1 ]─┬─► valve
           ▲-  [Tact]  Rclose  [ s ] │
           │                   VMIN  │
           └─────────────────────────┘

    wf ─►(+)─►[Kturb]─►[exp(-sTeng)]─►[1 + sTc]─►(+)─► Pm
          ▲-                          [1 + sTb]   ▲-
         Wfnl                                 Dm (1 + dw)

    Ldref/Kturb + Wfnl ───────────►(+)─►[Kpload + Kiload/s]─► fsrt
                                 -▲
    wf ─►[1 + sTsa]─►[     1     ]┘
         [1 + sTsb]  [1 + sTfload]

    Aset ─────────────►(+)─►[Ka]─►[ 1 ]─► fsra
                     -▲           [ s ]
    dw ─►[   s   ]────┘
         [1 + sTa]

    pe at the start ─►(+)─►[Kimw/s]─► mw
                    -▲
    p ─►[     1     ]┴─► pe
        [1 + sTpelec]

    The droop is of pe (Rselect = 1), the valve (-1), fsr (-2) or none (0); db is
    the dead band of the error. wf is the valve, with Flag = 1 times the speed. mw
    stays within 1.1 R, fsrt at most at 1. The integrals of the PID and of the load
    limiter follow fsr while another signal is the least, as PowerWorld and InterPSS
    draw it.

    fsra follows fsr where another signal is the least. The programs take fsr of one
    time step before and Ka times step times (Aset - acceleration); here that step
    is 10 ms. Ka = 0 leaves the limiter out (there it lets no valve open). Dm < 0
    multiplies wf on its way to fsrt with (1 + dw)^Dm. pref is a speed, R times the
    droop at rest; where Rselect = 0, it is 0. By its Trate the valve is that of
    PowerWorld 24 within 1e-6 pu at rest.

    The equations are those of InterPSS, which has compared them with PowerWorld. In
    doubt are Dm > 0 (sources take Dm (1 + dw), not Dm dw, from the power), the way
    of wf to fsrt where Dm is not negative (InterPSS multiplies it with the speed
    there) and the input of Kimw/s (pe, or p without its lag). The delay of a
    diesel engine, Teng, stands where OpenIPSL and Dynawo have it; it is a Padé
    approximant of order two (see DEGOV1). Rup and Rdown, rates of the load limit,
    do nothing, as in PowerWorld, whose diagram says so (GridKit at 366540c7); only
    Dynawo has them, at fsrt. Typical data are those of OpenIPSL and InterPSS.
    """
    low, high, Ldref = (
        in_use(s.VMIN0, p.VMIN),
        in_use(s.VMAX0, p.VMAX),
        in_use(s.Ldref0, p.Ldref),
    )
    full = fully_open(p, high)
    pe, d.PE = lag(u.p, s.PE, 1.0, p.Tpelec)
    power_error = p.Kimw * (s.PE0 - pe)
    mw, d.MW = limited_integrator(power_error, s.MW, 1.0, -1.1 * p.R, 1.1 * p.R)
    acceleration, d.ACC = washout(u.dw, s.ACC, 1.0, p.Ta)
    valve = clip(s.VALVE, low, high)
    wf = valve * where(p.Flag > 0.5, 1.0 + u.dw, 1.0)
    falling = exp(smaller(p.Dm, 0.0) * log(1.0 + u.dw))
    temperature, d.TEMP = lead_lag(wf * falling, s.TEMP, p.Tsa, p.Tsb)
    measured, d.TEMPM = lag(temperature, s.TEMPM, 1.0, p.Tfload)
    load = Ldref / p.Kturb + p.Wfnl - measured
    fsrt = p.Kpload * load + s.LOAD
    fsra = where(p.Ka > 0.0, s.FSRA, NEVER)
    least = smaller(smaller(fsrt, full), fsra)
    error = u.pref + mw - outside_band(u.dw, p) - p.R * droop(pe, valve, p)
    fsr, fsrn, error = fuel_demand(error, least, low, high, s, p)
    _, d.DERIV = washout(error, s.DERIV, 1.0, p.Tdgov)
    d.INTEG = p.Kigov * (error + (fsr - fsrn) / p.Kpgov)
    # without Kpload the load limiter's integral does not follow: it stops at 1
    follows = p.Kpload > 0.0
    back = where(follows, (fsr - fsrt) / where(follows, p.Kpload, 1.0), 0.0)
    d.LOAD = limited(p.Kiload * (load + back), s.LOAD, -NEVER, where(follows, NEVER, full))
    d.FSRA = (fsr - s.FSRA) / STEP + p.Ka * (p.Aset - acceleration)
    velocity = clip((fsr - valve) / p.Tact, p.Rclose, p.Ropen)
    d.VALVE = limited(velocity, s.VALVE, low, high)
    burnt, d.ENGINE, d.DENGINE = delayed(p.Kturb * (wf - p.Wfnl), s.ENGINE, s.DENGINE, p.Teng)
    power, d.TURB = lead_lag(burnt, s.TURB, p.Tc, p.Tb)
    return power - larger(p.Dm, 0.0) * (1.0 + u.dw)


def ggov1_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.PE = x.PE0 = u.p
    x.MW = x.DERIV = x.ACC = x.DENGINE = 0.0
    x.TURB = x.ENGINE = pm + larger(p.Dm, 0.0)
    x.VALVE = x.INTEG = x.TEMP = x.TEMPM = x.TURB / p.Kturb + p.Wfnl
    x.VMAX0, x.VMIN0 = larger(p.VMAX, x.VALVE), smaller(p.VMIN, x.VALVE)
    x.Ldref0 = larger(p.Ldref, x.TURB)
    full = fully_open(p, in_use(x.VMAX0, p.VMAX))
    x.LOAD = where(p.Kpload > 0.0, x.VALVE, full)
    x.FSRA = x.VALVE + STEP * p.Ka * p.Aset
    return p.R * where(p.Rselect < -1.5, x.VALVE, droop(x.PE, x.VALVE, p))


GGOV1_CONS = (
    "R Tpelec maxerr minerr Kpgov Kigov Kdgov Tdgov VMAX VMIN Tact Kturb Wfnl Tb Tc Teng Tfload "
    "Kpload Kiload Ldref Dm Ropen Rclose Kimw Aset Ka Ta Trate db Tsa Tsb Rup Rdown"
)
OF_GGOV1: dict[str, Any] = {
    "icons": {"Rselect": 1, "Flag": 0},
    "absent": {"Rup": 99.0, "Rdown": -99.0},
    "ignored": "Trate",
}
GGOV1 = governor(
    ggov1,
    ggov1_rest,
    sheet(
        ("Rselect", 1.0, "1", (-2.0, 1.0), "signal of the droop: 1, 0, -1 or -2"),
        ("Flag", 0.0, "1", (0.0, 1.0), "1: fuel in proportion to the speed"),
        ("R", 0.04, *UP_TO_10, "permanent droop"),
        ("Tpelec", 1.0, *TIME, "power transducer lag"),
        ("maxerr", 0.05, *UP_TO_10, "ceiling of the speed error"),
        ("minerr", -0.05, "pu", (-10.0, 0.0), "floor of the speed error"),
        ("Kpgov", 10.0, "1", (0.001, 1000.0), "proportional gain of the governor"),
        ("Kigov", 2.0, "1/s", (0.0, 1000.0), "integral gain of the governor"),
        ("Kdgov", 0.0, *LONG_TIME, "derivative gain of the governor"),
        ("Tdgov", 1.0, *DIVIDING_TIME, "derivative lag of the governor"),
        *limits("VMAX", 1.0, 0.15, "the valve", WITHIN_10),
        ("Tact", 0.5, *DIVIDING_TIME, "actuator time constant"),
        ("Kturb", 1.5, "1", (0.001, 100.0), "turbine gain"),
        ("Wfnl", 0.2, "pu", (0.0, 1.0), "fuel flow at no load"),
        ("Tb", 0.1, *TIME, "turbine lag"),
        ("Tc", 0.0, *TIME, "turbine lead"),
        ("Teng", 0.0, *SHORT_TIME, "engine delay"),
        ("Tfload", 3.0, *TIME, "lag of the load limiter"),
        ("Kpload", 2.0, "1", (0.0, 1000.0), "proportional gain of the load limiter"),
        ("Kiload", 0.67, "1/s", (0.0, 1000.0), "integral gain of the load limiter"),
        ("Ldref", 1.0, *UP_TO_10, "reference of the load limiter"),
        ("Dm", 0.0, "pu", (-100.0, 100.0), "speed sensitivity of the turbine"),
        ("Ropen", 0.1, "pu/s", (0.0001, 1000.0), "fastest opening of the valve"),
        ("Rclose", -0.1, "pu/s", (-1000.0, -0.0001), "fastest closing of the valve"),
        ("Kimw", 0.0, "1/s", (0.0, 1000.0), "gain of the power controller"),
        ("Aset", 0.01, "pu/s", (0.0, 1000.0), "setpoint of the acceleration limiter"),
        ("Ka", 10.0, "1", (0.0, 1000.0), "gain of the acceleration limiter"),
        ("Ta", 0.1, *DIVIDING_TIME, "lag of the acceleration limiter"),
        ("db", 0.0, "pu", (0.0, 1.0), "dead band of the speed error"),
        ("Tsa", 4.0, *TIME, "lead of the exhaust temperature"),
        ("Tsb", 5.0, *TIME, "lag of the exhaust temperature"),
        *BAND,
    ),
    "PE MW DERIV INTEG VALVE TURB TEMP TEMPM LOAD ACC FSRA ENGINE DENGINE",
    aliases="GGOV1D",
    records=(
        *record("GGOV1", GGOV1_CONS, held=PLAIN, **OF_GGOV1),
        *record(
            "GGOV1D",
            f"{GGOV1_CONS} DBH DBL",
            held=ON_RATING,
            doubt=OF_TWO_PROGRAMS,
            **OF_GGOV1,
        ),
    ),
    pslf_records=record(
        "ggov1",
        "R Rselect Tpelec maxerr minerr Kpgov Kigov Kdgov Tdgov VMAX VMIN Tact Kturb Wfnl Tb Tc "
        "Flag Teng Tfload Kpload Kiload Ldref Dm Ropen Rclose Kimw PMWSET Aset Ka Ta db Tsa Tsb "
        "Rup Rdown",
        icons={"Rselect": 1, "Flag": 0},
        absent={"Rup": 99.0, "Rdown": -99.0},
        ignored="PMWSET",
        held=PLAIN,
    ),
    setpoints="PE0 VMAX0 VMIN0 Ldref0",
)
