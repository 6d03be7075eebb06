"""Which unit was tested, and how."""

from dataclasses import dataclass

from exfit.results.description import RecordedTest
from exfit.results.model import FitResult
from exfit.util.text import show


@dataclass(frozen=True)
class UnitAndTest:
    """What identifies the unit, in words, and the tests with their records."""

    about: tuple[tuple[str, str], ...]
    tests: tuple[RecordedTest, ...]


def unit_and_test(result: FitResult) -> UnitAndTest:
    """Return which unit was tested, and how."""
    about = tuple((name, _plain(value)) for name, value in result.about.items())
    return UnitAndTest(about, result.tests)


def _plain(value: float | str) -> str:
    return value if isinstance(value, str) else show(value)
