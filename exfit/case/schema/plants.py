"""The sections of the case file about what surrounds the exciter."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import Discriminator, Field, Tag

from exfit.case.schema.values import (
    STATED,
    STD_ERRORS,
    Count,
    FreeSection,
    Frozen,
    Given,
    Known,
    Later,
    Number,
    Positive,
    Section,
    Sourced,
    Sources,
    StdErrors,
    Text,
    nothing,
)
from exfit.models import MACHINE_NAMES
from exfit.plants import HEARD, PLACES, Dialect, PowerAt

if TYPE_CHECKING:
    Heard = str
    Place = str
else:
    Heard = Literal[HEARD]
    Place = Literal[PLACES]

DIALECT = "Whose equations are solved; see [On load](../plants.md#on-load)."
ISOLATED = Field(description="f0, PL, QL, IP, IQ, YP, YQ, Ra, Rc, Xc: as of infinite-bus.")
LOAD = Field(description="P and Q until the breaker opens, pu on the base of the machine.")


class PlantSection(Section):
    """What surrounds the exciter."""

    type: str

    @property
    def given(self) -> Mapping[str, float]:
        """The values that the case gives of the plant, beside the data of the machine."""
        return {}


class WithData(PlantSection):
    """A plant with the data of a machine."""

    parameters: Frozen[Given] = Field(
        default_factory=nothing, description="Machine data; a missing value is the typical one."
    )
    free: Frozen[Later[FreeSection]] = Field(
        default_factory=nothing,
        description="Machine data that are fitted, as under parameters.free.",
    )
    sources: Sources = STATED
    std_errors: StdErrors = STD_ERRORS


class WithMachine(WithData):
    """A plant with a machine of exfit."""

    machine: Text = Field(description=f"Machine model: {', '.join(MACHINE_NAMES)}.")


class WithNetwork(PlantSection):
    """A plant with a network."""

    network: Frozen[Known]

    @property
    def given(self) -> Mapping[str, float]:
        """The values of the network."""
        return self.network


class OpenCircuit(WithMachine):
    """A machine with its breaker open, at rated speed."""

    type: Literal["open-circuit"] = Field(description="Kind of plant.")
    dialect: Dialect = Field(default="standard", description=DIALECT)


class InfiniteBus(WithMachine, WithNetwork):
    """A machine behind R + jX to a source of constant voltage and frequency."""

    type: Literal["infinite-bus"] = Field(description="Kind of plant.")
    network: Frozen[Known] = Field(
        description="f0 (Hz); R and X to the source; P and Q, or P and E (voltage of the source) "
        "at the start; Ra of the stator; Rc and Xc of the load compensation. PL, QL, IP, IQ, YP "
        "and YQ: a load at the far bus, where R and X end, of constant power, current "
        "and admittance, each at 1 pu of voltage; Rs and Xs from there to the source. pu on the "
        "base of the machine."
    )
    dialect: Dialect = Field(default="standard", description=DIALECT)


class Isolated(InfiniteBus):
    """A unit alone on a load at its terminals."""

    type: Literal["isolated"] = Field(description="Kind of plant.")  # type: ignore[assignment]
    network: Frozen[Known] = ISOLATED


class GridPlayback(WithMachine, WithNetwork):
    """A unit driven by the voltage and the angle or frequency that were recorded in a grid event.

    Its p and q, and what else was recorded, are compared.
    """

    type: Literal["grid-playback"] = Field(description="Kind of plant.")
    network: Frozen[Known] = Field(
        description="f0 (Hz); R and X of the step-up transformer, where vt and its angle are "
        "recorded on its other side; P and Q at the start where p or q is not recorded; Ra of "
        "the stator; Rc and Xc of the load compensation; pu on the base of the machine."
    )
    dialect: Dialect = Field(default="standard", description=DIALECT)
    power_at: PowerAt = Field(
        default="recorded-voltage",
        description="Where p and q are recorded, and given: at the recorded voltage, or at the "
        "terminals.",
    )


class MachineOnLoad(WithMachine, WithNetwork):
    """A machine alone that is at rest on load until its breaker opens.

    Its field voltage stays, or is that of the record's channel efd.
    """

    type: Literal["machine-on-load"] = Field(description="Kind of plant; the case has no model.")
    network: Frozen[Known] = LOAD


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


class MachinePlayback(WithMachine):
    """A recorded field voltage drives the machine on open circuit; vt and ifd are compared."""

    type: Literal["machine-playback"] = Field(description="Kind of plant; the case has no model.")


class GovernorPlayback(PlantSection):
    """A recorded speed drives the governor; p and the gate are compared."""

    type: Literal["governor-playback"] = Field(description="Kind of plant; the case has no model.")


class NoPlant(PlantSection):
    """The model alone: its output is vt."""

    type: Literal["none"] = Field(description="Kind of plant.")


class PlantElsewhere(WithData):
    """A unit that exfit does not simulate; its twin, a plant of exfit, has all else.

    The keys of the twin stand beside those of what simulates it. Without a twin the parameters are
    those that the case names, and derivatives are quotients of the runs.
    """

    twin: Literal["open-circuit", "infinite-bus"] | None = Field(
        default=None,
        description="The plant of exfit that gives the exact derivatives; default: none, they are "
        "finite differences of runs.",
    )
    parallel: Count = Field(default=1, description="Number of its processes that run in parallel.")
    time_limit: Positive = Field(default=60.0, description="Time limit of each run, s.")
    names: Frozen[Text] = Field(
        default_factory=nothing,
        description="Names of its parameters, where they differ, such as KA: K_A.",
    )
    machine: Text | None = Field(default=None, description="Machine model of the twin.")
    network: Frozen[Known] = Field(
        default_factory=nothing, description="Network of the twin infinite-bus."
    )
    dialect: Dialect = Field(default="standard", description=DIALECT)

    @property
    def plant(self) -> "OpenCircuit | InfiniteBus | Self":
        """The twin as a plant of its own, or this one where it has none."""
        if self.twin is None:
            return self
        twin = OpenCircuit if self.twin == "open-circuit" else InfiniteBus
        shared = {key: getattr(self, key) for key in twin.model_fields}
        return twin.model_construct(**{**shared, "type": self.twin})


class ExternalPlant(PlantElsewhere):
    """A unit that another program simulates; its twin, a plant of exfit, has all else.

    The keys of the twin stand beside those of the program. Without a twin the parameters are those
    that the case names, and derivatives are quotients of the program's runs.
    """

    type: Literal["external"] = Field(description="Kind of plant.")
    command: tuple[Text, ...] = Field(
        min_length=1,
        description="The program with its arguments; it runs in the folder of the case.",
    )

    @property
    def simulator(self) -> str:
        """What simulates the unit."""
        return " ".join(self.command)


class FmuPlant(PlantElsewhere):
    """A unit that is a functional mock-up unit (FMU); its twin, a plant of exfit, has all else.

    The keys of the twin stand beside those of the FMU. Without a twin the parameters are those
    that the case names, and derivatives are quotients of the FMU's runs.
    """

    type: Literal["fmu"] = Field(description="Kind of plant.")
    file: Text = Field(description="The FMU, of FMI 2 or 3: a path, relative to the case file.")
    interface: Literal["co-simulation", "model-exchange"] | None = Field(
        default=None,
        description="How it is run; default: co-simulation where the FMU has it.",
    )
    inputs: Frozen[Text] = Field(
        default_factory=nothing,
        description="Names of its inputs, where they differ, such as vref: avr.dVref.",
    )
    outputs: Frozen[Text] = Field(
        default_factory=nothing,
        description="Names of the compared variables, where they differ, such as vt: gen.V.",
    )

    @property
    def simulator(self) -> str:
        """What simulates the unit."""
        return PurePath(self.file).name


def kind_of_plant(value: Any) -> Any:
    """Tell kinds of plants apart, for pydantic; what is none has the kind that says so."""
    if isinstance(value, Mapping):
        return value.get("type")
    return getattr(value, "type", "open-circuit")


Plant = Annotated[
    Annotated[Later[OpenCircuit], Tag("open-circuit")]
    | Annotated[Later[InfiniteBus], Tag("infinite-bus")]
    | Annotated[Later[Isolated], Tag("isolated")]
    | Annotated[Later[GridPlayback], Tag("grid-playback")]
    | Annotated[Later[Playback], Tag("playback")]
    | Annotated[Later[MachinePlayback], Tag("machine-playback")]
    | Annotated[Later[GovernorPlayback], Tag("governor-playback")]
    | Annotated[Later[MachineOnLoad], Tag("machine-on-load")]
    | Annotated[Later[NoPlant], Tag("none")]
    | Annotated[Later[ExternalPlant], Tag("external")]
    | Annotated[Later[FmuPlant], Tag("fmu")],
    Discriminator(kind_of_plant),
]
SaturationName = Literal["quadratic", "exponential", "exponential-se"]


class AddedModel(Section):
    """A model with its data."""

    model: Text = Field(description="Name of the model.")
    parameters: Frozen[Given] = Field(
        default_factory=nothing,
        description="Its data; a missing value is the typical one.",
    )
    free: Frozen[Later[FreeSection]] = Field(
        default_factory=nothing, description="Parameters that are fitted."
    )
    sources: Sources = STATED
    std_errors: StdErrors = STD_ERRORS


WholePlant = type[OpenCircuit] | type[InfiniteBus] | type[Isolated] | type[MachineOnLoad]


class OffLine(PlantSection):
    """The machine of the case with its breaker open."""

    type: Literal["open-circuit"] = Field(description="Kind of plant.")
    whole: ClassVar[WholePlant] = OpenCircuit


class OnLine(WithNetwork):
    """The machine of the case behind R + jX to a source."""

    type: Literal["infinite-bus"] = Field(description="Kind of plant.")
    whole: ClassVar[WholePlant] = InfiniteBus
    network: Frozen[Sourced] = Field(
        description="As plant.network: f0, R and X to the source, P and Q or E, Ra, Rc, Xc, a "
        "load at the far bus."
    )
    dialect: Dialect = Field(default="standard", description=DIALECT)
    sources: Sources = STATED


class AloneOnItsLoad(OnLine):
    """The unit of the case alone on a load."""

    type: Literal["isolated"] = Field(description="Kind of plant.")  # type: ignore[assignment]
    whole: ClassVar[WholePlant] = Isolated
    network: Frozen[Sourced] = ISOLATED


class AloneOnLoad(WithNetwork):
    """The machine of the case without its exciter, on load until its breaker opens."""

    type: Literal["machine-on-load"] = Field(description="Kind of plant.")
    whole: ClassVar[WholePlant] = MachineOnLoad
    network: Frozen[Sourced] = LOAD
    sources: Sources = STATED


OwnPlant = Annotated[
    Annotated[Later[OffLine], Tag("open-circuit")]
    | Annotated[Later[OnLine], Tag("infinite-bus")]
    | Annotated[Later[AloneOnItsLoad], Tag("isolated")]
    | Annotated[Later[AloneOnLoad], Tag("machine-on-load")],
    Discriminator(kind_of_plant),
]


class Stabiliser(AddedModel):
    """A power system stabiliser; it acts on load only."""

    inputs: tuple[Heard, ...] | None = Field(
        default=None,
        min_length=1,
        description="Input signals, one or two of speed, p, vt, pa (accelerating power), fc "
        "(compensated frequency) and none; default: those of the model.",
    )


class Governor(AddedModel):
    """A turbine with its governor; it acts where the speed follows from the power."""

    load_controller: Later[AddedModel] | None = Field(
        default=None, description="A load controller, LCFB1, which moves its reference."
    )


class FurtherUnitSection(Section):
    """A further unit, the powers of which are recorded together with those of the case's."""

    exciter: Later[AddedModel] = Field(description="Its exciter.")
    machine: Later[AddedModel] = Field(description="Its machine.")
    stabiliser: Later[Stabiliser] | None = Field(default=None, description="Its stabiliser.")
    governor: Later[Governor] | None = Field(default=None, description="Its governor.")
    network: Frozen[Known] = Field(
        description="base: its MVA over those of the case's unit; share_P and share_Q: what it has "
        "of p and q at the start; R, X, Ra, Rc and Xc as of the case's unit. pu on its base."
    )
    sources: Sources = STATED
    std_errors: StdErrors = STD_ERRORS


class Limiter(AddedModel):
    """A limiter of over- or underexcitation."""

    place: Place | None = Field(
        default=None,
        description="Where it acts on the exciter: takeover, the gate of its kind; "
        "takeover-output, a second gate at the output of the regulator, where the model has one; "
        "summing, added to the voltage error. Default: the usual place of the model.",
    )
