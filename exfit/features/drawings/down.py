"""Where the rows of a block diagram lie from top to bottom, in px.

Rows of letters keep their order, and lie as far apart as what stands in them needs.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from exfit.features.drawings.across import Across
from exfit.features.drawings.letters import End, Letters
from exfit.features.drawings.parts import HALF_TEXT, RADIUS, DiagramPart, Parts

ROW = 8.0  # least height
GAP, EMPTY_ROW = 4.0, 16.0  # between what stands above each other, what an empty row adds
LEG = 16.0  # least length of an upright arrow
ABOVE_LINE = 11.0  # from a line to the middle of its name
LIMIT_GAP = 2.0  # between a block and its limit
SIGN = 8.0  # from the tip of an arrow into a sum to its sign, along and across


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


def rows_of(letters: Letters, places: Across) -> list[float]:
    """Return the middle of each row."""
    needed = list(_needed(letters, places))
    middles = [0.0]
    for row in range(1, letters.rows):
        above = [middles[upper] + room for upper, lower, room in needed if lower == row]
        middles.append(max([middles[-1] + ROW, *above]))
    return middles


def middle_of(part: DiagramPart, parts: Parts, rows: list[float]) -> float:
    """Return the middle of a part: a name stands above its line, a limit at its block."""
    if part.owner is None:
        return rows[part.row] - (ABOVE_LINE if part.role == "name" else 0.0)
    block = parts[part.owner]
    away = block.half_height + LIMIT_GAP + part.half_height
    return rows[block.row] + (away if part.element.top > part.owner.top else -away)


def _needed(letters: Letters, places: Across) -> Iterator[tuple[int, int, float]]:
    """Yield the least distances of rows: the upper, the lower, the distance."""
    obstacles = sorted(_obstacles(letters, places), key=lambda obstacle: obstacle.row)
    for k, upper in enumerate(obstacles):
        for lower in obstacles[k + 1 :]:
            if upper.row < lower.row and upper.meets(lower):
                empty = sum(upper.row < row < lower.row for row in letters.empty_rows)
                yield upper.row, lower.row, upper.down + lower.up + GAP + empty * EMPTY_ROW
    for line in places.uprights:
        (upper_row, down), (lower_row, up) = (_end(end, places.parts) for end in line.ends)
        if upper_row < lower_row and any(end.arrow for end in line.ends):
            yield upper_row, lower_row, down + up + LEG


def _end(end: End, parts: Parts) -> tuple[int, float]:
    """Return the row at an end of an upright line, and how far from it the line ends."""
    if end.element is None:
        return end.at, 0.0
    return parts[end.element].row, parts[end.element].half_height


def _obstacles(letters: Letters, places: Across) -> Iterator[Obstacle]:
    for element, part in places.parts.items():
        row, up, down = _reach(part, places.parts)
        left, right = (places.middles[element] + side * part.half_width for side in (-1, 1))
        if element.kind == "sum":
            left, right = left - 2.0 * SIGN, right + SIGN
        yield Obstacle(row, left, right, up, down)
    for line in letters.lines:
        if not line.upright:
            left, right = sorted(places.end(line, end) for end in line.ends)
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
