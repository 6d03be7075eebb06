"""Tails and quantiles behind an interval: to import SciPy's takes as long as the fit itself."""

from math import atan, erfc, exp, gamma, isinf, lgamma, pi, sqrt, tan
from statistics import NormalDist

import numpy as np

from exfit.util.arrays import Array

NODES = 40  # of the quadrature: it is exact to rounding
NEWTON_ROUNDING = 1e-14  # of the angle: a smaller step changes no digit
PHASES, LEAST_NORMAL, BISECTED = 90, 1e-3, 1e-3  # of a wave; of its unit; and of the quantile
LARGE = 50.0  # from here on the series of the gamma functions' ratio has all digits


def chi_square_tail(statistic: float, dof: int) -> float:
    """Probability that chi-square exceeds a statistic, for whole degrees of freedom.

    Source: Abramowitz & Stegun 1964, 26.4.4, 26.4.5 and 26.4.8.
    """
    half = 0.5 * statistic
    order, tail = (0.5, erfc(sqrt(half))) if dof % 2 else (1.0, exp(-half))
    term = half**order * exp(-half) / gamma(order + 1.0)
    while order < 0.5 * dof:
        tail += term
        order += 1.0
        term *= half / order
    return tail


def student_quantile(dof: float, probability: float) -> float:
    """Return the quantile of Student's t for dof >= 1 at a probability of 0.5 ... 0.995.

    With t = sqrt(dof) tan(angle) the density is proportional to cos(angle)^(dof - 1) (Abramowitz &
    Stegun 1964, 26.7.1 and 26.7.3): smooth, whether the degrees of freedom are whole or not. Its
    integral is concave in the angle, so that Newton's method from the smaller quantile of the
    normal distribution, the one for infinite degrees of freedom, rises to the solution.
    """
    normal = NormalDist().inv_cdf(probability)
    if isinf(dof):
        return normal
    scale = _gamma_ratio(0.5 * dof) / sqrt(pi)

    def density(angles: Array) -> Array:
        return np.asarray(scale * np.exp(0.5 * (dof - 1.0) * np.log1p(-(np.sin(angles) ** 2))))

    nodes, weights = quadrature()
    angle, step = atan(normal / sqrt(dof)), 1.0
    while step > NEWTON_ROUNDING * angle:
        reached = 0.5 + angle * float(weights @ density(angle * nodes))
        step = (probability - reached) / float(density(np.array(angle)))
        angle += step
    return sqrt(dof) * tan(angle)


def wave_quantile(normal: float, waves: Array, level: float) -> float:
    """Bound, at a level, of the sum of a normal error and a wave of any phase.

    ``normal`` is the standard deviation of the first; ``waves`` (2 K,) are the amplitudes of the
    cosines and sines of the phase and its multiples, over the root of 2.
    """
    cosines, sines = np.split(waves, 2)
    phases = np.linspace(0.0, 2.0 * pi, PHASES, endpoint=False)[:, None] * np.arange(
        1, len(cosines) + 1
    )
    wave = sqrt(2.0) * (np.cos(phases) @ sines - np.sin(phases) @ cosines)
    law, low, high = NormalDist(0.0, max(normal, LEAST_NORMAL)), 0.0, 6.0
    while high - low > BISECTED:
        size = 0.5 * (low + high)
        below = np.mean([law.cdf(size - w) - law.cdf(-size - w) for w in wave.tolist()])
        low, high = (size, high) if below < level else (low, size)
    return high


def quadrature() -> tuple[Array, Array]:
    """Return nodes and weights of Gauss and Legendre on 0 ... 1 (Golub & Welsch 1969)."""
    k = np.arange(1.0, NODES)
    nodes, vectors = np.linalg.eigh(np.diag(k / np.sqrt(4.0 * k**2 - 1.0), -1))
    return 0.5 * (1.0 + nodes), vectors[0] ** 2


def _gamma_ratio(a: float) -> float:
    """Return Gamma(a + 1/2) / Gamma(a) (NIST Handbook of Mathematical Functions 2010, 5.11.13)."""
    if a < LARGE:
        return exp(lgamma(a + 0.5) - lgamma(a))
    coefficients = (-399 / 262144, -21 / 32768, 5 / 1024, 1 / 128, -1 / 8, 1.0)
    return sqrt(a) * float(np.polyval(coefficients, 1.0 / a))
