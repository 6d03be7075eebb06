"""The uncertainty of fitted parameters: what is not determined, and where linear theory fails."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from math import sqrt
from typing import ClassVar, NamedTuple

import numpy as np

from exfit.dsp.quality import quantum
from exfit.dsp.rounding import is_coarse, noise_before_rounding, rounding_waves
from exfit.errors import SimulationError
from exfit.estimate import half_square
from exfit.fitting.experiment import Channel
from exfit.fitting.noise import LEAST_NOISE
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import MOST_NUMBERS_AT_ONCE, Residuals
from exfit.inference.confidence import (
    CORRELATED,
    TIED,
    Confidence,
    Uncertainty,
    closed,
    confidence,
    partners_on_bounds,
    rises,
)
from exfit.inference.identifiability import (
    Identifiability,
    ParameterEffect,
    effects,
    identifiability,
)
from exfit.inference.linear import Linearisation, PriorRow, ResidualBlock, Rounding
from exfit.inference.noise import Noise, effective_samples
from exfit.util.arrays import Array
from exfit.util.text import listed
from exfit.util.typed import IN_FILE, KEY

PLURALS = {"has": "have", "is": "are", "lies": "lie", "depends": "depend"}
MOST_RISE = 1.25  # times the rise that linear theory predicts: there an end may be 12 % off


class Sensitivity(NamedTuple):
    """Move of a signal over ``time`` (S,) in s for 100 % of each parameter: (S,), pu.

    What counts as 100 % says `Linearisation.ranked_size`. What belongs to a record is not among the
    parameters.
    """

    label: str
    time: Array
    moved: Mapping[str, Array]


class GivenError(NamedTuple):
    """The standard error of a value that was given, and by how much it moves each parameter.

    To first order, in the unit of the parameter, by what the records leave of that error.
    """

    std_error: float
    shifts: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class UncertaintyAnalysis:
    """Confidence and identifiability at the solution.

    ``nonlinear`` names the parameters over whose intervals the response is not linear;
    ``sensitivity`` is that of each channel over time, ``effects`` ranks the parameters by it;
    ``leaning_on_bounds`` names those that would be others if the parameters on a bound were let
    go, ``tied_to_bounds`` those of them that one on a bound decides, with that one; ``rises`` is by
    how much the cost rises from its minimum to the ends of each profile's interval, empty where
    that is not stored; ``by_few_samples`` says of which instants one or two samples decide.
    Standard errors and intervals allow for ``given_errors``, those of given values by name; all
    else is by the records alone, the correlations and the covariance too.
    """

    DERIVED: ClassVar = {"sentences": "sentences"}

    confidence: Confidence
    identifiability: Identifiability
    nonlinear: tuple[str, ...] = field(default=(), metadata={KEY: "not_linear"})
    effects: tuple[ParameterEffect, ...] = field(default=(), metadata={KEY: "sensitivities"})
    sensitivity: tuple[Sensitivity, ...] = field(default=(), metadata=IN_FILE)
    leaning_on_bounds: tuple[str, ...] = ()
    rises: Mapping[str, float] = field(default_factory=dict, metadata=IN_FILE)
    tied_to_bounds: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    by_few_samples: Mapping[str, str] = field(default_factory=dict)
    given_errors: Mapping[str, GivenError] = field(default_factory=dict)

    def with_parameters(self, parameters: Mapping[str, Uncertainty]) -> "UncertaintyAnalysis":
        """Return it with what is known of each parameter in place of its own."""
        return replace(self, confidence=replace(self.confidence, parameters=parameters))

    def without_intervals(self, why: str) -> "UncertaintyAnalysis":
        """Return it without what noise would say of the parameters, for a reason.

        What no record can tell apart stays.
        """
        parameters = {
            name: own._replace(interval=None, why=why, method=None)
            for name, own in self.confidence.parameters.items()
        }
        known = self.identifiability
        exact = tuple(combination for combination in known.unseen if combination.exact)
        return replace(
            self,
            confidence=replace(self.confidence, parameters=parameters, sentences=()),
            identifiability=known._replace(unseen=exact, suggestion=()),
        )

    @property
    def open(self) -> tuple[str, ...]:
        """Word what is not determined, with remedies."""
        without = {
            name: parameter
            for name, parameter in self.confidence.parameters.items()
            if parameter.why is not None
        }
        vague = [
            name
            for name, parameter in without.items()
            if parameter.std_error is not None and parameter.method is None
        ]
        if len({without[name].why for name in vague}) < 2:
            vague = []  # its own reason says more
        by_reason = dict[str, list[str]]()
        for name, parameter in without.items():
            if name not in vague:
                by_reason.setdefault(str(parameter.why), []).append(name)
        reasons = [shared_reason(names, why) for why, names in by_reason.items()]
        if vague:
            reasons.append(f"{listed(vague)} are not determined by the record: see `exfit profile`")
        return (*reasons, *self.identifiability.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """List all that a reader must know of it, in words."""
        return (*self.confidence.sentences, *self.open)


def shared_reason(names: Sequence[str], why: str) -> str:
    """Word the reason for which one or several parameters have no interval, or an open one."""
    if len(names) > 1:
        verb, _, rest = why.partition(" ")
        why = f"{PLURALS.get(verb, verb)} {rest}"
    return f"{listed(names)} {why}"


def uncertainty_at(
    problem: FitProblem, theta: Array, of_record: tuple[str, ...]
) -> UncertaintyAnalysis:
    """Analyse the uncertainty of the scaled parameters theta (N,).

    ``of_record`` names what belongs to a record and is no parameter of the unit. Raises
    SimulationError where a derivative is not finite.
    """
    return uncertainty_of(problem, theta, linearisation(problem, theta, of_record))


def uncertainty_of(problem: FitProblem, theta: Array, linear: Linearisation) -> UncertaintyAnalysis:
    """Analyse the uncertainty by a linearisation at theta (N,)."""
    intervals = confidence(linear)
    within = {**intervals.parameters}
    for parameter in problem.residuals.free:  # no interval beyond the bounds of its parameter
        own = within[parameter.name]
        if closed(own.interval):
            cut = max(own.interval[0], parameter.low), min(own.interval[1], parameter.high)
            within[parameter.name] = own._replace(interval=cut)
    intervals = replace(intervals, parameters=within)
    return UncertaintyAnalysis(
        confidence=intervals,
        identifiability=identifiability(linear, intervals),
        effects=effects(linear, intervals.noise),
        sensitivity=tuple(sensitivity(problem, theta, linear)),
        leaning_on_bounds=tuple(partners_on_bounds(linear, intervals.noise)),
        tied_to_bounds=partners_on_bounds(linear, intervals.noise, TIED),
        rises=rises(linear, intervals),
    )


def sensitivity(problem: FitProblem, theta: Array, linear: Linearisation) -> Iterator[Sensitivity]:
    """Sensitivity of each channel: at the record's samples or, where compressed, at some."""
    residuals = problem.residuals
    values, moves = residuals.values(theta), residuals.moves(theta)
    size = linear.ranked_size / slopes_of(residuals, theta)
    labels = iter(linear.channels)
    own = [n for n, of_record in enumerate(linear.nuisances) if not of_record]
    for experiment in problem.compressed.experiments:
        _, slopes = experiment.response_with_derivatives(values, moves)
        for k in range(len(experiment.channels)):
            moved = slopes[:, k] * size
            by_name = {linear.names[n]: moved[:, n] for n in own}
            yield Sensitivity(next(labels).label, experiment.simulator.times, by_name)


def slopes_of(residuals: Residuals, theta: Array) -> Array:
    """Return the derivative of each parameter to the number that the estimator moves, (N,)."""
    pairs = zip(residuals.free, theta, strict=True)
    return np.array([free.slope(float(x)) for free, x in pairs])


def linearisation(
    problem: FitProblem, theta: Array, of_record: tuple[str, ...], errors: Array | None = None
) -> Linearisation:
    """Return the errors and their exact derivatives at theta, in the parameters' own units.

    ``errors`` takes the place of those at theta. Raises SimulationError where a derivative is not
    finite.
    """
    residuals = problem.residuals
    values, free = residuals.values(theta), residuals.free
    # of all samples, where these fit in memory, as only they tell how a recorder rounds
    of_all = residuals.count * len(free) <= MOST_NUMBERS_AT_ONCE
    own = residuals if of_all else problem.compressed
    own_errors, slopes = own.errors(theta)
    if not np.isfinite(slopes).all():
        at = ", ".join(f"{parameter.name} = {values[parameter.name]:g}" for parameter in free)
        raise SimulationError(f"the derivatives are not finite at {at}")
    if errors is None:
        errors = own_errors if own is residuals else residuals(theta)[: residuals.count]
    influence, curvature = residuals.influence(errors)
    return Linearisation(
        names=tuple(parameter.name for parameter in free),
        units=("",) * len(free),
        values=np.array([values[parameter.name] for parameter in free]),
        logarithmic=np.array([parameter.logarithmic for parameter in free]),
        width=np.array([parameter.width for parameter in free]),
        held=tuple(parameter.bound(values[parameter.name]) for parameter in free),
        errors=errors,
        jacobian=slopes / slopes_of(residuals, theta),
        influence=influence,
        curvature=curvature,
        channels=tuple(_channels(residuals, own.sizes, errors, slopes)),
        priors=tuple(
            PriorRow(k, prior.mean, prior.std, residuals.noise)
            for k, prior in residuals.priors.items()
        ),
        nuisances=tuple(parameter.name in of_record for parameter in free),
        through_zero=tuple(parameter.low < 0.0 < parameter.high for parameter in free),
    )


def _channels(
    residuals: Residuals, rows: Sequence[int], errors: Array, slopes: Array
) -> Iterator[ResidualBlock]:
    """Yield the block of each channel; ``slopes`` (R, N) may have fewer rows than errors."""
    several = len(residuals.experiments) > 1
    places = zip(slices(rows), slices(residuals.sizes), strict=True)
    for experiment in residuals.experiments:
        white = experiment.whitening is not None
        for channel in experiment.channels:
            own, samples = next(places)
            label = f"{experiment.name} {channel.signal}" if several else channel.signal
            noise = None if white or channel.noise is None else channel.noise * channel.weight
            block = ResidualBlock(label, own, noise, channel.weight, samples)
            as_many = own.stop - own.start == samples.stop - samples.start
            of_record = any(nuisance.signal == channel.signal for nuisance in experiment.nuisances)
            if channel.plain and as_many and not (of_record or white):
                rounding = _rounding(channel, errors[samples], slopes[own])
                block = block._replace(rounding=rounding)
            yield block


def _rounding(channel: Channel, errors: Array, slopes: Array) -> Rounding | None:
    """Errors (M,) of a channel by the steps of its recorder, weighted.

    ``slopes`` (M, N) are the derivatives of these. None where the steps are no larger than its
    noise, and for a planned test, which has no errors.
    """
    readings, errors = channel.record, errors / channel.weight
    step = quantum(readings) if errors.any() else None
    if step is None or not is_coarse(step, float(np.sqrt(np.mean(errors**2)))):
        return None
    levels = readings + errors
    noise = noise_before_rounding(readings, levels, slopes, step)
    waves = rounding_waves(levels, step, noise)
    variance = (noise**2 + step**2 / 12.0) * channel.weight**2
    return Rounding(step * channel.weight, waves * channel.weight, variance)


def free_values(residuals: Residuals, theta: Array) -> dict[str, float]:
    """Return the values of the free parameters by name."""
    values = residuals.values(theta)
    return {free.name: values[free.name] for free in residuals.free}


def variance_of(
    residuals: Residuals, cost: float, uncertainty: UncertaintyAnalysis | None
) -> float:
    """Return the variance of the residuals at a minimum: no less than that of any recorder."""
    freedom = max(1, residuals.count - len(residuals.free))
    own = 2.0 * cost / freedom if uncertainty is None else uncertainty.confidence.variance
    return max(own, LEAST_NOISE**2)


def spread_of(residuals: Residuals, noises: Sequence[Noise]) -> Array:
    """Standard deviation (M,) of the weighted errors, widened where they are not white."""
    spreads = [
        max(noise.estimated, LEAST_NOISE * channel.weight) * sqrt(noise.inflation)
        for noise, channel in zip(noises, residuals.channels, strict=True)
    ]
    return np.repeat(spreads, residuals.sizes)


def spread_of_errors(residuals: Residuals, errors: Array, white: bool = False) -> Array:
    """Standard deviation (M,) of weighted errors (M,), widened unless they count as white."""
    spread = np.empty(len(errors))
    for place, channel in zip(slices(residuals.sizes), residuals.channels, strict=True):
        own = errors[place]
        inflation = 1.0 if white else len(own) / effective_samples(own)
        rms = float(np.sqrt(np.mean(own**2)))
        spread[place] = max(rms, LEAST_NOISE * channel.weight) * sqrt(inflation)
    return spread


def slices(sizes: Sequence[int]) -> list[slice]:
    """Places of blocks of these sizes, one behind the other."""
    ends = list(accumulate(sizes))
    return [slice(end - size, end) for size, end in zip(sizes, ends, strict=True)]


def nonlinear_parameters(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis, of_record: Sequence[str]
) -> tuple[str, ...]:
    """Return the parameters over whose intervals the response is not linear.

    Each end of an interval is visited along the linear trace, on which the other parameters follow,
    and the rise of the cost is compared with what the linear theory predicts. ``theta`` (N,) is the
    solution; what belongs to a record, ``of_record``, is left out.

    Source: Bates & Watts 1988, chapter 7; Donaldson & Schnabel 1987.
    """
    ends = [(name, x) for name, x, within in trace_ends(residuals, theta, uncertainty) if within]
    if not ends:
        return ()
    rises = residuals.costs([x for _, x in ends]) - half_square(residuals(theta))
    expected = np.array([uncertainty.rises[name] for name, _ in ends])
    alike = (rises >= expected / MOST_RISE) & (rises <= expected * MOST_RISE)
    names = dict.fromkeys(name for (name, _), linear in zip(ends, alike, strict=True) if not linear)
    return tuple(name for name in names if name not in of_record)


def not_served_by_linear_theory(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis, of_record: Sequence[str]
) -> tuple[str, ...]:
    """Return the parameters whose interval linear theory does not give, in their order.

    These are `nonlinear_parameters`, which ``uncertainty`` names, those on a bound or correlated
    with one there, those that reach a bound, or take others to one, within their interval, those
    without an interval, and those that correlate with any of these and so follow it where linear
    theory does not. ``theta`` (N,) is the solution.
    """
    ends = trace_ends(residuals, theta, uncertainty)
    leaving = {name for name, _, within in ends if not within}
    failing = {*uncertainty.nonlinear, *uncertainty.leaning_on_bounds, *leaving}
    parameters = uncertainty.confidence.parameters
    failed = np.array([name in failing or not own.determined for name, own in parameters.items()])
    with np.errstate(invalid="ignore"):
        follows = np.abs(uncertainty.confidence.correlation.matrix[:, failed]) > CORRELATED
    not_served = failed | follows.any(axis=1)
    return tuple(
        name
        for name, fails in zip(parameters, not_served, strict=True)
        if fails and name not in of_record
    )


def trace_ends(
    residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis
) -> Iterator[tuple[str, Array, bool]]:
    """Yield both ends of each linear interval, with the other parameters along.

    These are scaled (N,); then follows whether all of them lie within their bounds.
    """
    low, high = residuals.bounds
    own = slopes_of(residuals, theta)
    covariance = np.nan_to_num(uncertainty.confidence.covariance / np.outer(own, own))
    for k, free in enumerate(residuals.free):
        for limit in uncertainty.confidence.parameters[free.name].interval or ():
            if limit is not None:
                along = covariance[:, k] / covariance[k, k] * (free.scaled(limit) - theta[k])
                end = theta + along
                within = bool(np.all((end >= low) & (end <= high)))
                yield free.name, end, free.low < limit < free.high and within
