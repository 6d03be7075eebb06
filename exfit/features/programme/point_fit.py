"""A fit of points: few residuals, whose functions are cheap, so that every interval is profiled."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import hypot, isfinite
from typing import NamedTuple

import numpy as np

from exfit import estimate
from exfit.fitting.parameters import FreeParameter, Prior, units_of
from exfit.fitting.uncertainty import shared_reason
from exfit.inference.confidence import Confidence, confidence, rises
from exfit.inference.identifiability import Identifiability, identifiability
from exfit.inference.linear import Linearisation, PriorRow, ResidualBlock
from exfit.models.sheet import Parameter
from exfit.results.intervals.determination import of_profiles
from exfit.results.intervals.value_errors import first_order_shifts, widened_by
from exfit.results.model import FittedParameter
from exfit.util.arrays import Array
from exfit.util.text import listed

Values = Mapping[str, float]

DIFFERENCE = 6e-6  # of a scaled parameter: where the error of a central difference is least
DIFFERENCE_ERROR = 1e-9  # of the Jacobian, as a share of its largest singular value
POINTS_OF_PROFILE = 3  # of a side: only its end is asked for
STRATEGY = "lm-then-dgn"
MOST_DESCENTS = 4  # each to a lower minimum than the one before
STEP = 0.01  # of a standard error, to either side: small beside what curves the residuals


@dataclass(frozen=True, eq=False)
class PointProblem:
    """Residuals of points as functions of what is ``free``.

    ``errors(values)`` gives the weighted errors (M,), simulated less measured, nan for values that
    contradict each other; ``given`` are the values of all that is not free; ``blocks`` say which
    errors belong to which signal. An error of 1 is as large as its noise, as far as that is known.
    ``priors`` are those of values by name; ``following`` adds the values that follow from the free
    ones, ``leading`` the free ones that some values follow from.
    """

    errors: Callable[[Values], Array]
    given: Values
    free: tuple[FreeParameter, ...]
    blocks: tuple[ResidualBlock, ...]
    priors: Mapping[str, Prior]
    following: Callable[[dict[str, float]], dict[str, float]] = dict
    leading: Callable[[Values], Values] = dict

    @property
    def start(self) -> dict[str, float]:
        """All values at the start."""
        return {**self.given, **{each.name: each.start for each in self.free}}

    def values(self, theta: Array) -> dict[str, float]:
        """Return all values at scaled parameters (N,)."""
        pairs = zip(self.free, theta, strict=True)
        free = {each.name: each.value(float(x)) for each, x in pairs}
        return self.following({**self.given, **free})

    def theta(self, values: Values) -> Array:
        """Return the scaled parameters (N,) of some values."""
        known = self.leading(values)
        return np.array([each.scaled(known[each.name]) for each in self.free])

    def residuals(self, theta: Array) -> Array:
        """Return the weighted errors, then what priors add, (M + P,)."""
        values = self.values(theta)
        priors = [(values[name] - prior.mean) / prior.std for name, prior in self.priors.items()]
        return np.concatenate([self.errors(values), priors])

    def jacobian(self, theta: Array) -> Array:
        """Return the derivatives (M + P, N) to the scaled parameters, by differences in bounds.

        Where there are no errors on one side of a value, as of S10 beside S12, they are taken on
        the other.
        """
        low, high = self.bounds
        columns = []
        for k, x in enumerate(theta):
            ends = np.clip([x - DIFFERENCE, x + DIFFERENCE], low[k], high[k])
            moved = np.tile(theta, (2, 1))
            moved[:, k] = ends
            below, above = map(self.residuals, moved)
            if not np.isfinite(below).all():
                ends[0], below = x, self.residuals(theta)
            elif not np.isfinite(above).all():
                ends[1], above = x, self.residuals(theta)
            columns.append((above - below) / (ends[1] - ends[0]))
        return np.stack(columns, axis=1)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The bounds of the scaled parameters, each (N,)."""
        limits = [(each.scaled(each.low), each.scaled(each.high)) for each in self.free]
        low, high = np.array(limits).T
        return low, high

    def linearisation(self, values: Values) -> Linearisation:
        """Return the errors and their derivatives at some values."""
        free, theta, errors = self.free, self.theta(values), self.errors(values)
        return Linearisation(
            names=tuple(each.name for each in free),
            units=("",) * len(free),
            values=np.array([values[each.name] for each in free]),
            logarithmic=np.array([each.logarithmic for each in free]),
            width=np.array([each.width for each in free]),
            held=tuple(each.bound(values[each.name]) for each in free),
            errors=errors,
            jacobian=self.jacobian(theta)[: len(errors)] / self.slopes(theta),
            influence=errors,
            curvature=np.ones(len(errors)),
            channels=self.blocks,
            priors=tuple(
                PriorRow(k, self.priors[each.name].mean, self.priors[each.name].std, 1.0)
                for k, each in enumerate(free)
                if each.name in self.priors
            ),
            through_zero=tuple(each.low < 0.0 < each.high for each in free),
        )

    def slopes(self, theta: Array) -> Array:
        """Return the derivatives of the free values (N,) by their scaled parameters."""
        return np.array([each.slope(float(x)) for each, x in zip(self.free, theta, strict=True)])


@dataclass(frozen=True, eq=False)
class FittedPoints:
    """The best values of a fit of points, and how well these determine them.

    The intervals allow for the errors of the given values that ``allowed_for`` names.
    """

    values: dict[str, float]
    result: estimate.Result
    confidence: Confidence
    identifiability: Identifiability
    allowed_for: tuple[str, ...] = ()

    def scatter(self, signal: str) -> float:
        """Return the standard deviation of a signal's weighted errors, less what was fitted."""
        return next(noise.estimated for noise in self.confidence.noise if noise.label == signal)

    def parameter(
        self, free: FreeParameter, row: Parameter | None, unit: str, meaning: str
    ) -> FittedParameter:
        """Return what was found of a free parameter; without a ``row`` of a sheet it is the test's.

        ``unit`` and ``meaning`` are those of such a one.
        """
        value, known = self.values[free.name], self.confidence.parameters[free.name]
        return FittedParameter(
            value=value,
            start=free.start,
            min=free.low,
            max=free.high,
            at_bound=free.bound(value),
            of_record=row is None,
            std_error=known.std_error,
            interval=known.interval,
            interval_method=known.method,
            why=known.why,
            unit=unit if row is None else row.unit,
            meaning=meaning if row is None else row.meaning,
            physical=row is None or row.is_physical(value),
        )

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters that the points do not determine, in words."""
        by_reason: dict[str, list[str]] = {}
        for name, known in self.confidence.parameters.items():
            if known.why is not None:
                by_reason.setdefault(known.why, []).append(name)
        reasons = [shared_reason(names, why) for why, names in by_reason.items()]
        return (*reasons, *self.identifiability.sentences)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the noise of the points and on the intervals, in words."""
        if not self.allowed_for:
            return self.confidence.sentences
        errors = f"the intervals include the errors of {listed(self.allowed_for)} (given)"
        return (*self.confidence.sentences, errors)


def fit_points(problem: PointProblem, search: PointProblem) -> FittedPoints:
    """Return the fit of some points, with the intervals of profiles where these can be made.

    ``search`` is the same problem, perhaps with other free parameters in place of some, over which
    the errors are smooth where they are not over these: it descends, and profiles all others.

    Raises ValueError where the errors at the start are not finite.
    """
    theta = np.array([each.scaled(each.start) for each in search.free])
    for _ in range(MOST_DESCENTS):
        result = descended(search, theta)
        values = search.values(result.x)
        linear = problem.linearisation(values)
        intervals = confidence(linear, data="the points", hint="")
        profiles = profiled(problem, search, values, linear, intervals) if result.success else {}
        lower = [each for each in profiles.values() if each.profile.moved]
        if not lower:
            break
        lowest = min(lower, key=lambda each: each.profile.cost)
        theta = search.theta(lowest.problem.values(lowest.profile.x))
    known = dict(intervals.parameters)
    for name, (form, profile) in profiles.items():
        parameter = form.free[profile.index]
        known[name] = of_profiles(known[name], parameter, [profile], "the points do")
    intervals = replace(intervals, parameters=known)
    return FittedPoints(values, result, intervals, identifiability(linear, intervals))


def descended(problem: PointProblem, theta: Array) -> estimate.Result:
    """Return the minimum to which a local optimisation converges from scaled parameters (N,)."""
    return estimate.least_squares(
        problem.residuals,
        theta,
        problem.jacobian,
        problem.bounds,
        STRATEGY,
        x_scale=units_of(problem.free),
        jacobian_error=DIFFERENCE_ERROR,
    )


class PointProfile(NamedTuple):
    """The profile of a parameter, and the problem in which it was made."""

    problem: PointProblem
    profile: estimate.CostProfile


def profiled(
    problem: PointProblem,
    search: PointProblem,
    values: Values,
    linear: Linearisation,
    intervals: Confidence,
) -> dict[str, PointProfile]:
    """Return the profiles of parameters about some values, by name."""
    limits = {
        name: rise
        for name, rise in rises(linear, intervals).items()
        if isfinite(rise) and rise > 0.0
    }
    of_search = {each.name for each in search.free}
    profiles: dict[str, PointProfile] = {}
    for form, names in ((search, limits.keys() & of_search), (problem, limits.keys() - of_search)):
        rise_of = {k: limits[each.name] for k, each in enumerate(form.free) if each.name in names}
        if not rise_of:
            continue
        made = estimate.profiles(
            estimate.OneByOne(form.residuals, form.jacobian),
            form.theta(values),
            rise_of,
            form.bounds,
            points=POINTS_OF_PROFILE,
            workers=1,
            x_scale=units_of(form.free),
        )
        profiles |= {form.free[each.index].name: PointProfile(form, each) for each in made}
    return profiles


def allowing_for_errors(
    problem: PointProblem, fit: FittedPoints, std_errors: Mapping[str, float]
) -> FittedPoints:
    """Return the fit of some points with intervals that allow for the errors of given values.

    As `intervals.value_errors.allowing_for`; derivatives by the values are central differences.
    What is free, no value of the problem, or without effect on the points is left out.
    """
    at_fit, errors = problem.errors(fit.values), dict[str, Array]()
    given = problem.given.keys() - {parameter.name for parameter in problem.free}
    for name, std_error in std_errors.items():
        if name not in given:
            continue
        change, sides = np.zeros_like(at_fit), 0
        for step in (-STEP, STEP):
            value = fit.values[name] + step * std_error
            moved = problem.errors({**fit.values, name: value})
            if np.isfinite(moved).all():  # else the data contradict each other on this side
                change, sides = change + (moved - at_fit) / step, sides + 1
        if change.any():
            errors[name] = change / max(sides, 1)
    if not errors:
        return fit
    linear, theta = problem.linearisation(fit.values), problem.theta(fit.values)
    own = problem.jacobian(theta) / problem.slopes(theta)
    of_values = np.zeros((len(own), len(errors)))
    of_values[: len(linear.errors)] = np.stack([*errors.values()], axis=1)
    shifts = first_order_shifts(own, of_values, linear.free)
    parameters = {
        parameter.name: widened_by(
            hypot(*moved), fit.confidence.parameters[parameter.name], parameter, x, size, [*errors]
        )
        for parameter, moved, x, size in zip(
            problem.free, shifts.tolist(), theta.tolist(), linear.own_size.tolist(), strict=True
        )
    }
    confidence = replace(fit.confidence, parameters=parameters)
    return replace(fit, confidence=confidence, allowed_for=tuple(errors))
