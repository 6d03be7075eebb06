"""The noise of each channel of a fit: how large, and how much of it is the same again."""

from collections.abc import Iterator, Sequence
from math import nan, sqrt
from typing import Annotated, NamedTuple

import numpy as np

from exfit.inference.linear import Factors, ResidualBlock
from exfit.inference.quantiles import chi_square_tail
from exfit.util.arrays import Array
from exfit.util.text import digits

SURPRISING = 0.01  # of tests of what is true reject it
LAGS = 20  # the most that a test of whiteness takes (Box, Jenkins & Reinsel 1994, section 8.2.2)
SAMPLES_PER_LAG = 5
# of the largest: what a channel sees less of a direction, the others decide. With the scale of its
# record free that may be its own noise, by which the record differs from the response
SEEN = 0.01
ROUNDING = 1e-6  # of the variance of a channel
LEAST_P = 1e-10  # a probability below it is not worth its digits
# of an autoregression
HIGHEST_ORDER = 4
SAMPLES_PER_COEFFICIENT = 20
LEAST_SEEN = 1e-6  # of the largest singular value: rounding, no direction of the slopes
LARGEST_PARTIAL = 0.9999  # a partial autocorrelation of 1 is no stationary series


class Autoregression(NamedTuple):
    """A stationary series e[k] = sum of a[j] e[k-1-j] + v[k], v white.

    ``partial``: its partial autocorrelations, each between -1 and 1; as many as its order.
    """

    partial: tuple[float, ...]

    @property
    def coefficients(self) -> Array:
        """The coefficients a."""
        return _coefficients(np.array(self.partial))

    @property
    def share(self) -> float:
        """The variance of v over that of e."""
        return float(np.prod(1.0 - np.square(self.partial)))

    @property
    def inflation(self) -> float:
        """The variance of a long mean over that of white errors: the sum of autocorrelations."""
        return self.share / float(1.0 - np.sum(self.coefficients)) ** 2

    def correlated(self, rows: Array) -> Array:
        """Return rows (r, M) times a root of the correlations of M errors (M, M): (r, 2 M).

        The root is the response of the errors to what v was within them and as long before.
        """
        from scipy.linalg import solve_banded  # far quicker to import than scipy.signal

        backwards = np.concatenate([rows[:, ::-1], np.zeros_like(rows)], axis=1)
        bands = np.tile([[1.0], *([-a] for a in self.coefficients)], backwards.shape[1])
        filtered = solve_banded((len(self.partial), 0), bands, backwards.T)
        return np.asarray(np.sqrt(self.share) * filtered.T)


class Noise(NamedTuple):
    """The noise of a channel, of its weighted errors.

    std        standard deviation that counts: the one given, or the estimated one
    estimated  standard deviation of the residuals; nan without more samples than parameters
    given      what the user gave
    accepted   whether the one given agrees with the residuals; None if none is given
    p_value    of the test of whiteness; None if there are too few samples, or no errors at all
    effective  how many independent samples they are worth
    inflation  samples / effective: the factor on the variance
    rounding   step of a recorder that rounds more coarsely than its noise; 0 for any other
    partial_autocorrelations  of the autoregression that describes the residuals; none where they
               are white or where none does
    """

    label: str
    samples: int
    std: Annotated[float, nan]
    estimated: Annotated[float, nan]
    given: float | None
    accepted: bool | None
    p_value: float | None
    effective: Annotated[float, nan]
    inflation: Annotated[float, nan]
    rounding: float = 0.0
    partial_autocorrelations: tuple[float, ...] = ()

    @property
    def spread(self) -> float:
        """The standard deviation, widened for what is not white."""
        return self.std * sqrt(self.inflation)

    @property
    def series(self) -> Autoregression | None:
        """Autoregression that describes the residuals."""
        partial = self.partial_autocorrelations
        return Autoregression(partial) if partial else None

    def sentences(self, alone: bool) -> Iterator[str]:
        """Word all that is remarkable; ``alone``: there is no other channel."""
        if self.given is not None and self.accepted is False:
            used = "the larger one" if self.std != self.given else "the one given"
            yield (
                f"the residuals of {self.label} are {digits(self.estimated / self.given)} times "
                f"the noise given: {used} counts"
            )
        if self.rounding:
            yield (
                f"the recorder rounds {self.label} to {digits(self.rounding)} pu, more than its "
                "noise: samples at one level have the same error, and the intervals allow for it"
            )
        if self.p_value is not None and self.p_value < SURPRISING:
            p = f"p {digits(self.p_value)}" if self.p_value > LEAST_P else f"p below {LEAST_P:.0e}"
            finding = f"the residuals of {self.label} are not white (Ljung-Box {p})"
            if self.inflation == 1.0:
                yield f"{finding}, but alternate: the intervals are no wider for it"
                return
            if self.partial_autocorrelations:
                yield (
                    f"{finding}, but an autoregression of order "
                    f"{len(self.partial_autocorrelations)} describes them: for a slow change "
                    f"{self.samples} samples count as {self.effective:.0f}, and the intervals "
                    "allow for it"
                )
                return
            wider = "the intervals are" if alone else "its noise counts"
            more = " wider" if alone else ""
            yield (
                f"{finding}: {self.samples} samples count as {self.effective:.0f}, "
                f"{wider} {digits(sqrt(self.inflation))} times{more}"
            )


def noise_of(factors: Factors) -> tuple[Noise, ...]:
    """Return the noise of each channel.

    The standard deviation is that of the residuals, tau^2 = sum psi^2 / dof / mean(psi')^2 (Huber
    1981, section 7.6; the root of the mean square for least squares), the degrees of freedom
    shared out by samples. One that was given counts instead, unless a chi-square test rejects it
    at 1 %: then the larger counts.
    """
    lin = factors.lin
    share = 1.0 - factors.leverage / max(len(lin.errors), 1)
    whole = tuple(
        _noise(factors, channel, lin.influence[channel.samples], share) for channel in lin.channels
    )
    if len(whole) == 1 or np.any(lin.curvature != 1.0) or len(lin.errors) != len(lin.jacobian):
        return whole
    fits = [own_fit(factors, channel) for channel in lin.channels]
    own = tuple(
        _noise(factors, channel, fit.left_over, 1.0 - len(fit.amounts) / len(fit.left_over))
        for channel, fit in zip(lin.channels, fits, strict=True)
    )
    return tuple(
        by_own_fit if is_explained(factors, fit, k, own) else by_all
        for k, (by_own_fit, by_all, fit) in enumerate(zip(own, whole, fits, strict=True))
    )


class OwnFit(NamedTuple):
    """Errors (M,) of one channel, had the parameters been fitted to it alone.

    left_over  of its errors (M,)
    amounts    (K,) of what a fit to all channels left to be fitted to this one
    seen       (K, r) how the channel sees the directions of `Factors.left`, in these K of its own
    """

    left_over: Array
    amounts: Array
    seen: Array


def own_fit(factors: Factors, channel: ResidualBlock) -> OwnFit:
    """Deduct from the errors of one channel all that a change of the parameters explains.

    An error of the parameters that another channel caused, by its larger noise, is no noise of
    this one.
    """
    errors = factors.lin.errors[channel.samples]
    basis, singular, directions = np.linalg.svd(factors.left[channel.rows], full_matrices=False)
    some = singular > SEEN * np.max(singular, initial=0.0)
    if 2 * np.count_nonzero(some) > len(errors):
        some[:] = False
    basis, seen = basis[:, some], singular[some, None] * directions[some]
    amounts = basis.T @ errors
    return OwnFit(errors - basis @ amounts, amounts, seen)


def is_explained(factors: Factors, fit: OwnFit, place: int, noise: Sequence[Noise]) -> bool:
    """Test whether the noise of all channels explains what one left to be fitted.

    By a chi-square test at 1 %. Where it does not, as where the model cannot match two channels at
    once, that is an error like any other.
    """
    lin = factors.lin
    lefts = [factors.left[channel.rows] for channel in lin.channels]
    pairs = zip(lefts, noise, strict=True)
    moves = np.sum([each.spread**2 * (left.T @ left) for left, each in pairs], axis=0)
    variance = noise[place].spread ** 2
    seen = fit.seen
    covariance = variance * (np.eye(len(seen)) - 2.0 * seen @ seen.T) + seen @ moves @ seen.T
    values, vectors = np.linalg.eigh(covariance)
    some = values > ROUNDING * variance
    if not some.any():
        return True
    amounts = vectors[:, some].T @ fit.amounts
    tail = chi_square_tail(float(np.sum(amounts**2 / values[some])), int(np.count_nonzero(some)))
    return tail >= SURPRISING


def _noise(factors: Factors, channel: ResidualBlock, influence: Array, share: float) -> Noise:
    lin = factors.lin
    samples, curvature = len(influence), lin.mean_curvature(channel)
    # a share of the order of rounding: as many parameters as samples
    dof = samples * share if share > samples * np.finfo(float).eps else 0.0
    square = float(influence @ influence)
    estimated = sqrt(square / dof) / curvature if dof else nan
    p_value = whiteness(influence)
    effective, scatter, series = float(samples), estimated, None
    if not is_white(p_value):
        effective, slopes = effective_samples(influence), factors.left[channel.rows]
        # described by the lowest order that leaves white noise: it needs a row of the Jacobian for
        # each error, and errors that no coarse recorder rounds
        whole = channel.rounding is None and len(slopes) == len(influence)
        for each in described(influence, slopes) if whole else ():
            if is_white(whiteness(each.innovations)):
                series = each.series
                effective = min(effective, samples / series.inflation)
                scatter = max(estimated, sqrt(each.variance) / curvature)
                break
    given = channel.noise
    accepted = agrees(estimated, given, dof * effective / samples)
    return Noise(
        label=channel.label,
        samples=samples,
        std=scatter if given is None else given if accepted else max(given, scatter),
        estimated=estimated,
        given=given,
        accepted=accepted,
        p_value=p_value,
        effective=effective,
        inflation=samples / effective,
        rounding=0.0 if channel.rounding is None else channel.rounding.step / channel.weight,
        partial_autocorrelations=() if series is None else series.partial,
    )


def is_white(p_value: float | None) -> bool:
    """Test for whiteness at 1 %."""
    return p_value is None or p_value >= SURPRISING


def agrees(estimated: float, given: float | None, dof: float) -> bool | None:
    """Test a given standard deviation by chi-square at 1 %, two-sided.

    Without degrees of freedom nothing speaks against it.
    """
    if given is None or not dof or not estimated:
        return None if given is None else True
    from scipy.special import chdtr, chdtrc

    ratio = dof * (estimated / given) ** 2
    return bool(min(chdtr(dof, ratio), chdtrc(dof, ratio)) >= SURPRISING / 2.0)


def autocorrelations(errors: Array) -> Array:
    """Return the autocorrelations of errors (M,) from lag 0 on, (M,), about the mean zero.

    Zero, not their own mean: a lasting error of the model is the same error over and over.
    """
    count = len(errors)
    spectrum = np.fft.rfft(errors, 2 * count)
    products = np.fft.irfft(np.abs(spectrum) ** 2, 2 * count)[:count]
    return np.asarray(products / products[0])


def whiteness(errors: Array) -> float | None:
    """Probability that white noise is as correlated as this (Ljung & Box 1978).

    Over min(20, M / 5) lags. The loss of degrees of freedom to the parameters of a fit, few beside
    its samples, is left out.
    """
    count = len(errors)
    lags = min(LAGS, count // SAMPLES_PER_LAG)
    if not lags or not np.any(errors):
        return None
    later = np.arange(1, lags + 1)
    statistic = count * (count + 2) * np.sum(autocorrelations(errors)[later] ** 2 / (count - later))
    return chi_square_tail(float(statistic), lags)


def effective_samples(errors: Array) -> float:
    """Number of independent errors of the same worth for a mean: n / (1 + 2 sum rho).

    The sum ends where a pair of neighbours, lags 2k and 2k + 1, no longer adds to it: the initial
    positive sequence (Geyer 1992, section 3.3). Never more than there are.
    """
    rho = autocorrelations(errors)
    pairs = rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1)
    ended = np.flatnonzero(pairs <= 0.0)
    until = ended[0] if len(ended) else len(pairs)
    times = max(2.0 * float(np.sum(pairs[:until])) - 1.0, 1.0)
    return len(errors) / times


class Described(NamedTuple):
    """Errors (M,) as an autoregression, their variance, and what it leaves (M - order,)."""

    series: Autoregression
    variance: float
    innovations: Array


def described(errors: Array, slopes: Array) -> Iterator[Described]:
    """Yield errors (M,) of a fit as autoregressions of rising order.

    ``slopes`` (M, r): what the fit could take away from them. The estimate is that of restricted
    maximum likelihood (Patterson & Thompson 1971), given the first errors; it allows for what the
    fit took of slow errors, which makes those that are left look faster than they were.
    """
    from scipy.optimize import minimize

    highest = min(HIGHEST_ORDER, len(errors) // SAMPLES_PER_COEFFICIENT)
    basis, singular, _ = np.linalg.svd(slopes, full_matrices=False)
    basis = basis[:, singular > LEAST_SEEN * np.max(singular, initial=0.0)]
    both = np.column_stack([basis, errors / np.linalg.norm(errors)])
    lagged = np.array([both[highest - lag : len(both) - lag] for lag in range(highest + 1)])
    products = np.einsum("imk,jml->ijkl", lagged, lagged, optimize=True)
    dof = lagged.shape[1] - basis.shape[1]

    def likelihood(angles: Array) -> float:
        """Return minus the logarithm of the restricted likelihood, but for a constant."""
        whitener, own = _whitener(angles), products[: len(angles) + 1, : len(angles) + 1]
        root = np.linalg.cholesky(np.einsum("i,j,ijkl->kl", whitener, whitener, own))
        logarithms = np.log(np.diag(root))
        return float(dof * logarithms[-1] + np.sum(logarithms[:-1]))

    angles = np.empty(0)
    for order in range(1, highest + 1):
        try:
            angles = minimize(likelihood, np.append(angles, 0.0), method="BFGS").x
        except np.linalg.LinAlgError:  # the fit took all but rounding: nothing is left to describe
            return
        series = Autoregression(tuple((LARGEST_PARTIAL * np.tanh(angles)).tolist()))
        white = np.tensordot(_whitener(angles), lagged[: order + 1], 1)
        amounts = np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=None)[0]
        innovations = (white[:, -1] - white[:, :-1] @ amounts) * np.linalg.norm(errors)
        variance = float(innovations @ innovations) / dof / series.share
        yield Described(series, variance, innovations)


def _whitener(angles: Array) -> Array:
    """Matrix that makes correlated errors white, from the last one back."""
    return np.concatenate([[1.0], -_coefficients(LARGEST_PARTIAL * np.tanh(angles))])


def _coefficients(partial: Array) -> Array:
    """Return the coefficients of the series with these partial autocorrelations.

    Source: the recursion of Levinson and Durbin (Box, Jenkins & Reinsel 1994, appendix A3.2).
    """
    coefficients = np.empty(0)
    for value in partial:
        coefficients = np.append(coefficients - value * coefficients[::-1], value)
    return coefficients
