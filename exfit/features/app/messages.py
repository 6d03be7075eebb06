"""What a page may send: each message has its form, and whatever has another is refused."""

from typing import Annotated, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    StringConstraints,
    TypeAdapter,
    ValidationError,
)

from exfit.errors import ExfitError

LONGEST = 100_000  # characters of a message
Name = Annotated[str, StringConstraints(min_length=1, max_length=100)]
Text = Annotated[str, StringConstraints(max_length=100)]
Values = Annotated[dict[Name, FiniteFloat], Field(max_length=200)]


class Form(BaseModel):
    """A message: its keys, and no others."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Try(Form):
    """Values that a slider passes through while it is ``moving``, or where it rests."""

    do: Literal["try"]
    values: Values
    moving: bool = False


class Chosen(Form):
    """Values that someone has chosen: to start from, or to compare with records not fitted."""

    do: Literal["store", "validate"]
    values: Values


class Bound(Form):
    """Other bounds of a free parameter."""

    do: Literal["bound"]
    name: Name
    low: FiniteFloat
    high: FiniteFloat


class Lock(Form):
    """A free parameter that is held at a value."""

    do: Literal["lock"]
    name: Name
    value: FiniteFloat


class Named(Form):
    """A given value that the fit finds, too, or the free parameter of a profile."""

    do: Literal["free", "profile"]
    name: Name


class Apply(Form):
    """The remedy of a cause, by its number."""

    do: Literal["apply"]
    cause: Annotated[int, Field(ge=1, le=99)]


class Look(Form):
    """A record, case, result or planner's file in the working folder, which was dropped there."""

    do: Literal["look"]
    file: Name


class Correct(Form):
    """What a column of the record is: its signal ("" for none), its unit ("" as it is read)."""

    do: Literal["correct"]
    column: Name
    signal: Text
    unit: Text


class Draw(Form):
    """The drawing of an exciter."""

    do: Literal["drawing"]
    model: Name


class Make(Form):
    """The case of the record that is shown: model, step (pu), rated voltage (kV), machine data.

    With a planner's file its ``unit``, counted from 0, has the model.
    """

    do: Literal["make"]
    model: Text
    unit: Annotated[int, Field(ge=0, le=99_999)] = 0
    step: FiniteFloat | None
    kv: FiniteFloat | None
    machine: Values


class Plain(Form):
    """What needs no more than its name."""

    do: Literal["open", "fit", "stop", "save case", "save result", "save report", "discard"]


Message = Annotated[
    Try | Chosen | Bound | Lock | Named | Apply | Look | Correct | Draw | Make | Plain,
    Field(discriminator="do"),
]
FORMS: TypeAdapter[Message] = TypeAdapter(Message)


def read_message(text: str) -> Message:
    """Read a message; raises ExfitError with all that is wrong in it."""
    if len(text) > LONGEST:
        raise ExfitError(f"message: {len(text)} characters, at most {LONGEST}")
    try:
        return FORMS.validate_json(text)
    except ValidationError as fault:
        raise ExfitError(
            "; ".join(
                f"message: {'.'.join(map(str, each['loc']))}: {each['msg']}"[:300]
                for each in fault.errors(include_url=False, include_input=False)[:5]
            )
        ) from None
