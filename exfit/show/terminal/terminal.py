"""The terminal, and what all that is shown on it shares."""

import os
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len, set_cell_size
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment, Segments
from rich.table import Column, Table
from rich.text import Text

from exfit.inference.confidence import Interval, Uncertainty
from exfit.util.text import printable, rounded

if TYPE_CHECKING:
    from exfit.show.figure_files import PlannedFigures

BETWEEN_COLUMNS = 2  # characters
NARROW = 80  # columns where the width is unknown
DEEPEST_INDENT = 14  # characters: more would leave a sentence a narrow column
UNIT = r"(?:%|pu|s|Hz)(?!\w)"
UNBROKEN = re.compile(  # commands, ranges, and figures with their units
    rf"`[^`]*`|\d \.\.\. -?[\d.]+(?:e-?\d+)?(?: {UNIT})?|\d {UNIT}"
)
NO_BREAK = "\N{NO-BREAK SPACE}"


class GuardedConsole(Console):
    """A console that texts of files cannot control: names, units and remarks come from others."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        """Yield what is shown, with codes in place of control characters that it did not add."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))


def console() -> Console:
    """Return the terminal, or a file or pipe: as wide as COLUMNS says.

    Without COLUMNS the tables of a file are as on a narrow terminal, and no sentence is wrapped.
    """
    sized = {name: text for name, text in os.environ.items() if not _is_no_size(name, text)}
    terminal = GuardedConsole(highlight=False, _environ=sized)
    if wraps(terminal):
        return terminal
    return GuardedConsole(highlight=False, width=NARROW, soft_wrap=True)


def _is_no_size(name: str, text: str) -> bool:
    """Return whether a variable says that the terminal has no columns, or no lines."""
    return name in ("COLUMNS", "LINES") and text.isdigit() and int(text) == 0


def wraps(console: Console) -> bool:
    """Return whether sentences are wrapped: a person reads them, or COLUMNS is given."""
    columns = os.environ.get("COLUMNS")
    given = columns is not None and not _is_no_size("COLUMNS", columns)
    return console.is_terminal or given


def show_table(console: Console, table: Table, expendable: Sequence[str] = ()) -> None:
    """Show a table; one wider than the terminal in parts, each with the first column.

    Columns that are ``expendable`` are left out, one after the other, where that spares the parts.
    """
    for k, part in enumerate(parts_of(table, console.width, expendable)):
        if k:
            console.print()
        options = console.options.update(width=max(console.width, _width(part)))
        for line in console.render_lines(part, options, pad=False):
            cells = [*_without_blanks_behind(line), Segment.line()]
            console.print(Segments(cells), crop=False, soft_wrap=True)


def _without_blanks_behind(line: Sequence[Segment]) -> Iterator[Segment]:
    """Yield a line of a table without the blanks that fill its last column."""
    length = len("".join(segment.text for segment in line).rstrip())
    for segment in line:
        yield Segment(segment.text[:length], segment.style)
        length = max(length - len(segment.text), 0)


def parts_of(table: Table, width: int, expendable: Sequence[str] = ()) -> Iterator[Table]:
    """Yield a table, or parts of it that are no wider than so many columns of characters."""
    for shorter in _shorter(table, expendable):
        if _width(shorter) <= width:
            yield shorter
            return
    widths = [_least_width(column) for column in table.columns]
    first, *others = range(len(widths))
    places = [first]
    for k in others:
        if len(places) > 1 and _total(widths[place] for place in (*places, k)) > width:
            yield _with_columns(table, places)
            places = [first]
        places.append(k)
    yield _with_columns(table, places)


def _shorter(table: Table, expendable: Sequence[str]) -> Iterator[Table]:
    """Yield a table, then narrower ones: without expendable columns, its headings in more lines."""
    yield table
    yield _with_folded_headings(table)
    for count in range(1, len(expendable) + 1):
        left_out = expendable[:count]
        places = [k for k, column in enumerate(table.columns) if column.header not in left_out]
        yield _with_columns(table, places)


def _with_folded_headings(table: Table) -> Table:
    """Return a table whose headings have a word a line where they are wider than their column."""
    folded = _with_columns(table, range(len(table.columns)))
    for column in folded.columns:
        heading = str(column.header)
        if cell_len(heading) > max((cell_len(str(cell)) for cell in column.cells), default=0):
            words = UNBROKEN.sub(lambda part: part[0].replace(" ", NO_BREAK), heading).split(" ")
            column.header = "\n".join(words).replace(NO_BREAK, " ")
    return folded


def _width(table: Table) -> int:
    """Return the least width of a table in which nothing is cut."""
    return _total(map(_least_width, table.columns))


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


def interval(limits: Interval | None, digits: Callable[[float], str] = rounded) -> str:
    """Return an interval, its limits in some ``digits``; an open side by the other limit."""
    low, high = limits or (None, None)
    if low is not None and high is not None:
        return f"{digits(low)} ... {digits(high)}"
    if low is None:
        return "-" if high is None else f"below {digits(high)}"
    return f"above {digits(low)}"


def waiting(console: Console, paths: Iterable[Path]) -> None:
    """Say which files are watched."""
    names = ", ".join(path.name for path in paths)
    console.print()
    paragraph(console, f"watching {names}; Ctrl-C ends", "dim")


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
    paragraph(console, line, indent=width + 4)


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
    indent = len(kind) + 1 if len(kind) < DEEPEST_INDENT else 2
    for text in filter(None, texts):
        lines = wrapped(console, f"{kind.replace(' ', NO_BREAK)} {text}", indent)
        sentence = Text(lines)
        sentence.stylize(style, 0, len(kind))
        console.print(sentence, soft_wrap=True)


def paragraph(console: Console, text: str, style: str = "", indent: int = 0) -> None:
    """Show a text, its further lines indented; no figure leaves its unit."""
    console.print(Text(wrapped(console, text, indent), style), soft_wrap=True)


def in_groups(groups: Iterable[str], between: str = "   ") -> str:
    """Return groups of words as a text that is wrapped between the groups alone."""
    return between.join(group.replace(" ", NO_BREAK) for group in groups)


def wrapped(console: Console, text: str, indent: int) -> str:
    """Return a text in lines that are as wide as the terminal, where sentences are wrapped."""
    lines = text
    if wraps(console):
        lines = textwrap.fill(
            UNBROKEN.sub(lambda part: part[0].replace(" ", NO_BREAK), text),
            max(console.width, NARROW // 2),
            subsequent_indent=" " * indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
    return lines.replace(NO_BREAK, " ")
