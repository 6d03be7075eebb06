"""Where the parts of a block diagram lie from left to right, in px.

Columns of letters keep their order, and become as wide as what stands in them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

from exfit.features.drawings.letters import Element, End, Letters, Wire
from exfit.features.drawings.parts import RADIUS, DiagramPart, Parts

COLUMN, ARROW = 4.5, 11.0  # least widths of a column, of one with the head of an arrow
CORNER = 8.0  # least width where a line turns, so that it keeps clear of a box beside it
LIMIT_ROOM = 4.0  # left and right of a limit
TEXT_GAP = 4.0  # between a line and the text that it ends at
PAIR = 0.6  # of the radius: how far two arrows from one side lie off the middle of a circle
OFF_MIDDLE = 3  # half columns: a line so near to the middle of a text or box is meant to be in it
BESIDE = 2  # columns from an upright line to a text that belongs to it


@dataclass(frozen=True)
class Across:
    """Where parts have their middle, where upright lines lie, and the edges of the columns."""

    parts: Parts
    middles: Mapping[Element, float]
    uprights: Mapping[Wire, float]
    edges: Sequence[float]

    def upright_at(self, column: int, row: int) -> float | None:
        """Find the upright line through the character at a place."""
        for line, x in self.uprights.items():
            if line.along == column and line.ends[0].at <= row <= line.ends[1].at:
                return x
        return None

    def end(self, line: Wire, end: End) -> float:
        """Place an end of a line along a row."""
        if end.element is None:
            x = self.upright_at(end.at, line.along)
            return (self.edges[end.at] + self.edges[end.at + 1]) / 2.0 if x is None else x
        part, middle = self.parts[end.element], self.middles[end.element]
        if part.role == "name":
            return middle
        away = part.half_width + (0.0 if part.is_framed else TEXT_GAP)
        return middle + away if end is line.ends[0] else middle - away


def across(letters: Letters, parts: Parts) -> Across:
    """Place the parts and upright lines of a diagram."""
    edges = _edges(letters, parts)
    middles = {e: (edges[e.left] + edges[e.right]) / 2.0 for e in parts}
    uprights = {
        line: _upright(line, parts, middles, edges) for line in letters.lines if line.upright
    }
    raw = Across(parts, middles, uprights, edges)
    return Across(parts, {e: _moved(part, raw) for e, part in parts.items()}, uprights, edges)


def _edges(letters: Letters, parts: Parts) -> list[float]:
    """Return the left edge of each column, and the right edge of the last."""
    widths = [COLUMN] * letters.columns
    for line in letters.lines:
        for end in () if line.upright else line.ends:
            widths[end.at] = max(widths[end.at], ARROW if end.arrow else CORNER)
    needed = _widths(parts)
    for element in sorted(needed, key=lambda e: (e.right - e.left, e.left, e.top)):
        columns = range(element.left, element.right)
        lacking = max(0.0, needed[element] - sum(widths[column] for column in columns))
        for column in columns:
            widths[column] += lacking / len(columns)
    return [0.0, *accumulate(widths)]


def _widths(parts: Parts) -> dict[Element, float]:
    """Measure the columns of each part, those of a block with its limits."""
    widths = {e: 2.0 * part.half_width for e, part in parts.items() if part.owner is None}
    for part in parts.values():
        if part.owner is not None:
            widths[part.owner] = max(widths[part.owner], 2.0 * (part.half_width + LIMIT_ROOM))
    return widths


def _upright(
    line: Wire, parts: Parts, middles: Mapping[Element, float], edges: Sequence[float]
) -> float:
    """Place an upright line: in the middle of a circle or block that it ends at."""
    ends = [end.element for end in line.ends if end.element is not None]
    for element in ends:
        if parts[element].role == "circle":
            return middles[element] + _off_middle(line, parts[element])
    for element in ends:
        off = abs(2 * line.along + 1 - element.left - element.right)
        if parts[element].role == "block" and off <= OFF_MIDDLE:
            return middles[element]
    return (edges[line.along] + edges[line.along + 1]) / 2.0


def _off_middle(line: Wire, circle: DiagramPart) -> float:
    """Measure a line's distance from a circle's middle: two from one side keep apart."""
    side = next(k for k, end in enumerate(line.ends) if end.element is circle.element)
    columns = sorted(
        other.along for other, end in circle.lines if other.upright and other.ends[side] is end
    )
    if len(columns) < 2:
        return 0.0
    return PAIR * RADIUS * (-1.0 if line.along == columns[0] else 1.0)


def _moved(part: DiagramPart, raw: Across) -> float:
    """Place a part: a text keeps to its box or its line."""
    element, x = part.element, raw.middles[part.element]
    if part.owner is not None:
        return raw.middles[part.owner]
    if part.role == "remark":
        return _beside_upright(part, raw)
    if part.role not in ("input", "output"):
        return x
    line, end = part.lines[0]
    if line.upright:
        off = abs(2 * line.along + 1 - element.left - element.right)
        return raw.uprights[line] if off <= OFF_MIDDLE else x
    if end is line.ends[1]:
        return raw.edges[element.left] + part.half_width
    return raw.edges[element.right] - part.half_width


def _beside_upright(part: DiagramPart, raw: Across) -> float:
    """Place a text without a line of its own: against an upright line beside it."""
    element = part.element
    for columns in range(BESIDE):
        left = raw.upright_at(element.left - 1 - columns, element.top)
        if left is not None:
            return left + TEXT_GAP + part.half_width
        right = raw.upright_at(element.right + columns, element.top)
        if right is not None:
            return right - TEXT_GAP - part.half_width
    return raw.middles[element]
