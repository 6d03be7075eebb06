"""The schema of the case file, section by section; pydantic checks it.

The descriptions reach editors through the JSON Schema.
"""

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
    Strict,
    Tag,
    WrapSerializer,
)

from exfit.case.messages import FILE_NAME, PERCENT
from exfit.case.ties import is_tie
from exfit.models import MACHINE_NAMES
from exfit.plants import HEARD
from exfit.signals import RECORDED
from exfit.util.strategies import DEFAULT_STRATEGY, EXPLAINED, STRATEGIES

Value = TypeVar("Value")
if TYPE_CHECKING:
    RecordedSignal = str
    Heard = str
    Strategy = str
else:
    Heard = Literal[HEARD]
    Strategy = Literal[tuple(STRATEGIES)]
    RecordedSignal = Literal[RECORDED]


def _nothing() -> Mapping[str, Any]:
    return MappingProxyType({})


def _thawed(values: Mapping[str, Any], serialize: Callable[[Any], Any]) -> Any:
    return serialize(dict(values))


def _channel(value: Any) -> Any:
    return {"column": value} if isinstance(value, str) else value


Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Count = Annotated[int, Strict(), Field(ge=1)]
SINGLE = "fit"  # name of a record that stands alone
MOST_STARTS = 1_000_000  # a day of simulations; their points alone fill 100 MB
Text = Annotated[str, Strict(), Field(min_length=1)]
Frozen = Annotated[Mapping[str, Value], AfterValidator(MappingProxyType), WrapSerializer(_thawed)]


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


# marks in brackets stand in no file: case_form takes them out of the place of a fault
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
    min: Number = Field(description="Lower bound.")
    max: Number = Field(description="Upper bound.")
    scale: Literal["log", "linear"] = Field(
        default="log", description="Scale on which it is fitted; log requires min > 0."
    )
    prior: PriorSection | None = Field(
        default=None, description="Prior knowledge, which adds one residual."
    )


class Unknown(Section):
    """A value of a record or its test that is fitted, on a linear scale."""

    start: Start = Field(description="Start value; auto: taken from the first step in the record.")
    min: Number | None = Field(default=None, description="Lower bound; not required with auto.")
    max: Number | None = Field(default=None, description="Upper bound; not required with auto.")


Findable = Annotated[
    Annotated[Number, Tag("[number]")] | Annotated[Unknown, Tag("[unknown]")],
    Discriminator(_is_unknown),
]


def known(value: "float | Unknown | None") -> float | None:
    """Return a value where it is a number: given, or the start of one that is found."""
    start = value.start if isinstance(value, Unknown) else value
    return None if start == "auto" else start


ABOUT = Field(
    default_factory=_nothing,
    description="Facts about unit and test that the report shows, under any names, such as Plant, "
    "Unit, Rated, Test date, Tested by.",
)
MACHINE = Field(description=f"Machine model: {', '.join(MACHINE_NAMES)}.")
MACHINE_DATA = Field(
    default_factory=_nothing,
    description="Machine data; a missing value is the typical one.",
)
MACHINE_FREE = Field(
    default_factory=_nothing, description="Machine data that are fitted, as under parameters.free."
)


class PlantSection(Section):
    """What surrounds the exciter."""

    @property
    def given(self) -> Mapping[str, float]:
        """The values that the case gives of the plant, beside the data of the machine."""
        return {}


class OpenCircuit(PlantSection):
    """A machine with its breaker open, at rated speed."""

    type: Literal["open-circuit"] = Field(description="Kind of plant.")
    machine: Text = MACHINE
    parameters: Frozen[Given] = MACHINE_DATA
    free: Frozen[FreeSection] = MACHINE_FREE


class InfiniteBus(PlantSection):
    """A machine behind R + jX to a source of constant voltage and frequency."""

    type: Literal["infinite-bus"] = Field(description="Kind of plant.")
    machine: Text = MACHINE
    parameters: Frozen[Given] = MACHINE_DATA
    free: Frozen[FreeSection] = MACHINE_FREE
    network: Frozen[Number] = Field(
        description="f0 (Hz); R and X to the source; P and Q, or P and E (voltage of the source) "
        "at the start; Rc and Xc of the load compensation; pu on the base of the machine."
    )

    @property
    def given(self) -> Mapping[str, float]:
        """The values of the network."""
        return self.network


class Playback(PlantSection):
    """Recorded signals drive the exciter; efd is compared."""

    type: Literal["playback"] = Field(description="Kind of plant.")
    vref: Number | None = Field(
        default=None,
        description="Reference at the start, pu; default: the one that holds the recorded efd.",
    )

    @property
    def given(self) -> Mapping[str, float]:
        """The reference, where it is given."""
        return {} if self.vref is None else {"vref": self.vref}


class MachinePlayback(PlantSection):
    """A recorded field voltage drives the machine on open circuit; vt and ifd are compared."""

    type: Literal["machine-playback"] = Field(description="Kind of plant; the case has no model.")
    machine: Text = MACHINE
    parameters: Frozen[Given] = MACHINE_DATA
    free: Frozen[FreeSection] = MACHINE_FREE


class NoPlant(PlantSection):
    """The model alone: its output is vt."""

    type: Literal["none"] = Field(description="Kind of plant.")


Plant = OpenCircuit | InfiniteBus | Playback | MachinePlayback | NoPlant
SaturationName = Literal["quadratic", "exponential", "exponential-se"]


class Stabiliser(Section):
    """A power system stabiliser; it acts on load only."""

    model: Text = Field(description="Name of the stabiliser model.")
    inputs: tuple[Heard, ...] | None = Field(
        default=None,
        min_length=1,
        description="Input signals, one or two of speed, p, vt; default: those of the model.",
    )
    parameters: Frozen[Given] = Field(
        default_factory=_nothing,
        description="Its data; a missing value is the typical one.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=_nothing, description="Parameters that are fitted."
    )


class StepSection(Section):
    """A step of a signal."""

    at: Number = Field(description="Time, s.")
    step: Number = Field(description="Change, pu; not zero.")


class FindableStep(Section):
    """A step of a signal, whose time and size may be fitted."""

    at: Findable = Field(description="Time, s; or {start, min, max} to fit it.")
    step: Findable = Field(description="Change, pu, not zero; or {start, min, max} to fit it.")


class Switch(Section):
    """A switching in the network, with the values from then on."""

    at: Number = Field(description="Time, s.")
    R: NotNegative | None = Field(default=None, description="Resistance to the source, pu.")
    X: NotNegative | None = Field(default=None, description="Reactance to the source, pu.")
    E: Positive | None = Field(
        default=None, description="Voltage of the source, pu; only if plant.network gives E."
    )


class BumpTest(Section):
    """The test: the steps that were made."""

    vt0: Findable | None = Field(
        default=None,
        description="Terminal voltage before the first step, pu, or {start, min, max} to fit it; "
        "default: mean of the record there.",
    )
    begin: Number | None = Field(
        default=None,
        description="Time at which the simulation starts in steady state, s; default: the start of "
        "the record. Give an earlier time if steps were made before the record; vt0 is then the "
        "voltage from this time on.",
    )
    steady_until: Number | None = Field(
        default=None,
        description="End of the steady state in the record, s; default: the first step.",
    )
    vref: tuple[FindableStep, ...] = Field(
        default=(), min_length=1, description="Steps of the reference, in order of time."
    )
    vs: tuple[FindableStep, ...] = Field(
        default=(), min_length=1, description="Steps of the stabiliser's signal, in order of time."
    )
    E: tuple[StepSection, ...] = Field(
        default=(),
        min_length=1,
        description="Steps of the voltage of the source; infinite-bus only.",
    )
    network: tuple[Switch, ...] = Field(
        default=(), min_length=1, description="Switchings of R, X and E; infinite-bus only."
    )
    duration: Positive | None = Field(
        default=None, description="Length of the simulation, s; only if there is no record."
    )

    @property
    def instants(self) -> tuple[float, ...]:
        """The times of all events that are given as numbers, s, in order."""
        instants = {known(step.at) for step in (*self.vref, *self.vs)}
        instants |= {event.at for event in self.E} | {switch.at for switch in self.network}
        return tuple(sorted(at for at in instants if at is not None))

    @property
    def steady(self) -> float | None:
        """The end of the steady state, s; None where the case does not give it."""
        if self.steady_until is not None:
            return self.steady_until
        return self.instants[0] if self.instants else None


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


class Compared(Section):
    """How a signal is compared with its record."""

    weight: Positive = Field(default=1.0, description="Weight of the residuals of the signal.")
    noise: Positive | None = Field(
        default=None,
        description="Standard deviation of its noise, pu, in place of a weight; give it for all "
        "compared channels or for none.",
    )
    filter: Filter | None = Field(
        default=None, description="{lowpass: Hz} or {median: samples}, for record and simulation."
    )
    outliers: Positive | None = Field(
        default=None,
        description="Leaves out samples that are farther from the running median than this many "
        "standard deviations of the noise.",
    )
    averaged: Positive | None = Field(
        default=None,
        description="Length over which the recorder averages around each sample, s; the simulation "
        "is averaged in the same way. If it averages over the time before the sample, give half "
        "of this length as delay.",
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
    scale: Findable = Field(
        default=1.0,
        description="Factor; or {start, min, max} to fit it.",
    )
    offset: Findable = Field(
        default=0.0,
        description="Added after scaling, pu; or {start, min, max} to fit it.",
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
    Annotated[ChannelSection, Tag("[column]")] | Annotated[PhasesSection, Tag("[phases]")],
    Discriminator(_kind_of_channel),
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


class RecordFile(Section):
    """A measured record: a file as a recorder writes it."""

    file: Text = Field(description="Path, relative to the case file.")
    sheet: Text | None = Field(default=None, description="Sheet of a workbook; default: its first.")
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
        WrapSerializer(_thawed),
    ] = Field(description="Measured signals: the name of a column, or a mapping.")
    window: tuple[Number, Number] | None = Field(
        default=None,
        description="Start and end of the part that is used, s; default: the whole record.",
    )
    mask: tuple[tuple[Number, Number], ...] = Field(
        default=(), description="Parts that are not compared: start and end of each, s."
    )
    gaps: Literal["refuse", "skip"] = Field(
        default="refuse", description="Whether samples without a value are refused or left out."
    )
    resample: Positive | None = Field(
        default=None,
        description="Sampling rate to which the record is reduced through an anti-alias filter, "
        "Hz; default: as recorded.",
    )
    delay: Findable = Field(
        default=0.0,
        description="Delay of the recorder, s; or {start, min, max} to fit it.",
    )


class Parameters(Section):
    """The parameters of the exciter; one that is neither fixed nor free has its typical value."""

    fixed: Frozen[Given] = Field(
        default_factory=_nothing,
        description="Values that are fixed or tied to others: numbers or formulas such as =-VAMAX.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=_nothing, description="Parameters that are fitted."
    )


class Tolerance(Section):
    """Limits at which the search has converged."""

    gradient: NotNegative = Field(default=1e-8, description="Limit on the scaled gradient.")
    step: NotNegative = Field(default=1e-10, description="Limit on the relative step.")


class Limit(Section):
    """A limit on the difference between simulated and measured signals."""

    rmse: Positive = Field(description="Root mean square error, pu.")


class Estimate(Section):
    """How the free parameters are estimated."""

    strategy: Strategy = Field(
        default=DEFAULT_STRATEGY, description=f"Method of the search. {EXPLAINED}."
    )
    jacobian: Literal["exact", "central", "forward", "backward"] = Field(
        default="exact", description="Derivatives: exact, or by differences."
    )
    iterations: Count = Field(
        default=100, description="Largest number of iterations in each phase of the strategy."
    )
    tolerance: Tolerance = Field(
        default_factory=Tolerance, description="Limits at which the search has converged."
    )
    good_enough: Limit = Field(
        default_factory=lambda: Limit(rmse=2e-4),
        description="Error below which strategy auto accepts a match; default: rmse 2e-4.",
    )
    loss: Literal["least-squares", "huber", "soft-l1"] = Field(
        default="least-squares",
        description="Cost of a residual; huber and soft-l1 tolerate spikes.",
    )
    loss_scale: Positive = Field(
        default=1.345,
        description="Size of a residual, in standard deviations of the noise, from which huber and "
        "soft-l1 count it less than its square.",
    )
    starts: Annotated[Count, Field(le=MOST_STARTS)] = Field(
        default=1,
        description="Number of starts, distributed over the bounds; the first is that of the case.",
    )
    refine: Count | None = Field(
        default=None, description="Number of the best starts that are fitted; default: all."
    )


class SimulationSection(Section):
    """The grid of the simulation."""

    step: Positive = Field(default=0.001, description="Step of the integration, s.")
    output_step: Positive = Field(
        default=0.005, description="Spacing of the output if there is no record, s."
    )


class OffLine(PlantSection):
    """The machine of the case with its breaker open."""

    type: Literal["open-circuit"] = Field(description="Kind of plant.")


class OnLine(PlantSection):
    """The machine of the case behind R + jX to a source."""

    type: Literal["infinite-bus"] = Field(description="Kind of plant.")
    network: Frozen[Number] = Field(
        description="As plant.network: f0, R and X to the source, P and Q or E, Rc, Xc."
    )

    @property
    def given(self) -> Mapping[str, float]:
        """The values of the network."""
        return self.network


class Recording(Section):
    """A test and its record."""

    name: str = Field(
        pattern=FILE_NAME,
        max_length=100,
        description="Name of letters, digits, - _ and .; files are named after it.",
    )
    plant: Annotated[OffLine | OnLine, Field(discriminator="type")] | None = Field(
        default=None, description="Plant of this record, if it differs from that of the case."
    )
    test: BumpTest = Field(description="The steps that were made.")
    record: RecordFile = Field(description="The measured signals.")


class CaseDocument(Section):
    """A model, its plant, a test, its record, and the parameters to be fitted."""

    about: Frozen[Fact] = ABOUT
    model: Text | None = Field(
        default=None,
        description="Name of a model, in upper or lower case, or path of a .py file; none with "
        "plant machine-playback.",
    )
    saturation: SaturationName = Field(
        default="quadratic", description="Form of the exciter's saturation curve."
    )
    plant: Annotated[Plant, Field(discriminator="type")] = Field(
        description="The plant: what surrounds the exciter during the test."
    )
    stabiliser: Stabiliser | None = Field(
        default=None, description="A power system stabiliser; it acts on load only."
    )
    test: BumpTest | None = Field(
        default=None,
        description="The steps that were made; with records, each of them has its own.",
    )
    record: RecordFile | None = Field(
        default=None, description="The measured signals; not required by simulate."
    )
    records: tuple[Recording, ...] = Field(
        default=(),
        min_length=1,
        description="In place of test and record: several tests with their records, in one fit.",
    )
    parameters: Parameters = Field(
        default_factory=Parameters, description="Fixed and free parameters of the exciter."
    )
    estimate: Estimate = Field(
        default_factory=Estimate, description="How the free parameters are estimated."
    )
    simulation: SimulationSection = Field(
        default_factory=SimulationSection, description="The grid of the simulation."
    )
    validations: tuple[Recording, ...] = Field(
        default=(),
        alias="validate",
        description="Records on which the result is validated; they are not used in the fit.",
    )
    accept: Limit | None = Field(
        default=None,
        description="Limit of the error of a validation; beyond it the exit code is 3.",
    )
