"""The files of what simulates a case in place of exfit: they are code, as a model of a user is."""

import hashlib
from pathlib import Path

from exfit.case.case import Case
from exfit.case.peek import scripts_of
from exfit.case.schema import FmuPlant
from exfit.errors import CaseError

HASH_DIGITS = 12  # of a SHA-256, in a message


def program_files(case: Case) -> list[Path]:
    """Return the files of what simulates a case in place of exfit: scripts, or an FMU."""
    if case.external is None:
        return []
    if isinstance(case.external, FmuPlant):
        return [case.folder / case.external.file]
    return [case.folder / word for word in scripts_of(case.external.command, case.folder)]


def refuse_changed_program(case: Case, sha256: str) -> None:
    """Raise CaseError where the first of these files has another hash than a fit's, if it had one.

    Values of a fit are taken only together with the code that was fitted.
    """
    for file in program_files(case)[:1] if sha256 else ():
        with file.open("rb") as opened:
            own = hashlib.file_digest(opened, "sha256").hexdigest()
        if own != sha256:
            raise CaseError(
                [
                    f"{file}: not run: the file has changed since the fit: its SHA-256 begins with "
                    f"{own[:HASH_DIGITS]}, that of the fitted program was {sha256[:HASH_DIGITS]}; "
                    "fit again"
                ]
            )
