"""Values that a fit takes as given: what they move, and intervals that allow for their errors."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from math import hypot, inf, sqrt
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.given_errors import given_std_errors
from exfit.errors import SimulationError
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.nuisances import Nuisance, prefix_from
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import (
    GivenError,
    UncertaintyAnalysis,
    linearisation,
    slopes_of,
    spread_of,
)
from exfit.inference.confidence import NORMAL, UNDETERMINED, Uncertainty, closed
from exfit.inference.noise import Noise, effective_samples
from exfit.plants import VT0
from exfit.results.influences import first_of
from exfit.results.intervals.determination import without_linear_intervals
from exfit.results.intervals.free_values import sides_with_values, starts_of_values
from exfit.util.arrays import Array
from exfit.util.text import digits, listed

NEGLIGIBLE = 1e-3  # of what all values move: one that moves less, as a limit that does not act
UNSEEN = 1e-9  # of the largest singular value: rounding


class Refinement(NamedTuple):
    """Given values that the record knows better, none perhaps; what explains it as well, in words.

    ``others`` are given values, ``rivals`` what belongs to a test or a record. Where one of these
    explains more ``by_rival`` is the fall of chi-square with it.
    """

    names: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    by_rival: float = 0.0


class RefinedValues(NamedTuple):
    """Given values that are fitted: in ``steps``, one after the other, each with its error.

    Where all were fitted at once and moved to where they are most likely, they are as ``given``;
    ``minima`` that are as likely have other values and parameters, the result itself none.
    """

    given: Mapping[str, float] = MappingProxyType({})
    steps: tuple[Refinement, ...] = ()
    minima: tuple[Mapping[str, float], ...] = ()


NONE_REFINED = RefinedValues()


class ErrorsOfValues(NamedTuple):
    """Standard errors of given values, with effects; ``without`` has those without derivatives.

    ``together`` is by how much they move each parameter in all, a standard error in its unit;
    ``sides`` is how far down and up it, or a value, may lie where the first order does not serve.
    ``left`` are the standard errors that the records leave of the values.
    """

    given: Mapping[str, GivenError]
    together: Mapping[str, float]
    without: tuple[str, ...] = ()
    sides: Mapping[str, tuple[float, float]] = MappingProxyType({})
    left: Mapping[str, float] = MappingProxyType({})


def errors_of_values(
    case: Case,
    problem: FitProblem,
    theta: Array,
    noises: Sequence[Noise],
    setups: Sequence[ExperimentSetup] = (),
    refined: RefinedValues = NONE_REFINED,
) -> ErrorsOfValues:
    """Estimate what standard errors of given values move at the minimum theta (N,).

    So do those of the voltages that tests start from, where these are means of their records
    (``setups``).

    The values are known beforehand to their standard errors S, and by the records, whose errors
    have the standard deviation of the ``noises`` of the channels. To first order the residuals r of
    the minimum, with the derivatives G by the values that the parameters cannot reproduce, give
    them a posterior mean v = -C (G'r + S^-2 m) and covariance C = (S^-2 + G'G)^-1, in which m is
    by how much a ``refined`` value was moved from what was given. The parameters, which were fitted
    with these values, are off by what v moves, and uncertain by what C does.

    Source: Gelman et al. 2013, section 14.8 (a prior as further data of a regression).
    """
    residuals = problem.compressed
    std_errors = given_std_errors(case)
    std_errors = {name: std_errors[name] for name in std_errors if name in residuals.fixed}
    levels = _with_levels_open(residuals, () if case.kind.plays_back else setups)
    std_errors |= levels[1]
    if not std_errors:
        return ErrorsOfValues({}, {})
    influence = influence_of_values(levels[0], theta, std_errors)
    if influence is None:
        return ErrorsOfValues({}, {}, tuple(std_errors))
    of_priors = np.full(len(residuals.priors), residuals.noise)
    spread = np.append(spread_of(residuals, noises), of_priors)
    known = influence.beyond / spread[:, None]
    precision = np.eye(len(std_errors)) + known.T @ known
    pull = known.T @ (residuals(theta) / spread) + _moved(residuals, refined.given, std_errors)
    mean = -np.linalg.solve(precision, pull)
    covariance = np.linalg.inv(precision)
    variance = np.sum(influence.shifts @ covariance * influence.shifts, axis=1)
    bias = _uncertain_bias(residuals, known / spread[:, None], precision)
    moves = influence.shifts @ np.column_stack([mean, bias])
    together = np.sqrt(variance + np.sum(moves**2, axis=1))
    left = influence.shifts * np.sqrt(np.diag(covariance))
    names = [free.name for free in residuals.free]
    effects = {
        name: GivenError(std_error, dict(zip(names, column.tolist(), strict=True)))
        for (name, std_error), column in zip(std_errors.items(), left.T, strict=True)
        if np.any(np.abs(column) > NEGLIGIBLE * together)
    }
    share = np.diag(known.T @ known @ covariance)  # of each value that the record knows
    chance = float(np.sum(share))
    surprising = -float(pull @ mean) > chance + 2.0 * sqrt(2.0 * chance)
    sides = dict[str, tuple[float, float]]()
    if case.external is None:
        acting = () if case.kind.finds_rest else setups  # limits: of an event that takes too long
        starts = [*starts_of_values(residuals, theta, std_errors, acting), *refined.minima]
        starts += [{}] * (surprising or not influence.moving.all())
        if starts:
            sides = sides_with_values(residuals, theta, std_errors, spread, starts, refined.given)
    known_to = np.sqrt(np.diag(covariance) + bias**2)
    by_record = dict(zip(std_errors, known_to.tolist(), strict=True))
    return ErrorsOfValues(
        effects,
        dict(zip(names, together.tolist(), strict=True)),
        sides=sides,
        left={name: by_record[name] * std_errors[name] for name in std_errors},
    )


def _moved(
    residuals: Residuals, given: Mapping[str, float], std_errors: Mapping[str, float]
) -> list[float]:
    """Return by how many of its errors each value was moved from what was given."""
    at = residuals.fixed
    pairs = std_errors.items()
    return [(at[name] - given[name]) / error if name in given else 0.0 for name, error in pairs]


def _uncertain_bias(residuals: Residuals, slopes: Array, precision: Array) -> Array:
    """Return what of the bias by the noise of driving signals is uncertain in K values, (K,).

    In their standard errors; ``slopes`` (M, K) are over the variance of the residuals.
    """
    if all(experiment.whitening is None for experiment in residuals.experiments):
        return np.zeros(len(precision))
    from exfit.inference.whitening import BIAS_KNOWN_TO

    moved = slopes[: residuals.count].T @ residuals.bias
    return BIAS_KNOWN_TO * np.asarray(np.linalg.solve(precision, moved))


def allowing_for(
    errors: ErrorsOfValues,
    uncertainty: UncertaintyAnalysis,
    problem: FitProblem,
    theta: Array,
    of_record: tuple[str, ...],
) -> UncertaintyAnalysis:
    """Return the uncertainty with standard errors and intervals that allow for those of values.

    They add the square of their first-order shift to the variance of a parameter, and the
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
    widened, given = dict[str, Uncertainty](), errors.given
    for parameter, x, size in zip(problem.residuals.free, theta, sizes, strict=True):
        own, name = uncertainty.confidence.parameters[parameter.name], parameter.name
        of_name = {value: abs(error.shifts[name]) for value, error in given.items()}
        names = sorted(of_name, key=lambda value: -of_name[value])
        shift = errors.together[name]
        sides = errors.sides.get(name, (0.0, 0.0))
        at = float(x), float(size)
        widened[name] = widened_by(shift, own, parameter, *at, names, sides)
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
    bias = np.linalg.lstsq(jacobian, -residuals.bias, rcond=UNSEEN)[0]
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
    text = f"the intervals include the errors of {first_of([*given])} (given)"
    ratios = {
        name: (own.interval[1] - own.interval[0]) / (own.by_noise[1] - own.by_noise[0])
        for name, own in parameters.items()
        if name not in of_record and closed(own.interval) and closed(own.by_noise)
    }
    if ratios:
        widest = max(ratios, key=lambda name: ratios[name])
        value = max(given, key=lambda name: abs(given[name].shifts[widest]))
        times = f"that of {widest} is {digits(ratios[widest])} times as wide as from noise alone"
        text += f": {times}, most by {value}" if len(given) > 1 else f": {times}"
    yield text


def widened_by(
    shift: float,
    own: Uncertainty,
    parameter: FreeParameter,
    scaled: float,
    size: float,
    names: Sequence[str],
    sides: Sequence[float] = (0.0, 0.0),
) -> Uncertainty:
    """Widen the uncertainty of a parameter by a shift for the errors of values.

    ``size`` is what counts as 100 %; ``names`` are those of the values; ``sides`` are the least
    distances of the ends of the interval.
    """
    shift = max(shift, *(side / NORMAL for side in sides))
    linear = own.std_error if own.method == "linear" else None
    share, value = hypot(linear or 0.0, shift) / size, parameter.value(scaled)
    std_error = None if own.std_error is None else hypot(own.std_error, shift)
    relative = std_error / abs(value) if std_error is not None and value else None
    by_noise = own.by_noise or own.interval
    wider = own._replace(std_error=std_error, relative_error=relative, by_noise=by_noise)
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


def _with_levels_open(
    residuals: Residuals, setups: Sequence[ExperimentSetup]
) -> tuple[Residuals, dict[str, float]]:
    """Leave open the voltages that are means of records at rest; return their standard errors."""
    experiments, std_errors = [*residuals.experiments], dict[str, float]()
    for number, setup in enumerate(setups):
        experiment, test, vt = experiments[number], setup.test, setup.record.signals.get("vt")
        if test.vt0 is not None or vt is None or VT0 not in experiment.own:
            continue
        rest = vt[(setup.record.time < (inf if test.steady is None else test.steady))]
        rest = rest[np.isfinite(rest)]
        if len(rest) > 1 and np.ptp(rest) > 0.0:
            level = Nuisance(f"{prefix_from(setup.name)}{VT0}", "vt0")
            experiments[number] = replace(experiment, nuisances=(*experiment.nuisances, level))
            std_errors[level.name] = float(np.std(rest)) / sqrt(effective_samples(rest))
    return replace(residuals, experiments=experiments, counter=None), std_errors


class Influence(NamedTuple):
    """What K values do at a minimum: to the N parameters, in their units, and to the residuals.

    ``beyond`` (M, K) is what the parameters cannot reproduce; those that ``moving`` (N,) masks lie
    on no bound.
    """

    shifts: Array
    beyond: Array
    moving: NDArray[np.bool_]


def influence_of_values(
    residuals: Residuals, theta: Array, deviations: Mapping[str, float]
) -> Influence | None:
    """Return what deviations of K values would move at the minimum theta (N,).

    ``deviations`` are those of the values by name. The gradient stays zero, so that to first order
    the parameters move by -(J'J)^-1 J' dr/dv times the deviation of v: one Jacobian with a column
    more for each of these values gives both. A parameter on a bound moves as if it were let go,
    the others as if it stayed. None where a derivative is not finite.

    Source: the implicit function theorem on the gradient, with the Gauss-Newton matrix.
    """
    levels = {
        own.name: each.own[VT0]
        for each in residuals.experiments
        for own in each.nuisances
        if own.name in deviations
    }
    given = {name: levels.get(name, residuals.fixed.get(name, 0.0)) for name in deviations}
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
    shifts = first_order_shifts(own, of_values, moving)
    return Influence(shifts, of_values + own[:, moving] @ shifts[moving], moving)


def first_order_shifts(own: Array, of_values: Array, moving: NDArray[np.bool_]) -> Array:
    """Shift of each parameter with changes of the residuals (M, K), (N, K).

    ``own`` (M, N) is the Jacobian by the parameters, ``moving`` (N,) those that lie on no bound.
    """
    shifts = np.zeros((own.shape[1], of_values.shape[1]))
    if not moving.all():
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
