"""A programme in the terminal: how far it is while it runs, and what its tests came to."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from exfit.estimate import Progress
from exfit.features.programme.case.programme import ProgrammeStep
from exfit.features.programme.result import EnteredValue, FinishedTest, ProgrammeResult
from exfit.features.programme.run import CheckedStep
from exfit.features.programme.steady.saturation_result import MeasuredValue, SaturationResult
from exfit.features.programme.steady.v_curve_result import VCurve
from exfit.results.model import FitResult, FittedParameter, Iteration
from exfit.results.verdict import GOOD, NOT_CONVERGED
from exfit.show.terminal.checks import check
from exfit.show.terminal.fits import fit
from exfit.show.terminal.series import BRIEF, progress_words
from exfit.show.terminal.terminal import (
    interval,
    notes,
    number,
    paragraph,
    plain_table,
    remarks,
    show_table,
    unresolved,
)
from exfit.signals import TERMINALS
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


def saturation(console: Console, result: SaturationResult) -> None:
    """Show the numbers of the curve that is used, those of each form, and what limits them."""
    table = plain_table("", "value", "95 %", "unit", numbers=("value", "95 %"))
    no_interval = result.verdict.in_place_of_interval
    for name, value, unit in _quantities(result):
        ends = no_interval or interval(value.interval, value.rounded)
        table.add_row(name, value.rounded(value.value), ends, unit)
    show_table(console, table)
    console.print()
    heads = (f"base ({result.unit})", "S(1.0)", "S(1.2)", "rms (pu)")
    forms = plain_table("form", *heads, "", numbers=heads)
    for curve in result.curves:
        values = (curve.ifd_base, curve.S10, curve.S12)
        cells = (value.rounded(value.value) for value in values)
        remarks = ["used"] * (curve.form == result.form) + ["refuted"] * curve.refuted
        forms.add_row(curve.form, *cells, f"{curve.rms:.2g}", ", ".join(remarks))
    show_table(console, forms)
    if result.notes:
        console.print()
        notes(console, result.notes)


def _quantities(result: SaturationResult) -> Iterator[tuple[str, MeasuredValue, str]]:
    """Yield what the test gives: its name, value and unit."""
    curve = result.curve
    name = "exciter field current" if result.exciter else "base of ifd"
    yield f"{name}, 1 pu on the air-gap line", curve.ifd_base, result.unit
    if result.efd_base is not None:
        yield "base of efd", result.efd_base, result.efd_unit
    if result.resistance is not None:
        yield "resistance of the field", result.resistance, f"{result.efd_unit}/{result.unit}"
    yield "S(1.0)", curve.S10, "pu"
    yield "S(1.2)", curve.S12, "pu"
    if curve.hysteresis is not None:
        yield "hysteresis, rising less falling", curve.hysteresis, "pu"
    if result.residual is not None:
        yield "residual voltage", MeasuredValue(result.residual, None, (None, None)), "pu"


def v_curve(console: Console, result: VCurve) -> None:
    """Show the verdict, each point with its field by record and model, and what was fitted."""
    paragraph(console, f"verdict: {result.verdict.sentence}")
    console.print()
    show_table(console, points_table(result))
    if result.parameters:
        console.print()
        show_table(console, parameters_table(result))
    if result.undetermined or result.notes or result.verdict.causes:
        console.print()
    unresolved(console, result.undetermined)
    notes(console, (*(cause.sentence for cause in result.verdict.causes), *result.notes))


def points_table(result: VCurve) -> Table:
    """Return the points: power, voltage, and each field signal, measured and simulated."""
    fields = [
        f"{signal} {words}"
        for signal in result.readings
        for words in ("measured", "simulated", "differs")
    ]
    heads = ("point", *TERMINALS, *fields)
    table = plain_table(*heads, "", numbers=heads)
    for row in range(len(result.p)):
        cells = [f"{value:.3f}" for value in (result.p[row], result.q[row], result.vt[row])]
        for reading in result.readings.values():
            cells += [f"{reading.measured[row]:.4f}", f"{reading.simulated[row]:.4f}"]
            cells.append(f"{100.0 * reading.residuals[row] / reading.measured[row]:+.2f} %")
        worst = [signal for signal, each in result.readings.items() if each.worst == row]
        table.add_row(str(row + 1), *cells, "largest" if worst else "")
    return table


def parameters_table(result: VCurve) -> Table:
    """Return what was fitted, with its interval."""
    numbers = ("start", "fitted", "95 % interval")
    marks = {name: ", ".join(_marks(each)) for name, each in result.parameters.items()}
    remark = ("",) if any(marks.values()) else ()
    table = plain_table("parameter", *numbers, "unit", *remark, numbers=numbers)
    no_interval = result.verdict.in_place_of_interval
    for name, parameter in result.parameters.items():
        values = (number(parameter.start), parameter.rounded(parameter.value))
        limits = no_interval or interval(parameter.interval, parameter.rounded)
        mark = (marks[name],) if remark else ()
        style = "" if parameter.determined and parameter.physical else "yellow"
        table.add_row(name, *values, limits, parameter.unit, *mark, style=style)
    return table


def _marks(parameter: FittedParameter) -> Iterator[str]:
    if parameter.at_bound:
        yield f"on its {parameter.at_bound}"
    if not parameter.physical:
        yield "not physical"
