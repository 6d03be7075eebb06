"""A fit of points: few residuals, whose functions are cheap, so that every interval is profiled."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.fitting.parameters import UNIT, FreeParameter
from exfit.fitting.uncertainty import shared_reason
from exfit.inference import (
    Confidence,
    Identifiability,
    Linearisation,
    PriorRow,
    ResidualBlock,
    Uncertainty,
    confidence,
    identifiability,
    rises,
)

Array = NDArray[np.float64]
Values = Mapping[str, float]

DIFFERENCE = 6e-6  # of a scaled parameter: where the error of a central difference is least
DIFFERENCE_ERROR = 1e-9  # of the Jacobian, as a share of its largest singular value
POINTS_OF_PROFILE = 3  # of a side: only its end is asked for
STRATEGY = "lm-then-dgn"
ENDS = {
    estimate.ProfileEnd.FAILED: "the machine has no rest beyond",
    estimate.ProfileEnd.FLAT: "the residuals hardly change",
    estimate.ProfileEnd.INTERRUPTED: "interrupted",
}


@dataclass(frozen=True, eq=False)
class PointProblem:
    """Residuals of points as functions of what is ``free``.

    ``errors(values)`` gives the weighted errors (M,), simulated less measured, nan for values that
    contradict each other; ``given`` are the values of all that is not free; ``blocks`` say which
    errors belong to which signal. An error of 1 is as large as its noise, as far as that is known.
    """

    errors: Callable[[Values], Array]
    given: Values
    free: tuple[FreeParameter, ...]
    blocks: tuple[ResidualBlock, ...]

    def values(self, theta: Array) -> dict[str, float]:
        """Return all values at scaled parameters (N,)."""
        pairs = zip(self.free, theta, strict=True)
        return {**self.given, **{each.name: each.value(float(x)) for each, x in pairs}}

    def residuals(self, theta: Array) -> Array:
        """Return the weighted errors, then what priors add, (M + P,)."""
        values = self.values(theta)
        priors = [
            (values[each.name] - each.prior.mean) / each.prior.std
            for each in self.free
            if each.prior is not None
        ]
        return np.concatenate([self.errors(values), priors])

    def jacobian(self, theta: Array) -> Array:
        """Return the derivatives (M + P, N) to the scaled parameters, by differences in bounds."""
        low, high = self.bounds
        columns = []
        for k, x in enumerate(theta):
            ends = np.clip([x - DIFFERENCE, x + DIFFERENCE], low[k], high[k])
            below, above = (self.residuals(self._moved(theta, k, end)) for end in ends)
            columns.append((above - below) / (ends[1] - ends[0]))
        return np.stack(columns, axis=1)

    def _moved(self, theta: Array, index: int, x: float) -> Array:
        moved = theta.copy()
        moved[index] = x
        return moved

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The bounds of the scaled parameters, each (N,)."""
        limits = [(each.scaled(each.low), each.scaled(each.high)) for each in self.free]
        low, high = np.array(limits).T
        return low, high


@dataclass(frozen=True, eq=False)
class FittedPoints:
    """The best values of a fit of points, and how well these determine them."""

    values: dict[str, float]
    result: estimate.Result
    confidence: Confidence
    identifiability: Identifiability

    def scatter(self, signal: str) -> float:
        """Return the standard deviation of a signal's weighted errors, less what was fitted."""
        return next(noise.estimated for noise in self.confidence.noise if noise.label == signal)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """What the points do not determine, in words."""
        by_reason: dict[str, list[str]] = {}
        for name, known in self.confidence.parameters.items():
            if known.why is not None:
                by_reason.setdefault(known.why, []).append(name)
        reasons = [shared_reason(names, why) for why, names in by_reason.items()]
        return (*reasons, *self.identifiability.sentences)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is remarkable about the noise of the points, in words."""
        return self.confidence.sentences


def fit_points(problem: PointProblem) -> FittedPoints:
    """Return the fit of some points, with the intervals of profiles where these can be made.

    Raises ValueError where the errors at the start are not finite.
    """
    functions = estimate.OneByOne(problem.residuals, problem.jacobian)
    result = descended(problem, np.array([each.scaled(each.start) for each in problem.free]))
    linear = linearisation(problem, result.x)
    intervals = confidence(linear, data="the points", hint="")
    limits = {
        k: rise
        for k, rise in enumerate(rises(linear, intervals).values())
        if isfinite(rise) and rise > 0.0
    }
    if limits and result.success:
        profiles = estimate.profiles(
            functions,
            result.x,
            limits,
            problem.bounds,
            points=POINTS_OF_PROFILE,
            workers=1,
            x_scale=UNIT,
        )
        if profiles[0].moved:
            result = descended(problem, profiles[0].x)
            linear = linearisation(problem, result.x)
            intervals = confidence(linear, data="the points", hint="")
        intervals = with_profiles(intervals, problem, profiles)
    return FittedPoints(
        problem.values(result.x), result, intervals, identifiability(linear, intervals)
    )


def descended(problem: PointProblem, theta: Array) -> estimate.Result:
    """Return the minimum to which a descent leads from scaled parameters (N,)."""
    return estimate.least_squares(
        problem.residuals,
        theta,
        problem.jacobian,
        problem.bounds,
        STRATEGY,
        x_scale=UNIT,
        jacobian_error=DIFFERENCE_ERROR,
    )


def linearisation(problem: PointProblem, theta: Array) -> Linearisation:
    """Return the errors of a fit of points and their derivatives at scaled parameters (N,)."""
    values, free = problem.values(theta), problem.free
    errors = problem.errors(values)
    slopes = np.array([each.slope(float(x)) for each, x in zip(free, theta, strict=True)])
    return Linearisation(
        names=tuple(each.name for each in free),
        units=("",) * len(free),
        values=np.array([values[each.name] for each in free]),
        logarithmic=np.array([each.logarithmic for each in free]),
        width=np.array([each.width for each in free]),
        held=tuple(each.bound(values[each.name]) for each in free),
        errors=errors,
        jacobian=problem.jacobian(theta)[: len(errors)] / slopes,
        influence=errors,
        curvature=np.ones(len(errors)),
        channels=problem.blocks,
        priors=tuple(
            PriorRow(k, each.prior.mean, each.prior.std, 1.0)
            for k, each in enumerate(free)
            if each.prior is not None
        ),
        through_zero=tuple(each.low < 0.0 < each.high for each in free),
    )


def with_profiles(
    intervals: Confidence, problem: PointProblem, profiles: tuple[estimate.CostProfile, ...]
) -> Confidence:
    """Return what is known of the parameters, with the intervals of their profiles."""
    parameters = dict(intervals.parameters)
    for profile in profiles:
        parameter = problem.free[profile.index]
        parameters[parameter.name] = by_profile(parameters[parameter.name], parameter, profile)
    return replace(intervals, parameters=parameters)


def by_profile(
    known: Uncertainty, parameter: FreeParameter, profile: estimate.CostProfile
) -> Uncertainty:
    """Return what is known of a parameter by its profile."""
    limits = [None if end is None else parameter.value(end) for end in (profile.low, profile.high)]
    interval = None if limits == [None, None] else (limits[0], limits[1])
    why = " and ".join(open_sides(parameter, profile))
    return replace(known, interval=interval, why=why or None, method="profile")


def open_sides(parameter: FreeParameter, profile: estimate.CostProfile) -> Iterator[str]:
    """Yield why a profile has no limit on a side."""
    bounds = (f"its min {parameter.low:.4g}", f"its max {parameter.high:.4g}")
    limits = (profile.low, profile.high)
    for side, limit, end, bound in zip(
        ("lower", "upper"), limits, profile.ends, bounds, strict=True
    ):
        if limit is None:
            yield f"has no {side} limit: {ENDS.get(end, f'the points do not exclude {bound}')}"
