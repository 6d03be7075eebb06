"""Weighted least squares in the frequency domain: transforms of record and response, weighted.

Equal weights are least squares in time (Parseval). Others are one over the amplitude of the noise
at each frequency, estimated from the residuals of an earlier fit.

Source: Whittle 1953; Ljung 1999, sections 7.8 and 14.4; Hannan 1970, chapter 7 (smoothed spectra);
Prais & Winsten 1954 (whitening in time).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from related_work import (
    Estimate,
    Functions,
    Residuals,
    descent,
    linear_form,
    local,
    matched,
)
from scipy.ndimage import uniform_filter1d

ROUNDS = 2  # of a fit and the spectrum of its residuals
WIDTH = 61  # bins that a spectrum is averaged over: 6 Hz of 50


@dataclass(frozen=True, eq=False)
class Weighted:
    """Residuals whose transforms are weighted; ``weights`` (M // 2 + 1,) by frequency.

    With ``differenced`` transforms are those of differences from sample to sample: over that of the
    one impulse of a step's differences they are the frequency response.
    """

    own: Functions
    weights: np.ndarray
    differenced: bool = False

    def transformed(self, errors: np.ndarray) -> np.ndarray:
        """Return the real and imaginary parts of the weighted transform of errors (M, ...)."""
        if self.differenced:
            errors = np.diff(errors, axis=0, prepend=0.0)
        scale = self.weights * np.sqrt(2.0 / len(errors))
        scale[0] = self.weights[0] / np.sqrt(len(errors))
        half = np.fft.rfft(errors, axis=0) * scale.reshape(-1, *[1] * (errors.ndim - 1))
        return np.concatenate([half.real, half.imag])

    def residuals(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return what is made small at each of points (N,)."""
        return [self.transformed(errors) for errors in self.own.residuals(points)]

    def jacobians(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return its derivatives at each of points (N,)."""
        return [self.transformed(slopes) for slopes in self.own.jacobians(points)]


Weighting = Callable[[np.ndarray], np.ndarray]  # of residuals (M,)


def smoothed(residuals: np.ndarray) -> np.ndarray:
    """Return weights by the periodogram of residuals, averaged over neighbouring frequencies."""
    power = uniform_filter1d(np.abs(np.fft.rfft(residuals)) ** 2, WIDTH, mode="reflect")
    return np.sqrt(np.mean(power) / power)


def repeated_share(residuals: np.ndarray) -> float:
    """Return the share of each residual in the next one."""
    return float(residuals[1:] @ residuals[:-1] / (residuals @ residuals))


def by_share(residuals: np.ndarray) -> np.ndarray:
    """Return weights by an AR(1) of residuals: what whitens errors that repeat a share."""
    return whitening(repeated_share(residuals), len(residuals))


def whitening(share: float, count: int) -> np.ndarray:
    """Return the weights (M // 2 + 1,) for errors that repeat a share of the one before."""
    return np.abs(1.0 - share * np.exp(-2j * np.pi * np.fft.rfftfreq(count)))


def equal(residuals: np.ndarray) -> np.ndarray:
    """Return equal weights."""
    return np.ones(len(residuals) // 2 + 1)


def weighted(weighting: Weighting) -> Callable[[Residuals, np.ndarray], Estimate]:
    """Return the method: least squares by way of the linear phase, then fits by its residuals."""

    def estimate(record: Residuals, start: np.ndarray) -> Estimate:
        stages = [matched(record, start)]
        stages.append(local(record, stages[0].point))
        for _ in range(ROUNDS):
            functions = Weighted(record, weighting(record(stages[-1].point)))
            stages.append(descent(functions, stages[-1].point, record.bounds))
        return Estimate(stages[-1].point, sum(stage.simulations for stage in stages))

    return estimate


@dataclass(frozen=True, eq=False)
class Whitened:
    """Residuals that repeat a share of the one before, each less that share: in time."""

    own: Functions
    share: float

    def whitened(self, errors: np.ndarray) -> np.ndarray:
        """Return white errors of errors (M, ...); the first one has none before it."""
        first = np.sqrt(1.0 - self.share**2) * errors[:1]
        return np.concatenate([first, errors[1:] - self.share * errors[:-1]])

    def residuals(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return what is made small at each of points (N,)."""
        return [self.whitened(errors) for errors in self.own.residuals(points)]

    def jacobians(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return its derivatives at each of points (N,)."""
        return [self.whitened(slopes) for slopes in self.own.jacobians(points)]


def whitened_in_time(record: Residuals, start: np.ndarray) -> Estimate:
    """Return least squares by way of the linear phase, then fits whitened by their residuals."""
    stages = [matched(record, start)]
    stages.append(local(record, stages[0].point))
    for _ in range(ROUNDS):
        functions = Whitened(record, repeated_share(record(stages[-1].point)))
        stages.append(descent(functions, stages[-1].point, record.bounds))
    return Estimate(stages[-1].point, sum(stage.simulations for stage in stages))


def curve(highest: float) -> Callable[[Residuals, np.ndarray], Estimate]:
    """Return the method that fits the linear model's frequency response up to a frequency (Hz)."""

    def estimate(record: Residuals, start: np.ndarray) -> Estimate:
        times = record.experiments[0].simulator.times
        frequency = np.fft.rfftfreq(len(times), times[1] - times[0])
        within = ((frequency > 0.0) & (frequency <= highest)).astype(float)
        functions = Weighted(linear_form(record), within, differenced=True)
        return descent(functions, start, record.bounds)

    return estimate


def least_spread(slopes: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Return standard errors (N,) of equal weights and of the true ones, in those of white noise.

    For derivatives (M, N) and errors that repeat a share of the one before.
    """
    lags = np.abs(np.subtract.outer(np.arange(len(slopes)), np.arange(len(slopes))))
    covariance = share**lags
    inverse = np.linalg.inv(slopes.T @ slopes)
    least = np.linalg.inv(slopes.T @ np.linalg.solve(covariance, slopes))
    of_equal = inverse @ slopes.T @ covariance @ slopes @ inverse
    return tuple(np.sqrt(np.diag(each) / np.diag(inverse)) for each in (of_equal, least))
