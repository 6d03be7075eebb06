"""Which typical values matter: what a fit would find if one of them were wrong."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.errors import SimulationError
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.system import system_of
from exfit.fitting.uncertainty import UncertaintyAnalysis, slopes_of
from exfit.results.typical_values import DEVIATION, TypicalValue
from exfit.simulation.kernels import parameters_used

Array = NDArray[np.float64]

IN_STANDARD_ERRORS = 2.0  # half of a 95 % interval, where none is known


def parameters_of(case: Case) -> set[str]:
    """Return the parameters that a response of any of the records depends on."""
    own = [system_of(case.seen_from(recording), recording) for recording in case.recordings]
    return {name for system in own or [system_of(case)] for name in parameters_used(system)}


def typical_values_used(case: Case) -> dict[str, float]:
    """Return the typical values that a response of any of the records depends on."""
    used, values = parameters_of(case), case.values()
    return {name: values[name] for name in case.typical() if name in used}


def influence_of_typical_values(
    case: Case, residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis
) -> dict[str, TypicalValue]:
    """Return what each typical value that is not 0 would move, if it were DEVIATION larger.

    At the minimum theta (N,) the gradient stays zero, so that to first order the parameters move by
    -(J'J)^-1 J' dr/dv times the deviation of v: one Jacobian with a column more for each of these
    values gives both. A parameter on a bound stays there. Nothing where a derivative is not finite.

    Source: the implicit function theorem on the gradient, with the Gauss-Newton matrix.
    """
    typical = {name: value for name, value in typical_values_used(case).items() if value}
    if not typical:
        return {}
    jacobian = _in_own_units(residuals, theta, typical)
    if jacobian is None:
        return {}
    count, values = len(residuals.free), residuals.values(theta)
    deviations = DEVIATION * np.array([*typical.values()])
    moving = np.array([free.bound(values[free.name]) is None for free in residuals.free])
    shifts = np.zeros((count, len(typical)))
    own, of_typical = jacobian[:, :count][:, moving], jacobian[:, count:] * deviations
    shifts[moving] = -_least_squares(own, of_typical)
    names = [free.name for free in residuals.free]
    half_widths = _half_widths(residuals, uncertainty)
    return {
        name: _typical_value(value, dict(zip(names, column.tolist(), strict=True)), half_widths)
        for (name, value), column in zip(typical.items(), shifts.T, strict=True)
    }


def _least_squares(matrix: Array, right: Array) -> Array:
    """Return X (N, K) with the least norm of matrix (M, N) X - right (M, K), of small columns too.

    Source: Golub & Van Loan 2013, section 5.3.
    """
    triangle = np.linalg.qr(np.hstack([matrix, right]), mode="r")
    own, other = np.split(triangle, [matrix.shape[1]], axis=1)
    size = np.linalg.norm(own, axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(own / size, other)[0] / size[:, None])


def _in_own_units(residuals: Residuals, theta: Array, typical: Mapping[str, float]) -> Array | None:
    """Return the Jacobian by the free parameters and typical values, None where not finite."""
    added = [
        FreeParameter(name, value, -np.inf, np.inf, logarithmic=False)
        for name, value in typical.items()
    ]
    fixed = {name: value for name, value in residuals.fixed.items() if name not in typical}
    extended = replace(residuals, free=[*residuals.free, *added], fixed=fixed, counter=None)
    point = np.array([*theta, *(free.scaled(free.start) for free in added)])
    try:
        jacobian = extended.exact(point) / slopes_of(extended, point)
    except SimulationError:
        return None
    return jacobian if np.isfinite(jacobian).all() else None


def _half_widths(residuals: Residuals, uncertainty: UncertaintyAnalysis) -> dict[str, float]:
    """Return half the width of the interval of each parameter of the unit.

    Without one that has both ends it is twice the standard error, where that is known.
    """
    of_records = {
        nuisance.name for experiment in residuals.experiments for nuisance in experiment.nuisances
    }
    half_widths = {}
    for name, own in uncertainty.confidence.parameters.items():
        low, high = own.interval or (None, None)
        if name in of_records:
            continue
        if low is not None and high is not None:
            half_widths[name] = 0.5 * (high - low)
        elif own.std_error is not None:
            half_widths[name] = IN_STANDARD_ERRORS * own.std_error
    return half_widths


def _typical_value(
    value: float, shifts: Mapping[str, float], half_widths: Mapping[str, float]
) -> TypicalValue:
    """Return a typical value with those of its shifts that exceed half of an interval."""
    shares = {
        name: abs(shifts[name]) / half_width
        for name, half_width in half_widths.items()
        if abs(shifts[name]) > half_width > 0.0
    }
    return TypicalValue(value, shifts, dict(sorted(shares.items(), key=lambda each: -each[1])))
