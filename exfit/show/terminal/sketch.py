"""A small plot of measured against simulated, in the characters of a terminal.

Each is a braille cell of two by four dots. A package that plots would take as long to import as
most fits take.
"""

import math
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from rich.text import Text

from exfit.workflows.responses import LiveResponse

Array = NDArray[np.float64]
Dots = NDArray[np.bool_]

BRAILLE = 0x2800  # the cell without dots
DOT_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])  # by row and column
MEASURED, SIMULATED = "cyan", "bold red"  # of the terminal's own, readable on dark and light
LEAST_WIDTH, LEAST_HEIGHT = 45, 9  # characters: less is no plot
OTHER_LINES = 3  # lines beside the canvas: heading, axis, times
MARGIN = 0.05  # of the range, above and below
SMALLEST_RANGE = 1e-6  # pu: a range that is smaller shows rounding errors alone


def sketched(sketch: LiveResponse, width: int, height: int) -> list[Text]:
    """Return the lines of a plot of so many characters: what was measured and what is simulated.

    Where both lie in a character, it has the colour of the simulated one.
    """
    rows = height - OTHER_LINES
    low, high = _range(sketch)
    labels = [_label(level, high - low) for level in (high, 0.5 * (low + high), low)]
    margin = max(map(len, labels))
    columns = width - margin - 1
    measured = scattered(sketch.time, sketch.measured, (low, high), columns, rows)
    simulated = joined(sketch.time, sketch.simulated, (low, high), columns, rows)
    lines = [_heading(sketch, margin)]
    places = {0: labels[0], rows // 2: labels[1], rows - 1: labels[2]}
    codes = cells(measured | simulated)
    colours = _styles(measured, simulated)
    for row in range(rows):
        line = Text(f"{places.get(row, ''):>{margin}}┤", style="dim", no_wrap=True)
        if row not in places:
            line = Text(" " * margin + "│", style="dim", no_wrap=True)
        cell = zip(colours[row], codes[row], strict=True)
        for style, group in groupby(cell, key=lambda styled: styled[0]):
            # not the cell without dots: some fonts draw circles in their place
            text = "".join(chr(code) if code != BRAILLE else " " for _, code in group)
            line.append(text, style=style)
        lines.append(line)
    lines.append(Text(" " * margin + "└" + "─" * columns, style="dim", no_wrap=True))
    begin, end = f"{sketch.time[0]:.4g}", f"{sketch.time[-1]:.4g} s"
    between = " " * max(1, columns - len(begin) - len(end))
    lines.append(Text(" " * (margin + 1) + begin + between + end, style="dim", no_wrap=True))
    return lines


def scattered(
    time: Array, samples: Array, limits: tuple[float, float], columns: int, rows: int
) -> Dots:
    """Return the dots (4 rows, 2 columns) of samples (M,), each by itself."""
    dots = np.zeros((4 * rows, 2 * columns), dtype=bool)
    finite = np.isfinite(samples)
    across = (time[finite] - time[0]) / (time[-1] - time[0]) * (2 * columns - 1)
    dots[_down(samples[finite], limits, rows), np.rint(across).astype(int)] = True
    return dots


def joined(
    time: Array, samples: Array, limits: tuple[float, float], columns: int, rows: int
) -> Dots:
    """Return the dots (4 rows, 2 columns) of a line through samples (M,)."""
    dots = np.zeros((4 * rows, 2 * columns), dtype=bool)
    finite = np.isfinite(samples)
    if not finite.any():
        return dots
    instants = np.linspace(time[0], time[-1], 2 * columns)
    down = _down(np.interp(instants, time[finite], samples[finite]), limits, rows)
    before = np.concatenate([down[:1], down[:-1]])
    # each column reaches to where the one before it ends, and leaves that dot to it
    top = np.where(before < down, before + 1, down)
    bottom = np.where(before > down, before - 1, down)
    lines = np.arange(4 * rows)[:, None]
    return np.asarray((lines >= top) & (lines <= bottom))


def cells(dots: Dots) -> NDArray[np.int64]:
    """Return the characters (rows, columns), as numbers, of dots (4 rows, 2 columns)."""
    rows, columns = dots.shape[0] // 4, dots.shape[1] // 2
    parts = dots.reshape(rows, 4, columns, 2)
    return np.asarray(BRAILLE + np.einsum("rick,ik->rc", parts.astype(np.int64), DOT_BITS))


def _styles(measured: Dots, simulated: Dots) -> list[list[str]]:
    """Return the colour of each character, (rows, columns)."""
    has_simulated, has_measured = cells(simulated) != BRAILLE, cells(measured) != BRAILLE
    styles = np.where(has_simulated, SIMULATED, np.where(has_measured, MEASURED, ""))
    return [[str(style) for style in row] for row in styles]


def _down(samples: Array, limits: tuple[float, float], rows: int) -> NDArray[np.int64]:
    """Place samples: dots below the top."""
    low, high = limits
    place = (high - np.clip(samples, low, high)) / (high - low) * (4 * rows - 1)
    return np.rint(place).astype(np.int64)


def _range(sketch: LiveResponse) -> tuple[float, float]:
    """Return the levels at the bottom and the top."""
    both = np.concatenate([sketch.measured, sketch.simulated])
    finite = both[np.isfinite(both)]
    low, high = float(np.min(finite)), float(np.max(finite))
    room = MARGIN * max(high - low, SMALLEST_RANGE)
    return low - room, high + room


def _label(level: float, span: float) -> str:
    """Return a level in as many decimals as show a hundredth of the span, at most six."""
    return f"{level:.{min(max(0, math.ceil(2.0 - math.log10(span))), 6)}f}"


def _heading(sketch: LiveResponse, margin: int) -> Text:
    dot = chr(BRAILLE + 0x36)
    line = Text(" " * (margin + 1), no_wrap=True)
    line.append(f"{sketch.signal} (pu)   ", style="bold")
    line.append(f"{dot} measured   ", style=MEASURED)
    line.append(f"{dot} simulated", style=SIMULATED)
    return line
