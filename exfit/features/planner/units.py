"""The units of a dynamics file: machine, exciter, stabiliser, governor, and what is left out."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from exfit.errors import DynamicsError
from exfit.features.planner.fields import DynamicsFault, located, number
from exfit.features.planner.pslf import PSLF_FILES
from exfit.features.planner.psse import PSSE_FILES
from exfit.features.planner.records import (
    FLAGS,
    SHARE,
    FileFormat,
    Head,
    Reading,
    definition_of,
    definitions,
    read_values,
)
from exfit.models import LIMITERS
from exfit.util.text import closest, near, show

FORMATS = {files.suffix.removeprefix("."): files for files in (PSSE_FILES, PSLF_FILES)}
NEARLY_THE_NAME = 0.8  # of two names alike: a typing error, not another model
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

CLASSICAL = {"GENCLS": "a constant voltage behind a reactance, with nothing to verify"}


def format_of(file: str | Path) -> FileFormat:
    """Return the format of a file by its name: PSS/E's, unless it ends as another's."""
    return FORMATS.get(Path(file).suffix.lower().removeprefix("."), PSSE_FILES)


@dataclass(frozen=True)
class Unit:
    """A unit; ``warnings`` say, by line, what of the file its models do not represent."""

    bus: int
    id: str
    machine: Reading
    exciter: Reading
    stabiliser: Reading | None
    governor: Reading | None
    warnings: tuple[DynamicsFault, ...]

    @property
    def added(self) -> tuple[Reading, ...]:
        """Its stabiliser and its governor, those that it has."""
        return tuple(part for part in (self.stabiliser, self.governor) if part is not None)


@dataclass(frozen=True)
class RefusedUnit:
    """A unit that cannot be imported: its records by name, and why.

    ``modelled``: it has a machine and an exciter that exfit knows, so that its values are at fault.
    """

    bus: int
    id: str
    line: int
    records: tuple[str, ...]
    modelled: bool
    faults: tuple[DynamicsFault, ...]


@dataclass(frozen=True)
class DynamicsUnits:
    """The units of a dynamics file in its order; ``faults`` are of records that belong to no unit.

    ``classical`` counts the classical machines without an exciter, which are no units.
    """

    units: tuple[Unit, ...]
    refused: tuple[RefusedUnit, ...]
    faults: tuple[DynamicsFault, ...]
    classical: int = 0


def read_units(text: str, file: str | Path) -> DynamicsUnits:
    """Return every unit of a dynamics file, whose suffix gives the program.

    What is wrong with one does not hinder the others. A unit is what has a bus and a machine id:
    loads and other devices whose records begin so count as units without a machine.
    """
    heads, faults = format_of(file).heads(text)
    units, refused, classical = list[Unit](), list[RefusedUnit](), 0
    for own in _by_unit(heads).values():
        if _all_classical(own):
            classical += 1
            continue
        unit, wrong = _unit_of(own)
        if unit is not None:
            units.append(unit)
            continue
        missing, first = _missing_kinds(own), own[0]
        wrong += _lacking(own, missing)
        refused.append(
            RefusedUnit(
                first.bus,
                first.id,
                first.line,
                tuple(head.name for head in own),
                not missing,
                tuple(sorted(wrong, key=lambda fault: fault.line)),
            )
        )
    return DynamicsUnits(tuple(units), tuple(refused), tuple(faults), classical)


def read_unit(text: str, file: str, bus: int | None = None, machine_id: str | None = None) -> Unit:
    """Return a unit of a dynamics file: the only one, or that of a bus and a machine id.

    Raises DynamicsError with all faults of its records, each as ``file:line: what is wrong``, and
    where the unit is not in the file, is not the only one, or has no machine or exciter that exfit
    knows.
    """
    files = format_of(file)
    heads, faults = files.heads(text)
    if faults:
        raise DynamicsError(located(faults, file))
    if not heads:
        raise DynamicsError(f"{file}: has no record of a unit: {files.begins}")
    chosen = _chosen(_by_unit(heads), file, bus, machine_id)
    unit, faults = _unit_of(chosen)
    if unit is None:
        faults += _missing(_missing_kinds(chosen), chosen)
        raise DynamicsError(located(faults, file))
    return unit


def _by_unit(heads: Iterable[Head]) -> dict[tuple[int, str], list[Head]]:
    """Return the records of each unit by its bus and its id in capitals."""
    units: dict[tuple[int, str], list[Head]] = {}
    for head in heads:
        units.setdefault((head.bus, head.id.upper()), []).append(head)
    return units


def _chosen(
    units: Mapping[tuple[int, str], list[Head]], file: str, bus: int | None, machine_id: str | None
) -> list[Head]:
    """Return the records of one unit; raises DynamicsError where it is not exactly one."""
    wanted_id = None if machine_id is None else machine_id.strip().upper()
    meant = {
        key: records
        for key, records in units.items()
        if bus in (None, key[0]) and wanted_id in (None, key[1])
    }
    if len(meant) > 1:
        meant = {key: own for key, own in meant.items() if not _all_classical(own)}
    if len(meant) == 1:
        return next(iter(meant.values()))
    if meant:
        text = f"{file}: {len(meant)} units; select one by --bus and --id"
        raise DynamicsError([text, *_listed(meant)])
    given = {"bus": bus, "id": machine_id}
    wanted = (f"{label} {value!r}" for label, value in given.items() if value is not None)
    text = f"{file}: no record of {', '.join(wanted)}; the file has"
    raise DynamicsError([text, *_listed(units)])


def _listed(units: Mapping[tuple[int, str], list[Head]]) -> Iterator[str]:
    for (bus, machine_id), heads in list(units.items())[:MOST_LISTED]:
        yield f"  bus {bus}, id {machine_id}: {', '.join(head.name for head in heads)}"
    if len(units) > MOST_LISTED:
        yield f"  and {len(units) - MOST_LISTED} more"


def _unit_of(heads: Sequence[Head]) -> tuple[Unit | None, list[DynamicsFault]]:
    """Return the unit of its records, and their faults, with which it is None.

    It is None, too, where it has no machine or exciter that exfit knows.
    """
    faults, warnings = list[DynamicsFault](), list[DynamicsFault]()
    parts: dict[str, Reading] = {}
    for head in heads:
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
        parts[kind] = reading
    if "governor" in parts:
        parts["governor"] = _on_its_base(parts["governor"], heads, warnings)
    if faults or not parts.keys() >= {*NEEDED}:
        return None, faults
    exciter = parts["exciter"]
    warnings += [
        DynamicsFault(head.line, _left_out(head, exciter))
        for head in heads
        if head.definition is None
    ]
    unit = Unit(
        heads[0].bus,
        heads[0].id,
        parts["machine"],
        exciter,
        parts.get("stabiliser"),
        parts.get("governor"),
        tuple(sorted(warnings, key=lambda warning: warning.line)),
    )
    return unit, []


def _on_its_base(
    governor: Reading, heads: Iterable[Head], warnings: list[DynamicsFault]
) -> Reading:
    """Return a governor with the share of its base in the machine's, or add that it is another."""
    bases = {head.definition.kind: head.base for head in heads if head.definition is not None}
    own, machine = bases.get("governor"), bases.get("machine")
    if own is None or own == machine:
        return governor
    if machine is not None and machine > 0.0 and SHARE in governor.values:
        return replace(governor, values={**governor.values, SHARE: own / machine})
    theirs = "is not in the file" if machine is None else f"is {show(machine)} MVA"
    name = governor.definition.record.name
    text = (
        f"{name}: its values are on {show(own)} MW and not converted; the machine's base {theirs}"
    )
    warnings.append(DynamicsFault(governor.line, text))
    return governor


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
        for head in _unknown(chosen):  # PSS/E's machines are GENROU, GENSAL, GENCLS ...
            looks_like = "machine" if head.name.upper().startswith("GEN") else "exciter"
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
    names = [name for kind in NEEDED for name in _names_of(kind, heads[0].program)]
    for head in _unknown(heads):
        meant = closest(head.name, names, NEARLY_THE_NAME)
        if meant is not None:
            yield DynamicsFault(head.line, f"{head.name}: did you mean {meant}?")


def _unknown(heads: Iterable[Head]) -> list[Head]:
    """Return the records whose names do not show what they are."""
    left_out = (head for head in heads if head.definition is None)
    return [head for head in left_out if _kind_left_out(head.name) is None]


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


def _names_of(kind: str, program: str) -> list[str]:
    """Return the names by which a file of a program may have a machine or an exciter."""
    return sorted(
        definition.record.name
        for definition in definitions(program)
        if definition.kind == kind and definition_of(definition.record.name, program) == definition
    )


def _kind_left_out(name: str) -> str | None:
    """Guess the kind of a record that is left out, None where its name does not show it."""
    return LIMITER if name.upper() in LIMITERS else OTHERS.get(name.upper())


def _left_out(head: Head, exciter: Reading) -> str:
    kind, name = _kind_left_out(head.name), head.name.upper()
    if kind is None:
        return f"{head.name} is left out: not a known model"
    if name not in LIMITERS:
        return f"{kind} {name} is left out"
    how = "give it under limiters"
    # its place by the flag of its exciter's record
    record, flag = exciter.definition.record, name[:3]
    values = dict(zip(exciter.definition.names, exciter.fields, strict=True))
    if flag in FLAGS and flag in values:
        code = int(number(values[flag]))
        place = dict(record.places).get(code)
        if place in LIMITERS[name].places:
            how += f", place: {place} ({record.name} has {flag} = {code})"
    for own in LIMITERS[name].records:
        if own.exchanged:
            how += f", {' and '.join(own.exchanged)} exchanged"
    return f"{kind} {name} is left out: {how}"
