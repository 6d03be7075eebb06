"""One unit of a dynamics file: machine, exciter, stabiliser, governor, and what is left out."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from exfit.errors import DynamicsError
from exfit.features.planner.fields import DynamicsFault, Field, located, number, refuse
from exfit.features.planner.file_format import Head
from exfit.features.planner.formats import format_of
from exfit.features.planner.records import (
    FLAGS,
    SHARE,
    Definition,
    definition_of,
    definitions,
    read_values,
)
from exfit.models import LIMITERS
from exfit.util.text import near, show

NEEDED = ("machine", "exciter")
LIMITER = "excitation limiter"
MOST_LISTED = 20  # units in a message
OTHERS: Mapping[str, str] = {
    name: kind
    for kind, names in {
        "governor": """BBGOV1 CRCMGV DEGOV DEGOV1 GAST GAST2A GASTWD GGOV1 GGOV1DU HYGOV HYGOV2
            HYGOVDU HYGOVM HYGOVR1 HYGOVRU HYGOVT IEEEG1 IEEEG1SDU IEEEG2 IEEEG3 IEESGO IVOGO
            PIDGOV SHAF25 TGOV1 TGOV1DU TGOV2 TGOV3 TGOV4 TGOV5 TURCZT TWDM1T TWDM2T URCSCT URGS3T
            WEHGOV WESGOV WPIDHY WSHYDD WSHYGP WSIEG1""",
        "stabiliser": """BEPSST IEE2ST IVOST OSTB2T OSTB5T PTIST1 PTIST3
            STAB3 STAB4 STABNI STBSVC""",
        LIMITER: "MAXEX1 MAXEX2 MNLEX1 MNLEX2 MNLEX3 OEL1B OEL4C UEL2",
        "compensator": "COMP COMPCC IEEEVC REMCMP",
    }.items()
    for name in names.split()
}

CLASSICAL = {"GENCLS": "a constant voltage behind a reactance: no unit to verify"}


@dataclass(frozen=True)
class UnitPart:
    """A model of the unit with the values of its record, which begins on ``line``.

    ``fields`` are those behind the id, one for each name of the definition; ``inputs`` the signals
    of a stabiliser whose record has codes of them; ``unused`` the file's values of what ``values``
    has as 0, or not at all.
    """

    definition: Definition
    line: int
    values: Mapping[str, float]
    fields: tuple[Field, ...] = ()
    inputs: tuple[str, ...] = ()
    times_speed: bool = False
    unused: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Unit:
    """A unit; ``warnings`` say, by line, what of the file its models do not represent."""

    bus: int
    id: str
    machine: UnitPart
    exciter: UnitPart
    stabiliser: UnitPart | None
    governor: UnitPart | None
    warnings: tuple[DynamicsFault, ...]

    @property
    def added(self) -> tuple[UnitPart, ...]:
        """Its stabiliser and its governor, those that it has."""
        return tuple(part for part in (self.stabiliser, self.governor) if part is not None)


def read_unit(text: str, file: str, bus: int | None = None, machine_id: str | None = None) -> Unit:
    """Return a unit of a dynamics file: the only one, or that of a bus and a machine id.

    Raises DynamicsError with all faults of its records, each as ``file:line: what is wrong``, and
    where the unit is not in the file, is not the only one, or has no machine or exciter that exfit
    knows.
    """
    files = format_of(file)
    heads, faults = files.heads(text)
    refuse(faults, file)
    if not heads:
        raise DynamicsError([f"{file}: holds no record of a unit: {files.begins}"])
    chosen = _chosen(by_unit(heads), file, bus, machine_id)
    unit, faults = unit_of(chosen)
    if unit is None:
        left_out = [head for head in chosen if head.definition is None]
        faults += _missing(missing_kinds(chosen), chosen, left_out)
        raise DynamicsError(located(faults, file))
    return unit


def unit_of(heads: Sequence[Head]) -> tuple[Unit | None, list[DynamicsFault]]:
    """Return the unit of its records, and their faults, with which it is None.

    It is None, too, where it has no machine or exciter that exfit knows.
    """
    faults: list[DynamicsFault] = []
    left_out = [head for head in heads if head.definition is None]
    warnings = list[DynamicsFault]()
    parts = _parts(heads, faults, warnings)
    if "governor" in parts:
        parts["governor"] = _on_its_base(parts["governor"], heads, warnings)
    if faults or not parts.keys() >= {*NEEDED}:
        return None, faults
    exciter = parts["exciter"]
    warnings += [DynamicsFault(head.line, _left_out(head, exciter)) for head in left_out]
    unit = Unit(
        heads[0].bus,
        heads[0].id,
        parts["machine"],
        parts["exciter"],
        parts.get("stabiliser"),
        parts.get("governor"),
        tuple(sorted(warnings, key=lambda warning: warning.line)),
    )
    return unit, []


def _on_its_base(
    governor: UnitPart, heads: Iterable[Head], warnings: list[DynamicsFault]
) -> UnitPart:
    """Return a governor with the share of its base in the machine's, or add that it is another."""
    bases = {head.definition.kind: head.base for head in heads if head.definition is not None}
    own, machine = bases.get("governor"), bases.get("machine")
    if own is None or own == machine:
        return governor
    if machine is not None and machine > 0.0 and SHARE in governor.values:
        share = own / machine
        return replace(governor, values={**governor.values, SHARE: share})
    theirs = "is not in the file" if machine is None else f"is {show(machine)} MVA"
    name = governor.definition.record.name
    text = (
        f"{name}: its values are on {show(own)} MW and not converted; the machine's base {theirs}"
    )
    warnings.append(DynamicsFault(governor.line, text))
    return governor


def missing_kinds(heads: Iterable[Head]) -> list[str]:
    """List the kinds of record that a unit lacks: machine, exciter."""
    known = {head.definition.kind for head in heads if head.definition is not None}
    return [kind for kind in NEEDED if kind not in known]


def by_unit(heads: Iterable[Head]) -> dict[tuple[int, str], list[Head]]:
    """Return the records of each unit by its bus and its id in capitals."""
    units: dict[tuple[int, str], list[Head]] = {}
    for head in heads:
        units.setdefault((head.bus, head.id.upper()), []).append(head)
    return units


def _parts(
    chosen: Iterable[Head], faults: list[DynamicsFault], warnings: list[DynamicsFault]
) -> dict[str, UnitPart]:
    """Return the models of a unit by their kind; add what is wrong and what must be known."""
    parts: dict[str, UnitPart] = {}
    for head in chosen:
        definition = head.definition
        if definition is None:
            continue
        kind, name = definition.kind, head.name
        if kind in parts:
            first = parts[kind]
            other = f"{first.definition.record.name} is on line {first.line}"
            faults.append(DynamicsFault(head.line, f"{name}: a second {kind}; {other}"))
            continue
        reading = read_values(definition, head.line, head.fields)
        if kind == "governor" and reading.faults and not head.faults:
            # a unit whose governor cannot be simulated can be verified without it
            warnings += [
                fault._replace(text=f"governor {name} is left out: {fault.text}")
                for fault in reading.faults
            ]
            continue
        faults += head.faults or reading.faults
        warnings += reading.warnings
        parts[kind] = UnitPart(
            definition,
            head.line,
            reading.values,
            head.fields,
            reading.inputs,
            reading.times_speed,
            reading.unused,
        )
    return parts


def _chosen(
    units: Mapping[tuple[int, str], list[Head]], file: str, bus: int | None, machine_id: str | None
) -> list[Head]:
    """Return the records of one unit; raises DynamicsError where it is not exactly one."""
    meant = {
        key: records
        for key, records in units.items()
        if bus in (None, key[0]) and (machine_id is None or machine_id.strip().upper() == key[1])
    }
    if len(meant) > 1:
        meant = {key: records for key, records in meant.items() if not all_classical(records)}
    if len(meant) == 1:
        return next(iter(meant.values()))
    if meant:
        raise DynamicsError(
            [f"{file}: {len(meant)} units; choose by --bus and --id", *_list(meant)]
        )
    wanted = ", ".join(
        f"{label} {value!r}"
        for label, value in (("bus", bus), ("id", machine_id))
        if value is not None
    )
    raise DynamicsError([f"{file}: no record of {wanted}; the file has", *_list(units)])


def _list(units: Mapping[tuple[int, str], list[Head]]) -> Iterator[str]:
    for (bus, machine_id), heads in list(units.items())[:MOST_LISTED]:
        yield f"  bus {bus}, id {machine_id}: {', '.join(head.name for head in heads)}"
    if len(units) > MOST_LISTED:
        yield f"  and {len(units) - MOST_LISTED} more"


def _missing(
    missing: Sequence[str], chosen: Sequence[Head], left_out: Iterable[Head]
) -> Iterator[DynamicsFault]:
    """Yield a fault for each record that may be the machine or exciter that is missing."""
    classical = [*classical_machines(chosen)]
    if classical:
        yield from classical
        return
    unknown = [head for head in left_out if kind_left_out(head.name) is None]
    for kind in missing:
        names = names_of(kind, chosen[0].program)
        candidates = [head for head in unknown if len(missing) == 1 or _looks_like(head) == kind]
        for head in candidates:
            text = f"exfit has no {kind} of that name; {near(head.name, names)}"
            yield DynamicsFault(head.line, f"{head.name}: {text}")
        if not candidates:
            unit = f"bus {chosen[0].bus}, id {chosen[0].id}"
            yield DynamicsFault(chosen[0].line, f"{unit}: has no {kind}; known: {', '.join(names)}")


def classical_machines(heads: Iterable[Head]) -> Iterator[DynamicsFault]:
    """Name units that are classical machines, which have nothing that a record could verify."""
    for head in heads:
        if head.name.upper() in CLASSICAL:
            yield DynamicsFault(head.line, f"{head.name} is {CLASSICAL[head.name.upper()]}")


def all_classical(heads: Iterable[Head]) -> bool:
    """Whether the records at a place are classical machines alone, which are no unit to verify."""
    return all(head.name.upper() in CLASSICAL for head in heads)


def names_of(kind: str, program: str) -> list[str]:
    """Return the names by which a file of a program may have a machine or an exciter."""
    return sorted(
        definition.record.name
        for definition in definitions(program)
        if definition.kind == kind and definition_of(definition.record.name, program) == definition
    )


def _looks_like(head: Head) -> str:
    """Guess the kind of a record by its name: PSS/E's machines are GENROU, GENSAL, GENCLS ..."""
    return "machine" if head.name.upper().startswith("GEN") else "exciter"


def kind_left_out(name: str) -> str | None:
    """Guess the kind of a record that is left out, None where its name does not show it."""
    return LIMITER if name.upper() in LIMITERS else OTHERS.get(name.upper())


def _left_out(head: Head, exciter: UnitPart) -> str:
    kind = kind_left_out(head.name)
    if kind is None:
        return f"{head.name} is left out: not a known model"
    name = head.name.upper()
    if name not in LIMITERS:
        return f"{kind} {name} is left out"
    how = f"give it under limiters{_place(name, exciter)}"
    for record in LIMITERS[name].records:
        if record.exchanged:
            how += f", {' and '.join(record.exchanged)} exchanged"
    return f"{kind} {name} is left out: {how}"


def _place(limiter: str, exciter: UnitPart) -> str:
    """Find the place of a limiter by the flag of its exciter's record, "" where it is not known."""
    definition, flag = exciter.definition, limiter[:3]
    values = dict(zip(definition.names, exciter.fields, strict=True))
    if flag not in FLAGS or flag not in values:
        return ""
    code = int(number(values[flag]))
    place = dict(definition.record.places).get(code)
    if place not in LIMITERS[limiter].places:
        return ""
    return f", place: {place} ({definition.record.name} has {flag} = {code})"
