"""Which typical values matter: what a fit would find if one of them were wrong."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.intervals.value_errors import shifts_by_values
from exfit.results.typical_values import DEVIATION, TypicalValue, typical_values_used

Array = NDArray[np.float64]

IN_STANDARD_ERRORS = 2.0  # half of a 95 % interval, where none is known


def influence_of_typical_values(
    case: Case, residuals: Residuals, theta: Array, uncertainty: UncertaintyAnalysis
) -> dict[str, TypicalValue]:
    """Estimate the effect of each typical value that is not 0, were it DEVIATION larger.

    To first order, by `shifts_by_values`: nothing where a derivative is not finite.
    """
    typical = {name: value for name, value in typical_values_used(case).items() if value}
    if not typical:
        return {}
    deviations = {name: DEVIATION * value for name, value in typical.items()}
    shifts = shifts_by_values(residuals, theta, deviations)
    if shifts is None:
        return {}
    names = [free.name for free in residuals.free]
    half_widths = _half_widths(residuals, uncertainty)
    return {
        name: _typical_value(value, dict(zip(names, column.tolist(), strict=True)), half_widths)
        for (name, value), column in zip(typical.items(), shifts.T, strict=True)
    }


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
