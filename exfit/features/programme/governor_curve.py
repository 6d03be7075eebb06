"""A governor's gate over the power at rest, and its droop and dead band where the speed wanders."""

import re
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Literal

import numpy as np

from exfit.dsp.noise import noise
from exfit.errors import ModelError, RecordError
from exfit.estimate.solver import NotFinite
from exfit.features.programme.point_fit import FittedPoints, PointProblem, fit_points
from exfit.features.programme.result import (
    LARGEST_NOISES,
    LARGEST_SHARE,
    FieldReading,
    GovernorCurve,
)
from exfit.fitting.parameters import FreeParameter
from exfit.inference.linear import ResidualBlock
from exfit.models.governor_parts import outside_band
from exfit.models.sheet import Model
from exfit.plants.controls import gate_of
from exfit.plants.parts import Names
from exfit.results.model import FittedParameter
from exfit.results.verdict import GOOD, MATCHES, NO_MATCH, NOT_CONVERGED, Verdict
from exfit.signals import NOISE
from exfit.util.arrays import Array
from exfit.util.text import show

Values = Mapping[str, float]
Answer = Literal["gate", "p"]

# the droop of a governor or its inverse, by symbol
DROOPS, GAINS = ("R", "Rperm", "Rgate", "Relec", "Rg", "Re"), ("K",)
# what is found of a record beside the governor
LEVEL, LAG, SHARE = "level", "lag", "share"
MEANINGS = {
    LEVEL: ("pu", "at rated speed"),
    LAG: ("s", "lag behind the speed"),
    SHARE: ("1", "share that is not behind it"),
}
STANDS_IN = "stands for all of the governor's lags"
SETTLING = 0.05  # of a record: not compared, what was before it still acts
LONGEST_LAG, SHORTEST_LAG = 0.1, 0.05  # of the record; of its sampling
EVEN = 0.01  # of the sampling: by how much one interval may differ
FEWEST = 100  # samples of a record


def gates_at_rest(governor: Model, data: Values, power: Array) -> Array:
    """Return the gate (M,) at which a governor with these data holds a power (M,), per unit."""
    state, values = gate_of(governor) or "", Names(**data)
    gates = []
    with np.errstate(all="ignore"):
        for p in power:
            x = SimpleNamespace()
            governor.rest(p, Names(dw=0.0, p=p), values, x)
            gates.append(getattr(x, state))
    return np.array(gates, dtype=float)


def lagged(u: Array, share: float) -> Array:
    """Behind 1 / (1 + sT), T over the sampling a ``share``: u (M,) is straight between samples."""
    a = np.exp(-1.0 / share)
    mean = share * (1.0 - a)
    kernel = np.concatenate([[1.0 - mean], (mean * (1.0 - a)) * a ** np.arange(len(u) - 1)])
    size = 2 * len(u)
    moved = np.fft.irfft(np.fft.rfft(u - u[0], size) * np.fft.rfft(kernel, size), size)
    return np.asarray(u[0] + moved[: len(u)])


def gate_curve(
    governor: Model,
    data: Values,
    power: Array,
    gate: Array,
    free: Sequence[FreeParameter],
    limit: float | None = None,
) -> GovernorCurve:
    """Return the gate over the power at rest beside the governor's model, fitted for its data.

    Args:
        governor: the model.
        data: a value for each symbol of its sheet.
        power: p (M,), per unit on the machine's base.
        gate: its opening (M,), 1 fully open.
        free: data by symbol, which the points are fitted for.
        limit: largest rms of the residuals that counts as a match; None: LARGEST_SHARE of the rms.

    Raises ModelError for a governor without a gate, and where the start has no rest.
    """
    if gate_of(governor) is None:
        raise ModelError(f"{governor.name} has no state that is the gate")

    def simulated(values: Values) -> Array:
        return gates_at_rest(
            governor, {row.symbol: values[row.symbol] for row in governor.sheet}, power
        )

    return _fitted(governor, data, ("p", power), ("gate", gate), simulated, free, limit)


def droop_curve(
    governor: Model,
    data: Values,
    time: Array,
    speed: Array,
    answer: tuple[Answer, Array],
    free: Sequence[FreeParameter],
    limit: float | None = None,
) -> GovernorCurve:
    """Return what a governor's gate or power does while the speed wanders, fitted for its droop.

    It is ``level`` less the speed outside the dead band, over the droop, behind a ``lag``; both are
    found, too. Of the record (M,), evenly sampled, with a reference that stays, the beginning is
    not compared. Arguments as of ``gate_curve``; ``answer`` is named. The usual limit is
    LARGEST_SHARE of its rms about the mean, or LARGEST_NOISES times its noise if that is larger.

    Raises RecordError for samples that are not even or an answer that never changes, ModelError for
    a governor without a droop.
    """
    symbols = [each.name for each in free] + [row.symbol for row in governor.sheet]
    droop = next((name for name in symbols if name in (*DROOPS, *GAINS)), None)
    if droop is None:
        raise ModelError(f"{governor.name} has no droop among {', '.join((*DROOPS, *GAINS))}")
    steps, (name, measured) = np.diff(time), answer
    if len(time) < FEWEST or np.min(steps) <= 0.0 or np.ptp(steps) > EVEN * np.median(steps):
        raise RecordError(f"time: {FEWEST} samples and more at even intervals are needed")
    sampling, first = float(np.median(steps)), int(np.ceil(SETTLING * len(time)))
    rating = data["Trate_Mbase"] if name == "p" else 1.0

    def simulated(values: Values) -> Array:
        band = Names(DBH=values.get("DBH", 0.0), DBL=values.get("DBL", 0.0))
        gain = values[droop] if droop in GAINS else 1.0 / values[droop]
        outside = rating * gain * outside_band(speed - 1.0, band)
        behind = lagged(outside, values[LAG] / sampling)
        response = values[LEVEL] - behind - values[SHARE] * (outside - behind)
        return np.asarray(response[first:])

    spread, middle = float(np.ptp(measured)), float(np.mean(measured))
    if spread == 0.0:
        raise RecordError(f"{name}: {show(middle)} pu throughout: no response to the speed")
    longest = LONGEST_LAG * float(time[-1] - time[0])
    found = (
        FreeParameter(LEVEL, middle, middle - spread, middle + spread, logarithmic=False),
        FreeParameter(LAG, 3.0 * sampling, SHORTEST_LAG * sampling, longest, logarithmic=True),
        FreeParameter(SHARE, 0.3, 0.0, 1.0, logarithmic=False),
    )
    points = ("speed", speed[first:]), (name, measured[first:])
    return _fitted(governor, data, *points, simulated, (*free, *found), limit)


def _fitted(
    governor: Model,
    data: Values,
    over: tuple[str, Array],
    answer: tuple[str, Array],
    simulated: Callable[[Values], Array],
    free: Sequence[FreeParameter],
    limit: float | None,
) -> GovernorCurve:
    (x_name, x), (name, measured) = over, answer
    weight = 1.0 / NOISE[name]
    block = ResidualBlock(name, slice(0, len(measured)), noise=None, weight=weight)

    def errors(values: Values) -> Array:
        return weight * (simulated(values) - measured)

    values, fit = dict(data), None
    if free:
        problem = PointProblem(errors, data, tuple(free), (block,), {})
        try:
            fit = fit_points(problem, problem)
        except NotFinite:
            text = "the start of the fit and the given values give the points no finite errors"
            raise ModelError(f"{governor.name}: {text}") from None
        values = fit.values
    response = simulated(values)
    if not np.isfinite(response).all():
        at = int(np.argmin(np.isfinite(response)))
        raise RecordError(f"point {at + 1} ({x_name} {show(x[at])} pu): the governor has no rest")
    noises = LARGEST_NOISES * noise(measured) if x_name == "speed" else 0.0
    about = measured if x_name == "p" else measured - np.mean(measured)
    moved = float(np.sqrt(np.mean(about**2)))
    usual = max(LARGEST_SHARE * moved, noises)
    scatter = None if fit is None else fit.scatter(name) / weight
    reading = FieldReading(name, "pu", 1.0, measured, response, None, scatter, limit or usual)
    parameters = {} if fit is None else _parameters(governor, free, fit)
    return GovernorCurve(
        governor=governor.name,
        over=x_name,
        x=x,
        reading=reading,
        parameters=parameters,
        verdict=_verdict(reading, parameters, fit, moved),
        undetermined=() if fit is None else tuple(filter(_of_governor, fit.undetermined)),
        notes=() if fit is None else fit.notes,
    )


def _of_governor(sentence: str) -> bool:
    return not {LAG, SHARE} & {*re.findall(r"\w+", sentence)}


def _parameters(
    governor: Model, free: Sequence[FreeParameter], fit: FittedPoints
) -> dict[str, FittedParameter]:
    rows, found = {row.symbol: row for row in governor.sheet}, {}
    for each in free:
        own = fit.parameter(each, rows.get(each.name), *MEANINGS.get(each.name, ("", "")))
        found[each.name] = own.without_interval(STANDS_IN) if each.name in (LAG, SHARE) else own
    return found


def _verdict(
    reading: FieldReading,
    parameters: Mapping[str, FittedParameter],
    fit: FittedPoints | None,
    moved: float,
) -> Verdict:
    if fit is not None and not fit.result.success:
        return Verdict(NOT_CONVERGED, fit.result.message)
    beside = "within" if reading.matches else "beyond"
    reason = (
        f"{reading.signal} differs by {reading.rms:.2g} pu rms, {beside} the limit of "
        f"{reading.limit:.2g} pu; it is {moved:.2g} pu rms"
    )
    if not reading.matches or reading.rms >= moved:
        return Verdict(NO_MATCH, reason)
    determined = all(each.determined for each in parameters.values() if not each.of_record)
    return Verdict(GOOD if determined else MATCHES, reason)
