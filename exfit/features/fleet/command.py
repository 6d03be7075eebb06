"""The command batch."""

import re
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from os.path import normpath
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.options import (
    ABOVE_ZERO,
    ANY_PATH,
    NOT_CONVERGED,
    Interruption,
    output_option,
    print_json,
    progress_option,
    quiet_option,
)
from exfit.errors import ExfitError, FileError
from exfit.util.vocabulary import EXPLAINED, SEARCHES, SEARCHES_EXPLAINED, STRATEGIES

if TYPE_CHECKING:
    from exfit.features.fleet.batch import BatchObserver, CaseMaking
    from exfit.features.fleet.folder import CaseSummary, Fleet
    from exfit.output.events import Events

WITHOUT_FIT = ("failed", "timed out", "crashed", "refused", "not run")


def _part(_: click.Context, __: click.Parameter, value: str) -> tuple[int, int]:
    """Return the number of a part and how many there are, of a text such as 3/40."""
    match = re.fullmatch(r"([0-9]+)/([0-9]+)", value)
    if match is None:
        raise click.BadParameter(f"{value!r}: not of the form 3/40")
    number, parts = int(match[1]), int(match[2])
    if not 1 <= number <= parts:
        raise click.BadParameter(f"{value}: must be 1/{parts} ... {parts}/{parts}")
    return number, parts


@click.command(short_help="Fit many cases, and make a table of all.")
@click.argument("cases", type=ANY_PATH, nargs=-1, required=True, metavar="CASES")
@output_option(
    default=Path("fleet"), metavar="DIR", help="Folder for the results (default: fleet)."
)
@click.option(
    "--workers",
    type=click.IntRange(min=0),
    metavar="N",
    help="Worker processes, one thread each (default: one for each processor); 0: in this process, "
    "without a time limit.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Fit on the Dask cluster of this scheduler, such as tcp://10.0.0.1:8786, instead.",
)
@click.option(
    "--part",
    callback=_part,
    default="1/1",
    metavar="3/40",
    help="Fit only this share of the cases; 1/40 to 40/40, on computers that share DIR, fit all.",
)
@click.option(
    "--retry",
    type=click.Choice(["failed"]),
    help="Fit again what failed, crashed or exceeded the time limit in an earlier run.",
)
@click.option(
    "--time-limit",
    type=ABOVE_ZERO,
    default=3600.0,
    metavar="S",
    help="Time that a case may take, s (default: 3600).",
)
@click.option("--reports", is_flag=True, help="Write the report of each fit, too.")
@click.option(
    "--strategy",
    type=click.Choice([*STRATEGIES]),
    help=f"Strategy, instead of that of the cases. {EXPLAINED}.",
)
@click.option(
    "--search",
    type=click.Choice([*SEARCHES]),
    help=f"Search, instead of that of the cases. {SEARCHES_EXPLAINED}.",
)
@quiet_option
@click.option("--json", "as_json", is_flag=True, help="Print the rows as JSON and nothing else.")
@progress_option
def batch(
    cases: tuple[Path, ...],
    output: Path,
    workers: int | None,
    scheduler: str | None,
    part: tuple[int, int],
    retry: str | None,
    time_limit: float,
    reports: bool,
    strategy: str | None,
    search: str | None,
    quiet: bool,
    as_json: bool,
    progress: str,
    events: "Events | None",
) -> None:
    """Fit all CASES: case files, folders with case files (*.yaml) in them or below, and tables.

    A table, CSV or a workbook, lists records with what is known of each; the rows of a unit become
    a case in DIR/cases, as `exfit new` makes it. A programme is one case: `exfit run` runs it.

    Each case is fitted as by `exfit fit`, in worker processes. Its files are in a folder of DIR,
    named after a hash of all inputs of the fit: the case, its records, its model file, the
    options, the version of exfit. What is there is not fitted again: after an interruption or a
    change, the same command continues. Ctrl-C stops at once and keeps what is finished.

    A case that cannot be read, fails, crashes or does not end is a row with its reason, and the
    others continue; --retry failed fits it again. So is one that names code not trusted yet.

    With --scheduler the workers of a Dask cluster fit the cases: they need exfit in the versions of
    this computer, but none of its files. The package distributed comes with exfit[cluster].

    fleet.csv and fleet.html in DIR are the table of all cases that have been given for DIR. Exit
    code 0: every case that has a record matches it; 1: some have no fit, or none has a record; 3:
    some do not match, or Ctrl-C ended the command with some done.
    """
    if scheduler is not None and workers is not None:
        raise click.UsageError("--workers and --scheduler exclude each other.")
    from exfit.features.fleet.batch import batch as fit_all
    from exfit.features.fleet.table import report_file, write_missing_reports, write_tables
    from exfit.features.start.tables import is_table

    tables = [path for path in cases if is_table(path) and not path.is_dir()]
    lively = progress == "auto" and not (quiet or as_json)
    with _observer(output, lively, events) as observer:
        fleet = fit_all(
            [path for path in cases if path not in tables],
            output,
            workers=workers,
            scheduler=scheduler,
            part=part,
            retry_failed=retry is not None,
            time_limit=time_limit,
            strategy=strategy,
            search=search,
            observer=observer,
            further=(report_file,) if reports else (),
            write_tables=write_tables,
            made=_cases_of(tables, output),
        )
    if reports and write_missing_reports(fleet):
        write_tables(fleet)
    if as_json:
        print_json(fleet.to_dict())
    elif not quiet:
        from exfit.features.fleet.terminal import batch as show_batch
        from exfit.output.terminal import console

        show_batch(console(), fleet)
    _exit(fleet, quiet)


def _observer(
    output: Path, lively: bool, events: "Events | None"
) -> "AbstractContextManager[BatchObserver | None]":
    """Show the cases of a batch as they end: as events, or in a live table."""
    from exfit.features.fleet.terminal import BatchEvents, BatchProgress
    from exfit.output.terminal import console

    if events is not None:
        events.folder = output
        return nullcontext(BatchEvents(events))
    return BatchProgress(console()).running() if lively else nullcontext()


def _cases_of(tables: Sequence[Path], folder: Path) -> "dict[Path, CaseMaking]":
    """Plan the cases of tables; raises ExfitError with the faults of all of them."""
    from exfit.features.planner.import_all import cases_of_table

    made: dict[Path, CaseMaking] = {}
    faults = []
    for table in tables:
        try:
            cases = cases_of_table(table, folder)
        except ExfitError as fault:
            faults.append(str(fault))
            continue
        faults += [f"{table}: {file.stem}: also in another table" for file in made.keys() & cases]
        made |= cases
    if faults:
        raise ExfitError("\n".join(faults))
    return made


def _without_fit(rows: "Sequence[CaseSummary]") -> "Sequence[CaseSummary]":
    """List the cases that have no fit and should; all where none has a record."""
    none_to_fit = {row.status for row in rows} == {"no record"}
    return rows if none_to_fit else [row for row in rows if row.status in WITHOUT_FIT]


def _said(reason: str, case: Path) -> str:
    place = normpath(case)
    return reason if reason.startswith(place) else f"{place}: {reason}"


def _exit(fleet: "Fleet", quiet: bool) -> None:
    rows = fleet.of_run
    done = [row for row in rows if row.status == "done"]
    if fleet.interrupted and not done:
        raise Interruption("no case is done")
    without = _without_fit(rows)
    if without and not fleet.interrupted:
        if quiet:
            raise FileError(_said(row.reason, fleet.folder / row.case) for row in without)
        raise ExfitError(f"cases without a fit: {len(without)} of {len(rows)}")
    if fleet.interrupted or not all(row.holds for row in done):
        raise SystemExit(NOT_CONVERGED)
