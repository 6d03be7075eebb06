"""Errors of an event's 30 to 50 values fitted at once, which linear theory makes too small."""

from collections.abc import Mapping

from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.intervals.averages import moved
from exfit.results.intervals.value_errors import ErrorsOfValues

LARGER = 1.1  # than by linear theory, as docs/uncertainty.md counted


def errors_beyond_linear(errors: ErrorsOfValues) -> ErrorsOfValues:
    """Return what records leave of the given values, larger."""
    return errors._replace(
        sides={name: (LARGER * down, LARGER * up) for name, (down, up) in errors.sides.items()},
        left={name: LARGER * own for name, own in errors.left.items()},
    )


def beyond_linear(
    uncertainty: UncertaintyAnalysis, residuals: Residuals, values: Mapping[str, float]
) -> UncertaintyAnalysis:
    """Return the uncertainty with larger errors, and sides of intervals about the ``values``."""
    parameters = {**uncertainty.confidence.parameters}
    for free in residuals.free:
        own, at = parameters[free.name], free.scaled(values[free.name])
        error, relative, ends = own.std_error, own.relative_error, own.interval
        parameters[free.name] = own._replace(
            std_error=None if error is None else LARGER * error,
            relative_error=None if relative is None else LARGER * relative,
            interval=ends and (_farther(free, at, ends[0]), _farther(free, at, ends[1])),
            by_noise=own.by_noise or ends,
        )
    return uncertainty.with_parameters(parameters)


def _farther(free: FreeParameter, at: float, end: float | None) -> float | None:
    if end is None:
        return None
    return moved(free, end, (LARGER - 1.0) * (free.scaled(end) - at))
