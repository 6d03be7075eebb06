"""Which unit was tested, and how."""

from dataclasses import dataclass

from exfit.features.programme.result import ProgrammeResult
from exfit.results.description import RecordedTest
from exfit.results.facts import Facts
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported
from exfit.util.text import show


@dataclass(frozen=True)
class UnitAndTest:
    """What identifies the unit, in words, and the tests with their records, or why not."""

    about: tuple[tuple[str, str], ...]
    tests: tuple[RecordedTest, ...]
    missing: str = "The result does not hold this: the fit was interrupted."


def unit_and_test(result: Reported) -> UnitAndTest:
    """Return which unit was tested, and how."""
    return UnitAndTest(_facts(result.about), result.tests)


def unit_without_bumps(result: ProgrammeResult) -> UnitAndTest:
    """Return which unit was tested by a programme whose bump tests gave no fit."""
    fits = (test.result for test in result.tests if isinstance(test.result, FitResult))
    tests = tuple(test for fit in fits for test in fit.tests)
    return UnitAndTest(_facts(result.about), tests, "No test with a record in time was fitted.")


def _facts(about: Facts) -> tuple[tuple[str, str], ...]:
    return tuple((name, _plain(value)) for name, value in about.items())


def _plain(value: float | str) -> str:
    return value if isinstance(value, str) else show(value)
