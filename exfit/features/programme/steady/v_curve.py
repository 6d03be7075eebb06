"""V-curves: the field current that holds points on load, measured beside the machine's model."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.estimate.solver import NotFinite
from exfit.features.programme.steady.fields_on_load import (
    FieldsOnLoad,
    PointsOnLoad,
    base_of,
    field_on_load,
    weight_of,
)
from exfit.features.programme.steady.point_fit import (
    FittedPoints,
    PointProblem,
    allowing_for_errors,
    descended,
)
from exfit.features.programme.steady.v_curve_result import FieldReading, PowerLevel, VCurve
from exfit.fitting.parameters import FreeParameter
from exfit.models.machines import Machine
from exfit.models.sheet import Parameter
from exfit.results.model import FittedParameter
from exfit.results.verdict import GOOD, MATCHES, NO_MATCH, NOT_CONVERGED, Cause, Verdict
from exfit.util.text import show

Array = NDArray[np.float64]
Values = Mapping[str, float]

LARGEST_SHARE = 0.02  # of the rms of a field signal: what instruments and model may leave
LARGEST_NOISES = 3.0  # times the noise that is given
LEVEL_GAP = 0.04  # pu of power, between points of one level and those of the next
CURVE_POINTS = 101  # of the model's curve of a level, odd: one lies at its middle
WIDER = 0.1  # of the range of q: how far the model's curve goes beyond the points
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


def v_curve(
    machine: Machine,
    data: Values,
    points: PointsOnLoad,
    free: Sequence[FreeParameter] = (),
    limit: float | None = None,
    std_errors: Values = MappingProxyType({}),
) -> VCurve:
    """Return the points beside the machine's model, after a fit of its ``free`` data if there are.

    Args:
        machine: the model.
        data: a value for each symbol of its sheet.
        points: with readings of ``ifd``, ``efd`` or both.
        free: machine data by symbol, which the points are fitted for beside the free bases.
        limit: largest rms of the residuals of a field signal that counts as a match, pu; None:
            LARGEST_SHARE of its rms, or LARGEST_NOISES times its noise where that is larger.
        std_errors: of machine data by symbol, and of bases such as ``ifd.base`` (in their unit):
            the intervals allow for them.

    Raises RecordError for a point at which the model has no rest.

    Source: IEEE Std 115, cf. the saturation curves and the excitation on load; the model's
    equations are those of its dynamics at rest.
    """
    ifd = field_on_load(machine, data, points.p, points.q, points.vt)
    for row in np.flatnonzero(~np.isfinite(ifd))[:1]:
        place = f"p {show(points.p[row])}, q {show(points.q[row])}, vt {show(points.vt[row])} pu"
        raise RecordError(f"point {row + 1} ({place}): the machine has no rest there")
    fields = FieldsOnLoad(machine, points)
    problem = fields.problem(data, free)
    fit = None
    if problem.free:
        fit = allowing_for_errors(problem, fields.fit(problem), std_errors)
    values = problem.given if fit is None else fit.values
    readings = {
        signal: _reading_of(signal, fields, values, fit, limit) for signal in points.measurements
    }
    fitted = {} if fit is None else _parameters(fields, problem.free, fit)
    machine_data = {symbol: values[symbol] for symbol in data}
    verdict = _verdict(readings, fitted, fit, causes_of(fields, values, problem))
    if verdict.misfit:
        fitted = {name: each.without_interval(verdict.no_interval) for name, each in fitted.items()}
    return VCurve(
        machine=machine.name,
        p=points.p,
        q=points.q,
        vt=points.vt,
        readings=readings,
        given=dict(data),
        machine_data=machine_data,
        parameters=fitted,
        verdict=verdict,
        undetermined=() if fit is None else fit.undetermined,
        notes=() if fit is None else fit.notes,
        levels=tuple(power_levels(machine, machine_data, points)),
    )


def power_levels(machine: Machine, data: Values, points: PointsOnLoad) -> Iterator[PowerLevel]:
    """Yield the levels of power of some points, the lowest first, with the model's curves."""
    order = np.argsort(points.p, kind="stable")
    ends = np.flatnonzero(np.diff(points.p[order]) > LEVEL_GAP) + 1
    for rows in np.split(order, ends):
        p, low, high = float(np.mean(points.p[rows])), points.q[rows].min(), points.q[rows].max()
        beyond = WIDER * (points.q.max() - points.q.min())
        q = np.linspace(low - beyond, high + beyond, CURVE_POINTS)
        # the line through the voltages of the points, their mean for one q
        taken_q, taken_vt = points.q[rows], points.vt[rows]
        spread = taken_q - np.mean(taken_q)
        square = float(spread @ spread)
        slope = float(spread @ taken_vt) / square if square > 0.0 else 0.0
        vt = np.mean(taken_vt) + slope * (np.clip(q, low, high) - np.mean(taken_q))
        ifd = field_on_load(machine, data, np.full_like(q, p), q, vt)
        it = np.hypot(p, q) / vt
        yield PowerLevel(p, tuple(int(row) for row in np.sort(rows)), q, vt, it, ifd)


def _reading_of(
    signal: str,
    fields: FieldsOnLoad,
    values: Values,
    fit: FittedPoints | None,
    limit: float | None,
) -> FieldReading:
    reading, base = fields.points.measurements[signal], values[base_of(signal)]
    measured, simulated = reading.measured / base, fields.simulated(values)
    usual = max(
        LARGEST_SHARE * float(np.sqrt(np.mean(measured**2))),
        LARGEST_NOISES * (reading.noise or 0.0),
    )
    scatter = None if fit is None else fit.scatter(signal) / weight_of(signal, reading)
    return FieldReading(
        signal=signal,
        unit=reading.unit,
        base=base,
        measured=measured,
        simulated=simulated,
        noise=reading.noise,
        scatter=scatter,
        limit=usual if limit is None else limit,
        base_fitted=reading.free_base is not None,
    )


def _parameters(
    fields: FieldsOnLoad, free: Sequence[FreeParameter], fit: FittedPoints
) -> dict[str, FittedParameter]:
    rows = {row.symbol: row for row in fields.machine.sheet}
    fitted = {}
    for parameter in free:
        row, known = rows.get(parameter.name), fit.confidence.parameters[parameter.name]
        value, signal = fit.values[parameter.name], parameter.name.partition(".")[0]
        fitted[parameter.name] = FittedParameter(
            value=value,
            start=parameter.start,
            min=parameter.low,
            max=parameter.high,
            at_bound=parameter.bound(value),
            of_record=row is None,
            std_error=known.std_error,
            interval=known.interval,
            interval_method=known.method,
            why=known.why,
            unit=fields.points.measurements[signal].unit if row is None else row.unit,
            meaning=f"1 pu of {signal}" if row is None else row.meaning,
            physical=row is None or row.is_physical(value),
        )
    return fitted


def _verdict(
    readings: Mapping[str, FieldReading],
    fitted: Mapping[str, FittedParameter],
    fit: FittedPoints | None,
    causes: tuple[Cause, ...],
) -> Verdict:
    matches = []
    for reading in readings.values():
        beside = "within" if reading.matches else "beyond"
        noise = "" if reading.noise is None else f", noise {reading.noise:.2g} pu"
        worst = reading.worst
        matches.append(
            f"{reading.signal} differs by {reading.rms:.2g} pu rms, {beside} the limit of "
            f"{reading.limit:.2g} pu, by {reading.residuals[worst]:+.2g} pu at most (point "
            f"{worst + 1}){noise}"
        )
    reason = "; ".join(matches)
    if fit is not None and not fit.result.success:
        return Verdict(NOT_CONVERGED, fit.result.message, causes)
    if not all(reading.matches for reading in readings.values()):
        return Verdict(NO_MATCH, reason, causes)
    if not all(parameter.determined for parameter in fitted.values()):
        return Verdict(MATCHES, reason, causes)
    return Verdict(GOOD, reason, causes)


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
