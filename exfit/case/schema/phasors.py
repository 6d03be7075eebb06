"""The sections of the case file about the file of a PMU: its phasors and its flags."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from exfit.case.schema.values import Positive, Section, Text

AngleUnit = Literal["deg", "rad"]


def _several(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


Columns = Annotated[
    tuple[Text, ...],
    Field(min_length=1, max_length=3),
    BeforeValidator(_several, json_schema_input_type=Text | tuple[Text, ...]),
]
MAGNITUDE = Field(
    description="Column of the magnitude (rms) of the positive sequence, or of the three phases."
)
ANGLE = Field(description="Column of the angle, or those of the three phases.")
ANGLE_UNIT = Field(description="Unit of the angles.")


class VoltagePhasor(Section):
    """The voltage phasor of a PMU."""

    magnitude: Columns = MAGNITUDE
    angle: Columns = ANGLE
    unit: Text = Field(description="Unit of the magnitude, such as kV, V or pu.")
    angle_unit: AngleUnit = ANGLE_UNIT
    connection: Literal["phase-to-ground", "phase-to-phase"] | None = Field(
        default=None,
        description="Whether the magnitude is that from phase to ground or from phase to phase, "
        "which differ by sqrt(3); required unless it is in pu.",
    )


class CurrentPhasor(Section):
    """The current phasor of a PMU, out of the unit."""

    magnitude: Columns = MAGNITUDE
    angle: Columns = ANGLE
    unit: Text = Field(description="Unit of the magnitude, such as A, kA or pu.")
    angle_unit: AngleUnit = ANGLE_UNIT


class PhasorsSection(Section):
    """The phasors of a PMU; the power, in per unit, is voltage * conj(current)."""

    voltage: VoltagePhasor = Field(description="The voltage: phasors.vt and phasors.angle.")
    current: CurrentPhasor | None = Field(
        default=None, description="The current: phasors.p, phasors.q and phasors.it."
    )
    kV: Positive | None = Field(
        default=None, description="Rated voltage, line to line, kV; required unless all is in pu."
    )
    MVA: Positive | None = Field(
        default=None, description="Rated power, MVA; required with a current that is not in pu."
    )


class StatusSection(Section):
    """The flags of the rows of a file."""

    column: Text = Field(description="Name of the column.")
    accept: tuple[Text | int, ...] = Field(
        default=(),
        description="Entries that are good; default: words STAT of C37.118 without data error, in "
        "synchronism and sorted by time; or good, ok, valid.",
    )
