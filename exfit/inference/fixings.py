"""Which parameters to fix, so that a record determines the others."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Annotated, NamedTuple

import numpy as np

from exfit.inference.combinations import TIED, WEAK, Indices, seen_directions
from exfit.inference.factors import Factors, factored
from exfit.inference.linear import Array, Linearisation, Mask
from exfit.inference.noise import Noise
from exfit.inference.wording import error, listed
from exfit.util.typed import KEY

BETTER = 0.5  # of the error before: an improvement that is worth its words


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


def fixings(factors: Factors, noise: Sequence[Noise]) -> Iterator[Fixing]:
    """Suggest parameters to fix, one more each time, until the others are known to WEAK.

    The next is the first that a rank-revealing QR picks from the weak directions (Golub, Klema &
    Stewart 1976), exact ones before others. Nuisances are never fixed; their errors do not count.
    """
    lin = factors.lin
    model = ~np.array(lin.nuisances, dtype=bool)
    before = now = errors_of(factors, noise)
    fixed: list[int] = []
    while np.count_nonzero(factors.has_effect & model) > 1 and np.any(
        now[factors.has_effect & model] > WEAK
    ):
        fixed.append(next_to_fix(factors, noise, model))
        kept = factors.has_effect.copy()
        kept[fixed] = False
        factors = factored(lin, kept)
        now = errors_of(factors, noise)
        others = np.flatnonzero(factors.has_effect & model)
        yield Fixing(
            tuple(lin.names[k] for k in fixed),
            {lin.names[k]: FixingErrors(float(before[k]), float(now[k])) for k in others},
            fixing_sentence(lin, fixed, others, before, now),
        )


def errors_of(factors: Factors, noise: Sequence[Noise]) -> Array:
    """Return the relative standard errors of the parameters (N,), infinite if not determined."""
    covariance = factors.covariance(noise)
    return np.where(factors.determined, np.sqrt(np.diag(covariance)), inf)


def next_to_fix(factors: Factors, noise: Sequence[Noise], model: Mask) -> int:
    """Return the parameter of the model that moves most in what the record sees least."""
    singular, directions = seen_directions(factors, noise)
    own = np.flatnonzero(model[factors.has_effect])
    parts = np.round(directions[:, own], TIED)
    # the last one at least: a fit may determine less than its record, if it weights signals badly
    limit = 0.0 if singular[-1] == 0.0 else max(1.0 / WEAK, singular[-1])
    longest = np.argmax(np.linalg.norm(parts[singular <= limit], axis=0))
    return int(np.flatnonzero(factors.has_effect)[own[longest]])


def fixing_sentence(
    lin: Linearisation, fixed: Sequence[int], others: Indices, before: Array, now: Array
) -> str:
    """Word the gain by fixing, the most improved first."""
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
