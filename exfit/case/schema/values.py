"""The values of the case file: numbers, texts, what a fit finds, filters, columns of time."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Strict,
    Tag,
    WrapSerializer,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from exfit.case.ties import is_tie
from exfit.case.yaml import LONGEST_WHOLE
from exfit.util.text import magnitude_fault, show
from exfit.util.vocabulary import GIVEN_AS, NOT_STATED, SOURCES

if TYPE_CHECKING:
    Source = str
    GivenAs = str
else:
    Source = Literal[SOURCES]
    GivenAs = Literal[GIVEN_AS]

Value = TypeVar("Value")

FILE_NAME = r"^[A-Za-z0-9][A-Za-z0-9._%-]*$"  # of any system; a percent sign as in up-5%
PERCENT = r"^[0-9]+(\.[0-9]+)? ?%$"
REFUSED = "refused"  # the kind of fault of a value that a function here refuses


def refusal(text: str) -> PydanticCustomError:
    """Make the fault of a value, in words that the user reads."""
    return PydanticCustomError(REFUSED, "{text}", {"text": text})


def nothing() -> Mapping[str, Any]:
    """Return an empty mapping that cannot be changed."""
    return MappingProxyType({})


def thawed(values: Mapping[str, Any], serialize: Callable[[Any], Any]) -> Any:
    """Return a frozen mapping as pydantic writes a plain one."""
    return serialize(dict(values))


def _usable(value: float) -> float:
    """Refuse a number that is too large or small to compute with."""
    fault = magnitude_fault(value)
    if fault is not None:
        raise refusal(fault)
    return value


def not_zero(text: str) -> AfterValidator:
    """Make the check that refuses 0, or 0 as a start, with a text."""

    def check(value: Any) -> Any:
        if start_value(value) == 0.0:
            raise refusal(text)
        return value

    return AfterValidator(check)


def _rising(interval: tuple[float, float]) -> tuple[float, float]:
    start, end = map(show, interval)
    if interval[0] >= interval[1]:
        raise refusal(f"start {start} is not below end {end}")
    return interval


def _odd(count: int) -> int:
    if count % 2 == 0:
        raise refusal(f"{show(count)} is not an odd number")
    return count


def _kept(fact: float | str) -> float | str:
    """Refuse a number of more digits than a number keeps, as a serial number."""
    if isinstance(fact, float) and abs(fact) >= 10.0**LONGEST_WHOLE:
        raise refusal(f"more than {LONGEST_WHOLE} digits are not kept; put the number in quotes")
    return fact


Finite = Annotated[float, Strict(), Field(allow_inf_nan=False)]
USABLE = AfterValidator(_usable)  # behind other limits, which the JSON Schema loses otherwise
Number = Annotated[Finite, USABLE]
Positive = Annotated[Finite, Field(gt=0), USABLE]
NotNegative = Annotated[Finite, Field(ge=0), USABLE]
Count = Annotated[int, Strict(), Field(ge=1)]
Text = Annotated[str, Strict(), Field(min_length=1)]
MachineId = Annotated[str, Strict(), Field(min_length=1, max_length=2)]
Bus = Annotated[int, Strict(), Field(ge=1, le=999_999)]  # as PSS/E numbers them
Interval = Annotated[tuple[Number, Number], AfterValidator(_rising)]
Frozen = Annotated[Mapping[str, Value], AfterValidator(MappingProxyType), WrapSerializer(thawed)]

OLDER_FORM: Any = {"deprecated": True}  # for editors
Sources = Frozen[Source]
STATED = Field(
    default_factory=nothing,
    description="Sources by name; better beside each value: {value: 6.0, source: maker}.",
    json_schema_extra=OLDER_FORM,
)

StdErrors = Frozen[NotNegative]
STD_ERRORS = Field(
    default_factory=nothing,
    description="Standard errors by name; better beside each value: {value: 6.0, std_error: 2 %}.",
    json_schema_extra=OLDER_FORM,
)


def _number_or_text(value: Any) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return "[number]" if number else "[text]"


def _text_or_number(value: Any) -> str:
    return "[text]" if isinstance(value, str) else "[number]"


def section_or_number(value: Any) -> str:
    """Tell a section from a number, for pydantic."""
    return "[section]" if isinstance(value, dict | BaseModel) else "[number]"


Fact = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[Text, Tag("[text]")],
    Discriminator(_number_or_text),
    AfterValidator(_kept),
]
Start = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[Literal["auto"], Tag("[text]")],
    Discriminator(_text_or_number),
]
Step = Annotated[
    Annotated[Positive, Tag("[number]")] | Annotated[Literal["auto"], Tag("[text]")],
    Discriminator(_text_or_number),
]
Spread = Annotated[
    Annotated[Positive, Tag("[number]")] | Annotated[str, Field(pattern=PERCENT), Tag("[text]")],
    Discriminator(_text_or_number),
]
StdError = Annotated[
    Annotated[NotNegative, Tag("[number]")] | Annotated[str, Field(pattern=PERCENT), Tag("[text]")],
    Discriminator(_text_or_number),
]


def spread_of(std: float | str, value: float) -> float:
    """Return a standard deviation, which may be a percentage of a value, in the unit of this."""
    return abs(value) * float(std.rstrip("% ")) / 100.0 if isinstance(std, str) else std


class Section(BaseModel):
    """A part of the case file: unknown keys are refused, values never change."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        defer_build=True,
        field_title_generator=lambda name, _: name,
    )


class WhenRead:
    """Build the schema of a section when one is read: a case has few of all that it may have."""

    def __get_pydantic_core_schema__(
        self, section: type[Section], handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Hand the reading on to the section."""
        return core_schema.no_info_plain_validator_function(
            section.model_validate, metadata={"section": section}
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe the section, once for all places where it may stand."""
        section: type[Section] = schema["metadata"]["section"]
        section.model_rebuild()
        named: Any = {**section.__pydantic_core_schema__, "ref": section.__qualname__}
        return handler(core_schema.definitions_schema(named, []))


Later = Annotated[Value, WhenRead()]


def _no_tie(value: Any) -> Any:
    if is_tie(value):
        raise refusal(f"follows others by {value}: give neither source nor error")
    return value


class SourcedNumber(Section):
    """A value with its source."""

    value: Annotated[Number, BeforeValidator(_no_tie)] = Field(description="The value.")
    source: Source | None = Field(
        default=None, description=f"Where it is from; default: {NOT_STATED}."
    )


class StatedNumber(SourcedNumber):
    """A value with its source and its standard error, in place of the value alone."""

    std_error: StdError | None = Field(
        default=None,
        description="Its standard error: a number in its unit or a percentage such as 2 %, as "
        "from a certificate, which the intervals of a fit allow for; 0: exact.",
    )


# the checks take sources and standard errors out of the values: `stated_values`
if TYPE_CHECKING:
    Given = float | str
    Known = float
    Sourced = float
else:
    Given = Annotated[
        Annotated[Number, Tag("[number]")]
        | Annotated[str, Field(pattern="^="), Tag("[tie]")]
        | Annotated[Later[StatedNumber], Tag("[section]")],
        # marks in brackets stand in no file: the messages take them out of the place of a fault
        Discriminator(lambda given: "[tie]" if is_tie(given) else section_or_number(given)),
    ]
    Known = Annotated[
        Annotated[Number, Tag("[number]")] | Annotated[Later[StatedNumber], Tag("[section]")],
        Discriminator(section_or_number),
    ]
    Sourced = Annotated[
        Annotated[Number, Tag("[number]")] | Annotated[Later[SourcedNumber], Tag("[section]")],
        Discriminator(section_or_number),
    ]


class PriorSection(Section):
    """Prior knowledge of a parameter: a value and its standard deviation."""

    mean: Number = Field(description="Expected value, for example from a data sheet.")
    std: Spread = Field(description="Standard deviation: a number, or a percentage such as 20 %.")

    @property
    def sigma(self) -> float:
        """The standard deviation in the parameter's own unit."""
        return spread_of(self.std, self.mean)


class FreeSection(Section):
    """A parameter that is fitted."""

    start: Number = Field(description="Start value.")
    min: Number | None = Field(
        default=None, description="Lower bound; default: as far as the equations allow."
    )
    max: Number | None = Field(
        default=None, description="Upper bound; default: as far as the equations allow."
    )
    bounds: Literal["equations", "none"] = Field(
        default="equations",
        description="What ends the search without min or max: the limits of the equations, or "
        "nothing; none allows neither min nor max.",
    )
    scale: Literal["log", "linear", "start", "raw"] = Field(
        default="log",
        description="Scale on which it is fitted: its logarithm, which requires min > 0; its share "
        "of the width of its bounds, or of its start; or the parameter itself.",
    )
    prior: Later[PriorSection] | None = Field(
        default=None, description="Prior knowledge, which adds one residual."
    )
    source: Source | None = Field(
        default=None, description="Where its start is from; not under tests."
    )


class Unknown(Section):
    """A value of a record or its test that is fitted, on a linear scale."""

    start: Start = Field(description="Start value; auto: taken from the record.")
    min: Number | None = Field(default=None, description="Lower bound; not required with auto.")
    max: Number | None = Field(default=None, description="Upper bound; not required with auto.")


Findable = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[Later[Unknown], Tag("[section]")],
    Discriminator(section_or_number),
]


def start_value(value: "float | Unknown | None") -> float | None:
    """Return a value where it is a number: given, or the start of one that is found."""
    start = value.start if isinstance(value, Unknown) else value
    return None if start == "auto" else start


class LowPassSection(Section):
    """A low-pass filter, applied forwards and backwards, so without delay."""

    lowpass: Positive = Field(description="Cut-off frequency, Hz.")


class MedianSection(Section):
    """A running median."""

    median: Annotated[Count, AfterValidator(_odd)] = Field(description="Number of samples, odd.")


def _kind_of_filter(value: Any) -> str:
    median = isinstance(value, MedianSection) or (isinstance(value, dict) and "median" in value)
    return "[median]" if median else "[lowpass]"


Filter = Annotated[
    Annotated[Later[LowPassSection], Tag("[lowpass]")]
    | Annotated[Later[MedianSection], Tag("[median]")],
    Discriminator(_kind_of_filter),
]


class TimeColumn(Section):
    """The column with the time, and its unit."""

    column: Text = Field(description="Name of the column.")
    unit: Literal["s", "ms", "us", "min"] = Field(description="Unit of its numbers.")


def _kind_of_clock(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[pair]"
    return "[column]" if isinstance(value, dict | BaseModel) else "[name]"


Time = Annotated[
    Annotated[Text, Tag("[name]")]
    | Annotated[tuple[Text, Text], Tag("[pair]")]
    | Annotated[Later[TimeColumn], Tag("[column]")],
    Discriminator(_kind_of_clock),
]
