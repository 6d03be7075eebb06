"""What the rounding of a recorder does to the errors of its samples.

Noise smaller than the step does not make the errors of rounding independent: where the signal stays
at one level, all samples have the same error again.
"""

import numpy as np

from exfit.util.arrays import Array

COARSE = 1.8  # steps over the scatter: below, noise of 0.5 steps leaves 1 % of no sum of errors
FINEST, COARSEST, CANDIDATES = 0.03, 1.0, 15  # noise before rounding, in steps
CORRECTIONS = 4  # of the levels, from one candidate to the next
LEAST_PROBABILITY = 1e-6  # of a reading: what a model misses must not decide
MOST_WAVES = 20
NEGLIGIBLE = 1e-4  # of the variance of rounding


def is_coarse(step: float, scatter: float) -> bool:
    """Check whether the errors of rounding to a step repeat, beside errors of this scatter."""
    return step > COARSE * scatter


def noise_before_rounding(readings: Array, levels: Array, slopes: Array, step: float) -> float:
    """Return the standard deviation of the noise on levels (M,) that were rounded to readings (M,).

    It is that of the greatest likelihood, if the levels follow as the ``slopes`` (M, N) to what was
    fitted allow: a fit to rounded readings has taken some of their errors for the signal's. A
    reading is as probable as it is that the sum of level and noise lies within half a step of it;
    the logarithm of that is concave in the level.
    """
    off, basis = (levels - readings) / step, np.linalg.qr(slopes)[0]
    amounts = np.zeros(basis.shape[1])
    candidates = np.geomspace(COARSEST, FINEST, CANDIDATES)
    likelihoods = []
    for noise in candidates:
        for _ in range(CORRECTIONS):
            _, score, information = reading_likelihood(off + basis @ amounts, noise)
            weighted = basis.T @ (information[:, None] * basis)
            amounts = amounts + np.linalg.lstsq(weighted, basis.T @ score)[0]
        likelihoods.append(np.sum(reading_likelihood(off + basis @ amounts, noise)[0]))
    best = min(max(int(np.argmax(likelihoods)), 1), CANDIDATES - 2)
    around = slice(best - 1, best + 2)
    curve = np.polyfit(np.log(candidates[around]), likelihoods[around], 2)
    if curve[0] >= 0.0:
        return step * float(candidates[int(np.argmax(likelihoods))])
    return step * float(np.clip(np.exp(-curve[1] / (2.0 * curve[0])), FINEST, COARSEST))


def reading_likelihood(off: Array, noise: float) -> tuple[Array, Array, Array]:
    """Return the logarithm of the probability of readings, its slope and its expected curvature.

    ``off`` (M,) are the levels less the readings, both in steps of the recorder; (M,) each.
    """
    from scipy.special import ndtr

    high, low = (0.5 - off) / noise, (-0.5 - off) / noise
    probability = ndtr(high) - ndtr(low) + LEAST_PROBABILITY
    density_low, density_high = (
        np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) / noise for z in (low, high)
    )
    score = (density_low - density_high) / probability
    bend = (low * density_low - high * density_high) / noise / probability
    return np.log(probability), score, np.maximum(score**2 - bend, LEAST_PROBABILITY)


def rounding_waves(levels: Array, step: float, noise: float) -> Array:
    """Return W (M, 2 K), so that W W' is the covariance of the mean errors of rounding at levels.

    The zero of the recorder lies anywhere. By its Fourier series the mean error of rounding a level
    with noise is that of a sawtooth, each wave made smaller by the noise; waves of any phase have
    the covariance of a cosine of the difference of two levels.

    Source: Widrow & Kollar 2008, chapter 4 (the characteristic function of what is rounded).
    """
    k = np.arange(1, MOST_WAVES + 1)
    variances = (step / (np.pi * k)) ** 2 / 2.0 * np.exp(-((2.0 * np.pi * k * noise / step) ** 2))
    large = variances > NEGLIGIBLE * step**2 / 12.0
    k, variances = k[large], variances[large]
    angles = 2.0 * np.pi * levels[:, None] / step * k
    waves = np.hstack([np.cos(angles), np.sin(angles)])
    return np.asarray(waves * np.tile(np.sqrt(variances), 2))
