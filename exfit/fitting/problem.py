"""The problem of a fit: its residuals, as functions of all that is free."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.fitting.experiment import Channel, ExperimentSetup, Values
from exfit.fitting.parameters import FreeParameter, free_parameter
from exfit.fitting.residuals import Residuals, Robust
from exfit.simulation.interpolation import NEIGHBOURS, Interpolation
from exfit.util.arrays import Array


class FitProblem(NamedTuple):
    """Residuals of a fit, in two forms with the same cost and gradient at every point.

    ``residuals`` are those of all samples; ``compressed`` are fewer, or the same where nothing is
    gained.
    """

    residuals: Residuals
    compressed: Residuals


def problem_of(residuals: Residuals) -> FitProblem:
    """Return both forms of the residuals of all samples."""
    return FitProblem(residuals, compressed(residuals))


def with_setups(problem: FitProblem, setups: Sequence[ExperimentSetup]) -> FitProblem:
    """Make the problem of other tests, without another form."""
    experiments = [setup.experiment for setup in setups]
    residuals = replace(problem.residuals, experiments=experiments)
    return FitProblem(residuals, residuals)


def residuals_of(
    case: Case, setups: Sequence[ExperimentSetup], start: Values | None = None
) -> Residuals:
    """Return the residuals of a case as functions of its free parameters.

    ``start`` are the case's values, where they are at hand. Raises CaseError where nothing is free.
    """
    free = free_parameters(case, setups)
    if not free:
        raise CaseError(f"{case.path}: parameters.free: empty; a fit needs a free parameter")
    fixed = {**(case.values() if start is None else start)}
    for parameter in free:
        fixed.pop(parameter.name, None)
    return Residuals(
        [setup.experiment for setup in setups],
        free,
        fixed,
        case.ties,
        robust_of(case),
        case.estimate.difference_step,
        case.estimate.differences == "relative",
    )


def robust_of(case: Case) -> Robust | None:
    """Loss of a case in place of the squares."""
    estimate = case.estimate
    if estimate.loss == "least-squares":
        return None
    from exfit.dsp.robust_loss import LOSSES

    return Robust(LOSSES[estimate.loss], estimate.loss_scale)


def free_parameters(case: Case, setups: Sequence[ExperimentSetup] = ()) -> list[FreeParameter]:
    """Return the free parameters of a case, then what is found about its records.

    Raises CaseError for a start given beside the case that gives no size by which to search.
    """
    rows = case.rows()
    shared = [
        free_parameter(name, section, rows.get(name)) for name, section in case.free().items()
    ]
    sizeless = [each.name for each in shared if each.width == 0.0 or each.divisor == 0.0]
    if sizeless:
        raise CaseError(
            f"{case.path}: {name}: a start of 0 sets no scale for the search: give min and max"
            for name in sizeless
        )
    return [*shared, *(parameter for setup in setups for parameter in setup.free)]


# ---- compression

LEAST_GAIN = 3  # times fewer errors: else it does not pay
EIGENVALUE_ROUNDING = 1e-14  # of the largest of such a form: smaller ones are rounding
CHANGING_SAMPLES = ("shift", "delay", "scale", "offset")  # nuisances that change what is compared


@dataclass(frozen=True, eq=False)
class CompressedChannel(Channel):
    """A channel whose simulated samples are all points of the grid (G,).

    Its squared errors are those of six errors for each of K groups, and of one more. A group's
    samples are read from the same points of the grid: ``rows`` (K, 6). Its errors are ``maps``
    (K, 6, 6) times the values there less ``theirs`` (K, 6); ``rest`` is the root of what no
    response can lower.
    """

    rows: NDArray[np.int64] = field(kw_only=True)
    maps: Array = field(kw_only=True)
    theirs: Array = field(kw_only=True)
    rest: float = field(kw_only=True)

    def compared(self, simulated: Array) -> Array:
        """Compare simulated signals (K, G), a row of each."""
        return np.stack([self.filtered(samples) for samples in simulated])

    def filtered(self, samples: Array) -> Array:
        """Filter samples (G,) for the comparison: (6 K + 1,)."""
        return np.append(np.einsum("kij,kj->ki", self.maps, samples[self.rows]), 0.0)

    def slopes(self, samples: Array, slopes: Array) -> Array:
        """Return the derivatives (6 K + 1, N) of these, given those (G, N) of samples."""
        mapped = self.maps @ slopes[self.rows]
        return np.vstack([mapped.reshape(-1, slopes.shape[1]), np.zeros(slopes.shape[1])])

    @cached_property
    def record(self) -> Array:
        """The record as it is compared, (6 K + 1,)."""
        return np.append(self.theirs, self.rest)

    @property
    def size(self) -> int:
        """How many errors there are."""
        return self.theirs.size + 1


def compressed(residuals: Residuals) -> Residuals:
    """Return residuals with the same cost and gradient at every point, but fewer of them.

    Between two points of the grid a response is a polynomial through six of them. However many
    samples lie there, the sum of their squared errors is a quadratic form of these six values, and
    six errors have the same sum: a search goes the same way, in a fraction of time and memory. The
    Gauss-Newton matrix J'J is the same as well, so each method goes the same way. They are the same
    residuals where compression would not save much, or where it does not hold: with filters, with a
    robust loss or periodic disturbances, where another program simulates, and where the instants at
    which a record is read, or its scale, are found.

    Source: Golub & Van Loan 2013, section 5.3 (the least-squares problem of a factor R is that of
    all rows).
    """
    if residuals.robust is not None:
        return residuals
    experiments = []
    for whole in residuals.experiments:
        simulator = whole.simulator.on_grid()
        changing = any(nuisance.kind in CHANGING_SAMPLES for nuisance in whole.nuisances)
        added = whole.sines or whole.whitening or whole.simulator.responder is not None
        possible = all(channel.plain for channel in whole.channels) and not (changing or added)
        errors_on_grid = NEIGHBOURS * len(simulator.times) * len(whole.channels)
        if possible and LEAST_GAIN * errors_on_grid < sum(whole.sizes):
            sampling = whole.simulator.sampling()
            channels = tuple(_compressed_channel(own, sampling) for own in whole.channels)
            whole = replace(whole, simulator=simulator, channels=channels)
        experiments.append(whole)
    if all(new is old for new, old in zip(experiments, residuals.experiments, strict=True)):
        return residuals
    return replace(residuals, experiments=experiments)


def _compressed_channel(channel: Channel, sampling: Interpolation) -> CompressedChannel:
    measured, kept = channel.measured, channel.kept
    first = sampling.first[kept]
    starts = np.flatnonzero(np.diff(first, prepend=-1))
    group = np.cumsum(np.bincount(starts, minlength=len(first))) - 1
    levels = measured[kept][starts]  # about a sample of each group squares do not cancel
    deviations = measured[kept] - levels[group]
    count = len(starts)
    squares = np.zeros((count, NEIGHBOURS, NEIGHBOURS))
    products = np.zeros((count, NEIGHBOURS))
    place = np.cumsum(kept) - 1
    for block in sampling.blocks:
        here = kept[block]
        if not here.any():
            continue
        weights = sampling.weights(block)[here].T
        own, y = group[place[block][here]], deviations[place[block][here]]
        low = own[0]
        size = own[-1] - low + 1
        within = own - low
        for i, j in combinations_with_replacement(range(NEIGHBOURS), 2):
            sums = np.bincount(within, weights[i] * weights[j], size)
            squares[low : low + size, i, j] += sums
            if i != j:
                squares[low : low + size, j, i] += sums
        for i in range(NEIGHBOURS):
            products[low : low + size, i] += np.bincount(within, weights[i] * y, size)
    sizes, vectors = np.linalg.eigh(squares)
    significant = sizes > EIGENVALUE_ROUNDING * sizes[:, -1:]
    roots = np.sqrt(np.where(significant, sizes, 1.0))
    maps = np.where(significant, roots, 0.0)[:, :, None] * vectors.transpose(0, 2, 1)
    along = np.einsum("kji,kj->ki", vectors, products)
    theirs = np.where(significant, along / roots, 0.0)
    rest = max(float(deviations @ deviations - np.sum(theirs**2)), 0.0)
    return CompressedChannel(
        signal=channel.signal,
        measured=measured,
        weight=channel.weight,
        filtering=channel.filtering,
        noise=channel.noise,
        rows=np.minimum(first[starts][:, None] + np.arange(NEIGHBOURS), sampling.last),
        maps=maps,
        theirs=theirs + maps.sum(axis=2) * levels[:, None],
        rest=np.sqrt(rest),
    )
