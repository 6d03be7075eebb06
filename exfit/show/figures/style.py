"""How all figures look, and how one becomes a file."""

import warnings
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

from exfit.show.figures.axes import QuickAxes
from exfit.show.figures.layout import Layout
from exfit.show.figures.page import as_png, pixels

MEASURED, SIMULATED, START, LIMIT = "#8a8f98", "#c1272d", "#2b6cb0", "#b7791f"
GREEN = "#2f855a"
WIDTH = 9.0  # inches
DPI = 120
MILLI = 1e3
LONGEST_NAME = 20  # letters
COLORS = ("#1f4e9c", "#c1272d", GREEN, "#b7791f", "#6b46c1", "#0e7490", "#4a5568")
STYLES = ("-", "--", ":")


def new_figure(height: float, width: float = WIDTH, legend: str = "below") -> Figure:
    """Return an empty figure of a size in inches; a legend of the whole is right or below."""
    return Figure(figsize=(width, height), layout=Layout(legend))


def panels(figure: Figure, rows: int, columns: int = 1, **grid: Any) -> NDArray[np.object_]:
    """Return axes of a figure in rows and columns; see Figure.subplots."""
    own = {"axes_class": QuickAxes}
    return np.asarray(figure.subplots(rows, columns, squeeze=False, subplot_kw=own, **grid))


def short(name: str, most: int = LONGEST_NAME) -> str:
    """Return a name, cut off where it has more letters than there is room for."""
    return name if len(name) <= most else name[: most - 1] + "…"


def png(figure: Figure) -> bytes:
    """Return a figure as the bytes of a PNG file."""
    return encoded(drawn(figure))


def drawn(figure: Figure) -> NDArray[np.uint8]:
    """Return the pixels of a figure: rows of red, green, blue and opacity.

    Dollar signs in names make no formulas; letters that the font lacks are boxes.
    """
    for text in figure.findobj(Text):
        text.set_parse_math("$" not in text.get_text())
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
        return pixels(figure, DPI)


def encoded(picture: NDArray[np.uint8]) -> bytes:
    """Return pixels as the bytes of a PNG file; most of it without the interpreter's lock."""
    return as_png(picture, DPI)


def tidy(axes: Axes) -> None:
    """Give axes a grid and room, and no frame."""
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
