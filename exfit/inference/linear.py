"""A least-squares fit as its linearisation sees it: errors, slopes, and what is held."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

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


class Rounding(NamedTuple):
    """Errors that a recorder which rounds to a ``step`` adds to those of a channel, weighted.

    ``waves`` (samples, 2 K): waves waves' is the covariance of what is the same again where the
    signal stays at one level, cosines first, then sines; it is part of the ``variance`` of the
    errors, noise and rounding.
    """

    step: float
    waves: Array
    variance: float


@dataclass(frozen=True, eq=False)
class ResidualBlock:
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
        self._check_lengths()
        for name in ("errors", "jacobian", "influence", "curvature"):
            shape = (rows, count) if name == "jacobian" else (samples,)
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name}: shape {getattr(self, name).shape}, not {shape}")
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name}: not finite")
        if sum(len(self.errors[block.samples]) for block in self.channels) != samples:
            raise ValueError(f"channels: must cover the {samples} errors")
        if sum(len(self.jacobian[block.rows]) for block in self.channels) != rows:
            raise ValueError(f"channels: must cover the {rows} rows")

    def _check_lengths(self) -> None:
        count = len(self.names)
        for name in OF_EACH_PARAMETER:
            if len(getattr(self, name)) != count:
                raise ValueError(f"{name}: {len(getattr(self, name))} for {count} parameters")

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
        return np.asarray(np.where(self.logarithmic, value, linear))

    @cached_property
    def own_size(self) -> Array:
        """Change that counts as 100 % where a parameter is judged to be determined or not.

        It is `size`, but the value itself where the bounds keep it from zero.
        """
        value = np.abs(self.values)
        kept_from_zero = ~(np.array(self.through_zero) | np.array(self.nuisances)) & (value > 0.0)
        return np.asarray(np.where(kept_from_zero, value, self.size))

    @cached_property
    def ranked_size(self) -> Array:
        """Change that counts as 100 % where the effects of parameters are ranked, (N,).

        It is the value and, of a value of 0, the interval between the bounds.
        """
        value = np.abs(self.values)
        return np.asarray(np.where(value > 0.0, value, self.width))

    @property
    def free(self) -> Mask:
        """Mask of the parameters that lie on no bound (N,)."""
        return np.array([side is None for side in self.held], dtype=bool)

    @cached_property
    def relative(self) -> Array:
        """The derivative of the errors to relative changes, (R, N)."""
        return np.asarray(self.jacobian * self.size)

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
