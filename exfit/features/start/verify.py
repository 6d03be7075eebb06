"""The command verify: from a recorder's file to a report, in one."""

import hashlib
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import (
    NOT_CONVERGED,
    Output,
    force_option,
    output_option,
    progress_option,
    quiet_option,
    write_text,
)
from exfit.cli.records import bases_option, steps_option
from exfit.cli.streams import echo
from exfit.errors import CaseError, ExfitError
from exfit.features.planner.commands import bus_option
from exfit.features.start import command
from exfit.features.start.command import (
    answers_option,
    dyr_option,
    id_option,
    kv_option,
    model_option,
    mva_option,
)
from exfit.util.interrupts import interrupted

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.output.events import Events

MARK = "# made by exfit verify, which replaces this file unless it is edited: "
DIGITS = 12  # of a SHA-256


@click.command(short_help="Make a report from a record: new, fit, report in one.")
@click.argument("record", type=GivenFile(Kind.RECORD), required=False)
@dyr_option
@bus_option
@id_option
@model_option
@steps_option
@bases_option
@kv_option
@mva_option
@answers_option
@output_option(help="Report, .html or .pdf (default: RECORD-report.html).")
@force_option
@quiet_option
@progress_option
def verify(
    record: Path | None,
    dyr: Path | None,
    bus: int | None,
    machine_id: str | None,
    model: str | None,
    sizes: tuple[str, ...],
    bases: tuple[str, ...],
    kv: float | None,
    mva: float | None,
    answers_file: Path | None,
    output: Path | None,
    force: bool,
    quiet: bool,
    progress: str,
    events: "Events | None",
) -> None:
    """Make the verification report of RECORD: inspect, new, fit, validate and report in one.

    On a terminal it asks what neither the record nor a planner's file says, as exfit new does.
    Elsewhere what is missing is named, with the keys of --answers, and nothing is run.

    The case is written beside the report, under the name of RECORD, and the fit to
    runs/RECORD-fit. A former case is replaced only if nobody has edited it, or with --force. Exit
    code 0, 1 and 3 as exfit fit.
    """
    from exfit.cli.fitting import fit_case
    from exfit.features.report.writing import refuse_report, write_report
    from exfit.features.start.answers import checked
    from exfit.features.start.making import new_case, typical_left
    from exfit.features.start.starting_tests import sizes_of

    options = {
        "record": record, "dyr": dyr, "bus": bus, "id": machine_id, "model": model,
        "step": sizes_of(sizes), "base": command.bases_by_signal(bases), "kv": kv,
        "mva": mva, "output": output,
    }  # fmt: skip
    given, read = command.merged(answers_file, options), dict[Path, Any]()
    if "output" in given:
        refuse_report(Path(given["output"]), force)
    asks = command.is_terminal() and not quiet and events is None
    if asks:
        command.complete(given, read, "verify", introduced=answers_file is None)
    else:
        command.refuse_missing(given, read, answers_file)
    source = Path(given.get("record") or given["tests"])
    place = Path(given.get("output") or f"{source.stem}-report.html")
    case = place.with_name(f"{source.stem}.yaml")
    if asks:
        command.keep(given, case.with_suffix(command.ENDING))
    refuse_report(place, force)
    if not force:
        _refuse_edited(case)
    made = new_case(checked(given), case.parent, read)
    show = Output(None, True, quiet, as_json=False, progress=progress, events=events)
    show.warn(made.doubts)
    text = _marked(made.draft.text)
    loaded = _checked(text, case)
    write_text(text, case, ())
    if show.shown:
        validating = sum(test.validates for test in made.tests)
        counts = f"{len(made.tests) - validating} fitted, {validating} for validation"
        left = typical_left(made)
        echo(f"record: {source.name}; tests: {counts}")
        echo(f"case: {case}" + (f"; typical, not of this unit: {left}" if left else ""))
    result, folder = fit_case(loaded, show)
    if interrupted():  # the fit is kept; exfit report writes the page of it
        raise SystemExit(NOT_CONVERGED)
    pages = write_report(folder, place, force)
    if show.shown:
        echo(f"report: {', '.join(map(str, pages))}")
    if not result.holds:
        raise SystemExit(NOT_CONVERGED)


def _marked(text: str) -> str:
    """Return the text of a case with a last line that shows whether it was edited."""
    return f"{text}{MARK}{hashlib.sha256(text.encode()).hexdigest()[:DIGITS]}\n"


def _checked(text: str, case: Path) -> "Case":
    """Return the case of a text that is still to be written; raises CaseError, which says so."""
    from exfit.case.load import parse_case

    try:
        return parse_case(text, case)
    except CaseError as fault:
        remedy = "correct the answers, or edit the case that `exfit new` makes of them"
        raise CaseError((*fault.faults, f"{case} is not written: {remedy}")) from None


def _refuse_edited(case: Path) -> None:
    """Raise ExfitError where a case would be lost that somebody has edited or made otherwise."""
    if not case.exists():
        return
    text, mark, _ = case.read_bytes().decode(errors="replace").rpartition(MARK)
    if not mark or _marked(text).encode() != case.read_bytes():
        raise ExfitError(
            f"{case}: exists already, and verify did not make it as it is; "
            f"`exfit fit {quote(str(case))}` fits it, --force writes over it"
        )
