"""A case to start from: a model, records, and what is typical for all that is not known."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from exfit.case.case_draft import (
    CaseDraft,
    Noted,
    OpenValue,
    Remark,
    Section,
    parameter,
    with_sources,
)
from exfit.case.load import checked_case, faults_with_lines
from exfit.case.other_model import ALONE, bounds_of, free_of
from exfit.case.schema import SINGLE
from exfit.case.suggestion import (
    Base,
    bump_section,
    channels_section,
    record_of,
    relative,
    rounded,
    steps_section,
    suggested_event,
    weights_section,
)
from exfit.case.yaml import QUESTION, read_text, read_yaml
from exfit.errors import CaseError, ExfitError
from exfit.features.start.ratings import NO_RATINGS, Ratings, answered
from exfit.features.start.starting_tests import (
    StartingTest,
    doubtful_bases,
    refuse_other_size,
    sizes_in_use,
    starting_tests,
)
from exfit.features.start.tables import CaseOfTable, TableRow, tests_of_table
from exfit.models import find
from exfit.models.machines import Machine, find_machine
from exfit.models.sheet import Model, Parameter, typical
from exfit.plants import LOAD_CONTROLLER, MACHINE
from exfit.plants.infinite_bus import INFINITE_BUS
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.records.contradictions import shows_power
from exfit.records.inspection import Inspection
from exfit.records.recorded_tests import tests_of
from exfit.util.text import first_texts
from exfit.util.vocabulary import TYPICAL

DROOPS = ("R", "r")  # of a governor, permanent and temporary
SOME_TEST = {"vref": [{"at": 0.1, "step": 0.01}], "duration": 1.0}  # in place of a record's

VALIDATION_TO_COME = Remark("""\
validate:               # a record that the fit does not see, as the step down
  - name: down
    test: {vref: [{at: 1.0, step: -0.05}]}
    record: {file: down.csv, time: t, channels: {vt: vt}}""")
FACTS_TO_COME = Remark("about: {Plant: ..., Unit: ..., Rated: ..., Tested by: ...}  # for reports")


@dataclass(frozen=True)
class PartData:
    """A model with a value for each parameter, and the sources of these in the words of a case.

    A value without a source is not stated; ``origin`` says in a comment where the data are from;
    ``inputs`` are the signals of a stabiliser, () for those of its model; ``times_speed`` says that
    the speed multiplies the efd of an exciter; ``place`` is where a limiter acts on it.
    """

    model: Model | Machine
    values: Mapping[str, float]
    sources: Mapping[str, str]
    origin: str = ""
    inputs: tuple[str, ...] = ()
    times_speed: bool = False
    place: str = ""

    @classmethod
    def typical(cls, model: Model | Machine) -> "PartData":
        """Return a model with its typical data."""
        return cls(model, typical(model.sheet), {row.symbol: TYPICAL for row in model.sheet})


@dataclass(frozen=True)
class UnitData:
    """The exciter, behind the ``name`` that the case gives it, its machine, and what is ``added``.

    That are the stabiliser and the governor, each under the key of its section, and the
    ``limiters``; ``as_found`` is the section of what was in the planner's base.
    """

    name: str
    exciter: PartData
    machine: PartData
    added: Mapping[str, PartData] = field(default_factory=dict)
    limiters: tuple[PartData, ...] = ()
    as_found: Section = field(default_factory=dict)


def unit_with(
    model: str | None, machine: str | None, planner: UnitData | None, folder: Path
) -> UnitData:
    """Return a unit with typical data, or a planner's, with another exciter where one is given.

    A ``model`` that is a file is named as a case in a folder does. Raises ExfitError for a model or
    a machine that is not in the catalogue, and where neither a model nor a planner's unit is given.
    """
    if model is None:
        if planner is None:
            raise ExfitError("model: missing; the exciter is not known")
        return planner
    exciter = find(model, Path())
    if planner is not None and exciter is planner.exciter.model:
        return planner
    name = relative(Path(model), folder) if model.endswith(".py") else exciter.name
    data = PartData.typical(exciter)
    if planner is not None:
        return replace(planner, name=name, exciter=data)
    return UnitData(name, data, PartData.typical(find_machine(machine or "GENROU")))


def machine_of_case(path: Path) -> PartData:
    """Return the machine of another case with its values, those that are fitted at their start.

    An exciter in a file of Python is not run: then little but the plant is read. Raises CaseError
    with all faults of what is read, and where it has no machine.
    """
    top, faults = read_yaml(read_text(path), path)
    content = top.value
    if str(content.get("model")).endswith(".py"):
        first = next(iter(content.get("records") or [content]))
        test = {**first.get("test", {}), **SOME_TEST}
        content = {"model": "SEXS", "plant": content.get("plant"), "test": test}
    case = checked_case(content, path, faults)
    if case is None:
        raise faults_with_lines(faults, top, path)
    machine = case.parts.machine
    if machine is None:
        raise CaseError(f"{path}: plant {case.plant.type} has no machine")
    values, sources = case.values(), case.sources()
    names = {row.symbol: MACHINE + row.symbol for row in machine.sheet}
    return PartData(
        machine,
        {symbol: values[name] for symbol, name in names.items()},
        {symbol: sources[name] for symbol, name in names.items()},
        f"those of {path.name}",
    )


def starting_case(
    unit: UnitData,
    tests: Sequence[StartingTest],
    folder: Path,
    about: Mapping[str, str] | None = None,
) -> CaseDraft:
    """Make the case of a unit with the tests of one or more records.

    ``folder`` is where the case will be written, ``about`` what its report shows. What must be
    filled in is no number, so that the case is refused until it is.
    """
    names = {test.inspection.path: relative(test.inspection.path, folder) for test in tests}
    first = tests[0]
    event = suggested_event(first.inspection, names[first.inspection.path], first.bases)
    recordings, validations = (
        _events(tests, names) if event else _bump_tests(tests, names, unit.exciter.model.name)
    )
    of_governor = first.inspection.of_governor
    added: Section = {}
    for key, part in unit.added.items():
        tested = of_governor and key == "governor"
        put_added(added, key, _governor(unit, event) if tested else added_section(part))
    if of_governor and "governor" not in added:
        added["governor"] = _governor(unit, event)
    sections: Section = {
        **({"about": about} if about else {FACTS_TO_COME: None}),
        "model": unit.name,
        **({"efd_times_speed": True} if unit.exciter.times_speed else {}),
        "plant": _plant(unit, first.inspection, event),
        **added,
        **({"limiters": [*map(added_section, unit.limiters)]} if unit.limiters else {}),
        **recordings,
        "parameters": _parameters(unit.exciter, of_governor),
        **weights_section(first.inspection),
        **validations,
        **({"as_found": unit.as_found} if unit.as_found else {}),
    }
    return CaseDraft(sections, _heading(unit, tests))


def put_added(sections: Section, kind: str, section: Section) -> None:
    """Put the section of a stabiliser, a governor or, into the latter's, its load controller."""
    if kind == LOAD_CONTROLLER:
        sections["governor"] = {**sections["governor"], "load_controller": section}
    else:
        sections[kind] = section


def added_section(part: PartData) -> Section:
    """Make the section of a stabiliser, a governor, a load controller or a limiter."""
    values = {row.symbol: parameter(row, part.values[row.symbol]) for row in part.model.sheet}
    model = Noted(part.model.name, part.origin)
    section = {"model": model, **inputs_section(part.model, part.inputs), "parameters": values}
    if part.place:
        section["place"] = part.place
    return with_sources(section, part.sources)


def inputs_section(model: Model | Machine, inputs: tuple[str, ...]) -> Section:
    """Name the input signals of a stabiliser where they are not those of its model."""
    if isinstance(model, Model) and inputs and inputs != model.inputs:
        return {"inputs": Noted(list(inputs), "as the codes of its record say")}
    return {}


def _heading(unit: UnitData, tests: Sequence[StartingTest]) -> tuple[str, ...]:
    """Say what a case is made of, what to do with its values, and what must be known of it."""
    inspections = list({test.inspection.path: test.inspection for test in tests}.values())
    records = "the record" if len(inspections) == 1 else "the records"
    files = ", ".join(inspection.path.name for inspection in inspections)
    parts = [unit.exciter, unit.machine, *unit.added.values()]
    given = list(dict.fromkeys(part.origin for part in parts if part.origin))
    advice = f"Values are {' and '.join(given)}. " if given else ""
    if any(TYPICAL in part.sources.values() for part in parts):
        those = "Replace those that are typical" if given else "Values are typical: replace them"
        advice += f"{those} by those of the unit, each with its source. "
    return (
        f"{unit.exciter.model.name} on {records} {files}: a case to start from.",
        f"{advice}`exfit check` tries the case, `exfit identify` shows what its test resolves, "
        "`exfit fit` fits.",
        *(
            f"note: {text}."
            for inspection in inspections
            for text in first_texts(inspection.findings)
        ),
    )


def _events(tests: Sequence[StartingTest], names: Mapping[Path, str]) -> tuple[Section, Section]:
    """Make the sections of grid events, or tests of a governor; the case has the first's plant."""
    suggested = [
        suggested_event(test.inspection, names[test.inspection.path], test.bases) for test in tests
    ]
    kept = ("test", "record")
    entries: list[Section] = [{k: own[k] for k in own if k in kept} for own in suggested]
    if len(tests) == 1:
        return entries[0], {}
    for own, entry in zip(suggested, entries, strict=True):
        if own["plant"]["type"].value != suggested[0]["plant"]["type"].value:
            entry["plant"] = own["plant"]
    return _recordings(
        (test, {"name": test.name, **entry}) for test, entry in zip(tests, entries, strict=True)
    )


def _recordings(entries: Iterable[tuple[StartingTest, Section]]) -> tuple[Section, Section]:
    fitted, validating = list[Section](), list[Section]()
    for test, entry in entries:
        (validating if test.validates else fitted).append(entry)
    return {"records": fitted}, {"validate": validating} if validating else {}


def _bump_tests(
    tests: Sequence[StartingTest], names: Mapping[Path, str], exciter: str
) -> tuple[Section, Section]:
    """Make the sections of what is fitted, and of what validates.

    Channels stand once, at the first record of a file that has them; others refer to them.
    """
    single = len(tests) == 1 or tests[0].name == SINGLE
    known: dict[str, Section] = {}
    entries = list[tuple[StartingTest, Section]]()
    for test in sorted(tests, key=lambda test: test.validates):
        inspection = test.inspection
        level: Section = {}
        voltage = inspection.channel_of("vt")
        if exciter == ALONE and test.window is None:
            level["vt0"] = Noted(rounded(voltage.level if voltage else 1.0), "at rest")
        elif exciter != ALONE and test.steps and not test.steps[0].from_start:
            level["vt0"] = Noted({"start": "auto"}, "the mean at rest, with its noise")
        steps = {**level, **steps_section(inspection, test.steps, test.sizes)}
        if inspection.opening is not None and not test.steps:
            steps = bump_section(inspection)["test"]
        own = channels_section(inspection, ("vt", *test.bases), test.bases)
        channels = known.setdefault(repr(own), own)  # with their comments
        shared = Noted(channels, "the records below have the same" if channels is own else "")
        given = channels if single else shared
        record = record_of(inspection, names[inspection.path], given, test.window)
        entries.append((test, {"name": test.name, "test": steps, "record": record}))
    fitted, validating = _recordings(entries)
    if single:
        (entry,) = fitted["records"]
        fitted = {"test": entry["test"], "record": entry["record"]}
    return fitted, validating or {VALIDATION_TO_COME: None}


def _plant(unit: UnitData, inspection: Inspection, event: Section) -> Section:
    of_psse = [part.model.name for part in unit.added.values() if differs_in_psse(part.model)]
    dialect = {"dialect": Noted("psse", f"{' '.join(of_psse)} as in PSS/E")} if of_psse else {}
    if event:
        return _suggested_plant(unit, inspection, {**event["plant"], **dialect})
    if unit.exciter.model.name == ALONE:
        return {"type": "none"}
    power, opening = inspection.channel_of("p"), inspection.opening
    if opening is None and (power is None or not shows_power(power)):
        return _open_circuit(unit, inspection)
    levels: dict[str, float | str] = {"P": QUESTION, "Q": QUESTION}
    for signal in ("p", "q"):
        channel = inspection.channel_of(signal)
        if channel is not None and channel.seems_per_unit:
            levels[signal.upper()] = float(f"{channel.level:.4g}")
    network = {
        "f0": Noted(QUESTION, "Hz, rated frequency"),
        "R": Noted(0.0, "pu, resistance to the source"),
        "X": Noted(QUESTION, "pu, reactance to the source: transformer and grid"),
        "P": Noted(levels["P"], "pu of the machine, before the step"),
        "Q": Noted(levels["Q"], "pu, before the step"),
    }
    measured = {name: "measured" for name, level in levels.items() if level != QUESTION}
    why = f"{power.name} shows power" if power else "on load until its breaker opens"
    plant = {
        "type": Noted(INFINITE_BUS.name, why),
        "network": network,
        **dialect,
        **_machine(unit.machine),
    }
    return with_sources(plant, {**unit.machine.sources, "R": TYPICAL, **measured})


def _suggested_plant(unit: UnitData, inspection: Inspection, plant: Section) -> Section:
    """Add the machine to the plant of an event or of a test of the governor, where it has one."""
    if not inspection.of_governor:
        sources = {**unit.machine.sources, "R": TYPICAL, "X": TYPICAL}
        return with_sources({**plant, **_machine(unit.machine)}, sources)
    if "network" not in plant:
        return plant
    return with_sources({**plant, **_machine(unit.machine)}, unit.machine.sources)


def _open_circuit(unit: UnitData, inspection: Inspection) -> Section:
    """Make the plant of a unit without load, with a question where a column may be its power."""
    doubt = [each.name for each in inspection.channels if each.may_be_load]
    on_load = f"; or is {' or '.join(doubt)} its power?" if doubt else ""
    kind = Noted(OPEN_CIRCUIT.name, f"the breaker is open, at rated speed{on_load}")
    return with_sources({"type": kind, **_machine(unit.machine)}, unit.machine.sources)


def differs_in_psse(model: Model | Machine) -> bool:
    """Tell whether PSS/E has other equations for a model."""
    return isinstance(model, Model) and "psse" in dict(model.dialects)


def _machine(machine: PartData) -> Section:
    model = machine.model
    values = {row.symbol: parameter(row, machine.values[row.symbol]) for row in model.sheet}
    return {"machine": Noted(model.name, machine.origin or model.title), "parameters": values}


def _governor(unit: UnitData, suggested: Section) -> Section:
    """Make the section of the governor that a test is fitted for."""
    if "governor" not in unit.added:
        return dict(suggested["governor"])
    part = unit.added["governor"]
    rows = [*free_of(part.model, part.values)]
    rows += [row for row in part.model.sheet if row.symbol in DROOPS]
    section = added_section(part)
    section["parameters"] = {
        row.symbol: parameter(row, part.values[row.symbol])
        for row in part.model.sheet
        if row not in rows
    }
    free = Noted(_starts(rows, part.values), "move to parameters what the record does not show")
    return {**section, "free": free}


def _starts(rows: Iterable[Parameter], values: Mapping[str, float]) -> Section:
    starts: Section = {}
    for row in rows:
        numbers = (values[row.symbol], *bounds_of(row, values[row.symbol]))
        short = (float(f"{number:.6g}") for number in numbers)
        bounds = dict(zip(("start", "min", "max"), short, strict=True))
        starts[row.symbol] = Noted(bounds, above=f"{row.unit}, {row.meaning}")
    return starts


def _parameters(exciter: PartData, of_governor: bool = False) -> Section:
    model, values = exciter.model, exciter.values
    free = () if of_governor else free_of(model, values)
    section: Section = {}
    fixed = {
        row.symbol: parameter(row, values[row.symbol]) for row in model.sheet if row not in free
    }
    if fixed:
        section["fixed"] = Noted(fixed, "stays as it is; move to free what a fit is to find")
    if free:
        section["free"] = Noted(_starts(free, values), "found between bounds about where it starts")
    sources = {name: word for name, word in exciter.sources.items() if name in fixed}
    return with_sources(section, sources)


class MadeCase(NamedTuple):
    """A new case, what is doubtful in it, and the sizes of steps that it uses."""

    draft: CaseDraft
    doubts: tuple[str, ...]
    sizes: tuple[str, ...] = ()


def case_of_records(
    inspections: Sequence[Inspection],
    unit: UnitData,
    folder: Path,
    sizes: Mapping[str, float],
    bases: Mapping[str, Base],
    ratings: Ratings = NO_RATINGS,
) -> MadeCase:
    """Return the case of a unit with all tests of its records, to be written into a folder.

    Of ``sizes`` those are used that are of one of its tests. Raises ExfitError where a record
    contradicts them.
    """
    own = sizes_in_use(sizes, inspections)
    ratings = ratings.of_record(inspections)
    bases = ratings.bases(bases, inspections)
    tests = starting_tests(inspections, own, bases)
    draft = answered(starting_case(unit, tests, folder), ratings, bases, inspections)
    return MadeCase(draft, tuple(doubtful_bases(tests)), tuple(own))


def case_of_plan(
    case: CaseOfTable,
    unit: UnitData,
    folder: Path,
    bases: Mapping[str, Base],
    ratings: Ratings = NO_RATINGS,
) -> MadeCase:
    """Return the case that a table describes, to be written into a folder.

    ``bases`` are by signal; those of the table, and its ratings, count more. What neither the
    records nor the table says is to be filled in.

    Raises ExfitError where a record cannot be read or contradicts its row.
    """
    inspections = {file: settings.inspect(file) for file, settings in case.settings.items()}
    first, only = case.tests[0], next(iter(inspections.values()))
    ratings = case.ratings.over(ratings).of_record([*inspections.values()])
    bases = ratings.bases(bases, [*inspections.values()])
    whole = only.is_event or not tests_of(only)
    if len(case.tests) == 1 and whole and first.at is None and first.step is None:
        own = {} if first.base is None else {"vt": first.base}
        tests = starting_tests([only], {}, {**bases, **own})
    else:
        tests = tests_of_table([*_of_each_test(case.tests, inspections)], inspections, bases)
    draft = starting_case(unit, tests, folder, case.about)
    voltages = {settings.voltage for settings in case.settings.values() if settings.voltage}
    given: dict[OpenValue, str | float] = {}
    for value in draft.open_values():
        *_, section, key = ("", *value.place)
        if section == "network" and key in case.network:
            given[value] = case.network[str(key)]
        elif value.place[-3:] == ("channels", "vt", "column") and len(voltages) == 1:
            given[value] = next(iter(voltages))
    draft = answered(draft.filled(given), ratings, bases, [*inspections.values()])
    return MadeCase(draft, tuple(doubtful_bases(tests)))


def _of_each_test(
    rows: Sequence[TableRow], inspections: Mapping[Path, Inspection]
) -> Iterator[TableRow]:
    """Yield a row for each test; one without an instant is of all tests of a record of its own."""
    files = [row.file for row in rows]
    for row in rows:
        assert row.file is not None
        inspection = inspections[row.file]
        tests = tests_of(inspection)
        several = len(tests) > 1 and not inspection.is_event
        if row.at is not None or not several or files.count(row.file) > 1:
            yield row
            continue
        for test in tests:
            if row.step is not None:
                try:
                    refuse_other_size(inspection, test, row.step)
                except ExfitError as fault:
                    raise ExfitError(f"{row.place}: step: {fault}") from None
            yield row._replace(at=test.at)
