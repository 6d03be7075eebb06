"""Results of fits beside each other: how each ended, and their parameters."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from exfit.results.model import FitResult
from exfit.results.tables import csv_text, number_text
from exfit.util.text import rounded_value

INTERRUPTED, NOT_ACCEPTED = "interrupted", "not accepted"  # beside the verdicts


class ParameterValue(NamedTuple):
    """A parameter of one of several results: its value, and whether it was fitted there.

    ``at_bound`` is the bound that it lies on; it is not ``resolved`` where the record does not
    determine it; ``text`` is the value as tables print it.
    """

    value: float
    fitted: bool
    at_bound: str | None
    resolved: bool
    text: str


def outcome_of(result: FitResult) -> str:
    """Name the verdict on a fit in its words, or what speaks against one that matches."""
    if result.interrupted:
        return INTERRUPTED
    if result.verdict.matches and not result.accepted:
        return NOT_ACCEPTED
    return result.verdict.verdict


def explanation_of(result: FitResult) -> str:
    """Explain in a sentence why a fit ended so."""
    if outcome_of(result) == NOT_ACCEPTED:
        every = (*result.comparisons, *result.validation)
        return "; ".join(match.reason for match in every if match.reason)
    return result.verdict.reason


def parameters_beside(
    results: Sequence[FitResult],
) -> dict[str, tuple[ParameterValue | None, ...]]:
    """Return the parameters that any of the results fitted, each with its value in every result.

    Where a model has no such parameter it is None. What belongs to a record comes last.
    """
    every = [item for result in results for item in result.parameters.items()]
    names = dict.fromkeys(name for name, parameter in every if not parameter.of_record)
    names |= dict.fromkeys(name for name, _ in every)
    beside: dict[str, list[ParameterValue | None]] = {name: [] for name in names}
    for result in results:
        values = result.values
        for name, column in beside.items():
            parameter = result.parameters.get(name)
            if parameter is not None:
                value, bound = parameter.value, parameter.at_bound
                resolved = result.knowledge is None or parameter.determined
                text = parameter.rounded(value)
                column.append(ParameterValue(value, True, bound, resolved, text))
            elif name in values:
                text = rounded_value(values[name])
                column.append(ParameterValue(values[name], False, None, True, text))
            else:
                column.append(None)
    return {name: tuple(column) for name, column in beside.items()}


def results_table(results: Mapping[str, tuple[str, FitResult]]) -> str:
    """Return results as CSV, a line for each run by its name, blank where it has no such value."""
    fits = [fit for _, fit in results.values()]
    parameters = parameters_beside(fits)
    validations = dict.fromkeys(match.name for fit in fits for match in fit.validation)
    rows = []
    for k, (run, (case, fit)) in enumerate(results.items()):
        errors = {match.name: number_text(match.rmse) for match in fit.validation}
        known = {name: value for name, each in parameters.items() if (value := each[k]) is not None}
        on_bounds = [name for name, value in known.items() if value.at_bound]
        unresolved = [name for name, value in known.items() if not value.resolved]
        rows.append(
            {
                "run": run,
                "case": case,
                "model": fit.model,
                "strategy": fit.strategy,
                "outcome": outcome_of(fit),
                "explanation": explanation_of(fit),
                "f_start": number_text(fit.start_cost),
                "f": number_text(fit.cost),
                "rmse": number_text(fit.rmse),
                "fit_percent": number_text(fit.comparison.fit_percent),
                "iterations": f"{fit.nit}",
                "nfev": f"{fit.nfev}",
                "njev": f"{fit.njev}",
                "simulations": f"{fit.simulations}",
                "seconds": f"{fit.seconds:.3f}",
                **{f"rmse {name}": errors.get(name, "") for name in validations},
                **dict.fromkeys(parameters, ""),
                **{name: number_text(value.value) for name, value in known.items()},
                "at_bound": " ".join(on_bounds),
                "unresolved": " ".join(unresolved),
            }
        )
    return csv_text([*rows[:1], *(row.values() for row in rows)])
