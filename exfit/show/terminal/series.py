"""Fits of several cases with several strategies, while they run."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.text import Text

from exfit.results.model import Iteration
from exfit.results.side_by_side import outcome_of
from exfit.results.verdict import MATCHES, MISSES
from exfit.runs.fits import FitRun, PlannedFit, Progress
from exfit.show.terminal.terminal import paragraph

HEADS = ("fit", "it", "f", "rmse", "s", "")
FORMS = ("{:>4}", "{:>10}", "{:>10}", "{:>7}", "{:<13}")  # behind the name
MOST_OF_NAME = 28  # characters: the line has then 80
DESCENTS_ALONE = (
    "each fit is the descent from the start of its case alone: --search global looks further"
)
BRIEF = {MATCHES: "matches", MISSES: "misses"}  # what a line has no room for


class SeriesProgress:
    """Shows fits as they end, a line for each; a terminal has the one that runs below them."""

    def __init__(self, console: Console, plan: Sequence[PlannedFit]) -> None:
        self.console, self.count = console, len(plan)
        self._alone = any(fit.search == "local" for fit in plan)
        self._width = min(max(len(fit.name) for fit in plan), MOST_OF_NAME)
        self._done, self._shown = 0, ""
        self._live: Live | None = None

    @contextmanager
    def running(self) -> Iterator["SeriesProgress"]:
        """Show the lines for as long as the fits run."""
        if self._alone:
            paragraph(self.console, DESCENTS_ALONE)
        self.console.print(self._line(HEADS), style="bold", soft_wrap=True, markup=False)
        if not self.console.is_terminal:
            yield self
            return
        with Live(console=self.console, transient=True) as self._live:
            yield self

    def __call__(self, fit: PlannedFit, progress: Progress) -> None:
        """Show how far the fit that runs is."""
        self._show(fit.name, progress_words(progress))

    def finished(self, run: FitRun) -> None:
        """Show a fit that has ended."""
        result, outcome = run.result, outcome_of(run.result)
        numbers = (f"{result.cost:.4e}", f"{result.rmse:.4e}", f"{result.seconds:.2f}")
        style = "" if result.holds else "yellow"
        line = self._line((run.name, f"{result.nit}", *numbers, BRIEF.get(outcome, outcome)))
        self.console.print(Text(line, style), soft_wrap=True)
        self._show(run.name, "writing numbers")
        self._done += 1

    def _show(self, name: str, state: str) -> None:
        """Show below the lines what a fit is at; at once where it is another fit than before."""
        if self._live is not None:
            text = f"{self._done + 1} of {self.count}: {name}, {state}"
            self._live.update(Text(text, "dim"), refresh=name != self._shown)
            self._shown = name

    def _line(self, cells: Sequence[str]) -> str:
        name = cells[0]
        if len(name) > self._width:
            name = f"…{name[1 - self._width :]}"
        others = (form.format(cell) for form, cell in zip(FORMS, cells[1:], strict=True))
        return " ".join([f"{name:<{self._width}}", *others]).rstrip()


def progress_words(progress: Progress) -> str:
    """Describe the progress of a fit."""
    if isinstance(progress, Iteration):
        return f"iteration {progress.number}, f {progress.cost:.4e}"
    return f"{progress.stage} {progress.done} of {progress.total}, best f {progress.best:.4e}"
