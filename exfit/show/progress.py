"""A search while it runs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import TaskID
from rich.text import Text

from exfit.case import Case
from exfit.estimate import Progress
from exfit.result import Iteration
from exfit.show.terminal import plain_table

LINES = 12  # of the history that stay in sight
HISTORY = ("it", "phase", "f", "|g|", "step", "damping", "inner", "nfev")


class Watch:
    """Shows the iterations of a fit as they come: a live table, or lines in a file or pipe."""

    def __init__(self, console: Console, title: str) -> None:
        self.console, self.title = console, title
        self.lines: list[Iteration] = []
        self._live: Live | None = None

    @contextmanager
    def running(self) -> Iterator["Watch"]:
        """Show the table for as long as the fit runs."""
        if not self.console.is_terminal:
            yield self
            return
        with Live(console=self.console, auto_refresh=False) as self._live:
            yield self

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
            self._live.update(self._table(), refresh=True)

    def _table(self) -> RenderableType:
        table = plain_table(*HISTORY, numbers=[name for name in HISTORY if name != "phase"])
        for line in self.lines[-LINES:]:
            table.add_row(*_cells(line))
        hidden = len(self.lines) - LINES
        above = Text(f"({hidden} earlier iterations)", style="dim") if hidden > 0 else Text("")
        return Group(above, table)


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
