"""From answers to a case: the tests of its records, the data of its unit, what is open."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from exfit.case.case_draft import CaseDraft, OpenValue
from exfit.case.other_model import free_of
from exfit.case.suggestion import RecordSettings, bases_of, rated_bases, relative
from exfit.errors import ExfitError, FileError
from exfit.features.planner.fields import located
from exfit.features.planner.import_case import import_unit, unit_data
from exfit.features.start.answers import Answers, contradictions
from exfit.features.start.starting_case import (
    PartData,
    UnitData,
    machine_of_case,
    starting_case,
    unit_with,
)
from exfit.features.start.starting_tests import StartingTest, doubtful_bases, starting_tests
from exfit.features.start.tables import read_test_table, tests_of_table
from exfit.models import GOVERNORS
from exfit.models.sheet import Parameter
from exfit.plants import KINDS
from exfit.records.inspection import Inspection
from exfit.records.recorded_tests import tests_of
from exfit.util.text import dotted, listed, near
from exfit.util.vocabulary import TYPICAL

ON_LOAD = "on load"  # in the meaning of a parameter that acts there alone
HINTS = {"mva": "rated power of the unit"}  # of what has no hint in the case
TITLES = {"machine": "generator", "exciter": "exciter"}
ANY_MODEL = "SEXS"  # where that of the unit is not known yet

Inspections = dict[Path, Inspection]  # of the files read so far


class NewCase(NamedTuple):
    """A case that was made of answers: its unit, its tests, what is doubtful, what is open."""

    draft: CaseDraft
    unit: UnitData
    tests: tuple[StartingTest, ...]
    doubts: tuple[str, ...]
    open: tuple[OpenValue, ...]

    @property
    def on_load(self) -> bool:
        """Whether the machine is on load: in a grid event, or where the record shows power."""
        kind = KINDS.get(self.draft.kind_of_plant)
        return kind is not None and kind.on_load


def new_case(answers: Answers, folder: Path, read: Inspections) -> NewCase:
    """Make the case of some answers, to be written into a folder; ``read`` holds files read before.

    Without a model of the exciter it has any. Raises ExfitError for answers that contradict each
    other, the record or a data sheet.
    """
    for text in contradictions(answers):
        raise ExfitError(text)
    tests = tests_of_answers(answers, read)
    planner, warnings = None, tuple[str, ...]()
    if answers.dyr is not None:
        imported = import_unit(Path(answers.dyr), answers.bus, answers.id)
        warnings = tuple(located(imported.warnings, answers.dyr))
        planner = unit_data(imported, relative(Path(answers.dyr), folder))
    model = answers.model or (None if planner else ANY_MODEL)
    unit = unit_with(model, answers.machine_model, planner, folder)
    unit = replace(unit, added={**unit.added, **_governor(answers.governor)})
    machine, exciter = unit.machine, unit.exciter
    if answers.machine_from is not None:
        machine = machine_of_case(Path(answers.machine_from))
    faults = list[str]()
    machine = _with_values("machine", machine, answers.machine, answers, faults)
    exciter = _with_values("exciter", exciter, answers.exciter, answers, faults)
    known = {row.symbol for part in (machine, exciter) for row in part.model.sheet} | {"all"}
    for name in answers.sources:
        if name not in known:
            faults.append(f"sources: {name}: no parameter of this unit; {near(name, known)}")
    if faults:
        raise FileError(faults)
    unit = replace(unit, machine=machine, exciter=exciter)
    draft = starting_case(unit, tests, folder, answers.about)
    places = {dotted(value.place): value for value in draft.open_values()}
    for place in answers.open:
        if place not in places:
            raise ExfitError(f"open: {place}: not open in this case; {near(place, places)}")
    draft = draft.filled({places[place]: value for place, value in answers.open.items()})
    doubts = (*warnings, *doubtful_bases(tests))
    return NewCase(draft, unit, tests, doubts, draft.open_values())


def inspected(answers: Answers, file: Path, read: Inspections) -> Inspection:
    """Inspect a record as some answers say; raises ExfitError where it cannot be read."""
    if file not in read:
        settings = RecordSettings(
            answers.time, answers.time_unit, answers.sheet, memory=answers.memory
        )
        read[file] = settings.inspect(file)
    inspection = read[file]
    names = [channel.name for channel in inspection.channels]
    if answers.vt is None or (answers.vt not in names and str(file) != answers.record):
        return inspection
    if answers.vt not in names:
        raise ExfitError(f"vt: {answers.vt}: no column of {file}; {near(answers.vt, names)}")
    channels = tuple(
        replace(channel, signal="vt", sure=True, why="the answer to a question")
        if channel.name == answers.vt
        else replace(channel, signal=None if channel.signal == "vt" else channel.signal)
        for channel in inspection.channels
    )
    return replace(inspection, channels=channels)


def tests_of_answers(answers: Answers, read: Inspections) -> tuple[StartingTest, ...]:
    """Return the tests of a record and of further ones, or those that a table names."""
    texts = tuple(f"{signal}={text}" for signal, text in answers.base.items())
    bases = rated_bases(bases_of(texts), answers.kv, answers.mva)
    file = None if answers.record is None else Path(answers.record)
    if answers.tests is None:
        if file is None:
            raise ExfitError("record: missing")
        further = [inspected(answers, Path(other), read) for other in answers.validations]
        return starting_tests([inspected(answers, file, read)], answers.step, bases, further)
    rows = [row._replace(file=row.file or file) for row in read_test_table(Path(answers.tests))]
    for row in rows:
        if row.file is None:
            raise ExfitError(f"{row.place}: file: missing, and no --record is given")
    files = dict.fromkeys(row.file for row in rows if row.file is not None)
    return tests_of_table(rows, {path: inspected(answers, path, read) for path in files}, bases)


def _governor(name: str | None) -> dict[str, PartData]:
    """Return a governor with typical data under its key; raises ExfitError for an unknown one."""
    if name is None:
        return {}
    symbol = name.upper()
    if symbol not in GOVERNORS:
        raise ExfitError(f"governor: {name}: no governor of exfit; {near(symbol, GOVERNORS)}")
    return {"governor": PartData.typical(GOVERNORS[symbol])}


def _with_values(
    key: str, part: PartData, values: Mapping[str, float], answers: Answers, faults: list[str]
) -> PartData:
    """Return a part with other values and their sources; add what is wrong with them."""
    rows = {row.symbol: row for row in part.model.sheet}
    for symbol, value in values.items():
        place = f"{key}: {symbol}"
        if symbol not in rows:
            faults.append(f"{place}: no parameter of {part.model.name}; {near(symbol, rows)}")
        elif (fault := rows[symbol].range_fault(value)) is not None:
            faults.append(f"{place}: {fault}")
    sources = {name: word for name, word in part.sources.items() if name not in values}
    sources |= {symbol: answers.source_of(symbol) for symbol in values}
    return replace(part, values={**part.values, **values}, sources=sources)


def typical_values(case: NewCase) -> dict[str, list[Parameter]]:
    """List the parameters that stay typical and act in the tests, of the generator and exciter."""
    unit = case.unit
    free = {row.symbol for row in free_of(unit.exciter.model, unit.exciter.values)}
    return {
        key: [
            row
            for row in part.model.sheet
            if part.sources.get(row.symbol) == TYPICAL
            and not (ON_LOAD in row.meaning and not case.on_load)
            and not (key == "exciter" and row.symbol in free)
        ]
        for key, part in (("machine", unit.machine), ("exciter", unit.exciter))
        if key == "exciter" or case.draft.kind_of_plant != "none"
    }


def typical_left(case: NewCase) -> str:
    """Name the values that stay typical, "" where none does."""
    parts = typical_values(case)
    texts = [
        f"{TITLES[key]}: {listed([row.symbol for row in rows])}"
        for key, rows in parts.items()
        if rows
    ]
    return "; ".join(texts)


def key_of(value: OpenValue, answers: Answers, tests: Sequence[StartingTest]) -> str:
    """Name the answer that fills in an open value of a case."""
    *_, section, key = ("", *value.place)
    if key == "step" and not answers.step and any(tests_of(test.inspection) for test in tests):
        return "step"
    if value.place[-3:] == ("channels", "vt", "column"):
        return "vt"
    if (key == "kV" or (section, key) == ("vt", "base")) and answers.kv is None:
        return "kv"
    if (key == "MVA" or (section in ("p", "q") and key == "base")) and answers.mva is None:
        return "mva"
    return f"open.{dotted(value.place)}"


def missing_in(answers: Answers, folder: Path, read: Inspections) -> dict[str, str]:
    """List the answers that a case cannot do without, by their keys, with what each one is."""
    missing: dict[str, str] = {}
    if answers.record is None and answers.tests is None:
        missing["record"] = "file with the record of the tests"
    if answers.model is None and answers.dyr is None:
        missing["model"] = "model of the exciter, or dyr: a planner's file"
    if "record" not in missing:
        case = new_case(answers, folder, read)
        for value in case.open:
            key = key_of(value, answers, case.tests)
            missing.setdefault(key, value.hint or HINTS.get(key, "the record does not show it"))
    return missing
