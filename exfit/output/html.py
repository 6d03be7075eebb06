"""Blocks as HTML: tables that scroll by themselves, sentences, lists; charts as they are drawn."""

from collections.abc import Callable, Iterable, Iterator
from html import escape
from itertools import groupby

from exfit.output.blocks import (
    Block,
    Cell,
    Chart,
    Diagram,
    Facts,
    Heading,
    Note,
    Table,
    TableColumn,
    Verbatim,
)

CLASSES = {"ok": "good", "bad": "bad", "doubt": "why", "faint": "missing"}  # of the style sheet
LONG_WORD = 16  # letters: a longer one may be broken
MANY = 8  # columns that are set smaller on paper
FEW = 6  # rows that stay on one page
LONG = 12  # rows of a folded table that a reader sees without asking for more


def html(blocks: Iterable[Block], draw: Callable[[Chart], str] = lambda _: "") -> str:
    """Write blocks as HTML; ``draw`` writes a chart.

    What stands between backquotes is code. Warnings and remedies that follow each other are a list.
    Of a cell the lines below the first one are small. What another section has is an empty link to
    that section, for the page to number.
    """

    def kind(block: Block) -> str:
        if isinstance(block, Chart):
            return block.group
        return "list" if isinstance(block, Note) and block.kind in ("warning", "remedy") else ""

    pieces: list[str] = []
    for group, members in groupby(blocks, kind):
        if group == "list":
            notes = (block for block in members if isinstance(block, Note))
            pieces += ["<ul>", *(f"<li>{_note(note)}</li>" for note in notes), "</ul>"]
        elif group:
            pieces += ["<figure>", '<div class="grid">', *(_piece(each, draw) for each in members)]
            pieces += ["</div>", f"<figcaption><strong>{escape(group)}</strong></figcaption>"]
            pieces.append("</figure>")
        else:
            pieces += filter(None, (_piece(block, draw) for block in members))
    return "\n".join(pieces)


def _piece(block: Block, draw: Callable[[Chart], str]) -> str:
    match block:
        case Heading(text, level):
            return f"<h{level + 1}>{escape(text)}</h{level + 1}>"
        case Facts(pairs):
            rows = (f"<div><dt>{escape(n)}</dt><dd>{escape(t)}</dd></div>" for n, t in pairs)
            return "\n".join(['<dl class="about">', *rows, "</dl>"])
        case Note():
            style = ' class="missing"' if block.mark == "faint" else ""
            return f"<p{style}>{_note(block)}</p>"
        case Table(summary=""):
            return _wide(block.title or "Table", _table(block))
        case Table():
            length = "long" if len(block.rows) > LONG else "short"
            head = f'<details open class="{length}">\n<summary>{escape(block.summary)}</summary>'
            legend = f"<p>{sentence(block.legend)}</p>\n" if block.legend else ""
            return f"{head}\n{_wide(block.title, _table(block))}\n{legend}</details>"
        case Verbatim(text, title):
            return _wide(title, f"<pre>{escape(text)}</pre>")
        case Diagram(title, svg):
            caption = f"<figcaption><strong>{escape(title)}</strong></figcaption>"
            return f'<figure class="block-diagram">\n{_wide(title, svg)}\n{caption}\n</figure>'
        case Chart():
            return draw(block)


def _note(note: Note) -> str:
    see = f", see section {_link(note.see)}." if note.see else ""
    if not note.label:
        return sentence(note.text) + see
    return f"{_marked(Cell(note.label, note.mark))} {sentence(note.text)}{see}"


def _link(section: str) -> str:
    return f'<a href="#{section}"></a>'


def sentence(text: str) -> str:
    """Escape a text, in which what is between backquotes is code, to be typed."""
    pieces = (escape(piece) for piece in text.split("`"))
    return "".join(f"<code>{each}</code>" if k % 2 else each for k, each in enumerate(pieces))


def _wide(label: str, content: str) -> str:
    head = f'<div class="wide" role="region" aria-label="{escape(label)}" tabindex="0">'
    return f"{head}\n{content}\n</div>"


def _table(table: Table) -> str:
    many = "many" if len(table.columns) >= MANY else ""
    few = "few" if len(table.rows) <= FEW else ""
    heads = (
        f'<th scope="col"{_class(*_of_column(column))}>'
        f"{escape(column.heading.replace(chr(10), ' '))}</th>"
        if column.heading
        else "<td></td>"
        for column in table.columns
    )
    title = table.title[:1].upper() + table.title[1:]
    lines = [
        f"<table{_class(table.style, many, few)}>",
        *([f"<caption>{sentence(title)}</caption>"] if title else []),
        f"<thead><tr>{''.join(heads)}</tr></thead>",
        "<tbody>",
        *(_row(table, cells) for cells in table.rows),
        "</tbody>\n</table>",
    ]
    return "\n".join(lines)


def _of_column(column: TableColumn) -> Iterator[str]:
    """Yield the classes of a column; one that is expendable is not printed."""
    yield "n" if column.number else ""
    yield "aside" if column.expendable else ""


def _of_cell(column: TableColumn, cell: Cell) -> Iterator[str]:
    if column.folds:
        yield "text"
        yield "break" if any(len(word) > LONG_WORD for word in cell.text.split()) else ""
    if cell.mark == "faint":
        yield CLASSES[cell.mark]
    if cell.shade is not None:
        yield f"{'plus' if cell.shade >= 0 else 'minus'}{abs(cell.shade)}"


def _row(table: Table, cells: tuple[Cell, ...]) -> str:
    """Write a row; one that begins with a doubt is shaded."""
    whole = all(cell.mark == "doubt" for cell in cells)
    shown = []
    for k, (column, cell) in enumerate(zip(table.columns, cells, strict=True)):
        if k < table.leading and cell.text:
            style = _class(*_of_column(column))
            shown.append(f'<th scope="row"{style}>{_lines(cell.text)}</th>')
            continue
        styles = [*_of_column(column), *_of_cell(column, cell)]
        if cell.mark == "doubt" and not whole:
            styles[0] = "why"
        see = _link(cell.see) if cell.see else ""
        shown.append(f"<td{_class(*styles)}>{_marked(cell)}{see}</td>")
    return f"<tr{_class('vague' if cells[0].mark == 'doubt' else '')}>{''.join(shown)}</tr>"


def _marked(cell: Cell) -> str:
    if cell.mark == "strong":
        return f"<strong>{_lines(cell.text)}</strong>"
    if cell.mark in ("ok", "bad"):
        first, *rest = cell.text.split(": ", 1)
        return f'<strong class="{CLASSES[cell.mark]}">{sentence(first)}</strong>' + "".join(
            f": {sentence(each)}" for each in rest
        )
    return _lines(cell.text)


def _lines(text: str) -> str:
    first, *others = text.split("\n")
    return " ".join([sentence(first), *(f"<small>{sentence(line)}</small>" for line in others)])


def _class(*names: str) -> str:
    known = " ".join(filter(None, names))
    return f' class="{known}"' if known else ""
