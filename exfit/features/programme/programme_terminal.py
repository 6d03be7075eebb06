"""A programme in the terminal, while it runs."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.text import Text

from exfit.estimate import Progress
from exfit.features.programme.result import FinishedTest, ProgrammeStep
from exfit.results.model import FitResult, Iteration
from exfit.results.verdict import NOT_CONVERGED
from exfit.show.live import BRIEF, progress_words
from exfit.util.text import percentage

KIND, VERDICT, SECONDS = 10, 27, 7  # characters of the columns behind the name
FEWEST_OF_NAME = 12  # characters: on a narrower terminal verdicts are shortened
KEPT = "kept"  # in place of the time of a test that was not run again


class ProgrammeProgress:
    """Shows tests as they end, a line for each; a terminal has the one that runs below them."""

    def __init__(self, console: Console, steps: Sequence[ProgrammeStep]) -> None:
        self.console, self.steps = console, steps
        names = [name for step in steps for name in (step.name, *step.tests)]
        room = console.width - KIND - SECONDS - 3
        self._brief = room - VERDICT < FEWEST_OF_NAME
        self._verdict = len(NOT_CONVERGED) if self._brief else VERDICT
        longest = max((len(name) for name in names), default=0)
        self._width = min(longest, max(room - self._verdict, FEWEST_OF_NAME))
        self._live: Live | None = None
        self._shown = ""

    @contextmanager
    def running(self) -> Iterator["ProgrammeProgress"]:
        """Show the lines for as long as the tests run."""
        head = self._line("test", "kind", "verdict", "s")
        self.console.print(head, style="bold", soft_wrap=True, markup=False)
        if not self.console.is_terminal:
            yield self
            return
        with Live(console=self.console, transient=True) as self._live:
            yield self

    def __call__(self, step: ProgrammeStep, progress: Iteration | Progress | None) -> None:
        """Show how far the test that runs is."""
        if self._live is not None:
            number = self.steps.index(step) + 1
            words = "begins" if progress is None else progress_words(progress)
            text = f"{number} of {len(self.steps)}: {step.name}, {words}"
            self._live.update(Text(text, "dim"), refresh=step.name != self._shown)
            self._shown = step.name

    def finished(self, test: FinishedTest) -> None:
        """Show a test that has ended; of the bump tests each, the verdict on their fit once."""
        seconds = f"{test.result.seconds:.1f}" if isinstance(test.result, FitResult) else ""
        verdict = BRIEF.get(test.verdict, test.verdict) if self._brief else test.verdict
        line = self._line(test.name, test.kind, verdict, KEPT if test.kept else seconds)
        self.console.print(Text(line, "" if test.holds else "yellow"), soft_wrap=True)
        if isinstance(test.result, FitResult) and [*test.tests] != [test.name]:
            for match in (*test.result.comparisons, *test.result.validation):
                judged = "validated" if match.validation else "fitted"
                word = judged if match.accepted else "not accepted"
                line = self._line(
                    f"  {match.name}", "", f"{word}, {percentage(match.fit_percent)} %", ""
                )
                self.console.print(Text(line, "" if match.accepted else "yellow"), soft_wrap=True)

    def _line(self, name: str, kind: str, verdict: str, seconds: str) -> str:
        if len(name) > self._width:
            name = f"…{name[1 - self._width :]}"
        cells = (f"{name:<{self._width}}", f"{kind:<{KIND}}", f"{verdict:<{self._verdict}}")
        return " ".join((*cells, f"{seconds:>{SECONDS}}")).rstrip()
