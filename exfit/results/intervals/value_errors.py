"""Values that a fit takes as given: what they move, and intervals that allow for their errors."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.errors import SimulationError
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals
from exfit.fitting.system import typical_values_used
from exfit.fitting.uncertainty import GivenError, UncertaintyAnalysis, linearisation, slopes_of
from exfit.inference.confidence import NORMAL, UNDETERMINED, Uncertainty, closed
from exfit.results.influences import DEVIATION, TypicalValue
from exfit.results.intervals.determination import without_linear_intervals
from exfit.util.arrays import Array
from exfit.util.text import digits, listed

IN_STANDARD_ERRORS = 2.0  # half of a 95 % interval, where none is known
UNSEEN = 1e-9  # of the largest singular value: rounding
TINY = float(np.finfo(float).tiny)  # where the errors given leave nothing of a variance


class ErrorsOfValues(NamedTuple):
    """Standard errors of given values, with effects; ``without`` has those without derivatives."""

    given: Mapping[str, GivenError]
    without: tuple[str, ...] = ()


def errors_of_values(case: Case, problem: FitProblem, theta: Array) -> ErrorsOfValues:
    """Estimate what standard errors of given values move at the minimum theta (N,)."""
    residuals = problem.compressed
    std_errors = case.std_errors()
    std_errors = {name: std_errors[name] for name in std_errors if name in residuals.fixed}
    if not std_errors:
        return ErrorsOfValues({})
    shifts = shifts_by_values(residuals, theta, std_errors, bounds_hold=False)
    if shifts is None:
        return ErrorsOfValues({}, tuple(std_errors))
    names = [free.name for free in residuals.free]
    given = {
        name: GivenError(std_error, dict(zip(names, column.tolist(), strict=True)))
        for (name, std_error), column in zip(std_errors.items(), shifts.T, strict=True)
        if column.any()
    }
    return ErrorsOfValues(given)


def allowing_for(
    errors: ErrorsOfValues,
    uncertainty: UncertaintyAnalysis,
    problem: FitProblem,
    theta: Array,
    of_record: tuple[str, ...],
) -> UncertaintyAnalysis:
    """Return the uncertainty with standard errors and intervals that allow for those of values.

    Each value adds the square of its first-order shift to the variance of a parameter, and the
    square of 1.96 times that shift to that of each side of its interval, in scaled parameters; an
    open side stays open. The values count as independent of each other and of the noise.
    Correlation and covariance remain those of the records alone. As in `confidence` there is no
    interval where the standard error exceeds UNDETERMINED; where a profile took the place of
    linear theory, where the shift alone does.

    Source: JCGM 100:2008, section 5.1.2, the law of propagation of uncertainty.
    """
    if errors.without:
        why = (
            f"has no interval: no finite derivatives by {listed(errors.without)}, given with errors"
        )
        return without_linear_intervals(uncertainty, uncertainty.confidence.names, why)
    if not errors.given:
        return uncertainty
    sizes = linearisation(problem, theta, of_record).own_size
    widened, given = {}, errors.given
    for parameter, x, size in zip(problem.residuals.free, theta, sizes, strict=True):
        own, name = uncertainty.confidence.parameters[parameter.name], parameter.name
        shift = hypot(*(error.shifts[name] for error in given.values()))
        widened[name] = widened_by(shift, own, parameter, float(x), float(size), [*given])
    return replace(uncertainty, given_errors=given).with_parameters(widened)


def allowing_for_bias(
    uncertainty: UncertaintyAnalysis, problem: FitProblem, theta: Array, of_record: tuple[str, ...]
) -> UncertaintyAnalysis:
    """Return the uncertainty with that of the bias by the noise of driving signals, at theta (N,).

    That bias was taken out: it is as uncertain as the variance of the noise.
    """
    residuals = problem.residuals
    if all(experiment.whitening is None for experiment in residuals.experiments):
        return uncertainty
    from exfit.inference.whitening import BIAS_KNOWN_TO

    jacobian = residuals.errors(theta)[1]
    bias = np.linalg.lstsq(jacobian, -residuals.shift, rcond=UNSEEN)[0]
    sizes = linearisation(problem, theta, of_record).own_size
    widened = {}
    for parameter, x, size, moved in zip(residuals.free, theta, sizes, bias, strict=True):
        shift = BIAS_KNOWN_TO * abs(float(moved) * parameter.slope(float(x)))
        own = uncertainty.confidence.parameters[parameter.name]
        widened[parameter.name] = widened_by(
            shift, own, parameter, float(x), float(size), ["the noise of the driving signals"]
        )
    return uncertainty.with_parameters(widened)


def given_error_notes(
    uncertainty: UncertaintyAnalysis, of_record: Collection[str]
) -> Iterator[str]:
    """Yield which errors of values the intervals include, and what of the unit these widen most."""
    given, parameters = uncertainty.given_errors, uncertainty.confidence.parameters
    if not given:
        return
    ratios = {}
    for name, own in parameters.items():
        if own.std_error and name not in of_record:
            by_given = sum(error.shifts[name] ** 2 for error in given.values())
            ratios[name] = own.std_error / sqrt(max(own.std_error**2 - by_given, TINY))
    text = f"the intervals include the errors of {listed([*given])} (given)"
    if ratios:
        widest = max(ratios, key=lambda name: ratios[name])
        value = max(given, key=lambda name: abs(given[name].shifts[widest]))
        times = f"the standard error of {widest} is {digits(ratios[widest])} times as large"
        text += f": {times}, most by {value}" if len(given) > 1 else f": {times}"
    yield text


def widened_by(
    shift: float,
    own: Uncertainty,
    parameter: FreeParameter,
    scaled: float,
    size: float,
    names: Sequence[str],
) -> Uncertainty:
    """Widen the uncertainty of a parameter by a shift for the errors of values.

    ``size`` is what counts as 100 %; ``names`` are those of the values.
    """
    linear = own.std_error if own.method == "linear" else None
    share, value = hypot(linear or 0.0, shift) / size, parameter.value(scaled)
    std_error = None if own.std_error is None else hypot(own.std_error, shift)
    relative = std_error / abs(value) if std_error is not None and value else None
    wider = own._replace(std_error=std_error, relative_error=relative)
    if own.interval is None:
        return wider
    if share > UNDETERMINED:
        why = f"is not determined for the errors of {listed(names)}: standard error"
        return wider._replace(interval=None, why=f"{why} {digits(100.0 * share)} %")
    beyond = NORMAL * shift / parameter.slope(scaled)
    bounds = parameter.scaled(parameter.low), parameter.scaled(parameter.high)

    def moved(limit: float | None, sign: float) -> float | None:
        if limit is None:
            return None
        side = max(sign * (parameter.scaled(limit) - scaled), 0.0)
        return parameter.value(float(np.clip(scaled + sign * hypot(side, beyond), *bounds)))

    low, high = own.interval
    return wider._replace(interval=(moved(low, -1.0), moved(high, 1.0)))


def shifts_by_values(
    residuals: Residuals, theta: Array, deviations: Mapping[str, float], bounds_hold: bool = True
) -> Array | None:
    """Shift of each free parameter with each of K values, (N, K), in its own unit.

    ``deviations`` are those of the values by name. At the minimum theta (N,) the gradient stays
    zero, so that to first order the parameters move by -(J'J)^-1 J' dr/dv times the deviation of v:
    one Jacobian with a column more for each of these values gives both. A parameter on a bound
    stays there or, unless ``bounds_hold``, moves as if it were let go, the others as if it stayed.
    None where a derivative is not finite.

    Source: the implicit function theorem on the gradient, with the Gauss-Newton matrix.
    """
    given = {name: residuals.fixed[name] for name in deviations}
    added = [
        FreeParameter(name, value or deviations[name], -np.inf, np.inf, logarithmic=False)
        for name, value in given.items()
    ]
    fixed = {name: value for name, value in residuals.fixed.items() if name not in given}
    extended = replace(residuals, free=[*residuals.free, *added], fixed=fixed, counter=None)
    point = np.array([*theta, *(free.scaled(given[free.name]) for free in added)])
    try:
        jacobian = extended.exact(point) / slopes_of(extended, point)  # in their own units
    except SimulationError:
        return None
    if not np.isfinite(jacobian).all():
        return None
    count, values = len(residuals.free), residuals.values(theta)
    own, of_values = jacobian[:, :count], jacobian[:, count:] * [*deviations.values()]
    moving = np.array([free.bound(values[free.name]) is None for free in residuals.free])
    return first_order_shifts(own, of_values, moving, bounds_hold)


def first_order_shifts(
    own: Array, of_values: Array, moving: NDArray[np.bool_], bounds_hold: bool
) -> Array:
    """Shift of each parameter with changes of the residuals (M, K), (N, K).

    ``own`` (M, N) is the Jacobian by the parameters, ``moving`` (N,) those that lie on no bound.
    """
    shifts = np.zeros((own.shape[1], of_values.shape[1]))
    if not (bounds_hold or moving.all()):
        shifts = -_least_squares(own, of_values)
    shifts[moving] = -_least_squares(own[:, moving], of_values)
    return shifts


def _least_squares(matrix: Array, right: Array) -> Array:
    """Return X (N, K) with the least norm of matrix (M, N) X - right (M, K), of small columns too.

    Source: Golub & Van Loan 2013, section 5.3.
    """
    triangle = np.linalg.qr(np.hstack([matrix, right]), mode="r")
    own, other = np.split(triangle, [matrix.shape[1]], axis=1)
    size = np.linalg.norm(own, axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(own / size, other)[0] / size[:, None])


def influence_of_typical_values(
    case: Case, residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis
) -> dict[str, TypicalValue]:
    """Estimate the effect of each typical value that is not 0, were it DEVIATION larger.

    To first order, by `shifts_by_values`: nothing where a derivative is not finite. What matters
    are shifts of parameters of the unit by more than half their interval or, without one that has
    both ends, by more than two standard errors.
    """
    typical = {name: value for name, value in typical_values_used(case).items() if value}
    if not typical:
        return {}
    deviations = {name: DEVIATION * value for name, value in typical.items()}
    by_value = shifts_by_values(residuals, theta, deviations)
    if by_value is None:
        return {}
    half_widths = {}
    for symbol, own in uncertainty.confidence.parameters.items():
        if symbol in residuals.of_records:
            continue
        if closed(own.interval):
            half_widths[symbol] = 0.5 * (own.interval[1] - own.interval[0])
        elif own.std_error is not None:
            half_widths[symbol] = IN_STANDARD_ERRORS * own.std_error
    influence = {}
    for (name, value), column in zip(typical.items(), by_value.T, strict=True):
        moved = zip(residuals.free, column.tolist(), strict=True)
        shifts = {free.name: shift for free, shift in moved}
        shares = {
            symbol: abs(shifts[symbol]) / half_width
            for symbol, half_width in half_widths.items()
            if abs(shifts[symbol]) > half_width > 0.0
        }
        largest_first = dict(sorted(shares.items(), key=lambda each: -each[1]))
        influence[name] = TypicalValue(value, shifts, largest_first)
    return influence
