"""The network of a machine with a load at its far bus, or a fault at its terminals.

    terminals ── R + jX ── far bus ── Rs + jXs ── source
        │                     │
      fault                  load

A load has parts of constant power PL + jQL, of constant current IP, IQ and of constant admittance
YP, YQ, each as it is at a voltage of 1, signs as in PSS/E's load record (.raw): YQ > 0 is
capacitive. The network has no states: the voltage of the far bus follows from the sum of its
currents by Newton's rounds, which begin at the load's admittance of the start.
"""

from typing import NamedTuple

from exfit.engine.system import Signals
from exfit.engine.trace import Signal, cos, sin, sqrt, where
from exfit.models.machines import Axes, Source
from exfit.models.sheet import UP_TO_10, WITHIN_10, Sheet, sheet
from exfit.plants import OF_LOAD
from exfit.plants.loaded_machine import Flow
from exfit.plants.parts import Names

LOAD: Sheet = sheet(
    ("PL", 0.0, *WITHIN_10, "load of constant power at the far bus, active"),
    ("QL", 0.0, *WITHIN_10, "load of constant power at the far bus, reactive"),
    ("IP", 0.0, *WITHIN_10, "load of constant current at the far bus, active at 1 pu"),
    ("IQ", 0.0, *WITHIN_10, "load of constant current at the far bus, reactive at 1 pu"),
    ("YP", 0.0, *WITHIN_10, "load of constant admittance at the far bus, active at 1 pu"),
    ("YQ", 0.0, *WITHIN_10, "load of constant admittance at the far bus, capacitive at 1 pu"),
)
BEHIND_LOAD: Sheet = sheet(
    ("Rs", 0.0, *UP_TO_10, "resistance from the far bus to the source"),
    ("Xs", 0.0, *UP_TO_10, "reactance from the far bus to the source"),
)
ROUNDS = 5  # each squares the error, which is 0.1 pu at first where a fault halves vt
LAST_ROUND = 1e-5  # pu: a last step above this has no solution to go to
NO_SOLUTION = float("nan")


class Matrix(NamedTuple):
    """Coefficients of the components along d and q (columns) in those of a result (rows)."""

    dd: Signal
    dq: Signal
    qd: Signal
    qq: Signal

    def plus(self, other: "Matrix") -> "Matrix":
        """Add another one."""
        return Matrix(*(a + b for a, b in zip(self, other, strict=True)))

    def of(self, v: Axes) -> Axes:
        """Multiply a voltage or a current."""
        return Axes(self.dd * v.d + self.dq * v.q, self.qd * v.d + self.qq * v.q)

    def times(self, other: "Matrix") -> "Matrix":
        """Multiply another one."""
        left, right = self.of(Axes(other.dd, other.qd)), self.of(Axes(other.dq, other.qq))
        return Matrix(left.d, right.d, left.q, right.q)

    @property
    def inverse(self) -> "Matrix":
        """Its inverse."""
        scale = 1.0 / (self.dd * self.qq - self.dq * self.qd)
        return Matrix(scale * self.qq, -scale * self.dq, -scale * self.qd, scale * self.dd)


IDENTITY = Matrix(1.0, 0.0, 0.0, 1.0)


def complex_number(real: Signal, imaginary: Signal) -> Matrix:
    """Return an impedance R + jX, or an admittance G + jB, as it acts along d and q."""
    return Matrix(real, -imaginary, imaginary, real)


def switched(n: Names, u: Signals) -> Names:
    """Return the values of a network with the changes that inputs make to its load."""
    values = vars(n)
    changed = [name for name in OF_LOAD if name in values and name in u]
    return Names(**values | {name: values[name] + u[name] for name in changed})


def load_power(n: Names, vt: Signal) -> tuple[Signal, Signal]:
    """Return P and Q of the load at a voltage."""
    G, B = load_admittance(n, vt * vt)
    return G * vt * vt, -B * vt * vt


def load_admittance(n: Names, square: Signal) -> tuple[Signal, Signal]:
    """Return G and B of the load where the voltage of its bus has this square."""
    size = sqrt(square)
    return (
        n.PL / square + n.IP / size + n.YP,
        n.YQ - n.QL / square - n.IQ / size,
    )


def admittance_slope(n: Names, square: Signal) -> Matrix:
    """Return the derivative of the load's admittance to the square of the voltage."""
    area, half = square * square, 2.0 * square * sqrt(square)
    return complex_number(-n.PL / area - n.IP / half, n.QL / area + n.IQ / half)


def source_behind(at: Flow, n: Names) -> Flow:
    """Return the flow of a machine with the source in place of the far bus, which ``at`` has."""
    G, B = load_admittance(n, at.ex * at.ex + at.ey * at.ey)
    i_x = at.i_p - (G * at.ex - B * at.ey)
    i_y = -at.i_q - (G * at.ey + B * at.ex)
    return at._replace(
        ex=at.ex - n.Rs * i_x + n.Xs * i_y,
        ey=at.ey - n.Rs * i_y - n.Xs * i_x,
    )


class FaultedLine(NamedTuple):
    """R + jX from the terminals, and G + jB of a fault there."""

    R: Signal
    X: Signal
    G: Signal
    B: Signal


def machine_current(
    at: Source, line: FaultedLine, E: Signal, delta: Signal, load: Names | None, far: Signal
) -> Axes:
    """Return the current of a machine; not a number where the load has no solution.

    ``load`` has the rows of the load and of what is behind it, None where the source is the far
    bus itself; ``far`` is the voltage of that bus at the start.
    """
    stator, fault = Matrix(at.ra, -at.xq, at.xd, at.ra), complex_number(line.G, line.B)
    kept = IDENTITY.plus(stator.times(fault)).inverse
    inner, source = kept.of(at.voltage), Axes(E * sin(delta), E * cos(delta))
    towards = kept.times(stator).plus(complex_number(line.R, line.X)).inverse
    v = source
    if load is not None:
        beyond = complex_number(load.Rs, load.Xs).inverse
        v = far_voltage(inner, towards, source, beyond, load, far)
    i = towards.of(Axes(inner.d - v.d, inner.q - v.q))
    drop = stator.of(i)
    drawn = fault.of(kept.of(Axes(at.voltage.d - drop.d, at.voltage.q - drop.q)))
    return Axes(i.d + drawn.d, i.q + drawn.q)


def isolated_current(at: Source, n: Names, vt0: Signal) -> Axes:
    """Return the current of a machine that feeds the load alone; not a number without solution."""
    outward = Matrix(at.ra, -at.xq, at.xd, at.ra).inverse
    still = Axes(0.0, 0.0)
    v = far_voltage(at.voltage, outward, still, complex_number(0.0, 0.0), n, vt0)
    return outward.of(Axes(at.voltage.d - v.d, at.voltage.q - v.q))


def far_voltage(
    inner: Axes, towards: Matrix, source: Axes, beyond: Matrix, n: Names, far: Signal
) -> Axes:
    """Return the voltage of the load's bus between two voltages, by the admittances to them."""
    both, one, other = towards.plus(beyond), towards.of(inner), beyond.of(source)
    driven = Axes(one.d + other.d, one.q + other.q)
    v = both.plus(complex_number(*load_admittance(n, far * far))).inverse.of(driven)
    last = v
    for _ in range(ROUNDS):
        last, square = v, v.d * v.d + v.q * v.q
        moved = admittance_slope(n, square).of(v)  # by a change of the square
        slope = both.plus(complex_number(*load_admittance(n, square))).plus(
            Matrix(
                2.0 * moved.d * v.d, 2.0 * moved.d * v.q, 2.0 * moved.q * v.d, 2.0 * moved.q * v.q
            )
        )
        twice = 2.0 * square
        v = slope.inverse.of(Axes(driven.d + twice * moved.d, driven.q + twice * moved.q))
    step = Axes(v.d - last.d, v.q - last.q)
    found = step.d * step.d + step.q * step.q < LAST_ROUND * LAST_ROUND
    return Axes(where(found, v.d, NO_SOLUTION), where(found, v.q, NO_SOLUTION))
