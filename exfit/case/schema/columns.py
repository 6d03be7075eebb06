"""The sections of the case file about the columns of a file: its clock, and filters."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Discriminator, Field, Tag

from exfit.case.schema.values import Count, Positive, Section, Text


class LowPassSection(Section):
    """A low-pass filter, applied forwards and backwards, so without delay."""

    lowpass: Positive = Field(description="Cut-off frequency, Hz.")


class MedianSection(Section):
    """A running median."""

    median: Count = Field(description="Number of samples, odd.")


def _is_median(value: Any) -> str:
    median = isinstance(value, MedianSection) or (isinstance(value, dict) and "median" in value)
    return "[median]" if median else "[lowpass]"


Filter = Annotated[
    Annotated[LowPassSection, Tag("[lowpass]")] | Annotated[MedianSection, Tag("[median]")],
    Discriminator(_is_median),
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
    | Annotated[TimeColumn, Tag("[column]")],
    Discriminator(_kind_of_clock),
]
