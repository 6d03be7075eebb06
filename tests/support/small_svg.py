"""Figures of the documentation as small SVG, and whether two of them show the same.

Each line is one path, in tenths of a point, and so are the markers of one kind that follow each
other; letters stay text. Of a line only those vertices stay that are seen: the ends and extremes of
each column of a point, and of these no more than the shape of the line needs.
"""

import base64
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from html import escape, unescape
from importlib.metadata import version
from io import BytesIO
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ft2font import __freetype_version__
from numpy.typing import NDArray

from exfit.output.figures import style

Points = NDArray[np.float64]  # (n, 2)

SETTINGS = {
    "svg.hashsalt": "exfit",
    "svg.fonttype": "none",
    "font.sans-serif": ["DejaVu Sans", "Verdana"],
}
DRAWN_BY = f"Matplotlib {version('matplotlib').rpartition('.')[0]}, FreeType {__freetype_version__}"
SVG, LINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}href"
MANY = 100  # vertices of a line that is thinned by columns
COLUMN, SEEN = 1.5, 0.3  # points: see thinned
# points between two drawings of a curve. Another processor moves it by the last digit; a line that
# is other by 1 % of an axis moves by 3.
APART = 0.8
STUB = re.compile(r"M[^l]*l(0 ?-?[\d.]+|-?[\d.]+ 0)")  # a line across or down
SHADE = 0.02  # mean difference of two images, of 1

COMMAND = re.compile(r"([MlazCQ])|(-?\d*\.?\d+(?:e-?\d+)?)")


# ---- to draw


def small_svg(figure: Figure) -> bytes:
    """Draw a figure as SVG of few bytes, with the versions that it was drawn by."""
    with matplotlib.rc_context(SETTINGS):
        style.drawn(figure)  # gives all its place
        file = BytesIO()
        figure.savefig(file, format="svg", dpi=72)
    return _Writer(ET.fromstring(file.getvalue())).written().encode()


class _Writer:
    """Writes the elements of an SVG without groups, and styles and clips once."""

    def __init__(self, root: ET.Element) -> None:
        self.root = root
        clips = root.iter(f"{SVG}clipPath")
        self.clips = {clip.attrib["id"]: clip[0].attrib for clip in clips}
        self.names = {clip: f"c{number}" for number, clip in enumerate(self.clips)}
        self.markers = {
            path.attrib["id"]: path
            for defs in root.iter(f"{SVG}defs")
            for path in defs.iter(f"{SVG}path")
        }
        self.classes: dict[str, str] = {}
        self.stubs: dict[str, int] = {}  # by look: which of the lines has these
        self.lines: list[str] = []

    def written(self) -> str:
        for group in self.root:
            if group.tag == f"{SVG}g":
                self._walk(group, "")
        size = self.root.attrib["viewBox"]
        width, height = size.split()[2:]
        looks = "".join(f".{name}{{{look}}}" for look, name in self.classes.items())
        clips = "".join(
            f'<clipPath id="{self.names[clip]}"><rect '
            + " ".join(f'{key}="{_short(float(rect[key]))}"' for key in _SIDES)
            + "/></clipPath>"
            for clip, rect in self.clips.items()
        )
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}pt" height="{height}pt" '
            f'viewBox="{size}"><!-- {DRAWN_BY} -->'
        )
        common = "*{stroke-linejoin:round}text{font-family:DejaVu Sans,Verdana,sans-serif}"
        return "\n".join(
            [head, f"<style>{common}{looks}</style><defs>{clips}</defs>", *self.lines, "</svg>\n"]
        )

    def _walk(self, element: ET.Element, clip: str) -> None:
        """Write what is shown in a group; markers that follow each other are one path."""
        if "transform" in element.attrib:
            raise ValueError("a formula: give its axis a formatter of plain letters")
        clip = element.get("clip-path", clip)
        marker, places = None, list[tuple[float, float]]()
        for child in element:
            kind = child.tag.removeprefix(SVG)
            if kind == "use":
                marker = child
                places.append((float(child.attrib["x"]), float(child.attrib["y"])))
            elif kind == "g":
                self._walk(child, clip)
            elif kind == "path":
                self._path(self._look(child, clip), _path(child.attrib["d"]))
            elif kind == "text":
                self._text(child)
            elif kind == "image":
                self._image(child)
        if marker is not None:
            self._markers(marker, np.array(places), clip)

    def _look(self, element: ET.Element, clip: str, more: str = "") -> str:
        """Return the style of an element, with where it is clipped."""
        look = re.sub(r"font-family: [^;]*;? ?", "", element.get("style", "") + more)
        look = re.sub(r"([:;]) +", r"\1", look).rstrip(";")
        clipped = re.search(r"#(\w+)", element.get("clip-path", clip))
        look += f";clip-path:url(#{self.names[clipped[1]]})" if clipped else ""
        return look

    def _class(self, look: str) -> str:
        name = self.classes.setdefault(look, f"s{len(self.classes)}")
        return f' class="{name}"' if look else ""

    def _markers(self, use: ET.Element, places: Points, clip: str) -> None:
        """Write markers of one kind: dots as ends of lines without length, others as they are."""
        marker = self.markers[use.attrib[LINK][1:]]
        shape, looks = marker.attrib["d"], _looks(use) | _looks(marker)
        circle = re.match(r"M 0 (\S+)\s+C", shape)
        fill, stroke = looks.get("fill", "#000000"), looks.get("stroke", "none")
        if circle and stroke in (fill, "none"):
            width = 2 * float(circle[1]) + float(looks.get("stroke-width", stroke != "none"))
            opacity = looks.get("opacity") or looks.get("fill-opacity", "1")
            dots = ET.Element("path", {"style": f"stroke: {fill}; stroke-width: {width:.1f}"})
            more = "; stroke-linecap: round" + (f"; opacity: {opacity}" if opacity != "1" else "")
            # one dot in a square of half its width
            _, first = np.unique(np.rint(2.0 * places / width), axis=0, return_index=True)
            dots_at = np.rint(places[np.sort(first)] * 10.0)
            moves = np.diff(dots_at, axis=0, prepend=0.0) / 10.0
            line = "M" + "m".join(f"{_pair(x, y)}h0" for x, y in moves)
            self._path(self._look(dots, clip, more), line)
            return
        use.set("style", "; ".join(f"{key}: {value}" for key, value in looks.items()))
        if circle:
            r = float(circle[1])
            shape = f"m{_short(-r)} 0" + "".join(
                f"a{_short(r)} {_short(r)} 0 1 1 {_short(to)} 0" for to in (2 * r, -2 * r)
            )
            line = "".join(f"M{_pair(x, y)}{shape}z" for x, y in places)
        else:
            parts = [_vertices(part) for part in _parts(shape)]
            end = "z" if "z" in shape else ""
            line = "".join(_polyline(part + place) + end for place in places for part in parts)
        self._path(self._look(use, clip), line)

    def _path(self, look: str, line: str) -> None:
        """Write a path; lines of the grid and ticks of one look are one, as they have no order."""
        if STUB.fullmatch(line):
            first = self.stubs.setdefault(look, len(self.lines))
            if first < len(self.lines):
                self.lines[first] = self.lines[first].replace('"/>', f'{line}"/>')
                return
        elif "fill:#" in look:  # an area hides what stands before it
            self.stubs.clear()
        self.lines.append(f'<path{self._class(look)} d="{line}"/>')

    def _text(self, text: ET.Element) -> None:
        place = " ".join(
            f'{key}="{_rounded(text.attrib[key])}"'
            for key in ("x", "y", "transform")
            if key in text.attrib and "rotate(-0 " not in text.attrib[key]
        )
        words = escape("".join(text.itertext()), quote=False)
        self.lines.append(f"<text{self._class(self._look(text, ''))} {place}>{words}</text>")

    def _image(self, image: ET.Element) -> None:
        place = " ".join(
            f'{key}="{_rounded(image.attrib[key])}"' for key in (*_SIDES, "transform")
            if key in image.attrib
        )  # fmt: skip
        data = "".join(image.attrib[LINK].split())
        self.lines.append(f'<image {place} href="{data}"/>')


_SIDES = ("x", "y", "width", "height")


def _looks(element: ET.Element) -> dict[str, str]:
    pairs = re.findall(r"([\w-]+): *([^;]+)", element.get("style", ""))
    return dict(pairs)


def _parts(d: str) -> list[str]:
    return [part for part in re.split(r"(?=M)", d) if part.strip()]


def _vertices(part: str) -> Points:
    return np.array(re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", part), float).reshape(-1, 2)


def _path(d: str) -> str:
    """Return a path with fewer vertices and digits; of curves, as in a rounded box, all stay."""
    if set(re.findall("[A-Za-df-z]", d)) - set("MLz"):
        return _rounded(" ".join(d.split()))
    return "".join(
        _polyline(thinned(_vertices(part))) + ("z" if "z" in part else "") for part in _parts(d)
    )


def thinned(line: Points) -> Points:
    """Leave out the vertices of a line that are not seen (Douglas & Peucker 1973)."""
    if len(line) > MANY and np.all(np.diff(line[:, 0]) >= 0.0):
        line = line[_ends_and_extremes(line)]
    keep = np.zeros(len(line), bool)
    keep[[0, -1]] = True
    left = [(0, len(line) - 1)]
    for start, end in left:
        if end - start > 1:
            between = np.arange(start + 1, end)
            apart = _distances(line[between], line[[start]], line[[end]])
            farthest = int(np.argmax(apart))
            if apart[farthest] > SEEN:
                keep[between[farthest]] = True
                left += [(start, int(between[farthest])), (int(between[farthest]), end)]
    return line[keep]


def _ends_and_extremes(line: Points) -> list[int]:
    starts = np.flatnonzero(np.diff(np.floor(line[:, 0] / COLUMN), prepend=np.nan))
    kept: list[int] = []
    for start, end in zip(starts, [*starts[1:], len(line)], strict=True):
        y = line[start:end, 1]
        kept += sorted({start, start + np.argmin(y), start + np.argmax(y), end - 1})
    return kept


def _polyline(line: Points) -> str:
    places = np.rint(line * 10.0)
    moves = np.diff(places, axis=0)
    moves = moves[np.any(moves != 0.0, axis=1)] if len(line) > 2 else moves
    rest = "".join(f"l{_pair(*move)}" for move in moves / 10.0)
    return f"M{_pair(*places[0] / 10.0)}{rest[:1]}{rest[1:].replace('l-', '-').replace('l', ' ')}"


def _pair(x: float, y: float) -> str:
    return f"{_short(x)} {_short(y)}".replace(" -", "-")


def _short(value: float) -> str:
    return re.sub(r"^(-?)0\.", r"\1.", f"{round(value, 1) + 0.0:.10g}")


def _rounded(text: str) -> str:
    return re.sub(r"-?\d+\.\d+", lambda number: _short(float(number[0])), text)


# ---- to compare


class _Drawing(NamedTuple):
    """What an SVG shows: paths and texts with their looks, images, and what it was drawn by."""

    drawn_by: str
    size: str
    paths: list[tuple[str, str]]
    texts: list[tuple[str, str, list[float]]]
    images: list[bytes]


def _drawing(svg: bytes) -> _Drawing:
    text = svg.decode()
    looks = dict(re.findall(r"\.(s\d+)\{([^}]*)\}", text))
    paths = re.findall(r'<path(?: class="(\w+)")? d="([^"]*)"', text)
    texts = re.findall(r'<text(?: class="(\w+)")? ([^>]*)>([^<]*)<', text)
    return _Drawing(
        re.search("<!-- (.*?) -->", text)[1],
        re.search('viewBox="(.*?)"', text)[1],
        [(looks.get(name, ""), d) for name, d in paths],
        [
            (looks.get(name, ""), unescape(words), [*map(float, re.findall(r"-?[\d.]+\d*", place))])
            for name, place, words in texts
        ],
        [base64.b64decode(data) for data in re.findall(r'base64,([^"]+)"', text)],
    )


def same_svg(one: bytes, other: bytes, same_word: Callable[[str, str], bool]) -> bool:
    """Return whether two figures differ by no more than another machine or version does.

    Another version of Matplotlib has axes, ticks and legends elsewhere: of it only the size and
    the words are compared that are no number.
    """
    first, second = _drawing(one), _drawing(other)
    if first.size != second.size:
        return False
    if first.drawn_by != second.drawn_by:
        labels, its_labels = (
            sorted(word for _, words, _ in it.texts for word in words.split() if word[0].isalpha())
            for it in (first, second)
        )
        return labels == its_labels
    counts = [[len(it.paths), len(it.texts), len(it.images)] for it in (first, second)]
    return (
        counts[0] == counts[1]
        and all(
            look == its_look and _same_path(path, its_path)
            for (look, path), (its_look, its_path) in zip(first.paths, second.paths, strict=True)
        )
        and all(
            look == its_look
            and len(words.split()) == len(its_words.split())
            and all(map(same_word, words.split(), its_words.split()))
            and np.allclose(place, its_place, rtol=0.0, atol=APART)
            for (look, words, place), (its_look, its_words, its_place) in zip(
                first.texts, second.texts, strict=True
            )
        )
        and all(map(_same_image, first.images, second.images))
    )


def _same_path(one: str, other: str) -> bool:
    """Return whether no vertex of one path is farther off the other, and the reverse."""
    if one == other:
        return True
    if any(letter in path for path in (one, other) for letter in "aCQ"):
        shapes, numbers = zip(*map(_shape, (one, other)), strict=True)
        return shapes[0] == shapes[1] and np.allclose(*numbers, rtol=0.0, atol=APART)
    (starts, ends), (its_starts, its_ends) = map(_segments, (one, other))
    return (
        max(
            np.max(_distances(points, froms, tos))
            for points, froms, tos in (
                (np.concatenate([starts, ends]), its_starts, its_ends),
                (np.concatenate([its_starts, its_ends]), starts, ends),
            )
        )
        <= APART
    )


def _shape(path: str) -> tuple[str, list[float]]:
    found = COMMAND.findall(path)
    letters = "".join(letter for letter, _ in found)
    return letters, [float(number) for _, number in found if number]


def _segments(path: str) -> tuple[Points, Points]:
    """Return where the segments of a path of lines or dots begin and end."""
    pieces = list(_lines(path))
    return np.concatenate([line[:-1] for line in pieces]), np.concatenate(
        [line[1:] for line in pieces]
    )


def _lines(path: str) -> Iterator[Points]:
    if "h0" in path:
        dots = np.array(re.findall(r"(-?[\d.]+) ?(-?[\d.]+)h0", path), float)
        for dot in np.cumsum(dots, axis=0):
            yield np.stack([dot, dot])
        return
    for part in _parts(path):
        numbers = [float(number) for letter, number in COMMAND.findall(part) if number]
        moves = np.array(numbers[: len(numbers) // 2 * 2]).reshape(-1, 2)
        line = np.cumsum(moves, axis=0)
        yield np.concatenate([line, line[:1]]) if "z" in part or len(line) == 1 else line


def _distances(points: Points, starts: Points, ends: Points) -> Points:
    """Return the distance of each point to the nearest of some segments."""
    along = ends - starts
    length = np.maximum(np.sum(along**2, axis=1), 1e-12)
    nearest = np.full(len(points), np.inf)
    for start, move, squared in zip(starts, along, length, strict=True):
        offset = points - start
        share = np.clip(offset @ move / squared, 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(offset - share[:, None] * move).T))
    return nearest


def _same_image(one: bytes, other: bytes) -> bool:
    first, second = (matplotlib.image.imread(BytesIO(png)) for png in (one, other))
    return first.shape == second.shape and bool(np.mean(np.abs(first - second)) < SHADE)
