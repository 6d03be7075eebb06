"""The search for the parameters of a model that responds to steps as another does."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.features.translate.start import StartValue
from exfit.features.translate.steps import TranslationTask
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.residuals import Residuals, SideBySide
from exfit.models.blocks import SHORTEST
from exfit.models.sheet import Model, Parameter

Values = Mapping[str, float]
Watch = Callable[[estimate.Progress], None]

NOTICEABLE = 1e-3  # of the step, rms: a change of the responses that a study would not see
REACH = 10.0  # times the copied and the typical value: how far the search goes
ITERATIONS = 20  # of each phase
GAIN = 1e-4  # of the cost: what an iteration must gain


class Effort(NamedTuple):
    """From how many starts a search goes, and how many of them it refines."""

    starts: int
    refined: int


MANY_STARTS, ONE_START = Effort(32, 2), Effort(1, 1)


class FittedValues(NamedTuple):
    """The fitted values, and by what share of its value each can change unnoticed."""

    values: Values
    unnoticed: Values


def search(
    task: TranslationTask,
    free: Sequence[FreeParameter],
    values: Values,
    effort: Effort,
    watch: Watch,
) -> FittedValues | None:
    """Return values fitted to the steps; None where the target has no response.

    ``values`` are those of all other parameters. Raises KeyboardInterrupt at an interruption.
    """
    names = {parameter.name for parameter in free}
    fixed = {name: value for name, value in values.items() if name not in names}
    start = fixed | {parameter.name: parameter.start for parameter in free}
    experiments = [step.experiment(task.target, start) for step in task.fitted]
    residuals = Residuals(experiments, free, fixed)
    descent = estimate.Descent(
        functions=SideBySide(residuals),
        bounds=residuals.bounds,
        max_iterations=ITERATIONS,
        ftol=GAIN,
        x_scale=residuals.units,
    )
    minima = estimate.multistart(_best_starts(residuals, effort), [descent], watch=watch)
    if minima.interrupted:
        raise KeyboardInterrupt
    if minima.best is None:
        return None
    fitted = residuals.values(minima.best.x)
    return FittedValues({name: fitted[name] for name in names}, _unnoticed(residuals, minima.best))


def _best_starts(residuals: Residuals, effort: Effort) -> list[NDArray[np.float64]]:
    """Return the start of the residuals, and of others over the bounds those of the lowest cost."""
    start, *others = estimate.spread(residuals.bounds, effort.starts, residuals.start)
    order = np.argsort(residuals.costs(others), kind="stable")
    return [start, *(others[k] for k in order[: effort.refined - 1])]


def free_parameters(task: TranslationTask, values: Mapping[str, StartValue]) -> list[FreeParameter]:
    """Return the parameters of the target that are fitted, and where they start."""
    rows = [row for row in task.target.sheet if _is_fitted(row, values[row.symbol], task.source)]
    every = (_free(row, values[row.symbol]) for row in rows)
    return [parameter for parameter in every if parameter is not None]


def _is_fitted(row: Parameter, start: StartValue, source: Model) -> bool:
    """Tell whether a parameter is one that bump tests are fitted for, and no bypassed lag."""
    given = {entry.symbol for entry in source.sheet if entry.free} & {*start.of}
    return row.free and not (_bypassed(row, start) and given)


def _bypassed(row: Parameter, start: StartValue) -> bool:
    return row.unit == "s" and start.value < SHORTEST


def _free(row: Parameter, start: StartValue) -> FreeParameter | None:
    """Return a parameter that is fitted, from its copied value or a typical one.

    A gain that the source does not have may become zero. None where nothing says how large it is.
    """
    copied = bool(start.of) and not _bypassed(row, start)
    value = start.value if copied else row.typical
    sizes = [size for size in (value, row.typical) if size > 0.0]
    if not sizes:
        return None
    high = min(row.high, REACH * max(sizes))
    if row.unit != "s" and row.low <= 0.0 and not (copied and value > 0.0):
        return FreeParameter(row.symbol, value, 0.0, high, logarithmic=False)
    low = max(row.low, min(sizes) / REACH, SHORTEST if row.unit == "s" else 0.0)
    return FreeParameter(row.symbol, min(max(value, low), high), low, high, logarithmic=low > 0.0)


def _unnoticed(residuals: Residuals, best: estimate.Result) -> dict[str, float]:
    """Return by what share of its value each parameter that is not zero can change unnoticed.

    The others follow, as the linear model has it; half of the errors are those of vt.
    """
    values = residuals.values(best.x)
    slopes = [free.slope(float(x)) for free, x in zip(residuals.free, best.x, strict=True)]
    names = [free.name for free in residuals.free]
    relative = np.array([values[name] / slope for name, slope in zip(names, slopes, strict=True)])
    present = np.flatnonzero(relative)
    if not len(present):
        return {}
    jacobian = best.jac[:, present] * relative[present]
    _, singular, directions = np.linalg.svd(jacobian, full_matrices=False)
    rounding = np.finfo(float).eps * len(jacobian) * max(singular[0], np.finfo(float).tiny)
    per_share = directions / np.maximum(singular, rounding)[:, None]
    spread = np.sqrt(np.sum(per_share**2, axis=0))
    shares = NOTICEABLE * np.sqrt(len(jacobian) / 2.0) * spread
    return {names[k]: float(share) for k, share in zip(present, shares, strict=True)}
