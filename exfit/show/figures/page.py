"""Figures as PNG files, with short cuts where Matplotlib takes most of its time."""

import struct
import zlib
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends.backend_agg import RendererAgg, get_hinting_flag
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.ft2font import LoadFlags

SIGNATURE = b"\x89PNG\r\n\x1a\n"
EIGHT_BIT_RGB = (8, 2, 0, 0, 0)
COMPRESSION = 1  # of 9: the files are hardly larger
PER_METRE = 1.0 / 0.0254  # of what is one an inch
UNIT_PER_DOT = 64.0  # of FreeType's lengths
UPRIGHT = 90.0  # degrees
MOST_TEXTS = 4096  # kept as they were set: many figures have the same numbers and labels


class SetText(NamedTuple):
    """A text as it is set: its dots, where they begin beside its baseline, and its size in dots."""

    dots: NDArray[np.uint8]
    left: float
    below: float
    size: tuple[float, float, float]  # width, height, descent


@lru_cache(MOST_TEXTS)
def _set_text(text: str, font: FontProperties, dpi: float, hinting: "LoadFlags") -> SetText | None:
    """Set a text; return None where its font lacks a character."""
    face = get_font(findfont(font))
    if not all(face.get_char_index(ord(letter)) for letter in text):
        return None
    face.clear()
    face.set_size(font.get_size_in_points(), dpi)
    face.set_text(text, 0.0, flags=hinting)
    face.draw_glyphs_to_bitmap(antialiased=True)
    left, below = (offset / UNIT_PER_DOT for offset in face.get_bitmap_offset())
    width, height = (length / UNIT_PER_DOT for length in face.get_width_height())
    descent = face.get_descent() / UNIT_PER_DOT
    return SetText(np.array(face.get_image()), left, below, (width, height, descent))


class PageRenderer(RendererAgg):
    """Draws as Matplotlib does, but sets a text that appears again only once."""

    def _text(self, text: str, font: FontProperties) -> SetText | None:
        return _set_text(text, font.copy(), self.dpi, get_hinting_flag())

    def get_text_width_height_descent(
        self, s: str, prop: FontProperties, ismath: Any
    ) -> tuple[float, float, float]:
        """Return the size of a text in dots."""
        text = None if ismath else self._text(s, prop)
        if text is None:
            size: tuple[float, float, float]
            size = super().get_text_width_height_descent(s, prop, ismath)
            return size
        return text.size

    def draw_text(
        self,
        gc: GraphicsContextBase,
        x: float,
        y: float,
        s: str,
        prop: FontProperties,
        angle: float,
        ismath: Any = False,
        mtext: Any = None,
    ) -> None:
        """Draw a text whose baseline begins at a place, in dots from the upper left."""
        text = None if ismath or angle not in (0.0, UPRIGHT) else self._text(s, prop)
        if text is None:
            super().draw_text(gc, x, y, s, prop, angle, ismath, mtext)
            return
        descent = text.size[-1]
        if angle:
            dots = np.rot90(text.dots)
            left, low = x + text.below + descent - dots.shape[1], self.height - y + text.left
        else:
            dots = text.dots
            left, low = x + text.left, self.height - y - text.below - descent
        picture = np.empty((*dots.shape, 4), dtype=np.uint8)
        picture[:, :, :3] = np.round(255.0 * np.array(gc.get_rgb()[:3]))
        picture[:, :, 3] = dots
        self.draw_image(gc, round(left), round(low), picture[::-1])


def pixels(figure: Figure, dpi: float) -> NDArray[np.uint8]:
    """Return a figure as it is drawn: rows of red, green, blue and opacity."""
    former = figure.dpi
    figure.dpi = dpi
    renderer = PageRenderer(figure.bbox.width, figure.bbox.height, dpi)
    figure.draw(renderer)
    figure.dpi = former
    return np.asarray(renderer.buffer_rgba())


def as_png(picture: NDArray[np.uint8], dpi: float) -> bytes:
    """Return rows of pixels as a PNG file, without the filters that a library tries on each row."""
    height, width, _ = picture.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # a row begins with that of its filter
    for colour in range(3):
        rows[:, 1 + colour :: 3] = picture[:, :, colour]
    scale = round(dpi * PER_METRE)
    return SIGNATURE + b"".join(
        (
            _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, *EIGHT_BIT_RGB)),
            _chunk(b"pHYs", struct.pack(">IIB", scale, scale, 1)),
            _chunk(b"IDAT", zlib.compress(rows.data, COMPRESSION)),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(name: bytes, content: bytes) -> bytes:
    check = zlib.crc32(name + content)
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", check)
