"""Axes whose ticks are drawn together: an object for each takes half the time of a figure."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis
from matplotlib.backend_bases import RendererBase
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FixedLocator, Formatter, LogFormatter, NullLocator
from matplotlib.transforms import Bbox, IdentityTransform
from numpy.typing import NDArray

Array = NDArray[np.float64]

MARK, SMALL_MARK = 3.5, 2.0  # points: length of a mark, major and minor
LINE = 0.8  # points: width of a mark
GAP = 3.5  # points between a mark and its number
LABEL_GAP = 4.0  # points between the numbers and the label of an axis
LETTERS = 10.0  # points: size of a number
OFFSET = 15.0  # points: height of what the numbers of an axis have in common, with the gaps
INSIDE = 0.5  # dots that a tick may lie beyond the end of its axis
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

Style = dict[str, Any]  # how the ticks of an axis are drawn, as Axis.set_tick_params says it


class PowersOfTen(LogFormatter):
    """Labels of a logarithmic axis in plain letters: to typeset mathematics takes longer."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a tick, empty where there would be too many."""
        if not super().__call__(x, pos):
            return ""
        factor, exponent = f"{x:.3e}".split("e")
        power = f"10{str(int(exponent)).translate(RAISED)}"
        return power if float(factor) == 1.0 else f"{float(factor):g}×{power}"


def dots_of(renderer: RendererBase, points: float) -> float:
    """Return a length in dots."""
    return float(np.asarray(renderer.points_to_pixels(points)))


@dataclass(frozen=True, eq=False)
class Ticks:
    """The ticks of an axis, major or minor: where they are, in dots, and what they say."""

    name: str  # of the axis
    box: Bbox  # of the axes
    at: Array
    labels: list[str]
    style: Style
    mark: float

    def boxes(self, renderer: RendererBase) -> list[Bbox]:
        """Return the boxes of the labels, in dots."""
        return [
            Bbox.from_bounds(x, baseline - descent, width, height)
            for _, x, baseline, (width, height, descent) in self._placed(renderer)
        ]

    def draw(self, renderer: RendererBase) -> None:
        """Draw the grid, the marks and the labels."""
        low = self._edge
        if self.style.get("gridOn"):
            high = self.box.y1 if self.name == "x" else self.box.x1
            self._lines(renderer, low, high, self.style["grid_color"], self.style["grid_linewidth"])
        length = dots_of(renderer, self.length)
        if length:
            self._lines(renderer, low - length, low, "black", LINE)
        gc, font = renderer.new_gc(), self._font
        height = renderer.get_canvas_width_height()[1]
        for label, x, baseline, _ in self._placed(renderer):
            y = height - baseline if renderer.flipy() else baseline
            renderer.draw_text(gc, x, y, label, font, 0.0)
        gc.restore()

    def _placed(
        self, renderer: RendererBase
    ) -> Iterator[tuple[str, float, float, tuple[float, float, float]]]:
        """Yield each label with the left end of its baseline, its width, height and descent."""
        if not self.style.get("label1On", True):
            return
        font = self._font
        end = self._edge - dots_of(renderer, self.length + GAP)
        for at, label in zip(self.at, self.labels, strict=True):
            if not label:
                continue
            size = renderer.get_text_width_height_descent(label, font, False)
            width, height, descent = size
            if self.name == "x":
                yield label, at - width / 2.0, end - (height - descent), size
            else:
                yield label, end - width, at - (height - descent) / 2.0, size

    def _lines(
        self, renderer: RendererBase, low: float, high: float, color: str, width: float
    ) -> None:
        """Draw a line at each tick, so many points wide, all at once."""
        along, across = np.repeat(self.at, 2), np.tile([low, high], len(self.at))
        points = (along, across) if self.name == "x" else (across, along)
        codes = np.tile([Path.MOVETO, Path.LINETO], len(self.at))
        gc = renderer.new_gc()
        gc.set_foreground(color)
        gc.set_linewidth(width)
        renderer.draw_path(gc, Path(np.column_stack(points), codes), IdentityTransform())
        gc.restore()

    @property
    def _edge(self) -> float:
        return float(self.box.y0 if self.name == "x" else self.box.x0)

    @property
    def length(self) -> float:
        """Length of the marks, points."""
        return float(self.style.get("size", self.mark)) if self.style.get("tick1On", True) else 0.0

    @property
    def _font(self) -> FontProperties:
        return FontProperties(size=self.style.get("labelsize", LETTERS))


@dataclass(frozen=True)
class Outside:
    """What lies beside axes, in dots: numbers and label of each axis, titles and other texts."""

    left: float
    left_label: float
    below: float
    below_label: float
    right: float
    above: float


class TicksTogether(Axis):
    """An axis with marks outside and labels at its lower or left end, drawn without objects."""

    axis_name: str
    _major_tick_kw: Style
    _minor_tick_kw: Style
    _translate_tick_params: Callable[[Style], Style]

    def set(self, **properties: Any) -> Any:
        """Set properties; without this Matplotlib writes a docstring for each class at import."""
        return self.update(properties)

    def set_tick_params(self, which: str = "major", reset: bool = False, **style: Any) -> None:
        """Set how marks, labels and grid are drawn."""
        own = self._translate_tick_params(style)
        for group, styles in (("major", self._major_tick_kw), ("minor", self._minor_tick_kw)):
            if which in (group, "both"):
                styles.update(own)
        self.offsetText.set_visible(self._major_tick_kw.get("label1On", True))
        self.stale = True

    def set_clip_path(self, path: Any, transform: Any = None) -> None:
        """Cut nothing off: the axis lies outside."""

    def reset_ticks(self) -> None:
        """Leave the ticks: they are no objects."""

    def get_majorticklabels(self) -> list[Text]:
        """Return the numbers as objects, which are made for this."""
        return [Text(text=label) for group in self._update_ticks()[:1] for label in group.labels]

    @property
    def ticks(self) -> list[Ticks]:
        """The ticks that are drawn."""
        return self._update_ticks() if self.get_visible() and self.axes.axison else []

    def boxes(self, ticks: Sequence[Ticks], renderer: RendererBase) -> list[Bbox]:
        """Return the boxes of the numbers, and of the axis with its marks, in dots."""
        frame = self.axes.bbox.frozen()
        mark = dots_of(renderer, max((group.length for group in ticks), default=0.0))
        marks = (mark, 0.0) if self.axis_name == "y" else (0.0, mark)
        marked = Bbox.from_extents(frame.x0 - marks[0], frame.y0 - marks[1], frame.x1, frame.y1)
        return [marked, *(box for group in ticks for box in group.boxes(renderer))]

    def label_height(self, renderer: RendererBase) -> float:
        """Return how far the label reaches from the numbers, with the gap before it, in dots."""
        if not (self.get_visible() and self.axes.axison and self.label.get_text()):
            return 0.0
        box = self.label.get_window_extent(renderer)
        length = box.height if self.axis_name == "x" else box.width
        return length + dots_of(renderer, LABEL_GAP)

    def _update_ticks(self) -> list[Ticks]:
        """Return the ticks within the axes."""
        major, minor = self.get_major_locator(), self.get_minor_locator()
        ticks = []
        if not isinstance(major, NullLocator):
            labels = self.get_major_formatter()
            ticks.append(self._ticks(self.get_majorticklocs(), labels, self._major_tick_kw, MARK))
        if not isinstance(minor, NullLocator):
            labels = self.get_minor_formatter()
            own = self._minor_tick_kw
            ticks.append(self._ticks(self.get_minorticklocs(), labels, own, SMALL_MARK))
        return ticks

    def _ticks(self, places: Array, formatter: Formatter, style: Style, mark: float) -> Ticks:
        labels = formatter.format_ticks(list(places))
        column, axes = "xy".index(self.axis_name), self.axes
        points = np.zeros((len(places), 2))
        points[:, column] = places
        transform = axes.get_xaxis_transform() if column == 0 else axes.get_yaxis_transform()
        dots = transform.transform(points)[:, column]
        low, high = (axes.bbox.intervalx, axes.bbox.intervaly)[column]
        inside = (dots >= low - INSIDE) & (dots <= high + INSIDE)
        labels = [label for label, drawn in zip(labels, inside, strict=True) if drawn]
        return Ticks(self.axis_name, axes.bbox, dots[inside], labels, style, mark)

    def _get_ticklabel_bboxes(
        self, ticks: list[Ticks], renderer: RendererBase
    ) -> tuple[list[Bbox], list[Bbox]]:
        """Return the boxes of the labels at the lower or left end, and none at the other."""
        return [box for group in ticks for box in group.boxes(renderer)], []

    def get_tick_space(self) -> int:
        """Return how many ticks there is room for."""
        across = self.axis_name == "x"
        length = self.axes.bbox.width if across else self.axes.bbox.height
        letters = self._major_tick_kw.get("labelsize", LETTERS)
        return int(length * 72.0 / self.axes.figure.dpi / (letters * (3.0 if across else 2.0)))

    def _get_ticks_position(self) -> int:
        """Return that the ticks are at the lower or left end."""
        return 1


class QuickXAxis(TicksTogether, XAxis):
    """The horizontal axis."""


class QuickYAxis(TicksTogether, YAxis):
    """The vertical axis."""


class QuickAxes(Axes):
    """Axes as all, but for the time that their ticks take."""

    xaxis: "QuickXAxis"
    yaxis: "QuickYAxis"

    def set(self, **properties: Any) -> Any:
        """Set properties; see TicksTogether."""
        return self.update(properties)

    def _init_axis(self) -> None:
        self.xaxis, self.yaxis = QuickXAxis(self, clear=False), QuickYAxis(self, clear=False)
        for name, axis in (
            ("bottom", self.xaxis),
            ("top", self.xaxis),
            ("left", self.yaxis),
            ("right", self.yaxis),
        ):
            self.spines[name].register_axis(axis)

    def clear(self) -> None:
        """Clear the axes."""
        super().clear()
        for spine in self.spines.values():
            spine.get_position()  # sets it: otherwise the first tick that is made does

    def _update_title_position(self, renderer: RendererBase) -> None:
        """Leave the titles where they are: no ticks are above the axes."""

    @property
    def ticks(self) -> tuple[list[Ticks], list[Ticks]]:
        """The ticks that are drawn, of the horizontal and of the vertical axis."""
        return self.xaxis.ticks, self.yaxis.ticks

    @property
    def titles(self) -> list[Text]:
        """The titles that are set."""
        texts = {self.get_title(loc=place) for place in ("left", "center", "right")} - {""}
        return [
            child
            for child in self.get_children()
            if isinstance(child, Text) and child.get_text() in texts
        ]

    def offset_height(self, renderer: RendererBase) -> float:
        """Return the height of what stands above the numbers, to be added to or times all."""
        written = self.yaxis.get_major_formatter().get_offset() and self.yaxis.get_visible()
        return dots_of(renderer, OFFSET) if written else 0.0

    def outside(self, ticks: tuple[list[Ticks], list[Ticks]], renderer: RendererBase) -> Outside:
        """Return the room that what is beside the axes needs, with these ticks."""
        frame = self.bbox
        across, upright = ticks
        boxes = [*self.xaxis.boxes(across, renderer), *self.yaxis.boxes(upright, renderer)]
        titles = self.titles
        boxes += [
            text.get_window_extent(renderer)
            for text in self.texts
            if text.get_text() and text.get_in_layout()
        ]
        tops = [box.y1 for box in (*boxes, *(text.get_window_extent(renderer) for text in titles))]
        return Outside(
            left=frame.x0 - min(box.x0 for box in boxes),
            left_label=self.yaxis.label_height(renderer),
            below=frame.y0 - min(box.y0 for box in boxes),
            below_label=self.xaxis.label_height(renderer),
            right=max(box.x1 for box in boxes) - frame.x1,
            above=max(max(tops) - frame.y1, self.offset_height(renderer)),
        )


def named(axis: Axis, places: Sequence[float], names: Sequence[str]) -> None:
    """Give an axis names at places, in the same order."""
    axis.set_major_locator(FixedLocator(places))
    axis.set_major_formatter(FixedFormatter(names))


def logarithmic(axes: Axes) -> None:
    """Make the vertical axis a logarithmic one."""
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(PowersOfTen())
    axes.yaxis.set_minor_formatter(PowersOfTen())
