"""The terminal, and what all that is shown on it shares."""

import os
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len, set_cell_size
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from exfit.inference import Interval, Uncertainty
from exfit.util.text import rounded

if TYPE_CHECKING:
    from exfit.output.run_figures import PlannedFigures

BETWEEN_COLUMNS = 2  # characters
NARROW = 80  # columns where the width is unknown
UNBROKEN = re.compile(r"`[^`]*`|\d (?:%|pu|s|Hz)(?!\w)")  # commands, and figures with their units
NO_BREAK = "\N{NO-BREAK SPACE}"


def console() -> Console:
    """Return the terminal, or a file or pipe: as wide as COLUMNS says.

    Without COLUMNS the tables of a file are as on a narrow terminal, and no sentence is wrapped.
    """
    terminal = Console(highlight=False)
    if wraps(terminal):
        return terminal
    return Console(highlight=False, width=NARROW, soft_wrap=True)


def wraps(console: Console) -> bool:
    """Return whether sentences are wrapped: a person reads them, or COLUMNS is given."""
    return console.is_terminal or "COLUMNS" in os.environ


def show_table(console: Console, table: Table) -> None:
    """Show a table; one wider than the terminal in parts, each with the first column."""
    for k, part in enumerate(parts_of(table, console.width)):
        if k:
            console.print()
        width = max(console.width, _total(map(_least_width, part.columns)))
        console.print(part, width=width, crop=False, soft_wrap=False)


def parts_of(table: Table, width: int) -> Iterator[Table]:
    """Yield a table, or parts of it that are no wider than so many columns of characters."""
    widths = [_least_width(column) for column in table.columns]
    if _total(widths) <= width:
        yield table
        return
    first, *others = range(len(widths))
    places = [first]
    for k in others:
        if len(places) > 1 and _total(widths[place] for place in (*places, k)) > width:
            yield _with_columns(table, places)
            places = [first]
        places.append(k)
    yield _with_columns(table, places)


def _total(widths: Iterable[int]) -> int:
    """Return the width of a table of columns."""
    return sum(width + BETWEEN_COLUMNS for width in widths) - BETWEEN_COLUMNS


def _least_width(column: Column) -> int:
    """Return the width of a column that cuts nothing; one that may fold has its longest word."""
    cells = [str(cell) for cell in (column.header, *column.cells)]
    if column.overflow == "fold":
        cells = [str(cell) for cell in column.cells]
    pieces = (cell.splitlines() if column.no_wrap else cell.split() for cell in cells)
    return max((cell_len(piece) for each in pieces for piece in each), default=0)


def _with_columns(table: Table, places: Sequence[int]) -> Table:
    """Return a table of some of the columns of another one."""
    part = Table(box=None, pad_edge=False, header_style="bold", show_edge=False)
    for k in places:
        column = table.columns[k]
        part.add_column(
            column.header, justify=column.justify, no_wrap=column.no_wrap, overflow=column.overflow
        )
    cells = [[*table.columns[k].cells] for k in places]
    for row, style in zip(zip(*cells, strict=True), table.rows, strict=True):
        part.add_row(*row, style=style.style)
    return part


def plain_table(*columns: str, numbers: Sequence[str] = ()) -> Table:
    """Return a table without frames; the named columns are numbers, aligned to the right."""
    table = Table(box=None, pad_edge=False, header_style="bold", show_edge=False)
    for column in columns[:-1]:
        table.add_column(column, justify="right" if column in numbers else "left", no_wrap=True)
    # the last column gives way where the terminal is narrow
    table.add_column(columns[-1], justify="right" if columns[-1] in numbers else "left")
    return table


def number(value: float | None, digits: int = 5) -> str:
    """Return a number in a few digits, a dash for None."""
    return "-" if value is None else f"{value:.{digits}g}"


def interval(limits: Interval | None, error: float | None = None) -> str:
    """Return an interval in the digits that an error allows; an open side by the other limit."""
    low, high = limits or (None, None)
    if low is not None and high is not None:
        return f"{rounded(low, error)} ... {rounded(high, error)}"
    if low is None:
        return "-" if high is None else f"below {rounded(high, error)}"
    return f"above {rounded(low, error)}"


def waiting(console: Console, paths: Iterable[Path]) -> None:
    """Say which files are watched."""
    names = ", ".join(path.name for path in paths)
    console.print()
    console.print(f"watching {names}; Ctrl-C ends", markup=False, style="dim")


def again(console: Console, paths: Iterable[Path]) -> None:
    """Draw a line between two runs, with what has changed and when."""
    names = ", ".join(path.name for path in paths)
    console.print()
    console.rule(Text(f"{names} changed, {datetime.now():%H:%M:%S}"))


def written(console: Console, folder: Path) -> None:
    """Say where the files are."""
    console.print(f"written to {folder}", soft_wrap=True, markup=False)


def figure(console: Console, planned: "PlannedFigures", name: str) -> None:
    """Say which of the figures is written now, and what it shows."""
    width = max(map(cell_len, planned))
    line = f"  {set_cell_size(name, width)}  {planned[name].shows}"
    console.print(line, markup=False, soft_wrap=True)


def figures_of_fit(console: Console, name: str) -> None:
    """Say that the figures of a fit of several are written."""
    console.print(f"  {name}/*.png", markup=False, soft_wrap=True)


def error_of(uncertainty: Uncertainty, of_record: bool = False) -> str:
    """Return a standard error as it is shown: in percent, but of a record in its own unit."""
    if uncertainty.relative_error is not None and not of_record:
        return percent(uncertainty.relative_error)
    return "-" if uncertainty.std_error is None else f"{uncertainty.std_error:.1e}"


def notes(console: Console, texts: Iterable[str]) -> None:
    """Show what must be known beside the numbers."""
    remarks(console, "note:", texts)


def unresolved(console: Console, texts: Iterable[str]) -> None:
    """Show what the records do not determine."""
    remarks(console, "unresolved:", texts)


def percent(share: float) -> str:
    """Return a share in percent, two digits of it."""
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"


def remarks(console: Console, kind: str, texts: Iterable[str], style: str = "yellow") -> None:
    """Show sentences one below the other, each behind its kind; no figure leaves its unit."""
    indent = " " * (len(kind) + 1)
    for text in filter(None, texts):
        whole = UNBROKEN.sub(lambda part: part[0].replace(" ", NO_BREAK), text)
        lines = textwrap.fill(
            whole,
            max(console.width, NARROW // 2) if wraps(console) else len(indent) + len(whole) + 1,
            initial_indent=indent,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
        sentence = lines.replace(NO_BREAK, " ").removeprefix(indent)
        console.print(Text.assemble((kind, style), " ", sentence), soft_wrap=True)
