"""A kind of plant as data: what it needs, what acts on it, what it shows, and how it is built."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeVar

from exfit.engine.system import System
from exfit.errors import ModelError
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet
from exfit.plants.parts import SaturationForm
from exfit.signals import COMPARED

Component = TypeVar("Component", Model, Machine)
OF_EXCITER = ("vref", "vs")
REFERENCES = (*OF_EXCITER, "pref")  # inputs that are given as steps, ramps, tables or records
LIMITER_KINDS = ("oel", "uel", "scl")  # what limiters limit, as their names begin
STATOR_CURRENT = "scl"  # of the two sides of excitation, with an output for each
Requirement = Literal["exciter", "machine", "network"]
Swing = Literal["power", "torque"]  # what Pm is in the equation of the speed
PowerAt = Literal["recorded-voltage", "terminals"]  # where the recorded powers are


class Stabilised(NamedTuple):
    """A power system stabiliser, and the signals that it listens to."""

    model: Model
    inputs: tuple[str, ...]


class Attached(NamedTuple):
    """A limiter, and the place at which it acts on the exciter."""

    model: Model
    place: str

    @property
    def kind(self) -> str:
        """Kind of limiter, as its name begins: oel, uel, scl."""
        return kind_of_limiter(self.model.name)

    @property
    def prefix(self) -> str:
        """Beginning of the names of its parameters and states."""
        return f"{self.kind}."

    @property
    def signals(self) -> Mapping[str, str]:
        """The names of its outputs by the side on which they act, oel or uel."""
        name = self.prefix + self.model.name
        if self.kind == STATOR_CURRENT:
            return {side: f"{name}.{side}" for side in ("oel", "uel")}
        return {self.kind: name}


def kind_of_limiter(name: str) -> str:
    """Kind of a limiter of the catalogue, as its name begins: oel, uel, scl."""
    return name[:3].lower()


class Equipment(NamedTuple):
    """Parts and data from which a plant is built.

    ``inputs`` are the signals that tests change, ``recorded`` those that all records hold, and
    ``given`` what is known of the plant beside its data: of a network E or Q, of a playback vref.
    ``swing`` is the form of the equation of the speed, ``power_at`` the place of recorded powers.
    """

    exciter: Model | None
    machine: Machine | None
    saturation: SaturationForm
    inputs: tuple[str, ...] = ("vref",)
    recorded: frozenset[str] = frozenset()
    given: frozenset[str] = frozenset()
    stabiliser: Stabilised | None = None
    swing: Swing = "power"
    power_at: PowerAt = "recorded-voltage"
    governor: Model | None = None
    limiters: tuple[Attached, ...] = ()


def no_network(given: Collection[str]) -> Sheet:
    """Return the data sheet of a plant without a network."""
    return ()


@dataclass(frozen=True)
class PlantKind:
    """Surroundings of an exciter; ``name`` as a case has it, ``title`` as a report has it.

    ``needs`` are the parts that a case gives, ``events`` what a test may change, ``signals`` what
    a record may hold. Of these ``driving`` drive the simulation in place of the plant: ``required``
    ones must be recorded, ``required_one_of`` some others, those ``required_if_used`` where the
    exciter uses them; ``levels`` are recorded signals whose level at the start is a parameter,
    ``scaled`` driving ones whose scale is one. ``network`` is the data sheet of the network of
    which these values are given, ``network_required`` those that must be. ``per_unit`` says that
    voltages are those of a machine: per unit, and above zero at rest; ``finds_rest`` that the rest
    before the event is found in the record, ``has_equations`` that exfit simulates it.
    """

    name: str
    title: str
    needs: tuple[Requirement, ...]
    events: tuple[str, ...]
    signals: tuple[str, ...]
    build: Callable[[Equipment], System]
    driving: tuple[str, ...] = ()
    required: tuple[str, ...] = ()
    required_one_of: tuple[str, ...] = ()
    required_if_used: tuple[str, ...] = ()
    levels: tuple[str, ...] = ()
    scaled: tuple[str, ...] = ()
    network: Callable[[Collection[str]], Sheet] = no_network
    network_required: tuple[str, ...] = ()
    per_unit: bool = True
    finds_rest: bool = False
    has_equations: bool = True

    @property
    def has_exciter(self) -> bool:
        """Flag of a plant with an exciter."""
        return "exciter" in self.needs

    @property
    def has_machine(self) -> bool:
        """Flag of a plant with a machine."""
        return "machine" in self.needs

    @property
    def on_load(self) -> bool:
        """Flag of a machine that feeds a network."""
        return "network" in self.needs

    @property
    def closed_loop(self) -> bool:
        """Flag of an exciter that controls a machine in a simulated plant."""
        return self.has_exciter and self.has_machine and not self.plays_back

    @property
    def plays_back(self) -> bool:
        """Flag of a simulation that a record drives, and that cannot be without one."""
        return bool(self.required)

    @property
    def recorded_inputs(self) -> tuple[str, ...]:
        """The inputs of which a test may take what the record shows, beside a plant."""
        return () if self.plays_back else tuple(name for name in self.events if name in REFERENCES)

    @property
    def compared(self) -> tuple[str, ...]:
        """Signals to compare with a record."""
        return tuple(signal for signal in self.signals if signal not in self.driving)


def compared(outputs: tuple[str, ...]) -> tuple[str, ...]:
    """Return those outputs of a plant that may be compared with a record."""
    return tuple(signal for signal in outputs if signal in COMPARED)


def present(component: Component | None) -> Component:
    """Return a part of the equipment; raises ModelError where it is missing."""
    if component is None:
        raise ModelError("the plant lacks its exciter or its machine")
    return component
