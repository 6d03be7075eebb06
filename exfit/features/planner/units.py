"""The units of a dynamics file: machine, exciter, stabiliser, governor, and what is left out."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

from exfit.errors import DynamicsError
from exfit.features.planner.buses import NO_BUSES, Bus, Buses, numbers_of
from exfit.features.planner.fields import DynamicsFault, UnreadRecord, located, number
from exfit.features.planner.pslf import PSLF_FILES
from exfit.features.planner.psse import PSSE_FILES
from exfit.features.planner.records import (
    FLAGS,
    LIMITER,
    RATING,
    RESISTANCE,
    SHARE,
    FileFormat,
    Head,
    Reading,
    definition_of,
    definitions,
    outside,
    read_values,
)
from exfit.models.sheet import Model
from exfit.plants import (
    GOVERNOR,
    LOAD_CONTROLLER,
    MACHINE,
    MOVING_PREF,
    STABILISER,
    Attached,
    inputs_at,
)
from exfit.plants.limiting import inputs_for_limiters
from exfit.util.text import closest, near, show

FORMATS = {files.suffix.removeprefix("."): files for files in (PSSE_FILES, PSLF_FILES)}
NEARLY_THE_NAME = 0.8  # of two names alike: a typing error, not another model
NEEDED = ("machine", "exciter")
MOST_LISTED = 20  # units in a message
OTHERS: Mapping[str, str] = {
    name: kind
    for kind, names in {
        "governor": """BBGOV1 CCBT1 CRCMGV DEGOV DEGOV1 G2WSCC GAST GAST2A GASTWD GGOV1 GGOV1DU
            GGOV2 GGOV3 GPWSCC H6B HYG3 HYGOV HYGOV2 HYGOV4 HYGOVDU HYGOVM HYGOVR HYGOVR1
            HYGOVRU HYGOVT IEEEG1 IEEEG1SDU IEEEG2 IEEEG3 IEEEG3_GE IEEEG3_PTI IEESGO IVOGO
            PIDGOV SHAF25 TGOV1 TGOV1DU TGOV2 TGOV3 TGOV4 TGOV5 TURCZT TWDM1T TWDM2T URCSCT URGS3T
            WEHGOV WESGOV WPIDHY WSHYDD WSHYGP WSIEG1""",
        "stabiliser": """BEPSST IEE2ST IVOST OSTB2T OSTB5T PTIST1 PTIST3
            STAB3 STAB4 STABNI STBSVC""",
        "excitation limiter": "MAXEX1 MAXEX2 MNLEX1 MNLEX2 MNLEX3 OEL1 OEL1B OEL4C UEL2",
        "compensator": "CCOMP COMP COMPCC IEEEVC REMCMP",
        "meter": "AMETA FMETA IMETR VMETA",
    }.items()
    for name in names.split()
}

Driven = Mapping[tuple[str, str], Head]
SECOND = ("JBUS", "M")  # of a record of IEEEG1: bus and id of a machine beside its own
COMPENSATION = "IEEEVC"  # |vt + (Rc + jXc) it|
# those of PSS/E that exfit lacks: a name like theirs is no typing error
WITHOUT_MODEL = re.compile("BUDCZT|CELIN|EMAC1T|EX2000|EXBAS|IEEET5|IEEX2A|IEET1[AB]")
LOAD = re.compile(  # its id is another's than that of a machine at its bus
    r"(ACMT|CIM[56W]|CLOD|CMLD|DLSH|EXTL|IEEL|LDFR|LDS[3HT]|LVS[3HT])(BL|OW|ZN|AR|AL)(U\d)?"
    r"|[ABWZ]LWSCC|CMPLDW|LSDT\d|LVSH\d?"
)
CLASSICAL = {"GENCLS": "a constant voltage behind a reactance, with nothing to verify"}


def format_of(file: str | Path) -> FileFormat:
    """Return the format of a file by its name: PSS/E's, unless it ends as another's."""
    return FORMATS.get(Path(file).suffix.lower().removeprefix("."), PSSE_FILES)


@dataclass(frozen=True)
class Unit:
    """A unit; ``warnings`` say, by line, what of the file its models do not represent.

    ``unknown`` are the names of its records that exfit has no model of, which are left out; ``kv``,
    ``mva``, ``ra``, of the stator, and ``compensation``, Rc and Xc of IEEEVC, are None,
    ``bus_name`` is "", where the file does not state them.
    """

    bus: int
    id: str
    machine: Reading
    exciter: Reading
    stabiliser: Reading | None
    governor: Reading | None
    limiters: tuple[Reading, ...]
    warnings: tuple[DynamicsFault, ...]
    unknown: tuple[str, ...] = ()
    kv: float | None = None
    mva: float | None = None
    ra: float | None = None
    bus_name: str = ""
    compensation: tuple[float, float] | None = None
    load_controller: Reading | None = None

    @property
    def added(self) -> tuple[Reading, ...]:
        """Its stabiliser, its governor and the load controller of that, those that it has."""
        parts = (self.stabiliser, self.governor, self.load_controller)
        return tuple(part for part in parts if part is not None)


class WithoutExciter(NamedTuple):
    """A machine without an exciter, at constant field voltage, and what is left out beside it."""

    machine: Reading
    warnings: tuple[DynamicsFault, ...]


@dataclass(frozen=True)
class RefusedUnit:
    """A unit that cannot be imported: its records by name, and why.

    ``modelled``: it is a unit of which exfit lacks a model or its values are at fault, not a load
    or a machine without an exciter; of that ``alone`` is the machine.
    """

    bus: int
    id: str
    line: int
    records: tuple[str, ...]
    modelled: bool
    faults: tuple[DynamicsFault, ...]
    bus_name: str = ""
    alone: WithoutExciter | None = None


@dataclass(frozen=True)
class DynamicsUnits:
    """The units of a dynamics file in its order; ``faults`` are of records that belong to no unit.

    ``classical`` counts the classical machines without an exciter, which are no units; ``devices``
    are the names of records of other devices, such as loads and plants with converters, with the
    number of places where they stand.
    """

    units: tuple[Unit, ...]
    refused: tuple[RefusedUnit, ...]
    faults: tuple[DynamicsFault, ...]
    classical: int = 0
    devices: Mapping[str, int] = field(default_factory=dict)


def read_units(text: str, file: str | Path, buses: Buses = NO_BUSES) -> DynamicsUnits:
    """Return every unit of a dynamics file, whose suffix gives the program.

    What is wrong with one does not hinder the others. ``buses`` are those of a power flow file, for
    files that have their names.
    """
    heads, faults = format_of(file).heads(text, buses)
    driven = _driven(heads)
    units, refused, classical = list[Unit](), list[RefusedUnit](), 0
    loads = {(head.bus, head.id, head.name) for head in heads if _is_load(head)}
    devices = Counter(name for _, _, name in loads)
    for own in _by_unit(heads).values():
        if _all_classical(own):
            classical += 1
            continue
        if _is_device(own):
            devices.update({head.name for head in own})
            continue
        unit, wrong = _unit_of(own, driven)
        if unit is not None:
            units.append(unit)
            continue
        refused.append(_refused(own, wrong, faults))
    return DynamicsUnits(tuple(units), tuple(refused), tuple(faults), classical, devices)


def _refused(
    own: Sequence[Head], wrong: Sequence[DynamicsFault], unread: Iterable[DynamicsFault]
) -> RefusedUnit:
    """Return a unit without what it needs, or with ``wrong`` records; some may be ``unread``."""
    missing, first = _missing_kinds(own), own[0]
    faults = [*wrong, *_lacking(own, missing)]
    doubtful = any(not isinstance(each, UnreadRecord) or each.bus == first.bus for each in unread)
    if doubtful and missing == ["exciter"]:
        why = "a record that cannot be read may be its exciter"
        faults.append(DynamicsFault(first.line, why))
    return RefusedUnit(
        first.bus,
        first.id,
        first.line,
        tuple(head.name for head in own),
        not missing or (any(_is_machine(head.name) for head in own) and bool(_unknown(own))),
        tuple(sorted(faults, key=lambda fault: fault.line)),
        first.bus_name,
        None if doubtful else _machine_alone(own),
    )


def read_unit(
    text: str,
    file: str,
    bus: int | str | None = None,
    machine_id: str | None = None,
    buses: Buses = NO_BUSES,
) -> Unit:
    """Return a unit of a dynamics file: the only one, or that of a bus, or its name, and an id.

    Records that cannot be read are warnings if the unit is whole without them. Raises DynamicsError
    with all faults, each as ``file:line: what is wrong``, and where the unit is not in the file, is
    not the only one, or has no machine or exciter that exfit knows.
    """
    files = format_of(file)
    heads, unread = files.heads(text, buses)
    by_unit = _by_unit(heads)
    if not by_unit:
        none = f"{file}: has no record of a unit: {files.begins}"
        raise DynamicsError([*located(unread, file), none])
    try:
        chosen = _chosen(by_unit, file, bus, machine_id)
    except DynamicsError as fault:
        raise DynamicsError([*located(unread, file), *fault.faults]) from None
    unit, faults = _unit_of(chosen, _driven(heads))
    if unit is None:
        faults += _missing(_missing_kinds(chosen), chosen)
        raise DynamicsError(located([*unread, *faults], file))
    left = [DynamicsFault(line, f"{text}: the record is left out") for line, text in unread]
    warnings = sorted([*unit.warnings, *left], key=lambda warning: warning.line)
    return replace(unit, warnings=tuple(warnings))


def _by_unit(heads: Iterable[Head]) -> dict[tuple[int, str], list[Head]]:
    """Return the records of each unit by its bus and its id in capitals, without those of loads."""
    units: dict[tuple[int, str], list[Head]] = {}
    for head in heads:
        if _is_load(head):
            continue
        units.setdefault((head.bus, head.id.upper()), []).append(head)
    return units


def _chosen(
    units: Mapping[tuple[int, str], list[Head]],
    file: str,
    bus: int | str | None,
    machine_id: str | None,
) -> list[Head]:
    """Return the records of one unit; raises DynamicsError where it is not exactly one."""
    wanted_id = None if machine_id is None else machine_id.strip().upper()
    wanted = [bus]
    if isinstance(bus, str):
        named = {own[0].bus: Bus(own[0].bus_name, own[0].kv) for own in units.values()}
        wanted = [*numbers_of(bus, named)]
    meant = {
        key: records
        for key, records in units.items()
        if (bus is None or key[0] in wanted) and wanted_id in (None, key[1])
    }
    if len(meant) > 1:
        meant = {key: own for key, own in meant.items() if not _all_classical(own)}
    if len(meant) == 1:
        return next(iter(meant.values()))
    if meant:
        text = f"{file}: {len(meant)} units; select one by --bus and --id"
        raise DynamicsError([text, *_listed(meant)])
    given = [f"{label} {value!r}" for label, value in (("bus", bus), ("id", machine_id)) if value]
    text = f"{file}: no record of {', '.join(given)}; the file has"
    raise DynamicsError([text, *_listed(units)])


def _listed(units: Mapping[tuple[int, str], list[Head]]) -> Iterator[str]:
    for (bus, machine_id), heads in list(units.items())[:MOST_LISTED]:
        name = f" {heads[0].bus_name}" if heads[0].bus_name else ""
        yield f"  bus {bus}{name}, id {machine_id}: {', '.join(head.name for head in heads)}"
    if len(units) > MOST_LISTED:
        yield f"  and {len(units) - MOST_LISTED} more"


def _driven(heads: Iterable[Head]) -> Driven:
    """Return the records of IEEEG1 that drive a second machine, by its bus and id in capitals."""
    return {
        (head.fields[0].text, head.fields[1].text.upper()): head
        for head in heads
        if head.definition is not None and head.definition.names[:2] == SECOND and head.fields[1:]
    }


def _unit_of(heads: Sequence[Head], driven: Driven) -> tuple[Unit | None, list[DynamicsFault]]:
    """Return the unit of its records, and their faults, with which it is None.

    It is None, too, where it has no machine or exciter that exfit knows. ``driven`` are the
    records of other units that drive a machine.
    """
    faults, warnings = list[DynamicsFault](), list[DynamicsFault]()
    parts = _parts(heads, faults, warnings)
    if faults or not parts.keys() >= {MACHINE, ""}:
        return None, faults
    exciter = parts[""]
    of_load = next((head for head in heads if head.name.upper() == COMPENSATION), None)
    compensation = None if of_load is None else _compensation(of_load)
    if of_load is not None and compensation is not None:
        what = f"{of_load.name} acts on load: it is Rc and Xc of a network"
        warnings.append(DynamicsFault(of_load.line, what))
    known = None if compensation is None else of_load
    unknown = [head for head in heads if head.definition is None and head is not known]
    warnings += [DynamicsFault(head.line, _left_out(head.name)) for head in unknown]
    controller = _moving(parts, warnings)
    governor = _governing(parts.get(GOVERNOR), heads, driven, warnings)
    unit = Unit(
        heads[0].bus,
        heads[0].id,
        parts[MACHINE],
        exciter,
        parts.get(STABILISER),
        governor,
        tuple(_attached(parts.values(), exciter, warnings)),
        tuple(sorted(warnings, key=lambda warning: warning.line)),
        tuple(head.name for head in unknown),
        *_ratings(heads),
        heads[0].bus_name,
        compensation,
        controller,
    )
    return unit, []


def _moving(parts: Mapping[str, Reading], warnings: list[DynamicsFault]) -> Reading | None:
    """Return the load controller of a governor; add one without, which is left out."""
    controller = parts.get(MOVING_PREF)
    if controller is None or GOVERNOR in parts:
        return controller
    name = controller.definition.record.name
    what = f"{LOAD_CONTROLLER} {name} is left out: the unit has no governor"
    warnings.append(DynamicsFault(controller.line, what))
    return None


def _machine_alone(heads: Sequence[Head]) -> WithoutExciter | None:
    """Return the machine of a unit without a record that is, or may be, of an exciter."""
    faults, warnings = list[DynamicsFault](), list[DynamicsFault]()
    parts = _parts(heads, faults, warnings)
    if faults or "" in parts or MACHINE not in parts or _unknown(heads):
        return None
    for head in heads:
        if head.definition is None or head.definition.kind not in NEEDED:
            text = f"{head.name} is left out: without an exciter the machine is alone on load"
            warnings.append(DynamicsFault(head.line, text))
    return WithoutExciter(parts[MACHINE], tuple(warnings))


def _compensation(head: Head) -> tuple[float, float] | None:
    """Return Rc and Xc of a record of two numbers, None for another."""
    try:
        Rc, Xc = map(number, head.fields)
    except ValueError:
        return None
    return Rc, Xc


def _ratings(heads: Iterable[Head]) -> tuple[float | None, float | None, float | None]:
    """Return the kV, the MVA and the resistance that the record of the machine states."""
    for head in heads:
        if head.definition is not None and head.definition.kind == "machine":
            fields = dict(zip(head.definition.names, head.fields, strict=True))
            ra = number(fields[RESISTANCE]) if RESISTANCE in fields else None
            return head.kv, head.base or None, ra
    return None, None, None


def _parts(
    heads: Iterable[Head], faults: list[DynamicsFault], warnings: list[DynamicsFault]
) -> dict[str, Reading]:
    """Return the records that exfit has models of, by the beginnings of their parameters' names.

    A unit cannot do without its machine and its exciter, whose faults are added. Others that have
    faults are left out with a warning.
    """
    parts: dict[str, Reading] = {}
    for head in heads:
        definition = head.definition
        if definition is None:
            continue
        reading = read_values(definition, head.line, head.fields)
        wrong = [*(head.faults or reading.faults)]
        first = parts.setdefault(definition.prefix, reading)
        if first is not reading:
            kind = definition.prefix.removesuffix(".") or definition.kind
            other = f"{first.definition.record.name} is on line {first.line}"
            wrong = [DynamicsFault(head.line, f"{head.name}: a second {kind}; {other}")]
        if not wrong:
            warnings += reading.warnings
        elif definition.kind in NEEDED:
            faults += wrong
        else:
            what = f"{definition.kind} {head.name} is left out"
            texts = "; ".join(
                fault.text.removeprefix(f"{definition.record.name}: ") for fault in wrong
            )
            warnings.append(DynamicsFault(wrong[0].line, f"{what}: {texts}"))
            if first is reading:
                del parts[definition.prefix]
    return parts


def _attached(
    parts: Iterable[Reading], exciter: Reading, warnings: list[DynamicsFault]
) -> Iterator[Reading]:
    """Yield the limiters with their places at an exciter; add those without one, which are left.

    The place is that of the flag of the exciter's record, else the usual one of the limiter.
    """
    record, model = exciter.definition.record, exciter.definition.model
    values = dict(zip(exciter.definition.names, exciter.fields, strict=True))
    assert isinstance(model, Model)
    for limiter in parts:
        own = limiter.definition.model
        if limiter.definition.kind != LIMITER or not isinstance(own, Model):
            continue
        name, flag = limiter.definition.record.name, limiter.definition.prefix[:3].upper()
        fed = inputs_for_limiters(model)
        places = [
            place
            for place in own.places
            if fed.issuperset(inputs_at(Attached(own, place)).values())
        ]
        code = int(number(values[flag])) if flag in FLAGS and flag in values else None
        stated = dict[int | None, str](record.places).get(code)
        if not places or code == 0:  # with UEL = 0 of ST1C a UEL1 does not act in PSS/E 36.7
            why = f"has {flag} = 0" if places else "has no input for it"
            text = f"limiter {name} is left out: {record.name} {why}"
            warnings.append(DynamicsFault(limiter.line, text))
            continue
        place = stated if stated in places else places[0]
        if place != stated:
            why = "does not state its place" if code is None else f"has {flag} = {code}"
            text = f"{name}: {record.name} {why}; {place} is taken"
            warnings.append(DynamicsFault(limiter.line, text))
        yield replace(limiter, place=place)


def _governing(
    governor: Reading | None, heads: Sequence[Head], driven: Driven, warnings: list[DynamicsFault]
) -> Reading | None:
    """Return a governor with its base as a share of the machine's, or add that this is unknown.

    Without one, add that the governor of another machine drives this one, if it does.
    """
    if governor is None:
        other = driven.get((str(heads[0].bus), heads[0].id.upper()))
        if other is not None:
            of = f"{other.name} of machine {other.id} at bus {other.bus}"
            what = f"{of} drives this machine, too: not modelled, its power is constant"
            warnings.append(DynamicsFault(other.line, what))
        return None
    bases = {head.definition.kind: head.base for head in heads if head.definition is not None}
    own, machine = bases.get("governor"), bases.get("machine")
    if own is None or own == machine:
        return governor
    if machine is not None and machine > 0.0:
        return replace(governor, values={**governor.values, SHARE: own / machine})
    text = f"its values are on {show(own)} MW; the machine's base is not in the file (1 is taken)"
    warnings.append(DynamicsFault(governor.line, f"{governor.definition.record.name}: {text}"))
    return governor


def with_rating(unit: Unit, mva: float | None) -> Unit:
    """Return a unit whose turbine has the share of its rating, MW, in the machine's base, MVA."""
    governor = unit.governor
    rating = 0.0 if governor is None else dict(governor.unused).get(RATING, 0.0)
    if governor is None or rating == 0.0 or mva is None:
        return unit
    values = {**governor.values, SHARE: float(f"{rating / mva:.6g}")}
    if [*outside(governor.definition.model.sheet, values)]:
        return unit
    asked = f"{governor.definition.record.name}: {RATING}: "
    warnings = tuple(each for each in unit.warnings if not each.text.startswith(asked))
    return replace(unit, governor=replace(governor, values=values), warnings=warnings)


def _missing_kinds(heads: Iterable[Head]) -> list[str]:
    """List the kinds of record that a unit lacks: machine, exciter."""
    known = {head.definition.kind for head in heads if head.definition is not None}
    return [kind for kind in NEEDED if kind not in known]


def _missing(missing: Sequence[str], chosen: Sequence[Head]) -> Iterator[DynamicsFault]:
    """Yield a fault for each record that may be the machine or exciter that is missing."""
    classical = _classical_machines(chosen)
    if classical:
        yield from classical
        return
    for kind in missing:
        names = _names_of(kind, chosen[0].program)
        candidates = []
        for head in _unknown(chosen):
            looks_like = "machine" if _is_machine(head.name) else "exciter"
            candidates += [head] if len(missing) == 1 or looks_like == kind else []
        for head in candidates:
            text = f"exfit has no {kind} of that name; {near(head.name, names)}"
            yield DynamicsFault(head.line, f"{head.name}: {text}")
        if not candidates:
            unit = f"bus {chosen[0].bus}, id {chosen[0].id}"
            yield DynamicsFault(chosen[0].line, f"{unit}: has no {kind}; known: {', '.join(names)}")


def _lacking(heads: Sequence[Head], missing: Sequence[str]) -> Iterator[DynamicsFault]:
    """Name the part that a unit lacks of machine and exciter, and what may be meant."""
    classical = _classical_machines(heads)
    if classical or not missing:
        yield from classical
        return
    text = f"no {' and no '.join(missing)} of the catalogue: "
    yield DynamicsFault(heads[0].line, text + ", ".join(head.name for head in heads))
    for head in _unknown(heads):
        meant = _meant(head.name, head.program)
        if meant is not None:
            yield DynamicsFault(head.line, f"{head.name}: did you mean {meant}?")


def _is_machine(name: str) -> bool:
    """Whether a name is that of a machine: GENROU, GENSAL, GENTPJ ..., of which none is a load."""
    return name.upper().startswith("GEN") and name.upper() not in CLASSICAL


def _is_load(head: Head) -> bool:
    return head.definition is None and LOAD.fullmatch(head.name.upper()) is not None


def _is_device(heads: Sequence[Head]) -> bool:
    """Whether no record at a place is of a machine or of a model of exfit, nor nearly so named."""
    return all(
        head.definition is None
        and not _is_machine(head.name)
        and _meant(head.name, head.program) is None
        for head in heads
    )


def _unknown(heads: Iterable[Head]) -> list[Head]:
    """Return the records whose names do not show what they are."""
    left_out = (head for head in heads if head.definition is None)
    return [head for head in left_out if head.name.upper() not in OTHERS]


def _classical_machines(heads: Iterable[Head]) -> list[DynamicsFault]:
    """Name units that are classical machines, which have nothing that a record could verify."""
    return [
        DynamicsFault(head.line, f"{head.name} is {CLASSICAL[head.name.upper()]}")
        for head in heads
        if head.name.upper() in CLASSICAL
    ]


def _all_classical(heads: Iterable[Head]) -> bool:
    """Whether the records at a place are classical machines alone, which are no unit to verify."""
    return all(head.name.upper() in CLASSICAL for head in heads)


@cache
def _names_of(kind: str, program: str) -> tuple[str, ...]:
    """Return the names by which a file of a program may have a machine or an exciter."""
    names = (
        definition.record.name
        for definition in definitions(program)
        if definition.kind == kind and definition_of(definition.record.name, program) == definition
    )
    return tuple(sorted(names))


@cache
def _meant(name: str, program: str) -> str | None:
    """Return the machine or exciter whose name is nearly this one, if one is."""
    if WITHOUT_MODEL.fullmatch(name.upper()):
        return None
    names = [known for kind in NEEDED for known in _names_of(kind, program)]
    return closest(name, names, NEARLY_THE_NAME)


def _left_out(name: str) -> str:
    kind = OTHERS.get(name.upper())
    return (
        f"{name} is left out: not a known model" if kind is None else f"{kind} {name} is left out"
    )
