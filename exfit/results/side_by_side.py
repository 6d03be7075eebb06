"""Results of fits beside each other: how each ended, and their parameters."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from exfit.results.model import FitResult

CONVERGED = "converged"
NOT_CONVERGED, INTERRUPTED = "not converged", "interrupted"
NO_MATCH, NOT_ACCEPTED = "no match", "not accepted"
DIGITS = 9  # significant digits of a number in the table


class ParameterValue(NamedTuple):
    """A parameter of one of several results: its value, and whether it was fitted there.

    ``at_bound`` is the bound that it lies on, ``resolved`` whether the record determines it.
    """

    value: float
    fitted: bool
    at_bound: str | None
    resolved: bool


def outcome_of(result: FitResult) -> str:
    """Return in a word how a fit ended; it is trusted where that is CONVERGED."""
    if result.interrupted:
        return INTERRUPTED
    if not result.success:
        return NOT_CONVERGED
    if not result.describes:
        return NO_MATCH
    return CONVERGED if result.accepted else NOT_ACCEPTED


def parameters_beside(
    results: Sequence[FitResult],
) -> dict[str, tuple[ParameterValue | None, ...]]:
    """Return the parameters that any of the results fitted, each with its value in every result.

    Where a model has no such parameter it is None. What belongs to a record comes last.
    """
    every = [item for result in results for item in result.parameters.items()]
    names = dict.fromkeys(name for name, parameter in every if not parameter.of_record)
    names |= dict.fromkeys(name for name, _ in every)
    values = [result.values for result in results]
    return {
        name: tuple(_value(result, own, name) for result, own in zip(results, values, strict=True))
        for name in names
    }


def _value(result: FitResult, values: Mapping[str, float], name: str) -> ParameterValue | None:
    if name not in values:
        return None
    parameter = result.parameters.get(name)
    if parameter is None:
        return ParameterValue(values[name], False, None, True)
    return ParameterValue(parameter.value, True, parameter.at_bound, parameter.interval is not None)


def results_table(results: Mapping[str, tuple[str, FitResult]]) -> str:
    """Return results as CSV, a line for each; by the name of the run: its case and its result.

    What a run does not have is blank.
    """
    fits = [result for _, result in results.values()]
    parameters = parameters_beside(fits)
    validations = dict.fromkeys(match.name for fit in fits for match in fit.validation)
    header = [
        *("run", "case", "model", "strategy", "outcome", "message", "f_start", "f", "rmse"),
        *("fit_percent", "iterations", "nfev", "njev", "simulations", "seconds"),
        *(f"rmse {name}" for name in validations),
        *parameters,
        *("at_bound", "unresolved"),
    ]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    for k, (run, (case, fit)) in enumerate(results.items()):
        rmses = {match.name: match.rmse for match in fit.validation}
        own = {name: column[k] for name, column in parameters.items()}
        writer.writerow(
            [
                *(run, case, fit.model, fit.strategy, outcome_of(fit), fit.message),
                *map(_number, (fit.start_cost, fit.cost, fit.rmse, fit.comparison.fit_percent)),
                *(fit.nit, fit.nfev, fit.njev, fit.simulations, f"{fit.seconds:.3f}"),
                *(_number(rmses.get(name)) for name in validations),
                *("" if value is None else _number(value.value) for value in own.values()),
                " ".join(name for name, value in own.items() if value and value.at_bound),
                " ".join(name for name, value in own.items() if value and not value.resolved),
            ]
        )
    return out.getvalue()


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.{DIGITS}g}"
