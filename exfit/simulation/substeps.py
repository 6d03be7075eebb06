"""Into how many parts a step of a simulation is divided: a rule of the start at rest."""

import math
from collections.abc import Iterator, Mapping
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from exfit.engine.kernel import AtRest, linear_kernel
from exfit.engine.system import System, time_constants
from exfit.errors import SimulationError
from exfit.models.blocks import SHORTEST
from exfit.plants import VT0
from exfit.simulation.interpolation import ON_GRID
from exfit.util.arrays import Array, Mask

Counts = NDArray[np.int64]
Values = Mapping[str, float]

MOST_SUBSTEPS = 1000  # per step: beyond it the step or a time constant is a mistake
REST_TOLERANCE = 1e-6  # pu/s: below any real motion
STATE_ROUNDING = 1e-13  # of a state, relative
SQUARINGS = 5  # of a Jacobian, to bound its spectral radius
UNDERFLOW = 1e-200  # a smaller norm of a power may have lost all digits
WORTH_A_BLOCK = 3  # sets that take longer one by one than a block of them together
NO_SUBSTEPS = 0  # sub-steps of a set of values that has no response
KEPT = 32  # answers: a Jacobian is asked for where residuals were, and by one record after another


def substeps_at_rest(system: System, step: float, p: Array) -> NDArray[np.int64]:
    """Return into how many parts each step (s) is divided for parameter sets p (K, np).

    The rule is ceil(step * fastest rate), where the rate is the largest of the spectral radius
    of the slopes' Jacobian at rest and 1/T of every time constant that is not bypassed:
    Runge-Kutta of order four is unstable beyond 2.785, and a limit would hide it. It depends
    on the values alone, and a change of one sub-step moves a response by less than the
    method's own error. NO_SUBSTEPS where the start is no rest, or beyond MOST_SUBSTEPS. The
    answer cannot be written to: it serves all who ask the same.
    """
    return _substeps_at_rest(system, step, p.tobytes())


@lru_cache(KEPT)
def _substeps_at_rest(system: System, step: float, sets: bytes) -> NDArray[np.int64]:
    p = np.frombuffer(sets).reshape(-1, len(system.parameters))
    rest = linear_kernel(system).at_rest(p)
    lag_rate = _lag_rates(system, p)
    with np.errstate(all="ignore"):
        needed = _needed(step, lag_rate)
        enough = step * _radius_bounds(rest.jacobian) - ON_GRID <= needed
        # at rest whatever the spectral radius, where that is finite; a sum is finite where all
        # numbers are, or at most too large: then eigenvalues decide
        sure = enough & np.isfinite(rest.x.sum(axis=1)) & (needed <= MOST_SUBSTEPS)
        sure &= np.abs(rest.slopes).max(axis=1) <= REST_TOLERANCE
        parts = needed.astype(np.int64)
    if not sure.all():
        unsure = AtRest(*(part[~sure] for part in rest))
        radius = spectral_radii(unsure.jacobian)
        moves = np.any(_moving(unsure, radius), axis=1)
        parts[~sure] = _parts(step, np.where(moves, np.inf, np.maximum(lag_rate[~sure], radius)))
    parts.flags.writeable = False
    return parts


def groups(parts: Counts, lanes: int) -> Iterator[tuple[int, NDArray[np.intp]]]:
    """Yield lanes and the sets that run in so many: blocks with equal sub-steps, then others."""
    alone = np.flatnonzero(parts != NO_SUBSTEPS)
    if lanes > 1 and len(alone) >= WORTH_A_BLOCK:
        order = alone[np.argsort(parts[alone], kind="stable")]
        equal = np.split(order, np.flatnonzero(np.diff(parts[order])) + 1)
        filling = [len(group) - len(group) % lanes for group in equal]
        ends = [
            end if len(group) - end < WORTH_A_BLOCK else len(group)
            for group, end in zip(equal, filling, strict=True)
        ]
        together = [group[:end] for group, end in zip(equal, ends, strict=True) if end]
        if together:
            yield lanes, np.concatenate(together)
        alone = np.concatenate([group[end:] for group, end in zip(equal, ends, strict=True)])
    if len(alone):
        yield 1, alone


def why_unreachable(system: System, step: float, values: Values, p: Array) -> SimulationError:
    """Error to raise for values, as a vector p (np,), that have no sub-steps."""
    from exfit.simulation.limits import acting_at_rest, limits_passed

    rest = linear_kernel(system).at_rest(p[None])
    radius = spectral_radii(rest.jacobian)
    moving = _moving(rest, radius)[0]
    if not np.any(moving):
        return too_fast(system, step, values, float(radius[0]))
    finite = bool(np.isfinite(rest.jacobian).all())
    states = zip(system.states, rest.slopes[0], moving, strict=True)
    moved = [
        f"{name} moves by {slope:.3g} pu/s"
        for name, slope, moves in states
        if finite and moves and math.isfinite(slope)
    ]
    limiting = acting_at_rest(system, values) if finite else ""
    passed = limiting or limits_passed(system, values)
    why = passed or ", ".join(moved) or "the values do not define one"
    at = f" at vt0 = {values[VT0]:g} pu" if VT0 in values else ""
    return SimulationError(f"no state of rest{at}: {why}")


def substeps_for(system: System, step: float, values: Values, radius: float) -> int:
    """Return the sub-steps for slopes whose Jacobian has a spectral radius (1/s).

    Raises SimulationError where it is not finite, or they are more than MOST_SUBSTEPS.
    """
    if not math.isfinite(radius):
        raise SimulationError("the response does not stay finite")
    p = np.array([[values[name] for name in system.parameters]])
    parts = int(_parts(step, np.maximum(_lag_rates(system, p), radius))[0])
    if parts == NO_SUBSTEPS:
        raise too_fast(system, step, values, radius)
    return parts


def too_fast(system: System, step: float, values: Values, radius: float) -> SimulationError:
    """Error to raise for values that need more than MOST_SUBSTEPS."""
    lags = {name: values[name] for name in time_constants(system) if values[name] >= SHORTEST}
    shortest = min(lags, key=lambda name: lags[name], default=None)
    rate = max(radius, 1.0 / lags[shortest] if shortest else 0.0)
    smallest = (
        f"; the smallest time constant is {shortest} = {lags[shortest]:g} s" if shortest else ""
    )
    return SimulationError(
        f"simulation.step: {step:g} s would need {_needed(step, rate):.4g} sub-steps "
        f"(limit {MOST_SUBSTEPS}) for a rate of {rate:.4g} 1/s{smallest}"
    )


def spectral_radii(jacobians: Array) -> Array:
    """Return the spectral radius of each of Jacobians (K, nx, nx), inf where one is infinite."""
    radii = np.full(len(jacobians), np.inf)
    finite = np.isfinite(jacobians).all(axis=(1, 2))
    if np.any(finite):
        radii[finite] = np.abs(np.linalg.eigvals(jacobians[finite])).max(axis=1)
    return radii


@cache
def _places_of_lags(system: System) -> NDArray[np.intp]:
    return np.array([system.parameters.index(name) for name in time_constants(system)], np.intp)


def _lag_rates(system: System, p: Array) -> Array:
    """Return 1/T of the shortest time constant of each set that is not bypassed."""
    lags = p.take(_places_of_lags(system), axis=1)
    shortest = lags.min(axis=1, initial=np.inf, where=lags >= SHORTEST)
    return np.asarray(1.0 / shortest)


def _parts(step: float, rates: Array) -> NDArray[np.int64]:
    """Return the sub-steps that rates need, and NO_SUBSTEPS beyond MOST_SUBSTEPS."""
    parts = _needed(step, rates)
    # also where a rate is not a number
    return np.where(parts <= MOST_SUBSTEPS, parts, NO_SUBSTEPS).astype(np.int64)


def _needed(step: float, rates: Array | float) -> Array:
    """Return ceil(step * rate), at least one, inf where that is no number any more."""
    with np.errstate(over="ignore"):
        return np.maximum(np.ceil(np.multiply(step, rates) - ON_GRID), 1.0)


def _moving(rest: AtRest, radius: Array) -> Mask:
    """Mask of states (K, nx) that move: by more than the rounding of a state."""
    with np.errstate(all="ignore"):
        rounding = STATE_ROUNDING * np.max(np.abs(rest.x), axis=1) * radius
    limit = np.where(np.isfinite(rounding), REST_TOLERANCE + rounding, np.nan)
    return ~(np.abs(rest.slopes) <= limit[:, None])


def _radius_bounds(jacobians: Array) -> Array:
    """Return bounds above the spectral radii of Jacobians (K, nx, nx), without eigenvalues.

    A power's norm is a bound of the radius' power (Gelfand): the 32nd is near, or overflows.
    """
    power = jacobians
    for _ in range(SQUARINGS):
        power = power @ power
    norm = np.abs(power).sum(axis=2).max(axis=1)
    bound = norm ** (0.5**SQUARINGS)
    return np.where(norm > UNDERFLOW, bound, np.inf)
