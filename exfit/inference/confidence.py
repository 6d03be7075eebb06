"""How well a fit determines each of its parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp, inf, isfinite, sqrt
from statistics import NormalDist
from typing import Annotated, Literal, NamedTuple, TypeGuard

import numpy as np

from exfit.inference.linear import Factors, Linearisation, factored
from exfit.inference.noise import Noise, noise_of
from exfit.inference.quantiles import student_quantile, wave_quantile
from exfit.util.arrays import Array
from exfit.util.text import digits, listed
from exfit.util.typed import IN_FILE

LEVEL = 0.95
UNDETERMINED = 0.3  # relative standard error: the response is no longer linear over the interval
KNOWN = 0.2  # of a value: a parameter with a wider interval is not known as a setting is
CORRELATED = 0.2  # with another parameter: left free it would widen the interval by 2 %
TIED = (
    0.99  # correlation with a parameter on a bound: what is known of one is the bound of the other
)

NORMAL = NormalDist().inv_cdf(0.5 * (1.0 + LEVEL))

Interval = tuple[float | None, float | None]  # None: the record sets no limit on that side
IntervalMethod = Literal["linear", "profile", "hull", "windows", "averages", "causes"]


class Uncertainty(NamedTuple):
    """Uncertainty of one parameter.

    std_error       in its own unit; None where nothing determines it
    relative_error  std_error / |value|; None also where the value is 0
    interval        that holds the true value with the level of the confidence
    why             the reason where there is no interval, or where one side of it has no limit
    method          how the interval, or that there is none, was found: by linear theory, from the
                    profile likelihood, as the hull of the profiles about several minima, of fits
                    to windows of the records, or so that it also holds what averages of the
                    recorder, or other causes of residuals that are no noise, would change; None
                    where linear theory gives none
    by_noise        the interval from the noise alone, where errors of what the case gives widen it
    """

    std_error: float | None
    relative_error: float | None
    interval: Interval | None
    why: str | None
    method: IntervalMethod | None = None
    by_noise: Interval | None = None

    @property
    def determined(self) -> bool:
        """Flag of a parameter that the record limits on both sides."""
        return closed(self.interval)


def vagueness(value: float, interval: Interval | None) -> str:
    """Word a closed interval that is wider than +-20 % of the value; "" of any other."""
    if not closed(interval):
        return ""
    low, high = interval
    if high - low <= 2.0 * KNOWN * abs(value):
        return ""
    if low * high > 0.0:
        ratio = sqrt(max(abs(low), abs(high)) / min(abs(low), abs(high)))
        return f"to a factor of {digits(ratio)}"
    return f"to +-{digits(0.5 * (high - low))}"


def holds(interval: Interval, value: float) -> bool:
    """Test whether an interval, which may be open, holds a value."""
    low, high = interval
    return (low is None or value >= low) and (high is None or value <= high)


def closed(interval: Interval | None) -> TypeGuard[tuple[float, float]]:
    """Test whether there is an interval with limits on both sides."""
    return interval is not None and None not in interval


class Correlation(NamedTuple):
    """The correlations (N, N) of the estimates of N parameters; nan without a standard error."""

    names: tuple[str, ...]
    matrix: Array


@dataclass(frozen=True, eq=False)
class Confidence:
    """Confidence of all parameters together, by linear theory.

    dof          degrees of freedom behind the noise; infinite if all of it was given
    sentences    what is remarkable about the noise
    covariance   (N, N) in their own units, nan without a standard error; empty where not stored
    """

    level: float
    dof: Annotated[float, inf]
    parameters: Mapping[str, Uncertainty]
    correlation: Correlation
    noise: tuple[Noise, ...]
    sentences: tuple[str, ...]
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)), metadata=IN_FILE)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters."""
        return self.correlation.names

    @property
    def variance(self) -> float:
        """The variance of a weighted error, widened where errors are not white: of all channels."""
        squares = [each.spread**2 for each in self.noise]
        return float(np.average(squares, weights=[each.samples for each in self.noise]))


def confidence(
    lin: Linearisation, data: str = "the record", hint: str = "; see `exfit profile`"
) -> Confidence:
    """Return standard errors and 95 % intervals of the parameters of a fit, by linear theory.

    Reasons for having none name the ``data``, with a ``hint`` where a profile could help.

    The covariance is that of `Factors.covariance`, the noise that of `noise_of`. Parameters on a
    bound are held there: what is said of the others holds for that value. Intervals are those of
    Student's t, for the logarithm where the fit moved it: value * exp(-+ t s); else value -+ t s,
    which may pass a bound: it describes the record alone.

    There is none where the standard error exceeds UNDETERMINED of what counts as 100 %
    (`Linearisation.own_size`): of the value. Where zero lies between the bounds it counts no less
    than a tenth of the interval between these, so that a value near zero is not called undetermined
    for being small; for a nuisance it is that interval.
    """
    factors = factored(lin, lin.free)
    noise = noise_of(factors)
    relative = factors.covariance(noise)
    errors = np.sqrt(np.diag(relative))
    # the effective samples less the parameters that they determine
    dof = max(sum(each.effective for each in noise) - factors.leverage, 1.0)
    if all(each.accepted and each.inflation == 1.0 for each in noise):
        dof = inf
    quantiles = quantiles_of(factors, noise, dof)
    with np.errstate(invalid="ignore"):
        correlation = relative / np.outer(errors, errors)  # nan for errors of 0
    return Confidence(
        level=LEVEL,
        dof=dof,
        parameters={
            name: _uncertainty(factors, k, float(errors[k]), float(quantiles[k]), data, hint)
            for k, name in enumerate(lin.names)
        },
        correlation=Correlation(lin.names, correlation),
        noise=noise,
        sentences=tuple(text for each in noise for text in each.sentences(len(noise) == 1)),
        covariance=relative * np.outer(lin.size, lin.size),
    )


def rises(lin: Linearisation, intervals: Confidence) -> dict[str, float]:
    """Rise of the cost from its minimum to the ends of each profile's interval.

    Half the squared quantile of its error, times the variance of the parameter over that by the
    cost alone, the inverse of its second derivatives (Royall & Tsou 2003). With one channel and
    least squares the ratio is the variance of the weighted errors, widened where they are not
    white (Bates & Watts 1988, section 6.1). A parameter on a bound is let go for it; what has no
    variance then takes the mean of the channels by their samples.
    """
    noise, factors = intervals.noise, factored(lin, lin.free)
    half = 0.5 * quantiles_of(factors, noise, intervals.dof) ** 2
    ratios = _variance_ratios(factors, noise)
    for k in np.flatnonzero(~lin.free):
        let_go = lin.free.copy()
        let_go[k] = True
        ratios[k] = _variance_ratios(factored(lin, let_go), noise)[k]
    ratios = np.where(np.isfinite(ratios), ratios, intervals.variance)
    return dict(zip(lin.names, (half * ratios).tolist(), strict=True))


def quantiles_of(factors: Factors, noise: tuple[Noise, ...], dof: float) -> Array:
    """Return half of each interval in standard errors (N,): the quantile of Student's t.

    Less where the errors of a recorder's rounding dominate: they are bounded. There it is that of a
    normal error and of waves of one phase, which may be any, over that of a normal error alone.
    """
    t = student_quantile(dof, 0.5 * (1.0 + LEVEL))
    quantiles = np.full(len(factors.lin.names), t)
    errors = factors.rounding_errors(noise)
    if errors is None:
        return quantiles
    normal, waves = errors
    total = np.sqrt(normal**2 + np.sum(waves**2, axis=1))
    for k in np.flatnonzero(np.isfinite(total) & (total > 0.0)):
        quantiles[k] *= wave_quantile(normal[k] / total[k], waves[k] / total[k], LEVEL) / NORMAL
    return quantiles


def _variance_ratios(factors: Factors, noise: tuple[Noise, ...]) -> Array:
    """Return the variances (N,) over those by the cost alone, nan where there are none."""
    by_cost = factors.of_all(factors.spread)  # the inverse of its second derivatives
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.diag(factors.covariance(noise)) / np.diag(by_cost)


def partners_on_bounds(
    lin: Linearisation, noise: tuple[Noise, ...], least: float = CORRELATED
) -> dict[str, tuple[str, ...]]:
    """Name parameters that would change if those on a bound were let go, each with these.

    Those are all that correlate with one on a bound by more than ``least``, by linear theory for
    all parameters free, or that cannot be distinguished from one.
    """
    held = ~lin.free
    if not held.any():
        return {}
    factors = factored(lin, np.ones_like(held))
    covariance = factors.covariance(noise)
    errors = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        partners = np.abs(covariance / np.outer(errors, errors)) > least
    for k in np.flatnonzero(held & factors.has_effect & ~factors.determined):
        partners[:, k] |= np.isin(lin.names, factors.others(int(k)))
    return {
        name: tuple(lin.names[j] for j in np.flatnonzero(held & partners[k]))
        for k, name in enumerate(lin.names)
        if lin.free[k] and partners[k, held].any()
    }


def _uncertainty(
    factors: Factors, k: int, share: float, t: float, data: str, hint: str
) -> Uncertainty:
    """Return the uncertainty of a parameter, its error a ``share`` of 100 %, ``t`` the quantile."""
    lin, why = factors.lin, _reason(factors, k, share, data, hint)
    if not isfinite(share):
        return Uncertainty(None, None, None, why)
    value, std = float(lin.values[k]), share * float(lin.size[k])
    relative = std / abs(value) if value else None
    if why is not None:
        return Uncertainty(std, relative, None, why)
    if lin.logarithmic[k]:
        interval = (value * exp(-t * share), value * exp(t * share))
    else:
        interval = (value - t * std, value + t * std)
    return Uncertainty(std, relative, interval, None, "linear")


def _reason(factors: Factors, k: int, share: float, data: str, hint: str) -> str | None:
    """Word the reason for which a parameter has no interval."""
    lin = factors.lin
    if lin.held[k] is not None:
        return f"lies on its {lin.held[k]} {lin.values[k]:.3g}: the bound decides, not {data}"
    if not factors.has_effect[k]:
        return f"has no effect on {data}"
    if not factors.determined[k]:
        return f"cannot be distinguished from {listed(factors.others(k))}"
    if not isfinite(share):
        return "cannot be determined: there are no more samples than free parameters"
    relative = share * float(lin.size[k] / lin.own_size[k])
    if relative > UNDETERMINED:
        by_value = lin.own_size[k] == abs(lin.values[k])
        words = f"{digits(100.0 * relative)} %" if by_value else lin.error_in_words(k, share)
        return f"is not determined by {data}: standard error {words}{hint}"
    return None
