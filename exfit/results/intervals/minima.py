"""The minima that a search found: which of them the records refute, and what is said of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from exfit.estimate import LocalMinimum, half_square
from exfit.fitting.descents import short_descent
from exfit.fitting.global_search import SearchResult, is_same, taken_for_validation
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import LIKELIHOOD_RATIO as REFUTED
from exfit.fitting.uncertainty import UncertaintyAnalysis, free_values, variance_of
from exfit.results.model import Minima, Minimum, multiple
from exfit.util.arrays import Array
from exfit.util.text import rounded_value

Values = Mapping[str, float]

TINY = float(np.finfo(float).tiny)
REMARKABLE = 0.1  # difference between values of a parameter, as a share, that is worth a word
WITHIN = 2.0  # standard errors: an interval says it already
MOST_VALUES = 6  # of a minimum, in a sentence
STEPS = 8  # of a way from one minimum to another
JUMP = 2.5  # steps: what moves by more at once has left the valley
MOST_ITERATIONS = 10  # down to the floor of a valley, from a point that lies nearly on it


def minima_of(
    residuals: Residuals,
    search: SearchResult,
    uncertainty: UncertaintyAnalysis | None,
    walked: Residuals | None,
    refined: Values = MappingProxyType({}),
) -> Minima | None:
    """Return the minima of a search from several starts, in the parameters' own values.

    Half the likelihood ratio of two of them is the difference of their costs over the variance of
    the residuals, which the ``uncertainty`` of the result widens where they are not white. Ways
    from one to another are looked for with the residuals ``walked``, unless that is None. All have
    the same values of what was ``refined``. None where the search came to no minimum, or there were
    no further starts.
    """
    if search.minima is None or not search.minima.minima:
        return None
    found = search.minima
    ends = [
        (search.best.x, search.best.cost) if k == search.place else (local.x, local.cost)
        for k, local in enumerate(found.minima)
    ]
    lowest = min(cost for _, cost in ends)
    variance = variance_of(residuals, lowest, uncertainty)
    chi_squares = [2.0 * (cost - lowest) / variance for _, cost in ends]
    places: list[int | None] = [None] * len(ends)
    several = sum(chi_square <= REFUTED for chi_square in chi_squares) > 1
    if walked is not None and search.place is not None and several:
        allowed = lowest + 0.5 * REFUTED * variance
        places = valleys(walked, [x for x, _ in ends], search.place, allowed)
    minima = tuple(
        Minimum(
            {**free_values(residuals, x), **refined},
            cost,
            each.starts,
            above,
            above > REFUTED,
            valley,
        )
        for each, (x, cost), above, valley in zip(
            found.minima, ends, chi_squares, places, strict=True
        )
    )
    return Minima(minima, found.start_costs, found.end_costs, search.ways)


def minima_notes(
    residuals: Residuals,
    search: SearchResult,
    minima: Minima | None,
    uncertainty: UncertaintyAnalysis | None,
) -> Iterator[str]:
    """Note other minima beside the result of a search that lie outside its intervals."""
    if search.minima is None:
        return
    if search.minima.interrupted:
        ends = search.minima.end_costs
        done = int(np.count_nonzero(np.isfinite(ends)))
        yield (
            f"interrupted in the search from further starts: {done} of {len(ends)} runs "
            "ended, and this is the best of them"
        )
    own, best = search.own, search.best
    if search.for_validation:
        lowest = min(local.cost for local in search.minima.minima)
        yield taken_for_validation(best.cost / lowest)
    if search.goes_on and not own.success:
        yield (
            f"the run from the start of the case ended at {times(own.cost, best.cost)} this "
            f"cost: {own.message}"
        )
    if minima is not None:
        errors = {} if uncertainty is None else uncertainty.confidence.parameters
        std_errors = {name: each.std_error or 0.0 for name, each in errors.items()}
        yield from _of_others(residuals, search, search.minima.minima, minima.minima, std_errors)


def _of_others(
    residuals: Residuals,
    search: SearchResult,
    ends: Sequence[LocalMinimum],
    minima: Sequence[Minimum],
    std_errors: Values,
) -> Iterator[str]:
    """Note the end of the descent from the start, if elsewhere, and minima not refuted."""
    values, cost = residuals.values(search.best.x), search.best.cost
    here = {name: values[name] for name in minima[0].values}
    by_valley: dict[object, list[tuple[bool, Minimum]]] = {}
    for k, (end, minimum) in enumerate(zip(ends, minima, strict=True)):
        from_start = search.goes_on and search.own.success and is_same(end.result, search.own)
        apart = any(
            abs(value - here[name]) > WITHIN * std_errors.get(name, 0.0)
            for name, value in minimum.values.items()
        )
        if k != search.place and (from_start or (apart and not minimum.refuted)):
            valley = ("alone", k) if minimum.valley is None else minimum.valley
            by_valley.setdefault(valley, []).append((from_start, minimum))
    for place, members in by_valley.items():
        if place == 0:
            along = [minimum for _, minimum in members]
            yield valley_in_words(along, cost, _above(minima), here, residuals)
            continue
        from_start, minimum = max(members, key=lambda member: member[0])  # else the lowest
        subject = "the run from the start of the case ended at" if from_start else "there is"
        yield f"{subject} {minimum_in_words(minimum, cost, here)}"


def _above(minima: Sequence[Minimum]) -> float:
    """Find the largest chi-square in the valley of the result."""
    return max(each.chi_square or 0.0 for each in minima if each.valley == 0)


def minimum_in_words(minimum: Minimum, cost: float, here: Values) -> str:
    """Word another minimum: its height, whether it is refuted, the values that differ most."""
    verdict = "which the record rejects"
    if not minimum.refuted:
        verdict = (
            f"which the record does not reject (chi-square {minimum.chi_square:.2g} above the "
            f"lowest, limit {REFUTED})"
        )
    pairs = {name: (value, here[name]) for name, value in minimum.values.items()}
    moved = ", ".join(
        f"{name} {minimum.values[name]:.4g} (here {here[name]:.4g})"
        for name in most_different(pairs)
    )
    return f"another minimum, {times(minimum.cost, cost)} this cost, {verdict}: {moved}"


def valley_in_words(
    others: Sequence[Minimum], cost: float, above: float, here: Values, residuals: Residuals
) -> str:
    """Word the parameters that move along the flat valley of the result.

    ``above`` is the largest chi-square of them and the result.
    """
    values = {name: [here[name], *(each.values[name] for each in others)] for name in here}
    bounds = {free.name: (free.low, free.high) for free in residuals.free}
    moves = []
    for name in most_different({name: (min(own), max(own)) for name, own in values.items()}):
        least, most = (
            rounded_value(end, None, *bounds[name])
            for end in (min(values[name]), max(values[name]))
        )
        moves.append(f"{name} {least} ... {most}")
    count = "another minimum lies" if len(others) == 1 else f"{len(others)} other minima lie"
    height = f"{'up to ' * (len(others) > 1)}{times(max(each.cost for each in others), cost)}"
    return (
        f"{count} in the same flat valley, {height} this cost, and the record rejects "
        f"no point between them (chi-square up to {above:.2g}, limit {REFUTED}): it "
        f"extends over {', '.join(moves)}"
    )


def times(cost: float, other: float) -> str:
    """Return a cost in words, as a multiple of another one."""
    return multiple(cost / other) if other > 0.0 else f"{cost:.3g} pu² above"


def most_different(pairs: Mapping[str, tuple[float, float]]) -> list[str]:
    """Return the parameters of which two values differ most, in their own order."""
    apart = {
        name: abs(one - other) / max(abs(one), abs(other), TINY)
        for name, (one, other) in pairs.items()
    }
    remarkable = [name for name in apart if apart[name] > REMARKABLE] or [*apart]
    most = sorted(remarkable, key=lambda name: -apart[name])[:MOST_VALUES]
    return [name for name in apart if name in most]


def valleys(
    residuals: Residuals, minima: Sequence[Array], first: int, allowed: float
) -> list[int | None]:
    """Number the valley of each minimum (N,), that of the ``first`` one being valley 0.

    None for one whose cost exceeds the ``allowed`` one, beyond which the records refute a point.
    """
    costs = residuals.costs(minima)
    order = sorted(range(len(minima)), key=lambda place: (place != first, costs[place]))
    found: list[list[int]] = []
    for place in order:
        if place != first and not costs[place] <= allowed:
            continue
        for valley in found:
            if any(is_way(residuals, minima[k], minima[place], allowed) for k in valley):
                valley.append(place)
                break
        else:
            found.append([place])
    number = {place: k for k, valley in enumerate(found) for place in valley}
    return [number.get(place) for place in range(len(minima))]


def is_way(residuals: Residuals, one: Array, other: Array, allowed: float) -> bool:
    """Look for a way from one point (N,) to another on which no cost is too high.

    The parameter that differs most goes from one to the other in even steps, and the others follow.
    Where they would have to jump there is none.
    """
    k = int(np.argmax(np.abs(other - one)))
    farthest = JUMP * abs(float(other[k] - one[k])) / STEPS
    here = one
    for left in range(STEPS, 1, -1):
        there = _on_floor(residuals, here + (other - here) / left, k, allowed)
        if there is None or np.max(np.abs(there - here)) > farthest:
            return False
        here = there
    return bool(np.max(np.abs(other - here)) <= farthest)


def _on_floor(residuals: Residuals, point: Array, k: int, allowed: float) -> Array | None:
    """Return a point (N,) itself, or one below it with the same k; None where none is allowed."""
    if residuals.costs([point])[0] <= allowed:
        return point
    held = residuals.free[k]
    fixed = {**residuals.fixed, held.name: held.value(float(point[k]))}
    free = [parameter for parameter in residuals.free if parameter is not held]
    end = short_descent(
        replace(residuals, free=free, fixed=fixed, counter=None),
        np.delete(point, k),
        MOST_ITERATIONS,
        matches=lambda errors: half_square(errors) <= allowed,
    )
    return None if end is None or end.cost > allowed else np.insert(end.x, k, point[k])
