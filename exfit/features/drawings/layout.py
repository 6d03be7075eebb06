"""A block diagram with places, in px: frames, lines, texts."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import sqrt

from exfit.features.drawings import formulas
from exfit.features.drawings.across import Across, across
from exfit.features.drawings.down import SIGN, middle_of, rows_of
from exfit.features.drawings.formulas import Typeset
from exfit.features.drawings.letters import Element, End, Letters, Wire
from exfit.features.drawings.parts import RADIUS, DiagramPart, parts_of

MARGIN = 6.0  # around the diagram
STACKED = 10.0  # from the bar of a fraction to the middle of its parts

Point = tuple[float, float]


@dataclass(frozen=True)
class PlacedPart:
    """A part and its middle."""

    part: DiagramPart
    x: float
    y: float


@dataclass(frozen=True)
class Stroke:
    """A line from one point to another, with the heads of arrows at its ends."""

    start: Point
    end: Point
    heads: tuple[bool, bool] = (False, False)


@dataclass(frozen=True)
class Word:
    """A text and its middle."""

    text: Typeset
    x: float
    y: float


@dataclass(frozen=True)
class Picture:
    """A block diagram: its parts, lines, bars of fractions, dots and texts."""

    placed: tuple[PlacedPart, ...]
    strokes: tuple[Stroke, ...]
    bars: tuple[Stroke, ...]
    dots: tuple[Point, ...]
    words: tuple[Word, ...]

    @cached_property
    def corners(self) -> tuple[Point, Point]:
        """The top left and the bottom right corner."""
        across, down = [], []
        for placed in self.placed:
            across += [placed.x - placed.part.half_width, placed.x + placed.part.half_width]
            down += [placed.y - placed.part.half_height, placed.y + placed.part.half_height]
        for stroke in self.strokes:
            across += [stroke.start[0], stroke.end[0]]
            down += [stroke.start[1], stroke.end[1]]
        return (
            (min(across) - MARGIN, min(down) - MARGIN),
            (max(across) + MARGIN, max(down) + MARGIN),
        )


@dataclass(frozen=True)
class _Grid:
    """Where the columns and rows of a diagram lie."""

    letters: Letters
    places: Across
    rows: list[float]
    heights: Mapping[Element, float]

    def down(self, line: Wire, end: End) -> float:
        """Place an end of an upright line."""
        if end.element is None:
            return self.rows[end.at]
        part = self.places.parts[end.element]
        away = part.half_height
        if part.role == "circle":
            off = self.places.uprights[line] - self.places.middles[end.element]
            away = sqrt(max(0.0, RADIUS**2 - off**2))
        y = self.heights[end.element]
        return y + away if end is line.ends[0] else y - away


def picture(letters: Letters) -> Picture:
    """Return a diagram with places."""
    parts = parts_of(letters)
    places = across(letters, parts)
    rows = rows_of(letters, places)
    heights = {element: middle_of(part, parts, rows) for element, part in parts.items()}
    grid = _Grid(letters, places, rows, heights)
    placed = tuple(
        PlacedPart(part, places.middles[element], heights[element])
        for element, part in parts.items()
    )
    return Picture(
        placed,
        tuple(_stroke(line, grid) for line in letters.lines),
        tuple(bar for part in placed for bar in _bars(part)),
        tuple(_dots(grid)),
        (*(word for part in placed for word in _words(part)), *_signs(grid)),
    )


def _stroke(line: Wire, grid: _Grid) -> Stroke:
    if line.upright:
        x = grid.places.uprights[line]
        first, last = ((x, grid.down(line, end)) for end in line.ends)
    else:
        y = grid.rows[line.along]
        first, last = ((grid.places.end(line, end), y) for end in line.ends)
    return Stroke(first, last, (line.ends[0].arrow, line.ends[1].arrow))


def _dots(grid: _Grid) -> Iterator[Point]:
    for row, column in grid.letters.dots:
        x = grid.places.upright_at(column, row)
        if x is not None:
            yield x, grid.rows[row]


def _signs(grid: _Grid) -> Iterator[Word]:
    """Yield the sign of each arrow into a sum."""
    for element, part in grid.places.parts.items():
        for line, end in part.lines if element.kind == "sum" else ():
            if end.arrow:
                yield _sign(line, end, grid)


def _sign(line: Wire, end: End, grid: _Grid) -> Word:
    """Return the sign beside the tip of an arrow, on the outer side of two arrows."""
    away = SIGN if end is line.ends[0] else -SIGN  # from the circle
    if not line.upright:
        x = grid.places.end(line, end) + away
        return Word(formulas.text("+"), x, grid.rows[line.along] - SIGN)
    assert end.element is not None
    side = grid.letters.minus.get((end.at, line.along))
    x, middle = grid.places.uprights[line], grid.places.middles[end.element]
    outer = 1 if x > middle else -1 if x < middle else side or -1
    sign = formulas.text("+" if side is None else "-")
    return Word(sign, x + outer * SIGN, grid.down(line, end) + away)


def _words(placed: PlacedPart) -> Iterator[Word]:
    """Yield the texts of a part."""
    for piece, x in _pieces(placed):
        if isinstance(piece, Typeset):
            yield Word(piece, x, placed.y)
        else:
            yield Word(piece.upper, x, placed.y - STACKED)
            yield Word(piece.lower, x, placed.y + STACKED)


def _bars(placed: PlacedPart) -> Iterator[Stroke]:
    """Yield the bars of a part's fractions."""
    for piece, x in _pieces(placed):
        if isinstance(piece, formulas.Stack) and piece.bar:
            half = piece.width / 2.0 - 1.0
            yield Stroke((x - half, placed.y), (x + half, placed.y))


def _pieces(placed: PlacedPart) -> Iterator[tuple[formulas.Piece, float]]:
    """Yield the words of a part, with its middle."""
    left = placed.x - formulas.width(placed.part.pieces) / 2.0
    for piece in placed.part.pieces:
        yield piece, left + piece.width / 2.0
        left += piece.width
