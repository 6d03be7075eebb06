"""The block diagram of a model: its drawing with letters, placed and written as SVG."""

import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape

from exfit.features.drawings.formulas import SIZE, SMALL
from exfit.features.drawings.layout import (
    CLIP,
    DiagramPart,
    Picture,
    PlacedPart,
    Point,
    Role,
    Stroke,
    Word,
    picture,
)
from exfit.features.drawings.letters import diagram_and_remarks, read

NOT_IN_AN_ID = re.compile(r"[^\w.-]+")
FONT = "'STIX Two Typeset','Times New Roman','Liberation Serif','DejaVu Serif Condensed',serif"
HEAD, HALF_HEAD = 8.0, 3.2  # px: of an arrow
BASELINE = 0.33  # of the size: from the middle of letters down to the line that they stand on
DROP, RISE = 3.5, -5.5  # px: of a subscript, of an exponent
DOT = 2.2  # px: radius
# what stands in a circle, and the characteristic of a clamp, as strokes about (x, y)
SIGNS_IN_CIRCLES = {
    "sum": "M{x:.1f} {y:.1f}m4.4 -5.5h-8.8l5.5 5.5l-5.5 5.5h8.8",
    "product": "M{x:.1f} {y:.1f}m-5.5 -5.5l11 11m0 -11l-11 11",
}
CHARACTERISTIC = "M{x:.1f} {y:.1f}h6l10 -14h6"
# of a file of its own; on a page a drawing has the page's colours
STYLE = (
    "<style>svg{color:#1d232b;background:#fff}"
    "@media(prefers-color-scheme:dark){svg{color:#e3e6ea;background:#131416}}</style>"
)


def block_diagram(drawing: str, name: str, title: str) -> str:
    """Return the block diagram in a model's text as SVG in the colours of its page.

    It is empty where the text has no diagram. ``name`` begins the ids of its title and of its
    description in words, and must be its alone on a page.
    """
    diagram, _ = diagram_and_remarks(drawing)
    if not diagram:
        return ""
    placed = picture(read(diagram))
    key = f"diagram-{NOT_IN_AN_ID.sub('-', name)}"
    (left, top), (right, bottom) = placed.corners
    width, height = right - left, bottom - top
    words = " ".join(_in_words([each.part for each in placed.placed]))
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" class="diagram" role="img" '
            f'aria-labelledby="{key}-title {key}-text" width="{width:.0f}" height="{height:.0f}" '
            f'viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}" fill="none" '
            f'stroke="currentColor" stroke-width="1.2" stroke-linejoin="round">',
            f'<title id="{key}-title">{escape(f"Block diagram of {name}: {title}")}</title>',
            f'<desc id="{key}-text">{escape(words)}</desc>',
            *(f'<path d="{outline}"/>' for outline in map(_outline, placed.placed) if outline),
            f'<path stroke-linecap="square" d="{"".join(map(_line, placed.strokes))}"/>',
            f'<path stroke-width="1" d="{"".join(map(_line, placed.bars))}"/>',
            f'<path fill="currentColor" stroke="none" d="{"".join(_filled(placed))}"/>',
            f'<g fill="currentColor" stroke="none" text-anchor="middle" font-size="{SIZE:g}" '
            f'font-family="{FONT}">',
            *map(_text, placed.words),
            "</g>",
            "</svg>",
        ]
    )


def document(diagram: str) -> str:
    """Return a block diagram as a file of its own, dark where the reader's screen is."""
    head, end, rest = diagram.partition(">")
    return f"{head}{end}{STYLE}{rest}\n"


def _in_words(parts: Sequence[DiagramPart]) -> Iterator[str]:
    """Yield the inputs, blocks with limits and outputs of a diagram, in the order of reading."""
    in_order = sorted(parts, key=lambda part: (part.element.top, part.element.left))
    roles: Mapping[str, Role] = {"Inputs": "input", "Blocks": "block", "Outputs": "output"}
    for title, role in roles.items():
        words = []
        for part in in_order:
            if part.role == role:
                limits = [_letters(other) for other in in_order if other.owner == part.element]
                text = f" (limits: {', '.join(limits)})" if limits else ""
                words.append(_letters(part) + text)
        if words:
            yield f"{title}: {'; '.join(words)}."


def _letters(part: DiagramPart) -> str:
    rows = [row.strip("[]").strip() for row in part.element.rows]
    if len(rows) == 1:
        return rows[0]
    return " ".join(rows) if rows[1].startswith(("+", "-")) else " over ".join(rows)


def _outline(placed: PlacedPart) -> str:
    """Return the frame of a part, with the sign of what it does."""
    part, x, y = placed.part, placed.x, placed.y
    if part.role == "circle":
        return _circle(part.half_width, x, y) + SIGNS_IN_CIRCLES[part.element.kind].format(x=x, y=y)
    if part.role != "block":
        return ""
    a, b = part.half_width, part.half_height
    frame = f"M{x - a:.1f} {y - b:.1f}h{2 * a:.1f}v{2 * b:.1f}h{-2 * a:.1f}z"
    return frame + CHARACTERISTIC.format(x=x - 11.0, y=y + 7.0) * (part.element.rows == (CLIP,))


def _circle(radius: float, x: float, y: float) -> str:
    arc = f"a{radius:g} {radius:g} 0 1 1"
    return f"M{x - radius:.1f} {y:.1f}{arc} {2 * radius:g} 0{arc} {-2 * radius:g} 0"


def _line(stroke: Stroke) -> str:
    (x, y), (a, b) = stroke.start, stroke.end
    return f"M{x:.1f} {y:.1f}L{a:.1f} {b:.1f}"


def _filled(picture: Picture) -> Iterator[str]:
    """Yield the heads of the arrows, and the dots where lines part."""
    for stroke in picture.strokes:
        if stroke.heads[0]:
            yield _head(stroke.end, stroke.start)
        if stroke.heads[1]:
            yield _head(stroke.start, stroke.end)
    for x, y in picture.dots:
        yield _circle(DOT, x, y)


def _head(start: Point, tip: Point) -> str:
    (x, y), (a, b) = start, tip
    if x == a:
        back = HEAD if b < y else -HEAD
        return f"M{a:.1f} {b:.1f}l{-HALF_HEAD:g} {back:g}h{2 * HALF_HEAD:g}z"
    back = -HEAD if a > x else HEAD
    return f"M{a:.1f} {b:.1f}l{back:g} {-HALF_HEAD:g}v{2 * HALF_HEAD:g}z"


def _text(word: Word) -> str:
    spans, level = [], 0.0
    for run in word.text.runs:
        to = {"sub": DROP, "sup": RISE}.get(run.style, 0.0)
        marks = f' dy="{to - level:g}"' if to != level else ""  # what follows takes it back
        if run.style == "italic":
            marks += ' font-style="italic"'
        elif run.style != "plain":
            marks += f' font-size="{SMALL:g}"'
        letters = escape(run.text)
        spans.append(f"<tspan{marks}>{letters}</tspan>" if marks else letters)
        level = to
    base = word.y + BASELINE * SIZE
    return f'<text x="{word.x:.1f}" y="{base:.1f}">{"".join(spans)}</text>'
