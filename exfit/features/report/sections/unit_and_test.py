"""Which unit was tested, and how."""

from collections.abc import Iterator, Sequence

from exfit.features.programme.result import ProgrammeResult
from exfit.features.report.sections.texts import number
from exfit.results.description import RecordedTest
from exfit.results.facts import Facts
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported
from exfit.show import blocks
from exfit.show.blocks import Block, Note, Table, TableColumn, columns, row
from exfit.util.text import show

INTERRUPTED = "The result does not hold this: the fit was interrupted."


def unit_and_test(result: Reported) -> Iterator[Block]:
    """Yield the facts of the unit, and its tests with their records."""
    return _unit(result.about, result.tests, INTERRUPTED)


def unit_without_bumps(result: ProgrammeResult) -> Iterator[Block]:
    """Yield the unit and tests of a programme whose bump tests gave no fit."""
    fits = (test.result for test in result.tests if isinstance(test.result, FitResult))
    tests = tuple(test for fit in fits for test in fit.tests)
    return _unit(result.about, tests, "No test with a record in time was fitted.")


def _unit(about: Facts, tests: Sequence[RecordedTest], missing: str) -> Iterator[Block]:
    if about:
        yield blocks.Facts(
            tuple(
                (name, value if isinstance(value, str) else show(value))
                for name, value in about.items()
            )
        )
    else:
        silent = "The case does not say which unit this is: its section `about` is empty."
        yield Note(silent, mark="faint")
    if not tests:
        yield Note(missing, mark="faint")
        return
    texts = (TableColumn(title, folds=True) for title in ("record", "condition", "done"))
    numbers = ("from (s)", "to (s)", "samples", "every (s)")
    yield Table(
        (*columns("test", "used"), *texts, *columns("channels", *numbers, numbers=numbers)),
        tuple(
            row(
                test.name,
                "to fit" if test.role == "fitted" else "to validate",
                test.file,
                test.plant,
                test.done,
                test.channels,
                number(test.first),
                number(test.last),
                str(test.samples),
                number(test.spacing, 4),
            )
            for test in tests
        ),
        "Tests and their records",
    )
