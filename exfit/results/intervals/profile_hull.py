"""Profiles of the cost about all minima that the records do not refute, and their hull."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.fitting.global_search import SearchResult
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals, SideBySide

Array = NDArray[np.float64]
Watch = Callable[[estimate.Progress], object]


class FoundMinimum(NamedTuple):
    """A minimum of the cost: its point (N,), in scaled parameters, and its cost."""

    x: Array
    cost: float


class ProfilesAboutMinima(NamedTuple):
    """Profiles of parameters, by their places among the free ones, each about several minima.

    The first is that about the solution. ``lower`` is a minimum (N,) with a lower cost, where they
    led to one: then all are about that one alone.
    """

    by_index: Mapping[int, Sequence[estimate.CostProfile]]
    lower: Array | None = None
    interrupted: bool = False


def other_minima(search: SearchResult) -> list[FoundMinimum]:
    """Return the minima of a search beside its best point."""
    minima = enumerate(() if search.minima is None else search.minima.minima)
    return [FoundMinimum(local.x, local.cost) for k, local in minima if k != search.place]


def profiles_about(
    residuals: Residuals,
    solution: FoundMinimum,
    others: Sequence[FoundMinimum],
    rises: Mapping[int, float],
    points: int,
    progress: Watch,
) -> ProfilesAboutMinima:
    """Return the profiles about a solution, and about others as far as these are not refuted.

    What lies within the interval of a parameter already needs no further profile. An interruption
    keeps what is done by then.
    """
    profiles: dict[int, list[estimate.CostProfile]] = {}
    for minimum in (solution, *others):
        within = {
            k: rise
            for k, rise in rises.items()
            if allowed(solution, minimum, rise) and beyond(minimum.x[k], profiles.get(k, ()))
        }
        if not within:
            continue
        about_minimum = estimate.profiles(
            SideBySide(residuals),
            minimum.x,
            within,
            residuals.bounds,
            beside=None if minimum is solution else beside(solution, profiles),
            points=points,
            x_scale=residuals.units,
            watch=progress,
        )
        interrupted = not all(map(complete, about_minimum))
        if about_minimum[0].moved:
            lower = {profile.index: [profile] for profile in about_minimum}
            return ProfilesAboutMinima(lower, about_minimum[0].x, interrupted)
        for profile in about_minimum:
            profiles.setdefault(profile.index, []).append(profile)
        if interrupted:
            return ProfilesAboutMinima(profiles, interrupted=True)
    return ProfilesAboutMinima(profiles)


def allowed(solution: FoundMinimum, other: FoundMinimum, rise: float) -> bool:
    """Test whether another minimum lies below the rise at which a parameter's interval ends."""
    return other.cost - solution.cost < rise


def beyond(value: float, profiles: Iterable[estimate.CostProfile]) -> bool:
    """Test whether a value lies in the interval of no profile so far."""
    low, high = limits_of(profiles)
    return not low <= value <= high


def beside(
    solution: FoundMinimum, profiles: Mapping[int, Sequence[estimate.CostProfile]]
) -> estimate.LowerMinimum:
    """Interval that a profile about another minimum need not find again."""
    return estimate.LowerMinimum(
        solution.cost, {index: limits_of(each) for index, each in profiles.items()}
    )


def complete(profile: estimate.CostProfile) -> bool:
    """Test whether both sides of a profile came to their ends."""
    return estimate.ProfileEnd.INTERRUPTED not in profile.ends


def limits_of(profiles: Iterable[estimate.CostProfile]) -> tuple[float, float]:
    """Interval that encloses those of all profiles of a parameter, infinite where one is open."""
    low, high = inf, -inf
    for profile in profiles:
        below, above = (end is estimate.ProfileEnd.KNOWN for end in profile.ends)
        low = low if below else min(low, -inf if profile.low is None else profile.low)
        high = high if above else max(high, inf if profile.high is None else profile.high)
    return low, high


def reasons(parameter: FreeParameter, profiles: Sequence[estimate.CostProfile]) -> tuple[str, str]:
    """Reasons for which profiles leave the lower and upper limit open; "" for one that they set."""
    bounds = (f"its min {parameter.low:.4g}", f"its max {parameter.high:.4g}")
    each = [
        [reason(profile.ends[side], bound) for profile in profiles]
        for side, bound in enumerate(bounds)
    ]
    below, above = (next(filter(None, texts), "") for texts in each)
    return below, above


def reason(end: estimate.ProfileEnd, bound: str) -> str:
    """Word the reason for which a side of a profile has no limit, "" where it has one."""
    words = {
        estimate.ProfileEnd.BOUND: f"the record does not exclude {bound}",
        estimate.ProfileEnd.FAILED: "there is no response beyond",
        estimate.ProfileEnd.FLAT: "the cost hardly rises",
        estimate.ProfileEnd.INTERRUPTED: "interrupted",
    }
    return words.get(end, "")
