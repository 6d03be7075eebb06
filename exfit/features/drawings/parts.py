"""What the letters of a block diagram stand for: roles, contents, sizes in px."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from exfit.features.drawings import formulas
from exfit.features.drawings.formulas import Piece, Stack
from exfit.features.drawings.letters import CIRCLES, Element, End, Letters, Wire

RADIUS = 10.0  # of a circle
BOX_PADDING = 5.0  # left and right of what stands in a box
LOW_BOX, HIGH_BOX = 12.0, 21.0  # half of the height of a box of one row, of one with fractions
HALF_TEXT = 9.0  # half of the height of a text with its subscripts
LIMIT_ROWS = 2  # of letters, at most from a box to its limit
CLIP, HALF_CLIP = "[clip]", 16.0  # a clamp, which is drawn as its characteristic

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


def parts_of(letters: Letters) -> Parts:
    """Return the part that each element is."""
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
