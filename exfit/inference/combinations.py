"""Combinations of parameters that a record sees weakly, or not at all."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, nan, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from exfit.inference.factors import Factors, factored, tall_svd
from exfit.inference.linear import Array, Linearisation
from exfit.inference.noise import Noise
from exfit.inference.wording import digits, listed, move

Indices = NDArray[np.intp]

WEAK = 0.1  # relative standard error: worse than a data sheet
SMALLEST_PART = 0.1  # of the largest part of a combination: smaller ones hide what matters
EXACT_MOVE = 0.1  # relative change that shows an exact redundancy, which holds for any
TIED = 6  # digits: components that differ less are equal but for rounding


@dataclass(frozen=True)
class SignalChange:
    """Change of a signal: root mean square, in pu and in standard deviations of noise."""

    signal: str
    rms: Annotated[float, nan]
    noises: Annotated[float, nan]


@dataclass(frozen=True)
class Combination:
    """Parameters that can move together without being seen.

    moves    name and relative change, the largest first: by one standard error (``exact``: by 10 %)
    reached  the value of each that its move leads to; none if exact
    changes  what the signals do then
    error    the standard error along the combination; None if exact
    """

    moves: tuple[tuple[str, float], ...]
    changes: tuple[SignalChange, ...]
    error: float | None
    exact: bool
    sentence: str
    reached: Mapping[str, Annotated[float, inf]] = field(default_factory=dict)

    def leaves(self, intervals: Mapping[str, tuple[float, float]]) -> bool:
        """Test whether a move leads out of the interval of a parameter, by name."""
        return any(
            not intervals[name][0] <= value <= intervals[name][1]
            for name, value in self.reached.items()
            if name in intervals
        )


def seen_directions(factors: Factors, noise: Sequence[Noise]) -> tuple[Array, Array]:
    """Return the singular values (K,) and right directions (K, K) of relative changes.

    Those without any effect come last, with singular value 0.
    """
    lin, has_effect, count = factors.lin, factors.has_effect, len(factors.null)
    rounding = np.finfo(float).eps * np.max(np.abs(lin.relative), initial=0.0)
    spread = lin.by_row([np.fmax(channel_noise.spread, rounding) for channel_noise in noise])
    rows = np.vstack([lin.relative / spread[:, None], lin.prior_rows])[:, has_effect]
    _, singular, directions = tall_svd(rows)
    if count:
        singular[-count:], directions[-count:] = 0.0, np.linalg.qr(factors.null.T)[0].T
    return singular, directions


def exact_combinations(lin: Linearisation, noise: Sequence[Noise]) -> Iterator[Combination]:
    """Find combinations that change no signal; of parameters on a bound too, which may be why."""
    factors = factored(lin, np.ones(len(lin.names), dtype=bool))
    signals = listed([block.label for block in lin.channels])
    still = tuple(SignalChange(block.label, 0.0, 0.0) for block in lin.channels)
    for k in np.flatnonzero(~factors.has_effect):
        name = lin.names[k]
        text = f"{name} has no effect on {signals}: fix it"
        yield Combination(((name, EXACT_MOVE),), still, None, True, text)
    with_effect = np.flatnonzero(factors.has_effect)
    for direction, joined in zip(factors.null, factors.joined, strict=True):
        moves = ordered(with_effect[joined], EXACT_MOVE * direction[joined])
        sentence = f"{together(lin, moves)} without any change of {signals}: fix one of them"
        yield Combination(named(lin, moves), still, None, True, sentence)


def weak_combinations(
    lin: Linearisation, noise: Sequence[Noise], kept: Indices, singular: Array, directions: Array
) -> Iterator[Combination]:
    """Yield the directions with a standard error beyond WEAK, the weakest first."""
    for value, direction in reversed(list(zip(singular, directions, strict=True))):
        if value == 0.0 or value * WEAK >= 1.0:
            continue
        step = direction / value
        large = np.abs(step) > SMALLEST_PART * np.max(np.abs(step))
        moves = ordered(kept[large], step[large])
        changes = tuple(changes_of(lin, noise, lin.relative[:, kept] @ step))
        sentence = f"{together(lin, moves)}: {effects(changes)}"
        yield Combination(
            named(lin, moves),
            changes,
            1.0 / float(value),
            False,
            sentence,
            {lin.names[k]: moved(lin, k, share) for k, share in moves},
        )


def changes_of(lin: Linearisation, noise: Sequence[Noise], errors: Array) -> Iterator[SignalChange]:
    """Change of each channel with the weighted errors (M,)."""
    for channel, channel_noise in zip(lin.channels, noise, strict=True):
        rms = float(np.linalg.norm(errors[channel.rows])) / sqrt(channel_noise.samples)
        yield SignalChange(
            channel.label,
            rms / channel.weight,
            rms / channel_noise.std if channel_noise.std else inf,
        )


def effects(changes: Sequence[SignalChange]) -> str:
    """Return "vt changes by 3e-6 pu rms, 0.03 of its noise; efd by 5e-4 pu, 0.02"."""
    first, *others = changes
    of_first = (
        f"{first.signal} changes by {digits(first.rms)} pu rms, {digits(first.noises)} of its noise"
    )
    return "; ".join(
        [
            of_first,
            *(
                f"{change.signal} by {digits(change.rms)} pu, {digits(change.noises)}"
                for change in others
            ),
        ]
    )


def ordered(kept: Indices, shares: Array) -> list[tuple[int, float]]:
    """Return parameters and their shares, the largest first and upwards; ties as they come."""
    size = np.abs(shares)
    order = np.argsort(-np.round(size / np.max(size), TIED), kind="stable")
    upwards = np.sign(shares[order[0]])
    return [(int(kept[k]), float(upwards * shares[k])) for k in order]


def named(lin: Linearisation, moves: Sequence[tuple[int, float]]) -> tuple[tuple[str, float], ...]:
    """Return moves with the names of the parameters for their indices."""
    return tuple((lin.names[k], share) for k, share in moves)


def moved(lin: Linearisation, k: int, share: float) -> float:
    """Return the value of parameter k behind a relative move."""
    value = lin.values[k]
    with np.errstate(over="ignore"):
        return float(value * np.exp(share) if lin.logarithmic[k] else value + share * lin.size[k])


def together(lin: Linearisation, moves: Sequence[tuple[int, float]]) -> str:
    """Return "KD, TE and KA can move together (KD +50 %, TE +10 %, KA +9.7 %)"."""
    if len(moves) == 1:
        k, share = moves[0]
        return f"{lin.names[k]} can move alone ({move(lin, k, share)})"
    steps = ", ".join(f"{lin.names[k]} {move(lin, k, share)}" for k, share in moves)
    return f"{listed([lin.names[k] for k, _ in moves])} can move together ({steps})"
