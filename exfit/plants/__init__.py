"""What surrounds the exciter: the plant makes it a closed system that can be simulated."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

from exfit.engine.system import System
from exfit.models.blocks import Saturation, exponential, exponential_se, quadratic
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet
from exfit.registry import LazyPart
from exfit.registry import parts as parts_of_features
from exfit.signals import COMPARED

if TYPE_CHECKING:
    from exfit.plants.further import FurtherUnit

SaturationForm = Callable[..., Saturation]
SATURATION: Mapping[str, SaturationForm] = {
    "quadratic": quadratic,
    "exponential": exponential,
    "exponential-se": exponential_se,
}

# how the names of parameters begin, and the states of a stabiliser and a governor
MACHINE, NETWORK, STABILISER, GOVERNOR = "machine.", "network.", "stabiliser.", "governor."
LOAD_CONTROLLER, MOVING_PREF = "load controller", f"{GOVERNOR}load_controller."  # kind, names
FURTHER = "unit"  # and of those of further units, before their number
VT0 = "vt0"
DRIVING_SCALE = "driving_scale"  # what a recorded input is multiplied by
MEASURED = "vc1"  # the voltage that the exciter measures: an output, and an input added to it
BREAKER, SPEED = "breaker", "speed"  # inputs: 1 from the opening on; the recorded change of speed
FAULT = ("fault_G", "fault_B")  # inputs: the admittance of a fault at the terminals
GATE = "gate"  # an output: the opening of the gate, the valve or the fuel valve
OF_LOAD = ("PL", "QL", "YP", "YQ")  # values of a load that a test may change
SWITCHED = ("R", "X", "E", *OF_LOAD)

OF_EXCITER, OF_GOVERNOR = ("vref", "vs"), ("pref", "fs")
# inputs that are given as steps, ramps, tables or records
REFERENCES = (*OF_EXCITER, *OF_GOVERNOR)
# what a test may change in any plant, those of features among them
EVENTS = (*REFERENCES, "E", "angle", "network", "fault", BREAKER)
# what a stabiliser may listen to: pa is the accelerating power, fc the compensated frequency, none
# an input that is not in use
HEARD = ("speed", "p", "vt", "pa", "fc", "none")
LIMITER_KINDS = ("oel", "uel", "scl")  # what limiters limit, as their names begin
STATOR_CURRENT = "scl"  # of the two sides of excitation, with an output for each
GATES = {"takeover": "", "takeover-output": "_out"}  # how the inputs of an exciter end
SUMMING = "summing"
PLACES = (*GATES, SUMMING)
Requirement = Literal["exciter", "machine", "network", "governor"]
# whose equations of a unit are solved
Dialect = Literal["standard", "psse", "powerworld", "andes"]
PowerAt = Literal["recorded-voltage", "terminals"]  # where the recorded powers are


class Stabilised(NamedTuple):
    """A power system stabiliser, and the signals that it listens to."""

    model: Model
    inputs: tuple[str, ...]

    def in_dialect(self, dialect: str) -> "Stabilised":
        """Return it with the equations that another program has for it."""
        return self._replace(model=self.model.in_dialect(dialect))


class Attached(NamedTuple):
    """A limiter, and the place at which it acts on the exciter."""

    model: Model
    place: str

    @property
    def kind(self) -> str:
        """Kind of limiter, as its name begins: oel, uel, scl."""
        return self.model.name[:3].lower()

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


def acts_without_load(limiter: Attached) -> bool:
    """Test whether a limiter has something to limit on open circuit: the field current."""
    return limiter.model.inputs == ("ifd",)


def inputs_at(limiter: Attached) -> dict[str, str]:
    """Return the inputs of an exciter on which the outputs of a limiter act, by their names."""
    if limiter.place == SUMMING:
        return dict.fromkeys(limiter.signals.values(), "vsum")
    gate = GATES[limiter.place]
    return {signal: f"v{side}{gate}" for side, signal in limiter.signals.items()}


class Equipment(NamedTuple):
    """Parts and data from which a plant is built.

    ``inputs`` are the signals that tests change, ``recorded`` those that all records hold, and
    ``given`` what is known of the plant beside its data: of a network E or Q, of a playback vref.
    ``dialect`` says whose equations are solved, ``power_at`` is the place of recorded powers, and
    ``further`` are units the powers of which are recorded with this one's.
    """

    exciter: Model | None
    machine: Machine | None
    saturation: SaturationForm
    inputs: tuple[str, ...] = ("vref",)
    recorded: frozenset[str] = frozenset()
    given: frozenset[str] = frozenset()
    stabiliser: Stabilised | None = None
    dialect: Dialect = "standard"
    power_at: PowerAt = "recorded-voltage"
    governor: Model | None = None
    limiters: tuple[Attached, ...] = ()
    further: "tuple[FurtherUnit, ...]" = ()


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
    which these values are given, ``network_required`` those that must be, ``beside`` that of a
    further unit. ``per_unit`` says that voltages are those of a machine: per unit, above 0 at rest;
    ``finds_rest`` that the record shows the rest, ``has_equations`` that exfit simulates it.
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
    beside: Sheet = ()
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
    def off_line(self) -> bool:
        """Flag of an exciter that controls a machine whose breaker is open."""
        return self.closed_loop and not self.on_load

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


class Kinds(Mapping[str, PlantKind]):
    """The kinds of plant by the names that a case file gives them, each imported when asked for."""

    CORE: Mapping[str, str] = {
        "open-circuit": "open_circuit:OPEN_CIRCUIT",
        "infinite-bus": "infinite_bus:INFINITE_BUS",
        "isolated": "isolated:ISOLATED",
        "machine-on-load": "machine_on_load:MACHINE_ON_LOAD",
        "playback": "playback:PLAYBACK",
        "machine-playback": "playback:MACHINE_PLAYBACK",
        "governor-playback": "playback:GOVERNOR_PLAYBACK",
        "none": "alone:ALONE",
        "external": "outside:OUTSIDE",
        "fmu": "outside:FMU",
    }

    def __getitem__(self, name: str) -> PlantKind:
        if name in self.CORE:
            part = LazyPart(f"{__name__}.{self.CORE[name]}")
        else:
            part = parts_of_features("PLANTS")[name]
        kind: PlantKind = part.load()
        return kind

    def __contains__(self, name: object) -> bool:
        return name in self.CORE or name in parts_of_features("PLANTS")

    def __iter__(self) -> Iterator[str]:
        return iter([*self.CORE, *parts_of_features("PLANTS")])

    def __len__(self) -> int:
        return len(self.CORE) + len(parts_of_features("PLANTS"))


KINDS = Kinds()
