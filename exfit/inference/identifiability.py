"""What a record does not determine of the parameters, and which to fix so that it does."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Annotated

import numpy as np

from exfit.inference.combinations import (
    Combination,
    exact_combinations,
    seen_directions,
    weak_combinations,
)
from exfit.inference.confidence import Confidence
from exfit.inference.factors import factored
from exfit.inference.fixings import Fixing, fixings
from exfit.inference.linear import Array, Linearisation


@dataclass(frozen=True, eq=False)
class Identifiability:
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
        return replace(self, unseen=kept, suggestion=tuple(suggestion))


def identifiability(lin: Linearisation, intervals: Confidence) -> Identifiability:
    """Find combinations of parameters that the record does not see, and remedies.

    Singular values and right directions of the Jacobian to relative changes
    (`Linearisation.size`), its rows divided by the noise: 1 / singular value is the standard error
    along a direction. Priors are rows too.
    """
    factors = factored(lin, lin.free)
    singular, directions = seen_directions(factors, intervals.noise)
    kept = np.flatnonzero(factors.has_effect)
    smallest = float(np.min(singular, initial=inf))
    return Identifiability(
        names=tuple(lin.names[k] for k in kept),
        singular_values=singular,
        directions=directions,
        condition=float(singular[0]) / smallest if smallest > 0.0 and len(kept) else inf,
        correlation=intervals.correlation.matrix[np.ix_(kept, kept)],
        unseen=(
            *exact_combinations(lin, intervals.noise),
            *weak_combinations(lin, intervals.noise, kept, singular, directions),
        ),
        suggestion=tuple(fixings(factors, intervals.noise)),
    )
