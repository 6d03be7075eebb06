"""The option --apply of fit: the case that a cause of the last fit asks for."""

from pathlib import Path

from exfit.cli.options import Output
from exfit.cli.streams import echo
from exfit.util.files import within
from exfit.workflows.applied_causes import write_applied


def applied(case: Path, cause: str, output: Output) -> tuple[Path, Output]:
    """Write a case with the remedy of a cause of its last fit; say so, with the folder of its fit.

    Raises ExfitError where there is no such fit or cause, or the file would replace another.
    """
    folder = output.given or Path("runs") / f"{case.stem}-fit"
    written = write_applied(case, cause, folder)
    if output.shown:
        echo(f"written: {written.path}: {written.sentence}\n")
    if output.given is not None:
        own = within(folder.parent, f"{folder.name}-{written.word}")
        output = output._replace(given=own)
    return written.path, output
