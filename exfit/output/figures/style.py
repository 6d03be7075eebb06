"""How all figures look, and how one becomes a file."""

import struct
import warnings
import zlib
from collections import defaultdict
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text
from matplotlib.ticker import LogFormatter
from matplotlib.transforms import Bbox, ScaledTranslation
from numpy.typing import NDArray

from exfit.util.arrays import Array

MEASURED, SIMULATED, START, LIMIT = "#8a8f98", "#c1272d", "#2b6cb0", "#b7791f"
GREEN = "#2f855a"
WIDTH = 9.0  # inches
DPI = 120
MILLI = 1e3
POINTS = 72.0  # in an inch
PAD = 5.0 / POINTS  # inches around the axes with their labels
SMALLEST = 6.0  # points: letters of a title that is made to fit
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LONGEST_NAME = 20  # letters
COLORS = ("#1f4e9c", "#c1272d", GREEN, "#b7791f", "#6b46c1", "#0e7490", "#4a5568")
STYLES = ("-", "--", ":")


class MeasuredAxes(Axes):
    """Axes that are measured once for the same ticks, however often they are moved."""

    measured: tuple[object, Array] | None = None  # the ticks, the room (pixels) around the axes

    def ticks(self) -> object:
        """Return the places of the ticks."""
        return self.xaxis.get_majorticklocs().tolist(), self.yaxis.get_majorticklocs().tolist()

    def get_tightbbox(self, renderer: RendererBase | None = None, **options: Any) -> Bbox | None:
        """Find the box around the axes with their labels; see Axes.get_tightbbox."""
        ticks, extent = self.ticks(), np.array(self.get_window_extent().extents)
        if self.measured is None or self.measured[0] != ticks:
            box = super().get_tightbbox(renderer, **options)
            if box is None:
                return None
            self.measured = ticks, np.array(box.extents) - extent
        return Bbox((extent + self.measured[1]).reshape(2, 2))


class MeasuredFigure(Figure):
    """A figure whose axes are panels."""

    def add_subplot(self, *arguments: Any, **options: Any) -> Axes:
        """Add axes; see Figure.add_subplot."""
        panel: Axes = super().add_subplot(*arguments, axes_class=MeasuredAxes, **options)
        return panel


def new_figure(height: float, title: str = "", width: float = WIDTH) -> Figure:
    """Make an empty figure of a size in inches, which gives its axes the room that labels leave."""
    figure = MeasuredFigure(
        figsize=(width, height), layout=ConstrainedLayoutEngine(h_pad=PAD, w_pad=PAD)
    )
    if title:
        figure.suptitle(title, fontsize=11)
    return figure


def panels(figure: Figure, rows: int, columns: int = 1, **grid: Any) -> NDArray[np.object_]:
    """Make axes of a figure in rows and columns; see Figure.subplots."""
    return np.asarray(figure.subplots(rows, columns, squeeze=False, **grid))


def stacked(
    height: float, rows: int, title: str = "", **grid: Any
) -> tuple[Figure, NDArray[np.object_]]:
    """Make a figure of a height in inches, with axes below each other; see Figure.subplots."""
    figure = new_figure(height, title)
    return figure, panels(figure, rows, **grid)[:, 0]


def short(name: str, most: int = LONGEST_NAME) -> str:
    """Return a name, cut off where it has more letters than there is room for."""
    return name if len(name) <= most else name[: most - 1] + "…"


def png(figure: Figure) -> bytes:
    """Draw a figure as the bytes of a PNG file."""
    return encoded(drawn(figure))


def drawn(figure: Figure) -> NDArray[np.uint8]:
    """Draw a figure in pixels: rows of red, green, blue and opacity.

    Dollar signs in names make no formulas; letters that the font lacks are boxes.
    """
    for text in figure.findobj(Text):
        text.set_parse_math("$" not in text.get_text())
    former = figure.dpi
    figure.dpi = DPI
    canvas = FigureCanvasAgg(figure)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
        ticks = _with_aligned_labels(figure, canvas)
        layout = figure.get_layout_engine()
        if layout is not None:
            for axes in figure.axes:
                for artist in axes.get_children():
                    artist.set_in_layout(isinstance(artist, Axis | Text) and artist.get_in_layout())
            layout.execute(figure)
            other_ticks = _vertical_ticks(figure) != ticks  # as axes have their size
            if _fitted(figure) or other_ticks:
                _with_aligned_labels(figure, canvas)
                layout.execute(figure)
            figure.set_layout_engine("none")  # all has its place
        canvas.draw()
    figure.dpi = former
    return np.asarray(canvas.buffer_rgba())


def _vertical_ticks(figure: Figure) -> list[list[float]]:
    return [axes.yaxis.get_majorticklocs().tolist() for axes in figure.axes]


def _with_aligned_labels(figure: Figure, canvas: FigureCanvasAgg) -> list[list[float]]:
    """Place the labels of the vertical axes of a column in one line, left of all their ticks.

    Return these ticks. Matplotlib's own alignment measures the ticks of a column anew for each of
    its labels.
    """
    columns, renderer = defaultdict[int, dict[Axes, float]](dict), canvas.get_renderer()
    for axes in figure.axes:
        place, label = axes.get_subplotspec(), axes.yaxis.label
        if isinstance(axes, MeasuredAxes):
            axes.measured = None
        for axis in (axes.xaxis, axes.yaxis):
            if not axis.label.get_text():
                axis.set_label_coords(0.0, 0.0)  # else its ticks are measured to place nothing
        if place is None or not label.get_text() or str(axes.yaxis.label_position) != "left":
            continue
        label.set_visible(False)
        axes.yaxis.set_label_coords(0.0, 0.5)
        ticks, left = axes.yaxis.get_tightbbox(renderer), axes.get_window_extent().x0
        label.set_visible(True)
        room = 0.0 if ticks is None else max(left - ticks.x0, 0.0)
        columns[place.colspan.start][axes] = room
    for column in columns.values():
        for axes in column:
            left = -max(column.values()) / figure.dpi - axes.yaxis.labelpad / POINTS
            away = ScaledTranslation(left, 0.0, figure.dpi_scale_trans)
            axes.yaxis.set_label_coords(0.0, 0.5, axes.transAxes + away)
    return _vertical_ticks(figure)


def _fitted(figure: Figure) -> bool:
    """Make the letters of titles as small as their room asks for; tell whether any were."""
    pad = 2.0 * PAD * figure.dpi
    width, height = figure.bbox.width - pad, figure.bbox.height - pad
    rooms = {text: height if text.get_rotation() else width for text in figure.texts}
    for axes in figure.axes:
        titles = {axes.get_title(loc=place) for place in ("left", "center", "right")} - {""}
        written = (child for child in axes.get_children() if isinstance(child, Text))
        rooms |= {text: axes.bbox.width for text in written if text.get_text() in titles}
    changed = False
    for text, room in rooms.items():
        box = text.get_window_extent()
        length = box.height if text.get_rotation() else box.width
        if length > room:
            text.set_fontsize(max(float(text.get_fontsize()) * room / length, SMALLEST))
            changed = True
    return changed


def encoded(picture: NDArray[np.uint8]) -> bytes:
    """Write pixels as the bytes of a PNG file; most of it without the interpreter's lock.

    Each row is compressed as it is: Pillow tries all filters on it, which takes longer and makes
    larger files of lines on white.
    """
    height, width, _ = picture.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each begins with its filter: 0, none
    rows[:, 1:] = picture[:, :, :3].reshape(height, 3 * width)
    per_metre = round(DPI / 0.0254)
    chunks = {
        b"IHDR": struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0),  # 8 bits of each colour
        b"pHYs": struct.pack(">2IB", per_metre, per_metre, 1),
        b"IDAT": zlib.compress(rows.tobytes(), 1),
        b"IEND": b"",
    }
    whole = b"\x89PNG\r\n\x1a\n"
    for name, data in chunks.items():
        length, check = struct.pack(">I", len(data)), struct.pack(">I", zlib.crc32(name + data))
        whole += length + name + data + check
    return whole


class PowersOfTen(LogFormatter):
    """Labels of a logarithmic axis in plain letters: to typeset mathematics takes longer."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Write the label of a tick, empty where there would be too many."""
        if not super().__call__(x, pos):
            return ""
        factor, exponent = f"{x:.3e}".split("e")
        power = f"10{str(int(exponent)).translate(RAISED)}"
        return power if float(factor) == 1.0 else f"{float(factor):g}×{power}"


def zero_line(axes: Axes) -> None:
    """Draw the line of zero."""
    axes.axhline(0.0, color="black", linewidth=0.6)


def logarithmic(axes: Axes) -> None:
    """Make the vertical axis a logarithmic one."""
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(PowersOfTen())
    axes.yaxis.set_minor_formatter(PowersOfTen())


def tidy(axes: Axes, label: str = "") -> None:
    """Give axes a grid and room, no frame, and the label of their y axis."""
    if label:
        axes.set_ylabel(label)
    axes.grid(visible=True, color="#e2e5e9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.01)
    low, high = axes.get_ylim()
    if axes.get_yscale() == "linear" and high - low < 1e-6 * max(1.0, abs(high)):
        # a flat signal fills its axis with rounding errors unless it is given some room
        axes.set_ylim(low - 0.05 * max(abs(low), 0.1), high + 0.05 * max(abs(high), 0.1))
    if not np.isfinite((low, high)).all():
        axes.set_ylim(0.0, 1.0)
