"""Blocks as HTML: tables that scroll by themselves, sentences, lists; charts as they are drawn."""

from collections.abc import Callable, Iterable, Iterator
from html import escape
from itertools import groupby

from exfit.show.blocks import Block, Cell, Chart, Facts, Heading, Note, Table, TableColumn, Verbatim

CLASSES = {"ok": "good", "bad": "bad", "doubt": "why", "faint": "missing"}  # of the style sheet
LONG_WORD = 16  # letters: a longer one may be broken
MANY = 8  # columns that are set smaller on paper
FEW = 6  # rows that stay on one page


def html(blocks: Iterable[Block], draw: Callable[[Chart], str] = lambda _: "") -> str:
    """Write blocks as HTML; ``draw`` writes a chart.

    What stands between backquotes is code. Warnings and remedies that follow each other are a list.
    Of a cell the lines below the first one are small.
    """
    return "\n".join(_pieces(blocks, draw))


def _pieces(blocks: Iterable[Block], draw: Callable[[Chart], str]) -> Iterator[str]:
    for is_list, group in groupby(
        blocks, lambda block: isinstance(block, Note) and block.kind in ("warning", "remedy")
    ):
        if is_list:
            notes = (block for block in group if isinstance(block, Note))
            yield "\n".join(["<ul>", *(f"<li>{_sentence(note)}</li>" for note in notes), "</ul>"])
        else:
            yield from filter(None, (_piece(block, draw) for block in group))


def _piece(block: Block, draw: Callable[[Chart], str]) -> str:
    match block:
        case Heading(text, level):
            return f"<h{level + 1}>{escape(text)}</h{level + 1}>"
        case Facts(pairs):
            rows = (f"<div><dt>{escape(n)}</dt><dd>{escape(t)}</dd></div>" for n, t in pairs)
            return "\n".join(['<dl class="about">', *rows, "</dl>"])
        case Note():
            style = ' class="missing"' if block.mark == "faint" else ""
            return f"<p{style}>{_sentence(block)}</p>"
        case Table():
            return _wide(block.title or "Table", _table(block))
        case Verbatim(text):
            return _wide("Text", f"<pre>{escape(text)}</pre>")
        case Chart():
            return draw(block)
    return ""


def _sentence(note: Note) -> str:
    if not note.label:
        return _text(note.text)
    return f"{_marked(Cell(note.label, note.mark))} {_text(note.text)}"


def _text(text: str) -> str:
    """Escape a text, in which what is between backquotes is to be typed."""
    pieces = (escape(piece) for piece in text.split("`"))
    return "".join(f"<code>{each}</code>" if k % 2 else each for k, each in enumerate(pieces))


def _wide(label: str, content: str) -> str:
    head = f'<div class="wide" role="region" aria-label="{escape(label)}" tabindex="0">'
    return f"{head}\n{content}\n</div>"


def _table(table: Table) -> str:
    many = "many" if len(table.columns) >= MANY else ""
    few = "few" if len(table.rows) <= FEW else ""
    heads = (
        f'<th scope="col"{_class("n" if column.number else "")}>{_heading(column)}</th>'
        if column.heading
        else "<td></td>"
        for column in table.columns
    )
    title = table.title[:1].upper() + table.title[1:]
    lines = [
        f"<table{_class(many, few)}>",
        *([f"<caption>{_text(title)}</caption>"] if title else []),
        f"<thead><tr>{''.join(heads)}</tr></thead>",
        "<tbody>",
        *(_row(table, cells) for cells in table.rows),
        "</tbody>\n</table>",
    ]
    return "\n".join(lines)


def _heading(column: TableColumn) -> str:
    return escape(column.heading.replace("\n", " "))


def _row(table: Table, cells: tuple[Cell, ...]) -> str:
    """Write a row; one that begins with a doubt is shaded."""
    whole = all(cell.mark == "doubt" for cell in cells)
    shown = []
    for k, (column, cell) in enumerate(zip(table.columns, cells, strict=True)):
        if k < table.leading:
            style = _class("n" if column.number else "")
            shown.append(f'<th scope="row"{style}>{_lines(cell.text)}</th>')
            continue
        doubt = cell.mark == "doubt" and not whole
        long = any(len(word) > LONG_WORD for word in cell.text.split())
        number = "why" if doubt else "n" if column.number else ""
        text = "text" if column.folds else ""
        style = _class(number, text, "break" if column.folds and long else "")
        shown.append(f"<td{style}>{_marked(cell)}</td>")
    return f"<tr{_class('vague' if cells[0].mark == 'doubt' else '')}>{''.join(shown)}</tr>"


def _marked(cell: Cell) -> str:
    if cell.mark == "strong":
        return f"<strong>{_lines(cell.text)}</strong>"
    if cell.mark in ("ok", "bad"):
        first, *rest = cell.text.split(": ", 1)
        return f'<strong class="{CLASSES[cell.mark]}">{_text(first)}</strong>' + "".join(
            f": {_text(each)}" for each in rest
        )
    return _lines(cell.text)


def _lines(text: str) -> str:
    first, *others = text.split("\n")
    return " ".join([_text(first), *(f"<small>{_text(line)}</small>" for line in others)])


def _class(*names: str) -> str:
    known = " ".join(filter(None, names))
    return f' class="{known}"' if known else ""
