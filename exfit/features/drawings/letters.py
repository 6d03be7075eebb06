"""Read a block diagram that is drawn with letters: its blocks, its lines, its signs.

Boxes stand in brackets, over two rows where the second row has a bracket below the first one's:
``[1 + sTC]`` above ``[1 + sTB]``. ``(+)`` is a sum and ``(x)`` a product; a minus beside an arrow
into a sum subtracts. Lines and arrows are drawn with the characters of SIDES; all else is text.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

Kind = Literal["box", "sum", "product", "text"]
Place = tuple[int, int]  # a row and a column

# each character of a line: the sides to which it goes on, the side to which its arrow points
SIDES: Mapping[str, tuple[str, str]] = {
    "─": ("LR", ""), "│": ("UD", ""), "┌": ("RD", ""), "┐": ("LD", ""), "└": ("RU", ""),
    "┘": ("LU", ""), "├": ("URD", ""), "┤": ("ULD", ""), "┬": ("LRD", ""), "┴": ("LRU", ""),
    "┼": ("LRUD", ""), "►": ("L", "R"), "◄": ("R", "L"), "▲": ("D", "U"), "▼": ("U", "D"),
}  # fmt: skip
PARTED = 3  # sides of a character where a line parts; with four two lines cross
CIRCLES: Mapping[str, Kind] = {"(+)": "sum", "(x)": "product"}
BOX = re.compile(r"\[[^\[\]]*\]")
CIRCLE = re.compile(r"\([+x]\)")
STROKE = re.compile(f"[{''.join(SIDES)}]")
TEXT = re.compile(rf"[^ {''.join(SIDES)}]+(?: [^ {''.join(SIDES)}]+)*")
BESIDE = 1  # columns beside a circle from which an arrow from below still meets it


@dataclass(frozen=True)
class Element:
    """A box, a circle or a text: its rows of letters, and where they stand."""

    kind: Kind
    rows: tuple[str, ...]
    top: int
    left: int

    @property
    def bottom(self) -> int:
        """The last row."""
        return self.top + len(self.rows) - 1

    @property
    def right(self) -> int:
        """The column behind the last one."""
        return self.left + max(map(len, self.rows))

    def covers(self, row: int, column: int) -> bool:
        """Tell whether the character at a place is one of its."""
        inside = self.top <= row <= self.bottom
        return inside and 0 <= column - self.left < len(self.rows[row - self.top])


@dataclass(frozen=True)
class End:
    """The end of a line: its column or row, what it touches there, whether with an arrow.

    A ``loose`` one goes on to nothing: letters that are out of line.
    """

    at: int
    element: Element | None
    arrow: bool
    loose: bool


@dataclass(frozen=True)
class Wire:
    """A straight line along a row, or an ``upright`` one along a column."""

    upright: bool
    along: int
    ends: tuple[End, End]


@dataclass(frozen=True)
class Letters:
    """A diagram as it is drawn.

    ``dots`` are where a line parts; ``minus`` has the arrows that subtract, and on which side of
    the arrow the sign stands, -1 or 1.
    """

    elements: tuple[Element, ...]
    lines: tuple[Wire, ...]
    dots: tuple[Place, ...]
    minus: Mapping[Place, int]
    rows: int
    columns: int
    empty_rows: tuple[int, ...]


def diagram_and_remarks(drawing: str) -> tuple[str, list[str]]:
    """Return the block diagram of a model's text, and the paragraphs behind it, each a line."""
    paragraphs = drawing.split("\n\n")
    last = max((k for k, text in enumerate(paragraphs) if set(text) & {*SIDES}), default=-1)
    remarks = (" ".join(text.split()) for text in paragraphs[last + 1 :])
    return "\n\n".join(paragraphs[: last + 1]), [text for text in remarks if text]


def read(diagram: str) -> Letters:
    """Read the elements and lines of a diagram."""
    drawn = diagram.split("\n")
    columns = max(map(len, drawn))
    rows = [row.ljust(columns) for row in drawn]
    boxes = list(_boxes(rows))
    rows = _without(rows, boxes)
    circles = [Element(CIRCLES[text], (text,), k, at) for k, at, text in _matches(CIRCLE, rows)]
    rows = _without(rows, circles)
    minus = dict(_minus(rows))
    signs = [Element("text", ("-",), k, at + side) for (k, at), side in minus.items()]
    rows = _without(rows, signs)
    texts = [Element("text", (text,), k, at) for k, at, text in _matches(TEXT, rows)]
    elements = (*boxes, *circles, *texts)
    cells = {(k, at): SIDES[letter] for k, at, letter in _matches(STROKE, rows)}
    return Letters(
        elements,
        (*_lines(cells, elements, upright=False), *_lines(cells, elements, upright=True)),
        tuple(place for place, (sides, _) in cells.items() if len(sides) == PARTED),
        minus,
        len(rows),
        columns,
        tuple(k for k, row in enumerate(drawn) if not row.strip()),
    )


def _matches(pattern: re.Pattern[str], rows: Sequence[str]) -> Iterator[tuple[int, int, str]]:
    """Yield the matches of a pattern: row, first column, letters."""
    for k, row in enumerate(rows):
        for match in pattern.finditer(row):
            yield k, match.start(), match[0]


def _boxes(rows: Sequence[str]) -> Iterator[Element]:
    """Yield the boxes; a bracket that begins below another is its second row."""
    taken: set[int] = set()  # where second rows begin
    for k, (row, below) in enumerate(zip(rows, [*rows[1:], ""], strict=True)):
        seconds = {match.start(): match[0] for match in BOX.finditer(below)}
        firsts = [match for match in BOX.finditer(row) if match.start() not in taken]
        taken = {match.start() for match in firsts} & {*seconds}
        for match in firsts:
            second = [seconds[match.start()]] if match.start() in seconds else []
            yield Element("box", (match[0], *second), k, match.start())


def _minus(rows: Sequence[str]) -> Iterator[tuple[Place, int]]:
    """Yield each arrow that subtracts, and on which side of it the minus stands."""
    for k, row in enumerate(rows):
        for match in re.finditer("-[▲▼]", row):
            yield (k, match.start() + 1), -1
        for match in re.finditer("(?<!-)[▲▼]-", row):
            yield (k, match.start()), 1


def _without(rows: Sequence[str], elements: Iterable[Element]) -> list[str]:
    letters = [list(row) for row in rows]
    for element in elements:
        for k, row in enumerate(element.rows, element.top):
            letters[k][element.left : element.left + len(row)] = " " * len(row)
    return ["".join(row) for row in letters]


def _lines(
    cells: Mapping[Place, tuple[str, str]], elements: Sequence[Element], upright: bool
) -> Iterator[Wire]:
    """Yield the lines along rows, or the upright ones along columns."""
    back, onward = "UD" if upright else "LR"
    own = [
        (place[::-1] if upright else place, *sides)
        for place, sides in cells.items()
        if set(sides[0] + sides[1]) & {back, onward}
    ]
    for along, group in groupby(sorted(own), key=lambda cell: cell[0][0]):
        stretch: list[tuple[int, str, str]] = []
        for (_, at), sides, arrow in group:
            if stretch and not (
                at == stretch[-1][0] + 1 and onward in stretch[-1][1] and back in sides
            ):
                yield _line(along, stretch, elements, upright)
                stretch = []
            stretch.append((at, sides, arrow))
        yield _line(along, stretch, elements, upright)


def _line(
    along: int, stretch: Sequence[tuple[int, str, str]], elements: Sequence[Element], upright: bool
) -> Wire:
    """Return the line of joined characters (place, sides, arrow) along a row or column."""
    ends = []
    for (at, sides, arrow), side, step in zip(
        (stretch[0], stretch[-1]), "UD" if upright else "LR", (-1, 1), strict=True
    ):
        open_end = side in sides or arrow == side
        touched = _touched(along, at, step, elements, upright) if open_end else None
        ends.append(End(at, touched, arrow == side, open_end and touched is None))
    return Wire(upright, along, (ends[0], ends[1]))


def _touched(
    along: int, at: int, step: int, elements: Sequence[Element], upright: bool
) -> Element | None:
    """Find what ends a line: a text may stand a space off, a circle a column beside."""
    places = (
        [(at + step, along + beside) for beside in (0, -BESIDE, BESIDE)]
        if upright
        else [(along, at + step), (along, at + 2 * step)]
    )
    for place in places:
        for element in elements:
            if element.covers(*place) and (
                place == places[0] or element.kind in (("sum", "product") if upright else ("text",))
            ):
                return element
    return None
