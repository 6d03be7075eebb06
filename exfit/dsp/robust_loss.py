"""Losses of a weighted error: how much a sample counts that lies far from the rest."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from exfit.util.arrays import Array

Scale = float | Array  # one for all errors, or each its own
OfError = Callable[[Array, Scale], Array]


class Loss(NamedTuple):
    """Functions of the errors e (M,) and of the scale C > 0, a number or (M,), in the unit of e,
    beyond which they count less.

    The loss of an error is C^2 rho((e / C)^2) / 2. ``residual`` is the r of e's sign with r^2 / 2
    equal to it: least squares of r minimise the loss. ``slope`` is dr/de, ``influence`` the psi of
    robust statistics, d(r^2 / 2)/de, and ``curvature`` d psi/de. An infinite error has an infinite
    residual.

    Source: Huber 1964; Triggs, McLauchlan, Hartley and Fitzgibbon 1999, section 4.3.
    """

    residual: OfError
    slope: OfError
    influence: OfError
    curvature: OfError


def _square_residual(e: Array, scale: Scale) -> Array:
    return e


def _square_slope(e: Array, scale: Scale) -> Array:
    return np.ones_like(e)


def _huber_residual(e: Array, scale: Scale) -> Array:
    size = np.abs(e)
    far = np.sqrt(scale) * np.sqrt(2.0 * np.maximum(size, scale) - scale)
    return np.copysign(np.where(size <= scale, size, far), e)


def _huber_slope(e: Array, scale: Scale) -> Array:
    return scale / np.maximum(np.abs(_huber_residual(e, scale)), scale)


def _huber_influence(e: Array, scale: Scale) -> Array:
    return np.clip(e, -scale, scale)


def _huber_curvature(e: Array, scale: Scale) -> Array:
    return np.asarray(np.abs(e) <= scale, dtype=np.float64)


# with e = C sinh(u), C^2 (sqrt(1 + (e / C)^2) - 1) is 2 C^2 sinh(u / 2)^2: nothing cancels at 0
def _soft_residual(e: Array, scale: Scale) -> Array:
    return np.asarray(2.0 * scale * np.sinh(np.arcsinh(e / scale) / 2.0))


def _soft_slope(e: Array, scale: Scale) -> Array:
    half = np.cosh(np.arcsinh(e / scale) / 2.0)
    return np.asarray(1.0 / (2.0 * half - 1.0 / half))


def _soft_influence(e: Array, scale: Scale) -> Array:
    return np.asarray(scale * np.tanh(np.arcsinh(e / scale)))


def _soft_curvature(e: Array, scale: Scale) -> Array:
    return np.asarray((1.0 / np.cosh(np.arcsinh(e / scale))) ** 3)


LOSSES: Mapping[str, Loss] = MappingProxyType(
    {
        # rho(z) = z
        "least-squares": Loss(_square_residual, _square_slope, _square_residual, _square_slope),
        # rho(z) = z up to 1, then 2 sqrt(z) - 1
        "huber": Loss(_huber_residual, _huber_slope, _huber_influence, _huber_curvature),
        # rho(z) = 2 (sqrt(1 + z) - 1)
        "soft-l1": Loss(_soft_residual, _soft_slope, _soft_influence, _soft_curvature),
    }
)
