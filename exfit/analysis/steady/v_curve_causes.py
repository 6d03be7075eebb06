"""Why points on load are not matched: the one thing that, if it were another, would match them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from exfit.analysis.steady.fields_on_load import FieldsOnLoad, Values, base_of
from exfit.analysis.steady.point_fit import PointProblem, descended
from exfit.estimate.run import NotFinite
from exfit.fitting.parameters import FreeParameter
from exfit.models.sheet import Parameter
from exfit.results.verdict import Cause

MUCH_BETTER = 0.25  # of the cost: half of the rms
AS_GOOD = 1.5  # times the cost of the best: it explains the points as well
FARTHEST = 2.0  # times a value: as far as a trial goes
FEWEST_POINTS = 4  # of fewer one value explains too much
OF_MACHINE = ("Xd", "Xq")
SATURATION = ("S10", "S12")
REVERSED = Cause(
    "the points are matched much better with q reversed",
    "q is positive where the machine is overexcited: give scale: -1",
)


class TrialOfPoints(NamedTuple):
    """The cost at which one thing more matches the points, and what that would mean."""

    cost: float
    cause: Cause


def causes_of(fields: FieldsOnLoad, values: Values, fitted: set[str]) -> tuple[Cause, ...]:
    """Return what would match the points much better if it were another, the likeliest first.

    One by one Xd, Xq, the saturation and each base that is not ``fitted`` is fitted, and the
    reactive power reversed.
    """
    if len(fields.points.p) < FEWEST_POINTS:
        return ()
    cost = cost_of(fields, values)
    trials = sorted(
        (each for each in _trials(fields, values, fitted) if each.cost < MUCH_BETTER * cost),
        key=lambda each: each.cost,
    )
    return tuple(each.cause for each in trials if each.cost <= AS_GOOD * trials[0].cost)


def cost_of(fields: FieldsOnLoad, values: Values) -> float:
    """Return half the sum of the squares of the weighted errors."""
    errors = fields.errors(values)
    return 0.5 * float(errors @ errors)


def _trials(fields: FieldsOnLoad, values: Values, fitted: set[str]) -> Iterator[TrialOfPoints]:
    reverse = fields.points._replace(q=-fields.points.q)
    yield TrialOfPoints(cost_of(FieldsOnLoad(fields.machine, reverse), values), REVERSED)
    rows = {row.symbol: row for row in fields.machine.sheet}
    groups: list[tuple[str, ...]] = [(symbol,) for symbol in OF_MACHINE]
    groups += [SATURATION] if values["S10"] > 0.0 else []
    groups += [(base_of(signal),) for signal in fields.points.measurements]
    for names in groups:
        if not fitted & {*names}:
            yield from _trial(fields, values, [_freed(name, values, rows) for name in names])


def _freed(name: str, values: Values, rows: dict[str, Parameter]) -> FreeParameter:
    low, high = values[name] / FARTHEST, values[name] * FARTHEST
    if name in rows:
        low, high = max(low, rows[name].low), min(high, rows[name].high)
    return FreeParameter(name, values[name], low, high, logarithmic=True)


def _trial(
    fields: FieldsOnLoad, values: Values, free: list[FreeParameter]
) -> Iterator[TrialOfPoints]:
    problem = PointProblem(fields.errors, values, tuple(free), fields.blocks, {})
    search = fields.search(problem)
    try:
        end = descended(search, np.array([each.scaled(each.start) for each in search.free]))
    except NotFinite:
        return
    better = search.values(end.x)
    words = " and ".join(f"{each.name} = {better[each.name]:.4g}" for each in free)
    given = " and ".join(f"{values[each.name]:.4g}" for each in free)
    cause = Cause(
        f"the points are matched much better by {words} than by {given}",
        f"check {'the base' if free[0].name not in fields.symbols else 'it'}, or let it be fitted",
    )
    yield TrialOfPoints(end.cost, cause)
