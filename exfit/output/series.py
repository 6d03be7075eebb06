"""Results of fits beside each other, and of a series of fits, as blocks."""

from collections.abc import Callable, Iterator, Mapping, Sequence

from exfit.output.blocks import (
    Block,
    Heading,
    Note,
    Table,
    TableColumn,
    columns,
    number,
    paragraph,
    remarks,
    row,
)
from exfit.results.model import FitResult
from exfit.results.side_by_side import (
    ParameterValue,
    explanation_of,
    outcome_of,
    parameters_beside,
)
from exfit.runs.fits import FitSeries
from exfit.util.text import percentage

COST = "f"  # label of its row
ON_BOUND, UNRESOLVED, FIXED = "*", "?", "="  # behind a value
MARKS = {
    ON_BOUND: "on a bound",
    UNRESOLVED: "without a closed 95 % interval",
    FIXED: "fixed",
}
Row = tuple[str, str, tuple[str, ...]]  # label, unit, and a cell for each result
Figure = tuple[str, str, Callable[[FitResult], str]]  # label, unit, and what a result has there
MODEL: tuple[Figure, ...] = (
    ("model", "", lambda fit: fit.model),
    ("strategy", "", lambda fit: fit.strategy),
    ("f at the start", "pu²", lambda fit: f"{fit.start_cost:.3e}"),
)
MATCH: tuple[Figure, ...] = (
    (COST, "pu²", lambda fit: f"{fit.cost:.3e}"),
    ("rmse", "pu", lambda fit: f"{fit.rmse:.3e}"),
    ("fit", "%", lambda fit: percentage(fit.comparison.fit_percent)),
)
EFFORT: tuple[Figure, ...] = (
    ("iterations", "", lambda fit: f"{fit.nit}"),
    ("residuals", "", lambda fit: f"{fit.nfev}"),
    ("Jacobians", "", lambda fit: f"{fit.njev}"),
    ("simulations", "", lambda fit: f"{fit.simulations}"),
    ("time", "s", lambda fit: f"{fit.seconds:.2f}"),
)


def fit_series(series: FitSeries) -> Iterator[Block]:
    """Yield the results of a series: a table for each case, or one where each was fitted once.

    How each fit ended stands below its table, and last what was not run.
    """
    by_case = series.by_case
    if series.runs and all(len(runs) == 1 for runs in by_case.values()):
        results = {name: runs[0].result for name, runs in by_case.items()}
        yield from side_by_side(results, models=True)
        yield from _outcomes(results)
    else:
        for name, runs in by_case.items():
            results = {run.result.strategy: run.result for run in runs}
            first = runs[0].result
            yield Heading(f"{name}: {first.model} fitted to {first.comparison.record}")
            yield from side_by_side(results, start=True)
            yield from _outcomes(results)
    for name in series.failed:
        yield Note("failed", "verdict", f"{name}:", "bad")
    if series.not_run:
        yield paragraph(f"not run (interrupted): {', '.join(series.not_run)}", "bad")


def _outcomes(results: Mapping[str, FitResult]) -> Iterator[Note]:
    for name, result in results.items():
        label = f"{name}: {outcome_of(result)}:"
        yield from remarks(label, [explanation_of(result)], "ok" if result.holds else "bad")


def side_by_side(
    results: Mapping[str, FitResult], start: bool = False, models: bool = False
) -> Iterator[Block]:
    """Yield the parameters and figures of results, by their headings.

    The ``start`` that they share is a column of its own; ``models`` are lines above the others.
    """
    fits = [*results.values()]
    units = {name: parameter.unit for fit in fits for name, parameter in fit.parameters.items()}
    parameters: list[Row] = [
        (name, units[name], tuple(map(_cell, values)))
        for name, values in parameters_beside(fits).items()
    ]
    rows = [*(_rows(MODEL, fits) if models else ()), *parameters, *_figures(fits)]
    headings = [*results]
    if start:
        values = {name: f"{number(each.start)} " for name, each in fits[0].parameters.items()}
        first = {**values, COST: f"{fits[0].start_cost:.3e} "}
        rows = [(label, unit, (first.get(label, ""), *cells)) for label, unit, cells in rows]
        headings = ["start", *headings]
    yield rows_table(headings, rows)
    shown = {mark for _, _, cells in parameters for cell in cells for mark in MARKS if mark in cell}
    if shown:
        legend = ", ".join(f"{mark} {words}" for mark, words in MARKS.items() if mark in shown)
        yield paragraph(legend, "faint")


def rows_table(headings: Sequence[str], rows: Sequence[Row], title: str = "") -> Table:
    """Make a table of rows behind their labels and units."""
    beside = (TableColumn(heading, number=True) for heading in headings)
    cells = tuple(row(label, unit, *cells) for label, unit, cells in rows)
    return Table((*columns("", "unit"), *beside), cells, title, leading=2)


def _rows(figures: Sequence[Figure], fits: Sequence[FitResult]) -> Iterator[Row]:
    """Yield a line for each figure; all cells end with the room that a mark takes."""
    for label, unit, text in figures:
        yield label, unit, tuple(f"{text(fit)} " for fit in fits)


def _cell(value: ParameterValue | None) -> str:
    """Write a value with its mark; all are aligned, with room for one behind each."""
    if value is None:
        return ""
    if not value.fitted:
        return value.text + FIXED
    mark = ON_BOUND if value.at_bound else " " if value.resolved else UNRESOLVED
    return value.text + mark


def _figures(fits: Sequence[FitResult]) -> Iterator[Row]:
    yield from _rows(MATCH, fits)
    for name in dict.fromkeys(match.name for fit in fits for match in fit.validation):
        errors = ({match.name: match.rmse for match in fit.validation}.get(name) for fit in fits)
        cells = ("" if error is None else f"{error:.3e} " for error in errors)
        yield f"rmse {name}", "pu", tuple(cells)
    yield from _rows(EFFORT, fits)
