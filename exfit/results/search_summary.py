"""A search from several starts in a sentence."""

from collections.abc import Iterator, Sequence

import numpy as np

from exfit.results.model import Minima, Minimum

NEAR = 2.0  # times a cost: below it another one is given to a thousandth


def search_summary(minima: Minima, cost: float) -> str:
    """Return from where a search went, and where its descents led; ``cost`` is of the result."""
    own = max(1, minima.ways.count("strategy"))
    further = minima.starts - own
    starts = "1 further start" if further == 1 else f"{further} further starts"
    return f"from the start of the case and {starts}: {', '.join(_ends(minima, cost))}"


def _ends(minima: Minima, cost: float) -> Iterator[str]:
    """Yield the counts of descents: to the minimum of the result, to others, to nowhere."""
    others = [minimum for minimum in minima.minima if minimum.cost != cost]
    here = sum(minimum.starts for minimum in minima.minima if minimum.cost == cost)
    yield f"{here} of {minima.starts} descents lead to this {'minimum' if here else 'point'}"
    along = sum(minimum.starts for minimum in others if minimum.valley == 0)
    if along:
        yield f"{along} to others in its flat valley"
    yield from _elsewhere(others, cost)
    yield from _refuted(others, cost)
    if minima.failed:
        yield f"{minima.failed} to none: no response"
    unfinished = int(np.count_nonzero(np.isnan(minima.end_costs))) - minima.failed
    if unfinished > 0:
        yield f"{unfinished} not done"


def _elsewhere(minima: Sequence[Minimum], cost: float) -> Iterator[str]:
    """Yield the counts of descents to each open minimum beyond the valley of the result."""
    for minimum in minima:
        if minimum.valley != 0 and not minimum.refuted:
            verdict = "" if minimum.refuted is None else " (not refuted)"
            yield f"{minimum.starts} to one {_height(minimum, cost)}{verdict}"


def _refuted(minima: Sequence[Minimum], cost: float) -> Iterator[str]:
    """Yield the counts of descents to minima that the records refute."""
    refuted = [minimum for minimum in minima if minimum.refuted]
    if len(refuted) == 1:
        yield f"{refuted[0].starts} to one {_height(refuted[0], cost)} (refuted)"
    elif refuted:
        descents = sum(minimum.starts for minimum in refuted)
        yield f"{descents} to {len(refuted)} others, {_height(refuted[0], cost)} or more (refuted)"


def _height(minimum: Minimum, cost: float) -> str:
    """Word the height of a minimum."""
    return f"{multiple(minimum.cost / cost)} as high" if cost > 0.0 else f"at {minimum.cost:.3g}"


def multiple(ratio: float) -> str:
    """Write the ratio of two costs in as many digits as tell them apart."""
    digits = max(0, 3 - len(f"{ratio:.0f}")) if ratio >= NEAR else 3
    return f"{ratio:.{digits}f} times"
