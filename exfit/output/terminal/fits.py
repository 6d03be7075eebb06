"""What a fit found."""

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table
from rich.text import Text

from exfit.output.terminal.matches import comparisons
from exfit.output.terminal.terminal import error_of, notes, number, plain_table, remarks
from exfit.results.model import FitResult, Minima

MINIMA = 5  # columns of minima that fit beside each other


def fit(console: Console, result: FitResult, before: FitResult | None = None) -> None:
    """Show what a fit found, and how well it is known.

    The values of a fit ``before`` stand beside the new ones.
    """
    console.print()
    console.print(fitted_table(result, before))
    console.print()
    outcome = "converged" if result.success else "NOT CONVERGED"
    style = "green" if result.success else "bold red"
    console.print(Text.assemble((outcome, style), f": {result.message}"))
    match = result.comparison
    several = len(result.comparisons) > 1
    figures = f"cost {result.start_cost:.4e} -> {result.cost:.4e}"
    if not several:
        figures += f"   rmse {match.rmse:.3e} pu   fit {match.fit_percent:.2f} %"
    console.print(figures)
    console.print(
        f"{result.nit} iterations, {result.nfev} residuals, {result.njev} Jacobians, "
        f"{result.simulations} simulations, {result.seconds:.2f} s"
    )
    console.print(f"sub-steps: {result.substeps}")
    if result.minima is not None:
        console.print()
        minima(console, result.minima, result.parameters)
    if result.knowledge is not None:
        console.print()
        remarks(console, "open", result.knowledge.sentences)
    notes(console, result.notes)
    if result.validation or several:
        comparisons(console, [*result.comparisons, *result.validation])


def fitted_table(result: FitResult, before: FitResult | None = None) -> Table:
    """Return the fitted values with their intervals; what belongs to a record stands last."""
    former = () if before is None else ("before",)
    numbers = ("start", *former, "fitted", "95 % interval", "error")
    table = plain_table("parameter", *numbers, "unit", "", numbers=numbers)
    for name, one in result.parameters.items():
        style = "yellow" if one.at_bound else ""
        mark = f"on its {one.at_bound}" if one.at_bound else ""
        interval, error = "-", "-"
        if result.knowledge is not None:
            known = result.knowledge.confidence.parameters[name]
            style = style or ("yellow" if known.why else "")
            if known.interval is not None:
                interval = " ... ".join(number(limit) for limit in known.interval)
            error = error_of(known, one.of_record)
        was = () if before is None else (number(before.values.get(name)),)
        cells = (number(one.start), *was, number(one.value), interval, error, one.unit, mark)
        table.add_row(name, *cells, style=style)
    return table


def minima(console: Console, found: Minima, parameters: Iterable[str]) -> None:
    """Show the distinct minima of a search from many starts, the lowest first."""
    refined = sum(one.starts for one in found.minima)
    console.print(
        f"{len(found.start_costs)} starts, {refined} refined, {found.failed} without a response; "
        f"distinct minima: {len(found.minima)}"
    )
    ranks = [str(rank + 1) for rank in range(min(len(found.minima), MINIMA))]
    table = plain_table("minimum", *ranks, numbers=ranks)
    shown = found.minima[:MINIMA]
    table.add_row("cost", *(f"{one.cost:.3e}" for one in shown))
    table.add_row("starts", *(str(one.starts) for one in shown))
    for name in parameters:
        table.add_row(name, *(number(one.values[name], 4) for one in shown))
    console.print(table)
    if len(found.minima) > MINIMA:
        console.print(f"and {len(found.minima) - MINIMA} more, all in result.json")
