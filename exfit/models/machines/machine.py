"""A synchronous machine as data, and what the kinds of machine share.

Per unit as excitation studies have it: 1 pu of efd and of ifd gives 1 pu of terminal voltage on the
air-gap line; power, current and reactances are on the machine's own base. The rotor's q axis leads
its d axis. Neglected, as in PSS/E: the stator's own transients, and speed in the stator's voltages,
until a breaker opens. The armature resistance is a part of the plant (`plants.loaded_machine`).

A d axis has a field and a damper winding: T'd0 dE'q/dt = efd - ifd and T''d0 dpsi/dt = E'q - psi
- (X'd - Xl) id; the voltage behind X'' is the subtransient flux, of which E'q and psi have shares
(Sauer, Pai: Power System Dynamics and Stability, 3.3 to 3.6; PSS/E GENROU, GENSAL).
"""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import pairwise
from typing import Literal, NamedTuple

from exfit.engine.trace import Signal, exp, log, where
from exfit.models.blocks import SHORTEST, lag, modulus, quadratic
from exfit.models.sheet import (
    LONG_TIME,
    NONE,
    POSITIVE_TIME,
    UP_TO_10,
    UP_TO_100,
    Records,
    Sheet,
    chosen,
    record,
    table,
)

Faults = Iterable[tuple[str, str]]


class Axes(NamedTuple):
    """A voltage or a current, by its components along d and q, per unit."""

    d: Signal
    q: Signal


class Source(NamedTuple):
    """A machine as its stator sees it: a voltage behind a reactance on each axis.

    ``ra`` is the resistance of the stator, which the plant knows.
    """

    voltage: Axes
    xd: Signal
    xq: Signal
    ra: Signal = 0.0


class Machine(NamedTuple):
    """A machine: its data sheet, its states and its functions.

    ``drawing`` is a text: the block diagram of its axes, then remarks. Of the states ``d_axis``
    move on open circuit too, ``q_axis`` on load only. ``source(s, p)`` is what the states alone
    determine; ``field(s, i, p)`` is ifd at the stator current i; the functions
    ``slopes(s, efd, ifd, i, p, d)`` and ``q_slopes(s, i, p, d)`` write slopes into ``d``;
    ``rest(v, i, p, x)`` writes the states that hold v and i; ``quadrature(vt, i_p, i_q, p)`` is the
    reactance behind which, at rest, the voltage lies on the q axis, where the current seen from vt
    is i_p - j i_q; ``faults(values)`` yields (symbol, text) for data that contradict each other;
    ``saturation`` is the form of the curve through S10 and S12. Where X'' saturates,
    ``saturated(flux, it, p)`` is the saturation at an air-gap flux and a current of the stator,
    which the states then have as ``SAT``. ``speed`` is where the speed counts in any dialect: in
    the torque, or in the stator's voltage too.
    """

    name: str
    title: str
    drawing: str
    sheet: Sheet
    d_axis: tuple[str, ...]
    q_axis: tuple[str, ...]
    source: Callable[..., Source]
    field: Callable[..., Signal]
    slopes: Callable[..., None]
    q_slopes: Callable[..., None]
    rest: Callable[..., None]
    quadrature: Callable[..., Signal]
    faults: Callable[[Mapping[str, float]], Faults]
    records: Records = ()
    saturation: Literal["quadratic", "exponential"] = "quadratic"
    pslf_records: Records = ()
    doubt: str = ""
    saturated: Callable[..., Signal] | None = None
    speed: Literal["", "torque", "voltage"] = ""

    def idle_saturation(self, fluxes: Signal, p: Signal) -> Signal:
        """Saturation of X'' without a current of the stator; 0 where X'' does not saturate."""
        if self.saturated is None:
            return 0.0
        fluxes.SAT = 0.0
        voltage = self.source(fluxes, p).voltage
        return self.saturated(modulus(voltage.q, voltage.d), 0.0, p)

    @property
    def states(self) -> tuple[str, ...]:
        """All states, those that move on open circuit first."""
        return (*self.d_axis, *self.q_axis)


# rows that machines share by name
ROWS = table(
    ("Tpd0", *POSITIVE_TIME, "d-axis transient time constant"),
    ("Tppd0", *LONG_TIME, "d-axis subtransient time constant"),
    ("Tppq0", "s", (0.001, 1000.0), "q-axis subtransient time constant, on load"),
    ("H", *POSITIVE_TIME, "inertia constant, on load"),
    ("D", *UP_TO_100, "damping, on load"),
    ("Xd", "pu", (0.01, 10.0), "d-axis synchronous reactance"),
    ("Xq", "pu", (0.01, 10.0), "q-axis synchronous reactance, on load"),
    ("Xpd", "pu", (0.001, 10.0), "d-axis transient reactance"),
    ("Xppd", "pu", (0.001, 10.0), "subtransient reactance"),
    ("Xl", *UP_TO_10, "leakage reactance"),
    ("S10", *UP_TO_100, "saturation at 1.0 pu"),
    ("S12", *UP_TO_100, "saturation at 1.2 pu"),
)
of_machine = partial(chosen, ROWS)


def descending(values: Mapping[str, float], *symbols: str) -> Faults:
    """Yield a fault for each value that does not exceed the next one of the row."""
    for larger, smaller in pairwise(symbols):
        if values[larger] <= values[smaller]:
            yield larger, f"{values[larger]:g} is not above {smaller} = {values[smaller]:g}"


def not_rising(values: Mapping[str, float], *symbols: str) -> Faults:
    """Yield a fault for each value that is below the next one of the row; they may be equal."""
    for larger, smaller in pairwise(symbols):
        if values[larger] < values[smaller]:
            yield larger, f"{values[larger]:g} is below {smaller} = {values[smaller]:g}"


def d_axis_order(values: Mapping[str, float]) -> Faults:
    """Find contradictions on a d axis with a damper.

    X'd = X''d is a damper that is not seen: its time constant may be anything, such as 999.
    """
    yield from descending(values, "Xd", "Xpd")
    yield from descending(values, "Xpd", "Xl")
    if values["Xpd"] > values["Xppd"]:
        yield from descending(values, "Tpd0", "Tppd0")


def unusual_reactances(values: Mapping[str, float]) -> Faults:
    """Yield (symbol, text) for reactances that the equations bear and no machine has.

    Planners' files hold such data, estimated or rounded.
    """
    rows = [symbol for symbol in ("Xpd", "Xppd", "Xl") if symbol in values]
    yield from not_rising(values, *rows)


def saturation_order(values: Mapping[str, float]) -> Faults:
    """Yield a fault where the saturation at 1.2 pu is not above that at 1.0 pu."""
    s10, s12 = values["S10"], values["S12"]
    if s12 <= s10 and (s10, s12) != (0.0, 0.0):
        yield "S12", f"{s12:g} at 1.2 pu is not above S10 = {s10:g} at 1.0 pu"


def power_order(values: Mapping[str, float]) -> Faults:
    """Yield a fault where no power of the flux has the saturation at both points."""
    yield from saturation_order(values)
    if values["S10"] == 0.0 < values["S12"]:
        yield "S10", "0 lies on no exponential saturation curve; give both as 0, or neither"


# how PSLF names them; its armature resistance is the network's Ra, its compensation nothing here
PSLF_NAMES = {
    **{"Tpd0": "tpdo", "Tppd0": "tppdo", "Tpq0": "tpqo", "Tppq0": "tppqo"},
    **{
        "Xd": "ld",
        "Xq": "lq",
        "Xpd": "lpd",
        "Xpq": "lpq",
        "Xppd": "lppd",
        "Xppq": "lppq",
        "Xl": "ll",
    },
    **{"S10": "s1", "S12": "s12"},
}


def pslf_record(
    name: str,
    cons: str,
    behind: str = "",
    held: Mapping[str, float] = NONE,
    icons: Mapping[str, int] = NONE,
    doubt: str = "",
) -> Records:
    """Return PSLF's record of a machine: what it has more is taken as none."""
    return record(
        name,
        f"{cons} RA RCOMP XCOMP ACCEL {behind}",
        absent={"RCOMP": 0.0, "XCOMP": 0.0},
        ignored="RA ACCEL",
        spelled=PSLF_NAMES,
        held=held,
        icons=icons,
        doubt=doubt,
    )


D_AXIS = ("EQP", "PSID")
D_AXIS_DRAWING = """\
efd ─►(+)─►[   1   ]─┬─ EQP ─┬──────────────────►[Xppd - Xl]──►(+)─►(+)─► vq
      -▲   [ sTpd0 ] │       │                   [Xpd - Xl ]    ▲   -▲
       │             │       └►(+)─►[    1     ]─┬►[Xpd - Xppd]─┘    │
       │             │         -▲   [1 + sTppd0] │ [ Xpd - Xl ]   Xppd id
       └─── ifd ◄────┘          │                │
             ▲           (Xpd - Xl) id           │
             └──────────── PSID ─────────────────┘
"""
FIELD_CURRENT = """\
ifd = EQP + (Xd - Xpd) (id + k (EQP - PSID - (Xpd - Xl) id)) and saturation,
with k = (Xpd - Xppd) / (Xpd - Xl)^2."""


def damper_flux(s: Signal, p: Signal) -> Signal:
    """Return psi; on open circuit it is E'q where T''d0 is zero."""
    return where(p.Tppd0 < SHORTEST, s.EQP, s.PSID)


def subtransient_flux(s: Signal, p: Signal) -> Signal:
    """Return the flux along d, which is the voltage along q behind X''."""
    share = (p.Xppd - p.Xl) / (p.Xpd - p.Xl)
    return share * s.EQP + (1.0 - share) * damper_flux(s, p)


def unsaturated_field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current that holds the fluxes of a machine without saturation."""
    inner = p.Xpd - p.Xl
    coupling = (p.Xpd - p.Xppd) / (inner * inner)
    return s.EQP + (p.Xd - p.Xpd) * (i.d + coupling * (s.EQP - damper_flux(s, p) - inner * i.d))


def d_slopes(s: Signal, efd: Signal, ifd: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """Write the slopes of field and damper."""
    d.EQP = (efd - ifd) / p.Tpd0
    _, d.PSID = lag(s.EQP - (p.Xpd - p.Xl) * i.d, s.PSID, 1.0, p.Tppd0)


def d_rest(v: Axes, i: Axes, p: Signal, x: Signal) -> None:
    """Write the fluxes of field and damper that hold a voltage at a current."""
    x.EQP = v.q + p.Xpd * i.d
    x.PSID = x.EQP - (p.Xpd - p.Xl) * i.d


def curve(flux: Signal, p: Signal) -> Signal:
    """Compute the field current of saturation: quadratic through both points."""
    return quadratic(flux, 1.0, p.S10, 1.2, p.S12).vx


def factor(flux: Signal, p: Signal) -> Signal:
    """Compute the saturation by which inductances are divided: quadratic, over the flux."""
    return curve(flux, p) / flux


def power_curve(flux: Signal, p: Signal) -> Signal:
    """Compute the field current of saturation: flux times a power of it (GENROE)."""
    none = p.S10 <= 0.0
    base = where(none, 1.0, p.S10)
    exponent = log(where(none, 1.0, p.S12) / base) / log(1.2)
    return where(none, 0.0, flux * p.S10 * exp(exponent * log(flux)))


def along_axes(form: Signal, flux: Axes, p: Signal) -> Axes:
    """Compute the part of the saturated air-gap flux on both axes.

    ``flux`` is the voltage behind X''. The q axis saturates less, as its reactance is smaller.
    """
    size = modulus(flux.q, flux.d)
    if size is flux.q:  # open circuit
        return Axes(0.0, form(size, p))
    factor = form(size, p) / size
    return Axes(factor * flux.d * (p.Xq - p.Xl) / (p.Xd - p.Xl), factor * flux.q)


def quadrature(form: Signal, vt: Signal, i_p: Signal, i_q: Signal, p: Signal) -> Signal:
    """Return the reactance behind which the voltage lies on the q axis of a saturated machine."""
    flux = modulus(vt + p.Xppd * i_q, p.Xppd * i_p)
    saturated = 1.0 + form(flux, p) / flux * (p.Xq - p.Xl) / (p.Xd - p.Xl)
    return (p.Xq - p.Xppd) / saturated + p.Xppd


def unsaturated_quadrature(vt: Signal, i_p: Signal, i_q: Signal, p: Signal) -> Signal:
    """Give the reactance of a q axis that does not saturate: Xq."""
    return p.Xq
