"""The sections of a record: how its file is read, and how its channels are compared."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    WrapSerializer,
)

from exfit.case.schema.plants import OwnPlant
from exfit.case.schema.tests import BumpTest
from exfit.case.schema.values import (
    FILE_NAME,
    Count,
    Filter,
    Findable,
    Interval,
    Later,
    NotNegative,
    Positive,
    Section,
    Text,
    Time,
    not_zero,
    thawed,
)
from exfit.signals import RECORDED
from exfit.util.file_names import LONGEST_NAME

AngleUnit = Literal["deg", "rad"]


Columns = Annotated[
    tuple[Text, ...],
    Field(min_length=1, max_length=3),
    BeforeValidator(
        lambda value: [value] if isinstance(value, str) else value,
        json_schema_input_type=Text | tuple[Text, ...],
    ),
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

    voltage: Later[VoltagePhasor] = Field(description="The voltage: phasors.vt and phasors.angle.")
    current: Later[CurrentPhasor] | None = Field(
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
        description="Entries of valid rows; default: words STAT of C37.118 without data error, in "
        "synchronism and sorted by time; or good, ok, valid.",
    )


if TYPE_CHECKING:
    RecordedSignal = str
else:
    RecordedSignal = Literal[RECORDED]
SINGLE = "fit"  # name of a record that stands alone


def _channel(value: Any) -> Any:
    return {"column": value} if isinstance(value, str) else value


class SineSection(Section):
    """A small periodic disturbance of a channel, which the fit finds with the parameters."""

    frequency: Findable = Field(
        description="Its frequency, Hz; or {start, min, max} to fit it. start: auto takes it from "
        "the residuals of a fit without it, if a line stands out of them and they are white "
        "otherwise; if not, no sine is fitted, and a note says why.",
    )


class Compared(Section):
    """How a signal is compared with its record."""

    weight: Positive = Field(default=1.0, description="Weight of the residuals of the signal.")
    noise: Positive | None = Field(
        default=None,
        description="Standard deviation of its noise, pu, instead of a weight; give it for all "
        "compared channels or for none.",
    )
    filter: Filter | None = Field(
        default=None, description="{lowpass: Hz} or {median: samples}, for record and simulation."
    )
    outliers: Positive | None = Field(
        default=None,
        description="Discards samples farther from the running median than this many standard "
        "deviations of the noise.",
    )
    averaged: NotNegative | None = Field(
        default=None,
        description="Length over which the recorder averages around each sample, s; the simulation "
        "is averaged in the same way. If it averages over the time before the sample, give half "
        "of this length as delay. 0: it does not average.",
    )
    sine: Later[SineSection] | None = Field(
        default=None,
        description="A small sine of constant amplitude, such as an oscillation of the grid, added "
        "to the simulated signal.",
    )


class ChannelSection(Compared):
    """The column of a signal and its conversion to per unit: column / base * scale + offset."""

    column: Text = Field(description="Name of the column.")
    unit: Text | None = Field(
        default=None, description="Unit of the column, such as kV, V, A, MW, pu or %."
    )
    base: Positive | None = Field(
        default=None,
        description="Value of 1 pu in that unit; for ifd the field current on the air-gap line at "
        "rated voltage.",
    )
    scale: Annotated[Findable, not_zero("must not be 0")] = Field(
        default=1.0, description="Factor; or {start, min, max} to fit it."
    )
    offset: Findable = Field(
        default=0.0, description="Added after scaling, pu; or {start, min, max} to fit it."
    )


class PhasesSection(Compared):
    """The terminal voltage from three phases: its positive sequence."""

    phases: tuple[Text, Text, Text] = Field(
        description="Columns of the three phases, in phase order."
    )
    kind: Literal["waveform", "rms"] = Field(
        description="waveform: instantaneous values, from which the positive sequence is computed; "
        "rms: RMS values, which are averaged."
    )
    unit: Text = Field(description="Unit of the columns and of base, such as V or kV.")
    base: Positive = Field(description="Rated voltage, RMS, line to line, in that unit.")
    connection: Literal["phase-to-ground", "phase-to-phase"] = Field(
        description="Whether phase-to-ground or phase-to-phase voltages are recorded."
    )
    cycles: Count = Field(
        default=1, description="Length of the window in whole cycles; waveforms only."
    )


def _kind_of_channel(value: Any) -> str:
    phases = isinstance(value, PhasesSection) or (isinstance(value, dict) and "phases" in value)
    return "[phases]" if phases else "[column]"


Entry = Annotated[
    Annotated[Later[ChannelSection], Tag("[column]")]
    | Annotated[Later[PhasesSection], Tag("[phases]")],
    Discriminator(_kind_of_channel),
]


class RecordFile(Section):
    """A measured record: a file as a recorder writes it."""

    file: Text = Field(description="Path, relative to the case file.")
    sheet: Text | None = Field(
        default=None, description="Sheet of a workbook; default: the only one with a table."
    )
    time: Time = Field(
        description="Column with the time, in s or in the unit that the file gives; or two "
        "columns, [date, time of day]; or {column, unit}. Timestamps count from the first sample."
    )
    channels: Annotated[
        Mapping[
            RecordedSignal,
            Annotated[Entry, BeforeValidator(_channel, json_schema_input_type=Text | Entry)],
        ],
        Field(min_length=1),
        AfterValidator(MappingProxyType),
        WrapSerializer(thawed),
    ] = Field(description="Measured signals: the name of a column, or a mapping.")
    phasors: Later[PhasorsSection] | None = Field(
        default=None,
        description="Voltage and current phasors of a PMU, from which the columns phasors.vt, "
        "phasors.angle, phasors.p, phasors.q and phasors.it are computed.",
    )
    status: Later[StatusSection] | None = Field(
        default=None,
        description="Column with the flags of a PMU: rows that are not valid are refused, or left "
        "out with gaps: skip.",
    )
    window: Interval | None = Field(
        default=None,
        description="Start and end of the part that is used, s; default: the whole record.",
    )
    mask: tuple[Interval, ...] = Field(
        default=(), description="Parts that are not compared: start and end of each, s."
    )
    switchings: Literal["find", "mask", "compare"] = Field(
        default="find",
        description="Whether 0.2 s before and after each switching in the grid, a jump of vt or of "
        "its angle, are left out (mask) or compared; find leaves them out and fits the times of "
        "larger ones, each between two samples; grid-playback only.",
    )
    filter: Filter | None = Field(
        default=None,
        description="{lowpass: Hz} or {median: samples}, for all channels alike, those that drive "
        "and those that are compared; its end effects are left out; grid-playback only.",
    )
    gaps: Literal["refuse", "skip"] = Field(
        default="refuse", description="Whether samples without a value are refused or left out."
    )
    repeats: Literal["refuse", "first", "last"] = Field(
        default="refuse",
        description="Which of several rows with the same time stamp is used; identical rows count "
        "as one.",
    )
    resample: Positive | None = Field(
        default=None,
        description="Sampling rate to which the record is reduced through an anti-alias filter, "
        "Hz; default: as recorded.",
    )
    memory: Positive | None = Field(
        default=None,
        description="Memory that reading the file may take, GB; default: 1, or four times the size "
        "of the file, at most 4.",
    )
    delay: Findable = Field(
        default=0.0,
        description="Delay of the recorder, s; or {start, min, max} to fit it. In a grid event: of "
        "the compared channels, relative to the driving ones.",
    )


class Recording(Section):
    """A test and its record."""

    name: str = Field(
        pattern=FILE_NAME,
        max_length=LONGEST_NAME,
        description="Name of letters, digits, - _ . and %; files are named after it.",
    )
    plant: OwnPlant | None = Field(
        default=None, description="Plant of this record, if it differs from that of the case."
    )
    test: Later[BumpTest] = Field(
        default_factory=BumpTest,
        description="The test; only a record of a grid event needs none.",
    )
    record: Later[RecordFile] = Field(description="The measured signals.")
