"""The values of the case file: numbers, texts, what a fit finds, what is known beforehand."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Strict,
    Tag,
    WrapSerializer,
)
from pydantic_core import PydanticCustomError

from exfit.case.messages import MAGNITUDE, PERCENT
from exfit.case.ties import is_tie
from exfit.util.sources import NOT_STATED, SOURCES
from exfit.util.text import magnitude_fault

if TYPE_CHECKING:
    Source = str
else:
    Source = Literal[SOURCES]

Value = TypeVar("Value")


def nothing() -> Mapping[str, Any]:
    """Return an empty mapping that cannot be changed."""
    return MappingProxyType({})


def thawed(values: Mapping[str, Any], serialize: Callable[[Any], Any]) -> Any:
    """Return a frozen mapping as pydantic writes a plain one."""
    return serialize(dict(values))


def _usable(value: float) -> float:
    """Return a number; raises PydanticCustomError for one too large or small to compute with."""
    fault = magnitude_fault(value)
    if fault is not None:
        raise PydanticCustomError(MAGNITUDE, "{fault}", {"fault": fault})
    return value


Finite = Annotated[float, Strict(), Field(allow_inf_nan=False)]
USABLE = AfterValidator(_usable)  # behind other limits, which the JSON Schema loses otherwise
Number = Annotated[Finite, USABLE]
Positive = Annotated[Finite, Field(gt=0), USABLE]
NotNegative = Annotated[Finite, Field(ge=0), USABLE]
Count = Annotated[int, Strict(), Field(ge=1)]
Text = Annotated[str, Strict(), Field(min_length=1)]
MachineId = Annotated[str, Strict(), Field(min_length=1, max_length=2)]
Bus = Annotated[int, Strict(), Field(ge=1, le=999_999)]  # as PSS/E numbers them
Frozen = Annotated[Mapping[str, Value], AfterValidator(MappingProxyType), WrapSerializer(thawed)]

Sources = Frozen[Source]
STATED = Field(
    default_factory=nothing,
    description=f"Where the value of each parameter comes from; {NOT_STATED} by default.",
)

StdErrors = Frozen[Positive]
STD_ERRORS = Field(
    default_factory=nothing,
    description="Standard error of each given value that is not exact, in its own unit, as from a "
    "test report; the intervals of a fit allow for it.",
)


def _is_tie(value: Any) -> str:
    return "[tie]" if is_tie(value) else "[number]"


def _is_percent(value: Any) -> str:
    return "[percent]" if isinstance(value, str) else "[number]"


def _is_text(value: Any) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return "[number]" if number else "[text]"


def _is_word(value: Any) -> str:
    return "[auto]" if isinstance(value, str) else "[number]"


def _is_unknown(value: Any) -> str:
    return "[unknown]" if isinstance(value, dict | BaseModel) else "[number]"


# marks in brackets stand in no file: the messages take them out of the place of a fault
Given = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[str, Field(pattern="^="), Tag("[tie]")],
    Discriminator(_is_tie),
]
Fact = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[Text, Tag("[text]")],
    Discriminator(_is_text),
]
Start = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[Literal["auto"], Tag("[auto]")],
    Discriminator(_is_word),
]
Spread = Annotated[
    Annotated[Positive, Tag("[number]")] | Annotated[str, Field(pattern=PERCENT), Tag("[percent]")],
    Discriminator(_is_percent),
]


class Section(BaseModel):
    """A part of the case file: unknown keys are refused, values never change."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        defer_build=True,
        field_title_generator=lambda name, _: name,
    )


class PriorSection(Section):
    """Prior knowledge of a parameter: a value and its standard deviation."""

    mean: Number = Field(description="Expected value, for example from a data sheet.")
    std: Spread = Field(description="Standard deviation: a number, or a percentage such as 20 %.")

    @property
    def sigma(self) -> float:
        """The standard deviation in the parameter's own unit."""
        if isinstance(self.std, str):
            return abs(self.mean) * float(self.std.rstrip("% ")) / 100.0
        return self.std


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
    prior: PriorSection | None = Field(
        default=None, description="Prior knowledge, which adds one residual."
    )


class Unknown(Section):
    """A value of a record or its test that is fitted, on a linear scale."""

    start: Start = Field(description="Start value; auto: taken from the record.")
    min: Number | None = Field(default=None, description="Lower bound; not required with auto.")
    max: Number | None = Field(default=None, description="Upper bound; not required with auto.")


Findable = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[Unknown, Tag("[unknown]")],
    Discriminator(_is_unknown),
]


def start_value(value: "float | Unknown | None") -> float | None:
    """Return a value where it is a number: given, or the start of one that is found."""
    start = value.start if isinstance(value, Unknown) else value
    return None if start == "auto" else start
