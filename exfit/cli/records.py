"""The commands inspect and new."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli import completion
from exfit.cli.options import (
    Output,
    file_option,
    force_option,
    output_options,
    print_json,
    refuse_existing,
    write_text,
)

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
sheet_option = click.option("--sheet", metavar="NAME", help="Sheet of an Excel file.")


@click.command("inspect", short_help="Show the content of a recorder's file.")
@click.argument("file", type=click.Path(path_type=Path))
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
    from exfit.case.suggestion import bump_section, record_section, weights_section
    from exfit.output import run_folder

    # files of one record in several formats have one stem
    folder = output.folder(f"{file.name}-inspect")
    inspection = _inspected(file, clock, unit, sheet)
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


@click.command(short_help="Make a case from a model and a record.")
@click.option(
    "--model",
    required=True,
    metavar="NAME",
    help="Exciter, or the file of a model.",
    shell_complete=completion.exciters,
)
@click.option(
    "--machine",
    default="GENROU",
    metavar="NAME",
    help="Machine model (default: GENROU).",
    shell_complete=completion.machines,
)
@click.option(
    "--record",
    "file",
    required=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Record of the bump test.",
)
@time_option
@unit_option
@sheet_option
@file_option
@force_option
def new(
    model: str,
    machine: str,
    file: Path,
    clock: tuple[str, ...],
    unit: str | None,
    sheet: str | None,
    output: Path | None,
    force: bool,
) -> None:
    """Make a commented case from a model and a record: detected steps, typical values as starts.

    The parameters that a bump test is fitted for are free; `exfit models NAME` lists them. What the
    record does not show is left to be filled in, and the case is refused until it is.
    """
    from exfit.case.starting_case import starting_case
    from exfit.case.suggestion import relative
    from exfit.models import find
    from exfit.models.machines import find_machine

    if output is not None:
        refuse_existing(output, force)
    folder = Path() if output is None else output.parent
    exciter, around = find(model, Path()), find_machine(machine)
    name = relative(Path(model), folder) if model.endswith(".py") else exciter.name
    text = starting_case(exciter, name, around, _inspected(file, clock, unit, sheet), folder)
    write_text(text, output, ())
    if output is not None:
        click.echo(f"written to {output}; next: exfit check {output}")


def _inspected(
    file: Path, clock: tuple[str, ...], unit: str | None, sheet: str | None
) -> "Inspection":
    from exfit.records.formats import open_table
    from exfit.records.inspection import inspect

    return inspect(open_table(file, sheet), clock or None, unit)
