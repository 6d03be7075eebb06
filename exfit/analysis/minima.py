"""The minima that a search found: which of them the records refute, and what is said of them."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from exfit.estimate import LocalMinimum
from exfit.fitting.global_search import SearchResult, is_same
from exfit.fitting.residuals import LEAST_NOISE, Residuals
from exfit.fitting.search import LIKELIHOOD_RATIO as REFUTED
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.model import Minima, Minimum
from exfit.results.search_summary import multiple

Values = Mapping[str, float]

TINY = float(np.finfo(float).tiny)
REMARKABLE = 0.1  # difference between values of a parameter, as a share, that is worth a word
WITHIN = 2.0  # standard errors: an interval says it already
MOST_VALUES = 6  # of a minimum, in a sentence


def minima_of(
    residuals: Residuals, search: SearchResult, uncertainty: UncertaintyAnalysis | None
) -> Minima | None:
    """Return the minima of a search from several starts, in the parameters' own values.

    Half the likelihood ratio of two of them is the difference of their costs over the variance of
    the residuals, which the ``uncertainty`` of the result widens where they are not white. None
    where the search came to no minimum, or there were no further starts.
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
    minima = tuple(
        Minimum(own_values(residuals, x), cost, local.starts, chi_square, chi_square > REFUTED)
        for local, (x, cost), chi_square in zip(found.minima, ends, chi_squares, strict=True)
    )
    return Minima(minima, found.start_costs, found.end_costs, search.ways)


def variance_of(
    residuals: Residuals, cost: float, uncertainty: UncertaintyAnalysis | None
) -> float:
    """Return the variance of the residuals at a minimum: no less than that of any recorder."""
    freedom = max(1, residuals.count - len(residuals.free))
    own = 2.0 * cost / freedom if uncertainty is None else uncertainty.confidence.variance
    return max(own, LEAST_NOISE**2)


def own_values(residuals: Residuals, x: NDArray[np.float64]) -> dict[str, float]:
    """Return the values of the free parameters."""
    values = residuals.values(x)
    return {parameter.name: values[parameter.name] for parameter in residuals.free}


def minima_notes(
    residuals: Residuals,
    search: SearchResult,
    minima: Minima | None,
    uncertainty: UncertaintyAnalysis | None,
) -> Iterator[str]:
    """Yield what must be known of the other minima beside the result of a search.

    Those within the intervals of the ``uncertainty`` are no news.
    """
    if search.minima is None:
        return
    if search.minima.interrupted:
        ends = search.minima.end_costs
        done = int(np.count_nonzero(np.isfinite(ends)))
        yield (
            f"interrupted in the search from further starts: {done} of {len(ends)} descents were "
            "done, and this is the best of them"
        )
    own, best = search.own, search.best
    if search.goes_on and not own.success:
        yield (
            f"the descent from the start of the case ended at {times(own.cost, best.cost)} this "
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
    """Yield where the start of the case led, if elsewhere, and what the records do not refute."""
    here = own_values(residuals, search.best.x)
    for k, (end, minimum) in enumerate(zip(ends, minima, strict=True)):
        from_start = search.goes_on and search.own.success and is_same(end.result, search.own)
        apart = any(
            abs(value - here[name]) > WITHIN * std_errors.get(name, 0.0)
            for name, value in minimum.values.items()
        )
        if k != search.place and (from_start or (apart and not minimum.refuted)):
            subject = (
                "the descent from the start of the case ended at" if from_start else "there is"
            )
            yield f"{subject} {minimum_in_words(minimum, search.best.cost, here)}"


def minimum_in_words(minimum: Minimum, cost: float, here: Values) -> str:
    """Return how another minimum lies to the result, and what the records say of it."""
    verdict = "which the record refutes"
    if not minimum.refuted:
        verdict = (
            f"which the record does not refute (chi-square {minimum.chi_square:.2g} above the "
            f"lowest, limit {REFUTED})"
        )
    height = times(minimum.cost, cost)
    return f"another minimum, {height} this cost, {verdict}: {differences(minimum.values, here)}"


def times(cost: float, other: float) -> str:
    """Return a cost in words, as a multiple of another one."""
    return multiple(cost / other) if other > 0.0 else f"{cost:.3g} pu² above"


def differences(there: Values, here: Values) -> str:
    """Return which values of a minimum are others than here: those that differ most."""
    apart = {
        name: abs(value - here[name]) / max(abs(value), abs(here[name]), TINY)
        for name, value in there.items()
    }
    remarkable = [name for name in apart if apart[name] > REMARKABLE] or [*apart]
    most = sorted(remarkable, key=lambda name: -apart[name])[:MOST_VALUES]
    own = [name for name in apart if name in most]
    return ", ".join(f"{name} {there[name]:.4g} (here {here[name]:.4g})" for name in own)
