"""What a system does near its state of rest: its poles, and its frequency responses with margins.

Everything follows from the exact linearisation, the derivatives of the equations at rest. A limit
that is reached there has no gain.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from math import inf, log10, pi, sqrt
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.system import System, Trace, trace
from exfit.engine.tangents import Tangents, differentiate
from exfit.engine.trace import Node, evaluate
from exfit.errors import SimulationError
from exfit.plants import MEASURED
from exfit.simulation.limits import at_rest, limits_passed
from exfit.simulation.substeps import REST_TOLERANCE, STATE_ROUNDING, spectral_radii
from exfit.util.arrays import Array, distinct

ComplexArray = NDArray[np.complex128]
Values = Mapping[str, float]

MOST_STATES = 3  # named with a pole
TAKES_PART = 0.2  # of the participation of the state that takes part most
NO_POLE = 1e-12  # of the fastest rate: an eigenvalue of zero, but for rounding
SPLIT = 1e-6  # of a pole: rounding moves the two of a double one apart by its square root
POINTS = 350  # of a frequency response, beside those around its peaks
PEAK_POINTS = np.linspace(-3.0, 3.0, 25)  # half widths of a peak: where its points lie
LIGHTLY = 0.5  # damping ratio: a mode below it has a peak that the other points would cut off
DECADE = 10.0  # beyond the slowest and the fastest pole
FINER = 2  # times as many points to find crossovers between
BETWEEN = 33  # points in a gap that is searched for its crossover
ROUNDS = 6  # of that search, each 32 times finer: to rounding
HALF_POWER = 1.0 / sqrt(2.0)  # -3 dB


class Pole(NamedTuple):
    """A mode: of a pair of conjugate poles the upper one, so ``value`` (1/s) has Im >= 0.

    ``damping`` is the ratio -Re/|value|: 1 for a real stable pole, negative for an unstable one,
    0 at the origin; ``frequency`` that of its oscillation in Hz, 0 for a real one; ``states`` the
    one to three that take part most, the first the most.
    """

    value: complex
    damping: float
    frequency: float
    states: tuple[str, ...]


class Bode(NamedTuple):
    """A frequency response: ``frequency`` (M,) in Hz, ``response`` (M,) complex, pu per pu."""

    frequency: Array
    response: ComplexArray


class Margins(NamedTuple):
    """Distance of the voltage loop from instability; None where the loop gain has no crossover.

    ``gain`` (dB) is by how much the loop gain may rise, or, negative, must not fall; ``phase``
    (deg) how much the loop may lag more, or, negative, less. Of several crossovers it is that with
    the smallest margin. ``gain_at`` and ``phase_at`` are its frequencies (Hz): where the phase is
    -180 degrees, and where the gain is 1.
    """

    gain: float | None
    phase: float | None
    gain_at: float | None
    phase_at: float | None


class SmallSignal(NamedTuple):
    """A system near its state of rest.

    ``closed`` is the response of ``path[1]`` to ``path[0]``: of vt to vref, of efd where the
    voltage is played back; ``open`` the gain of the voltage loop, broken where the exciter
    measures the voltage, positive at low frequency; with ``margins`` it is None where there is no
    such loop. ``bandwidth`` (Hz) is where ``closed`` first falls 3 dB below its value at rest, None
    where it does not; ``peak`` its largest gain (dB).
    """

    poles: tuple[Pole, ...]
    closed: Bode
    open: Bode | None
    margins: Margins | None
    bandwidth: float | None
    peak: Annotated[float, -inf]
    path: tuple[str, str]


class StateSpace(NamedTuple):
    """A linear system dx/dt = A x + b u, y = c x + d u with one input and one output."""

    A: Array
    b: Array
    c: Array
    d: float

    def response(self, s: ComplexArray) -> ComplexArray:
        """Return the transfer function at complex frequencies s (M,) in 1/s."""
        states = len(self.A)
        shifted = s[:, None, None] * np.eye(states) - self.A
        given = np.broadcast_to(self.b.astype(np.complex128)[:, None], (len(s), states, 1))
        response = np.linalg.solve(shifted, given)[:, :, 0] @ self.c + self.d
        return np.asarray(response, dtype=np.complex128)

    def at(self, frequency: Array) -> ComplexArray:
        """Return the frequency response at frequencies (M,) in Hz."""
        return self.response(np.asarray(2j * pi * frequency, dtype=np.complex128))

    def bode(self, frequency: Array) -> Bode:
        """Return it with the frequencies."""
        return Bode(frequency, self.at(frequency))

    def broken(self) -> "StateSpace":
        """Return the gain of the loop that feeds y back into u, as a negative feedback has it.

        No time passes from u to y but through a state: d = 0.
        """
        return StateSpace(self.A - np.outer(self.b, self.c), self.b, -self.c, 0.0)


class LinearSystem(NamedTuple):
    """A linearisation: the Jacobian A of the moving states, and columns and rows by name."""

    states: tuple[str, ...]
    A: Array
    B: Mapping[str, Array]
    C: Mapping[str, Array]
    D: Mapping[tuple[str, str], float]

    def path(self, source: str, output: str) -> StateSpace:
        """Return the system from one input to one output."""
        return StateSpace(self.A, self.B[source], self.C[output], self.D[output, source])


def small_signal(system: System, values: Values, frequency: Array | None = None) -> SmallSignal:
    """Return poles, frequency responses and margins of a system at the state of rest of ``values``.

    ``frequency`` (M,) in Hz is where the responses are given; by default about 400 points that span
    the poles, dense around the peaks. The margins are those of Astrom and Murray, Feedback Systems
    (2008), 9.3, at crossovers refined to rounding; which states take part in a pole follows from
    the participation factors of Perez-Arriaga, Verghese and Schweppe (1982).

    Raises SimulationError where the values have no state of rest.
    """
    linear = linearised(system, values)
    source = "vref" if "vref" in system.inputs else system.inputs[0]
    output = "efd" if "vt" in system.inputs else "vt"
    forward = linear.path(source, output)
    loop = linear.path(MEASURED, MEASURED).broken() if MEASURED in linear.C else None
    poles = poles_of(linear)
    rates = [pole.value for pole in poles]
    if loop is not None:
        rates += list(np.linalg.eigvals(loop.A))
    dense = spanning(rates)
    frequencies = dense if frequency is None else np.asarray(frequency, dtype=np.float64)
    closed = forward.bode(frequencies)
    around_peaks = closed if frequencies is dense else forward.bode(dense)
    return SmallSignal(
        poles=poles,
        closed=closed,
        open=None if loop is None else loop.bode(frequencies),
        margins=None if loop is None else margins(loop, dense),
        bandwidth=bandwidth(forward, around_peaks),
        peak=_decibels(float(np.max(np.abs(around_peaks.response)))),
        path=(source, output),
    )


@cache
def _traced(system: System) -> tuple[System, Trace, Tangents]:
    """Return a system with the input that breaks its voltage loop, its graph and derivatives."""
    from_outside = replace(system, inputs=tuple(dict.fromkeys((*system.inputs, MEASURED))))
    try:
        traced = trace(from_outside, (*system.outputs, MEASURED))
    except KeyError:  # there is no loop
        from_outside, traced = system, trace(system, system.outputs)
    return from_outside, traced, differentiate(traced, from_outside, (), from_outside.inputs)


def linearised(system: System, values: Values) -> LinearSystem:
    """Return the exact linearisation of a system at rest, without the states of bypassed blocks.

    Raises SimulationError where the values have no state of rest.
    """
    system, traced, derived = _traced(system)
    start = at_rest(traced, values)
    seeds = np.eye(len(traced.x) + len(traced.u))
    driven: list[Node] = [node for node in (*derived.x, *derived.u) if node is not None]
    symbols = {
        **start,
        **dict.fromkeys(derived.r, np.zeros(len(seeds))),
        **dict(zip(driven, seeds, strict=True)),
    }
    derivatives = evaluate([*traced.slopes, *derived.slopes, *derived.outputs], symbols)

    def rows(nodes: Sequence[Node]) -> Array:
        return np.stack([np.broadcast_to(derivatives[node], (len(seeds),)) for node in nodes])

    slopes, count = rows(derived.slopes), len(traced.x)
    x = np.array([float(start[node]) for node in traced.x])
    moving = np.array([float(derivatives[node]) for node in traced.slopes])
    radius = float(spectral_radii(slopes[None, :, :count])[0])
    rounding = STATE_ROUNDING * float(np.max(np.abs(x), initial=0.0)) * radius
    if not (np.isfinite(rounding) and np.all(np.abs(moving) <= REST_TOLERANCE + rounding)):
        why = limits_passed(system, values) or "the values do not define one"
        raise SimulationError(f"no state of rest: {why}")
    # the state of a bypassed block, and one held at its limit, stays put
    moves = np.any(slopes != 0.0, axis=1)
    outputs = (*system.outputs, MEASURED)[: len(traced.outputs)]
    out = dict(zip(outputs, rows(derived.outputs), strict=True))
    columns = {name: count + k for k, name in enumerate(system.inputs)}
    moving_states = np.flatnonzero(moves)
    return LinearSystem(
        states=tuple(system.states[k] for k in moving_states),
        A=slopes[np.ix_(moving_states, moving_states)],
        B={name: slopes[moving_states, column] for name, column in columns.items()},
        C={name: row[moving_states] for name, row in out.items()},
        D={(y, u): float(out[y][column]) for y in out for u, column in columns.items()},
    )


def poles_of(linear: LinearSystem) -> tuple[Pole, ...]:
    """Return the modes of a linear system, the slowest first.

    A state takes part in a mode by its components in the right and the left eigenvector, the rows
    of the inverse of the right ones (Kundur 1994, section 12.2.4). Of a mode that is there twice,
    with one eigenvector, the pseudo-inverse is taken.
    """
    values, right = np.linalg.eig(linear.A)
    size = np.max(np.abs(values), initial=0.0)
    values = np.where(np.abs(values.imag) > SPLIT * np.abs(values), values, values.real + 0j)
    taking_part = np.abs(np.linalg.pinv(right).T * right)
    poles = []
    for value, own in zip(values.tolist(), taking_part.T, strict=True):
        if value.imag < 0.0:
            continue
        at = value if abs(value) > NO_POLE * size else 0j
        ranked = np.argsort(-own, kind="stable")[:MOST_STATES]
        least = TAKES_PART * own[ranked[0]]
        states = tuple(linear.states[k] for k in ranked if own[k] >= least)
        damping = -at.real / abs(at) if at else 0.0
        poles.append(Pole(at, damping, at.imag / (2.0 * pi), states))
    return tuple(sorted(poles, key=lambda pole: abs(pole.value)))


def spanning(rates: Sequence[complex], points: int = POINTS) -> Array:
    """Return frequencies (M,) in Hz that span poles (1/s), dense around those lightly damped."""
    sizes = np.abs(np.array(rates, dtype=np.complex128))
    sizes = sizes[sizes > NO_POLE * np.max(sizes, initial=0.0)]
    low, high = (np.min(sizes), np.max(sizes)) if len(sizes) else (1.0, 1.0)
    peaks = [
        rate.imag + abs(rate.real) * PEAK_POINTS
        for rate in rates
        if rate.imag > 0.0 and abs(rate.real) < LIGHTLY * abs(rate)
    ]
    every = np.concatenate([np.geomspace(low / DECADE, high * DECADE, points), *peaks])
    return distinct(every[every >= low / DECADE]) / (2.0 * pi)


def margins(loop: StateSpace, frequency: Array) -> Margins:
    """Return the smallest margins of a loop gain, all its crossovers between frequencies (Hz)."""
    places = np.linspace(0.0, len(frequency) - 1.0, FINER * (len(frequency) - 1) + 1)
    fine = np.exp(np.interp(places, np.arange(len(frequency)), np.log(frequency)))
    L = loop.at(fine)

    def at(f: float) -> complex:
        return complex(loop.at(np.array([f]))[0])

    def smallest(margins_at: Sequence[tuple[float, float]]) -> tuple[float | None, float | None]:
        return min(margins_at, key=lambda margin_at: abs(margin_at[0]), default=(None, None))

    at_phase = [f for f in _crossings(lambda z: z.imag, loop, fine, L) if at(f).real < 0.0]
    at_gain = _crossings(lambda z: np.abs(z) - 1.0, loop, fine, L)
    gain, gain_at = smallest([(-_decibels(abs(at(f))), f) for f in at_phase])
    phase, phase_at = smallest([(float(np.degrees(np.angle(-at(f)))), f) for f in at_gain])
    return Margins(gain, phase, gain_at, phase_at)


def _crossings(
    measure: Callable[[ComplexArray], Array],
    of: StateSpace,
    frequency: Array,
    response: ComplexArray,
) -> list[float]:
    """Return the frequencies (Hz) where a measure of the response changes its sign."""
    positive = measure(response) > 0.0
    crossings = []
    for k in np.flatnonzero(positive[1:] != positive[:-1]):
        low, high = frequency[k], frequency[k + 1]
        for _ in range(ROUNDS):
            inside = np.linspace(low, high, BETWEEN)
            above = measure(of.at(inside)) > 0.0
            first = int(np.argmax(above != above[0]))
            if first == 0:  # within rounding of its end
                break
            low, high = inside[first - 1], inside[first]
        crossings.append(float(0.5 * (low + high)))
    return crossings


def bandwidth(of: StateSpace, at: Bode) -> float | None:
    """Frequency (Hz) at which a response falls 3 dB below its value at rest; None without one.

    ``at`` is the response at frequencies between which it is looked for.
    """
    try:
        still = abs(float(of.d - of.c @ np.linalg.solve(of.A, of.b)))
    except np.linalg.LinAlgError:  # an integrator that nothing holds
        return None
    level = HALF_POWER * still
    crossings = _crossings(lambda z: level - np.abs(z), of, at.frequency, at.response)
    return crossings[0] if crossings and 0.0 < still < inf else None


def _decibels(gain: float) -> float:
    return 20.0 * log10(gain) if gain > 0.0 else -inf
