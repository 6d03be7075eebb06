"""Blocks on a terminal: tables in parts where they are wide, sentences behind their labels."""

from collections.abc import Iterable, Iterator, Sequence

from rich.cells import cell_len
from rich.console import Console
from rich.segment import Segment, Segments
from rich.table import Table as Grid
from rich.text import Text

from exfit.show.blocks import (
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
from exfit.show.terminal.terminal import (
    UNBROKEN,
    in_groups,
    paragraph,
    remarks,
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
            case Facts():
                texts = (f"{name} {value}" if name else value for name, value in block.pairs)
                paragraph(console, in_groups(texts, block.between), indent=INDENT)
            case Table():
                _table(console, block)
            case Note(label=""):
                paragraph(console, block.text, STYLES[block.mark], INDENT * block.indent)
            case Note():
                label = " " * INDENT * block.indent + block.label
                remarks(console, label, [block.text], STYLES[block.mark])
            case Verbatim(text):
                console.print(Text(text), soft_wrap=True)


def show_shortest(console: Console, versions: Iterable[Sequence[Block]]) -> None:
    """Write the first version of something that has few lines, else the last one."""
    chosen: Sequence[Block] = ()
    for chosen in versions:
        with console.capture() as written:
            show(console, chosen)
        if written.get().count("\n") < MOST_LINES:
            break
    show(console, chosen)


def _table(console: Console, table: Table) -> None:
    """Show a table; one wider than the terminal in parts, each with the leading columns."""
    if table.title:
        paragraph(console, table.title)
    for k, part in enumerate(parts_of(table, console.width)):
        if k:
            console.print()
        least = _total(part, range(len(part.columns)))
        options = console.options.update(width=max(console.width, least))
        for line in console.render_lines(_grid(part), options, pad=False):
            cells = [*_without_blanks_behind(line), Segment.line()]
            console.print(Segments(cells), crop=False, soft_wrap=True)


def parts_of(table: Table, width: int) -> Iterator[Table]:
    """Yield a table, or parts of it that are no wider than so many columns of characters.

    Columns that are expendable are left out, one after the other, where that spares the parts.
    """
    every = range(len(table.columns))
    for shorter in _shorter(table):
        if _total(shorter, range(len(shorter.columns))) <= width:
            yield shorter
            return
    leading = [*every[: table.leading]]
    places = leading
    for group in _groups(table):
        if len(places) > len(leading) and _total(table, [*places, *group], width) > width:
            yield _with_columns(table, places)
            places = leading
        places = [*places, *group]
    yield _with_columns(table, places)


def _groups(table: Table) -> Iterator[list[int]]:
    """Yield the places of the columns behind the leading ones, those of a group together."""
    group: list[int] = []
    for k in range(table.leading, len(table.columns)):
        name = table.columns[k].group
        if group and not (name and name == table.columns[group[0]].group):
            yield group
            group = []
        group.append(k)
    if group:
        yield group


def _shorter(table: Table) -> Iterator[Table]:
    """Yield a table, then narrower ones: headings in more lines, without expendable columns."""
    yield table
    folded = [
        TableColumn(_a_word_a_line(column.heading), column.number, folds=column.folds)
        if cell_len(column.heading) > max((cell_len(row[k].text) for row in table.rows), default=0)
        else column
        for k, column in enumerate(table.columns)
        if not column.group
    ]
    if len(folded) == len(table.columns):
        yield Table(tuple(folded), table.rows, table.title, table.leading)
    for last in sorted({column.expendable for column in table.columns} - {0}):
        kept = [k for k, c in enumerate(table.columns) if not 0 < c.expendable <= last]
        yield _with_columns(table, kept)


def _a_word_a_line(heading: str) -> str:
    words = UNBROKEN.sub(lambda part: part[0].replace(" ", NO_BREAK), heading).split(" ")
    return "\n".join(words).replace(NO_BREAK, " ")


def _with_columns(table: Table, places: Sequence[int]) -> Table:
    rows = tuple(tuple(row[k] for k in places) for row in table.rows)
    return Table(tuple(table.columns[k] for k in places), rows, table.title, table.leading)


def _total(table: Table, places: Iterable[int], most: int = 0) -> int:
    """Width of columns beside each other; headings that fold count in full up to ``most``."""
    widths = [_least_width(table, k, most) for k in places]
    return sum(width + BETWEEN_COLUMNS for width in widths) - BETWEEN_COLUMNS


def _least_width(table: Table, place: int, most: int) -> int:
    """Width of a column that cuts nothing; one that may fold has its longest word."""
    column = table.columns[place]
    texts = [row[place].text for row in table.rows]
    whole = not column.folds and place < len(table.columns) - 1
    pieces = [piece for text in texts for piece in (text.splitlines() if whole else text.split())]
    heading = column.heading.splitlines() if whole or column.folds else column.heading.split()
    if column.folds:
        return max(cell_len(piece) for piece in (*pieces, *(line[:most] for line in heading)))
    return max((cell_len(piece) for piece in (*pieces, *heading)), default=0)


def _grid(table: Table) -> Grid:
    """Make the table of rich: without frames, the last column gives way where it is narrow."""
    grid = Grid(box=None, pad_edge=False, header_style="bold", show_edge=False)
    for k, column in enumerate(table.columns):
        grid.add_column(
            Text(column.heading),
            justify="right" if column.number else "left",
            no_wrap=not column.folds and k < len(table.columns) - 1,
            overflow="fold" if column.folds else "ellipsis",
        )
    for row in table.rows:
        grid.add_row(*(Text(cell.text, STYLES[cell.mark]) for cell in row))
    return grid


def _without_blanks_behind(line: Sequence[Segment]) -> Iterator[Segment]:
    """Yield a line of a table without the blanks that fill its last column."""
    length = len("".join(segment.text for segment in line).rstrip())
    for segment in line:
        yield Segment(segment.text[:length], segment.style)
        length = max(length - len(segment.text), 0)
