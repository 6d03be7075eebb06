"""A programme: its tests as they end, and the values that they gave those after them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.text import Text

from exfit.estimate import Progress
from exfit.features.programme.checking import CheckedStep
from exfit.features.programme.result import EnteredValue, FinishedTest, ProgrammeResult
from exfit.features.programme.saturation_result import SaturationResult
from exfit.features.programme.steps import ProgrammeStep
from exfit.features.programme.terminal_saturation import saturation
from exfit.features.programme.terminal_v_curve import v_curve
from exfit.features.programme.v_curve_result import VCurve
from exfit.results.model import FitResult, Iteration
from exfit.results.verdict import GOOD, NOT_CONVERGED
from exfit.show.terminal.checks import check
from exfit.show.terminal.fits import fit
from exfit.show.terminal.series import BRIEF, progress_words
from exfit.show.terminal.terminal import interval, paragraph, plain_table, remarks, show_table
from exfit.util.text import percentage
from exfit.workflows.model_check import Check

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


def programme(console: Console, result: ProgrammeResult) -> None:
    """Show what a programme came to: the fit of its bump tests, what else its tests gave."""
    for test in result.tests:
        if not isinstance(test.result, FitResult):
            console.print()
            paragraph(console, f"{test.name} ({test.kind})", "bold")
            _at_rest(console, test)
    if result.fit is not None:
        fit(console, result.fit)
    if result.values:
        console.print()
        _values(console, result.values)
    console.print()
    for test in result.tests:
        if not test.holds and isinstance(test.result, FitResult):
            remarks(console, f"{test.name}: {test.verdict}:", [test.reason], "bold red")
    for name, fault in result.failed.items():
        remarks(console, f"{name}: failed:", fault.splitlines(), "bold red")
    remarks(console, "warning:", result.warnings)
    if result.not_run:
        names = ", ".join(result.not_run)
        paragraph(console, f"not run, interrupted: {names}; run again to go on", "bold red")


def checked_step(console: Console, checked: CheckedStep) -> None:
    """Show a test of a programme that is checked: its result at rest, or the check of its fit."""
    step = checked.step
    tests = "" if step.tests in ((), (step.name,)) else f" of {', '.join(step.tests)}"
    paragraph(console, f"{step.name}{tests} ({step.kind})", "bold")
    if isinstance(checked.outcome, Check):
        check(console, checked.outcome)
    elif checked.outcome is None:
        paragraph(console, checked.fault, "bold red")
    else:
        _at_rest(console, checked.outcome)
    console.print()


def _at_rest(console: Console, test: FinishedTest) -> None:
    """Show what a test at rest gives; nothing of a fit."""
    if isinstance(test.result, SaturationResult):
        style = "green" if test.verdict == GOOD else "yellow" if test.holds else "bold red"
        paragraph(console, f"verdict: {test.verdict}: {test.reason}", style)
        saturation(console, test.result)
    elif isinstance(test.result, VCurve):
        v_curve(console, test.result)


def _values(console: Console, values: Sequence[EnteredValue]) -> None:
    """Show the values that tests gave, each beside the one of the file."""
    paragraph(console, "values that tests gave to those after them", "bold")
    heads = ("value", "unit", "measured", "95 % interval", "source", "test", "in the file")
    table = plain_table(*heads, numbers=("measured",))
    for value in values:
        known = value.given is not None
        given = f"{value.given:g}, {value.given_source}" if known else value.given_source or "none"
        if not value.entered:
            given += ", used"
        table.add_row(
            value.name,
            value.unit,
            value.rounded(value.value),
            interval(value.interval, value.rounded),
            value.source,
            value.test,
            given,
        )
    show_table(console, table, expendable=("unit", "test"))
