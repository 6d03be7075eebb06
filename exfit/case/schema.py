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
    """What is known of a parameter beside the record: a value with its standard deviation."""

    mean: Number = Field(description="Value, as a data sheet has it.")
    std: Spread = Field(description="Standard deviation, a number or a share such as 20 %.")

    @property
    def sigma(self) -> float:
        """The standard deviation in the parameter's own unit."""
        if isinstance(self.std, str):
            return abs(self.mean) * float(self.std.rstrip("% ")) / 100.0
        return self.std


class FreeSection(Section):
    """A parameter that the fit may change."""

    start: Number = Field(description="Value from which the fit starts.")
    min: Number = Field(description="Lower bound.")
    max: Number = Field(description="Upper bound.")
    scale: Literal["log", "linear"] = Field(
        default="log", description="Scale on which the fit moves it; log needs min > 0."
    )
    prior: PriorSection | None = Field(default=None, description="What is known of it beforehand.")


class Unknown(Section):
    """A value of a record or its test that the fit finds, on a linear scale."""

    start: Start = Field(
        description="Value from which the fit starts; auto: as the record shows the first step."
    )
    min: Number | None = Field(default=None, description="Lower bound; auto needs none.")
    max: Number | None = Field(default=None, description="Upper bound; auto needs none.")


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
    description="What identifies unit and test in a report, under names of your own, such as "
    "Plant, Unit, Rated, Test date, Tested by.",
)
MACHINE = Field(description="Machine model: GENROU, GENROE, GENSAL, GENSAE or ONE_AXIS.")
MACHINE_DATA = Field(
    default_factory=_nothing,
    description="Machine data; what is missing takes its typical value.",
)
MACHINE_FREE = Field(
    default_factory=_nothing, description="Machine data that are fitted, as parameters.free."
)


class PlantSection(Section):
    """What surrounds the exciter."""

    @property
    def given(self) -> Mapping[str, float]:
        """What is known of the plant beside the data of the machine, as the case gives it."""
        return {}


class OpenCircuit(PlantSection):
    """A machine whose breaker is open, at rated speed."""

    type: Literal["open-circuit"] = Field(description="What surrounds the exciter.")
    machine: Text = MACHINE
    parameters: Frozen[Given] = MACHINE_DATA
    free: Frozen[FreeSection] = MACHINE_FREE


class InfiniteBus(PlantSection):
    """A machine behind R + jX to a source of constant voltage and frequency."""

    type: Literal["infinite-bus"] = Field(description="What surrounds the exciter.")
    machine: Text = MACHINE
    parameters: Frozen[Given] = MACHINE_DATA
    free: Frozen[FreeSection] = MACHINE_FREE
    network: Frozen[Number] = Field(
        description="f0 (Hz); R and X to the source; P and Q, or P and E (the source's voltage) at "
        "the start; Rc and Xc of the load compensation; pu on the machine's base."
    )

    @property
    def given(self) -> Mapping[str, float]:
        """The values of the network."""
        return self.network


class Playback(PlantSection):
    """Recorded signals drive the exciter; efd is compared."""

    type: Literal["playback"] = Field(description="What surrounds the exciter: the record.")
    vref: Number | None = Field(
        default=None,
        description="The reference at the start, pu, where it is known; default: the one that "
        "holds the recorded efd.",
    )

    @property
    def given(self) -> Mapping[str, float]:
        """The reference, where it is known."""
        return {} if self.vref is None else {"vref": self.vref}


class MachinePlayback(PlantSection):
    """A recorded field voltage drives the machine on open circuit; vt and ifd are compared."""

    type: Literal["machine-playback"] = Field(description="The machine alone; there is no model.")
    machine: Text = MACHINE
    parameters: Frozen[Given] = MACHINE_DATA
    free: Frozen[FreeSection] = MACHINE_FREE


class NoPlant(PlantSection):
    """The model alone: its output is vt."""

    type: Literal["none"] = Field(description="What surrounds the model: nothing.")


Plant = OpenCircuit | InfiniteBus | Playback | MachinePlayback | NoPlant
SaturationName = Literal["quadratic", "exponential", "exponential-se"]


class Stabiliser(Section):
    """A power system stabiliser, which acts on load."""

    model: Text = Field(description="Stabiliser model of the catalogue.")
    inputs: tuple[Heard, ...] | None = Field(
        default=None,
        min_length=1,
        description="What it listens to, one or two of speed, p, vt; default: as its model says.",
    )
    parameters: Frozen[Given] = Field(
        default_factory=_nothing,
        description="Its data; what is missing takes its typical value.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=_nothing, description="Values that are fitted."
    )


class StepSection(Section):
    """A step of a signal."""

    at: Number = Field(description="Instant, s.")
    step: Number = Field(description="Change, pu; not zero.")


class FindableStep(Section):
    """A step of a signal, whose instant and size the fit may find."""

    at: Findable = Field(description="Instant, s; or {start, min, max}, and the fit finds it.")
    step: Findable = Field(
        description="Change, pu, not zero; or {start, min, max}, and the fit finds it."
    )


class Switch(Section):
    """A switching in the network: the values that it has from then on."""

    at: Number = Field(description="Instant, s.")
    R: NotNegative | None = Field(default=None, description="Resistance to the source, pu.")
    X: NotNegative | None = Field(default=None, description="Reactance to the source, pu.")
    E: Positive | None = Field(
        default=None, description="Voltage of the source, pu; only where plant.network gives E."
    )


class BumpTest(Section):
    """What was done to the unit."""

    vt0: Findable | None = Field(
        default=None,
        description="Voltage before the first step, pu; default: mean of the record there; or "
        "{start, min, max}, and the fit finds it.",
    )
    begin: Number | None = Field(
        default=None,
        description="Where the simulation starts at rest, s; default: with the record. Earlier "
        "than the record, for steps that were made before it; then vt0 holds from here on.",
    )
    steady_until: Number | None = Field(
        default=None,
        description="Until when the record is at rest, s; default: the first step.",
    )
    vref: tuple[FindableStep, ...] = Field(
        default=(), min_length=1, description="Steps of the reference, in the order of time."
    )
    vs: tuple[FindableStep, ...] = Field(
        default=(), min_length=1, description="Steps of the stabiliser's signal, in its place."
    )
    E: tuple[StepSection, ...] = Field(
        default=(), min_length=1, description="Steps of the source's voltage; infinite-bus."
    )
    network: tuple[Switch, ...] = Field(
        default=(), min_length=1, description="Switchings of R, X and E; infinite-bus."
    )
    duration: Positive | None = Field(
        default=None, description="Length of the simulation, s; only where there is no record."
    )

    @property
    def instants(self) -> tuple[float, ...]:
        """When something is done, as far as it is known, s, in the order of time."""
        instants = {known(step.at) for step in (*self.vref, *self.vs)}
        instants |= {event.at for event in self.E} | {switch.at for switch in self.network}
        return tuple(sorted(at for at in instants if at is not None))

    @property
    def steady(self) -> float | None:
        """Until when the unit is at rest, s; None where nothing tells."""
        if self.steady_until is not None:
            return self.steady_until
        return self.instants[0] if self.instants else None


class LowPassSection(Section):
    """A low-pass filter, run forwards and backwards."""

    lowpass: Positive = Field(description="Cut-off frequency, Hz.")


class MedianSection(Section):
    """A running median."""

    median: Count = Field(description="Samples, an odd number.")


def _is_median(value: Any) -> str:
    median = isinstance(value, MedianSection) or (isinstance(value, dict) and "median" in value)
    return "[median]" if median else "[lowpass]"


Filter = Annotated[
    Annotated[LowPassSection, Tag("[lowpass]")] | Annotated[MedianSection, Tag("[median]")],
    Discriminator(_is_median),
]


class Compared(Section):
    """How the record of a signal counts."""

    weight: Positive = Field(default=1.0, description="Weight of the signal in the fit.")
    noise: Positive | None = Field(
        default=None,
        description="Standard deviation of its noise, pu, in place of a weight; all channels that "
        "are compared, or none.",
    )
    filter: Filter | None = Field(
        default=None, description="{lowpass: Hz} or {median: samples}; simulation and record alike."
    )
    outliers: Positive | None = Field(
        default=None,
        description="Leave out samples farther from the running median than so many standard "
        "deviations of the noise.",
    )
    averaged: Positive | None = Field(
        default=None,
        description="Over how long the recorder averages about each instant, s: the simulation is "
        "averaged alike. A mean over the time before it is late by half of this: give that as "
        "delay.",
    )


class ChannelSection(Compared):
    """Where a signal stands and how it becomes per unit: column / base * scale + offset."""

    column: Text = Field(description="Name of the column.")
    unit: Text | None = Field(
        default=None, description="Unit of the column's numbers, such as kV, V, A, MW, pu or %."
    )
    base: Positive | None = Field(
        default=None,
        description="What 1 pu is, in that unit; of ifd the field current on the air-gap line at "
        "rated voltage.",
    )
    scale: Findable = Field(
        default=1.0,
        description="Factor on the column's numbers; or {start, min, max}, and the fit finds it.",
    )
    offset: Findable = Field(
        default=0.0,
        description="What is added after scaling, pu; or {start, min, max}, and the fit finds it.",
    )


class PhasesSection(Compared):
    """The terminal voltage from three phases: that of the positive sequence."""

    phases: tuple[Text, Text, Text] = Field(
        description="Columns of the three phases, in their order."
    )
    kind: Literal["waveform", "rms"] = Field(
        description="waveform: instantaneous values, of which the positive sequence is taken; rms: "
        "RMS values, of which the mean is taken."
    )
    unit: Text = Field(description="Unit of the columns and of base, such as V or kV.")
    base: Positive = Field(description="Rated voltage, RMS, line to line, in that unit.")
    connection: Literal["phase-to-ground", "phase-to-phase"] = Field(
        description="Between what the voltages are recorded: a factor of sqrt(3)."
    )
    cycles: Count = Field(
        default=1, description="Length of the window, in whole cycles; of waveforms."
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
        description="Column with the time, s or as the file says; or [date, time of day], two "
        "columns; or {column, unit}. Timestamps count from the first."
    )
    channels: Annotated[
        Mapping[
            RecordedSignal,
            Annotated[Entry, BeforeValidator(_channel, json_schema_input_type=Text | Entry)],
        ],
        Field(min_length=1),
        AfterValidator(MappingProxyType),
        WrapSerializer(_thawed),
    ] = Field(description="Measured signals, each a column or {column, scale, offset, weight}.")
    window: tuple[Number, Number] | None = Field(
        default=None, description="First and last instant used, s; default: the whole record."
    )
    mask: tuple[tuple[Number, Number], ...] = Field(
        default=(), description="Stretches that are not compared, each its first and last instant."
    )
    gaps: Literal["refuse", "skip"] = Field(
        default="refuse", description="What to do where a channel has no number."
    )
    resample: Positive | None = Field(
        default=None,
        description="Rate of a slower, even clock that the record is put on through an anti-alias "
        "filter, Hz; default: as recorded.",
    )
    delay: Findable = Field(
        default=0.0,
        description="By how much the recorder is late, s; or {start, min, max}, and the fit finds "
        "it.",
    )


class Parameters(Section):
    """The exciter's parameters; what is neither fixed nor free takes its typical value."""

    fixed: Frozen[Given] = Field(
        default_factory=_nothing,
        description="Values that stay, or follow others: numbers, or arithmetic such as =-VAMAX.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=_nothing, description="Values that are fitted."
    )


class Tolerance(Section):
    """When the estimator stops as converged."""

    gradient: NotNegative = Field(default=1e-8, description="Limit on the scaled gradient.")
    step: NotNegative = Field(default=1e-10, description="Limit on the relative step.")


class Limit(Section):
    """A limit on how far simulated and measured signals may differ."""

    rmse: Positive = Field(description="Root mean square error, pu.")


class Estimate(Section):
    """How the free parameters are found."""

    strategy: Strategy = Field(
        default=DEFAULT_STRATEGY, description=f"How the search goes. {EXPLAINED}."
    )
    jacobian: Literal["exact", "central", "forward", "backward"] = Field(
        default="exact", description="Derivatives: exact, or by differences."
    )
    iterations: Count = Field(
        default=100, description="Most iterations of each phase of the strategy."
    )
    tolerance: Tolerance = Field(default_factory=Tolerance, description="When to stop.")
    good_enough: Limit = Field(
        default_factory=lambda: Limit(rmse=2e-4),
        description="What strategy auto calls a match; default: rmse 2e-4.",
    )
    loss: Literal["least-squares", "huber", "soft-l1"] = Field(
        default="least-squares", description="What an error costs; huber and soft-l1 bear spikes."
    )
    loss_scale: Positive = Field(
        default=1.345,
        description="From how many standard deviations of the noise on an error costs less than "
        "its square.",
    )
    starts: Annotated[Count, Field(le=MOST_STARTS)] = Field(
        default=1, description="Starts spread over the bounds, beside the case's own."
    )
    refine: Count | None = Field(
        default=None, description="How many of the best starts are fitted; default: all."
    )


class SimulationSection(Section):
    """The grid of the simulation."""

    step: Positive = Field(default=0.001, description="Step of the integration, s.")
    output_step: Positive = Field(
        default=0.005, description="Spacing of the output where there is no record, s."
    )


class OffLine(PlantSection):
    """The case's machine with its breaker open."""

    type: Literal["open-circuit"] = Field(description="What surrounds the exciter.")


class OnLine(PlantSection):
    """The case's machine behind R + jX to a source."""

    type: Literal["infinite-bus"] = Field(description="What surrounds the exciter.")
    network: Frozen[Number] = Field(
        description="As plant.network: f0, R and X to the source, P and Q or E, Rc, Xc."
    )

    @property
    def given(self) -> Mapping[str, float]:
        """The values of the network."""
        return self.network


class Recording(Section):
    """A test and what was measured at it."""

    name: str = Field(
        pattern=FILE_NAME,
        max_length=100,
        description="Name, of letters, digits, - _ and .; files are named after it.",
    )
    plant: Annotated[OffLine | OnLine, Field(discriminator="type")] | None = Field(
        default=None, description="What surrounds the exciter, where that is not the case's plant."
    )
    test: BumpTest = Field(description="What was done to the unit.")
    record: RecordFile = Field(description="What was measured.")


class CaseDocument(Section):
    """A study of exfit: a model, its plant, a test, its record, and what is to be found."""

    about: Frozen[Fact] = ABOUT
    model: Text | None = Field(
        default=None,
        description="Model of the catalogue, in upper or lower case, or path of a .py file; none "
        "with plant machine-playback.",
    )
    saturation: SaturationName = Field(
        default="quadratic", description="Form of the exciter's saturation curve."
    )
    plant: Annotated[Plant, Field(discriminator="type")] = Field(
        description="What surrounds the exciter."
    )
    stabiliser: Stabiliser | None = Field(
        default=None, description="A power system stabiliser; on open circuit it does not act."
    )
    test: BumpTest | None = Field(
        default=None, description="What was done to the unit; each of the records has its own."
    )
    record: RecordFile | None = Field(
        default=None, description="What was measured; a simulation does without."
    )
    records: tuple[Recording, ...] = Field(
        default=(),
        min_length=1,
        description="In place of test and record: several tests with their records, fitted as one.",
    )
    parameters: Parameters = Field(
        default_factory=Parameters, description="What is known and what is to be found."
    )
    estimate: Estimate = Field(
        default_factory=Estimate, description="How the free parameters are found."
    )
    simulation: SimulationSection = Field(
        default_factory=SimulationSection, description="The grid of the simulation."
    )
    validations: tuple[Recording, ...] = Field(
        default=(), alias="validate", description="Records on which the result is tried."
    )
    accept: Limit | None = Field(
        default=None, description="What a validation must keep to; beyond it the exit code is 3."
    )
