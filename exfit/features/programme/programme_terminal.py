"""A programme in the terminal, while it runs."""

from collections.abc import Sequence

from rich.console import Console

from exfit.estimate import Progress
from exfit.features.programme.result import FinishedTest, ProgrammeStep
from exfit.output.live import BRIEF, RunLines, progress_words
from exfit.results.model import FitResult, Iteration
from exfit.results.verdict import NOT_CONVERGED
from exfit.util.text import percentage

KIND, VERDICT, SECONDS = 10, 27, 7  # characters of the columns behind the name
FEWEST_OF_NAME = 12  # characters: on a narrower terminal verdicts are shortened
KEPT = "kept"  # in place of the time of a test that was not run again


class ProgrammeProgress(RunLines):
    """The tests of a programme, each as it ends."""

    def __init__(self, console: Console, steps: Sequence[ProgrammeStep]) -> None:
        room = console.width - KIND - SECONDS - 3
        self.brief = room - VERDICT < FEWEST_OF_NAME
        verdict = len(NOT_CONVERGED) if self.brief else VERDICT
        names = [name for step in steps for name in (step.name, *step.tests)]
        longest = max((len(name) for name in names), default=0)
        width = min(longest, max(room - verdict, FEWEST_OF_NAME))
        forms = (f"{{:<{KIND}}}", f"{{:<{verdict}}}", f"{{:>{SECONDS}}}")
        self.steps = steps
        super().__init__(console, ("test", "kind", "verdict", "s"), forms, width, len(steps))

    def __call__(self, step: ProgrammeStep, progress: Iteration | Progress | None) -> None:
        """Show how far the test that runs is: those before it have ended, or failed."""
        self.done = self.steps.index(step)
        self.show(step.name, "begins" if progress is None else progress_words(progress))

    def finished(self, test: FinishedTest) -> None:
        """Show a test that has ended; of the bump tests each, the verdict on their fit once."""
        result, seconds = test.result, KEPT if test.kept else ""
        if isinstance(result, FitResult) and not test.kept:
            seconds = f"{result.seconds:.1f}"
        verdict = BRIEF.get(test.verdict, test.verdict) if self.brief else test.verdict
        self.line((test.name, test.kind, verdict, seconds), "" if test.holds else "yellow")
        if isinstance(result, FitResult) and [*test.tests] != [test.name]:
            for match in (*result.comparisons, *result.validation):
                judged = "validated" if match.validation else "fitted"
                word = judged if match.accepted else "not accepted"
                fit = f", {percentage(match.fit_percent)} %" if match.overlays else ""
                cells = (f"  {match.name}", "", f"{word}{fit}", "")
                self.line(cells, "" if match.accepted else "yellow")
