"""Block diagrams: all that is drawn with letters is in the vector graphics, nothing overlaps."""

import re
from collections import Counter
from itertools import combinations
from math import hypot
from xml.etree import ElementTree

import numpy as np
import pytest

from exfit.features.drawings.diagram import block_diagram, document
from exfit.features.drawings.formulas import SIZE
from exfit.features.drawings.layout import CLIP, picture
from exfit.features.drawings.letters import SIDES, diagram_and_remarks, read
from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES

CATALOGUE = {**MODELS, **STABILISERS, **GOVERNORS, **LOAD_CONTROLLERS, **LIMITERS, **MACHINES}
SVG = "{http://www.w3.org/2000/svg}"
ARROWS = "►◄▲▼"
CAPITAL = 0.36 * SIZE  # half of the height of letters without what hangs below their line
NEAR = 0.5  # px: less than half of the width of a line
FLUXES = {"EQP": "Eq", "EDP": "Ed", "PSID": "ψd", "PSIQ": "ψq"}  # as they are typeset
SQUARE_IN_CIRCLE = 0.5  # lines off the middle of a circle end below its edge, not within this
GARBLED = 40  # diagrams with letters out of place


@pytest.fixture(params=CATALOGUE)
def diagram(request):
    """The block diagram of a model, as letters."""
    return diagram_and_remarks(CATALOGUE[request.param].drawing)[0]


def svg_of(text):
    return ElementTree.fromstring(block_diagram(text, "NAME", "title"))


def typeset(letters):
    """Return how often each letter and digit must stand in a drawing."""
    for name, symbol in FLUXES.items():
        letters = letters.replace(name, symbol)
    letters = letters.replace(CLIP, "").replace("(x)", "").replace("²", "2")
    letters = re.sub(r"([XT])p+(?=[dq])", r"\1", letters)  # a prime
    return Counter(re.findall(r"\w", letters))


def box_of(word):
    """Return where a text stands: left, right, top, bottom."""
    half = word.text.width / 2.0
    return word.x - half, word.x + half, word.y - CAPITAL, word.y + CAPITAL


def crosses(box, start, end):
    """Return whether an upright or level line passes through a box."""
    left, right, top, bottom = box
    (a, c), (b, d) = sorted((start[0], end[0])), sorted((start[1], end[1]))
    return a < right - NEAR and c > left + NEAR and b < bottom - NEAR and d > top + NEAR


def edges(placed):
    """Return the four sides of a frame."""
    part, x, y = placed.part, placed.x, placed.y
    left, right = x - part.half_width, x + part.half_width
    top, bottom = y - part.half_height, y + part.half_height
    corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


def test_each_symbol_and_number_of_the_letters_is_drawn(diagram):
    drawn = Counter(
        letter
        for text in svg_of(diagram).iter(f"{SVG}text")
        for letter in re.findall(r"\w", "".join(text.itertext()))
    )
    assert drawn == typeset(diagram)


def test_each_box_circle_and_arrow_of_the_letters_is_drawn(diagram):
    drawn = picture(read(diagram))
    boxes = [placed.part for placed in drawn.placed if placed.part.element.kind == "box"]
    circles = [placed.part.element.kind for placed in drawn.placed if placed.part.role == "circle"]
    assert sum(len(box.element.rows) for box in boxes) == diagram.count("[")
    assert Counter(circles) == Counter(sum=diagram.count("(+)"), product=diagram.count("(x)"))
    assert sum(sum(stroke.heads) for stroke in drawn.strokes) == sum(map(diagram.count, ARROWS))
    signs = Counter(re.findall("-[▲▼]|[▲▼]-", diagram))
    assert sum(word.text.letters == "−" for word in drawn.words) == signs.total()


def test_each_frame_is_closed(diagram):
    """A frame's path comes back to where it began, by h and v, and then ends with z."""
    drawn = picture(read(diagram))
    paths = [path.get("d") for path in svg_of(diagram).iter(f"{SVG}path")]
    blocks = sum(placed.part.role == "block" for placed in drawn.placed)
    frames = [path for path in paths if re.match(r"M[-\d. ]+h[\d.]+v[\d.]+h-[\d.]+z", path)]
    assert len(frames) == blocks
    for frame in frames:
        right, _, back = map(float, re.findall(r"[hv](-?[\d.]+)", frame)[:3])
        assert right == -back > 0.0


def test_each_line_ends_at_what_it_leads_to(diagram):
    letters = read(diagram)
    assert not [line for line in letters.lines if any(end.loose for end in line.ends)]
    drawn = picture(letters)
    frames = [placed for placed in drawn.placed if placed.part.is_framed]
    for line, stroke in zip(letters.lines, drawn.strokes, strict=True):
        for end, point in zip(line.ends, (stroke.start, stroke.end), strict=True):
            owner = [placed for placed in frames if placed.part.element == end.element]
            for placed in owner:
                assert reaches(placed, point)


def reaches(placed, point):
    """Return whether a point lies on a frame."""
    part, x, y = placed.part, abs(point[0] - placed.x), abs(point[1] - placed.y)
    if part.role == "circle":
        return hypot(x, y) == pytest.approx(part.half_width, abs=0.01)
    on_side = x == pytest.approx(part.half_width) and y <= part.half_height
    return on_side or (y == pytest.approx(part.half_height) and x <= part.half_width)


def test_no_text_lies_on_a_line_on_a_frame_or_on_another_text(diagram):
    drawn = picture(read(diagram))
    lines = [(stroke.start, stroke.end) for stroke in (*drawn.strokes, *drawn.bars)]
    lines += [side for placed in drawn.placed if placed.part.is_framed for side in edges(placed)]
    for word in drawn.words:
        struck = [line for line in lines if crosses(box_of(word), *line)]
        assert not struck, (word.text.letters, struck)
    for word, other in combinations(drawn.words, 2):
        left, right, top, bottom = box_of(other)
        assert not crosses(box_of(word), (left, top), (right, bottom)), (
            word.text.letters,
            other.text.letters,
        )


def test_no_line_passes_through_a_frame_or_along_another_line(diagram):
    drawn = picture(read(diagram))
    for placed in drawn.placed:
        if placed.part.is_framed:
            part = placed.part
            size = SQUARE_IN_CIRCLE if part.role == "circle" else 1.0
            x, y = size * part.half_width, size * part.half_height
            box = placed.x - x, placed.x + x, placed.y - y, placed.y + y
            for stroke in drawn.strokes:
                assert not crosses(box, stroke.start, stroke.end), placed.part.element.rows
    for stroke, other in combinations(drawn.strokes, 2):
        for axis in (0, 1):
            along, across = axis, 1 - axis
            level = {point[across] for line in (stroke, other) for point in (line.start, line.end)}
            if max(level) - min(level) < 2.0:
                ends = [
                    sorted(p[along] for p in (line.start, line.end)) for line in (stroke, other)
                ]
                assert min(e[1] for e in ends) - max(e[0] for e in ends) < NEAR


def test_a_diagram_is_drawn_the_same_each_time_in_the_colours_of_its_page(diagram):
    written = block_diagram(diagram, "NAME", "title <1>")
    assert written == block_diagram(diagram, "NAME", "title <1>")
    root = ElementTree.fromstring(written)
    colours = {
        value for node in root.iter() for key, value in node.items() if key in ("fill", "stroke")
    }
    assert colours == {"none", "currentColor"}
    title, words = root.find(f"{SVG}title"), root.find(f"{SVG}desc")
    assert root.get("aria-labelledby") == f"{title.get('id')} {words.get('id')}"
    assert title.text == "Block diagram of NAME: title <1>"
    assert "Blocks: " in words.text
    assert len(written) < 15_000


def test_every_diagram_fits_on_a_printed_page_with_readable_letters():
    """180 mm are 680 px: letters of 15 px become no smaller than 12 px, 9 points."""
    for name, model in CATALOGUE.items():
        (left, _), (right, _) = picture(read(diagram_and_remarks(model.drawing)[0])).corners
        assert right - left < 850.0, name


def test_a_file_of_its_own_follows_the_readers_screen():
    root = ElementTree.fromstring(document(block_diagram(MODELS["SEXS"].drawing, "SEXS", "t")))
    assert "prefers-color-scheme:dark" in root.find(f"{SVG}style").text


def test_a_text_without_a_diagram_has_none():
    assert block_diagram("A gain.\n\nNothing more.", "MINE", "a gain") == ""
    assert diagram_and_remarks("A gain\nof mine.\n\nMore.") == ("", ["A gain of mine.", "More."])


def test_letters_out_of_place_are_drawn_nonetheless():
    """A user's own drawing may have any fault: characters lost or made of something else."""
    rng = np.random.default_rng(20)
    names, letters = list(CATALOGUE), [*SIDES, " ", "[", "]", "x", "-", "(+)"]
    for _ in range(GARBLED):
        diagram = list(diagram_and_remarks(CATALOGUE[rng.choice(names)].drawing)[0])
        for place in rng.integers(0, len(diagram), 12):
            diagram[place] = str(rng.choice(letters))
        svg_of("".join(diagram))
