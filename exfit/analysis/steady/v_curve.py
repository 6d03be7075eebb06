"""V-curves: the field current that holds points on load, measured beside the machine's model."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.analysis.steady.field_on_load import field_on_load
from exfit.analysis.steady.point_fit import FittedPoints, PointProblem, fit_points
from exfit.errors import RecordError
from exfit.fitting.parameters import FreeParameter
from exfit.inference import ResidualBlock
from exfit.models.machines import Machine
from exfit.results.model import FittedParameter
from exfit.results.v_curve import FieldReading, PowerLevel, VCurve
from exfit.results.verdict import GOOD, MATCHES, NO_MATCH, NOT_CONVERGED, Verdict
from exfit.signals import NOISE
from exfit.util.text import show

Array = NDArray[np.float64]
Values = Mapping[str, float]

LARGEST_SHARE = 0.02  # of the rms of a field signal: what instruments and model may leave
LARGEST_NOISES = 3.0  # times the noise that is given
LEVEL_GAP = 0.04  # pu of power, between points of one level and those of the next
SALIENCY = "saliency"  # (1 - Xq / Xd)^2, in which the field current is smooth up to Xq = Xd
UP_TO_XD = "has no upper limit: the points do not exclude Xq = Xd"
CURVE_POINTS = 101  # of the model's curve of a level, odd: one lies at its middle
WIDER = 0.1  # of the range of q: how far the model's curve goes beyond the points


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
    readings: Mapping[str, FieldMeasurement]


def v_curve(
    machine: Machine,
    data: Values,
    points: PointsOnLoad,
    free: Sequence[FreeParameter] = (),
    limit: float | None = None,
) -> VCurve:
    """Return the points beside the machine's model, after a fit of its ``free`` data if there are.

    Args:
        machine: the model.
        data: a value for each symbol of its sheet.
        points: with readings of ``ifd``, ``efd`` or both.
        free: machine data by symbol, which the points are fitted for beside the free bases.
        limit: largest rms of the residuals of a field signal that counts as a match, pu; None:
            LARGEST_SHARE of its rms, or LARGEST_NOISES times its noise where that is larger.

    Raises RecordError for a point at which the model has no rest.

    Source: IEEE Std 115, cf. the saturation curves and the excitation on load; the model's
    equations are those of its dynamics at rest.
    """
    _refuse_no_rest(machine, data, points)
    fields = FieldsOnLoad(machine, points)
    problem = fields.problem(data, free)
    fit = fields.fit(problem) if problem.free else None
    values = problem.given if fit is None else fit.values
    readings = {
        signal: _reading_of(signal, fields, values, fit, limit) for signal in points.readings
    }
    fitted = {} if fit is None else _parameters(fields, problem.free, fit)
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
        verdict=_verdict(readings, fitted, fit),
        undetermined=() if fit is None else fit.undetermined,
        notes=() if fit is None else fit.notes,
        levels=tuple(power_levels(machine, machine_data, points)),
    )


@dataclass(frozen=True, eq=False)
class FieldsOnLoad:
    """The field signals at points on load, by a machine's model."""

    machine: Machine
    points: PointsOnLoad

    def problem(self, data: Values, free: Sequence[FreeParameter]) -> PointProblem:
        """Return the fit of free machine data, and of the bases that are free."""
        readings = self.points.readings
        bases = {base_of(signal): reading.base for signal, reading in readings.items()}
        free_bases = [reading.free_base for reading in readings.values() if reading.free_base]
        parameters = (*free, *free_bases)
        priors = {each.name: each.prior for each in parameters if each.prior is not None}
        return PointProblem(self.errors, {**data, **bases}, parameters, self.blocks, priors)

    def fit(self, problem: PointProblem) -> FittedPoints:
        """Return the fit of what is free."""
        fit = fit_points(problem, self.search(problem))
        known = fit.confidence.parameters.get("Xq")
        if known is None or known.interval is None or known.interval[1] is not None:
            return fit
        quadrature = next(each for each in problem.free if each.name == "Xq")
        if quadrature.high < fit.values["Xd"]:
            return fit
        return fit.explained("Xq", UP_TO_XD)

    def search(self, problem: PointProblem) -> PointProblem:
        """Return the same problem with SALIENCY free in place of Xq.

        By Xq itself the field current is stationary where Xq = Xd: a descent that comes there finds
        no way back, and beyond it the same field currents return.
        """
        quadrature = next((each for each in problem.free if each.name == "Xq"), None)
        if quadrature is None:
            return problem
        start = {**problem.given, **{each.name: each.start for each in problem.free}}
        share = min(quadrature.start / start["Xd"], 1.0)
        saliency = FreeParameter(SALIENCY, (1.0 - share) ** 2, 0.0, 1.0, logarithmic=False)

        def following(values: dict[str, float]) -> dict[str, float]:
            xq = values["Xd"] * (1.0 - sqrt(values[SALIENCY]))
            return values | {"Xq": min(max(xq, quadrature.low), quadrature.high)}

        return replace(
            problem,
            free=tuple(saliency if each is quadrature else each for each in problem.free),
            following=following,
        )

    @property
    def blocks(self) -> tuple[ResidualBlock, ...]:
        """Where the errors of each field signal are."""
        count = len(self.points.p)
        return tuple(
            ResidualBlock(
                signal,
                slice(k * count, (k + 1) * count),
                noise=None if reading.noise is None else 1.0,
                weight=weight_of(signal, reading),
            )
            for k, (signal, reading) in enumerate(self.points.readings.items())
        )

    def errors(self, values: Values) -> Array:
        """Return the weighted errors of all field signals; nan where the data contradict."""
        readings = self.points.readings
        if any(True for _ in self.machine.faults(values)):
            return np.full(len(self.points.p) * len(readings), np.nan)
        ifd = self.simulated({**values, "Xq": min(values["Xq"], values["Xd"])})
        # in shares of the base at the start: the weights of the readings stay as they are
        errors = [
            weight_of(signal, reading)
            * (ifd * values[base_of(signal)] - reading.measured)
            / reading.base
            for signal, reading in readings.items()
        ]
        return np.concatenate(errors)

    def simulated(self, values: Values) -> Array:
        """Return the model's field current (M,), which is its field voltage at rest."""
        data = {row.symbol: values[row.symbol] for row in self.machine.sheet}
        return field_on_load(self.machine, data, self.points.p, self.points.q, self.points.vt)


def base_of(signal: str) -> str:
    """Return the name of the base of a field signal."""
    return f"{signal}.base"


def weight_of(signal: str, reading: FieldMeasurement) -> float:
    """Return the weight of the errors of a field signal: one over its noise, or a typical one."""
    return 1.0 / (NOISE[signal] if reading.noise is None else reading.noise)


def power_levels(machine: Machine, data: Values, points: PointsOnLoad) -> Iterator[PowerLevel]:
    """Yield the levels of power of some points, the lowest first, with the model's curves."""
    order = np.argsort(points.p, kind="stable")
    ends = np.flatnonzero(np.diff(points.p[order]) > LEVEL_GAP) + 1
    for rows in np.split(order, ends):
        p, low, high = float(np.mean(points.p[rows])), points.q[rows].min(), points.q[rows].max()
        beyond = WIDER * (points.q.max() - points.q.min())
        q = np.linspace(low - beyond, high + beyond, CURVE_POINTS)
        vt = _voltage_along(points.q[rows], points.vt[rows], q)
        ifd = field_on_load(machine, data, np.full_like(q, p), q, vt)
        it = np.hypot(p, q) / vt
        yield PowerLevel(p, tuple(int(row) for row in np.sort(rows)), q, vt, it, ifd)


def _voltage_along(q: Array, vt: Array, curve: Array) -> Array:
    """Return the voltages on the line through those of some points, their mean for one q."""
    spread = q - np.mean(q)
    square = float(spread @ spread)
    slope = float(spread @ vt) / square if square > 0.0 else 0.0
    inside = np.clip(curve, q.min(), q.max())
    return np.asarray(np.mean(vt) + slope * (inside - np.mean(q)))


def _refuse_no_rest(machine: Machine, data: Values, points: PointsOnLoad) -> None:
    ifd = field_on_load(machine, data, points.p, points.q, points.vt)
    for row in np.flatnonzero(~np.isfinite(ifd))[:1]:
        place = f"p {show(points.p[row])}, q {show(points.q[row])}, vt {show(points.vt[row])} pu"
        raise RecordError(f"point {row + 1} ({place}): the machine has no rest there")


def _reading_of(
    signal: str,
    fields: FieldsOnLoad,
    values: Values,
    fit: FittedPoints | None,
    limit: float | None,
) -> FieldReading:
    reading, base = fields.points.readings[signal], values[base_of(signal)]
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
            unit=fields.points.readings[signal].unit if row is None else row.unit,
            meaning=f"1 pu of {signal}" if row is None else row.meaning,
            physical=row is None or row.is_physical(value),
        )
    return fitted


def _verdict(
    readings: Mapping[str, FieldReading],
    fitted: Mapping[str, FittedParameter],
    fit: FittedPoints | None,
) -> Verdict:
    reason = "; ".join(map(_match, readings.values()))
    if fit is not None and not fit.result.success:
        return Verdict(NOT_CONVERGED, fit.result.message)
    if not all(reading.matches for reading in readings.values()):
        return Verdict(NO_MATCH, reason)
    if not all(parameter.determined for parameter in fitted.values()):
        return Verdict(MATCHES, reason)
    return Verdict(GOOD, reason)


def _match(reading: FieldReading) -> str:
    """Return how a field signal matches, in words: rms beside the limit, and the noise."""
    beside = "within" if reading.matches else "beyond"
    noise = "" if reading.noise is None else f", noise {reading.noise:.2g} pu"
    worst = reading.worst
    return (
        f"{reading.signal} differs by {reading.rms:.2g} pu rms, {beside} the limit of "
        f"{reading.limit:.2g} pu, by {reading.residuals[worst]:+.2g} pu at most (point "
        f"{worst + 1}){noise}"
    )
