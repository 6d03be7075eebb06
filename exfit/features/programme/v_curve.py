"""V-curves: the field current that holds points on load, measured beside the machine's model."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exfit.errors import ModelError, RecordError
from exfit.estimate.solver import NotFinite
from exfit.features.programme.point_fit import (
    FittedPoints,
    PointProblem,
    allowing_for_errors,
    descended,
    fit_points,
)
from exfit.features.programme.result import (
    LARGEST_NOISES,
    LARGEST_SHARE,
    FieldReading,
    PowerLevel,
    VCurve,
)
from exfit.fitting.parameters import FreeParameter
from exfit.inference.linear import ResidualBlock
from exfit.models.machines import Machine
from exfit.plants.loaded_machine import Flow, loaded_at_rest
from exfit.plants.parts import Names
from exfit.results.cause import Cause
from exfit.results.model import FittedParameter
from exfit.results.verdict import GOOD, MATCHES, NO_MATCH, NOT_CONVERGED, Verdict
from exfit.signals import NOISE
from exfit.util.arrays import Array
from exfit.util.text import show

Values = Mapping[str, float]

SALIENCY = "saliency"  # (1 - Xq / Xd)^2, in which the field current is smooth up to Xq = Xd
UP_TO_XD = "has no upper limit: the points do not exclude Xq = Xd"
LEVEL_GAP = 0.04  # pu of power, between points of one level and those of the next
CURVE_POINTS = 101  # of the model's curve of a level, odd: one lies at its middle
WIDER = 0.1  # of the range of q: how far the model's curve goes beyond the points
MUCH_BETTER = 0.25  # of the cost: half of the rms
AS_GOOD = 1.5  # times the cost of the best: it explains the points as well
FARTHEST = 2.0  # times a value: as far as a trial goes
FEWEST_POINTS = 4  # of fewer one value explains too much
REVERSED = Cause(
    "the points are matched much better with q reversed",
    "q is positive where the machine is overexcited: give scale: -1",
)


class FieldMeasurement(NamedTuple):
    """Readings (M,) of a field signal in ``unit``, of which ``base`` is 1 pu.

    ``noise`` is their standard deviation, pu, where it is known; ``free_base`` says between which
    bounds the base is found, if it is not known.
    """

    measured: Array
    unit: str = "pu"
    base: float = 1.0
    noise: float | None = None
    free_base: FreeParameter | None = None


class PointsOnLoad(NamedTuple):
    """Points at rest, each (M,) per unit on the machine's base, and readings of its field."""

    p: Array
    q: Array
    vt: Array
    measurements: Mapping[str, FieldMeasurement]


def base_of(signal: str) -> str:
    """Return the name of the base of a field signal."""
    return f"{signal}.base"


def weight_of(signal: str, measurement: FieldMeasurement) -> float:
    """Return the weight of the errors of a field signal: one over its noise, or a typical one."""
    return 1.0 / (NOISE[signal] if measurement.noise is None else measurement.noise)


def field_on_load(
    machine: Machine, data: Values, p: ArrayLike, q: ArrayLike, vt: ArrayLike
) -> Array:
    """Return ifd (M,) that holds p, q and vt, each (M,), all per unit; efd at rest is the same.

    ``data`` has a value for every symbol of the machine's sheet. It is nan where no rest exists.

    Source: Kundur, Power System Stability and Control, 3.6.3 to 3.6.5 (steady state, on the
    machine's rotor axes); saturation as the machine's model has it.
    """
    active, reactive, voltage = (np.asarray(signal, np.float64) for signal in (p, q, vt))
    with np.errstate(all="ignore"):  # where a voltage is zero, too
        terminals = Flow(active / voltage, reactive / voltage, voltage, np.zeros_like(voltage))
        ifd = loaded_at_rest(voltage, terminals, machine, Names(**data)).ifd
    return np.asarray(ifd, np.float64)


@dataclass(frozen=True, eq=False)
class FieldsOnLoad:
    """The field signals at points on load, by a machine's model, as functions of its data."""

    machine: Machine
    points: PointsOnLoad

    def problem(self, data: Values, free: Sequence[FreeParameter]) -> PointProblem:
        """Return the fit of free machine data, and of the bases that are free."""
        measurements = self.points.measurements
        bases = {base_of(signal): measurement.base for signal, measurement in measurements.items()}
        free_bases = (measurement.free_base for measurement in measurements.values())
        parameters = (*free, *(base for base in free_bases if base is not None))
        priors = {each.name: each.prior for each in parameters if each.prior is not None}
        count = len(self.points.p)
        blocks = tuple(
            ResidualBlock(
                signal,
                slice(k * count, (k + 1) * count),
                noise=None if measurement.noise is None else 1.0,
                weight=weight_of(signal, measurement),
            )
            for k, (signal, measurement) in enumerate(measurements.items())
        )
        return PointProblem(self.errors, {**data, **bases}, parameters, blocks, priors)

    def fit(self, problem: PointProblem) -> FittedPoints:
        """Return the fit of what is free; raises ModelError where its start has no errors."""
        for symbol, text in self.machine.faults(problem.start):
            raise ModelError(f"{self.machine.name}: the fit starts from {symbol}: {text}")
        try:
            fit = fit_points(problem, search_of(problem))
        except NotFinite:
            text = "the start of the fit and the given values give the points no finite errors"
            raise ModelError(f"{self.machine.name}: {text}") from None
        known = fit.confidence.parameters.get("Xq")
        if known is None or known.interval is None or known.interval[1] is not None:
            return fit
        quadrature = next(each for each in problem.free if each.name == "Xq")
        if quadrature.high < fit.values["Xd"]:
            return fit
        parameters = {**fit.confidence.parameters, "Xq": known._replace(why=UP_TO_XD)}
        return replace(fit, confidence=replace(fit.confidence, parameters=parameters))

    def errors(self, values: Values) -> Array:
        """Return the weighted errors of all field signals; nan where the data contradict."""
        measurements = self.points.measurements
        if any(True for _ in self.machine.faults(values)):
            return np.full(len(self.points.p) * len(measurements), np.nan)
        ifd = self.simulated({**values, "Xq": min(values["Xq"], values["Xd"])})
        # in shares of the base at the start: the weights of the readings stay as they are
        errors = [
            weight_of(signal, measurement)
            * (ifd * values[base_of(signal)] - measurement.measured)
            / measurement.base
            for signal, measurement in measurements.items()
        ]
        return np.concatenate(errors)

    def cost(self, values: Values) -> float:
        """Return half the sum of the squares of the weighted errors."""
        errors = self.errors(values)
        return 0.5 * float(errors @ errors)

    def simulated(self, values: Values) -> Array:
        """Return the model's field current (M,), which is its field voltage at rest."""
        data = {row.symbol: values[row.symbol] for row in self.machine.sheet}
        return field_on_load(self.machine, data, self.points.p, self.points.q, self.points.vt)


def search_of(problem: PointProblem) -> PointProblem:
    """Return the same problem with SALIENCY free in place of Xq.

    By Xq itself the field current is stationary where Xq = Xd: a local optimisation that comes
    there does not leave it, and beyond it the same field currents return.
    """
    quadrature = next((each for each in problem.free if each.name == "Xq"), None)
    if quadrature is None:
        return problem
    share = min(quadrature.start / problem.start["Xd"], 1.0)
    saliency = FreeParameter(SALIENCY, (1.0 - share) ** 2, 0.0, 1.0, logarithmic=False)

    def following(values: dict[str, float]) -> dict[str, float]:
        xq = values["Xd"] * (1.0 - sqrt(values[SALIENCY]))
        return values | {"Xq": min(max(xq, quadrature.low), quadrature.high)}

    def leading(values: Values) -> Values:
        return {SALIENCY: (1.0 - min(values["Xq"] / values["Xd"], 1.0)) ** 2, **values}

    free = tuple(saliency if each is quadrature else each for each in problem.free)
    return replace(problem, free=free, following=following, leading=leading)


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

    Raises RecordError for a point at which the model has no steady state.

    Source: IEEE Std 115, cf. the saturation curves and the excitation on load; the model's
    equations are those of its dynamics at rest.
    """
    ifd = field_on_load(machine, data, points.p, points.q, points.vt)
    for row in np.flatnonzero(~np.isfinite(ifd))[:1]:
        place = f"p {show(points.p[row])}, q {show(points.q[row])}, vt {show(points.vt[row])} pu"
        raise RecordError(f"point {row + 1} ({place}): the machine has no steady state there")
    fields = FieldsOnLoad(machine, points)
    problem = fields.problem(data, free)
    fit = None
    if problem.free:
        fit = allowing_for_errors(problem, fields.fit(problem), std_errors)
    values = problem.given if fit is None else fit.values
    readings = {}
    for signal, reading in points.measurements.items():
        base = values[base_of(signal)]
        measured, noises = reading.measured / base, LARGEST_NOISES * (reading.noise or 0.0)
        usual = max(LARGEST_SHARE * float(np.sqrt(np.mean(measured**2))), noises)
        readings[signal] = FieldReading(
            signal=signal,
            unit=reading.unit,
            base=base,
            measured=measured,
            simulated=fields.simulated(values),
            noise=reading.noise,
            scatter=None if fit is None else fit.scatter(signal) / weight_of(signal, reading),
            limit=usual if limit is None else limit,
            base_fitted=reading.free_base is not None,
        )
    fitted = {} if fit is None else _parameters(fields, problem.free, fit)
    verdict = _verdict(readings, fitted, fit, causes_of(fields, values, problem))
    if verdict.misfit:
        fitted = {name: each.without_interval(verdict.no_interval) for name, each in fitted.items()}
    machine_data = {symbol: values[symbol] for symbol in data}
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


def _parameters(
    fields: FieldsOnLoad, free: Sequence[FreeParameter], fit: FittedPoints
) -> dict[str, FittedParameter]:
    rows = {row.symbol: row for row in fields.machine.sheet}
    fitted = {}
    for parameter in free:
        name, signal = parameter.name, parameter.name.partition(".")[0]
        row, unit = rows.get(name), ""
        if row is None:
            unit = fields.points.measurements[signal].unit
        fitted[name] = fit.parameter(parameter, row, unit, f"1 pu of {signal}")
    return fitted


def _verdict(
    readings: Mapping[str, FieldReading],
    fitted: Mapping[str, FittedParameter],
    fit: FittedPoints | None,
    causes: tuple[Cause, ...],
) -> Verdict:
    if fit is not None and not fit.result.success:
        return Verdict(NOT_CONVERGED, fit.result.message, causes)
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
    if not all(reading.matches for reading in readings.values()):
        return Verdict(NO_MATCH, reason, causes)
    determined = all(parameter.determined for parameter in fitted.values())
    return Verdict(GOOD if determined else MATCHES, reason, causes)


def causes_of(fields: FieldsOnLoad, values: Values, problem: PointProblem) -> tuple[Cause, ...]:
    """Find the things that, if another, would match the points much better, the likeliest first.

    One by one Xd, Xq, the saturation and each base that the problem does not fit is fitted as well,
    and the reactive power reversed; what the problem fits is fitted again from its start.
    """
    if len(fields.points.p) < FEWEST_POINTS:
        return ()
    saturation = [("S10", "S12")] if problem.given["S10"] > 0.0 else []
    bases = [(base_of(signal),) for signal in fields.points.measurements]
    fitted = {each.name for each in problem.free}
    turned = replace(fields, points=fields.points._replace(q=-fields.points.q))
    reverse = _minimum(replace(problem, errors=turned.errors))
    trials = [TrialOfPoints(inf if reverse is None else turned.cost(reverse))]
    for names in (("Xd",), ("Xq",), *saturation, *bases):
        if not fitted & {*names}:
            trials.append(_trial(fields, problem, names))
    most = MUCH_BETTER * fields.cost(values)
    better = sorted((each for each in trials if each.cost < most), key=lambda each: each.cost)
    return tuple(each.cause for each in better if each.cost <= AS_GOOD * better[0].cost)


class TrialOfPoints(NamedTuple):
    """The cost at which one thing more matches the points, and what that would mean."""

    cost: float
    cause: Cause = REVERSED


def _trial(fields: FieldsOnLoad, problem: PointProblem, names: Sequence[str]) -> TrialOfPoints:
    """Fit some values as well, each between half and twice of what it is."""
    given, rows = problem.given, {row.symbol: row for row in fields.machine.sheet}
    freed = []
    for name in names:
        low, high = given[name] / FARTHEST, given[name] * FARTHEST
        if name in rows:
            low, high = max(low, rows[name].low), min(high, rows[name].high)
        freed.append(FreeParameter(name, given[name], low, high, logarithmic=True))
    better = _minimum(replace(problem, free=(*freed, *problem.free)))
    if better is None:
        return TrialOfPoints(inf)
    words = " and ".join(f"{name} = {better[name]:.4g}" for name in names)
    instead = " and ".join(f"{given[name]:.4g}" for name in names)
    cause = Cause(
        f"the points are matched much better by {words} than by {instead}",
        f"check {'it' if names[0] in rows else 'the base'}, or let it be fitted",
    )
    return TrialOfPoints(fields.cost(better), cause)


def _minimum(problem: PointProblem) -> Values | None:
    """Find the values to which a local optimisation from those of a problem converges, if any."""
    if not problem.free:
        return problem.given
    search = search_of(problem)
    try:
        end = descended(search, np.array([each.scaled(each.start) for each in search.free]))
    except NotFinite:
        return None
    return search.values(end.x)
