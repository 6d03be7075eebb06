"""Results of fits beside each other, as many at a time as the terminal has room for."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from rich.console import Console

from exfit.results.model import FitResult
from exfit.results.side_by_side import ParameterValue, parameters_beside
from exfit.show.terminal.terminal import number, paragraph, plain_table, show_table
from exfit.util.text import percentage

COST = "f"  # label of its row
BETWEEN_COLUMNS = 2  # characters
ON_BOUND, UNRESOLVED, FIXED = "*", "?", "="  # behind a value
MARKS = {
    ON_BOUND: "on a bound",
    UNRESOLVED: "without a closed 95 % interval",
    FIXED: "fixed",
}


class Row(NamedTuple):
    """A line of a table: its label, its unit, and a cell for each result."""

    label: str
    unit: str
    cells: tuple[str, ...]


HEAD = Row("", "unit", ())
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


def side_by_side(
    console: Console, results: Mapping[str, FitResult], start: bool = False, models: bool = False
) -> None:
    """Show the parameters and figures of results, by their headings.

    The ``start`` that they share is a column of its own; ``models`` are lines above the others.
    """
    fits = [*results.values()]
    parameters = [*_parameters(fits)]
    rows = [*(_rows(MODEL, fits) if models else ()), *parameters, *_figures(fits)]
    headings = [*results]
    if start:
        first = _start(fits[0])
        rows = [row._replace(cells=(first.get(row.label, ""), *row.cells)) for row in rows]
        headings = ["start", *headings]
    tables(console, headings, rows)
    shown = {mark for row in parameters for cell in row.cells for mark in MARKS if mark in cell}
    if shown:
        legend = ", ".join(f"{mark} {words}" for mark, words in MARKS.items() if mark in shown)
        paragraph(console, legend, "dim")


def _start(fit: FitResult) -> dict[str, str]:
    """Return what a fit started from, by the labels of the rows."""
    values = {name: f"{number(parameter.start)} " for name, parameter in fit.parameters.items()}
    return {**values, COST: f"{fit.start_cost:.3e} "}


def tables(console: Console, headings: Sequence[str], rows: Sequence[Row]) -> None:
    """Show rows as tables below each other, each with as many columns as fit."""
    for columns in _packed(headings, rows, console.width):
        names = [headings[k] for k in columns]
        table = plain_table("", "unit", *names, numbers=names)
        for row in rows:
            table.add_row(row.label, row.unit, *(row.cells[k] for k in columns))
        show_table(console, table)
        if columns[-1] != len(headings) - 1:
            console.print()


def _packed(headings: Sequence[str], rows: Sequence[Row], width: int) -> Iterator[range]:
    """Yield the places of as many columns at a time as a terminal has room for, at least one."""
    labels = max(len(row.label) for row in rows) + max(len(row.unit) for row in (*rows, HEAD))
    widths = [
        max(len(heading), *(len(row.cells[k]) for row in rows)) + BETWEEN_COLUMNS
        for k, heading in enumerate(headings)
    ]
    first, taken = 0, labels + BETWEEN_COLUMNS
    for k, column in enumerate(widths):
        if k > first and taken + column > width:
            yield range(first, k)
            first, taken = k, labels + BETWEEN_COLUMNS
        taken += column
    yield range(first, len(widths))


def _rows(figures: Sequence[Figure], fits: Sequence[FitResult]) -> Iterator[Row]:
    """Yield a line for each figure; all cells end with the room that a mark takes."""
    for label, unit, text in figures:
        yield Row(label, unit, tuple(f"{text(fit)} " for fit in fits))


def _parameters(fits: Sequence[FitResult]) -> Iterator[Row]:
    units = {name: parameter.unit for fit in fits for name, parameter in fit.parameters.items()}
    for name, values in parameters_beside(fits).items():
        yield Row(name, units[name], tuple(map(_cell, values)))


def _cell(value: ParameterValue | None) -> str:
    """Return a value with its mark; all are aligned, with room for one behind each."""
    if value is None:
        return ""
    if not value.fitted:
        return value.text + FIXED
    mark = ON_BOUND if value.at_bound else " " if value.resolved else UNRESOLVED
    return value.text + mark


def _figures(fits: Sequence[FitResult]) -> Iterator[Row]:
    yield from _rows(MATCH, fits)
    for name in dict.fromkeys(match.name for fit in fits for match in fit.validation):
        yield Row(f"rmse {name}", "pu", tuple(_validation(fit, name) for fit in fits))
    yield from _rows(EFFORT, fits)


def _validation(fit: FitResult, name: str) -> str:
    matches = [match for match in fit.validation if match.name == name]
    return f"{matches[0].rmse:.3e} " if matches else ""
