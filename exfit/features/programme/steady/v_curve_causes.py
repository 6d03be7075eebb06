"""Causes of points on load that are not matched: one thing that, if another, would match them."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from exfit.estimate.run import NotFinite
from exfit.features.programme.steady.fields_on_load import FieldsOnLoad, Values, base_of
from exfit.features.programme.steady.point_fit import PointProblem, descended
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


def causes_of(fields: FieldsOnLoad, values: Values, problem: PointProblem) -> tuple[Cause, ...]:
    """Find the things that, if another, would match the points much better, the likeliest first.

    One by one Xd, Xq, the saturation and each base that the problem does not fit is fitted as well,
    and the reactive power reversed; what the problem fits is fitted again from its start.
    """
    if len(fields.points.p) < FEWEST_POINTS:
        return ()
    cost = cost_of(fields, values)
    trials = sorted(
        (each for each in _trials(fields, problem) if each.cost < MUCH_BETTER * cost),
        key=lambda each: each.cost,
    )
    return tuple(each.cause for each in trials if each.cost <= AS_GOOD * trials[0].cost)


def cost_of(fields: FieldsOnLoad, values: Values) -> float:
    """Return half the sum of the squares of the weighted errors."""
    errors = fields.errors(values)
    return 0.5 * float(errors @ errors)


def _trials(fields: FieldsOnLoad, problem: PointProblem) -> Iterator[TrialOfPoints]:
    values = problem.given
    reversed_fields = replace(fields, points=fields.points._replace(q=-fields.points.q))
    for better in _descended(reversed_fields, replace(problem, errors=reversed_fields.errors)):
        yield TrialOfPoints(cost_of(reversed_fields, better), REVERSED)
    rows = {row.symbol: row for row in fields.machine.sheet}
    groups: list[tuple[str, ...]] = [(symbol,) for symbol in OF_MACHINE]
    groups += [SATURATION] if values["S10"] > 0.0 else []
    groups += [(base_of(signal),) for signal in fields.points.measurements]
    fitted = {each.name for each in problem.free}
    for names in groups:
        if not fitted & {*names}:
            freed = tuple(_freed(name, values, rows) for name in names)
            yield from _trial(fields, replace(problem, free=(*freed, *problem.free)), names)


def _freed(name: str, values: Values, rows: dict[str, Parameter]) -> FreeParameter:
    low, high = values[name] / FARTHEST, values[name] * FARTHEST
    if name in rows:
        low, high = max(low, rows[name].low), min(high, rows[name].high)
    return FreeParameter(name, values[name], low, high, logarithmic=True)


def _trial(
    fields: FieldsOnLoad, problem: PointProblem, names: tuple[str, ...]
) -> Iterator[TrialOfPoints]:
    for better in _descended(fields, problem):
        words = " and ".join(f"{name} = {better[name]:.4g}" for name in names)
        given = " and ".join(f"{problem.given[name]:.4g}" for name in names)
        cause = Cause(
            f"the points are matched much better by {words} than by {given}",
            f"check {'the base' if names[0] not in fields.symbols else 'it'}, or let it be fitted",
        )
        yield TrialOfPoints(cost_of(fields, better), cause)


def _descended(fields: FieldsOnLoad, problem: PointProblem) -> Iterator[Values]:
    """Yield the values at the minimum that a descent from those of a problem reaches, if any."""
    if not problem.free:
        yield problem.given
        return
    search = fields.search(problem)
    try:
        end = descended(search, np.array([each.scaled(each.start) for each in search.free]))
    except NotFinite:
        return
    yield search.values(end.x)
