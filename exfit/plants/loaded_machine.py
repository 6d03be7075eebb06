"""A machine on load: at rest, behind an impedance to a voltage, and with a breaker that opens.

The resistance Ra of its stator is one of the network to the equations of the machine: they have the
voltage behind it. What leaves the terminals is less by its losses, which the turbine gives.

A stator whose breaker has opened has no current, and its voltage follows the speed. On load the
equations neglect speed in the stator's voltages, as PSS/E does. From rest at rated speed nothing is
lost by that, as the source keeps the speed; and when the breaker opens the speed is still 1, so
that it starts to count without a jump: then vt = speed times flux, per unit. (After a swing the
speed may be off by a thousandth there, and vt jumps by as much.)
"""

from collections.abc import Callable
from math import pi
from typing import NamedTuple

from exfit.engine.system import Signals
from exfit.engine.trace import Signal, cos, is_zero, sin, sqrt, where
from exfit.models.blocks import modulus
from exfit.models.machines import Axes, Machine, Source
from exfit.plants import BREAKER, SPEED
from exfit.plants.parts import Names

ROUNDS = 3  # to a saturation: each leaves a thousandth of the error
NO_STEP, NO_CURRENT = 1e-14, 1e-24  # squares that rounding does not tell from none
NEWTON_STEPS = 4  # to an angle: each cubes the error, which is 0.33 at first
HALF_OPEN = 0.5  # of a breaker between closed, 0, and open, 1


class Flow(NamedTuple):
    """The terminals at the start, vt as the real axis: current i_p - j i_q, source ex + j ey."""

    i_p: Signal
    i_q: Signal
    ex: Signal
    ey: Signal


class Stator(NamedTuple):
    """A machine's terminals by the axes of its rotor, which is turned by delta."""

    v: Axes
    i: Axes
    delta: Signal


def behind_resistance(vt: Signal, at: Flow, Ra: Signal) -> tuple[Signal, Flow]:
    """Return the voltage behind the stator's resistance, and the flow with it as the real axis."""
    x, y = vt + Ra * at.i_p, -Ra * at.i_q
    size = modulus(x, y)
    c, s = x / size, y / size
    i_p, i_q = c * at.i_p - s * at.i_q, c * at.i_q + s * at.i_p
    return size, Flow(i_p, i_q, c * at.ex + s * at.ey, c * at.ey - s * at.ex)


def behind(vt: Signal, p: Signal, q: Signal, R: Signal, X: Signal) -> Flow:
    """Return the terminals at vt, p and q, and the source that holds them behind R + jX."""
    i_p, i_q = p / vt, q / vt
    return Flow(i_p, i_q, vt - R * i_p - X * i_q, R * i_q - X * i_p)


def rotor_frame(vt: Signal, at: Flow, machine: Machine, p: Names) -> Stator:
    """Return the terminals by the axes of the rotor: q lies along vt + jXq it."""
    xq = machine.quadrature(vt, at.i_p, at.i_q, p)
    x, y = vt + xq * at.i_q, xq * at.i_p
    size = modulus(x, y)
    c, s = x / size, y / size
    return Stator(
        v=Axes(vt * s, vt * c),
        i=Axes(at.i_p * s + at.i_q * c, at.i_p * c - at.i_q * s),
        delta=angle(c * at.ex + s * at.ey, s * at.ex - c * at.ey),
    )


def angle(x: Signal, y: Signal) -> Signal:
    """Return the angle of the point (x, y), in radians between -pi and pi; not for x = y = 0."""
    size = sqrt(x * x + y * y)
    radians = where(y < 0.0, -pi / 2.0, pi / 2.0) * (1.0 - x / size)
    for _ in range(NEWTON_STEPS):
        radians = radians + (y * cos(radians) - x * sin(radians)) / size
    return radians


class LoadedMachine(NamedTuple):
    """A machine at rest on load: its terminals, the states that hold them, its field current."""

    stator: Stator
    fluxes: Names
    ifd: Signal


def loaded_at_rest(
    vt: Signal, at: Flow, machine: Machine, p: Names, Ra: Signal = 0.0
) -> LoadedMachine:
    """Rest of the machine that holds vt and a current; efd is then its field current."""
    stator, fluxes = rotor_frame(*behind_resistance(vt, at, Ra), machine, p), Names()
    machine.rest(stator.v, stator.i, p, fluxes)
    ifd = machine.field(fluxes, stator.i, p)
    return LoadedMachine(stator._replace(v=terminals(stator.v, stator.i, Ra)), fluxes, ifd)


def terminals(v: Axes, i: Axes, Ra: Signal) -> Axes:
    """Return the voltage of the terminals from the one behind the stator's resistance."""
    return Axes(v.d - Ra * i.d, v.q - Ra * i.q)


def losses(i: Axes, Ra: Signal) -> Signal:
    """Return the losses in the stator's resistance."""
    return Ra * (i.d * i.d + i.q * i.q)


def current(at: Source, E: Signal, R: Signal, X: Signal, delta: Signal) -> Axes:
    """Current of a machine into E behind R + jX."""
    drop_d, drop_q = at.voltage.d - E * sin(delta), at.voltage.q - E * cos(delta)
    xd, xq, R = at.xd + X, at.xq + X, at.ra + R
    scale = 1.0 / (R * R + xd * xq)
    return Axes((R * drop_d + xq * drop_q) * scale, (R * drop_q - xd * drop_d) * scale)


def voltage(at: Source, i: Axes, factor: Signal = 1.0) -> Axes:
    """Return the voltage of a machine at a current, times a factor of its speed."""
    d, q = at.voltage.d + at.xq * i.q, at.voltage.q - at.xd * i.d
    return terminals(Axes(factor * d, factor * q), i, at.ra)


def compensated(v: Axes, i: Axes, n: Names) -> Signal:
    """Return VC1 = |vt + (Rc + jXc) it| (IEEE Std 421.5-2005, 4): a positive Xc is a droop."""
    return modulus(v.d + n.Rc * i.d - n.Xc * i.q, v.q + n.Rc * i.q + n.Xc * i.d)


def compensated_angle(v: Axes, i: Axes, X: Signal) -> Signal:
    """Return the angle by which vt + jX it is ahead of the rotor's q axis, rad."""
    return angle(v.q + X * i.d, X * i.q - v.d)


def connected(
    machine: Machine,
    source: Callable[[], Source],
    drives: Callable[[Source], Axes],
    fluxes: Names,
    p: Names,
    speed: Signal = 1.0,
) -> tuple[Source, Axes]:
    """Return a machine's source and the current that it ``drives``.

    Where X'' saturates, by the flux and the current that it is to give, its saturation is found in
    rounds with a slope that the first two show, and added to the ``fluxes``.
    """
    if machine.saturated is None:
        at = source()
        return at, drives(at)
    saturated = machine.saturated

    def following(saturation: Signal) -> tuple[Signal, Source, Axes]:
        fluxes.SAT = saturation
        at = source()
        i = drives(at)
        gap_d, gap_q = at.voltage.d + (at.xq - p.Xl) * i.q, at.voltage.q - (at.xd - p.Xl) * i.d
        square = i.d * i.d + i.q * i.q
        it = 0.0 if is_zero(square) else sqrt(square + NO_CURRENT)
        return saturated(modulus(gap_q, gap_d) / speed, it, p), at, i

    first = machine.idle_saturation(fluxes, p)
    second, _, _ = following(first)
    third, _, _ = following(second)
    step = second - first
    slope = (third - second) * step / (step * step + NO_STEP)
    now = third
    for _ in range(ROUNDS):
        found, _, _ = following(now)
        now = now + (found - now) / (1.0 - slope)
    _, at, i = following(now)
    return at, i


class Terminals(NamedTuple):
    """A unit's terminals at one instant: voltage and current by the axes of its rotor.

    ``fluxes`` are the machine's states, ``dw`` the speed less 1 that is heard and shown.
    """

    fluxes: Names
    v: Axes
    i: Axes
    dw: Signal

    @property
    def vt(self) -> Signal:
        """The terminal voltage."""
        return modulus(self.v.d, self.v.q)

    @property
    def p(self) -> Signal:
        """The active power."""
        return self.v.d * self.i.d + self.v.q * self.i.q

    @property
    def q(self) -> Signal:
        """The reactive power."""
        return self.v.q * self.i.d - self.v.d * self.i.q


class MachineBreaker(NamedTuple):
    """A machine with its breaker at one instant: ``open`` says whether it is.

    ``dw`` is its speed less 1, ``factor`` what the stator's voltages have of the speed.
    """

    open: Signal
    dw: Signal
    factor: Signal

    def until_open(self, closed: Signal) -> Signal:
        """Keep a value until the breaker that is ``closed`` opens, then zero."""
        return where(self.open, 0.0, closed)

    def once_open(self, slope: Signal) -> Signal:
        """Take zero until the breaker opens, then the value."""
        return where(self.open, slope, 0.0)

    def current(self, closed: Axes) -> Axes:
        """Return the current, which is that with the breaker ``closed`` until it opens."""
        return Axes(self.until_open(closed.d), self.until_open(closed.q))


def breaker_of(u: Signals, dw: Signal) -> MachineBreaker:
    """Return the state of a breaker; ``dw`` is the simulated speed less 1.

    A recorded speed, where there is one, is in place of the simulated one from the opening on.
    """
    opened = u[BREAKER] > HALF_OPEN
    deviation = where(opened, u[SPEED], dw) if SPEED in u else dw
    return MachineBreaker(opened, deviation, where(opened, 1.0 + deviation, 1.0))
