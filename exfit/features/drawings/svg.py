"""A block diagram as SVG, in the colours of the page that it stands on."""

import re
from collections.abc import Iterator
from html import escape

from exfit.features.drawings.formulas import SIZE, SMALL, Styled
from exfit.features.drawings.layout import Picture, PlacedPart, Point, Stroke, Word
from exfit.features.drawings.parts import CLIP

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


def svg(picture: Picture, key: str, title: str, description: str) -> str:
    """Return a picture; ``key`` begins the ids of its title and description, less what ids lack."""
    key = NOT_IN_AN_ID.sub("-", key)
    (left, top), (right, bottom) = picture.corners
    width, height = right - left, bottom - top
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" class="diagram" role="img" '
            f'aria-labelledby="{key}-title {key}-text" width="{width:.0f}" height="{height:.0f}" '
            f'viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}" fill="none" '
            f'stroke="currentColor" stroke-width="1.2" stroke-linejoin="round">',
            f'<title id="{key}-title">{escape(title)}</title>',
            f'<desc id="{key}-text">{escape(description)}</desc>',
            *(f'<path d="{outline}"/>' for outline in map(_outline, picture.placed) if outline),
            f'<path stroke-linecap="square" d="{"".join(map(_line, picture.strokes))}"/>',
            f'<path stroke-width="1" d="{"".join(map(_line, picture.bars))}"/>',
            f'<path fill="currentColor" stroke="none" d="{"".join(_filled(picture))}"/>',
            f'<g fill="currentColor" stroke="none" text-anchor="middle" font-size="{SIZE:g}" '
            f'font-family="{FONT}">',
            *map(_text, picture.words),
            "</g>",
            "</svg>",
        ]
    )


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
    base = word.y + BASELINE * SIZE
    return f'<text x="{word.x:.1f}" y="{base:.1f}">{"".join(_spans(word))}</text>'


def _spans(word: Word) -> Iterator[str]:
    """Yield the letters; a subscript's drop is taken back by what follows it."""
    level = 0.0
    for run in word.text.runs:
        to = {"sub": DROP, "sup": RISE}.get(run.style, 0.0)
        yield _span(run, to - level)
        level = to


def _span(run: Styled, drop: float) -> str:
    marks = f' dy="{drop:g}"' if drop else ""
    if run.style == "italic":
        marks += ' font-style="italic"'
    elif run.style != "plain":
        marks += f' font-size="{SMALL:g}"'
    return f"<tspan{marks}>{escape(run.text)}</tspan>" if marks else escape(run.text)
