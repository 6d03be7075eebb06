"""The result of a programme: its tests with what each shows, and the values that they gave."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Annotated, Any

from exfit.features.programme.results_at_rest import SaturationResult, VCurve
from exfit.results.description import UnitDescription
from exfit.results.model import FitResult
from exfit.results.side_by_side import explanation_of, outcome_of
from exfit.util.text import ERRORS_IN_INTERVAL, error_of_interval, rounded_value
from exfit.util.typed import IN_FILE, KEY, plain

StepResult = SaturationResult | VCurve | FitResult


@dataclass(frozen=True)
class EnteredValue:
    """A value that a test gave, and whether it entered the later tests.

    ``name`` is that of a parameter (machine.S10), or of the base of a signal (ifd.base) in
    ``unit``; ``interval`` holds it with 95 % confidence. ``given`` is what the file of the
    programme has in its place, None where it has nothing, and ``given_source`` where that comes
    from; ``excluded`` says whether that lies outside the interval. The value was fitted between
    ``min`` and ``max``.
    """

    name: str
    value: float
    interval: tuple[float, float]
    source: str
    test: str
    unit: str = ""
    given: float | None = None
    given_source: str = ""
    entered: bool = True
    excluded: bool = False
    min: Annotated[float, -inf] = -inf
    max: Annotated[float, inf] = inf

    def rounded(self, number: float) -> str:
        """Return the value, or an end of its interval, as tables print it: within the bounds."""
        return rounded_value(number, error_of_interval(*self.interval), self.min, self.max)

    @property
    def std_error(self) -> float:
        """The standard error that later tests allow for: by the wider side of the interval."""
        low, high = self.interval
        return 2.0 * max(self.value - low, high - self.value) / ERRORS_IN_INTERVAL

    @property
    def warning(self) -> str:
        """The contradiction of the file to the value, in a sentence; "" without one."""
        if not self.excluded or self.given is None:
            return ""
        low, high = map(self.rounded, self.interval)
        measured = f"{low} ... {high} {self.unit}".rstrip()
        used = f"the value of {'the test' if self.entered else 'the file'} is used"
        return (
            f"{self.name}: {self.given:g} in the file ({self.given_source}) lies outside "
            f"{measured}, which the test {self.test} gave; {used}"
        )


@dataclass(frozen=True)
class ProgrammeStep:
    """A test that is run by itself, or all bump tests, which are fitted together.

    ``name`` is that of its folder, ``tests`` are the names of its tests.
    """

    name: str
    kind: str
    tests: tuple[str, ...]


@dataclass(frozen=True)
class KeptTest(ProgrammeStep):
    """A test as programme.json names it; ``key`` is a hash of all that goes into its result."""

    key: str


@dataclass(frozen=True, eq=False)
class FinishedTest(KeptTest):
    """A test that has been run; its result is ``kept`` of an earlier run with the same key."""

    result: StepResult = field(metadata=IN_FILE)
    kept: bool = field(default=False, metadata=IN_FILE)

    @property
    def verdict(self) -> str:
        """The verdict, in the words of that of a fit."""
        result = self.result
        return outcome_of(result) if isinstance(result, FitResult) else result.verdict.verdict

    @property
    def reason(self) -> str:
        """The verdict in a sentence."""
        result = self.result
        return explanation_of(result) if isinstance(result, FitResult) else result.verdict.reason

    @property
    def interrupted(self) -> bool:
        """Whether its result is the best point of a fit that was interrupted."""
        return isinstance(self.result, FitResult) and self.result.interrupted

    @property
    def holds(self) -> bool:
        """Whether its results can be used: an exit code of 0 by itself."""
        result = self.result
        return result.holds if isinstance(result, FitResult) else result.verdict.matches


@dataclass(frozen=True, eq=False)
class KeptSummary:
    """The content of programme.json but its version: a programme without the results of its tests.

    ``failed`` holds the error of each test that could not be run, by its name; ``not_run`` names
    those that an interruption left out. ``unit`` has the models with what the tests gave.
    """

    path: Path = field(metadata={KEY: "programme"})
    about: Mapping[str, float | str]
    tests: tuple[KeptTest, ...]
    values: tuple[EnteredValue, ...] = ()
    failed: Mapping[str, str] = field(default_factory=dict)
    not_run: tuple[str, ...] = ()
    interrupted: bool = False
    unit: UnitDescription = field(default_factory=UnitDescription)


@dataclass(frozen=True, eq=False)
class ProgrammeResult(KeptSummary):
    """A programme that has been run: its tests in the order of the run, and the values they gave.

    ``failed`` holds the error of each test that could not be run, by its name; ``not_run`` names
    those that an interruption left out. ``unit`` has the models with what the tests gave.
    """

    tests: tuple[FinishedTest, ...]

    @property
    def name(self) -> str:
        """The name of the programme."""
        return self.path.stem

    @property
    def results(self) -> dict[str, StepResult]:
        """The results by the names of the tests; that of all bump tests is named fit."""
        return {test.name: test.result for test in self.tests}

    @property
    def fit(self) -> FitResult | None:
        """The fit of the bump tests; None where there is none."""
        result = self.results.get("fit")
        return result if isinstance(result, FitResult) else None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Contradictions to the file of the programme, in sentences."""
        return tuple(filter(None, (value.warning for value in self.values)))

    @property
    def holds(self) -> bool:
        """Whether every test has been run, and its result can be used."""
        done = not (self.failed or self.not_run or self.interrupted)
        return done and all(test.holds for test in self.tests)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of all tests as plain data, as ``exfit run --json`` prints them."""
        content: dict[str, Any] = plain(self)
        del content["unit"]
        content["tests"] = [
            {
                "name": test.name,
                "kind": test.kind,
                "tests": list(test.tests),
                "verdict": test.verdict,
                "reason": test.reason,
                "holds": test.holds,
                "kept": test.kept,
                "result": plain(test.result),
            }
            for test in self.tests
        ]
        return {**content, "warnings": list(self.warnings)}
