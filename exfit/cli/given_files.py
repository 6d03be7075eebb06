"""Files given to a command: one of another kind, or with a name that is not quite right.

Each is refused with what it is and with the command, or the file, that was meant.
"""

import os
import re
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import Any

import click

from exfit.errors import CaseError, ExfitError
from exfit.util.files import refuse_bytes

RECORDS = (
    ".csv", ".tsv", ".txt", ".asc", ".dat", ".cfg", ".cff", ".mat", ".parquet", ".xlsx", ".xlsm",
    ".xls", ".ods", ".plb",
)  # fmt: skip
CASES = (".yaml", ".yml")
DYNAMICS_FILES = (".dyr", ".dyd")  # of PSS/E, of PSLF
# at the begin of a line, where it is one of the keys at the top
KEY_OF_CASE = re.compile("^(plant|tests?|record)[ \\t]*:", re.MULTILINE)
RESULT, PARAMETERS = "result.json", "parameters.yaml"


class Kind(StrEnum):
    """What a file is, in words."""

    CASE = "a case"
    RECORD = "a recorder's file"
    RESULT = "the result of a fit"
    PARAMETERS = "the parameters of a fit"
    DYNAMICS = "a planner's dynamics file"


# what takes a file of a kind
COMMANDS = {
    Kind.CASE: "use exfit fit {path} or exfit simulate {path}",
    Kind.RECORD: "use exfit inspect {path}, or exfit new --model NAME --record {path}",
    Kind.RESULT: (
        "use exfit report {path}, exfit export {path}, or exfit validate CASE --parameters {path}"
    ),
    Kind.PARAMETERS: "give it with a case: exfit simulate CASE --parameters {path}",
    Kind.DYNAMICS: "make a case of it: exfit import {path}",
}


class GivenFile(click.Path):
    """The path of a file of some kinds, the usual first; what is certainly no such is refused."""

    def __init__(self, *kinds: Kind) -> None:
        super().__init__(path_type=Path)
        self.kinds = kinds

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path; raises ExfitError with the command or the file that was meant."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        refuse_bytes(path)
        if not path.exists():
            meant = _meant(path)
            if meant is not None:
                raise ExfitError(f"{path}: cannot be read: No such file; did you mean {meant}?")
            return path
        kind = _kind_of(path)
        if kind is None or kind in self.kinds:
            return path
        advice = COMMANDS[kind].format(path=path)
        if kind is Kind.CASE and ctx is not None and Kind.RESULT in self.kinds:
            command, folder = f"exfit {ctx.info_name}", Path("runs") / f"{path.stem}-fit"
            advice = f"fit it first: exfit fit {path}, then {command} {folder}"
            if (folder / RESULT).is_file():
                advice = f"for the result of its fit use {command} {folder}"
            if ctx.info_name == "report":
                advice += f"; or, without a fit, exfit validate {path}"
        raise ExfitError(f"{path}: {kind}, not {self.kinds[0]}; {advice}")


class ParameterFile(GivenFile):
    """The path of a file of parameters: of the folder or the result of a fit the one in it."""

    def __init__(self) -> None:
        super().__init__(Kind.PARAMETERS, Kind.RESULT)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path of the parameters; raises ExfitError where a folder holds none."""
        path = super().convert(value, param, ctx)
        folder = path.parent if path.name == RESULT else path
        if not folder.is_dir():
            return path
        if not (folder / PARAMETERS).is_file():
            raise ExfitError(f"{path}: contains no {PARAMETERS} of a fit")
        return folder / PARAMETERS


def _meant(path: Path) -> Path | None:
    """Return the file beside one that does not exist whose name is nearly its name, or None."""
    from difflib import get_close_matches

    try:
        names = [other.name for other in path.parent.iterdir()]
    except OSError:
        return None
    stems = [name for name in names if Path(name).stem.casefold() == path.stem.casefold()]
    near = stems or get_close_matches(path.name, names, n=1, cutoff=0.8)
    return path.with_name(near[0]) if near else None


def _kind_of(path: Path) -> Kind | None:
    """Recognise a file; None where that is not certain."""
    suffix = path.suffix.lower()
    if path.is_dir():
        return Kind.RESULT if (path / RESULT).is_file() else None
    if suffix in RECORDS:
        return Kind.RECORD
    if suffix in DYNAMICS_FILES:
        return Kind.DYNAMICS
    if path.name == RESULT:
        return Kind.RESULT
    if suffix not in CASES:
        return None
    from exfit.case.yaml import read_text

    with suppress(CaseError):
        if KEY_OF_CASE.search(read_text(path)):
            return Kind.CASE
    from exfit.case.peek import keys_of

    keys = keys_of(path)
    if {"plant", "test", "tests", "record"} & keys:
        return Kind.CASE
    return Kind.PARAMETERS if "parameters" in keys else None
