"""The data of a new case: models with their values, typical or taken from elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from exfit.case.case_draft import Section
from exfit.case.load import load_case
from exfit.case.suggestion import relative
from exfit.errors import CaseError, ExfitError
from exfit.models import find
from exfit.models.machines import Machine, find_machine
from exfit.models.sheet import Model, typical
from exfit.plants import MACHINE
from exfit.util.sources import TYPICAL


@dataclass(frozen=True)
class PartData:
    """A model with a value for each parameter, and the sources of these in the words of a case.

    A value without a source is not stated; ``origin`` says in a comment where the data are from;
    ``inputs`` are the signals of a stabiliser, () for those of its model; ``times_speed`` says that
    the speed multiplies the efd of an exciter.
    """

    model: Model | Machine
    values: Mapping[str, float]
    sources: Mapping[str, str]
    origin: str = ""
    inputs: tuple[str, ...] = ()
    times_speed: bool = False

    @classmethod
    def typical(cls, model: Model | Machine) -> "PartData":
        """Return a model with its typical data."""
        return cls(model, typical(model.sheet), {row.symbol: TYPICAL for row in model.sheet})


@dataclass(frozen=True)
class UnitData:
    """The exciter, behind the ``name`` that the case gives it, its machine, and what is ``added``.

    That are the stabiliser and the governor, each under the key of its section; ``as_found``
    is the section of what was in the planner's base.
    """

    name: str
    exciter: PartData
    machine: PartData
    added: Mapping[str, PartData] = field(default_factory=dict)
    as_found: Section = field(default_factory=dict)


def unit_with(
    model: str | None, machine: str | None, planner: UnitData | None, folder: Path
) -> UnitData:
    """Return a unit with typical data, or a planner's, with another exciter where one is given.

    A ``model`` that is a file is named as a case in a folder does. Raises ExfitError for a model or
    a machine that is not in the catalogue, and where neither a model nor a planner's unit is given.
    """
    if planner is not None:
        if model is None:
            return planner
        name, exciter = _exciter(model, folder)
        same = exciter.model is planner.exciter.model
        return planner if same else replace(planner, name=name, exciter=exciter)
    if model is None:
        raise ExfitError("model: missing; the exciter is not known")
    return UnitData(*_exciter(model, folder), PartData.typical(find_machine(machine or "GENROU")))


def _exciter(model: str, folder: Path) -> tuple[str, PartData]:
    """Return an exciter with its typical data, behind the name that a case in a folder gives it."""
    exciter = find(model, Path())
    name = relative(Path(model), folder) if model.endswith(".py") else exciter.name
    return name, PartData.typical(exciter)


def machine_of_case(path: Path) -> PartData:
    """Return the machine of another case with its values, those that are fitted at their start.

    Raises CaseError with all faults of that case, and where it has no machine.
    """
    case = load_case(path)
    machine = case.parts.machine
    if machine is None:
        raise CaseError([f"{path}: plant {case.plant.type} has no machine"])
    values, sources = case.values(), case.sources()
    names = {row.symbol: MACHINE + row.symbol for row in machine.sheet}
    return PartData(
        machine,
        {symbol: values[name] for symbol, name in names.items()},
        {symbol: sources[name] for symbol, name in names.items()},
        f"those of {path.name}",
    )
