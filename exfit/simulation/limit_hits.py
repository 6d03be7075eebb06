"""Which limits a response has met, for how long, and how near it came to the others."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.trace import evaluate
from exfit.simulation.limits import EquationLimit, at_rest, equation_limits, traced
from exfit.simulation.simulator import Run, Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]

ROUNDING = 1e-9  # of a limit: a state put back on it stands that near, one that passes by does not
POINTS_AT_ONCE = 16384  # of a run: the values of a whole graph along them take 50 MB
FAR = 100.0  # times what a signal moves: a limit beyond that is a number that stands for none


class LimitHit(NamedTuple):
    """A limit that a response has met.

    ``limit`` is the parameter that sets it, "0" for a state that cannot become negative;
    ``signal`` the state that was held or cut, "" where it was no state; ``value`` the limit when
    it was first met (pu, of the signal: VFEMAX limits VE where VFE reaches it); ``seconds`` how
    long in all, and which ``share`` of the test that is; ``first`` when (s).
    """

    limit: str
    signal: str
    value: float
    seconds: float
    first: float
    share: float


class Nearest(NamedTuple):
    """How near a response came to a limit that it did not meet.

    ``percent`` is the smallest distance, of the range between the floor and the ceiling; ``at`` is
    when (s), ``value`` the limit then.
    """

    limit: str
    signal: str
    value: float
    percent: float
    at: float


class Followed(NamedTuple):
    """A limiter along a run: its value and its bound (n,), and where it is held."""

    limiter: EquationLimit
    value: Array
    bound: Array
    held: NDArray[np.bool_]


def limits_hit(simulator: Simulator, values: Values) -> tuple[LimitHit, ...]:
    """Return the limits that the response to these values meets, in the order of their instants.

    A state is at its non-windup limit while it stands on it, within rounding; any other value
    while it wants to be beyond. Found at every point of the simulation's grid, whose step is how
    exactly the times are known. ``values`` are the parameters of the system; per unit.

    Raises SimulationError where the start is no rest.
    """
    run = simulator.run(values)
    found = [_hit(same, run, simulator.delay) for same in _alike(_followed(simulator, values, run))]
    return tuple(sorted((hit for hit in found if hit is not None), key=lambda hit: hit.first))


def nearest(simulator: Simulator, values: Values) -> tuple[Nearest, ...]:
    """Return how near the response came to each limit that it did not meet, the nearest first.

    Left out are limits on one side only, and those that are a hundred times further away than the
    signal ever moved, as 9999 is where there is none. Raises SimulationError where the start is no
    rest.
    """
    run = simulator.run(values)
    followed = _followed(simulator, values, run)
    met = {_key(one.limiter) for one in followed if np.any(one.held)}
    found: dict[tuple[str, str, float], Nearest] = {}
    for one, other in _ranges(followed):
        distance = one.limiter.sign * (one.bound - one.value)
        at = int(np.argmin(distance))
        width = abs(one.bound[at] - other.bound[at])
        moved = float(np.ptp(one.value))
        if _key(one.limiter) not in met and 0.0 < distance[at] <= FAR * moved and width > 0.0:
            limit, signal = one.limiter.limit, one.limiter.signal
            share = 100.0 * float(distance[at]) / float(width)
            near = Nearest(
                limit, signal, float(one.bound[at]), share, float(run.time[at] + simulator.delay)
            )
            found.setdefault(_key(one.limiter), near)
    return tuple(sorted(found.values(), key=lambda near: near.percent))


def _followed(simulator: Simulator, values: Values, run: Run) -> list[Followed]:
    """Return every limiter of the system along a run."""
    system = simulator.system
    of, every = traced(system), equation_limits(system)
    fixed = at_rest(of, values)
    blocks: list[list[tuple[Array, Array]]] = []
    for first in range(0, len(run.time), POINTS_AT_ONCE):
        now = slice(first, first + POINTS_AT_ONCE)
        courses = [run.outputs[name] for name in system.states]
        courses += [run.inputs[name] for name in system.inputs]
        pairs = zip((*of.x, *of.u), courses, strict=True)
        targets = [node for one in every for node in (one.value, one.bound)]
        known = evaluate(targets, {**fixed, **{node: course[now] for node, course in pairs}})
        count = len(run.time[now])
        blocks.append(
            [(_along(known[one.value], count), _along(known[one.bound], count)) for one in every]
        )
    return [_follow(one, [block[k] for block in blocks]) for k, one in enumerate(every)]


def _along(value: Array | float, count: int) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (count,))


def _follow(limiter: EquationLimit, parts: Sequence[tuple[Array, Array]]) -> Followed:
    value, bound = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    beyond = limiter.sign * (value - bound)
    near = ROUNDING * np.maximum(np.abs(bound), np.abs(value))
    # a limit of zero has no size of its own
    near = np.maximum(near, ROUNDING * np.max(np.abs(value), initial=0.0))
    held = beyond >= -near if limiter.stands else beyond > near
    return Followed(limiter, value, bound, held & np.isfinite(bound))


def _key(limiter: EquationLimit) -> tuple[str, str, float]:
    return limiter.limit, limiter.signal, limiter.sign


def _alike(followed: Iterable[Followed]) -> Iterable[list[Followed]]:
    """Return the limiters together that hold one signal at one limit: a drawing has it once."""
    together: dict[tuple[str, str, float], list[Followed]] = {}
    for one in followed:
        together.setdefault(_key(one.limiter), []).append(one)
    return together.values()


def _hit(same: Sequence[Followed], run: Run, delay: float) -> LimitHit | None:
    held = np.any([one.held for one in same], axis=0)
    if not np.any(held):
        return None
    first = int(np.argmax(held))
    one = next(one for one in same if one.held[first])
    seconds = float(np.trapezoid(held.astype(np.float64), run.time))
    return LimitHit(
        limit=one.limiter.limit,
        signal=one.limiter.signal,
        value=float(one.bound[first]),
        seconds=seconds,
        first=float(run.time[first]) + delay,
        share=seconds / float(run.time[-1] - run.time[0]),
    )


def _ranges(followed: Sequence[Followed]) -> Iterator[tuple[Followed, Followed]]:
    """Yield each limiter with the one on the other side of the same value."""
    sides = {(one.limiter.value, one.limiter.sign): one for one in followed}
    for (value, sign), one in sides.items():
        other = sides.get((value, -sign))
        if other is not None:
            yield one, other
