"""The code that a case names: a file of Python, the command or the FMU that simulates it."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from exfit.case.peek import command_of, fmu_of, scripts_of
from exfit.util.files import read_regular
from exfit.util.trust import Code


def code_in(content: Mapping[str, Any], folder: Path) -> Iterator[Code]:
    """Yield the code that the content of a case names, as far as it is there."""
    model, command, fmus = content.get("model"), command_of(content), fmu_of(content)
    if isinstance(model, str) and model.endswith(".py"):
        with suppress(OSError):
            yield Code.of_file(folder / model, read_regular(folder / model))
    for named in [command] if command else fmus:
        with suppress(OSError):
            yield program_code(named, folder)


def program_code(named: Sequence[str] | str, folder: Path) -> Code:
    """Return the code of a command, or of the file of an FMU, that simulates a case in a folder.

    Raises OSError where a file of it cannot be read.
    """
    if isinstance(named, str):
        return Code.of_file(folder / named, read_regular(folder / named))
    scripts = [read_regular(folder / word) for word in scripts_of(named, folder)]
    return Code.of_command(named, folder, scripts)
