"""A search while it runs."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import TaskID
from rich.table import Table
from rich.text import Text

from exfit.case import Case
from exfit.courses import Sketch
from exfit.estimate import Progress
from exfit.result import Iteration
from exfit.show.sketch import LEAST_HEIGHT, LEAST_WIDTH, sketched
from exfit.show.terminal import plain_table

LINES = 12  # of the history that stay in sight
FEWEST = 4  # of them beside a plot
TABLE = 64  # columns of the history
GAP = 2  # columns between the history and a plot beside it
AROUND = 5  # lines beside the history: title, what is hidden, names of columns, progress, cursor
HIGHEST = (20, 14)  # lines of a plot beside the history and below it
WIDEST = 100  # columns of a plot
SHARE = 0.03  # of the time of a fit: so much may be spent on showing it
HISTORY = ("it", "phase", "f", "|g|", "step", "damping", "inner", "nfev")


class Watch:
    """Shows the iterations of a fit as they come: a live table, or lines in a file or pipe.

    A terminal with room for it has a plot of the response beside the table or below it. ``most`` is
    the largest number of iterations of a phase.
    """

    def __init__(self, console: Console, title: str, most: int | None = None) -> None:
        self.console, self.title, self.most = console, title, most
        self.lines: list[Iteration] = []
        self._sketch: Sketch | None = None
        self._live: Live | None = None
        self._next = 0.0  # when it may be drawn again

    @contextmanager
    def running(self) -> Iterator["Watch"]:
        """Show the table for as long as the fit runs."""
        if not self.console.is_terminal:
            yield self
            return
        with Live(console=self.console, auto_refresh=False) as self._live:
            try:
                yield self
            finally:
                if self.lines:
                    self._live.update(self._picture(), refresh=True)

    @property
    def look(self) -> Callable[[Sketch], None] | None:
        """What is to be told the responses; None where they would not be shown."""
        shows = self.console.is_terminal and not self.console.options.ascii_only
        return self._keep if shows else None

    def _keep(self, sketch: Sketch) -> None:
        self._sketch = sketch

    def __call__(self, line: Iteration) -> None:
        """Show one more iteration."""
        self.lines.append(line)
        if len(self.lines) == 1:
            self.console.print(self.title, markup=False)
        if self._live is None:
            heading = "{:>4} {:5} {:>10} {:>9} {:>9} {:>9} {:>5} {:>5}"
            if len(self.lines) == 1:
                self.console.print(heading.format(*HISTORY), soft_wrap=True)
            self.console.print(heading.format(*_cells(line)), soft_wrap=True)
        else:
            self._draw(self._live)

    def _draw(self, live: Live) -> None:
        """Draw, unless that was done so lately that it would slow down the fit."""
        began = time.perf_counter()
        if began < self._next:
            return
        live.update(self._picture(), refresh=True)
        ended = time.perf_counter()
        self._next = ended + (ended - began) / SHARE

    def _picture(self) -> RenderableType:
        """Return the table, and the plot where there is room for it: beside or below."""
        width, height = self.console.size
        free, beside, below = height - AROUND, width - TABLE - GAP, height - AROUND - FEWEST
        high = max(1, min(free, LINES))
        if self._sketch is not None and beside >= LEAST_WIDTH and free >= LEAST_HEIGHT:
            grid = Table.grid(padding=(0, GAP, 0, 0))
            lines = sketched(self._sketch, min(beside, WIDEST), min(free, HIGHEST[0]))
            grid.add_row(self._table(high), Text("\n").join(lines))
            return Group(grid, self._progress())
        if self._sketch is not None and below >= LEAST_HEIGHT and width >= LEAST_WIDTH:
            lines = sketched(self._sketch, min(width - 1, WIDEST), min(below, HIGHEST[1]))
            rows = min(free - len(lines), LINES)
            return Group(self._table(rows), self._progress(), *lines)
        return Group(self._table(high), self._progress())

    def _table(self, rows: int) -> RenderableType:
        table = plain_table(*HISTORY, numbers=[name for name in HISTORY if name != "phase"])
        for line in self.lines[-rows:]:
            table.add_row(*_cells(line))
        hidden = len(self.lines) - rows
        above = Text(f"({hidden} earlier iterations)", style="dim") if hidden > 0 else Text("")
        return Group(above, table)

    def _progress(self) -> Text:
        first, last = self.lines[0], self.lines[-1]
        limit = "" if self.most is None else f" (at most {self.most} a phase)"
        share = last.cost / first.cost if first.cost > 0.0 else 1.0
        cost = f"cost {last.cost:.4e}, {100.0 * share:.3g} % of the start's"
        text = f"iteration {last.number}{limit}: {cost}"
        return Text(text, style="dim", no_wrap=True, overflow="ellipsis")


def _cells(line: Iteration) -> tuple[str, ...]:
    return (
        str(line.number),
        line.phase,
        f"{line.cost:.4e}",
        f"{line.gradient_norm:.2e}",
        f"{line.step_norm:.2e}",
        f"{line.damping:.2e}" if line.damping == line.damping else "-",
        str(line.inner),
        str(line.nfev),
    )


def task(case: Case, strategy: str | None) -> str:
    """Return what a fit is about to do."""
    free = ", ".join(case.free())
    return f"{case.path.stem}: {case.subject}, {strategy or case.estimate.strategy}; free {free}"


class Bar:
    """Shows how far many searches are, with the time left; in a file or pipe a line at the end."""

    def __init__(self, console: Console) -> None:
        self.console = console

    @contextmanager
    def running(self) -> Iterator[Callable[[Progress], None]]:
        """Return what is to be told the progress."""
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

            def tell(now: Progress) -> None:
                if now.stage not in tasks:
                    tasks[now.stage] = bars.add_task(now.stage, total=now.total, best=now.best)
                bars.update(tasks[now.stage], completed=now.done, best=now.best)

            yield tell
