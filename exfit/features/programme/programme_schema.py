"""The sections of a programme: all tests of a unit, of which each feeds the later ones."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, TypeVar

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, WrapSerializer

from exfit.case.schema import CaseDocument, FreeSection, Recording
from exfit.case.schema.estimate import Limit
from exfit.case.schema.plants import SaturationName
from exfit.case.schema.values import (
    FILE_NAME,
    Findable,
    Frozen,
    Number,
    Positive,
    Section,
    Text,
    nothing,
    thawed,
)
from exfit.signals import FIELDS, OF_GOVERNOR, TERMINALS
from exfit.util.file_names import LONGEST_NAME

SATURATION: Final = "saturation"
STEADY: Final = "steady"
GOVERNOR: Final = "governor"
REJECTION: Final = "rejection"
BUMP: Final = "bump"
ORDER = (
    SATURATION,
    STEADY,
    GOVERNOR,
    REJECTION,
    BUMP,
)  # what measures the machine before what needs it

MOST_POINTS = 1000  # of a list; a longer one is a file
POINT_SIGNALS = (*TERMINALS, *FIELDS)
CURVE_SIGNALS = ("vt", *FIELDS)
GOVERNOR_SIGNALS = ("time", *OF_GOVERNOR)

if TYPE_CHECKING:
    PointSignal = str
    CurveSignal = str
    GovernorSignal = str
else:
    PointSignal = Literal[POINT_SIGNALS]
    CurveSignal = Literal[CURVE_SIGNALS]
    GovernorSignal = Literal[GOVERNOR_SIGNALS]

Rows = tuple[tuple[Number, ...], ...]
Key = TypeVar("Key")
Value = TypeVar("Value")
Columns = Annotated[Mapping[Key, Value], AfterValidator(MappingProxyType), WrapSerializer(thawed)]


class NamedColumn(Section):
    """A column of points."""

    column: Text | None = Field(
        default=None, description="Name of the column; none with points in place of a file."
    )


class PointColumn(NamedColumn):
    """A column of points and its conversion to per unit: column / base * scale."""

    unit: Text | None = Field(
        default=None,
        description="Unit of the column, such as MW, Mvar, kV, A, V, pu or %; default: that of the "
        "file, else pu.",
    )
    base: Findable | None = Field(
        default=None,
        description="Value of 1 pu in that unit: of p and q the rated MVA of the machine; of ifd "
        "and efd what gives 1 pu of voltage on the air-gap line, or {start, min, max} to fit it, "
        "where start: auto needs no bounds.",
    )
    scale: Number = Field(default=1.0, description="Factor, such as -1; not zero.")
    noise: Positive | None = Field(
        default=None,
        description="Standard deviation of the readings of ifd or efd, pu; default: that of the "
        "residuals.",
    )


class CurveColumn(NamedColumn):
    """A column of the points of a saturation curve."""

    unit: Text | None = Field(
        default=None,
        description="Unit of the column, such as kV, A, V; default: that of the file, else pu for "
        "vt, A for ifd, V for efd.",
    )
    base: Positive | None = Field(
        default=None,
        description="Value of 1 pu of vt in that unit, the rated voltage; ifd and efd have none: "
        "the test measures it.",
    )


def _named(value: Any) -> Any:
    return {"column": value} if isinstance(value, str) else value


GivenPointColumn = Annotated[
    PointColumn, BeforeValidator(_named, json_schema_input_type=Text | PointColumn)
]
GivenCurveColumn = Annotated[
    CurveColumn, BeforeValidator(_named, json_schema_input_type=Text | CurveColumn)
]


class TestAtRest(Section):
    """A test at rest: points that were read from instruments."""

    kind: str = Field(description="Kind of test.")
    name: str = Field(
        pattern=FILE_NAME,
        max_length=LONGEST_NAME,
        description="Name of letters, digits, - _ and .; files are named after it.",
    )
    file: Text | None = Field(
        default=None, description="File of the points, in any format of a record."
    )
    sheet: Text | None = Field(
        default=None, description="Sheet of a workbook; default: the only one with a table."
    )


class SteadyTest(TestAtRest):
    """Points of the V-curves: field current, or voltage, of the machine at rest on load."""

    kind: Literal["steady"] = Field(description="Kind of test.")
    points: Annotated[Rows, Field(min_length=1, max_length=MOST_POINTS)] | None = Field(
        default=None,
        description="In place of a file: [p, q, vt, ifd] or [p, q, vt, ifd, efd] of each point.",
    )
    columns: Columns[PointSignal, GivenPointColumn] = Field(
        default_factory=nothing,
        description="Columns of p, q, vt and of ifd, efd or both: a name, or a mapping. p and q "
        "are positive where the machine gives power and is overexcited.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=nothing,
        description="Machine data that the points are fitted for: Xd, Xq, S10, S12, Xl, as under "
        "parameters.free.",
    )
    accept: Limit | None = Field(
        default=None,
        description="Limit of the rms difference of each field signal, pu; beyond it the points "
        "are not matched. Default: 2 % of its rms, or 3 times its noise where that is larger.",
    )


class GovernorTest(TestAtRest):
    """The gate over the power at rest; or what gate or power does while the speed wanders."""

    kind: Literal["governor"] = Field(description="Kind of test.")
    columns: Columns[GovernorSignal, GivenPointColumn] = Field(
        default_factory=nothing,
        description="Columns of p and gate; or of time (s), speed and gate or p: a name, or a "
        "mapping. p is on the rated MVA of the machine.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=nothing,
        description="Data of the governor that are found, such as At and qNL, or R, DBH and DBL, "
        "as under parameters.free.",
    )
    accept: Limit | None = Field(
        default=None,
        description="Limit of the rms difference of gate or p, pu. Default: 2 % of its rms; with "
        "speed about its mean, or 3 times its noise.",
    )


class FieldWindingSection(Section):
    """The resistance of the field winding, from which the base of efd follows."""

    resistance: Positive | None = Field(
        default=None,
        description="Resistance, ohm; default: the slope of efd over ifd, where efd is a column.",
    )
    temperature: Number | None = Field(
        default=None, gt=-100.0, description="Its temperature there, or during the test, degrees C."
    )
    hot: Number | None = Field(
        default=None,
        gt=-100.0,
        description="Temperature in operation, degrees C, to which the resistance is converted as "
        "that of copper; default: not converted.",
    )


class SaturationTest(TestAtRest):
    """The open-circuit saturation curve: terminal voltage over field current at rated speed."""

    kind: Literal["saturation"] = Field(description="Kind of test.")
    file: Text | None = Field(
        default=None,
        description="File of the points, in any format of a record, in the order in which they "
        "were taken.",
    )
    points: Annotated[Rows, Field(max_length=MOST_POINTS)] | None = Field(
        default=None,
        description="In place of a file: [vt, ifd] or [vt, ifd, efd] of each point, in the order "
        "in which they were taken.",
    )
    columns: Columns[CurveSignal, GivenCurveColumn] = Field(
        default_factory=nothing,
        description="Columns of vt, ifd and, where it was measured, efd: a name, or a mapping.",
    )
    form: SaturationName | None = Field(
        default=None,
        description="Form of the curve that is used: quadratic (GENROU, GENSAL), exponential (as "
        "of GENROE, GENSAE: a power of the voltage), exponential-se; default: that of the machine.",
    )
    brushless: bool = Field(
        default=False,
        description="Whether ifd is the field current of a brushless exciter: the curve is then "
        "that of exciter and machine together, and gives the machine no values.",
    )
    winding: FieldWindingSection = Field(
        default_factory=FieldWindingSection,
        description="Resistance and temperature of the field winding, for the base of efd.",
    )


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
    | Annotated[GovernorTest, Tag(f"[{GOVERNOR}]")]
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
