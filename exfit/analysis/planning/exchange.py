"""The search for the best moves of the reference: a coordinate exchange from several starts."""

from collections.abc import Iterator, Sequence
from math import inf

from exfit.analysis.planning.candidates import REST, Bench, Move, Moves

DWELLS = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0)  # s between steps
SHARES = tuple(k / 5.0 for k in range(-5, 6))  # of the limit of the reference
REFINEMENTS = (0.1, 0.05, 0.025)  # of that limit, about the best of these
MOST_SWEEPS = 6
LEAST_GAIN_OF_SWEEP = 1e-3  # of the criterion


def best_single_step(bench: Bench, signals: Sequence[str], duration: float) -> Moves:
    """Return the best single step: all levels of the finest ladder, up and down."""
    finest = REFINEMENTS[-1]
    levels = [sign * k * finest for k in range(1, round(1.0 / finest) + 1) for sign in (1.0, -1.0)]
    return min(
        ((Move(0.0, round(level, 6)),) for level in levels),
        key=lambda moves: bench.cost(moves, signals, duration),
    )


def best_moves(bench: Bench, fewer: Moves, signals: Sequence[str], duration: float) -> Moves:
    """Return the best moves with one more than those given: a coordinate exchange."""
    starts = [start for start in _starts(fewer, duration)
              if bench.cost(start, signals, duration) < inf]  # fmt: skip
    ends = [_exchanged(bench, start, signals, duration) for start in starts]
    return min(ends, key=lambda moves: bench.cost(moves, signals, duration), default=fewer)


def _starts(fewer: Moves, duration: float) -> Iterator[Moves]:
    """Yield moves to begin the exchange from: one more behind those given, and pulses."""
    for dwell in (0.5, 2.0):
        for share in (0.0, -fewer[-1].share):
            yield (*fewer, Move(dwell, share))
    count = len(fewer) + 1
    even = (duration - REST) / count
    for dwell in (max((d for d in DWELLS if d <= even), default=DWELLS[0]), DWELLS[1]):
        yield tuple(Move(dwell if k else 0.0, 0.8 * (-1) ** k) for k in range(count))


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


def _other_moves(move: Move, first: bool) -> Iterator[Move]:
    """Yield moves with another level or, but for the first, another instant."""
    near_by = [move.share + sign * part for part in REFINEMENTS for sign in (1.0, -1.0)]
    for share in (*SHARES, *near_by):
        if abs(share) <= 1.0:
            yield move._replace(share=round(share, 6))
    if not first:
        for dwell in DWELLS:
            yield move._replace(dwell=dwell)
