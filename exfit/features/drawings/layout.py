"""A block diagram with places, in px: what its letters stand for, frames, lines, texts.

Columns and rows of letters keep their order. A column becomes as wide as what stands in it, rows
lie as far apart as what stands in them needs.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate
from math import sqrt
from typing import Literal

from exfit.features.drawings import formulas
from exfit.features.drawings.formulas import Piece, Stack, Typeset
from exfit.features.drawings.letters import CIRCLES, Element, End, Letters, Wire

RADIUS = 10.0  # of a circle
BOX_PADDING = 5.0  # left and right of what stands in a box
LOW_BOX, HIGH_BOX = 12.0, 21.0  # half of the height of a box of one row, of one with fractions
HALF_TEXT = 9.0  # half of the height of a text with its subscripts
LIMIT_ROWS = 2  # of letters, at most from a box to its limit
CLIP, HALF_CLIP = "[clip]", 16.0  # a clamp, which is drawn as its characteristic

COLUMN, ARROW = 4.5, 11.0  # least widths of a column, of one with the head of an arrow
CORNER = 8.0  # least width where a line turns, so that it keeps clear of a box beside it
LIMIT_ROOM = 4.0  # left and right of a limit
TEXT_GAP = 4.0  # between a line and the text that it ends at
PAIR = 0.6  # of the radius: how far two arrows from one side lie off the middle of a circle
OFF_MIDDLE = 3  # half columns: a line so near to the middle of a text or box is meant to be in it
BESIDE = 2  # columns from an upright line to a text that belongs to it
ROW = 8.0  # least height
GAP, EMPTY_ROW = 4.0, 16.0  # between what stands above each other, what an empty row adds
LEG = 16.0  # least length of an upright arrow
ABOVE_LINE = 11.0  # from a line to the middle of its name
LIMIT_GAP = 2.0  # between a block and its limit
SIGN = 8.0  # from the tip of an arrow into a sum to its sign, along and across
MARGIN = 6.0  # around the diagram
STACKED = 10.0  # from the bar of a fraction to the middle of its parts

Point = tuple[float, float]
# a limit stands above or below a block; a name is that of the line that passes it
Role = Literal["block", "circle", "input", "output", "name", "limit", "remark"]


@dataclass(frozen=True)
class DiagramPart:
    """An element of a diagram: its role, what is written in it, its size, its lines.

    ``owner`` is the block whose limit it is.
    """

    element: Element
    role: Role
    pieces: tuple[Piece, ...]
    half_width: float
    half_height: float
    lines: tuple[tuple[Wire, End], ...]
    owner: Element | None = None

    @property
    def is_framed(self) -> bool:
        """Whether it has a frame, to which lines lead."""
        return self.role in ("block", "circle")

    @property
    def row(self) -> int:
        """The row of the lines at its sides, else its first one."""
        sides = (line.along for line, _ in self.lines if not line.upright)
        return min(sides, default=self.element.top)


Parts = Mapping[Element, DiagramPart]


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
class DiagramGrid:
    """Where the columns and rows of a diagram lie: their edges, upright lines, the middles."""

    letters: Letters
    parts: Parts
    edges: Sequence[float]
    uprights: Mapping[Wire, float]
    middles: Mapping[Element, float]
    rows: Sequence[float] = ()
    heights: Mapping[Element, float] = field(default_factory=dict)

    def upright_at(self, column: int, row: int) -> float | None:
        """Find the upright line through the character at a place."""
        for line, x in self.uprights.items():
            if line.along == column and line.ends[0].at <= row <= line.ends[1].at:
                return x
        return None

    def across(self, line: Wire, end: End) -> float:
        """Place an end of a line along a row."""
        if end.element is None:
            x = self.upright_at(end.at, line.along)
            return (self.edges[end.at] + self.edges[end.at + 1]) / 2.0 if x is None else x
        part, middle = self.parts[end.element], self.middles[end.element]
        if part.role == "name":
            return middle
        away = part.half_width + (0.0 if part.is_framed else TEXT_GAP)
        return middle + away if end is line.ends[0] else middle - away

    def down(self, line: Wire, end: End) -> float:
        """Place an end of an upright line."""
        if end.element is None:
            return self.rows[end.at]
        part = self.parts[end.element]
        away = part.half_height
        if part.role == "circle":
            off = self.uprights[line] - self.middles[end.element]
            away = sqrt(max(0.0, RADIUS**2 - off**2))
        y = self.heights[end.element]
        return y + away if end is line.ends[0] else y - away


def picture(letters: Letters) -> Picture:
    """Return a diagram with places."""
    parts = _parts(letters)
    edges = _edges(letters, parts)
    middles = {e: (edges[e.left] + edges[e.right]) / 2.0 for e in parts}
    uprights = {
        line: _upright(line, parts, middles, edges) for line in letters.lines if line.upright
    }
    raw = DiagramGrid(letters, parts, edges, uprights, middles)
    grid = replace(raw, middles={e: _moved(part, raw) for e, part in parts.items()})
    rows = _rows(grid)
    heights = {e: _height(part, parts, rows) for e, part in parts.items()}
    grid = replace(grid, rows=rows, heights=heights)
    placed = tuple(PlacedPart(part, grid.middles[e], heights[e]) for e, part in parts.items())
    words, bars, dots = [], [], []
    for row, column in letters.dots:
        upright = grid.upright_at(column, row)
        if upright is not None:
            dots.append((upright, rows[row]))
    for part in placed:
        left = part.x - formulas.width(part.part.pieces) / 2.0
        for piece in part.part.pieces:
            x = left + piece.width / 2.0
            left += piece.width
            if isinstance(piece, Typeset):
                words.append(Word(piece, x, part.y))
                continue
            words += [
                Word(piece.upper, x, part.y - STACKED),
                Word(piece.lower, x, part.y + STACKED),
            ]
            if piece.bar:
                half = piece.width / 2.0 - 1.0
                bars.append(Stroke((x - half, part.y), (x + half, part.y)))
    return Picture(
        placed,
        tuple(_stroke(line, grid) for line in letters.lines),
        tuple(bars),
        tuple(dots),
        (*words, *_signs(grid)),
    )


def _parts(letters: Letters) -> Parts:
    parts = {element: _part(element, letters.lines) for element in letters.elements}
    owners = {element: _owner(part, parts) for element, part in parts.items()}
    return {
        element: replace(part, role="limit", owner=owners[element]) if owners[element] else part
        for element, part in parts.items()
    }


def _part(element: Element, lines: Sequence[Wire]) -> DiagramPart:
    touching = tuple((line, end) for line in lines for end in line.ends if end.element is element)
    if element.kind in CIRCLES.values():
        return DiagramPart(element, "circle", (), RADIUS, RADIUS, touching)
    if element.rows == (CLIP,):
        return DiagramPart(element, "block", (), HALF_CLIP, LOW_BOX, touching)
    if element.kind == "box":
        pieces = formulas.formula(element.rows)
        height = HIGH_BOX if any(isinstance(piece, Stack) for piece in pieces) else LOW_BOX
        half_width = formulas.width(pieces) / 2.0 + BOX_PADDING
        return DiagramPart(element, "block", pieces, half_width, height, touching)
    role = _role([end for _, end in touching])
    text = formulas.text(element.rows[0])
    padding, height = (BOX_PADDING, LOW_BOX) if role == "block" else (0.0, HALF_TEXT)
    return DiagramPart(element, role, (text,), text.width / 2.0 + padding, height, touching)


def _role(ends: Sequence[End]) -> Role:
    """Find the role of a text: a block is one that an arrow leads to and a line leaves."""
    match len(ends), {end.arrow for end in ends}:
        case 0, _:
            return "remark"
        case _, arrows if len(arrows) == 2:
            return "block"
        case 1, arrows if arrows == {False}:
            return "input"
        case _, arrows if arrows == {False}:
            return "name"
    return "output"


def _owner(part: DiagramPart, parts: Parts) -> Element | None:
    """Return the block that a text without lines stands above or below."""
    if part.role != "remark":
        return None
    text = part.element
    beside: dict[Element, tuple[int, int]] = {}
    for box, other in parts.items():
        rows = max(box.top - text.top, text.top - box.bottom)
        columns = min(text.right, box.right) - max(text.left, box.left)
        if other.role == "block" and 0 < rows <= LIMIT_ROWS and columns > 0:
            beside[box] = rows, -columns
    return min(beside, key=lambda box: beside[box], default=None)


def _edges(letters: Letters, parts: Parts) -> list[float]:
    """Return the left edge of each column, and the right edge of the last."""
    widths = [COLUMN] * letters.columns
    for line in letters.lines:
        for end in () if line.upright else line.ends:
            widths[end.at] = max(widths[end.at], ARROW if end.arrow else CORNER)
    needed = {e: 2.0 * part.half_width for e, part in parts.items() if part.owner is None}
    for part in parts.values():
        if part.owner is not None:  # a block has room for its limits
            needed[part.owner] = max(needed[part.owner], 2.0 * (part.half_width + LIMIT_ROOM))
    for element in sorted(needed, key=lambda e: (e.right - e.left, e.left, e.top)):
        columns = range(element.left, element.right)
        lacking = max(0.0, needed[element] - sum(widths[column] for column in columns))
        for column in columns:
            widths[column] += lacking / len(columns)
    return [0.0, *accumulate(widths)]


def _upright(
    line: Wire, parts: Parts, middles: Mapping[Element, float], edges: Sequence[float]
) -> float:
    """Place an upright line: in the middle of a circle or block that it ends at.

    At a circle two lines from one side keep apart.
    """
    touched = [(k, end.element) for k, end in enumerate(line.ends) if end.element is not None]
    for side, element in touched:
        if parts[element].role == "circle":
            columns = sorted(
                other.along
                for other, end in parts[element].lines
                if other.upright and other.ends[side] is end
            )
            off = -1.0 if line.along == columns[0] else 1.0
            return middles[element] + (PAIR * RADIUS * off if len(columns) > 1 else 0.0)
    for _, element in touched:
        if parts[element].role == "block" and _is_within(line, element):
            return middles[element]
    return (edges[line.along] + edges[line.along + 1]) / 2.0


def _is_within(line: Wire, element: Element) -> bool:
    """Tell whether an upright line is meant to be in the middle of a text or box."""
    return abs(2 * line.along + 1 - element.left - element.right) <= OFF_MIDDLE


def _moved(part: DiagramPart, raw: DiagramGrid) -> float:
    """Place a part: a text keeps to its box or its line, one without against an upright line."""
    element, x = part.element, raw.middles[part.element]
    if part.owner is not None:
        return raw.middles[part.owner]
    if part.role == "remark":
        for columns in range(BESIDE):
            left = raw.upright_at(element.left - 1 - columns, element.top)
            if left is not None:
                return left + TEXT_GAP + part.half_width
            right = raw.upright_at(element.right + columns, element.top)
            if right is not None:
                return right - TEXT_GAP - part.half_width
    if part.role not in ("input", "output"):
        return x
    line, end = part.lines[0]
    if line.upright:
        return raw.uprights[line] if _is_within(line, element) else x
    if end is line.ends[1]:
        return raw.edges[element.left] + part.half_width
    return raw.edges[element.right] - part.half_width


@dataclass(frozen=True)
class Obstacle:
    """What others keep clear of: from its row so far up and down, between two x."""

    row: int
    left: float
    right: float
    up: float
    down: float

    def meets(self, other: "Obstacle") -> bool:
        """Tell whether one could stand above the other."""
        return self.left < other.right + GAP and other.left < self.right + GAP


def _rows(grid: DiagramGrid) -> list[float]:
    needed = list(_distances(grid))
    middles = [0.0]
    for row in range(1, grid.letters.rows):
        above = [middles[upper] + room for upper, lower, room in needed if lower == row]
        middles.append(max([middles[-1] + ROW, *above]))
    return middles


def _height(part: DiagramPart, parts: Parts, rows: Sequence[float]) -> float:
    """Return the middle of a part: a name stands above its line, a limit at its block."""
    if part.owner is None:
        return rows[part.row] - (ABOVE_LINE if part.role == "name" else 0.0)
    block = parts[part.owner]
    away = block.half_height + LIMIT_GAP + part.half_height
    return rows[block.row] + (away if part.element.top > part.owner.top else -away)


def _distances(grid: DiagramGrid) -> Iterator[tuple[int, int, float]]:
    """Yield the least distances of rows: the upper, the lower, the distance."""
    obstacles = sorted(_obstacles(grid), key=lambda obstacle: obstacle.row)
    for k, upper in enumerate(obstacles):
        for lower in obstacles[k + 1 :]:
            if upper.row < lower.row and upper.meets(lower):
                empty = sum(upper.row < row < lower.row for row in grid.letters.empty_rows)
                yield upper.row, lower.row, upper.down + lower.up + GAP + empty * EMPTY_ROW
    for line in grid.uprights:
        parts = [None if end.element is None else grid.parts[end.element] for end in line.ends]
        (first, down), (last, up) = (
            (end.at, 0.0) if part is None else (part.row, part.half_height)
            for end, part in zip(line.ends, parts, strict=True)
        )
        if first < last and any(end.arrow for end in line.ends):
            yield first, last, down + up + LEG


def _obstacles(grid: DiagramGrid) -> Iterator[Obstacle]:
    for element, part in grid.parts.items():
        row, up, down = _reach(part, grid.parts)
        left, right = (grid.middles[element] + side * part.half_width for side in (-1, 1))
        if element.kind == "sum":
            left, right = left - 2.0 * SIGN, right + SIGN
        yield Obstacle(row, left, right, up, down)
    for line in grid.letters.lines:
        if not line.upright:
            left, right = sorted(grid.across(line, end) for end in line.ends)
            yield Obstacle(line.along, left, right, 1.0, 1.0)


def _reach(part: DiagramPart, parts: Parts) -> tuple[int, float, float]:
    """Return the row that a part belongs to, how far up and how far down it reaches from there."""
    if part.owner is not None:
        block = parts[part.owner]
        near = block.half_height + LIMIT_GAP
        far = near + 2.0 * part.half_height
        above = part.element.top < part.owner.top
        return (block.row, far, -near) if above else (block.row, -near, far)
    if part.role == "name":
        return part.row, ABOVE_LINE + HALF_TEXT, 0.0
    if part.element.kind == "sum":
        return part.row, RADIUS + GAP, RADIUS + 2.0 * SIGN
    return part.row, part.half_height, part.half_height


def _stroke(line: Wire, grid: DiagramGrid) -> Stroke:
    if line.upright:
        x = grid.uprights[line]
        first, last = ((x, grid.down(line, end)) for end in line.ends)
    else:
        y = grid.rows[line.along]
        first, last = ((grid.across(line, end), y) for end in line.ends)
    return Stroke(first, last, (line.ends[0].arrow, line.ends[1].arrow))


def _signs(grid: DiagramGrid) -> Iterator[Word]:
    """Yield the sign of each arrow into a sum, beside its tip, on the outer side of two arrows."""
    for element, part in grid.parts.items():
        for line, end in part.lines if element.kind == "sum" else ():
            if not end.arrow:
                continue
            away = SIGN if end is line.ends[0] else -SIGN  # from the circle
            if not line.upright:
                x = grid.across(line, end) + away
                yield Word(formulas.text("+"), x, grid.rows[line.along] - SIGN)
                continue
            side = grid.letters.minus.get((end.at, line.along))
            x, middle = grid.uprights[line], grid.middles[element]
            outer = 1 if x > middle else -1 if x < middle else side or -1
            sign = formulas.text("+" if side is None else "-")
            yield Word(sign, x + outer * SIGN, grid.down(line, end) + away)
