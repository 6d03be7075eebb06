"""The schema of the case file, section by section; pydantic checks it.

The descriptions reach editors through the JSON Schema.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    WrapSerializer,
)

FILE_NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"

Value = TypeVar("Value")
Signal = Literal["vt", "efd", "ifd", "p", "q", "vref"]
Heard = Literal["speed", "p", "vt"]


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
Text = Annotated[str, Strict(), Field(min_length=1)]
Frozen = Annotated[Mapping[str, Value], AfterValidator(MappingProxyType), WrapSerializer(_thawed)]


class Section(BaseModel):
    """A part of the case file: unknown keys are refused, values never change."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        defer_build=True,
        field_title_generator=lambda name, _: name,
    )


class Free(Section):
    """A parameter that the fit may change."""

    start: Number = Field(description="Value from which the fit starts.")
    min: Number = Field(description="Lower bound.")
    max: Number = Field(description="Upper bound.")
    scale: Literal["log", "linear"] = Field(
        default="log", description="Scale on which the fit moves it; log needs min > 0."
    )


MACHINE = Field(description="Machine model: GENROU, GENROE, GENSAL, GENSAE or ONE_AXIS.")
MACHINE_DATA = Field(
    default_factory=_nothing,
    description="Machine data; what is missing takes its typical value.",
)
MACHINE_FREE = Field(
    default_factory=_nothing, description="Machine data that are fitted, as parameters.free."
)


class OpenCircuit(Section):
    """A machine whose breaker is open, at rated speed."""

    type: Literal["open-circuit"] = Field(description="What surrounds the exciter.")
    machine: Text = MACHINE
    parameters: Frozen[Number] = MACHINE_DATA
    free: Frozen[Free] = MACHINE_FREE


class InfiniteBus(Section):
    """A machine behind R + jX to a source of constant voltage and frequency."""

    type: Literal["infinite-bus"] = Field(description="What surrounds the exciter.")
    machine: Text = MACHINE
    parameters: Frozen[Number] = MACHINE_DATA
    free: Frozen[Free] = MACHINE_FREE
    network: Frozen[Number] = Field(
        description="f0 (Hz); R and X to the source; P and Q, or P and E (the source's voltage) at "
        "the start; Rc and Xc of the load compensation; pu on the machine's base."
    )


class Playback(Section):
    """Recorded signals drive the exciter; efd is compared."""

    type: Literal["playback"] = Field(description="What surrounds the exciter: the record.")
    vref: Number | None = Field(
        default=None,
        description="The reference at the start, pu, where it is known; default: the one that "
        "holds the recorded efd.",
    )


class MachinePlayback(Section):
    """A recorded field voltage drives the machine on open circuit; vt and ifd are compared."""

    type: Literal["machine-playback"] = Field(description="The machine alone; there is no model.")
    machine: Text = MACHINE
    parameters: Frozen[Number] = MACHINE_DATA
    free: Frozen[Free] = MACHINE_FREE


class NoPlant(Section):
    """The model alone: its output is vt."""

    type: Literal["none"] = Field(description="What surrounds the model: nothing.")


class Stabiliser(Section):
    """A power system stabiliser, which acts on load."""

    model: Text = Field(description="Stabiliser model of the catalogue.")
    inputs: tuple[Heard, ...] | None = Field(
        default=None,
        min_length=1,
        description="What it listens to, one or two of speed, p, vt; default: as its model says.",
    )
    parameters: Frozen[Number] = Field(
        default_factory=_nothing,
        description="Its data; what is missing takes its typical value.",
    )
    free: Frozen[Free] = Field(default_factory=_nothing, description="Values that are fitted.")


class Step(Section):
    """A step of a signal."""

    at: Number = Field(description="Instant, s.")
    step: Number = Field(description="Change, pu; not zero.")


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

    vt0: Number | None = Field(
        default=None,
        description="Voltage before the first step, pu; default: mean of the record there.",
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
    vref: tuple[Step, ...] = Field(
        default=(), min_length=1, description="Steps of the reference, in the order of time."
    )
    vs: tuple[Step, ...] = Field(
        default=(), min_length=1, description="Steps of the stabiliser's signal, in its place."
    )
    E: tuple[Step, ...] = Field(
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
        """When something is done, s, in the order of time."""
        steps = {step.at for step in (*self.vref, *self.vs, *self.E)}
        return tuple(sorted(steps | {switch.at for switch in self.network}))

    @property
    def steady(self) -> float | None:
        """Until when the unit is at rest, s; None where nothing tells."""
        if self.steady_until is not None:
            return self.steady_until
        return self.instants[0] if self.instants else None


class Channel(Section):
    """Where a signal stands and how it becomes per unit: column * scale + offset."""

    column: Text = Field(description="Name of the column.")
    scale: Number = Field(default=1.0, description="Factor on the column's numbers.")
    offset: Number = Field(default=0.0, description="What is added after scaling, pu.")
    weight: Positive = Field(default=1.0, description="Weight of the signal in the fit.")


class RecordFile(Section):
    """A measured record: a CSV file with a row of column names."""

    file: Text = Field(description="Path, relative to the case file.")
    time: Text = Field(description="Column with the time, s.")
    channels: Annotated[
        Mapping[
            Signal,
            Annotated[Channel, BeforeValidator(_channel, json_schema_input_type=Text | Channel)],
        ],
        Field(min_length=1),
        AfterValidator(MappingProxyType),
        WrapSerializer(_thawed),
    ] = Field(description="Measured signals, each a column or {column, scale, offset, weight}.")
    window: tuple[Number, Number] | None = Field(
        default=None, description="First and last instant used, s; default: the whole record."
    )


class Parameters(Section):
    """The exciter's parameters; what is neither fixed nor free takes its typical value."""

    fixed: Frozen[Number] = Field(default_factory=_nothing, description="Values that stay.")
    free: Frozen[Free] = Field(default_factory=_nothing, description="Values that are fitted.")


class Tolerance(Section):
    """When the estimator stops as converged."""

    gradient: NotNegative = Field(default=1e-8, description="Limit on the scaled gradient.")
    step: NotNegative = Field(default=1e-10, description="Limit on the relative step.")


class Limit(Section):
    """A limit on how far simulated and measured signals may differ."""

    rmse: Positive = Field(description="Root mean square error, pu.")


class Estimate(Section):
    """How the free parameters are found."""

    strategy: Literal["gn", "dgn", "lm", "lm-then-dgn", "auto", "robust"] = Field(
        default="lm-then-dgn",
        description="Gauss-Newton, damped Gauss-Newton, Levenberg-Marquardt, or several of them.",
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


class Simulation(Section):
    """The grid of the simulation."""

    step: Positive = Field(default=0.001, description="Step of the integration, s.")
    output_step: Positive = Field(
        default=0.005, description="Spacing of the output where there is no record, s."
    )


class Validation(Section):
    """A record the fit never sees, on which its result is tried."""

    name: str = Field(
        pattern=FILE_NAME,
        max_length=100,
        description="Name, of letters, digits, - _ and .; files are named after it.",
    )
    test: BumpTest = Field(description="What was done to the unit.")
    record: RecordFile = Field(description="What was measured.")
