"""A least-squares fit as its linearisation sees it, and its normal equations, factored.

Errors, slopes, and what is held; what the fit determines, and what it cannot distinguish.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import exp
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from exfit.util.arrays import Array, Mask
from exfit.util.text import digits

if TYPE_CHECKING:
    from exfit.inference.noise import Noise


SMALL = 0.1  # of the interval: bounds usually lie a decade off what a linear parameter may be
OF_EACH_PARAMETER = (
    "units",
    "values",
    "logarithmic",
    "width",
    "held",
    "nuisances",
    "through_zero",
)
LEAST_CURVATURE = 1e-3  # of least squares: a loss that takes nearly every sample for an outlier
EXACTLY_REDUNDANT = 1e-9  # of the largest singular value: rounding, not a weak influence
NO_EFFECT = 1e-12  # of the largest column: rounding
TAKES_PART = 0.01  # of the largest component of a direction
MOST_EXPONENT = 7.0  # natural logarithm: beyond a factor of a thousand only the order counts


class Rounding(NamedTuple):
    """Errors that a recorder which rounds to a ``step`` adds to those of a channel, weighted.

    ``waves`` (samples, 2 K): waves waves' is the covariance of what is the same again where the
    signal stays at one level, cosines first, then sines; it is part of the ``variance`` of the
    errors, noise and rounding.
    """

    step: float
    waves: Array
    variance: float


class ResidualBlock(NamedTuple):
    """The errors of one signal in one record, on one clock, in the order of time.

    label   "vt", or "up vt" where there are several records
    rows    which rows of the Jacobian, contiguous
    noise   standard deviation of its weighted errors as the user gave it
    weight  of its errors: weighted error = weight * (simulated - measured)
    errors  which of the errors, contiguous, where they are more than the rows
    rounding  of a recorder whose steps are larger than its noise, with as many rows as errors
    """

    label: str
    rows: slice
    noise: float | None = None
    weight: float = 1.0
    errors: slice | None = None
    rounding: Rounding | None = None

    @property
    def samples(self) -> slice:
        """Places of its errors."""
        return self.rows if self.errors is None else self.errors


@dataclass(frozen=True)
class PriorRow:
    """Prior of a parameter: it adds the residual noise * (x - mean) / std to the fit.

    noise is what the fit took as the standard deviation of a weighted error.
    """

    index: int
    mean: float
    std: float
    noise: float


@dataclass(frozen=True, eq=False)
class Linearisation:
    """A fit of N parameters to M weighted errors at its minimum.

    Where the samples are many, fewer rows R of the Jacobian have the same J'J; else R = M.

    names, units   of the parameters
    values         (N,) in their own units
    logarithmic    (N,) whether the fit moved the logarithm
    width          (N,) high - low of the bounds
    held           "min" or "max" for a parameter on that bound
    errors         (M,) simulated minus measured, weighted, no robust loss applied
    jacobian       (R, N) d errors / d values
    influence      (M,) psi(e) of the loss; least squares: the errors
    curvature      (M,) psi'(e) of the loss; least squares: ones
    channels       covering all rows
    nuisances      True for what belongs to the record, as the instant of a step, not to the model
    through_zero   True where zero lies between the bounds: the value may be zero by chance

    Raises ValueError for shapes that do not agree and for numbers that are not finite.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    logarithmic: Mask
    width: Array
    held: tuple[str | None, ...]
    errors: Array
    jacobian: Array
    influence: Array
    curvature: Array
    channels: tuple[ResidualBlock, ...]
    priors: tuple[PriorRow, ...] = ()
    nuisances: tuple[bool, ...] = ()
    through_zero: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        samples, rows, count = len(self.errors), len(self.jacobian), len(self.names)
        for name, usual in (("nuisances", False), ("through_zero", True)):
            object.__setattr__(self, name, getattr(self, name) or (usual,) * count)
        for name in OF_EACH_PARAMETER:
            if len(getattr(self, name)) != count:
                raise ValueError(f"{name}: {len(getattr(self, name))} for {count} parameters")
        for name in ("errors", "jacobian", "influence", "curvature"):
            array, shape = getattr(self, name), (rows, count) if name == "jacobian" else (samples,)
            if array.shape != shape:
                raise ValueError(f"{name}: shape {array.shape}, not {shape}")
            if not np.isfinite(array).all():
                raise ValueError(f"{name}: not finite")
        if sum(len(self.errors[block.samples]) for block in self.channels) != samples:
            raise ValueError(f"channels: must cover the {samples} errors")
        if sum(len(self.jacobian[block.rows]) for block in self.channels) != rows:
            raise ValueError(f"channels: must cover the {rows} rows")

    @cached_property
    def size(self) -> Array:
        """The change of each parameter that counts as 100 %, (N,) in its own unit.

        Its value, where the fit moves the logarithm. The value of a parameter on the linear scale
        may be zero by chance and is then no measure of itself: it counts no less than a tenth of
        the interval between its bounds. The zero of a nuisance, as of an instant, has no meaning
        at all: the interval counts.
        """
        value = np.abs(self.values)
        linear = np.where(self.nuisances, self.width, np.maximum(value, SMALL * self.width))
        return np.where(self.logarithmic, value, linear)

    @cached_property
    def own_size(self) -> Array:
        """Change that counts as 100 % where a parameter is judged to be determined or not.

        It is `size`, but the value itself where the bounds keep it from zero.
        """
        value = np.abs(self.values)
        kept_from_zero = ~(np.array(self.through_zero) | np.array(self.nuisances)) & (value > 0.0)
        return np.where(kept_from_zero, value, self.size)

    @cached_property
    def ranked_size(self) -> Array:
        """Change that counts as 100 % where the effects of parameters are ranked, (N,).

        It is the value and, of a value of 0, the interval between the bounds.
        """
        value = np.abs(self.values)
        return np.where(value > 0.0, value, self.width)

    @property
    def free(self) -> Mask:
        """Mask of the parameters that lie on no bound (N,)."""
        return np.array([side is None for side in self.held], dtype=bool)

    @cached_property
    def relative(self) -> Array:
        """The derivative of the errors to relative changes, (R, N)."""
        return self.jacobian * self.size

    def mean_curvature(self, channel: ResidualBlock) -> float:
        """Return psi' of the loss over a channel, on average: 1 for least squares."""
        return max(float(np.mean(self.curvature[channel.samples])), LEAST_CURVATURE)

    def by_row(self, values: Sequence[float]) -> Array:
        """Return a number for each channel as one for each row, (R,)."""
        rows = np.empty(len(self.jacobian))
        for channel, value in zip(self.channels, values, strict=True):
            rows[channel.rows] = value
        return rows

    @cached_property
    def prior_rows(self) -> Array:
        """The derivatives of what the priors say to relative changes, in their std, (P, N)."""
        rows = np.zeros((len(self.priors), len(self.names)))
        for row, prior in zip(rows, self.priors, strict=True):
            row[prior.index] = self.size[prior.index] / prior.std
        return rows

    @property
    def prior_noise(self) -> Array:
        """Standard deviation of an error as the fit took it, for each prior (P,)."""
        return np.array([prior.noise for prior in self.priors])

    def error_in_words(self, index: int, share: float) -> str:
        """Word a standard error, a share of what counts as 100 %, in percent or its own unit."""
        if self.size[index] == abs(self.values[index]):
            return f"{digits(100.0 * share)} %"
        return f"{digits(share * float(self.size[index]))} {self.units[index]}".strip()

    def move_in_words(self, index: int, share: float) -> str:
        """Word the move of a parameter; what would more than double it, as a factor."""
        if not self.logarithmic[index] or abs(share) <= 1.0:
            return ("+" if share > 0.0 else "-") + self.error_in_words(index, abs(share))
        if abs(share) > MOST_EXPONENT:
            return "by orders of magnitude"
        return f"times {digits(exp(share))}"


@dataclass(frozen=True, eq=False)
class Factors:
    """The rows of a fit, errors and priors, over relative changes of k parameters: rank r.

    has_effect (N,) which parameters these are: those requested that have an effect
    left    (R, r) and spread (k, r): the pseudo-inverse of the rows is spread left'
    null    (d, k) relative changes without any effect, largest component 1, sparse
    joined  (d, k) which parameters take part in them
    """

    lin: Linearisation
    has_effect: Mask
    left: Array
    spread: Array
    null: Array
    joined: Mask

    @property
    def leverage(self) -> float:
        """Number of parameters that the errors determine, those by priors aside."""
        return float(np.sum(self.left[: len(self.lin.jacobian)] ** 2))

    @cached_property
    def determined(self) -> Mask:
        """Mask of the parameters (N,) that are determined at all."""
        determined = np.zeros(len(self.has_effect), dtype=np.bool_)
        determined[self.has_effect] = ~self.joined.any(axis=0)
        return determined

    def covariance(self, noise: Sequence["Noise"]) -> Array:
        """Return the covariance of relative changes (N, N), nan where nothing is determined.

        It is A^-1 B A^-1, A = sum of w J'J over the channels, w the mean psi', and B = sum of
        w^2 J'CJ, C the covariance of the weighted errors (Huber 1981, section 7.6; White 1980); a
        prior adds its own row to both. C is the variance of a channel, widened where its errors are
        not white; for one channel without priors it is noise^2 (J'J)^-1 then.
        """
        lin, rows = self.lin, len(self.lin.jacobian)
        blocks = [self._errors_seen(*pair) for pair in zip(lin.channels, noise, strict=True)]
        priors = self.left[rows : rows + len(lin.priors)].T * lin.prior_noise
        return self.of_all(self.spread @ np.hstack([*blocks, priors]))

    def _errors_seen(self, channel: ResidualBlock, noise: "Noise") -> Array:
        """Return (r, K) so that its square is what B has of a channel, in the directions left.

        C is the larger of the widened variance and, where an autoregression describes the errors,
        its covariance; where the recorder rounds coarsely, that with the covariance of the
        rounding, whose waves come last.
        """
        own = np.asarray(self.left[channel.rows].T * np.sqrt(self.lin.mean_curvature(channel)))
        widened = np.asarray(noise.spread * own)
        if noise.series is not None:
            correlated = noise.std * noise.series.correlated(own)
            return max(widened, correlated, key=lambda errors: float(np.sum(errors**2)))
        if channel.rounding is None:
            return widened
        waves = channel.rounding.waves
        variance = max(noise.std**2, channel.rounding.variance)
        white = max(variance - float(np.mean(np.sum(waves**2, axis=1))), 0.0)
        rounded = np.hstack([np.sqrt(white) * own, own @ waves])
        return max(widened, rounded, key=lambda errors: float(np.sum(errors**2)))

    def rounding_errors(self, noise: Sequence["Noise"]) -> tuple[Array, Array] | None:
        """Spread of relative changes by the errors of a recorder's rounding.

        That is the standard deviation (N,) of all other errors, which are normal, and the waves
        (N, 2 K) that rounding adds; None unless the covariance of one channel is by its rounding.
        """
        lin = self.lin
        waves = [0 if c.rounding is None else c.rounding.waves.shape[1] for c in lin.channels]
        blocks = [self._errors_seen(*pair) for pair in zip(lin.channels, noise, strict=True)]
        rounded = [
            k
            for k, (block, count) in enumerate(zip(blocks, waves, strict=True))
            if count and block.shape[1] > len(lin.errors[lin.channels[k].samples])
        ]
        if len(rounded) != 1:
            return None
        count = waves[rounded[0]]
        amplitudes = np.zeros((len(lin.names), count))
        amplitudes[self.has_effect] = self.spread @ blocks[rounded[0]][:, -count:]
        variance = np.diag(self.covariance(noise)) - np.sum(amplitudes**2, axis=1)
        return np.sqrt(np.maximum(variance, 0.0)), amplitudes

    def of_all(self, root: Array) -> Array:
        """Return root root' (k, k) for all parameters (N, N), nan where nothing is determined."""
        count = len(self.lin.names)
        whole = np.full((count, count), np.nan)
        whole[np.ix_(self.has_effect, self.has_effect)] = root @ root.T
        whole[~self.determined, :] = whole[:, ~self.determined] = np.nan
        return whole

    def others(self, index: int) -> list[str]:
        """Return the names of the parameters that one cannot be distinguished from."""
        at = int(np.count_nonzero(self.has_effect[:index]))
        together = np.asarray(self.joined[self.joined[:, at]].any(axis=0))
        together[at] = False
        return [self.lin.names[k] for k in np.flatnonzero(self.has_effect)[together]]


def factored(lin: Linearisation, kept: Mask) -> Factors:
    """Factor the rows of a fit over the parameters that are kept (N,); the others stay put.

    Singular values of columns of length one, never of J'J; those below EXACTLY_REDUNDANT do not
    count (pseudo-inverse: right for every parameter that takes no part in such a direction).
    """
    weight = lin.by_row([np.sqrt(lin.mean_curvature(channel)) for channel in lin.channels])
    rows = np.vstack([lin.relative * weight[:, None], lin.prior_rows * lin.prior_noise[:, None]])
    lengths = np.linalg.norm(rows, axis=0)
    has_effect = kept & (lengths > NO_EFFECT * np.max(lengths, initial=0.0))
    left, singular, directions = tall_svd(rows[:, has_effect] / lengths[has_effect])
    some = singular > EXACTLY_REDUNDANT * np.max(singular, initial=0.0)
    null = sparse(directions[~some] / lengths[has_effect])
    joined = takes_part(null) | takes_part(null * lengths[has_effect])
    spread = directions[some].T / singular[some] / lengths[has_effect][:, None]
    return Factors(lin, has_effect, left[:, some], spread, null, joined)


def tall_svd(rows: Array) -> tuple[Array, Array, Array]:
    """Return the singular values of a matrix with as many directions as it has columns."""
    missing = max(rows.shape[1] - rows.shape[0], 0)
    left, singular, right = np.linalg.svd(np.pad(rows, ((0, missing), (0, 0))), False)
    return left, singular, right


def sparse(basis: Array) -> Array:
    """Return vectors (d, k) of the same span of which each has a component of its own.

    So redundancies that have nothing to do with each other come apart. The largest component is 1.
    """
    if not len(basis):
        return basis
    own = pivots(basis)
    reduced = np.linalg.solve(basis[:, own], basis)
    largest = np.take_along_axis(reduced, np.abs(reduced).argmax(axis=1)[:, None], axis=1)
    return reduced / largest


def pivots(rows: Array) -> list[int]:
    """Return the columns, one for each row (d, k), that are longest beside those before.

    Source: Golub & Van Loan 2013, section 5.4.2 (QR with column pivoting), by Gram and Schmidt.
    """
    left, picked = np.array(rows), list[int]()
    for _ in rows:
        picked.append(int(np.argmax(np.linalg.norm(left, axis=0))))
        direction = left[:, picked[-1]] / np.linalg.norm(left[:, picked[-1]])
        left -= np.outer(direction, direction @ left)
        left[:, picked] = 0.0
    return picked


def takes_part(directions: Array) -> Mask:
    """Mask of the components of each direction (d, k) that count."""
    size = np.abs(directions)
    return np.asarray(size > TAKES_PART * np.max(size, axis=1, keepdims=True, initial=0.0))
