"""The command inspect, and the options of commands that inspect a record."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import ABOVE_ZERO, Output, output_options

if TYPE_CHECKING:
    from exfit.output.blocks import Block

time_option = click.option(
    "--time",
    "clock",
    multiple=True,
    metavar="COLUMN",
    help="Time column; twice for date and time. Default: detected.",
)
unit_option = click.option(
    "--time-unit",
    "unit",
    type=click.Choice(("s", "ms", "us", "min")),
    help="Unit of a numeric time. Default: as in the file, else s.",
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
memory_option = click.option(
    "--memory",
    type=ABOVE_ZERO,
    metavar="GB",
    help="Limit of memory for reading. Default: 1, or four times the size of the file, 4 at most.",
)


@click.command("inspect", short_help="Show the content of a recorder's file.")
@click.argument("file", type=GivenFile(Kind.RECORD))
@time_option
@unit_option
@sheet_option
@memory_option
@output_options
def inspect_(
    file: Path,
    clock: tuple[str, ...],
    unit: str | None,
    sheet: str | None,
    memory: float | None,
    output: Output,
) -> None:
    """Show the content of FILE, a record: channels, sampling, gaps, noise, spikes, steps.

    Suggests the sections record, test and estimate of a case; guesses are marked. Writes
    inspect.json and inspect.png to runs/FILE-inspect, or to DIR.
    """
    from exfit.case.case_draft import CaseDraft
    from exfit.case.suggestion import RecordSettings, suggested_sections
    from exfit.output import inspections, run_folder

    # files of one record in several formats have one stem
    folder = output.folder(f"{file.name}-inspect", run_folder.OF_INSPECTION)
    inspection = RecordSettings(clock, unit, sheet, memory=memory).inspect(file)
    figures = run_folder.write_inspection(inspection, folder)

    def blocks() -> "Iterator[Block]":
        suggested = CaseDraft(suggested_sections(inspection, file.as_posix()))
        yield from inspections.inspection(inspection, suggested.lines())

    output.show(inspection.as_json() if output.as_json else {}, blocks(), folder, figures)
