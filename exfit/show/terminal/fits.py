"""The result of a fit."""

from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.table import Table

from exfit.inference.sensitivity import ParameterEffect
from exfit.results.model import FitResult, FittedParameter
from exfit.results.search_summary import search_summary
from exfit.results.verdict import GOOD, MATCHES
from exfit.show.terminal.terminal import (
    NO_BREAK,
    error_of,
    in_groups,
    interval,
    notes,
    number,
    paragraph,
    plain_table,
    remarks,
    show_table,
    unresolved,
)
from exfit.show.terminal.validations import comparisons, played, rejections
from exfit.util.sources import by_source
from exfit.util.text import percentage

STYLES = {GOOD: "bold green", MATCHES: "bold yellow"}  # of verdicts; of the others bold red


def fit(console: Console, result: FitResult, before: FitResult | None = None) -> None:
    """Show the fitted values, how well they are determined, and how well each record is met.

    The values of a fit ``before`` are printed beside the new ones.
    """
    console.print()
    verdict(console, result)
    console.print()
    show_table(console, fitted_table(result, before), _expendable(result))
    console.print()
    if result.success:
        remarks(console, f"{result.outcome}:", [result.message], "bold")
    several = len(result.comparisons) > 1
    figures = [f"cost {result.start_cost:.4e} -> {result.cost:.4e}"]
    if not several:
        comparison = result.comparison
        figures += [f"rmse {comparison.rmse:.3e} pu", f"fit {percentage(comparison.fit_percent)} %"]
    paragraph(console, in_groups(figures), indent=2)
    effort = (
        f"{result.nit} iterations",
        f"{result.nfev} residuals",
        f"{result.njev} Jacobians",
        f"{result.simulations} simulations",
        f"{result.seconds:.2f} s",
    )
    paragraph(console, in_groups(effort, ", "), indent=2)
    _phase_ends(console, result)
    paragraph(console, f"sub-steps: {result.substeps}")
    if result.sources:
        remarks(console, "sources of the values:", [source_counts(result)], "")
    if result.minima is not None:
        remarks(console, "search:", [search_summary(result.minima, result.cost)], "bold")
    if result.knowledge is not None:
        console.print()
        remarks(console, "sensitivity:", ranking(result.knowledge.effects), "bold")
        unresolved(console, result.knowledge.sentences)
    notes(console, result.notes)
    if result.validation or several:
        comparisons(console, [*result.comparisons, *result.validation])
    else:
        played(console, result.comparisons)


def verdict(console: Console, result: FitResult) -> None:
    """Show in a line what a fit comes to, then why it may be so and what to do."""
    style = STYLES.get(result.verdict.verdict, "bold red")
    remarks(console, "verdict:", [result.verdict.sentence], style)
    rejections(console, result.validation)
    kind = "note:" if result.verdict.verdict == GOOD else "cause:"
    remarks(console, kind, (cause.sentence for cause in result.verdict.causes))


def _phase_ends(console: Console, result: FitResult) -> None:
    """Show where each phase of the search handed over to the next."""
    for end in result.phase_ends:
        errors = ", ".join(f"{match.rmse:.3e}" for match in end.comparisons)
        figures = (
            f"end of {end.phase}: iteration {end.iteration}, cost {end.cost:.4e}",
            f"rmse {errors} pu",
            f"parameters_{end.phase}.yaml",
        )
        paragraph(console, in_groups(figures), indent=2)


def source_counts(result: FitResult) -> str:
    """Return how many values come from where."""
    groups = by_source(result.sources, result.sources)
    return in_groups((f"{len(names)} {source}" for source, names in groups.items()), ", ")


def ranking(effects: Sequence[ParameterEffect]) -> Iterator[str]:
    """Yield in one sentence which parameter matters first."""
    ranked = (f"{effect.label}{NO_BREAK}{number(effect.of_noise, 2)}" for effect in effects)
    if effects:
        yield f"1 % of each moves the response by, in units of the noise: {', '.join(ranked)}"


def _expendable(result: FitResult) -> tuple[str, str]:
    """Return which columns a narrow terminal can do without, the one that says least first."""
    linear = any(parameter.linear_error is not None for parameter in result.parameters.values())
    return ("start", "error") if linear else ("error", "start")


def fitted_table(result: FitResult, before: FitResult | None = None) -> Table:
    """Return the fitted values with their intervals; what belongs to a record comes last."""
    former = () if before is None else ("before",)
    numbers = ("start", *former, "fitted", "95 % interval", "error")
    marks = {name: ", ".join(_marks(each)) for name, each in result.parameters.items()}
    remark = ("",) if any(marks.values()) else ()
    no_interval = result.verdict.in_place_of_interval
    table = plain_table("parameter", *numbers, "unit", *remark, numbers=numbers)
    for name, parameter in result.parameters.items():
        vague = result.knowledge is not None and parameter.why
        style = "yellow" if parameter.at_bound or not parameter.physical or vague else ""
        old = () if before is None else (parameter.rounded(before.values.get(name)),)
        values = (number(parameter.start), *old, parameter.rounded(parameter.value))
        limits = no_interval or interval(parameter.interval, parameter.rounded)
        mark = (marks[name],) if remark else ()
        table.add_row(
            name, *values, limits, _error(result, name), parameter.unit, *mark, style=style
        )
    return table


def _error(result: FitResult, name: str) -> str:
    """Return the standard error of a parameter, a dash where linear theory does not serve."""
    parameter = result.parameters[name]
    if result.knowledge is None or parameter.linear_error is None:
        return "-"
    return error_of(result.knowledge.confidence.parameters[name], parameter.of_record)


def _marks(parameter: FittedParameter) -> Iterator[str]:
    """Yield what must be seen beside a value."""
    if parameter.at_bound:
        yield f"on its {parameter.at_bound}"
    if not parameter.physical:
        yield "not physical"
    if parameter.interval_note:
        yield parameter.interval_note
