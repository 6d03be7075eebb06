"""Searches while they run: iterations, further starts, profiles, fits of several cases."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from itertools import groupby, zip_longest
from threading import Event, Thread
from typing import Self

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.live import Live
from rich.progress import TaskID
from rich.text import Text

from exfit.case.case import Case
from exfit.estimate import Progress
from exfit.output.iterations import COLUMNS, IterationColumn
from exfit.output.terminal import paragraph
from exfit.results.model import Iteration
from exfit.results.verdict import MATCHES, MISSES
from exfit.runs.fits import FitRun, PlannedFit
from exfit.runs.fits import Progress as ProgressOfFit
from exfit.util.arrays import Array
from exfit.workflows.responses import LiveResponse

Dots = NDArray[np.bool_]

MOST_ITERATIONS = 12  # shown at a time
FEWEST_ITERATIONS = 4  # beside a plot
HISTORY_WIDTH = 72  # characters of the history beside a plot
BETWEEN_COLUMNS = 2  # characters between the history and a plot beside it
OTHER_LINES = 6  # beside the history: title, what is hidden, two of names, progress, cursor
PLOT_HEIGHTS = (20, 14)  # lines of a plot beside the history and below it
PLOT_WIDTH = 100  # characters at most
SHARE_OF_TIME = 0.03  # of the time of a fit: so much may be spent on showing it
QUIET = 4.0  # s: after so long without a line one says that the fit goes on
STAGES = {
    "screening": ("screening", "points"),
    "refining": ("search", "further starts"),
    "profiling": ("profiles", "sides"),
    "weighing": ("weighting by noise", "passes"),
    "causes": ("causes", "tried"),
}  # in words, and what is counted

BRAILLE = 0x2800  # the cell without dots
DOT_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])  # by row and column
MEASURED, SIMULATED = "cyan", "bold red"  # of the terminal's own, readable on dark and light
LEAST_WIDTH, LEAST_HEIGHT = 45, 9  # characters: less is no plot
LINES_BESIDE = 3  # beside the canvas: heading, axis, times
MARGIN = 0.05  # of the range, above and below
SMALLEST_RANGE = 1e-6  # pu: a range that is smaller shows rounding errors alone

HEADS = ("fit", "it", "f", "rmse", "s", "")
FORMS = ("{:>4}", "{:>10}", "{:>10}", "{:>7}", "{:<13}")  # behind the name
MOST_OF_NAME = 28  # characters: the line has then 80
DESCENTS_ALONE = "each fit is one run from the start of its case: --search global makes more"
BRIEF = {MATCHES: "matches", MISSES: "misses"}  # what a line has no room for


class LiveIterations:
    """Shows the iterations of a fit as they come: a live table, or lines in a file or pipe.

    Where nothing comes for some seconds, how long the fit has taken is shown all the same. A
    terminal with room for it has a plot of the response beside the table or below it. ``most`` is
    the largest number of iterations of a phase, or of each phase by name.
    """

    def __init__(
        self, console: Console, title: str, most: int | Mapping[str, int] | None = None
    ) -> None:
        self.console, self.title, self.most = console, title, most
        self.lines: list[Iteration] = []
        self._titled = False
        self._sketch: LiveResponse | None = None
        self._live: Live | None = None
        self._starts: Progress | None = None
        self._next = 0.0  # when it may be drawn again
        self._began = self._shown = time.monotonic()

    @contextmanager
    def running(self) -> Iterator["LiveIterations"]:
        """Show the table for as long as the fit runs."""
        live = Live(console=self.console, auto_refresh=False) if self.console.is_terminal else None
        ended = Event()
        waiting = Thread(target=self._wait, args=(ended,), daemon=True)
        with live or nullcontext() as self._live:
            waiting.start()
            try:
                yield self
            finally:
                ended.set()
                waiting.join()
                if self._live is not None and self._titled:
                    self._live.update(self.picture() if self.lines else "", refresh=True)

    def _wait(self, ended: Event) -> None:
        """Show how long the fit has taken whenever nothing else was shown for a while."""
        with suppress(OSError):  # an output that is lost is the command's to report
            while not ended.wait(max(self._shown + QUIET - time.monotonic(), 0.0)):
                if time.monotonic() - self._shown < QUIET:
                    continue
                self._entitle()
                if self._live is None:
                    self._print(self._progress().plain)
                else:
                    shown = self.picture() if self.lines else self._progress()
                    self._live.update(shown, refresh=True)
                self._shown = time.monotonic()

    def _entitle(self) -> None:
        """Show the title, unless that was done."""
        if not self._titled:
            self._titled = True
            paragraph(self.console, self.title)

    def _print(self, line: str) -> None:
        self._shown = time.monotonic()
        self.console.print(line, soft_wrap=True)

    @property
    def live(self) -> Callable[[LiveResponse], None] | None:
        """What takes the responses; None where they would not be shown."""
        shows = self.console.is_terminal and not self.console.options.ascii_only
        return self._keep if shows else None

    def _keep(self, sketch: LiveResponse) -> None:
        self._sketch = sketch

    def __call__(self, iteration: Iteration) -> None:
        """Show one more iteration."""
        self.lines.append(iteration)
        self._entitle()
        if self._live is not None:
            self._draw(self._live)

    def starts(self, progress: Progress) -> None:
        """Show how far what follows the iterations is: further starts, profiles, causes.

        A file or pipe has a line at its beginning, where that is announced, and at its end.
        """
        before, self._starts = self._starts, progress
        if self._live is not None:
            self._draw(self._live)
            return
        begins = progress.done == 0 and (before is None or before.stage != progress.stage)
        if begins or progress.done == progress.total:
            self._print(_of_search(progress))

    def _draw(self, live: Live) -> None:
        """Draw, unless that was done so lately that it would slow down the fit."""
        began = time.perf_counter()
        if began < self._next:
            return
        live.update(self.picture(), refresh=True)
        self._shown = time.monotonic()
        ended = time.perf_counter()
        self._next = ended + (ended - began) / SHARE_OF_TIME

    def picture(self) -> Text:
        """Return the table, and the plot where there is room for it: beside or below."""
        width, height = self.console.size
        free, beside, below = (
            height - OTHER_LINES,
            width - HISTORY_WIDTH - BETWEEN_COLUMNS,
            height - OTHER_LINES - FEWEST_ITERATIONS,
        )
        if self._sketch is not None and beside >= LEAST_WIDTH and free >= LEAST_HEIGHT:
            plot = sketched(self._sketch, min(beside, PLOT_WIDTH), min(free, PLOT_HEIGHTS[0]))
            table = [
                Text(line.plain.ljust(HISTORY_WIDTH + BETWEEN_COLUMNS), line.style)
                for line in self._table(free, HISTORY_WIDTH)
            ]
            blank = Text(" " * (HISTORY_WIDTH + BETWEEN_COLUMNS))
            both = zip_longest(table, plot)
            lines = [(left or blank) + (right or Text()) for left, right in both]
            return _joined([*lines, self._progress()])
        if self._sketch is not None and below >= LEAST_HEIGHT and width > LEAST_WIDTH:
            plot = sketched(self._sketch, min(width - 1, PLOT_WIDTH), min(below, PLOT_HEIGHTS[1]))
            return _joined([*self._table(free - len(plot), width), self._progress(), *plot])
        return _joined([*self._table(max(free, 1), width), self._progress()])

    def _table(self, room: int, width: int) -> list[Text]:
        """Return the last lines of the history, in no more than so many beside its head.

        It has the columns that there is room for: none is cut in two.
        """
        rows, count = min(room, MOST_ITERATIONS), 1
        while (
            count < len(COLUMNS)
            and sum(each.width + 1 for each in COLUMNS[: count + 1]) <= width + 1
        ):
            count += 1
        hidden, columns = len(self.lines) - rows, COLUMNS[:count]
        titles = [["", *column.heading.splitlines()][-2:] for column in columns]
        return [
            Text(f"({hidden} earlier iterations)" if hidden > 0 else "", style="dim"),
            *(Text(_row(columns, words), style="bold") for words in zip(*titles, strict=True)),
            *(
                Text(_row(columns, [column.text(line) for column in columns]))
                for line in self.lines[-rows:]
            ),
        ]

    def _progress(self) -> Text:
        seconds = time.monotonic() - self._began
        if not self.lines:
            return Text(f"before the first iteration, {seconds:.0f} s", style="dim")
        first, last, limit = self.lines[0], self.lines[-1], ""
        if isinstance(self.most, int):
            limit = f" (at most {self.most} a phase)"
        elif self.most is not None:
            counts = ", ".join(f"{count} {phase}" for phase, count in self.most.items())
            limit = f" (at most {counts})"
        share = last.cost / first.cost if first.cost > 0.0 else 1.0
        cost = f"cost {last.cost:.4e}, {100.0 * share:.3g} % of the start's"
        text = f"iteration {last.number}{limit}: {cost}"
        text = text if self._starts is None else _of_search(self._starts)
        return Text(f"{text}, {seconds:.0f} s" if seconds >= QUIET else text, style="dim")


def _of_search(progress: Progress) -> str:
    stage, counted = STAGES[progress.stage]
    done = f"{stage}: {progress.done} of {progress.total} {counted}"
    return f"{done}, lowest cost {progress.best:.4e}"


def _joined(lines: Iterable[Text]) -> Text:
    """Return lines below each other; what is wider than the terminal is cut off."""
    text = Text("\n").join(lines)
    text.no_wrap, text.overflow = True, "crop"
    return text


def _row(columns: Sequence[IterationColumn], texts: Sequence[str]) -> str:
    """Write a line of the history, each text below the title of its column."""
    cells = (
        text.rjust(column.width) if column.number else text.ljust(column.width)
        for column, text in zip(columns, texts, strict=True)
    )
    return " ".join(cells)


def task(case: Case, strategy: str | None) -> str:
    """Describe the fit that begins."""
    free = ", ".join(case.free())
    return f"{case.path.stem}: {case.subject}, {strategy or case.estimate.strategy}; free {free}"


class ProgressBar:
    """Shows how far many searches are, with the time left; in a file or pipe a line at the end."""

    def __init__(self, console: Console) -> None:
        self.console = console

    @contextmanager
    def running(self) -> Iterator[Callable[[Progress], None]]:
        """Show a bar, and give the function that takes the progress."""
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        columns = (
            TextColumn("{task.description:<10}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("best cost {task.fields[best]:.4e}"),
        )
        with Bars(*columns, console=self.console) as bars:
            tasks: dict[str, TaskID] = {}

            def show(now: Progress) -> None:
                if now.stage not in tasks:
                    tasks[now.stage] = bars.add_task(now.stage, total=now.total, best=now.best)
                bars.update(tasks[now.stage], completed=now.done, best=now.best)

            yield show


class RunLines:
    """Shows runs as they end, a line for each; a terminal has the one that runs below them.

    ``forms`` are those of the cells behind the name, which has ``width`` characters at most.
    """

    def __init__(
        self, console: Console, heads: Sequence[str], forms: Sequence[str], width: int, count: int
    ) -> None:
        self.console, self.heads, self.forms = console, heads, forms
        self.width, self.count = width, count
        self.done, self._shown = 0, ""
        self._live: Live | None = None

    @contextmanager
    def running(self) -> Iterator[Self]:
        """Show the lines for as long as the runs last."""
        self.line(self.heads, "bold")
        if not self.console.is_terminal:
            yield self
            return
        with Live(console=self.console, transient=True) as self._live:
            yield self

    def show(self, name: str, state: str) -> None:
        """Show below the lines what a run is at; at once where it is another one than before."""
        if self._live is not None:
            text = f"{self.done + 1} of {self.count}: {name}, {state}"
            self._live.update(Text(text, "dim"), refresh=name != self._shown)
            self._shown = name

    def line(self, cells: Sequence[str], style: str = "") -> None:
        """Print a line."""
        name = cells[0]
        if len(name) > self.width:
            name = f"…{name[1 - self.width :]}"
        others = (form.format(cell) for form, cell in zip(self.forms, cells[1:], strict=True))
        text = " ".join([f"{name:<{self.width}}", *others]).rstrip()
        self.console.print(Text(text, style), soft_wrap=True)


class SeriesProgress(RunLines):
    """The fits of a series, each as it ends."""

    def __init__(self, console: Console, plan: Sequence[PlannedFit]) -> None:
        width = min(max(len(fit.name) for fit in plan), MOST_OF_NAME)
        super().__init__(console, HEADS, FORMS, width, len(plan))
        if any(fit.search == "local" for fit in plan):
            paragraph(console, DESCENTS_ALONE)

    def __call__(self, fit: PlannedFit, progress: ProgressOfFit) -> None:
        """Show how far the fit that runs is."""
        self.show(fit.name, progress_words(progress))

    def finished(self, run: FitRun) -> None:
        """Show a fit that has ended."""
        result, outcome = run.result, run.verdict
        numbers = (f"{result.cost:.4e}", f"{result.rmse:.4e}", f"{result.seconds:.2f}")
        cells = (run.name, f"{result.nit}", *numbers, BRIEF.get(outcome, outcome))
        self.line(cells, "" if run.holds else "yellow")
        self.show(run.name, "writing numbers")
        self.done += 1


def progress_words(progress: ProgressOfFit) -> str:
    """Describe the progress of a fit."""
    if isinstance(progress, Iteration):
        return f"iteration {progress.number}, f {progress.cost:.4e}"
    return f"{progress.stage} {progress.done} of {progress.total}, best f {progress.best:.4e}"


def sketched(sketch: LiveResponse, width: int, height: int) -> list[Text]:
    """Plot what was measured and what is simulated, in so many characters of a terminal.

    Each is a braille cell of two by four dots. Where both lie in one, it has the colour of the
    simulated one. A package that plots would take as long to import as most fits take.
    """
    rows = height - LINES_BESIDE
    both = np.concatenate([sketch.measured, sketch.simulated])
    finite = both[np.isfinite(both)]
    low, high = float(np.min(finite)), float(np.max(finite))
    room = MARGIN * max(high - low, SMALLEST_RANGE)
    low, high = low - room, high + room
    # as many decimals as show a hundredth of the range, at most six
    decimals = min(max(0, math.ceil(2.0 - math.log10(high - low))), 6)
    labels = [f"{level:.{decimals}f}" for level in (high, 0.5 * (low + high), low)]
    places = {0: labels[0], rows // 2: labels[1], rows - 1: labels[2]}
    margin = max(map(len, labels))
    columns = width - margin - 1
    measured = scattered(sketch.time, sketch.measured, (low, high), columns, rows)
    simulated = joined(sketch.time, sketch.simulated, (low, high), columns, rows)
    codes, has_measured = cells(measured | simulated), cells(measured) != BRAILLE
    styles = np.where(has_measured, MEASURED, "")
    styles = np.where(cells(simulated) != BRAILLE, SIMULATED, styles)
    dot = chr(BRAILLE + 0x36)
    head = Text(" " * (margin + 1), no_wrap=True)
    head.append(f"{sketch.signal} (pu)   ", style="bold")
    head.append(f"{dot} measured   ", style=MEASURED)
    head.append(f"{dot} simulated", style=SIMULATED)
    lines = [head]
    for row in range(rows):
        axis = f"{places[row]:>{margin}}┤" if row in places else " " * margin + "│"
        line = Text(axis, style="dim", no_wrap=True)
        cell = zip(styles[row].tolist(), codes[row].tolist(), strict=True)
        for style, group in groupby(cell, key=lambda styled: styled[0]):
            # not the cell without dots: some fonts draw circles in their place
            text = "".join(chr(code) if code != BRAILLE else " " for _, code in group)
            line.append(text, style=style)
        lines.append(line)
    begin, end = f"{sketch.time[0]:.4g}", f"{sketch.time[-1]:.4g} s"
    between = " " * max(1, columns - len(begin) - len(end))
    for foot in ("└" + "─" * columns, f" {begin}{between}{end}"):
        lines.append(Text(" " * margin + foot, style="dim", no_wrap=True))
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


def _down(samples: Array, limits: tuple[float, float], rows: int) -> NDArray[np.int64]:
    """Place samples: dots below the top."""
    low, high = limits
    place = (high - np.clip(samples, low, high)) / (high - low) * (4 * rows - 1)
    return np.rint(place).astype(np.int64)
