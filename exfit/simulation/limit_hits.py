"""Which limits a response has met, for how long, and how near it came to the others."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.system import System
from exfit.engine.trace import evaluate
from exfit.simulation.limits import (
    EquationLimit,
    at_rest,
    equation_limits,
    limiter_outputs,
    traced,
)
from exfit.simulation.simulator import Run, Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]

LIMIT_ROUNDING = (
    1e-9  # of a limit: a state put back on it is that near, one that passes by does not
)
POINTS_AT_ONCE = 16384  # of a run: the values of a whole graph along them take 50 MB
FARTHEST_LIMIT = 100.0  # times what a signal moves: a limit beyond that stands for no limit


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


class LimiterAction(NamedTuple):
    """A limiter of excitation that acted, oel.OEL2C, and from when to when each time (s)."""

    name: str
    spans: tuple[tuple[float, float], ...]

    @property
    def sentence(self) -> str:
        """Word the time in which it acted."""
        first, last = self.spans[0][0], self.spans[-1][1]
        times = "" if len(self.spans) == 1 else f", {len(self.spans)} times"
        return f"{self.name} acts from {first:.4g} s to {last:.4g} s{times}"


class Nearest(NamedTuple):
    """Distance of a response from a limit that it did not meet.

    ``percent`` is the smallest distance, of the range between the floor and the ceiling; ``at`` is
    when (s), ``value`` the limit then.
    """

    limit: str
    signal: str
    value: float
    percent: float
    at: float


class Extreme(NamedTuple):
    """Largest move of a signal towards a limit: its ``share`` of the way from zero to it."""

    limit: str
    share: float


class Followed(NamedTuple):
    """A limiter along a run: its value and its bound (n,), and where it is held."""

    limiter: EquationLimit
    value: Array
    bound: Array
    held: NDArray[np.bool_]


def limits_hit(simulator: Simulator, values: Values) -> tuple[LimitHit, ...]:
    """Find the limits that the response to these values meets, in the order of their instants.

    A state is at its non-windup limit while it is on it, within rounding; any other value
    while it would be beyond. Found at every point of the simulation's grid, whose step is how
    exactly the times are known. ``values`` are the parameters of the system; per unit.

    Raises SimulationError where the start is no rest.
    """
    run = simulator.run(values)
    hits = [
        _hit(limiters, run, simulator.delay)
        for limiters in _alike(_followed(simulator, values, run))
    ]
    return tuple(sorted((hit for hit in hits if hit is not None), key=lambda hit: hit.first))


def limiter_actions(simulator: Simulator, values: Values) -> tuple[LimiterAction, ...]:
    """Return the limiters of excitation that act in the response to these values, and when.

    Raises SimulationError where the start is no rest.
    """
    names = limiter_outputs(simulator.system)
    if not names:
        return ()
    run = simulator.run(values)
    time = run.time + simulator.delay
    actions = []
    followed = _followed(simulator, values, run)
    for name in names:
        held = np.any([side.held for side in followed if side.limiter.limit == name], axis=0)
        if np.any(held):
            actions.append(LimiterAction(name, tuple(_spans(held, time))))
    return tuple(actions)


def _spans(held: NDArray[np.bool_], time: Array) -> Iterator[tuple[float, float]]:
    """Yield start and end of each stretch in which a condition holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]]).astype(int)))
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        yield float(time[first]), float(time[after - 1])


def limits_at_rest(system: System, values: Values) -> tuple[str, ...]:
    """Find limits on which a system rests, so that even a small deviation may meet them.

    ``values`` are the parameters of the system.
    """
    limiters = equation_limits(system)
    targets = [node for limiter in limiters for node in (limiter.value, limiter.bound)]
    rest = evaluate(targets, at_rest(traced(system), values))
    names = []
    for limiter in limiters:
        value, bound = float(rest[limiter.value]), float(rest[limiter.bound])
        near = LIMIT_ROUNDING * max(abs(value), abs(bound))
        if isfinite(bound) and abs(value - bound) <= near:
            names.append(limiter.limit)
    return tuple(dict.fromkeys(names))


def nearest(simulator: Simulator, values: Values) -> tuple[Nearest, ...]:
    """Distance of the response from each limit that it did not meet, the nearest first.

    Left out are limits on one side only, and those that are a hundred times further away than the
    signal ever moved, as 9999 is where there is none. Raises SimulationError where the start is no
    rest.
    """
    run = simulator.run(values)
    followed = _followed(simulator, values, run)
    met = {_key(limit_side.limiter) for limit_side in followed if np.any(limit_side.held)}
    by_key: dict[tuple[str, str, float], Nearest] = {}
    for limit_side, other_side in _ranges(followed):
        distance = limit_side.limiter.sign * (limit_side.bound - limit_side.value)
        at = int(np.argmin(distance))
        width = abs(limit_side.bound[at] - other_side.bound[at])
        most = FARTHEST_LIMIT * float(np.ptp(limit_side.value))
        if _key(limit_side.limiter) not in met and 0.0 < distance[at] <= most and width > 0.0:
            limit, signal = limit_side.limiter.limit, limit_side.limiter.signal
            share = 100.0 * float(distance[at]) / float(width)
            near = Nearest(
                limit,
                signal,
                float(limit_side.bound[at]),
                share,
                float(run.time[at] + simulator.delay),
            )
            by_key.setdefault(_key(limit_side.limiter), near)
    return tuple(sorted(by_key.values(), key=lambda near: near.percent))


def extremes(simulator: Simulator, values: Values) -> tuple[Extreme, ...]:
    """Largest move of the response towards each of its limits, 1 or more where it met them.

    Left out is what was always on the other side of zero. Raises SimulationError where the start
    is no rest.
    """
    run = simulator.run(values)
    reached = []
    for followed in _followed(simulator, values, run):
        sides = followed.limiter.sign * followed.bound > 0.0
        if np.any(sides):
            share = float(np.max(followed.value[sides] / followed.bound[sides]))
            met = bool(np.any(followed.held))
            if share > 0.0 and np.isfinite(share):
                reached.append(Extreme(followed.limiter.limit, max(share, 1.0) if met else share))
    return tuple(reached)


def _followed(simulator: Simulator, values: Values, run: Run) -> list[Followed]:
    """Return every limiter of the system along a run."""
    system = simulator.system
    trace_, limiters = traced(system), equation_limits(system)
    fixed = at_rest(trace_, values)
    blocks: list[list[tuple[Array, Array]]] = []
    for first in range(0, len(run.time), POINTS_AT_ONCE):
        now = slice(first, first + POINTS_AT_ONCE)
        signals = [run.outputs[name] for name in system.states]
        signals += [run.inputs[name] for name in system.inputs]
        pairs = zip((*trace_.x, *trace_.u), signals, strict=True)
        targets = [node for limiter in limiters for node in (limiter.value, limiter.bound)]
        evaluated = evaluate(targets, {**fixed, **{node: samples[now] for node, samples in pairs}})
        count = len(run.time[now])
        blocks.append(
            [
                (_along(evaluated[limiter.value], count), _along(evaluated[limiter.bound], count))
                for limiter in limiters
            ]
        )
    return [_follow(limiter, [block[k] for block in blocks]) for k, limiter in enumerate(limiters)]


def _along(value: Array | float, count: int) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (count,))


def _follow(limiter: EquationLimit, parts: Sequence[tuple[Array, Array]]) -> Followed:
    value, bound = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    beyond = limiter.sign * (value - bound)
    near = LIMIT_ROUNDING * np.maximum(np.abs(bound), np.abs(value))
    # a limit of zero has no size of its own
    near = np.maximum(near, LIMIT_ROUNDING * np.max(np.abs(value), initial=0.0))
    held = beyond >= -near if limiter.clamped else beyond > near
    return Followed(limiter, value, bound, held & np.isfinite(bound))


def _key(limiter: EquationLimit) -> tuple[str, str, float]:
    return limiter.limit, limiter.signal, limiter.sign


def _alike(followed: Iterable[Followed]) -> Iterable[list[Followed]]:
    """Return the limiters together that hold one signal at one limit: a drawing has it once."""
    together: dict[tuple[str, str, float], list[Followed]] = {}
    for limit in followed:
        together.setdefault(_key(limit.limiter), []).append(limit)
    return together.values()


def _hit(limits: Sequence[Followed], run: Run, delay: float) -> LimitHit | None:
    held = np.any([reached.held for reached in limits], axis=0)
    if not np.any(held):
        return None
    first = int(np.argmax(held))
    reached = next(reached for reached in limits if reached.held[first])
    seconds = float(np.trapezoid(held.astype(np.float64), run.time))
    return LimitHit(
        limit=reached.limiter.limit,
        signal=reached.limiter.signal,
        value=float(reached.bound[first]),
        seconds=seconds,
        first=float(run.time[first]) + delay,
        share=seconds / float(run.time[-1] - run.time[0]),
    )


def _ranges(followed: Sequence[Followed]) -> Iterator[tuple[Followed, Followed]]:
    """Yield each limiter with the one on the other side of the same value."""
    sides = {(side.limiter.value, side.limiter.sign): side for side in followed}
    for (value, sign), side in sides.items():
        opposite = sides.get((value, -sign))
        if opposite is not None:
            yield side, opposite
