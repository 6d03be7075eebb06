"""A validation as data: values that were compared with records, whoever they are from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from exfit.results.comparisons import AsFound, Comparison
from exfit.results.description import (
    Behaviour,
    GivenInPlace,
    OtherProgram,
    PartDescription,
    RecordedTest,
    source_in_words,
    values_of_part,
)
from exfit.results.model import FitResult, FittedParameter
from exfit.util.typed import IN_FILE, KEY
from exfit.util.vocabulary import Criteria


@dataclass(frozen=True, eq=False)
class ValidationResult:
    """A unit with given values beside its records: nothing is searched for here.

    ``matches`` are the comparisons with the records that the values were fitted to, if there are
    any, then with those that no fit saw. ``origin`` says in words whose values they are, ``values``
    are all of them, named as in the system; ``options`` are those of the command. The rest is as in
    `FitResult`. It describes validation.json, too.
    """

    # nothing is fitted; ``origin`` and ``options`` say whose values these are
    parameters: ClassVar[Mapping[str, FittedParameter]] = {}
    given_values: ClassVar[Mapping[str, GivenInPlace]] = {}

    case: Path
    about: Mapping[str, float | str]
    model: str
    saturation: str
    origin: str
    values: Mapping[str, float]
    sources: Mapping[str, str]
    ties: Mapping[str, str]
    matches: tuple[Comparison, ...] = field(metadata={KEY: "validation"})
    versions: Mapping[str, str]
    inputs: Mapping[str, str]
    options: tuple[str, ...] = ()
    parts: tuple[PartDescription, ...] = field(default=(), metadata=IN_FILE)
    tests: tuple[RecordedTest, ...] = field(default=(), metadata=IN_FILE)
    behaviour: Behaviour | None = field(default=None, metadata=IN_FILE)
    files: Mapping[str, str] = field(default_factory=dict, metadata=IN_FILE)
    case_text: str = field(default="", metadata=IN_FILE)
    as_found: AsFound | None = field(default=None, metadata=IN_FILE)
    criteria: Criteria = field(default_factory=Criteria, metadata=IN_FILE)
    other_program: OtherProgram | None = field(default=None, metadata=IN_FILE)

    @property
    def name(self) -> str:
        """The name of the case."""
        return self.case.stem

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Those with the records that the values were fitted to."""
        return tuple(match for match in self.matches if not match.validation)

    @property
    def validation(self) -> tuple[Comparison, ...]:
        """Those with the records that no fit saw, each with its verdict."""
        return tuple(match for match in self.matches if match.validation)

    @property
    def accepted(self) -> bool:
        """Whether every record meets the criteria of the case, or its validation holds."""
        return all(match.accepted for match in self.matches)

    @property
    def holds(self) -> bool:
        """Whether the values hold on the records: every validation is accepted."""
        return self.accepted

    @property
    def notes(self) -> tuple[str, ...]:
        """What must be known of the records, each with its name: steps found in them, and more."""
        return tuple(
            f"{match.name}: {text}"
            for match in self.matches
            for text in (*(step.text for step in match.steps), *match.notes)
        )

    @property
    def of_records(self) -> dict[str, float]:
        """What was found about the records: instants and sizes of steps, levels, delays."""
        return {name: value for match in self.matches for name, value in match.of_record.items()}

    @property
    def fixed(self) -> dict[str, float]:
        """The values of the exciter, and of helpers of ties."""
        return self.values_of("")

    @property
    def network(self) -> dict[str, float]:
        """The values of the network by symbol."""
        return self.values_of("network.")

    def values_of(self, prefix: str) -> dict[str, float]:
        """Return the values of one part by symbol; the exciter's prefix is empty."""
        return values_of_part(self.values, prefix)

    def source_of(self, name: str) -> str:
        """Word the source of a parameter's value: maker, typical, tied ..."""
        return source_in_words(name, self.sources, self.ties)


Reported = FitResult | ValidationResult  # what a report can be made of
