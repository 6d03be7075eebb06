"""A machine at rest on load, and its stator behind an impedance to a voltage."""

from typing import NamedTuple

from exfit.engine.trace import Signal, cos, sin
from exfit.models.machines import Axes, Machine, Source
from exfit.models.phasors import angle, modulus
from exfit.plants.parts import Names


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


class LoadedMachine(NamedTuple):
    """A machine at rest on load: its terminals, the states that hold them, its field current."""

    stator: Stator
    fluxes: Names
    ifd: Signal


def loaded_at_rest(vt: Signal, at: Flow, machine: Machine, p: Names) -> LoadedMachine:
    """Rest of the machine that holds vt and a current; efd is then its field current."""
    stator, fluxes = rotor_frame(vt, at, machine, p), Names()
    machine.rest(stator.v, stator.i, p, fluxes)
    return LoadedMachine(stator, fluxes, machine.field(fluxes, stator.i, p))


def current(at: Source, E: Signal, R: Signal, X: Signal, delta: Signal) -> Axes:
    """Current of a machine into E behind R + jX."""
    drop_d, drop_q = at.voltage.d - E * sin(delta), at.voltage.q - E * cos(delta)
    xd, xq = at.xd + X, at.xq + X
    scale = 1.0 / (R * R + xd * xq)
    return Axes((R * drop_d + xq * drop_q) * scale, (R * drop_q - xd * drop_d) * scale)


def compensated(v: Axes, i: Axes, n: Names) -> Signal:
    """Return VC1 = |vt + (Rc + jXc) it| (IEEE Std 421.5-2005, 4): a positive Xc is a droop."""
    return modulus(v.d + n.Rc * i.d - n.Xc * i.q, v.q + n.Rc * i.q + n.Xc * i.d)
