"""The sections of a programme: all tests of a unit, of which each feeds the later ones."""

from typing import Annotated, Any, ClassVar, Final, Literal

from pydantic import Discriminator, Field, Tag

from exfit.case.schema import CaseDocument, FreeSection, Recording
from exfit.case.schema.values import Frozen, Section
from exfit.features.programme.case.schema_at_rest import SaturationTest, SteadyTest

SATURATION: Final = "saturation"
STEADY: Final = "steady"
REJECTION: Final = "rejection"
BUMP: Final = "bump"
ORDER = (SATURATION, STEADY, REJECTION, BUMP)  # what measures the machine before what needs it


class RecordedBump(Recording):
    """A bump test of a programme; all that are fitted are fitted together, as records are."""

    kind: Literal["bump"] = Field(default=BUMP, description="Kind of test.")
    use: Literal["fit", "validate"] = Field(
        default="fit",
        description="Whether it is fitted, or the result of the others is validated on it.",
    )


class RecordedRejection(Recording):
    """A test of a programme that determines data of the machine before the bump tests."""

    kind: Literal["rejection"] = Field(description="Kind of test.")
    free: Annotated[Frozen[FreeSection], Field(min_length=1)] = Field(
        description="Machine data that it is fitted for, as under parameters.free; nothing else "
        "is fitted."
    )


def _kind_of_test(value: Any) -> str:
    kind = value.get("kind", BUMP) if isinstance(value, dict) else getattr(value, "kind", BUMP)
    return f"[{kind}]"


TestOfProgramme = Annotated[
    Annotated[SaturationTest, Tag(f"[{SATURATION}]")]
    | Annotated[SteadyTest, Tag(f"[{STEADY}]")]
    | Annotated[RecordedRejection, Tag(f"[{REJECTION}]")]
    | Annotated[RecordedBump, Tag(f"[{BUMP}]")],
    Discriminator(_kind_of_test),
]


class ProgrammeSection(Section):
    """The section that makes a case file a programme."""

    not_of_a_case: ClassVar[str] = (
        "makes this a programme of several tests, not a case: exfit run runs it"
    )
    programme: tuple[TestOfProgramme, ...] = Field(
        default=(),
        alias="tests",
        min_length=1,
        description="In place of test, record, records and validate: the tests of a programme, "
        "of which each feeds the later ones.",
    )


class ProgrammeDocument(CaseDocument, ProgrammeSection):
    """The file of a programme: what its tests share, as in a case, and the tests."""
