"""Case: one study as its YAML file describes it, checked, with the models it names.

pydantic lives only here and in case_schema.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, PrivateAttr, ValidationError

from exfit.case.checks.model import contradictions
from exfit.case.messages import form_faults, show
from exfit.case.parts import Part, Parts, parts_of, ties_of, with_network
from exfit.case.schema import (
    ABOUT,
    BumpTest,
    Channel,
    Estimate,
    Fact,
    FindableStep,
    Free,
    Frozen,
    InfiniteBus,
    Limit,
    MachinePlayback,
    NoPlant,
    OnLine,
    OpenCircuit,
    Parameters,
    Phases,
    Playback,
    RecordFile,
    Recording,
    Section,
    Simulation,
    Stabiliser,
    Step,
    Switch,
    Text,
    TimeColumn,
    Unknown,
    Value,
    known,
)
from exfit.case.ties import Ties
from exfit.case.yaml import Fault, Place, read_text, read_yaml
from exfit.errors import CaseError, RecordError
from exfit.records.record import ChannelLike, Clock, Record, ThreePhases, read_record

__all__ = [
    "BumpTest",
    "Case",
    "FindableStep",
    "InfiniteBus",
    "MachinePlayback",
    "NoPlant",
    "OpenCircuit",
    "Playback",
    "RecordFile",
    "Recording",
    "Step",
    "Switch",
    "Unknown",
    "dotted",
    "initial_level",
    "initial_voltage",
    "json_schema",
    "known",
    "load_case",
    "parse_case",
]

SINGLE = "fit"  # name of a record that stands alone
DIALECT = "https://json-schema.org/draft/2020-12/schema"


class Case(Section):
    """A study of exfit: a model, its plant, a test, its record, and what is to be found."""

    about: Frozen[Fact] = ABOUT
    model: Text | None = Field(
        default=None,
        description="Model of the catalogue, in upper or lower case, or path of a .py file; none "
        "with plant machine-playback.",
    )
    saturation: Literal["quadratic", "exponential", "exponential-se"] = Field(
        default="quadratic", description="Form of the exciter's saturation curve."
    )
    plant: Annotated[
        OpenCircuit | InfiniteBus | Playback | MachinePlayback | NoPlant,
        Field(discriminator="type"),
    ] = Field(description="What surrounds the exciter.")
    stabiliser: Stabiliser | None = Field(
        default=None, description="A power system stabiliser; on open circuit it does not act."
    )
    test: BumpTest | None = Field(
        default=None, description="What was done to the unit; each of the records has its own."
    )
    record: RecordFile | None = Field(
        default=None, description="What was measured; a simulation does without."
    )
    records: tuple[Recording, ...] = Field(
        default=(),
        min_length=1,
        description="In place of test and record: several tests with their records, fitted as one.",
    )
    parameters: Parameters = Field(
        default_factory=Parameters, description="What is known and what is to be found."
    )
    estimate: Estimate = Field(
        default_factory=Estimate, description="How the free parameters are found."
    )
    simulation: Simulation = Field(
        default_factory=Simulation, description="The grid of the simulation."
    )
    validations: tuple[Recording, ...] = Field(
        default=(), alias="validate", description="Records on which the result is tried."
    )
    accept: Limit | None = Field(
        default=None, description="What a validation must keep to; beyond it the exit code is 3."
    )

    _path: Path = PrivateAttr()
    _parts: Parts = PrivateAttr()
    _ties: Ties = PrivateAttr()

    @property
    def path(self) -> Path:
        """The case file."""
        return self._path

    @property
    def folder(self) -> Path:
        """The folder to which the paths in the file are relative."""
        return self._path.parent

    @property
    def parts(self) -> Parts:
        """The models that the file names."""
        return self._parts

    @property
    def subject(self) -> str:
        """The name of what is studied: the exciter, or the machine where it stands alone."""
        return self._parts.all[0].name

    @property
    def ties(self) -> Ties:
        """The parameters that follow others, as the system names them."""
        return self._ties

    @property
    def recordings(self) -> tuple[Recording, ...]:
        """The records that are fitted; a single one is named fit."""
        if self.records or self.record is None or self.test is None:
            return self.records
        return (Recording.model_construct(name=SINGLE, test=self.test, record=self.record),)

    @property
    def tests(self) -> tuple[BumpTest, ...]:
        """The tests of the fit, then those of the validations."""
        alone = () if self.test is None else (self.test,)
        return (*alone, *(one.test for one in (*self.records, *self.validations)))

    @property
    def on_load(self) -> bool:
        """Whether the breaker is closed in any of the tests."""
        plants = (self.plant, *(one.plant for one in (*self.records, *self.validations)))
        return any(isinstance(plant, InfiniteBus | OnLine) for plant in plants)

    def seen_from(self, recording: Recording) -> "Case":
        """Return the case as one record sees it: in the plant of that record."""
        if recording.plant is None or not isinstance(self.plant, OpenCircuit | InfiniteBus):
            return self
        own = {key: getattr(self.plant, key) for key in ("machine", "parameters", "free")}
        kind = InfiniteBus if isinstance(recording.plant, OnLine) else OpenCircuit
        plant = kind.model_construct(**own, **dict(recording.plant))
        view = self.model_copy(update={"plant": plant})
        network = recording.plant.network if isinstance(recording.plant, OnLine) else None
        view._parts = with_network(self._parts, network)
        return view

    def values(self) -> dict[str, float]:
        """Return every parameter of the parts, as the system names them: typical, fixed, start.

        What follows others comes out of them; helpers that only such arithmetic uses stand last.
        """
        values: dict[str, float] = {}
        for part in self._parts.all:
            starts = {symbol: free.start for symbol, free in self._free(part).items()}
            resolved = part.resolved(numbers_of(self._fixed(part)), starts)
            values |= {part.prefix + symbol: value for symbol, value in resolved.items()}
        helpers = {name: one.start for name, one in self._helpers(self.parameters.free).items()}
        helpers |= numbers_of(self._helpers(self.parameters.fixed))
        return self._ties.apply({**values, **helpers})

    def free(self) -> dict[str, Free]:
        """Return the free parameters, as the system names them."""
        own = {
            part.prefix + symbol: free
            for part in self._parts.all
            for symbol, free in self._free(part).items()
        }
        return {**own, **self._helpers(self.parameters.free)}

    def typical(self) -> tuple[str, ...]:
        """Return the parameters that the file does not give, as the system names them."""
        return tuple(
            part.prefix + row.symbol
            for part in self._parts.all
            for row in part.sheet
            if row.symbol not in {**self._fixed(part), **self._free(part)}
        )

    def units(self) -> dict[str, str]:
        """Return the unit of every parameter."""
        return {
            part.prefix + row.symbol: row.unit for part in self._parts.all for row in part.sheet
        }

    def _fixed(self, part: Part) -> Mapping[str, float | str]:
        found: Mapping[str, float | str] = _at(self, part.fixed)
        return {symbol: found[symbol] for symbol in found if symbol in part.symbols}

    def _free(self, part: Part) -> Mapping[str, Free]:
        found: Mapping[str, Free] = {} if part.free is None else _at(self, part.free)
        return {symbol: found[symbol] for symbol in found if symbol in part.symbols}

    def _helpers(self, given: Mapping[str, Value]) -> dict[str, Value]:
        """Return what stands among the exciter's parameters and is none of them."""
        own = next((part.symbols for part in self._parts.all if part.kind == "exciter"), ())
        return {name: value for name, value in given.items() if name not in own}

    def measure(self, test: BumpTest, record: RecordFile) -> Record:
        """Return the record of a test; raises RecordError where its steps lie outside it."""
        channels: dict[str, ChannelLike | ThreePhases] = {
            signal: source_of(channel) for signal, channel in record.channels.items()
        }
        path = self.folder / record.file
        missing = record.gaps == "skip"
        clock = clock_of(record)
        per_unit = frozenset(
            signal
            for signal, channel in record.channels.items()
            if self.plant.type != "none" and _as_it_stands(channel)
        )
        read = read_record(
            path,
            clock,
            channels,
            record.window,
            missing,
            record.sheet,
            record.resample,
            per_unit,
        )
        start, end = read.time[0], read.time[-1]
        if test.begin is not None:
            if test.begin > start:
                raise RecordError(
                    f"{path}: begins at {show(start)} s, before {self.path} begins to simulate it "
                    f"at {show(test.begin)} s"
                )
            start = test.begin
        for at in test.instants:
            if not start <= at < end:
                raise RecordError(
                    f"{path}: holds {show(start)} ... {show(end)} s, "
                    f"but {self.path} has a step at {show(at)} s"
                )
        steady = test.steady
        if steady is not None and steady > end:
            raise RecordError(
                f"{path}: ends at {show(end)} s, before test.steady_until = {show(steady)} s "
                f"of {self.path}"
            )
        if test.vt0 is None and steady is not None and not start < steady:
            what = "the first step" if test.steady_until is None else "test.steady_until"
            raise RecordError(
                f"{path}: begins at {show(start)} s, with {what}: nothing before it tells "
                f"vt0, and {self.path} does not give it"
            )
        return read


def numbers_of(given: Mapping[str, float | str]) -> dict[str, float]:
    """Return those values that are numbers of their own."""
    return {name: value for name, value in given.items() if not isinstance(value, str)}


def _at(section: Any, place: Place) -> Any:
    """Return what stands at a place of the case."""
    for key in place:
        section = getattr(section, str(key))
    return section


class Column(NamedTuple):
    """Where a signal stands in a file and how it becomes per unit."""

    column: str
    scale: float
    offset: float
    unit: str | None
    base: float | None


def clock_of(record: RecordFile) -> Clock:
    """Return where the time of a record stands."""
    if isinstance(record.time, str):
        return Clock((record.time,))
    if isinstance(record.time, TimeColumn):
        return Clock((record.time.column,), record.time.unit)
    return Clock(record.time)


def column_of(channel: Channel) -> Column:
    """Return the column of a channel; where a fit finds scale or offset, with their starts."""
    scale, offset = known(channel.scale), known(channel.offset)
    return Column(
        channel.column, 1.0 if scale is None else scale, offset or 0.0, channel.unit, channel.base
    )


def _as_it_stands(channel: Channel | Phases) -> bool:
    """Tell whether a case takes the numbers of a column for per unit."""
    if not isinstance(channel, Channel):
        return False
    return channel.unit is None and channel.base is None and channel.scale == 1.0


def source_of(channel: Channel | Phases) -> Column | ThreePhases:
    """Return where a signal stands: in a column, or in three."""
    if isinstance(channel, Channel):
        return column_of(channel)
    return ThreePhases(
        channel.phases,
        channel.kind,
        channel.unit,
        channel.base,
        channel.connection,
        channel.cycles,
    )


def initial_level(test: BumpTest, record: Record, signal: str) -> float:
    """Return the mean of a recorded signal while the unit is still at rest.

    Raises RecordError where it has no sample there.
    """
    until = np.inf if test.steady is None else test.steady
    rest = record.signals[signal][record.time < until]
    rest = rest[np.isfinite(rest)]
    if not len(rest):
        raise RecordError(
            f"{record.source}: {signal}: no sample before {show(until)} s tells where it starts"
        )
    return float(np.mean(rest))


def initial_voltage(test: BumpTest, record: Record) -> float:
    """Return the voltage before the first step: as the test gives it, else the record's mean."""
    vt0 = known(test.vt0)
    return initial_level(test, record, "vt") if vt0 is None else vt0


def load_case(path: Path) -> Case:
    """Return the case of a YAML file.

    Raises CaseError with all faults of the file, each as ``file:line: place: what is wrong``.
    """
    return parse_case(read_text(path), path)


def parse_case(text: str, path: Path) -> Case:
    """Return the case of a YAML text, as if it stood in the file ``path``; raises CaseError."""
    top, faults = read_yaml(text, path)
    parts = parts_of(top.value, path.parent, faults)
    ties = ties_of(top.value, parts, faults)
    case = _checked(top.value, faults)
    taken = {fault.place for fault in faults}
    found = contradictions(top.value, parts, ties)
    faults += [fault for fault in found if fault.place not in taken]
    if faults or case is None:
        lines = [(fault.line or top.line_of(fault.place), fault) for fault in faults]
        raise CaseError(
            f"{path}:{line}: {dotted(fault.place)}: {fault.text}"
            for line, fault in sorted(lines, key=lambda found: found[0])
        )
    case._path, case._parts, case._ties = path, parts, ties
    return case


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of the case file."""
    from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

    class NoNulls(GenerateJsonSchema):
        """A key that may be missing may not be null."""

        def nullable_schema(self, schema: Any) -> JsonSchemaValue:
            return self.generate_inner(schema["schema"])

        def default_schema(self, schema: Any) -> JsonSchemaValue:
            found = super().default_schema(schema)
            return _without(found, "default") if found.get("default", 0) is None else found

    schema = Case.model_json_schema(by_alias=True, schema_generator=NoNulls)
    return {"$schema": DIALECT, **schema, "title": "exfit case"}


def dotted(place: Place) -> str:
    """Return a place as ``test.vref[0].at``."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)[1:]


def _without(mapping: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in mapping.items() if name != key}


def _checked(data: dict[str, Any], faults: list[Fault]) -> Case | None:
    """Return the case if its data has the right form; add a fault for each that has not."""
    try:
        return Case.model_validate(data)
    except ValidationError as error:
        known = {fault.place for fault in faults}
        found = form_faults(error.errors(include_url=False), json_schema())
        faults += [fault for fault in found if fault.place not in known]
        return None
