"""A search while it runs."""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from itertools import zip_longest
from threading import Event, Thread

from rich.console import Console
from rich.live import Live
from rich.progress import TaskID
from rich.text import Text

from exfit.case.case import Case
from exfit.estimate import Progress
from exfit.results.model import Iteration
from exfit.results.tables import yes_or_no
from exfit.show.terminal.sketch import LEAST_HEIGHT, LEAST_WIDTH, sketched
from exfit.show.terminal.terminal import paragraph
from exfit.workflows.responses import LiveResponse

MOST_ITERATIONS = 12  # shown at a time
FEWEST_ITERATIONS = 4  # beside a plot
HISTORY_WIDTH = 70  # characters of the history
BETWEEN_COLUMNS = 2  # characters between the history and a plot beside it
OTHER_LINES = 5  # beside the history: title, what is hidden, names of columns, progress, cursor
PLOT_HEIGHTS = (20, 14)  # lines of a plot beside the history and below it
PLOT_WIDTH = 100  # characters at most
SHARE_OF_TIME = 0.03  # of the time of a fit: so much may be spent on showing it
QUIET = 5.0  # s: after so long without a line one says that the fit goes on
FORMATS = ("{:>4}", "{:5}", "{:>10}", "{:>9}", "{:>9}", "{:>9}", "{:>6}", "{:>5}", "{:>5}")
STAGES = {
    "screening": ("screening", "points"),
    "refining": ("search", "further starts"),
    "profiling": ("profiles", "sides"),
    "weighing": ("weighing by noise", "passes"),
    "causes": ("causes", "tried"),
}  # in words, and what is counted
HISTORY = ("it", "phase", "f", "|g|", "step", "damping", "capped", "inner", "nfev")


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
                if self._live is not None and self.lines:
                    self._live.update(self.picture(), refresh=True)

    def _wait(self, ended: Event) -> None:
        """Show how long the fit has taken whenever nothing else was shown for a while."""
        with suppress(OSError):  # an output that is lost is the command's to report
            while not ended.wait(max(self._shown + QUIET - time.monotonic(), 0.0)):
                if time.monotonic() - self._shown < QUIET:
                    continue
                if self._live is None:
                    self._print(self._progress().plain if self.lines else self.title)
                elif self.lines:
                    self._live.update(self.picture(), refresh=True)
                self._shown = time.monotonic()

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
        if len(self.lines) == 1:
            paragraph(self.console, self.title)
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
                for line in self._table(free)
            ]
            blank = Text(" " * (HISTORY_WIDTH + BETWEEN_COLUMNS))
            both = zip_longest(table, plot)
            lines = [(left or blank) + (right or Text()) for left, right in both]
            return _joined([*lines, self._progress()])
        if self._sketch is not None and below >= LEAST_HEIGHT and width > LEAST_WIDTH:
            plot = sketched(self._sketch, min(width - 1, PLOT_WIDTH), min(below, PLOT_HEIGHTS[1]))
            return _joined([*self._table(free - len(plot)), self._progress(), *plot])
        return _joined([*self._table(max(free, 1)), self._progress()])

    def _table(self, room: int) -> list[Text]:
        """Return the last lines of the history, in no more than so many beside its head."""
        rows, columns = min(room, MOST_ITERATIONS), _fitting(self.console.width)
        hidden = len(self.lines) - rows
        above = f"({hidden} earlier iterations)" if hidden > 0 else ""
        head = Text(_row(HISTORY[:columns]), style="bold")
        return [
            Text(above, style="dim"),
            head,
            *(Text(_row(_cells(line)[:columns])) for line in self.lines[-rows:]),
        ]

    def _progress(self) -> Text:
        first, last = self.lines[0], self.lines[-1]
        limit = "" if self.most is None else f" (at most {_most(self.most)})"
        share = last.cost / first.cost if first.cost > 0.0 else 1.0
        cost = f"cost {last.cost:.4e}, {100.0 * share:.3g} % of the start's"
        text = f"iteration {last.number}{limit}: {cost}"
        text = text if self._starts is None else _of_search(self._starts)
        seconds = time.monotonic() - self._began
        return Text(f"{text}, {seconds:.0f} s" if seconds >= QUIET else text, style="dim")


def _most(iterations: int | Mapping[str, int]) -> str:
    """Write the largest number of iterations in words."""
    if isinstance(iterations, int):
        return f"{iterations} a phase"
    return ", ".join(f"{count} {phase}" for phase, count in iterations.items())


def _of_search(progress: Progress) -> str:
    stage, counted = STAGES[progress.stage]
    done = f"{stage}: {progress.done} of {progress.total} {counted}"
    return f"{done}, lowest cost {progress.best:.4e}"


def _joined(lines: Iterable[Text]) -> Text:
    """Return lines below each other; what is wider than the terminal is cut off."""
    text = Text("\n").join(lines)
    text.no_wrap, text.overflow = True, "crop"
    return text


def _row(cells: Sequence[str]) -> str:
    """Return the first cells of a line of the history, each in its column."""
    return " ".join(form.format(cell) for form, cell in zip(FORMATS, cells, strict=False))


def _fitting(width: int) -> int:
    """Count the columns of the history that a terminal has room for: none is cut in two."""
    return max(k for k in range(1, len(HISTORY) + 1) if k == 1 or len(_row(HISTORY[:k])) <= width)


def _cells(line: Iteration) -> tuple[str, ...]:
    return (
        str(line.number),
        line.phase,
        f"{line.cost:.4e}",
        f"{line.gradient_norm:.2e}",
        f"{line.step_norm:.2e}",
        f"{line.damping:.2e}" if line.damping == line.damping else "-",
        yes_or_no(line.capped) or "-",
        str(line.inner),
        str(line.nfev),
    )


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
