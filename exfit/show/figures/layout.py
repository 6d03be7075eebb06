"""Where the axes of a figure are: as large as their labels leave room for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.layout_engine import LayoutEngine
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from numpy.typing import ArrayLike, NDArray

from exfit.show.figures.axes import LABEL_GAP, Outside, QuickAxes, Ticks, dots_of
from exfit.show.figures.page import PageRenderer

Array = NDArray[np.float64]

PAD = 5.0  # points: around the figure, and between what is beside each other
MOST_PASSES = 3  # the numbers of an axis depend on its length
SMALLEST = 6.0  # points: letters of a title that is made to fit


@dataclass
class Room:
    """What is left of a figure, in dots."""

    left: float
    right: float
    bottom: float
    top: float


class Layout(LayoutEngine):
    """Gives all axes of a figure the room that its titles, labels and legend leave.

    The legend is on the ``legend`` side: right or below. In place of Matplotlib's own engine, which
    takes twice as long as the drawing.
    """

    _adjust_compatible = False
    _colorbar_gridspec = False

    def __init__(self, legend: str = "below") -> None:
        super().__init__()
        self.legend = legend

    def execute(self, fig: Figure) -> None:
        """Place titles, legend and axes of a figure."""
        renderer, pad = PageRenderer(1.0, 1.0, fig.dpi), PAD * fig.dpi / 72.0
        room = Room(pad, fig.bbox.width - pad, pad, fig.bbox.height - pad)
        _place_titles(fig, room, renderer)
        self._place_legend(fig, room, renderer)
        panels = [axes for axes in fig.axes if isinstance(axes, QuickAxes)]
        ticks = [axes.ticks for axes in panels]
        for _ in range(MOST_PASSES if panels else 0):
            outsides = [
                axes.outside(own, renderer) for axes, own in zip(panels, ticks, strict=True)
            ]
            _place(fig, panels, outsides, room, renderer)
            former, ticks = ticks, [axes.ticks for axes in panels]
            if _numbers(ticks) == _numbers(former):
                break

    def _place_legend(self, fig: Figure, room: Room, renderer: PageRenderer) -> None:
        pad = dots_of(renderer, PAD)
        for legend in fig.legends:
            box = legend.get_window_extent(renderer)
            right = room.right / fig.bbox.width
            if self.legend == "right":
                legend.set_loc("upper right")
                legend.set_bbox_to_anchor((right, room.top / fig.bbox.height))
                room.right -= box.width + pad
            else:
                legend.set_loc("lower right")
                legend.set_bbox_to_anchor((right, room.bottom / fig.bbox.height))
                room.bottom += box.height + pad


def _place_titles(fig: Figure, room: Room, renderer: PageRenderer) -> None:
    """Place the title above, and what is written below or to the left of all axes."""
    width, height, pad = fig.bbox.width, fig.bbox.height, dots_of(renderer, PAD)
    for text in fig.texts:
        _fit(text, (height if text.get_rotation() else width) - 2.0 * pad, renderer)
        box = text.get_window_extent(renderer)
        if text.get_rotation():
            text.set_position((room.left / width, 0.5))
            room.left += box.width + pad
        elif text.get_position()[1] > 0.5:
            text.set_position((0.5, room.top / height))
            room.top -= box.height + pad
        else:
            text.set_position((0.5, room.bottom / height))
            room.bottom += box.height + pad


def _numbers(ticks: Sequence[tuple[list[Ticks], list[Ticks]]]) -> list[list[str]]:
    """Return what the ticks of axes say."""
    return [group.labels for both in ticks for groups in both for group in groups]


def _place(
    fig: Figure,
    panels: Sequence[QuickAxes],
    outsides: Sequence[Outside],
    room: Room,
    renderer: PageRenderer,
) -> None:
    """Place the axes of a grid by what is beside them, the labels of a column or row in line."""
    placed = [
        (axes, spec, outside)
        for axes, outside in zip(panels, outsides, strict=True)
        if (spec := axes.get_subplotspec()) is not None
    ]
    grid = placed[0][1].get_gridspec()
    left, left_label, right = np.zeros((3, grid.ncols))
    above, below, below_label = np.zeros((3, grid.nrows))
    for _, spec, outside in placed:
        first, last = spec.colspan[0], spec.colspan[-1]
        upper, lower = spec.rowspan[0], spec.rowspan[-1]
        for most, place, needed in (
            (left, first, outside.left),
            (left_label, first, outside.left_label),
            (right, last, outside.right),
            (above, upper, outside.above),
            (below, lower, outside.below),
            (below_label, lower, outside.below_label),
        ):
            most[place] = max(most[place], needed)
    pad = dots_of(renderer, PAD)
    x0, x1 = _spans(room.right - room.left, left + left_label, right, grid.get_width_ratios(), pad)
    y1, y0 = _spans(
        room.top - room.bottom, above, below + below_label, grid.get_height_ratios(), pad
    )
    x0, x1, y0, y1 = room.left + x0, room.left + x1, room.top - y0, room.top - y1
    gap = dots_of(renderer, LABEL_GAP)
    for axes, spec, _ in placed:
        first, last = spec.colspan[0], spec.colspan[-1]
        upper, lower = spec.rowspan[0], spec.rowspan[-1]
        box = Bbox([[x0[first], y0[lower]], [x1[last], y1[upper]]])
        axes.set_position(box.transformed(fig.transFigure.inverted()))
        axes.yaxis.set_label_coords(-(left[first] + gap) / box.width, 0.5)
        axes.xaxis.set_label_coords(0.5, -(below[lower] + gap) / box.height)
        for title in axes.titles:
            title.set_y(1.0 + axes.offset_height(renderer) / box.height)
            _fit(title, box.width, renderer)


def _fit(text: Text, most: float, renderer: RendererBase) -> None:
    """Make the letters of a text as small as its room asks for, as long as they are readable."""
    box = text.get_window_extent(renderer)
    length = box.height if text.get_rotation() else box.width
    if length > most:
        text.set_fontsize(max(float(text.get_fontsize()) * most / length, SMALLEST))


def _spans(
    length: float, before: Array, after: Array, ratios: ArrayLike, pad: float
) -> tuple[Array, Array]:
    """Return where columns of axes begin and end, each between what it needs before and after."""
    free = length - before.sum() - after.sum() - pad * (len(before) - 1)
    shares = np.asarray(ratios, dtype=float)
    widths = free * shares / shares.sum()
    ends = np.cumsum(before + widths + after + pad) - pad - after
    return ends - widths, ends
