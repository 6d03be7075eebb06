"""Long records compressed for a search: fewer errors with the same sum of squares.

Where a response is smooth, all its samples follow from a few of them. The squared errors of all
are a quadratic form of these few, and as many errors have the same sum.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.noise import noise_of
from exfit.fitting.residuals import UNREACHABLE, Residuals
from exfit.util.arrays import Array

Rows = NDArray[np.intp]

LEAST_SAMPLES = 10_000  # of a record: fewer cost little
LEAST_GAIN = 3  # times fewer errors: else it does not pay
NODES = 12  # samples of which all others of a stretch follow
EXTREMES = np.cos(np.pi * np.arange(NODES) / (NODES - 1))  # of the polynomial of highest degree
LEAST_STRETCH = 3 * NODES  # samples: fewer are compared one by one
CHECKED = 8 * NODES  # samples of a stretch, spread over it, that its polynomial must match
TOLERANCE = 1e-7  # of a channel's noise: how near its response must be to the polynomials
OF_DERIVATIVES = 1e-8  # of the largest derivative to a parameter: the same of these
LEAST_ERROR = 1e-11  # pu: below that rounding of a long run is seen
WIDTH = 0.25  # of a stretch, as a share of the time since the last change of an input
BLOCK = 1 << 16  # samples that are looked at together
SCALED = 1 << 12  # samples that show how large derivatives are
NO_ROWS = np.arange(0)
WITHIN = 1e-6  # standard errors: how far a search may end from the minimum of all samples
CHANGING_SAMPLES = ("shift", "delay", "scale", "offset")  # nuisances that change what is compared


class Stretch(NamedTuple):
    """Samples of a record from its row ``first`` on to that before ``end``.

    They follow a polynomial through ``nodes`` (NODES,) of them; without any each stands for itself.
    """

    first: int
    end: int
    nodes: Rows = NO_ROWS

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.end - self.first

    def polynomials(self, times: Array, rows: Rows) -> Array:
        """Chebyshev polynomials of the stretch at some rows, (rows, NODES)."""
        from numpy.polynomial.chebyshev import chebvander  # most records are short

        low, high = times[self.first], times[self.end - 1]
        return chebvander((2.0 * times[rows] - low - high) / (high - low), NODES - 1)

    def with_nodes(self, times: Array) -> "Stretch":
        """Return it with the samples nearest to the extremes of the last polynomial as nodes."""
        low, high = times[self.first], times[self.end - 1]
        wanted = 0.5 * (low + high) - 0.5 * (high - low) * EXTREMES
        behind = np.searchsorted(times[self.first : self.end], wanted) + self.first
        behind = np.clip(behind, self.first + 1, self.end - 1)
        before_is_nearer = wanted - times[behind - 1] < times[behind] - wanted
        nodes = np.unique(behind - before_is_nearer)
        return self._replace(nodes=nodes) if len(nodes) == NODES else self

    def matches(self, times: Array, curves: Array, tolerance: Array) -> bool:
        """Test whether curves (size, C) follow the polynomials through their values at the nodes.

        The ``tolerance`` (C,) is that of each.
        """
        checked = np.linspace(self.first, self.end - 1, min(CHECKED, self.size)).astype(int)
        through = curves[self.nodes - self.first]
        sizes = np.linalg.solve(self.polynomials(times, self.nodes), through - through[0])
        followed = self.polynomials(times, checked) @ sizes + through[0]
        off = np.max(np.abs(followed - curves[checked - self.first]), axis=0)
        return bool(np.all(off <= tolerance))


@dataclass(frozen=True, eq=False)
class CompressedChannel(Channel):
    """A channel that is simulated at few of its samples (G,).

    Its squared errors are those of D samples that stand for themselves, of NODES errors for each of
    K stretches, and of one more. The samples ``alone`` are rows (D,) of those simulated; the errors
    of a stretch are ``maps`` (K, NODES, NODES) times the samples at its ``nodes`` (K, NODES). What
    they are compared with is ``theirs``; ``rest`` is the root of what no response can lower.
    """

    alone: Rows = field(kw_only=True)
    nodes: Rows = field(kw_only=True)
    maps: Array = field(kw_only=True)
    theirs: Array = field(kw_only=True)
    rest: float = field(kw_only=True)

    def compared(self, simulated: Array) -> Array:
        """Compare simulated signals (K, G), a row of each."""
        return self.slopes(simulated.T, simulated.T).T

    def filtered(self, samples: Array) -> Array:
        """Filter samples (G,) for the comparison."""
        return self.slopes(samples, samples[:, None])[:, 0]

    def slopes(self, samples: Array, slopes: Array) -> Array:
        """Return the derivatives (errors, N) of these, given those (G, N) of samples."""
        mapped = np.matmul(self.maps, slopes[self.nodes]).reshape(-1, slopes.shape[1])
        return np.concatenate([slopes[self.alone], mapped, np.zeros((1, slopes.shape[1]))])

    @cached_property
    def record(self) -> Array:
        """The record as it is compared."""
        return np.append(self.theirs, self.rest)

    @property
    def size(self) -> int:
        """How many errors there are."""
        return len(self.theirs) + 1


def compressed(residuals: Residuals, at: Array | None = None) -> Residuals:
    """Return residuals with the same cost and gradient near a point (N,), but fewer of them.

    Between the changes of its inputs a record is divided into stretches, until on each of them the
    response at the point (by default the start) and its derivatives are polynomials through NODES
    samples, within TOLERANCE. So they are short where something happens, or the samples stand for
    themselves, and long where a unit settles. None is longer than the time since the last change:
    what another set does soon after it is seen as well. How good that is at the end of a search,
    `is_as_all` tells.

    They are the same residuals where compression would not save much, or where it does not hold:
    with filters, with a robust loss or periodic disturbances, where another program simulates, and
    where the instants at which a record is read, or its scale, are found.

    Source: Golub & Van Loan 2013, section 5.3 (the least-squares problem of a factor R is that of
    all rows).
    """
    theta = residuals.start if at is None else at
    if residuals.robust is not None or not any(map(_is_long, residuals.experiments)):
        return residuals
    try:
        values, moves = residuals.values(theta), residuals.moves(theta)
        experiments = [
            _compressed(whole, residuals, values, moves) if _is_long(whole) else whole
            for whole in residuals.experiments
        ]
    except UNREACHABLE:
        return residuals
    if all(new is old for new, old in zip(experiments, residuals.experiments, strict=True)):
        return residuals
    return replace(residuals, experiments=experiments)


def is_as_all(few: Residuals, residuals: Residuals, theta: Array) -> bool:
    """Test that the minimum of compressed residuals near a point (N,) is that of all samples.

    A step of Gauss and Newton from the one to the other is within WITHIN standard errors.
    """
    if few is residuals:
        return True
    errors, slopes = residuals.errors(theta)
    few_errors, few_slopes = few.errors(theta)
    if not (np.isfinite(slopes).all() and np.isfinite(few_slopes).all()):
        return True
    triangle = np.linalg.qr(few_slopes, mode="r")
    scale = np.linalg.norm(triangle, axis=0)
    moved = slopes.T @ errors - few_slopes.T @ few_errors
    _, sizes, right = np.linalg.svd(triangle / scale)
    seen = sizes > np.sqrt(np.finfo(float).eps) * sizes[0]
    step = (right[seen] @ (moved / scale)) / sizes[seen]
    freedom = max(1, residuals.count - len(theta))
    return bool(step @ step <= WITHIN**2 * (errors @ errors) / freedom)


def _is_long(whole: Experiment) -> bool:
    """Test whether a record has many samples that can be compressed."""
    added = whole.sines or whole.whitening or whole.simulator.responder is not None
    changing = any(nuisance.kind in CHANGING_SAMPLES for nuisance in whole.nuisances)
    return (
        len(whole.simulator.times) >= LEAST_SAMPLES
        and not (added or changing)
        and all(channel.plain for channel in whole.channels)
    )


def _compressed(
    whole: Experiment, residuals: Residuals, values: dict[str, float], moves: list[dict[str, float]]
) -> Experiment:
    """Compress a long record by its response to some values, if that pays."""
    alone, stretches = list[Rows](), list[Stretch]()
    for stretch in _divided(whole, residuals, partial(_curves, whole, values, moves)):
        if not len(stretch.nodes):
            alone.append(np.arange(stretch.first, stretch.end))
        else:
            stretches.append(stretch)
    samples, count = len(whole.simulator.times), sum(map(len, alone)) + NODES * len(stretches)
    if not stretches or LEAST_GAIN * count > samples:
        return whole
    alone_, nodes = np.concatenate([NO_ROWS, *alone]), np.stack([one.nodes for one in stretches])
    rows = np.union1d(alone_, nodes)
    return replace(
        whole,
        simulator=whole.simulator.at_times(whole.simulator.times[rows]),
        channels=tuple(
            _compressed_channel(channel, whole.simulator.times, stretches, alone_, rows)
            for channel in whole.channels
        ),
    )


def _compressed_channel(
    channel: Channel, times: Array, stretches: Sequence[Stretch], alone: Rows, rows: Rows
) -> CompressedChannel:
    kept, measured = channel.kept, channel.measured
    maps, theirs = np.zeros((len(stretches), NODES, NODES)), np.zeros((len(stretches), NODES))
    rest = 0.0
    for k, stretch in enumerate(stretches):
        here = np.arange(stretch.first, stretch.end)[kept[stretch.first : stretch.end]]
        level = np.mean(measured[here]) if len(here) else 0.0  # about it squares do not cancel
        # with rows of zeros the factors of few samples are as large as those of many
        missing = np.zeros(max(0, NODES - len(here)))
        y = np.append(measured[here] - level, missing)
        polynomials = np.vstack([stretch.polynomials(times, here), np.zeros((len(missing), NODES))])
        factor, triangle = np.linalg.qr(polynomials)
        maps[k] = triangle @ np.linalg.inv(stretch.polynomials(times, stretch.nodes))
        along = y @ factor
        theirs[k] = along + maps[k].sum(axis=1) * level
        left = y - factor @ along
        rest += float(left @ left)
    own = alone[kept[alone]]
    return CompressedChannel(
        **{each.name: getattr(channel, each.name) for each in fields(Channel)},
        alone=np.searchsorted(rows, own),
        nodes=np.searchsorted(rows, np.stack([stretch.nodes for stretch in stretches])),
        maps=maps,
        theirs=np.concatenate([measured[own], theirs.ravel()]),
        rest=float(np.sqrt(rest)),
    )


def _divided(
    whole: Experiment, residuals: Residuals, curves_of: Callable[[Array], Array]
) -> Iterator[Stretch]:
    """Yield the stretches of a record in their order; ``curves_of`` times are its response."""
    times = whole.simulator.times
    some = times[:: -(-len(times) // SCALED)]
    tolerance = OF_DERIVATIVES * np.max(np.abs(curves_of(some)), axis=0)
    for k, channel in enumerate(whole.channels):
        tolerance[k] = max(TOLERANCE * noise_of(channel), LEAST_ERROR)
    grid = np.searchsorted(times, whole.simulator.on_grid().times + whole.simulator.delay)
    changes = _changes(whole, residuals)
    divisions = np.searchsorted(times, np.union1d(*changes), side="right")
    for block in range(0, len(times), BLOCK):
        behind = min(block + BLOCK, len(times))
        curves = curves_of(times[block:behind])
        inside = divisions[(divisions > block) & (divisions < behind)]
        bounds = np.unique([block, *inside, behind]).tolist()
        waiting = [Stretch(*pair) for pair in pairwise(bounds)][::-1]
        while waiting:
            stretch = waiting.pop()
            if stretch.size >= LEAST_STRETCH and _lies_far(stretch, times, *changes):
                own = stretch.with_nodes(times)
                here = curves[stretch.first - block : stretch.end - block]
                if len(own.nodes) and own.matches(times, here, tolerance):
                    yield own
                    continue
            if stretch.size >= 2 * LEAST_STRETCH:
                middle = _middle(stretch, grid)
                waiting += [Stretch(middle, stretch.end), Stretch(stretch.first, middle)]
            else:
                yield stretch


def _middle(stretch: Stretch, grid: NDArray[np.int64]) -> int:
    """Row at which to divide a stretch: best a point of the grid, where a response has corners."""
    middle = (stretch.first + stretch.end) // 2
    point = int(grid[min(int(np.searchsorted(grid, middle)), len(grid) - 1)])
    least = LEAST_STRETCH // 2
    return point if stretch.first + least <= point <= stretch.end - least else middle


def _curves(
    whole: Experiment, values: dict[str, float], moves: list[dict[str, float]], times: Array
) -> Array:
    """Response at some times and its derivatives, (times, channels + channels N)."""
    simulator = whole.with_inputs(values, whole.simulator.at_times(times))
    directions = [whole.direction(move) for move in moves]
    samples, slopes = simulator.tangents(whole.parameters(values), whole.signals, directions)
    return np.column_stack([samples, slopes.reshape(len(times), -1)])


def _changes(whole: Experiment, residuals: Residuals) -> tuple[Array, Array]:
    """Intervals in which an input changes, as the recorder shows it: starts and ends (K,), s.

    Where a fit moves an instant that is all the time in which it may lie.
    """
    steps, free = whole.simulator.inputs.steps, {own.name: own for own in residuals.free}
    intervals = [(step.at, step.end) for step in steps]
    for own in whole.nuisances:
        if own.kind in ("at", "switching"):
            for place in range(own.step, own.step + own.count):
                moved = free[own.name]
                intervals[place] = (moved.low, moved.high + steps[place].ramp)
    starts, ends = np.array(intervals).reshape(-1, 2).T + whole.simulator.delay
    return starts, ends


def _lies_far(stretch: Stretch, times: Array, starts: Array, ends: Array) -> bool:
    """Test that nothing changes within a stretch, nor just before it."""
    low, high = times[stretch.first], times[stretch.end - 1]
    if np.any((starts < high) & (ends >= low)):
        return False
    before = ends[ends < low]
    return not len(before) or bool(high - low <= WIDTH * (low - before.max()))
