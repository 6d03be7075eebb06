"""The parts of a case with a data sheet: exciter, machine, network, what is added to them."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from exfit.case.schema.values import FreeSection
from exfit.case.ties import Tie, TieError, Ties, is_tie, parse
from exfit.case.yaml import Fault
from exfit.errors import ModelError
from exfit.models import GOVERNORS, LIMITERS, STABILISERS, Catalogue, find
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES, Machine
from exfit.models.sheet import (
    Limits,
    Model,
    Parameter,
    Sheet,
    contradictions,
    exponential_faults,
    typical,
)
from exfit.plants import EVENTS, GOVERNOR, KINDS, MACHINE, NETWORK, STABILISER, Attached, PlantKind
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.signals import RECORDED
from exfit.util.text import Place, near

if TYPE_CHECKING:
    from exfit.plants.further import FurtherUnit

Data = Mapping[str, Any]
Contradictions = Iterable[tuple[str, str]]

# in place of a kind that does not exist, which is a fault of its own
ANY_PLANT = replace(OPEN_CIRCUIT, events=EVENTS, signals=RECORDED)
OF_RECORD = ("vt0", "delay")  # what a fit finds about a record, under names without a dot

# an exciter's saturation as AEX exp(BEX E), from which its two points follow exactly
MEANINGS = {"AEX": "factor of the saturation curve", "BEX": "exponent of the saturation curve"}
POINTS = ("SE1", "SE2")
# the saturation at a voltage, by the form of the curve: VX = E SE is the exponential, or SE is
FORMS = {"exponential": "=AEX*exp(BEX*{0})/{0}", "exponential-se": "=AEX*exp(BEX*{0})"}


@dataclass(frozen=True)
class Part:
    """A part of a case: its kind, the model it names, the section of the file about it.

    ``values`` is the key of that section with the fixed parameters, which are those of its sheet,
    in the system under ``prefix``. ``check(values)`` yields (symbol, text) for values that
    contradict each other.
    """

    kind: str
    name: str
    prefix: str
    sheet: Sheet
    section: Place
    values: str = "parameters"
    check: Callable[[Mapping[str, float]], Contradictions] = field(
        default=contradictions, compare=False
    )

    @property
    def fixed(self) -> Place:
        """Where the file gives its fixed parameters."""
        return (*self.section, self.values)

    @property
    def free(self) -> Place | None:
        """Where the file gives its free parameters; None: it has none."""
        return None if self.values == "network" else (*self.section, "free")

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Its parameters by symbol."""
        return tuple(row.symbol for row in self.sheet)

    def resolved(self, *given: Mapping[str, float]) -> dict[str, float]:
        """Return a value for each parameter: typical unless given, the last one wins."""
        values = typical(self.sheet)
        for some in given:
            values |= {symbol: value for symbol, value in some.items() if symbol in values}
        return values


class Parts(NamedTuple):
    """The models that a case names, and all its parts."""

    exciter: Model | None
    machine: Machine | None
    stabiliser: Model | None
    governor: Model | None
    all: tuple[Part, ...]
    limiters: tuple[Attached, ...] = ()
    further: "tuple[FurtherUnit, ...]" = ()


def parts_of(data: Data, folder: Path, faults: list[Fault], model_sha256: str = "") -> Parts:
    """Return the parts of a case file's data; add a fault for a name that stands for none.

    The file of a user's own model is run only if it has the hash given, where one is.
    """

    def named(section: Any, place: Place, catalogue: Mapping[str, Any], kind: str) -> Any:
        """Find what a section names in a catalogue; add a fault where there is none."""
        name = _mapping(section).get(str(place[-1]))
        if not isinstance(name, str) or not name:
            return None
        if name.upper() not in catalogue:
            text = f"{name!r} is not a {kind} model; {near(name, catalogue)}"
            faults.append(Fault(place, text))
        return catalogue.get(name.upper())

    plant = _mapping(data.get("plant"))
    kind = kind_of(plant)
    exciter = None
    if not kind.has_equations:
        from exfit.plants.outside import stand_in

        fixed, free = _at(data, ("parameters", "fixed")), _at(data, ("parameters", "free"))
        exciter = stand_in(plant, {**fixed, **free})
    elif kind.has_exciter:
        exciter = _exciter(data, folder, faults, model_sha256)
    machine: Machine | None = None
    if kind.has_machine:
        machine = named(plant, ("plant", "machine"), MACHINES, "machine")
    added: dict[str, tuple[str, Catalogue]] = {
        "stabiliser": (STABILISER, STABILISERS),
        "governor": (GOVERNOR, GOVERNORS),
    }
    models: dict[str, Model | None] = {
        key: named(data.get(key), (key, "model"), catalogue, key)
        for key, (_, catalogue) in added.items()
    }
    parts = []
    if exciter is not None:
        exponential = str(data.get("saturation")).startswith("exponential")
        parts.append(exciter_part(exciter, exponential))
    if machine is not None:
        kinds = (kind, *map(kind_of, plants_of_records(data).values()))
        parts.append(machine_part(machine, on_load=any(kind.on_load for kind in kinds)))
    if kind.on_load:
        parts.append(network_part(_mapping(plant.get("network")), kind))
    parts += [
        added_part(key, prefix, model)
        for key, (prefix, _) in added.items()
        if (model := models[key]) is not None
    ]
    limiters: dict[str, Attached] = {}
    for at, entry in enumerate(_entries(data.get("limiters"))):
        place = ("limiters", at, "model")
        model = named(entry, place, LIMITERS, "limiter")
        if model is None:
            continue
        acts_at = entry.get("place")
        limiter = Attached(model, acts_at if isinstance(acts_at, str) else model.places[0])
        first = limiters.setdefault(limiter.kind, limiter)
        if first is limiter:
            parts.append(added_part(limiter.kind, limiter.prefix, model, ("limiters", at)))
        else:
            name = entry["model"].upper()
            text = f"{name}: a second one beside {first.model.name}; at most one of each kind"
            faults.append(Fault(place, text))
    added_models = (models["stabiliser"], models["governor"])
    found = Parts(exciter, machine, *added_models, tuple(parts), tuple(limiters.values()))
    return _with_others(found, data, kind, named)


def _with_others(found: Parts, data: Data, kind: PlantKind, named: Callable[..., Any]) -> Parts:
    """Return parts with the load controller of the governor, and with further units."""
    if "load_controller" in _mapping(data.get("governor")):
        from exfit.case.load_controller import with_load_controller

        governor, part = with_load_controller(found.governor, data, (), "", named)
        found = found._replace(governor=governor, all=(*found.all, *part))
    entries = _entries(data.get("further_units"))
    if not entries or not kind.beside:
        return found
    from exfit.case.further_units import with_further_units

    return with_further_units(found, entries, kind, named)


def kind_of(plant: Data) -> PlantKind:
    """Return the kind of a plant section; one that allows everything where there is none.

    That of a plant that exfit does not simulate is the kind of its twin, where it has one.
    """
    kind = KINDS.get(str(plant.get("type")), ANY_PLANT)
    if kind.has_equations or "twin" not in plant:
        return kind
    return KINDS.get(str(plant.get("twin")), ANY_PLANT)


def in_plant(parts: Parts, kind: PlantKind, given: Data) -> Parts:
    """Return the parts in a plant of another kind, of whose network some values are given."""
    network = (network_part(given, kind),) if kind.on_load else ()
    if kind.has_exciter:
        others = tuple(part for part in parts.all if part.kind != "network")
        return parts._replace(all=(*others, *network))
    machine = tuple(part for part in parts.all if part.kind == "machine")
    return Parts(None, parts.machine, None, None, (*machine, *network))


def plants_of_records(data: Data) -> dict[Place, Data]:
    """Return the plants that records have in place of the case's, by their place in the file."""
    return {
        (key, at, "plant"): _mapping(entry["plant"])
        for key in ("records", "validate")
        for at, entry in enumerate(_entries(data.get(key)))
        if isinstance(entry, dict) and "plant" in entry
    }


def ties_of(data: Data, parts: Parts, faults: list[Fault]) -> Ties:
    """Return the ties of a case file's data; add a fault for each that cannot be used."""
    names = [part.prefix + symbol for part in parts.all for symbol in part.symbols]
    names += helpers_of(data, parts)
    known, tied = set(names), tied_texts(data, parts)
    ties: dict[str, Tie] = {}
    for name, (place, text) in tied.items():
        try:
            tie = parse(text)
        except TieError as error:
            faults.append(Fault(place, str(error)))
            continue
        unknown = [used for used in tie.names if used not in known]
        if not unknown:
            ties[name] = tie
        for used in unknown:
            faults.append(Fault(place, f"{used} is not a parameter; {near(used, names)}"))
    try:
        return Ties(ties)
    except TieError as error:
        first = str(error).partition(" -> ")[0]
        faults.append(Fault(tied[first][0], str(error)))
        return Ties({})


def tied_texts(data: Data, parts: Parts) -> dict[str, tuple[Place, str]]:
    """Return place and text of every value that is the arithmetic of others, by its name.

    The points of a saturation curve follow from AEX and BEX where these are given: those of the
    data sheet's voltages E1 and E2, or of the case's.
    """
    tied: dict[str, tuple[Place, str]] = {}
    for part in parts.all:
        if part.kind != "network":
            for symbol, value in _at(data, part.fixed).items():
                if is_tie(value):
                    tied[part.prefix + symbol] = (*part.fixed, symbol), value
        if part.kind == "exciter" and has_saturation(part.sheet):
            form = FORMS.get(str(data.get("saturation")))
            places = saturation_places(data)
            if form is not None and {name for *_, name in places} == {*MEANINGS}:
                for symbol in POINTS:
                    tied[symbol] = places[-1], form.format(symbol.replace("SE", "E"))
    return tied


def has_saturation(sheet: Sheet) -> bool:
    """Tell if a model has the two points of a saturation curve."""
    return {*POINTS} <= {row.symbol for row in sheet}


def saturation_places(data: Data) -> list[Place]:
    """List the places at which a case file's data give AEX and BEX, in this order."""
    return [
        ("parameters", key, name)
        for name in MEANINGS
        for key in ("fixed", "free")
        if name in _at(data, ("parameters", key))
    ]


def helpers_of(data: Data, parts: Parts) -> dict[str, Place]:
    """Return the names among the exciter's parameters that are none of them, with their places.

    A name of another part (machine.H), or of what may be found about a record, is no helper.
    """
    own = next((part.symbols for part in parts.all if part.kind == "exciter"), ())
    return {
        name: ("parameters", key, name)
        for key in ("fixed", "free")
        for name in _at(data, ("parameters", key))
        if name not in own and name.isidentifier() and name not in OF_RECORD
    }


def bounds_of(section: FreeSection, row: Parameter | None) -> Limits:
    """Return the bounds of a free parameter of a case."""
    return search_bounds(section.min, section.max, row) if section.bounds != "none" else (-inf, inf)


def search_bounds(low: float | None, high: float | None, row: Parameter | None) -> Limits:
    """Return the bounds of a free parameter, given those that the case has.

    A missing one is the limit of the equations, which may be infinite; a time constant stays where
    its block is not bypassed, also where its bound of 0 belongs to a start of 0 that another one
    has replaced. Without a data sheet there is no limit.
    """
    lowest, highest = (-inf, inf) if row is None else row.domain
    if row is not None and row.is_time:
        lowest = max(lowest, SHORTEST)
        low = None if low == 0.0 else low
    return lowest if low is None else low, highest if high is None else high


def is_held(start: float | None, row: Parameter | None) -> bool:
    """Tell if a free parameter is a time constant of 0, whose block is bypassed.

    The response does not depend on it there, so that no fit can leave that value.
    """
    return row is not None and row.is_time and row.low == 0.0 and start == 0.0


def exciter_part(model: Model, exponential: bool) -> Part:
    """Return the part of an exciter, with an exponential saturation or a quadratic one."""

    def check(values: Mapping[str, float]) -> Contradictions:
        yield from contradictions(values)
        if exponential:
            yield from exponential_faults(values)

    return Part("exciter", model.name, "", model.sheet, ("parameters",), "fixed", check)


def added_part(kind: str, prefix: str, model: Model, section: Place = ()) -> Part:
    """Return the part of a stabiliser, governor or limiter, in a section of its kind by default."""
    return Part(kind, model.name, prefix, model.sheet, section or (kind,))


def machine_part(machine: Machine, on_load: bool) -> Part:
    """Return the part of a machine, which ``on_load`` needs a damper of its d axis."""

    def check(values: Mapping[str, float]) -> Contradictions:
        if len(values) == len(machine.sheet):
            yield from machine.faults(values)
        if on_load and values.get("Tppd0", inf) < SHORTEST:
            yield "Tppd0", f"{values['Tppd0']:g} is for open circuit; on load it must be positive"

    return Part("machine", machine.name, MACHINE, machine.sheet, ("plant",), check=check)


def network_part(given: Data, kind: PlantKind, plant: Place = ("plant",)) -> Part:
    """Return the part of a network in a plant of some kind, which needs these values given."""
    sheet = kind.network(given)
    symbols = [row.symbol for row in sheet]

    def check(values: Mapping[str, float]) -> Contradictions:
        for symbol in kind.network_required:
            if symbol not in given:
                yield symbol, "is missing"
        if "P" not in kind.network_required:
            return
        if "Q" not in given and "E" not in given:
            either = "either Q or E, the voltage of the source, must be given with P"
            yield "Q", f"is missing{f': {either}' if 'X' in symbols else ''}"
        if "Q" in given and "E" in given:
            yield "Q", "not allowed with E, from which it follows"
        if values.get("R") == values.get("X") == 0.0 and "Xs" not in symbols:
            yield "X", "0, and R = 0 as well: the machine needs an impedance to the source"
        if "Xs" in symbols:
            if values.get("Rs") == values.get("Xs") == 0.0:
                yield "Xs", "0, and Rs = 0 as well: the far bus needs an impedance to the source"
            if "E" in given:
                yield "E", "not allowed with a far bus before the source: give Q"

    if "Q" in given and "E" in given:
        sheet = tuple(dict.fromkeys((*sheet, *kind.network(("Q",)))))
    return Part("network", "the network", NETWORK, sheet, plant, "network", check)


def _exciter(data: Data, folder: Path, faults: list[Fault], sha256: str) -> Model | None:
    name = data.get("model")
    if not isinstance(name, str) or not name:
        return None
    try:
        model = find(name, folder, sha256)
        if data.get("efd_times_speed") is not True:
            return model
        from exfit.models.speed_multiplier import times_speed

        return times_speed(model)
    except ModelError as error:
        faults.append(Fault(("model",), str(error)))
        return None


def _at(data: Data, place: Place) -> dict[str, Any]:
    """Return the section at a place of the file, an empty one where there is none."""
    section: Any = data
    for key in place:
        if isinstance(key, int):
            section = next(iter(_entries(section)[key : key + 1]), None)
        else:
            section = _mapping(section).get(key)
    return _mapping(section)


def _entries(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _mapping(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}
