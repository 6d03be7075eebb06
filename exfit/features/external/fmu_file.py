"""A functional mock-up unit (FMU) as a file: what it says of itself; none of its code is run."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple
from zipfile import ZipFile

Interface = Literal["co-simulation", "model-exchange"]
Use = Literal["parameter", "input", "output"]  # set before the start, set at any time, read

PACKAGE_MISSING = 'needs the package FMPy: pip install "exfit[fmu]"'
VERSIONS = ("2.", "3.")  # of FMI
NUMBERS = ("Real", "Float64", "Float32", "Integer", "Int8", "Int16", "Int32", "Int64", "UInt8",
           "UInt16", "UInt32", "UInt64", "Boolean", "Enumeration")  # fmt: skip


class FmuError(Exception):
    """A file that is no FMU, or none that can be run here."""


class FmuVariable(NamedTuple):
    """A variable of an FMU: in its own words what it is, and what can be done with it."""

    kind: str
    uses: tuple[Use, ...]


class FmuDescription(NamedTuple):
    """What an FMU says of itself: its interfaces, its variables by name."""

    interfaces: tuple[Interface, ...]
    variables: Mapping[str, FmuVariable]

    def usable_as(self, use: Use) -> list[str]:
        """Return the names of the variables that can be used so."""
        return [name for name, variable in self.variables.items() if use in variable.uses]


def fmu_description(path: Path) -> FmuDescription:
    """Return the description in an FMU, or in the folder with its content.

    Raises FmuError for a file that is none, one of another version of FMI, one without machine
    code for this system, and where FMPy is missing.
    """
    description, platforms = _read(path)
    version = str(description.fmiVersion)
    if not version.startswith(VERSIONS):
        raise FmuError(f"is of FMI {version}; must be of FMI 2 or 3")
    interfaces: dict[Interface, Any] = {
        "co-simulation": description.coSimulation,
        "model-exchange": description.modelExchange,
    }
    present = tuple(name for name, interface in interfaces.items() if interface is not None)
    if not present:
        raise FmuError("is neither for co-simulation nor for model exchange")
    here = _platform()
    if here not in platforms:
        raise FmuError(f"has no machine code for {here}; has {', '.join(platforms) or 'none'}")
    return FmuDescription(present, variables_of(description))


def variables_of(description: Any) -> dict[str, FmuVariable]:
    """Return the variables of a description that FMPy has read."""
    return {str(each.name): _variable(each) for each in description.modelVariables}


def _variable(variable: Any) -> FmuVariable:
    kind = f"{variable.variability} {variable.causality}, {variable.type}"
    if variable.type not in NUMBERS or variable.shape:
        return FmuVariable(kind, ())
    is_output = variable.causality in ("local", "output")
    starts = variable.causality == "parameter" or (is_output and variable.initial == "exact")
    uses: list[Use] = ["output"] if is_output else []
    if starts and variable.variability != "constant":
        uses.append("parameter")
    if variable.causality == "input" or variable.variability == "tunable":
        uses.append("input")
    return FmuVariable(kind, tuple(uses))


def _read(path: Path) -> tuple[Any, list[str]]:
    """Return FMPy's description of an FMU, and the systems that it has machine code for."""
    try:
        import fmpy
    except ImportError:
        raise FmuError(PACKAGE_MISSING) from None
    try:
        description = fmpy.read_model_description(str(path), validate=False)
        return description, fmpy.supported_platforms(str(path))
    except OSError as fault:
        raise FmuError(f"cannot be read: {fault.strerror or fault}") from None
    except Exception as fault:  # damaged files make the package fail in many ways
        what = str(fault).partition("\n")[0] or type(fault).__name__
        raise FmuError(f"is not an FMU, or damaged: {what}") from None


def _platform() -> str:
    import fmpy

    return str(fmpy.platform)


@contextmanager
def laid_out(path: Path) -> Iterator[Path]:
    """Provide a folder with the content of an FMU; it is removed afterwards.

    Raises FmuError for a file that is none.
    """
    with TemporaryDirectory(prefix="exfit-fmu-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        try:
            with ZipFile(path) as archive:
                archive.extractall(folder)
        except OSError as fault:
            raise FmuError(f"cannot be read: {fault.strerror or fault}") from None
        except Exception as fault:  # damaged files: of zip, of what is packed in it
            raise FmuError(f"is not an FMU, or damaged: {fault}") from None
        yield folder


def worker_command(settings: str) -> list[str]:
    """Return the command of the program that simulates an FMU, with its settings as JSON.

    It finds exfit and FMPy where this process has found them, and nothing in its own folder.
    """
    places = [str(Path(place).absolute()) for place in sys.path]
    return [sys.executable, "-P", "-c", _PROGRAM.format(places=places), settings]


_PROGRAM = (
    "import sys; sys.path[:] = {places!r}; from exfit.features.external.fmu import main; main()"
)
