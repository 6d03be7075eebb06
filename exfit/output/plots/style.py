"""How all figures look, and how one becomes a file."""

import io

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

MEASURED, SIMULATED, START, LIMIT = "#8a8f98", "#c1272d", "#2b6cb0", "#b7791f"
GREEN = "#2f855a"
WIDTH = 9.0  # inches
DPI = 120
MILLI = 1e3
COLORS = ("#1f4e9c", "#c1272d", GREEN, "#b7791f", "#6b46c1", "#0e7490", "#4a5568")
STYLES = ("-", "--", ":")


def png(figure: Figure) -> bytes:
    """Return a figure as the bytes of a PNG file."""
    out = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(out, format="png", dpi=DPI)
    return out.getvalue()


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
