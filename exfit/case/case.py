"""Case: one study as its YAML file describes it, checked, with the models it names.

pydantic lives only here and in case_schema.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr

from exfit.case.parts import Part, Parts, with_network
from exfit.case.schema import (
    ABOUT,
    BumpTest,
    Estimate,
    Fact,
    FreeSection,
    Frozen,
    InfiniteBus,
    Limit,
    MachinePlayback,
    NoPlant,
    OnLine,
    OpenCircuit,
    Parameters,
    Playback,
    RecordFile,
    Recording,
    Section,
    SimulationSection,
    Stabiliser,
    Text,
    Value,
)
from exfit.case.ties import Ties
from exfit.case.yaml import Place

SINGLE = "fit"  # name of a record that stands alone


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
    simulation: SimulationSection = Field(
        default_factory=SimulationSection, description="The grid of the simulation."
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

    def free(self) -> dict[str, FreeSection]:
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

    def _free(self, part: Part) -> Mapping[str, FreeSection]:
        found: Mapping[str, FreeSection] = {} if part.free is None else _at(self, part.free)
        return {symbol: found[symbol] for symbol in found if symbol in part.symbols}

    def _helpers(self, given: Mapping[str, Value]) -> dict[str, Value]:
        """Return what stands among the exciter's parameters and is none of them."""
        own = next((part.symbols for part in self._parts.all if part.kind == "exciter"), ())
        return {name: value for name, value in given.items() if name not in own}


def numbers_of(given: Mapping[str, float | str]) -> dict[str, float]:
    """Return those values that are numbers of their own."""
    return {name: value for name, value in given.items() if not isinstance(value, str)}


def _at(section: Any, place: Place) -> Any:
    """Return what stands at a place of the case."""
    for key in place:
        section = getattr(section, str(key))
    return section
