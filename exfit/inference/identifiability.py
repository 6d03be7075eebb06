"""What a record does not determine of the parameters, which to fix so that it does, and effects.

Effects say which parameter matters first: how far a small change of each moves what is recorded.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan, sqrt
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.inference.confidence import Confidence
from exfit.inference.linear import Factors, Linearisation, factored, tall_svd
from exfit.inference.noise import Noise
from exfit.util.arrays import Array
from exfit.util.text import digits, listed
from exfit.util.typed import KEY

Indices = NDArray[np.intp]

WEAK = 0.1  # relative standard error: worse than a data sheet
SMALLEST_PART = 0.1  # of the largest part of a combination: smaller ones hide what matters
EXACT_MOVE = 0.1  # relative change that shows an exact redundancy, which holds for any
TIED = 6  # digits: components that differ less are equal but for rounding
BETTER = 0.5  # of the error before: an improvement that is worth its words
PERCENT = 0.01
OF_INTERVAL = "is 0: 1 % of its interval"


class SignalChange(NamedTuple):
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


class FixingErrors(NamedTuple):
    """The relative standard error with nothing fixed, and now; infinite: not determined."""

    before: Annotated[float, inf]
    after: Annotated[float, inf]


@dataclass(frozen=True)
class Fixing:
    """Gain in the standard errors of the others by fixing parameters, all ``names`` of them.

    errors: name to relative standard error with nothing fixed and now; infinite: not determined.
    """

    names: tuple[str, ...] = field(metadata={KEY: "fix"})
    errors: Mapping[str, FixingErrors]
    sentence: str

    @property
    def concerned(self) -> frozenset[str]:
        """Parameters of its sentence: those to fix, and those then known better."""
        better = (name for name, each in self.errors.items() if each.after < BETTER * each.before)
        return frozenset((*self.names, *better))


class Identifiability(NamedTuple):
    """Relative changes of the parameters ``names`` (K,) that the record determines.

    Those on a bound and those without effect are not among them. singular_values (K,) descend,
    0 where exactly redundant; directions (K, K) has a row for each; condition is the ratio of the
    largest to the smallest. unseen: the combinations with a standard error beyond WEAK, exact ones
    first. suggestion: parameters to fix, one more each time, until every other has one below it.
    """

    names: tuple[str, ...]
    singular_values: Array
    directions: Array
    condition: Annotated[float, inf]
    correlation: Array
    unseen: tuple[Combination, ...]
    suggestion: tuple[Fixing, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """The combinations in words, and the gain by fixing parameters."""
        return (
            *(combination.sentence for combination in self.unseen),
            *(fixing.sentence for fixing in self.suggestion),
        )

    def within(self, intervals: Mapping[str, tuple[float, float]]) -> "Identifiability":
        """Return it without what the intervals of profiles, by name, contradict.

        Linear theory does not hold along a combination that leads a parameter out of its interval,
        nor for what fixing one of these would bring.
        """
        kept = tuple(each for each in self.unseen if not each.leaves(intervals))
        contradicted = {name for each in self.unseen if each not in kept for name in each.reached}
        suggestion = (each for each in self.suggestion if not each.concerned & contradicted)
        return self._replace(unseen=kept, suggestion=tuple(suggestion))


def identifiability(lin: Linearisation, intervals: Confidence) -> Identifiability:
    """Find combinations of parameters that the record does not see, and remedies.

    Singular values and right directions of the Jacobian to relative changes
    (`Linearisation.size`), its rows divided by the noise: 1 / singular value is the standard error
    along a direction. Priors are rows too.
    """
    factors, noise = factored(lin, lin.free), intervals.noise
    singular, directions = _seen_directions(factors, noise)
    kept = np.flatnonzero(factors.has_effect)
    smallest = float(np.min(singular, initial=inf))
    return Identifiability(
        names=tuple(lin.names[k] for k in kept),
        singular_values=singular,
        directions=directions,
        condition=float(singular[0]) / smallest if smallest > 0.0 and len(kept) else inf,
        correlation=intervals.correlation.matrix[np.ix_(kept, kept)],
        unseen=(
            *_exact_combinations(lin),
            *_weak_combinations(lin, noise, kept, singular, directions),
        ),
        suggestion=tuple(_fixings(factors, noise)),
    )


def _seen_directions(factors: Factors, noise: Sequence[Noise]) -> tuple[Array, Array]:
    """Singular values (K,) and right directions (K, K) of relative changes, unseen ones last."""
    lin, has_effect, count = factors.lin, factors.has_effect, len(factors.null)
    rounding = np.finfo(float).eps * np.max(np.abs(lin.relative), initial=0.0)
    spread = lin.by_row([np.fmax(channel_noise.spread, rounding) for channel_noise in noise])
    rows = np.vstack([lin.relative / spread[:, None], lin.prior_rows])[:, has_effect]
    _, singular, directions = tall_svd(rows)
    if count:
        singular[-count:], directions[-count:] = 0.0, np.linalg.qr(factors.null.T)[0].T
    return singular, directions


def _exact_combinations(lin: Linearisation) -> Iterator[Combination]:
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
        moves = _ordered(with_effect[joined], EXACT_MOVE * direction[joined])
        named = tuple((lin.names[k], share) for k, share in moves)
        text = f"{_together(lin, moves)} without any change of {signals}: fix one of them"
        yield Combination(named, still, None, True, text)


def _weak_combinations(
    lin: Linearisation, noise: Sequence[Noise], kept: Indices, singular: Array, directions: Array
) -> Iterator[Combination]:
    """Yield the directions with a standard error beyond WEAK, the weakest first."""
    for value, direction in reversed(list(zip(singular, directions, strict=True))):
        if value == 0.0 or value * WEAK >= 1.0:
            continue
        step = direction / value
        large = np.abs(step) > SMALLEST_PART * np.max(np.abs(step))
        moves = _ordered(kept[large], step[large])
        errors, changes = lin.relative[:, kept] @ step, []
        for channel, own in zip(lin.channels, noise, strict=True):
            rms = float(np.linalg.norm(errors[channel.rows])) / sqrt(own.samples)
            noises = rms / own.std if own.std else inf
            changes.append(SignalChange(channel.label, rms / channel.weight, noises))
        first, *others = changes
        words = [
            f"{first.signal} changes by {digits(first.rms)} pu rms, {digits(first.noises)} of its "
            "noise",
            *(f"{each.signal} by {digits(each.rms)} pu, {digits(each.noises)}" for each in others),
        ]
        reached = {}
        with np.errstate(over="ignore"):
            for k, share in moves:
                at = lin.values[k]
                at = at * np.exp(share) if lin.logarithmic[k] else at + share * lin.size[k]
                reached[lin.names[k]] = float(at)
        yield Combination(
            tuple((lin.names[k], share) for k, share in moves),
            tuple(changes),
            1.0 / float(value),
            False,
            f"{_together(lin, moves)}: {'; '.join(words)}",
            reached,
        )


def _ordered(kept: Indices, shares: Array) -> list[tuple[int, float]]:
    """Return parameters and their shares, the largest first and upwards; ties as they come."""
    size = np.abs(shares)
    order = np.argsort(-np.round(size / np.max(size), TIED), kind="stable")
    upwards = np.sign(shares[order[0]])
    return [(int(kept[k]), float(upwards * shares[k])) for k in order]


def _together(lin: Linearisation, moves: Sequence[tuple[int, float]]) -> str:
    """Return "KD, TE and KA can move together (KD +50 %, TE +10 %, KA +9.7 %)"."""
    if len(moves) == 1:
        return f"{lin.names[moves[0][0]]} can move alone ({lin.move_in_words(*moves[0])})"
    steps = ", ".join(f"{lin.names[k]} {lin.move_in_words(k, share)}" for k, share in moves)
    return f"{listed([lin.names[k] for k, _ in moves])} can move together ({steps})"


def _fixings(factors: Factors, noise: Sequence[Noise]) -> Iterator[Fixing]:
    """Suggest parameters to fix, one more each time, until the others are known to WEAK.

    The next is the first that a rank-revealing QR picks from the weak directions (Golub, Klema &
    Stewart 1976), exact ones before others. Nuisances are never fixed; their errors do not count.
    """
    lin = factors.lin
    model = ~np.array(lin.nuisances, dtype=bool)
    before = now = _errors_of(factors, noise)
    fixed: list[int] = []
    while np.count_nonzero(factors.has_effect & model) > 1 and np.any(
        now[factors.has_effect & model] > WEAK
    ):
        singular, directions = _seen_directions(factors, noise)
        own = np.flatnonzero(model[factors.has_effect])
        parts = np.round(directions[:, own], TIED)
        # the last one at least: a fit that weights signals badly may determine less than its record
        limit = 0.0 if singular[-1] == 0.0 else max(1.0 / WEAK, singular[-1])
        longest = np.argmax(np.linalg.norm(parts[singular <= limit], axis=0))
        fixed.append(int(np.flatnonzero(factors.has_effect)[own[longest]]))
        kept = factors.has_effect.copy()
        kept[fixed] = False
        factors = factored(lin, kept)
        now = _errors_of(factors, noise)
        others = np.flatnonzero(factors.has_effect & model)
        yield Fixing(
            tuple(lin.names[k] for k in fixed),
            {lin.names[k]: FixingErrors(float(before[k]), float(now[k])) for k in others},
            _fixing_sentence(lin, fixed, others, before, now),
        )


def _errors_of(factors: Factors, noise: Sequence[Noise]) -> Array:
    """Return the relative standard errors of the parameters (N,), infinite if not determined."""
    covariance = factors.covariance(noise)
    return np.where(factors.determined, np.sqrt(np.diag(covariance)), inf)


def _fixing_sentence(
    lin: Linearisation, fixed: Sequence[int], others: Indices, before: Array, now: Array
) -> str:
    """Word the gain by fixing, the most improved first: "TE is known to 1.4 % (10 % before)"."""
    start = f"with {listed([lin.names[k] for k in fixed])} fixed"
    better = [int(k) for k in others if now[k] < BETTER * before[k]]
    if not better:
        return f"{start}, the others are known no better"
    better.sort(key=lambda k: now[k] / before[k] if isfinite(before[k]) else 0.0)
    gains: list[str] = []
    for k in better:
        known, earlier = ("", "") if gains else (" is known", " before")
        was = (
            f" ({lin.error_in_words(k, float(before[k]))}{earlier})" if isfinite(before[k]) else ""
        )
        gains.append(f"{lin.names[k]}{known} to {lin.error_in_words(k, float(now[k]))}{was}")
    return f"{start}, {', '.join(gains)}"


class ParameterEffect(NamedTuple):
    """Effect of 1 % of a parameter on the records.

    ``rms`` is the root mean square of the change of each channel over its samples, per unit;
    ``of_noise`` is that of all samples together, each in standard deviations of its noise: below
    about 1 / sqrt(samples) no record shows the change. ``percent_of`` says of what the 1 % is: of
    the value or, where that is 0, of the interval between the bounds.
    """

    parameter: str
    rms: Mapping[str, float]
    of_noise: Annotated[float, nan]
    percent_of: Literal["value", "interval"] = "value"

    @property
    def label(self) -> str:
        """The parameter, with what the 1 % is of where that is not its value."""
        return self.parameter if self.percent_of == "value" else f"{self.parameter} ({OF_INTERVAL})"


def effects(lin: Linearisation, noise: Sequence[Noise]) -> tuple[ParameterEffect, ...]:
    """Return the effect of each parameter, the strongest first.

    What counts as 100 % is `Linearisation.ranked_size`. Samples that are left out do
    not count, and filters are applied. What belongs to a record is no parameter. Where the noise of
    a channel is not known its effects are compared per unit.
    """
    samples, found = [each.samples for each in noise], list[ParameterEffect]()
    for k, (name, size) in enumerate(zip(lin.names, lin.ranked_size, strict=True)):
        if lin.nuisances[k]:
            continue
        moved = [PERCENT * size * lin.jacobian[channel.rows, k] for channel in lin.channels]
        squares = [float(np.sum(each**2)) for each in moved]
        rms = {
            channel.label: (square / count) ** 0.5 / channel.weight
            for channel, square, count in zip(lin.channels, squares, samples, strict=True)
        }
        with np.errstate(divide="ignore", invalid="ignore"):
            in_noise = np.divide(squares, [each.std**2 for each in noise])
        of_noise = float(np.sqrt(np.sum(in_noise) / sum(samples)))
        effect = ParameterEffect(name, rms, of_noise if isfinite(of_noise) else nan)
        found.append(effect if lin.values[k] != 0.0 else effect._replace(percent_of="interval"))
    if all(isfinite(effect.of_noise) for effect in found):
        return tuple(sorted(found, key=lambda effect: -effect.of_noise))
    return tuple(sorted(found, key=lambda effect: -sum(rms**2 for rms in effect.rms.values())))
