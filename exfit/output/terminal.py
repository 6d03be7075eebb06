"""Blocks on a terminal: tables in parts where they are wide, sentences behind their labels."""

import os
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len, set_cell_size
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment, Segments
from rich.table import Table as Grid
from rich.text import Text

from exfit.output.blocks import (
    NO_BREAK,
    Block,
    Facts,
    Heading,
    Mark,
    Note,
    Table,
    TableColumn,
    Verbatim,
)
from exfit.util.text import printable

if TYPE_CHECKING:
    from exfit.output.figure_files import PlannedFigures

NARROW = 80  # columns where the width is unknown
DEEPEST_INDENT = 14  # characters: more would leave a sentence a narrow column
UNIT = r"(?:%|pu|s|Hz)(?!\w)"
UNBROKEN = re.compile(  # commands, ranges, and figures with their units
    rf"`[^`]*`|\d \.\.\. -?[\d.]+(?:e-?\d+)?(?: {UNIT})?|\d {UNIT}"
)
STYLES: dict[Mark, str] = {
    "": "",
    "ok": "bold green",
    "doubt": "yellow",
    "bad": "bold red",
    "strong": "bold",
    "faint": "dim",
}
INDENT = 2  # characters a level
BETWEEN_COLUMNS = 2  # characters
MOST_LINES = 30  # of what is shown in brief: with the command they are read at a glance


class GuardedConsole(Console):
    """A console that texts of files cannot control: names, units and remarks come from others."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        """Render segments with codes in place of control characters that no style added."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))


def console() -> Console:
    """Make the console of the terminal, or of a file or pipe: as wide as COLUMNS says.

    Without COLUMNS the tables of a file are as on a narrow terminal, and no sentence is wrapped.
    """
    sized = {name: text for name, text in os.environ.items() if not _is_no_size(name, text)}
    terminal = GuardedConsole(highlight=False, _environ=sized)
    if wraps(terminal):
        return terminal
    return GuardedConsole(highlight=False, width=NARROW, soft_wrap=True)


def _is_no_size(name: str, text: str) -> bool:
    return name in ("COLUMNS", "LINES") and text.isdigit() and int(text) == 0


def wraps(console: Console) -> bool:
    """Tell whether sentences are wrapped: a person reads them, or COLUMNS is given."""
    columns = os.environ.get("COLUMNS")
    given = columns is not None and not _is_no_size("COLUMNS", columns)
    return console.is_terminal or given


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


def paragraph(console: Console, text: str, style: str = "", indent: int = 0) -> None:
    """Show a text, its further lines indented; no figure leaves its unit."""
    console.print(Text(wrapped(console, text, indent), style), soft_wrap=True)


def wrapped(console: Console, text: str, indent: int) -> str:
    """Break a text in lines that are as wide as the terminal, where sentences are wrapped."""
    lines = text
    if wraps(console):
        lines = textwrap.fill(
            unbroken(text),
            max(console.width, NARROW // 2),
            subsequent_indent=" " * indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
    return lines.replace(NO_BREAK, " ")


def unbroken(text: str) -> str:
    """Keep commands, ranges, and figures with their units in one line."""
    return UNBROKEN.sub(lambda part: part[0].replace(" ", NO_BREAK), text)


def show(console: Console, blocks: Iterable[Block]) -> None:
    """Write blocks one below the other; charts and pictures are left to pages and files."""
    apart, first = False, True
    for block in blocks:
        stands_apart = isinstance(block, Table | Verbatim)
        if not first and (apart or stands_apart or isinstance(block, Heading)):
            console.print()
        apart, first = stands_apart, False
        match block:
            case Heading(text):
                paragraph(console, text, "bold")
            case Facts(pairs, between):
                texts = (f"{name} {value}" if name else value for name, value in pairs)
                line = between.join(text.replace(" ", NO_BREAK) for text in texts)
                paragraph(console, line, indent=INDENT)
            case Table():
                _table(console, block)
            case Note(label=""):
                paragraph(console, block.text, STYLES[block.mark], INDENT * block.indent)
            case Note():
                _labelled(console, block)
            case Verbatim(text):
                console.print(Text(text), soft_wrap=True)


def _labelled(console: Console, note: Note) -> None:
    label = " " * INDENT * note.indent + note.label
    indent = len(label) + 1 if len(label) < DEEPEST_INDENT else INDENT
    line = f"{label.replace(' ', NO_BREAK)} {note.text}"
    sentence = Text(wrapped(console, line, indent))
    sentence.stylize(STYLES[note.mark], 0, len(label))
    console.print(sentence, soft_wrap=True)


def show_shortest(console: Console, versions: Iterable[Sequence[Block]]) -> None:
    """Write the first version of something that has few lines, else the last one."""
    chosen: Sequence[Block] = ()
    for chosen in versions:
        with console.capture() as shown:
            show(console, chosen)
        if shown.get().count("\n") < MOST_LINES:
            break
    show(console, chosen)


def _table(console: Console, table: Table) -> None:
    """Show a table; one wider than the terminal in parts, each with the leading columns.

    It has no frames; the last column gives way where the terminal is narrow.
    """
    if table.title:
        paragraph(console, table.title)
    for k, part in enumerate(parts_of(table, console.width)):
        if k:
            console.print()
        grid = Grid(box=None, pad_edge=False, header_style="bold", show_edge=False)
        for place, column in enumerate(part.columns):
            grid.add_column(
                Text(column.heading),
                justify="right" if column.number else "left",
                no_wrap=not column.folds and place < len(part.columns) - 1,
                overflow="fold" if column.folds else "ellipsis",
            )
        for cells in part.rows:
            grid.add_row(*(Text(cell.text, STYLES[cell.mark]) for cell in cells))
        options = console.options.update(width=max(console.width, _total(part)))
        for line in console.render_lines(grid, options, pad=False):
            # without the blanks that fill the last column
            length, kept = len("".join(segment.text for segment in line).rstrip()), []
            for segment in line:
                kept.append(Segment(segment.text[:length], segment.style))
                length = max(length - len(segment.text), 0)
            console.print(Segments([*kept, Segment.line()]), crop=False, soft_wrap=True)


def parts_of(table: Table, width: int) -> Iterator[Table]:
    """Yield a table, or parts of it that are no wider than so many columns of characters.

    Columns that are expendable are left out, one after the other, where that spares the parts.
    """
    for shorter in _shorter(table):
        if _total(shorter) <= width:
            yield shorter
            return
    leading = [*range(table.leading)]
    groups: list[list[int]] = []  # places of the columns behind the leading ones
    for k in range(table.leading, len(table.columns)):
        name = table.columns[k].group
        if groups and name and name == table.columns[groups[-1][0]].group:
            groups[-1].append(k)
        else:
            groups.append([k])
    places = leading
    for group in groups:
        if len(places) > len(leading) and _total(table, [*places, *group], width) > width:
            yield _with_columns(table, places)
            places = leading
        places = [*places, *group]
    yield _with_columns(table, places)


def _shorter(table: Table) -> Iterator[Table]:
    """Yield a table, then narrower ones: headings in more lines, without expendable columns."""
    yield table
    if not any(column.group for column in table.columns):
        folded = []
        for k, column in enumerate(table.columns):
            widest = max((cell_len(row[k].text) for row in table.rows), default=0)
            if cell_len(column.heading) > widest:
                title = unbroken(column.heading).replace(" ", "\n").replace(NO_BREAK, " ")
                column = TableColumn(title, column.number, folds=column.folds)
            folded.append(column)
        yield replace(table, columns=tuple(folded))
    for last in sorted({column.expendable for column in table.columns} - {0}):
        kept = [k for k, c in enumerate(table.columns) if not 0 < c.expendable <= last]
        yield _with_columns(table, kept)


def _with_columns(table: Table, places: Sequence[int]) -> Table:
    rows = tuple(tuple(row[k] for k in places) for row in table.rows)
    return replace(table, columns=tuple(table.columns[k] for k in places), rows=rows)


def _total(table: Table, places: Sequence[int] | None = None, most: int = 0) -> int:
    """Width of columns that cuts nothing; headings that fold count in full up to ``most``.

    A column that may fold, and the last one, has its longest word.
    """
    total = -BETWEEN_COLUMNS
    for place in range(len(table.columns)) if places is None else places:
        column, is_last = table.columns[place], place == len(table.columns) - 1
        texts, heading = [row[place].text for row in table.rows], column.heading.splitlines()
        if column.folds or is_last:
            pieces = [word for text in texts for word in text.split()]
        else:
            pieces = [line for text in texts for line in text.splitlines()]
        if column.folds:
            heading = [line[:most] for line in heading]
        elif is_last:
            heading = column.heading.split()
        total += max(map(cell_len, (*pieces, *heading)), default=0) + BETWEEN_COLUMNS
    return total
