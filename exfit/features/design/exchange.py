"""The search for the best moves of the reference: a coordinate exchange from several starts."""

from collections.abc import Iterator, Sequence
from math import inf

from exfit.features.design.candidates import REST, Bench, Moves, ReferenceMove

DWELLS = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0)  # s between steps
SHARES = tuple(k / 5.0 for k in range(-5, 6))  # of the limit of the reference
REFINEMENTS = (0.1, 0.05, 0.025)  # of that limit, about the best of these
FIRST_DWELLS = (0.2, 1.0, 3.0)  # s, of a further step
MOST_SWEEPS = 6
LEAST_GAIN = 0.01  # of the criterion, for which a step or a channel is added
LEAST_GAIN_OF_SWEEP = 1e-3  # of the criterion


def best_single_step(bench: Bench, signals: Sequence[str], duration: float) -> Moves:
    """Return the best single step: all levels of the finest ladder, up and down."""
    finest = REFINEMENTS[-1]
    levels = [sign * k * finest for k in range(1, round(1.0 / finest) + 1) for sign in (1.0, -1.0)]
    return min(
        ((ReferenceMove(0.0, round(level, 6)),) for level in levels),
        key=lambda moves: bench.cost(moves, signals, duration),
    )


def best_moves(
    bench: Bench, fewer: Sequence[Moves], signals: Sequence[str], duration: float
) -> list[Moves]:
    """Return moves with one more than those given, the best first; none where none are allowed.

    The best of ``fewer`` is what the search begins with; where a further move gains nothing from
    there, as when it leaves no time for one, the others of them follow.
    """

    def cost(moves: Moves) -> float:
        return bench.cost(moves, signals, duration)

    ends: list[Moves] = []
    for before in fewer:
        families = _later(before), _earlier(before), _pulses(len(before) + 1, duration)
        starts = [min(family, key=cost) for family in families]
        allowed = (start for start in starts if cost(start) < inf)
        exchanged = [_exchanged(bench, start, signals, duration) for start in allowed]
        ends = sorted(dict.fromkeys([*ends, *exchanged]), key=cost)
        if ends and gains(cost(fewer[0]), cost(ends[0])):
            break
    return ends


def gains(before: float, after: float) -> bool:
    """Tell whether a criterion is so much smaller that an addition is worth it."""
    return after <= (1.0 - LEAST_GAIN) * before


def _later(fewer: Moves) -> Iterator[Moves]:
    """Yield moves with one more behind those given."""
    for dwell in FIRST_DWELLS:
        for share in _levels(fewer[-1].share):
            yield (*fewer, ReferenceMove(dwell, share))


def _earlier(fewer: Moves) -> Iterator[Moves]:
    """Yield moves with one more before those given."""
    first, *others = fewer
    for dwell in FIRST_DWELLS:
        for share in _levels(first.share):
            yield (ReferenceMove(0.0, share), ReferenceMove(dwell, first.share), *others)


def _pulses(count: int, duration: float) -> Iterator[Moves]:
    """Yield moves up and down in turn."""
    even = (duration - REST) / count
    for dwell in (max((d for d in DWELLS if d <= even), default=DWELLS[0]), DWELLS[1]):
        for size in SHARES:
            yield tuple(ReferenceMove(dwell if k else 0.0, size * (-1) ** k) for k in range(count))


def _exchanged(bench: Bench, moves: Moves, signals: Sequence[str], duration: float) -> Moves:
    """Return moves of which no single coordinate can be exchanged for a better one."""
    cost = bench.cost(moves, signals, duration)
    for _ in range(MOST_SWEEPS):
        before = cost
        for k in range(len(moves)):
            for other in [*_other_moves(moves[k], first=k == 0)]:
                trial = (*moves[:k], other, *moves[k + 1 :])
                trial_cost = bench.cost(trial, signals, duration)
                if trial_cost < cost:
                    moves, cost = trial, trial_cost
        if cost > (1.0 - LEAST_GAIN_OF_SWEEP) * before:
            break
    return moves


def _other_moves(move: ReferenceMove, first: bool) -> Iterator[ReferenceMove]:
    """Yield moves with another level or, but for the first, another instant."""
    for share in _levels(move.share):
        yield move._replace(share=share)
    if not first:
        for dwell in DWELLS:
            yield move._replace(dwell=dwell)


def _levels(share: float) -> Iterator[float]:
    """Yield the levels of the ladder, and finer ones about a level."""
    near_by = (share + sign * part for part in REFINEMENTS for sign in (1.0, -1.0))
    for level in (*SHARES, *near_by):
        if abs(level) <= 1.0:
            yield round(level, 6)
