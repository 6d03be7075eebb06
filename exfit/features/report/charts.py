"""Charts as data, and where their lines, ticks and labels lie: a template draws them as SVG.

matplotlib would take two seconds to be imported and to draw those of a report, these a tenth of
one; and their text follows the style sheet of the page, so that it can be read on a telephone.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np

from exfit.output.blocks import Chart, Panel, Range, Rule, Series
from exfit.util.arrays import Array

MILLI = 1e3
TALL, HALF, LOW = 170.0, 120.0, 72.0  # of panels: of signals, of gain and phase, of errors
BINS = 600  # segments of a line: about as many as a print or a screen shows
TIME = "time (s)"
LEVEL = Rule(0.0, style="level")
COLOURS, DASHES = 7, 3  # of lines in the style sheet
LEFT, RIGHT, TOP, BOTTOM = 74.0, 16.0, 30.0, 48.0  # room around the panels for their labels
SMALL = 300.0  # units of a drawing: a chart beside another one
ROOM = 0.06  # of the range, above and below the lines
NARROW = 0.05  # of its level: the range of a signal that rests
RESTS = 1e-6  # of its level: a signal that moves by less would fill its axis with rounding errors
LARGEST = 1e150  # a larger value is off every axis: the length of one to it would be infinite
LEAST_SPAN = 1e-250  # of a smaller range no tick could be computed
LEAST_LEVEL = 0.1  # pu: the level of a signal that rests at zero
PER_TICK = (80.0, 22.0)  # of an axis, across and upward: closer labels would touch
UNIT_STEPS = (1.0, 2.0, 5.0, 10.0)  # of ticks, times a power of ten


def line_style(k: int) -> str:
    """Return the class of the style sheet for the k-th line of a panel."""
    return f"p{k % COLOURS} dash{k // COLOURS % DASHES}"


@dataclass(frozen=True)
class Tick:
    """A mark of an axis: its place on the drawing, and its label."""

    at: float
    label: str


@dataclass(frozen=True)
class Mark:
    """A line on the drawing: the d of its path, its class."""

    path: str
    style: str


@dataclass(frozen=True)
class Label:
    """A text on the drawing."""

    x: float
    y: float
    text: str
    end: bool


@dataclass(frozen=True)
class Drawn:
    """A panel with places on the drawing, from its top left corner down and to the right."""

    title: str
    top: float
    height: float
    low: float
    high: float
    y_ticks: tuple[Tick, ...]
    marks: tuple[Mark, ...]
    rules: tuple[Mark, ...]
    labels: tuple[Label, ...]


@dataclass(frozen=True)
class Drawing:
    """A chart with places on the drawing."""

    chart: Chart
    height: float
    inner: float
    start: float
    end: float
    x_ticks: tuple[Tick, ...]
    panels: tuple[Drawn, ...]


@dataclass(frozen=True)
class Axis:
    """A range of values along a length of the drawing; a logarithmic one is of log10."""

    low: float
    high: float
    length: float
    logarithmic: bool = False

    def places(self, values: Array) -> Array:
        """Place values on the drawing: units from the low end of the axis."""
        placed = _log(values) if self.logarithmic else values
        with np.errstate(over="ignore"):
            return np.asarray((placed - self.low) / (self.high - self.low) * self.length)

    def place(self, value: float) -> float:
        """Place a value on the drawing: units from the low end of the axis."""
        return float(self.places(np.array([value]))[0])


def drawing(chart: Chart) -> Drawing:
    """Place all of a chart on its drawing."""
    inner = chart.width - LEFT - RIGHT
    lines = [series for panel in chart.panels for series in panel.series]
    x_range = chart.x_range or _span((series.x for series in lines), chart.logarithmic)
    across = Axis(*x_range, inner, chart.logarithmic)
    panels, top = [], TOP
    for panel in chart.panels:
        panels.append(_drawn(panel, across, top))
        top += panel.height + TOP
    height = top - TOP + BOTTOM
    most = max(3, int(inner // PER_TICK[0]))
    x_ticks = ticks(across, most, chart.whole)
    return Drawing(chart, height, inner, across.low, across.high, x_ticks, tuple(panels))


def ticks(axis: Axis, most: int, whole: bool = False) -> tuple[Tick, ...]:
    """Place marks at round values, about so many; on a logarithmic axis at powers of ten."""
    if axis.logarithmic:
        first, last = ceil(axis.low - 1e-9), floor(axis.high + 1e-9)
        powers = range(first, last + 1, max(1, ceil((last - first + 1) / most)))
        labels = {k: f"{10.0**k:g}" if -3 <= k <= 3 else f"1e{k}" for k in powers}
        return tuple(Tick(axis.place(10.0**k), label) for k, label in labels.items())
    for finer in (1, 2):  # one mark alone would give no scale
        least = (axis.high - axis.low) / (finer * most)
        power = 10.0 ** floor(log10(least))
        step = power * next(each for each in UNIT_STEPS if each * power >= least * (1.0 - 1e-9))
        step = max(step, 1.0) if whole else step
        first, last = ceil(axis.low / step - 1e-9), floor(axis.high / step + 1e-9)
        values = [k * step for k in range(first, last + 1)]
        if len(values) > 1:
            break
    return tuple(Tick(axis.place(value), _number(value, step)) for value in values)


def _drawn(panel: Panel, across: Axis, top: float) -> Drawn:
    levels = [series.y for series in panel.series]
    fixed = [np.array([rule.at]) for rule in panel.rules if not rule.upright]
    low, high = _span([*levels, *fixed], panel.logarithmic)
    room = ROOM * (high - low)
    upward = Axis(low - room, high + room, panel.height, panel.logarithmic)
    y_ticks = ticks(upward, max(3, int(panel.height // PER_TICK[1])))
    rules, labels = [], []
    for rule in panel.rules:
        if rule.upright:  # its label is at its foot, that of a level above it
            x = across.place(rule.at)
            end = x > 0.5 * across.length
            path, place = (
                f"M{x:.1f} 0v{panel.height:.1f}",
                (x - 5.0 if end else x + 5.0, panel.height - 7.0),
            )
        else:
            y, end = panel.height - upward.place(rule.at), True
            path, place = f"M0 {y:.1f}h{across.length:.1f}", (across.length - 4.0, y - 4.0)
        rules.append(Mark(path, rule.style))
        if rule.label:
            labels.append(Label(*place, rule.label, end))
    return Drawn(
        panel.title,
        top,
        panel.height,
        upward.low,
        upward.high,
        tuple(Tick(panel.height - tick.at, tick.label) for tick in y_ticks),
        tuple(_mark(series, across, upward) for series in panel.series),
        tuple(rules),
        tuple(labels),
    )


def _mark(series: Series, across: Axis, upward: Axis) -> Mark:
    """Draw dots, or the strokes of a line: a gap in the values is one on the drawing."""
    x, y = across.places(series.x), upward.length - upward.places(series.y)
    seen, path, pen = np.isfinite(x) & np.isfinite(y), list[str](), "M"
    for a, b, drawn in zip(x.tolist(), y.tolist(), seen.tolist(), strict=True):
        if drawn:
            path.append(f"M{a:.1f} {b:.1f}h0" if series.dots else f"{pen}{a:.1f} {b:.1f}")
        pen = "L" if drawn else "M"
    return Mark("".join(path), series.style + (" dots" if series.dots else ""))


def _span(lines: Iterable[Array], logarithmic: bool) -> Range:
    """Return the range of some lines, of their log10 on a logarithmic axis."""
    values = np.concatenate([*lines, np.zeros(0)])
    values = _log(values) if logarithmic else values
    values = values[np.abs(values) <= LARGEST]
    if not len(values):
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    level = max(abs(low), abs(high))
    if logarithmic and high - low < 1.0:
        return floor(low), floor(low) + max(1.0, ceil(high) - floor(low))
    if high - low <= max(RESTS * level, LEAST_SPAN):
        around = NARROW * max(level, LEAST_LEVEL)
        return low - around, high + around
    return low, high


def _log(values: Array) -> Array:
    """Return log10; what has none, as a vanished gradient, is a gap."""
    return np.log10(np.where(values > 0.0, values, np.nan))


def _number(value: float, step: float) -> str:
    """Return the label of a tick: enough decimals, or digits, to differ from its neighbours."""
    decimals = max(0, -floor(log10(step) + 1e-9))
    if decimals > 5 or abs(value) >= 1e6:
        digits = floor(log10(abs(value))) - floor(log10(step) + 1e-9) + 1 if value else 1
        return f"{value:.{max(digits, 3)}g}"
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text
