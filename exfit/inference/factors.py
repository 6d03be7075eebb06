"""The normal equations of a fit, factored: what it determines, and what it cannot distinguish."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from exfit.inference.linear import Array, Linearisation, Mask, ResidualBlock

if TYPE_CHECKING:
    from exfit.inference.noise import Noise

EXACTLY_REDUNDANT = 1e-9  # of the largest singular value: rounding, not a weak influence
NO_EFFECT = 1e-12  # of the largest column: rounding
TAKES_PART = 0.01  # of the largest component of a direction


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
        pairs = zip(lin.channels, noise, strict=True)
        blocks = [self._errors_seen(channel, channel_noise) for channel, channel_noise in pairs]
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
        pairs = zip(lin.channels, noise, strict=True)
        blocks = [self._errors_seen(channel, each) for channel, each in pairs]
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

    @property
    def inverse(self) -> Array:
        """The inverse of A: of the second derivatives that the cost has, (N, N)."""
        return self.of_all(self.spread)

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
    return np.asarray(reduced / largest)


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
