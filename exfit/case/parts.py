"""The parts of a case with a data sheet: exciter, machine, network, what is added to them."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any

from exfit.case.saturation import saturation_ties
from exfit.case.ties import Tie, TieError, Ties, is_tie, parse
from exfit.case.yaml import Fault
from exfit.errors import ModelError
from exfit.models import GOVERNORS, LIMITERS, STABILISERS, Catalogue, find
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES, Machine
from exfit.models.sheet import Model, Sheet, contradictions, exponential_faults, typical
from exfit.plants import EVENTS, GOVERNOR, KINDS, MACHINE, NETWORK, STABILISER, Attached, PlantKind
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.signals import RECORDED
from exfit.util.text import Place, near

Data = Mapping[str, Any]
Contradictions = Iterator[tuple[str, str]]

# in place of a kind that does not exist, which is a fault of its own
ANY_PLANT = replace(OPEN_CIRCUIT, events=EVENTS, signals=RECORDED)
OF_RECORD = ("vt0", "delay")  # what a fit finds about a record, under names without a dot


@dataclass(frozen=True)
class Part:
    """A part of a case: its kind, the model it names, where the file gives its parameters.

    ``sources`` is where the file says where their values come from. Its parameters are those of its
    sheet, in the system under ``prefix``. ``check(values)`` yields (symbol, text) for values that
    contradict each other.
    """

    kind: str
    name: str
    prefix: str
    sheet: Sheet
    fixed: Place
    free: Place | None
    sources: Place
    check: Callable[[Mapping[str, float]], Contradictions] = field(compare=False)

    @property
    def std_errors(self) -> Place:
        """Where the file gives the standard errors of its values."""
        return (*self.sources[:-1], "std_errors")

    @property
    def symbols(self) -> tuple[str, ...]:
        """Its parameters by symbol."""
        return tuple(row.symbol for row in self.sheet)

    def resolved(self, *given: Mapping[str, float]) -> dict[str, float]:
        """Return a value for each parameter: typical unless given, the last one wins."""
        values = typical(self.sheet)
        for some in given:
            values |= {symbol: value for symbol, value in some.items() if symbol in values}
        return values


@dataclass(frozen=True)
class Parts:
    """The models that a case names, and all its parts."""

    exciter: Model | None
    machine: Machine | None
    stabiliser: Model | None
    governor: Model | None
    all: tuple[Part, ...]
    limiters: tuple[Attached, ...] = ()


def parts_of(data: Data, folder: Path, faults: list[Fault], model_sha256: str = "") -> Parts:
    """Return the parts of a case file's data; add a fault for a name that stands for none.

    The file of a user's own model is run only if it has the hash given, where one is.
    """
    plant = _mapping(data.get("plant"))
    kind = kind_of(plant)
    exciter = None
    if not kind.has_equations:
        exciter = _named(plant, data)
    elif kind.has_exciter:
        exciter = _exciter(data, folder, faults, model_sha256)
    machine = _machine(plant, faults) if kind.has_machine else None
    stabiliser = _added(data, "stabiliser", STABILISERS, faults)
    governor = _added(data, "governor", GOVERNORS, faults)
    parts = []
    if exciter is not None:
        exponential = str(data.get("saturation")).startswith("exponential")
        parts.append(exciter_part(exciter, exponential))
    if machine is not None:
        kinds = (kind, *map(kind_of, plants_of_records(data).values()))
        parts.append(machine_part(machine, on_load=any(kind.on_load for kind in kinds)))
    if kind.on_load:
        parts.append(network_part(_mapping(plant.get("network")), kind))
    added = (("stabiliser", STABILISER, stabiliser), ("governor", GOVERNOR, governor))
    parts += [added_part(kind, prefix, model) for kind, prefix, model in added if model is not None]
    places, limiters = limiters_of(data, faults)
    parts += [limiter_part(at, limiter) for at, limiter in zip(places, limiters, strict=True)]
    return Parts(exciter, machine, stabiliser, governor, tuple(parts), limiters)


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
    limiting = tuple(limiter.kind for limiter in parts.limiters)
    without = ("exciter", "stabiliser", "governor", *limiting)
    absent = ("network",) if kind.has_exciter else ("network", *without)
    others = tuple(part for part in parts.all if part.kind not in absent)
    network = (network_part(given, kind),) if kind.on_load else ()
    changed = replace(parts, all=(*others, *network))
    if kind.has_exciter:
        return changed
    return replace(changed, exciter=None, stabiliser=None, governor=None, limiters=())


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
    ties: dict[str, Tie] = {}
    places: dict[str, Place] = {}
    for name, place, text in _tied(data, parts):
        places[name] = place
        try:
            ties[name] = parse(text)
        except TieError as error:
            faults.append(Fault(place, str(error)))
    names = [part.prefix + symbol for part in parts.all for symbol in part.symbols]
    names += helpers_of(data, parts)
    known = set(names)
    for name, tie in list(ties.items()):
        for used in tie.names:
            if used not in known:
                faults.append(
                    Fault(places[name], f"{used} is not a parameter; {near(used, names)}")
                )
                ties.pop(name, None)
    try:
        return Ties(ties)
    except TieError as error:
        first = str(error).partition(" -> ")[0]
        faults.append(Fault(places[first], str(error)))
        return Ties({})


def used_by_ties(data: Data, parts: Parts) -> set[str]:
    """Return the names used in the arithmetic of a case file's data."""
    used: set[str] = set()
    for _, _, text in _tied(data, parts):
        with suppress(TieError):
            used |= {*parse(text).names}
    return used


def places_of_ties(data: Data, parts: Parts) -> dict[str, Place]:
    """Return the place of the arithmetic that gives each tied parameter."""
    return {name: place for name, place, _ in _tied(data, parts)}


def helpers_of(data: Data, parts: Parts) -> dict[str, Place]:
    """Return the names among the exciter's parameters that are none of them, with their places.

    A name of another part (machine.H), or of what may be found about a record, is no helper.
    """
    own = next((part.symbols for part in parts.all if part.kind == "exciter"), ())
    section = _mapping(data.get("parameters"))
    return {
        name: ("parameters", key, name)
        for key in ("fixed", "free")
        for name in _mapping(section.get(key))
        if name not in own and name.isidentifier() and name not in OF_RECORD
    }


def _tied(data: Data, parts: Parts) -> Iterator[tuple[str, Place, str]]:
    """Yield name, place and text of every value that is the arithmetic of others."""
    sections: list[tuple[str, Place]] = [
        (part.prefix, part.fixed) for part in parts.all if part.kind != "network"
    ]
    for prefix, place in sections:
        section = _at(data, place)
        for symbol, value in section.items():
            if is_tie(value):
                yield prefix + symbol, (*place, symbol), value
    for part in parts.all:
        if part.kind == "exciter":
            yield from saturation_ties(data, part.sheet)


def exciter_part(model: Model, exponential: bool) -> Part:
    """Return the part of an exciter, with an exponential saturation or a quadratic one."""

    def check(values: Mapping[str, float]) -> Contradictions:
        yield from contradictions(values)
        if exponential:
            yield from exponential_faults(values)

    places = _places("parameters", "fixed")
    return Part("exciter", model.name, "", model.sheet, *places, check)


def machine_part(machine: Machine, on_load: bool) -> Part:
    """Return the part of a machine."""

    def check(values: Mapping[str, float]) -> Contradictions:
        if len(values) == len(machine.sheet):
            yield from machine.faults(values)
        if on_load and values.get("Tppd0", inf) < SHORTEST:
            yield "Tppd0", f"{values['Tppd0']:g} is for open circuit; on load it must be positive"

    places = _places("plant", "parameters")
    return Part("machine", machine.name, MACHINE, machine.sheet, *places, check)


def added_part(kind: str, prefix: str, model: Model) -> Part:
    """Return the part of a stabiliser or of a governor."""
    places = _places(kind, "parameters")
    return Part(
        kind,
        model.name,
        prefix,
        model.sheet,
        *places,
        lambda values: iter(contradictions(values)),
    )


def limiter_part(at: int, limiter: Attached) -> Part:
    """Return the part of a limiter, an entry of the list of a case."""
    place = ("limiters", at)
    return Part(
        limiter.kind,
        limiter.model.name,
        limiter.prefix,
        limiter.model.sheet,
        (*place, "parameters"),
        (*place, "free"),
        (*place, "sources"),
        lambda values: iter(contradictions(values)),
    )


def limiters_of(data: Data, faults: list[Fault]) -> tuple[list[int], tuple[Attached, ...]]:
    """Return the limiters of a case, one of each kind, and their indices; add faults of names."""
    by_kind: dict[str, tuple[int, Attached]] = {}
    for at, entry in enumerate(_entries(data.get("limiters"))):
        section = _mapping(entry)
        name = _catalogue_name(section, ("limiters", at, "model"), LIMITERS, "limiter", faults)
        if name is None:
            continue
        model, place = LIMITERS[name], section.get("place")
        limiter = Attached(model, place if isinstance(place, str) else model.places[0])
        first = by_kind.setdefault(limiter.kind, (at, limiter))[1]
        if first is not limiter:
            text = f"{name}: a second one beside {first.model.name}; at most one of each kind"
            faults.append(Fault(("limiters", at, "model"), text))
    return [at for at, _ in by_kind.values()], tuple(limiter for _, limiter in by_kind.values())


def network_part(given: Data, kind: PlantKind, place: Place = ("plant", "network")) -> Part:
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
        if values.get("R") == values.get("X") == 0.0:
            yield "X", "0, and R = 0 as well: the machine needs an impedance to the source"

    if "Q" in given and "E" in given:
        sheet = tuple(dict.fromkeys((*sheet, *kind.network(("Q",)))))
    sources = (*place[:-1], "sources")
    return Part("network", "the network", NETWORK, sheet, place, None, sources, check)


def _places(section: str, fixed: str) -> tuple[Place, Place, Place]:
    """Find the sections of the file for fixed values, free ones, and their sources."""
    return (section, fixed), (section, "free"), (section, "sources")


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


def _named(plant: Data, data: Data) -> Model:
    """Make the stand-in of a model that is elsewhere: the parameters that a case names."""
    from exfit.plants.outside import model_of_names

    command = plant.get("command")
    words = [str(word) for word in command] if isinstance(command, list) else []
    files = [word for word in words[1:] if not word.startswith("-")]
    words += [str(plant[key]) for key in ("file", "type") if key in plant]
    section = _mapping(data.get("parameters"))
    names = (name for key in ("fixed", "free") for name in _mapping(section.get(key)))
    name = Path([*files, *words][0]).stem.upper()
    return model_of_names(name, dict.fromkeys(names))


def _machine(plant: Data, faults: list[Fault]) -> Machine | None:
    name = _catalogue_name(plant, ("plant", "machine"), MACHINES, "machine", faults)
    return None if name is None else MACHINES[name]


def _added(data: Data, kind: str, catalogue: Catalogue, faults: list[Fault]) -> Model | None:
    """Return the stabiliser or governor that a case names; None where it has none."""
    name = _catalogue_name(_mapping(data.get(kind)), (kind, "model"), catalogue, kind, faults)
    return None if name is None else catalogue[name]


def _catalogue_name(
    section: Data, place: Place, catalogue: Mapping[str, Any], kind: str, faults: list[Fault]
) -> str | None:
    """Return the entry that a section names; add a fault where there is none of that name."""
    name = section.get(str(place[-1]))
    if not isinstance(name, str) or not name:
        return None
    if name.upper() in catalogue:
        return name.upper()
    faults.append(Fault(place, f"{name!r} is not a {kind} model; {near(name, catalogue)}"))
    return None


def _at(data: Data, place: Place) -> dict[str, Any]:
    """Return the section at a place of the file, an empty one where there is none."""
    section: Any = data
    for key in place:
        if isinstance(key, int):
            section = _entries(section)[key : key + 1]
            section = section[0] if section else None
        else:
            section = _mapping(section).get(key)
    return _mapping(section)


def _entries(value: Any) -> list[Any]:
    """Return a list of the file, an empty one where there is none."""
    return value if isinstance(value, list) else []


def _mapping(value: Any) -> dict[str, Any]:
    """Return a mapping of the file, an empty one where there is none."""
    return value if isinstance(value, dict) else {}
