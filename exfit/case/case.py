"""Case: a checked case file, with the models it names. It is data: nothing of it ever changes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from exfit.case.parts import Part, Parts, in_plant, is_held
from exfit.case.schema import (
    SINGLE,
    AsFoundSection,
    BumpTest,
    CaseDocument,
    Estimate,
    ExternalPlant,
    FmuPlant,
    FreeSection,
    FurtherUnitSection,
    Governor,
    Limiter,
    Parameters,
    Plant,
    RecordFile,
    Recording,
    SaturationName,
    SimulationSection,
    Stabiliser,
    Value,
)
from exfit.case.schema.values import GivenAs
from exfit.case.ties import Ties
from exfit.errors import CaseError
from exfit.models.sheet import Parameter
from exfit.plants import KINDS, NETWORK, PlantKind
from exfit.records.record import Record
from exfit.util.text import near
from exfit.util.vocabulary import FITTED, NOT_STATED, TYPICAL, Criteria, least_certain


class GivenValue(NamedTuple):
    """A value in place of one of the case file: the one there, and who gave it.

    ``before`` is None for what starts from the record. ``source`` is a file of parameters, or an
    option.
    """

    value: float
    before: float | None
    source: Path | str


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case of exfit: a model, its plant, a test, its records, and the parameters to be found.

    The sections are those of the case file. ``path`` is that file. For a case made in Python
    (``from_file`` is false) ``path`` is the folder of its files and the name that messages use.
    ``given_records`` holds, by name, the records that were given as arrays instead of files,
    ``given_values`` the values of parameters that were given in place of those of the sections,
    ``given_sources`` where values that were given beside the case come from, ``given_std_errors``
    their standard errors, ``freed`` those values of the file that are fitted, too. ``external`` is
    the section of what simulates the unit in place of exfit: ``plant`` is its twin then, if any,
    and the search local unless the case says otherwise.
    """

    path: Path
    from_file: bool
    about: Mapping[str, float | str]
    model: str | None
    saturation: SaturationName
    efd_times_speed: bool
    plant: Plant
    stabiliser: Stabiliser | None
    governor: Governor | None
    limiters: tuple[Limiter, ...]
    further_units: tuple[FurtherUnitSection, ...]
    test: BumpTest | None
    record: RecordFile | None
    records: tuple[Recording, ...]
    parameters: Parameters
    given: GivenAs
    estimate: Estimate
    simulation: SimulationSection
    validations: tuple[Recording, ...]
    criteria: Criteria
    as_found: AsFoundSection | None
    parts: Parts
    ties: Ties
    external: ExternalPlant | FmuPlant | None = None
    given_records: Mapping[str, Record] = field(default_factory=dict)
    given_values: Mapping[str, GivenValue] = field(default_factory=dict)
    given_sources: Mapping[str, str] = field(default_factory=dict)
    given_std_errors: Mapping[str, float] = field(default_factory=dict)
    freed: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return the name, what is studied, and the free parameters, in one line."""
        free = ", ".join(self.free()) or "nothing"
        return f"<Case {self.path.stem}: {self.subject}, {self.plant.type}; free: {free}>"

    @classmethod
    def of(
        cls, document: CaseDocument, parts: Parts, ties: Ties, path: Path, from_file: bool = True
    ) -> "Case":
        """Return the case of checked sections that are, or would be, in the file ``path``.

        Raises CaseError for faults in the file of its criteria.
        """
        sections = {name: getattr(document, name) for name in CaseDocument.model_fields}
        external = sections["plant"]
        if isinstance(external, ExternalPlant | FmuPlant):
            sections.update(plant=external.plant, external=external)
            if "search" not in document.estimate.model_fields_set:
                sections["estimate"] = sections["estimate"].model_copy(update={"search": "local"})
        sections["criteria"] = Criteria()
        if document.criteria is not None:
            from exfit.case.criteria import criteria_of

            sections["criteria"] = criteria_of(document.criteria, path.parent)
        return cls(path=path, from_file=from_file, parts=parts, ties=ties, **sections)

    @classmethod
    def from_dict(
        cls,
        content: Mapping[str, Any],
        record: Record | Mapping[str, Record] | None = None,
        folder: str | Path = ".",
        name: str = "case",
    ) -> "Case":
        """Return the case that a mapping with the keys of a case file describes.

        Args:
            content: the sections of the case.
            record: the measurements, in place of a file; of several records a mapping by name. The
                section ``record`` may then be missing, or say only how they are compared.
            folder: to which the files that the case names are relative.
            name: what messages call the case.

        Raises CaseError with all faults, each as ``name: place: what is wrong``.

        Example:
            >>> record = exfit.Record.from_arrays(time, {"vt": vt})
            >>> case = exfit.Case.from_dict({"model": "SEXS", ...}, record)
        """
        from exfit.case.load import case_of_dict

        records = {SINGLE: record} if isinstance(record, Record) else record or {}
        return case_of_dict(content, records, Path(folder) / name)

    def with_record(self, record: Record, name: str = SINGLE) -> "Case":
        """Return the case with other measurements for one of its records, in place of its file.

        ``name`` is that of the record in the case, "fit" where there is only one. The signals are
        per unit and are not changed. The keys of the record's section that say how it is compared
        (weight, noise, filter, outliers, mask, delay) apply; those that say how it is read
        (columns, units, window, resample) do not. Raises CaseError where the case has no such
        record, or where a signal is missing.
        """
        sections = {
            recording.name: recording.record for recording in (*self.recordings, *self.validations)
        }
        if name not in sections:
            hint = near(name, sections) if sections else "it has none: give it to Case.from_dict"
            raise CaseError(f"{self.path}: {name}: not a record of the case; {hint}")
        missing = [signal for signal in sections[name].channels if signal not in record.signals]
        if missing:
            raise CaseError(
                f"{self.path}: record {name}: {signal}: missing in {record.source}"
                for signal in missing
            )
        return replace(self, given_records={**self.given_records, name: record})

    def with_values(
        self,
        values: Mapping[str, float],
        source: Path | str,
        sources: Mapping[str, str] = MappingProxyType({}),
    ) -> "Case":
        """Return the case with other values: fixed ones, and starts of those that are free.

        A value that followed others no longer does. ``source`` says who gave the values,
        ``sources`` where each of them comes from. Names and values are not checked.
        """
        own = self.values()
        earlier = self.given_values
        given = {
            name: GivenValue(
                value, earlier[name].before if name in earlier else own.get(name), source
            )
            for name, value in values.items()
            if value != own.get(name)
        }
        ties = {name: tie for name, tie in self.ties.by_name.items() if name not in given}
        given_sources = {
            name: sources.get(name, NOT_STATED) for name in values if name in (*sources, *given)
        }
        return replace(
            self,
            ties=Ties(ties),
            given_values={**earlier, **given},
            given_sources={**self.given_sources, **given_sources},
        )

    @property
    def folder(self) -> Path:
        """The folder to which the paths in the file are relative."""
        return self.path.parent

    @property
    def program_files(self) -> list[Path]:
        """The files of what simulates it in place of exfit, which are code: scripts, or an FMU."""
        if self.external is None:
            return []
        if isinstance(self.external, FmuPlant):
            return [self.folder / self.external.file]
        from exfit.case.peek import scripts_of

        return [self.folder / word for word in scripts_of(self.external.command, self.folder)]

    @property
    def parameter_file(self) -> Path | None:
        """The file that gave values in place of those of the case, if one did."""
        sources = (given.source for given in self.given_values.values())
        return next((source for source in sources if isinstance(source, Path)), None)

    @property
    def subject(self) -> str:
        """The name of what is simulated: the exciter, or the machine where it is alone."""
        return self.parts.all[0].name

    @property
    def recordings(self) -> tuple[Recording, ...]:
        """The records that are fitted; a single one is named fit."""
        test = BumpTest() if self.test is None and self.kind.finds_rest else self.test
        if self.records or self.record is None or test is None:
            return self.records
        # both sections are checked already
        return (Recording.model_construct(name=SINGLE, test=test, record=self.record),)

    @property
    def tests(self) -> tuple[BumpTest, ...]:
        """The tests of the fit, then those of the validations."""
        alone = () if self.test is None else (self.test,)
        return (*alone, *(recording.test for recording in (*self.records, *self.validations)))

    @property
    def kind(self) -> PlantKind:
        """The kind of its plant."""
        return KINDS[self.plant.type]

    @property
    def has_no_equations(self) -> bool:
        """Whether another program simulates it and no plant of exfit is its twin."""
        return self.external is not None and self.external.twin is None

    @property
    def on_load(self) -> bool:
        """Whether the breaker is closed in any of the tests."""
        plants = (
            self.plant,
            *(recording.plant for recording in (*self.records, *self.validations)),
        )
        return any(KINDS[plant.type].on_load for plant in plants if plant is not None)

    def seen_from(self, recording: Recording) -> "Case":
        """Return the case as one record sees it: in the plant of that record."""
        plant = recording.plant
        if plant is None or not self.kind.closed_loop:
            return self
        whole, own = dict(self.plant), dict(plant)
        machine = {key: whole[key] for key in ("machine", "parameters", "free")}
        sources = {**whole["sources"], **own.get("sources", {})}
        return replace(
            self,
            plant=plant.whole(**{**machine, **own, "sources": sources}),
            parts=in_plant(self.parts, KINDS[plant.type], plant.given),
            given_values={
                name: given
                for name, given in self.given_values.items()
                if not name.startswith(NETWORK)
            },
        )

    def values(self) -> dict[str, float]:
        """Return every parameter of the parts, as the system names them: typical, fixed, start.

        What was given in place of these counts. What follows others comes out of them; helpers
        that only such arithmetic uses come last.
        """
        values: dict[str, float] = {}
        for part in self.parts.all:
            starts = {symbol: free.start for symbol, free in self._free(part).items()}
            resolved = part.resolved(numbers_of(self._fixed(part)), starts)
            values |= {part.prefix + symbol: value for symbol, value in resolved.items()}
        values |= {name: free.start for name, free in self._helpers(self.parameters.free).items()}
        values |= numbers_of(self._helpers(self.parameters.fixed))
        given = {name: each.value for name, each in self.given_values.items() if name in values}
        return self.ties.apply({**values, **given})

    def free(self) -> dict[str, FreeSection]:
        """Return the free parameters, as the system names them, without those that are held."""
        held = self.held()
        given = self._free_as_given()
        return {name: free for name, free in given.items() if name not in held}

    def held(self) -> tuple[str, ...]:
        """Return the time constants that are given as free and start from 0.

        Their blocks are bypassed, so that they stay at 0.
        """
        rows = self.rows()
        given = self._free_as_given()
        return tuple(name for name, free in given.items() if is_held(free.start, rows.get(name)))

    def rows(self) -> dict[str, Parameter]:
        """Return the row of the data sheet of every parameter, as the system names it."""
        return {part.prefix + row.symbol: row for part in self.parts.all for row in part.sheet}

    def _free_as_given(self) -> dict[str, FreeSection]:
        own = {
            part.prefix + symbol: free
            for part in self.parts.all
            for symbol, free in self._free(part).items()
        }
        sections = {**own, **self._helpers(self.parameters.free)}
        starts = {
            name: given.value for name, given in self.given_values.items() if name in sections
        }
        return {
            name: section.model_copy(update={"start": starts[name]}) if name in starts else section
            for name, section in sections.items()
        }

    def sources(self, fitted: Iterable[str] = ()) -> dict[str, str]:
        """Name the source of every value, as the system names them: typical, nameplate ...

        What the case does not give is typical. The source of a free parameter is that of its start,
        unless it is among those ``fitted``. What follows others is as certain as the least certain
        of these.
        """
        sources = dict.fromkeys(self.values(), NOT_STATED)
        for part in self.parts.all:
            stated: Mapping[str, str] = self._section(part, "sources")
            given, own = {*self._fixed(part), *self._free(part)}, part.symbols
            sources |= {
                part.prefix + symbol: stated.get(symbol, NOT_STATED) if symbol in given else TYPICAL
                for symbol in own
            }
            helpers = stated if part.kind == "exciter" else ()
            sources |= {name: stated[name] for name in helpers if name not in own}
        sources |= {name: word for name, word in self.given_sources.items() if name in sources}
        sources |= dict.fromkeys(fitted, FITTED)
        for name in self.ties.order:
            sources[name] = least_certain(sources[used] for used in self.ties.by_name[name].names)
        return sources

    def std_errors(self) -> dict[str, float]:
        """Return the standard errors that the case gives of its values, as the system names them.

        What is free or follows others has none, nor what was given in place of a value of the case
        without an error of its own. `given_errors.given_std_errors` has those of other values, too.
        """
        return {name: std for name, std in self._stated_errors().items() if std > 0.0}

    def exact(self) -> tuple[str, ...]:
        """Return the given values that are said to be exact, as the system names them."""
        return tuple(name for name, std in self._stated_errors().items() if std == 0.0)

    def _stated_errors(self) -> dict[str, float]:
        std_errors: dict[str, float] = {}
        for part in self.parts.all:
            stated: Mapping[str, float] = self._section(part, "std_errors")
            own = {*part.symbols, *(stated if part.kind == "exciter" else ())}  # with helpers
            std_errors |= {part.prefix + name: std for name, std in stated.items() if name in own}
        kept = {name: std for name, std in std_errors.items() if name not in self.given_values}
        others = {*self.ties.by_name, *self._free_as_given()}
        every = {**kept, **self.given_std_errors}
        return {name: std for name, std in every.items() if name not in others}

    def typical(self) -> tuple[str, ...]:
        """Return the parameters that keep a typical value, as the system names them."""
        sources, others = self.sources(), {*self.ties.by_name, *self.free()}
        return tuple(
            name for name in self.rows() if sources[name] == TYPICAL and name not in others
        )

    def units(self) -> dict[str, str]:
        """Return the unit of every parameter."""
        return {name: row.unit for name, row in self.rows().items()}

    def _section(self, part: Part, key: str) -> Any:
        """Return what a key of the section of a part has."""
        section: Any = self
        for step in part.section:
            section = section[step] if isinstance(step, int) else getattr(section, step)
        return getattr(section, key)

    def _fixed(self, part: Part) -> Mapping[str, float | str]:
        given: Mapping[str, float | str] = self._section(part, part.values)
        return {symbol: given[symbol] for symbol in given if symbol in part.symbols}

    def _free(self, part: Part) -> Mapping[str, FreeSection]:
        given: Mapping[str, FreeSection] = {}
        if part.free is not None:
            given = self._section(part, "free")
        return {symbol: given[symbol] for symbol in given if symbol in part.symbols}

    def _helpers(self, given: Mapping[str, Value]) -> dict[str, Value]:
        """Return the names among the exciter's parameters that are none of them."""
        own = next((part.symbols for part in self.parts.all if part.kind == "exciter"), ())
        return {name: value for name, value in given.items() if name not in own}


def numbers_of(given: Mapping[str, float | str]) -> dict[str, float]:
    """Return those values that are numbers of their own."""
    return {name: value for name, value in given.items() if not isinstance(value, str)}
