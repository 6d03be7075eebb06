"""The command inspect, and the options of commands that inspect a record."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import Output, output_options, print_json

if TYPE_CHECKING:
    from exfit.records.inspection import Inspection

time_option = click.option(
    "--time",
    "clock",
    multiple=True,
    metavar="COLUMN",
    help="Column of the time; given twice, of date and time. Default: as the file shows.",
)
unit_option = click.option(
    "--time-unit",
    "unit",
    type=click.Choice(("s", "ms", "us", "min")),
    help="Unit of the time's numbers. Default: as the file says, else s.",
)
steps_option = click.option(
    "--step",
    "sizes",
    multiple=True,
    metavar="[TEST=]PU",
    help="Size of the steps: 0.05; of one test: up=0.05, at-312s=0.02.",
)
bases_option = click.option(
    "--base", "bases", multiple=True, metavar="SIGNAL=VALUE", help="Value of 1 pu: vt=15.75kV."
)
sheet_option = click.option("--sheet", metavar="NAME", help="Sheet of an Excel file.")


@click.command("inspect", short_help="Show the content of a recorder's file.")
@click.argument("file", type=GivenFile(Kind.RECORD))
@time_option
@unit_option
@sheet_option
@output_options
def inspect_(
    file: Path,
    clock: tuple[str, ...],
    unit: str | None,
    sheet: str | None,
    output: Output,
) -> None:
    """Show the content of FILE, a record: channels, sampling, gaps, noise, spikes, steps.

    Suggests the record, test and estimate sections of a case; guesses are marked. Writes
    inspect.json and inspect.png to runs/FILE-inspect, or to DIR.
    """
    from exfit.case.starting.suggestion import bump_section, record_section, weights_section
    from exfit.output import run_folder

    # files of one record in several formats have one stem
    folder = output.folder(f"{file.name}-inspect")
    inspection = inspected(file, clock, unit, sheet)
    figures = run_folder.write_inspection(inspection, folder)
    if output.as_json:
        print_json(inspection.as_json())
    elif output.shown:
        from exfit.output import terminal

        console = terminal.console()
        terminal.inspection(
            console,
            inspection,
            [
                *record_section(inspection, file.as_posix()),
                *bump_section(inspection),
                *weights_section(inspection),
            ],
        )
        terminal.written(console, folder)
    output.draw(figures)


def inspected(
    file: Path, clock: tuple[str, ...], unit: str | None, sheet: str | None
) -> "Inspection":
    """Return what a recorder's file holds; raises RecordError where it is none."""
    from exfit.records.formats import open_table
    from exfit.records.inspection import inspect

    return inspect(open_table(file, sheet), clock or None, unit)
