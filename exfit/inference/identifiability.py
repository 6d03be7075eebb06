"""What a record cannot tell of the parameters, and which to fix so that it can."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.inference.confidence import Confidence, finite
from exfit.inference.factors import Factors, factored, tall_svd
from exfit.inference.linear import Array, Linearisation, Mask
from exfit.inference.noise import Noise
from exfit.inference.wording import digits, error, listed, move

Indices = NDArray[np.intp]

WEAK = 0.1  # relative standard error: worse than a data sheet
SHOWN = 0.1  # of the largest part of a combination: smaller ones hide what matters
EXACT_MOVE = 0.1  # relative change that shows an exact redundancy, which holds for any
BETTER = 0.5  # of the error before: an improvement that is worth its words
TIED = 6  # digits: components that differ less are equal but for rounding


@dataclass(frozen=True)
class Change:
    """By how much a signal moves: root mean square, in pu and in standard deviations of noise."""

    signal: str
    rms: float
    noises: float


@dataclass(frozen=True)
class Combination:
    """Parameters that can move together without being seen.

    moves    name and relative change, the largest first: by one standard error (``exact``: by 10 %)
    changes  what the signals do then
    error    the standard error along the combination; None if exact
    """

    moves: tuple[tuple[str, float], ...]
    changes: tuple[Change, ...]
    error: float | None
    exact: bool
    sentence: str


@dataclass(frozen=True)
class Fixing:
    """What fixing parameters, all ``names`` of them, brings for the standard errors of the others.

    errors: name to relative standard error with nothing fixed and now; infinite: not determined.
    """

    names: tuple[str, ...]
    errors: Mapping[str, tuple[float, float]]
    sentence: str


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What the record tells of relative changes of the parameters ``names`` (K,).

    Those on a bound and those without effect are not among them. singular_values (K,) descend,
    0 where exactly redundant; directions (K, K) has a row for each; condition is the ratio of the
    largest to the smallest. unseen: the combinations with a standard error beyond WEAK, exact ones
    first. suggestion: parameters to fix, one more each time, until every other has one below it.
    """

    names: tuple[str, ...]
    singular_values: Array
    directions: Array
    condition: float
    correlation: Array
    unseen: tuple[Combination, ...]
    suggestion: tuple[Fixing, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What to tell: the combinations, and what fixing parameters would bring."""
        return (
            *(one.sentence for one in self.unseen),
            *(one.sentence for one in self.suggestion),
        )

    def as_json(self) -> dict[str, Any]:
        """Return the content as JSON takes it: None for what is not a finite number."""
        return {
            "names": list(self.names),
            "singular_values": self.singular_values.tolist(),
            "directions": self.directions.tolist(),
            "condition": finite(self.condition),
            "correlation": [[finite(x) for x in row] for row in self.correlation.tolist()],
            "unseen": [
                {
                    "moves": dict(one.moves),
                    "changes": [
                        {"signal": c.signal, "rms": c.rms, "noises": finite(c.noises)}
                        for c in one.changes
                    ],
                    "error": one.error,
                    "exact": one.exact,
                    "sentence": one.sentence,
                }
                for one in self.unseen
            ],
            "suggestion": [
                {
                    "fix": list(one.names),
                    "errors": {
                        name: {"before": finite(before), "after": finite(after)}
                        for name, (before, after) in one.errors.items()
                    },
                    "sentence": one.sentence,
                }
                for one in self.suggestion
            ],
        }


def sensitivity(lin: Linearisation) -> Array:
    """Return by how much each signal moves over time for a change by 100 %, (M, N), in pu.

    What counts as 100 % says `Linearisation.size`: the value, for most.
    """
    return lin.relative / lin.by_row([one.weight for one in lin.channels])[:, None]


def identifiability(lin: Linearisation, known: Confidence) -> Identifiability:
    """Return which combinations of parameters the record does not see, and what would help.

    Singular values and right directions of the Jacobian to relative changes
    (`Linearisation.size`), its rows divided by the noise: 1 / singular value is the standard error
    along a direction. Priors are rows too.
    """
    factors = factored(lin, lin.free)
    singular, directions = seen_directions(factors, known.noise)
    kept = np.flatnonzero(factors.seen)
    smallest = float(np.min(singular, initial=inf))
    return Identifiability(
        names=tuple(lin.names[k] for k in kept),
        singular_values=singular,
        directions=directions,
        condition=float(singular[0]) / smallest if smallest > 0.0 and len(kept) else inf,
        correlation=known.correlation[np.ix_(kept, kept)],
        unseen=(
            *exact_combinations(lin, known.noise),
            *weak_combinations(lin, known.noise, kept, singular, directions),
        ),
        suggestion=tuple(fixings(factors, known.noise)),
    )


def seen_directions(factors: Factors, noise: Sequence[Noise]) -> tuple[Array, Array]:
    """Return the singular values (K,) and right directions (K, K) of relative changes.

    Directions that nothing in the record tells apart come last, with singular value 0; the others
    are perpendicular to them.
    """
    lin, seen, count = factors.lin, factors.seen, len(factors.null)
    rounding = np.finfo(float).eps * np.max(np.abs(lin.relative), initial=0.0)
    spread = lin.by_row([np.fmax(one.spread, rounding) for one in noise])
    rows = np.vstack([lin.relative / spread[:, None], lin.prior_rows])[:, seen]
    null = np.linalg.qr(factors.null.T)[0].T
    _, singular, directions = tall_svd(rows - rows @ null.T @ null)
    if count:
        singular[-count:], directions[-count:] = 0.0, null
    return singular, directions


def exact_combinations(lin: Linearisation, noise: Sequence[Noise]) -> Iterator[Combination]:
    """Yield what nothing tells apart, those on a bound too: it may be why they are there."""
    factors = factored(lin, np.ones(len(lin.names), dtype=bool))
    signals = listed([one.label for one in lin.channels])
    still = tuple(Change(one.label, 0.0, 0.0) for one in lin.channels)
    for k in np.flatnonzero(~factors.seen):
        name = lin.names[k]
        text = f"{name} has no effect on {signals}: fix it"
        yield Combination(((name, EXACT_MOVE),), still, None, True, text)
    kept = np.flatnonzero(factors.seen)
    for direction, joined in zip(factors.null, factors.joined, strict=True):
        moves = ordered(kept[joined], EXACT_MOVE * direction[joined])
        told = f"{together(lin, moves)} without any change of {signals}: fix one of them"
        yield Combination(named(lin, moves), still, None, True, told)


def weak_combinations(
    lin: Linearisation, noise: Sequence[Noise], kept: Indices, singular: Array, directions: Array
) -> Iterator[Combination]:
    """Yield the directions with a standard error beyond WEAK, the weakest first."""
    for value, direction in reversed(list(zip(singular, directions, strict=True))):
        if value == 0.0 or value * WEAK >= 1.0:
            continue
        step = direction / value
        shown = np.abs(step) > SHOWN * np.max(np.abs(step))
        moves = ordered(kept[shown], step[shown])
        changes = tuple(changes_of(lin, noise, lin.relative[:, kept] @ step))
        effects = ", ".join(
            f"{one.signal} changes by {digits(one.rms)} pu rms, {digits(one.noises)} of its noise"
            for one in changes
        )
        told = f"{together(lin, moves)}: {effects}"
        yield Combination(named(lin, moves), changes, 1.0 / float(value), False, told)


def changes_of(lin: Linearisation, noise: Sequence[Noise], moved: Array) -> Iterator[Change]:
    """Yield what each channel does when the weighted errors move (M,)."""
    for channel, one in zip(lin.channels, noise, strict=True):
        rms = float(np.sqrt(np.mean(moved[channel.rows] ** 2)))
        yield Change(channel.label, rms / channel.weight, rms / one.std if one.std else inf)


def ordered(kept: Indices, shares: Array) -> list[tuple[int, float]]:
    """Return parameters and their shares, the largest first and upwards; ties as they come."""
    size = np.abs(shares)
    order = np.argsort(-np.round(size / np.max(size), TIED), kind="stable")
    upwards = np.sign(shares[order[0]])
    return [(int(kept[k]), float(upwards * shares[k])) for k in order]


def named(lin: Linearisation, moves: Sequence[tuple[int, float]]) -> tuple[tuple[str, float], ...]:
    """Return moves with the names of the parameters for their indices."""
    return tuple((lin.names[k], share) for k, share in moves)


def together(lin: Linearisation, moves: Sequence[tuple[int, float]]) -> str:
    """Return "KD, TE and KA can move together (KD +50 %, TE +10 %, KA +9.7 %)"."""
    if len(moves) == 1:
        k, share = moves[0]
        return f"{lin.names[k]} can move ({move(lin, k, share)})"
    steps = ", ".join(f"{lin.names[k]} {move(lin, k, share)}" for k, share in moves)
    return f"{listed([lin.names[k] for k, _ in moves])} can move together ({steps})"


def fixings(factors: Factors, noise: Sequence[Noise]) -> Iterator[Fixing]:
    """Yield which parameters to fix, one more each time, until the others are known to WEAK.

    The next is the first that a rank-revealing QR picks from the weak directions (Golub, Klema &
    Stewart 1976), exact ones before others. Nuisances are never fixed; their errors do not count.
    """
    lin = factors.lin
    model = ~np.array(lin.nuisances, dtype=bool)
    before = now = errors_of(factors, noise)
    fixed: list[int] = []
    while np.count_nonzero(factors.seen & model) > 1 and np.any(now[factors.seen & model] > WEAK):
        fixed.append(next_to_fix(factors, noise, model))
        kept = factors.seen.copy()
        kept[fixed] = False
        factors = factored(lin, kept)
        now = errors_of(factors, noise)
        others = np.flatnonzero(factors.seen & model)
        yield Fixing(
            tuple(lin.names[k] for k in fixed),
            {lin.names[k]: (float(before[k]), float(now[k])) for k in others},
            fixing_sentence(lin, fixed, others, before, now),
        )


def errors_of(factors: Factors, noise: Sequence[Noise]) -> Array:
    """Return the relative standard errors of the parameters (N,), infinite if not determined."""
    covariance = factors.covariance(tuple(one.spread for one in noise))
    return np.where(factors.determined, np.sqrt(np.diag(covariance)), inf)


def next_to_fix(factors: Factors, noise: Sequence[Noise], model: Mask) -> int:
    """Return the parameter of the model that moves most in what the record sees least."""
    from scipy.linalg import qr

    singular, directions = seen_directions(factors, noise)
    own = np.flatnonzero(model[factors.seen])
    parts = np.round(directions[:, own], TIED)
    moving = np.linalg.norm(parts, axis=1) > SHOWN  # others move nuisances alone
    parts, singular = parts[moving], singular[moving]
    # the last one at least: many that are not weak may add up
    limit = 0.0 if singular[-1] == 0.0 else max(1.0 / WEAK, singular[-1])
    pick = qr(parts[singular <= limit], mode="r", pivoting=True)[1][0]
    return int(np.flatnonzero(factors.seen)[own[pick]])


def fixing_sentence(
    lin: Linearisation, fixed: Sequence[int], others: Indices, before: Array, now: Array
) -> str:
    """Return what fixing brings, the most improved first."""
    start = f"with {listed([lin.names[k] for k in fixed])} fixed"
    better = [int(k) for k in others if now[k] < BETTER * before[k]]
    if not better:
        return f"{start}, the others are known no better"
    better.sort(key=lambda k: now[k] / before[k] if isfinite(before[k]) else 0.0)
    return f"{start}, {', '.join(improvement(lin, k, before, now, k == better[0]) for k in better)}"


def improvement(lin: Linearisation, k: int, before: Array, now: Array, first: bool) -> str:
    """Return "TE is known to 1.4 % (10 % before)", and shorter where it is not the first."""
    known, earlier = (" is known", " before") if first else ("", "")
    was = f" ({error(lin, k, float(before[k]))}{earlier})" if isfinite(before[k]) else ""
    return f"{lin.names[k]}{known} to {error(lin, k, float(now[k]))}{was}"
