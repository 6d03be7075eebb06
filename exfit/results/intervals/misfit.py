"""Intervals of an event with all given values fitted of which the model shows not all.

That is where more than noise is left, or where limits act: the filter of a recorder blurs what
drives them, and parameters take that up.
"""

from collections.abc import Mapping, Sequence

from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.influences import first_of
from exfit.results.intervals.averages import moved
from exfit.results.intervals.value_errors import ErrorsOfValues
from exfit.simulation.limits import extremes

NOT_NOISE = 2.0  # times the errors, as measured
ACTING = 0.999  # of a limit: what comes so far is held by it


def acting_limits(
    setups: Sequence[ExperimentSetup], values: Mapping[str, float]
) -> tuple[str, ...]:
    """Return the limits that hold the responses at the values."""
    reached = (each for setup in setups for each in extremes(*setup.experiment.at(values)))
    return tuple(dict.fromkeys(each.limit for each in reached if each.share >= ACTING))


def why_counted_twice(acting: Sequence[str], explained: bool) -> str:
    """Return why errors and intervals count twice, "" where they do not."""
    if explained and not acting:
        return ""
    why = f"{first_of([*acting])} limits the response" if explained else "more than noise is left"
    return f"{why} with all values fitted: errors and intervals count twice"


def counted_twice(errors: ErrorsOfValues) -> ErrorsOfValues:
    """Return what records leave of the given values twice as large."""
    return errors._replace(
        sides={
            name: (NOT_NOISE * down, NOT_NOISE * up) for name, (down, up) in errors.sides.items()
        },
        left={name: NOT_NOISE * own for name, own in errors.left.items()},
    )


def allowing_for_misfit(
    uncertainty: UncertaintyAnalysis, residuals: Residuals, values: Mapping[str, float]
) -> UncertaintyAnalysis:
    """Return the uncertainty with errors, and sides of intervals about the ``values``, twice."""
    parameters = {**uncertainty.confidence.parameters}
    for free in residuals.free:
        own, at = parameters[free.name], values[free.name]
        error, relative, ends = own.std_error, own.relative_error, own.interval
        parameters[free.name] = own._replace(
            std_error=None if error is None else NOT_NOISE * error,
            relative_error=None if relative is None else NOT_NOISE * relative,
            interval=ends and (_farther(free, at, ends[0]), _farther(free, at, ends[1])),
            by_noise=own.by_noise or ends,
        )
    return uncertainty.with_parameters(parameters)


def _farther(free: FreeParameter, value: float, limit: float | None) -> float | None:
    if limit is None:
        return None
    return moved(free, limit, (NOT_NOISE - 1.0) * (free.scaled(limit) - free.scaled(value)))
