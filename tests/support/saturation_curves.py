"""Saturation curves with known numbers, as an engineer takes them: for tests and the study."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.features.programme.result import SaturationForm
from exfit.features.programme.saturation import EXCESS, saturation_curve

Array = NDArray[np.float64]

LOOP = 0.02  # field current of the rising less that of the falling branch, pu
REMANENCE = 0.01  # pu of field current: at most, by which the mean of the branches is moved
LEVEL_SCATTER = 0.01  # pu: levels are set by hand
SHAPES = ("even", "proportional", "closed")  # of the loop over the voltage
QUANTITIES = ("base", "S(1.0)", "S(1.2)")


@dataclass(frozen=True)
class DrawnCurve:
    """Points of a machine, each reading with noise, and what is true of it."""

    form: SaturationForm
    truth: tuple[float, float, float]  # base, S10, S12
    vt: Array
    ifd: Array
    top: float


class Hits(NamedTuple):
    """Whether the intervals hold base, S(1.0) and S(1.2), and half their widths."""

    held: tuple[bool, bool, bool]
    widths: tuple[float, float, float]  # inf where a side has no limit


def drawn_curve(
    form: SaturationForm,
    random: np.random.Generator,
    branches: int = 2,
    shape: str | None = None,
) -> DrawnCurve:
    """Return 10 to 20 points up to 1.1 or 1.2 pu, with noise of 0.1 to 0.3 % in both readings."""
    S10 = random.uniform(0.05, 0.2)
    S12 = S10 * random.uniform(2.2, 5.0)
    base, top, noise = random.uniform(100.0, 3000.0), random.choice([1.1, 1.2]), 1e-3
    noise *= random.uniform(1.0, 3.0)
    count, lowest = int(random.integers(10, 21)), random.uniform(0.1, 0.35)
    rising = count if branches == 1 else (count + 1) // 2
    vt = np.concatenate(
        [np.linspace(lowest, top, rising), np.linspace(top, lowest, count - rising + 1)[1:]]
    )
    inner = np.delete(np.arange(count), rising - 1)
    vt[inner] += LEVEL_SCATTER * random.uniform(-1.0, 1.0, count - 1)
    direction = np.repeat([1.0, -1.0], [rising, count - rising])
    mean = vt + EXCESS[form](vt, S10, S12)
    half = 0.5 * LOOP * widths(vt, mean, top, shape or str(random.choice(SHAPES)))
    offset = REMANENCE * random.uniform(-1.0, 1.0)
    ifd = base * (mean + offset + direction * half + noise * random.standard_normal(count))
    return DrawnCurve(
        form, (base, S10, S12), vt + noise * random.standard_normal(count), ifd, float(top)
    )


def widths(vt: Array, mean: Array, top: float, shape: str) -> Array:
    """Return the width of a loop (M,) over its largest: even, as the current, closed at the top."""
    if shape == "even":
        return np.ones_like(vt)
    return mean / mean.max() if shape == "proportional" else np.sqrt(1.0 - np.minimum(vt / top, 1))


def hits_of(curve: DrawnCurve) -> Hits:
    """Return whether the intervals of a curve hold what is true of it."""
    fitted = saturation_curve(curve.vt, curve.ifd, curve.form).curve
    held, halves = [], []
    for value, truth in zip((fitted.ifd_base, fitted.S10, fitted.S12), curve.truth, strict=True):
        low, high = value.interval
        low, high = -np.inf if low is None else low, np.inf if high is None else high
        held.append(bool(low <= truth <= high))
        halves.append(0.5 * (high - low))
    halves[0] /= curve.truth[0]
    return Hits(tuple(held), tuple(halves))


def shares(hits: Iterable[Hits]) -> Array:
    """Return the shares (3,) of intervals that hold what is true."""
    return np.mean([each.held for each in hits], axis=0)
