"""A functional mock-up unit (FMU) that simulates a case: its program, its variables."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from exfit.case.case import Case
from exfit.case.parts import OF_RECORD
from exfit.case.schema import FmuPlant
from exfit.errors import CaseError
from exfit.features.external.fmu_file import (
    FmuDescription,
    FmuError,
    Interface,
    Use,
    fmu_description,
    laid_out,
    worker_command,
)
from exfit.features.external.program import ExternalProgram, running
from exfit.simulation.simulator import Simulator
from exfit.util.files import on_disk
from exfit.util.text import near

Test = tuple[Simulator, tuple[str, ...]]  # with the signals that are compared


class FmuProgram(ExternalProgram):
    """The program that runs an FMU, with the description that was read when it was laid out."""

    def __init__(
        self, section: FmuPlant, settings: str, folder: Path, description: FmuDescription
    ) -> None:
        limits = (section.parallel, section.time_limit)
        super().__init__(worker_command(settings), folder, *limits, "plant.file")
        self.description = description


@contextmanager
def fmu_program(case: Case, section: FmuPlant) -> Iterator[ExternalProgram]:
    """Provide the program that runs the FMU of a case; end it afterwards.

    Raises CaseError for a file that cannot be run.
    """
    file = on_disk(case.folder / section.file)
    try:
        description = fmu_description(file)
        interface = _interface(case, section, description)
        with laid_out(file) as folder:
            settings = {
                "folder": str(folder),
                "interface": interface,
                "inputs": dict(section.inputs),
                "outputs": dict(section.outputs),
            }
            program = FmuProgram(section, json.dumps(settings), folder, description)
            with running(program):
                yield program
    except FmuError as fault:
        text = f"{case.path}: plant.file: {section.simulator} {fault}"
        raise CaseError([text]) from None


def refuse_unknown_variables(case: Case, program: ExternalProgram, tests: Sequence[Test]) -> None:
    """Raise CaseError with all that an FMU cannot be given, or asked for, in the tests of a case.

    Nothing where no FMU simulates it.
    """
    section = case.external
    if isinstance(section, FmuPlant) and isinstance(program, FmuProgram):
        faults = [*_variable_faults(case, section, program.description, tests)]
        if faults:
            raise CaseError([f"{case.path}: {fault}" for fault in dict.fromkeys(faults)])


def own_value_notes(case: Case, program: ExternalProgram) -> Iterator[str]:
    """Name the parameters of a case that an FMU does not take, and has its own values of."""
    section = case.external
    if not isinstance(section, FmuPlant) or not isinstance(program, FmuProgram):
        return
    taken = program.description.usable_as("parameter")
    symbols = [part.prefix + symbol for part in case.parts.all for symbol in part.symbols]
    missing = [
        name for name in (*symbols, OF_RECORD[0]) if section.names.get(name, name) not in taken
    ]
    if missing:
        yield f"{section.simulator} has values of its own in place of {', '.join(missing)}"


def _variable_faults(
    case: Case, section: FmuPlant, description: FmuDescription, tests: Sequence[Test]
) -> Iterator[str]:
    """Yield the variables that the FMU does not have, or that cannot be used so."""
    variables = description.variables
    changed = {step.signal: "" for twin, _ in tests for step in twin.inputs.steps}
    compared = {signal: "" for _, signals in tests for signal in signals}
    # without a twin it is the case that says which parameters there are
    needed = dict.fromkeys(case.values() if case.has_no_equations else case.free(), "")
    uses: tuple[tuple[str, Mapping[str, str], Use, str], ...] = (
        ("names", {**needed, **section.names}, "parameter", "a parameter that can be set"),
        ("inputs", {**changed, **section.inputs}, "input", "an input"),
        ("outputs", {**compared, **section.outputs}, "output", "an output"),
    )
    for key, names, use, what in uses:
        possible = description.usable_as(use)
        for name, given in names.items():
            variable = given or name
            if variable in possible:
                continue
            text = f"{section.simulator} has no variable {variable}; {near(variable, possible)}"
            if variable in variables:
                text = f"{variable} is not {what} but {variables[variable].kind}"
            yield f"plant.{key}.{name}: {text}"


def _interface(case: Case, section: FmuPlant, description: FmuDescription) -> Interface:
    """Choose the interface by which an FMU is run; raises CaseError where it has not that one."""
    interface = section.interface or description.interfaces[0]
    if interface not in description.interfaces:
        text = f"{section.simulator} has {' and '.join(description.interfaces)} only"
        raise CaseError([f"{case.path}: plant.interface: {interface}: {text}"])
    return interface
