"""The commands import and export."""

from pathlib import Path

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import file_option, force_option, refuse_existing, write_text
from exfit.cli.records import bases_option, sheet_option, steps_option, time_option, unit_option
from exfit.cli.streams import echo
from exfit.errors import ExfitError, FileError
from exfit.features.planner.files_of_many import OfRecords, export_every_unit, import_every_unit
from exfit.features.planner.play_in import export_play_in

MOST_BUSES = 999_999
BUSES = click.IntRange(1, MOST_BUSES)


@click.command("import", short_help="Make cases from a planner's dynamics file.")
@click.argument("dyr", type=GivenFile(Kind.DYNAMICS), metavar="UNIT")
@click.option("--bus", type=BUSES, metavar="N", help="Bus of the unit.")
@click.option("--id", "machine_id", metavar="ID", help="Machine id of the unit, such as 1.")
@click.option("--all", "every", is_flag=True, help="Make a case of every unit, in the folder -o.")
@click.option(
    "--records",
    type=click.Path(path_type=Path, exists=True),
    metavar="DIR|TABLE",
    help="With --all: records named by bus and id, or a table of them.",
)
@steps_option
@bases_option
@time_option
@unit_option
@sheet_option
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File to write, with --all a folder; without it, to the terminal.",
)
@force_option
def import_(
    dyr: Path,
    bus: int | None,
    machine_id: str | None,
    every: bool,
    records: Path | None,
    sizes: tuple[str, ...],
    bases: tuple[str, ...],
    clock: tuple[str, ...],
    unit: str | None,
    sheet: str | None,
    output: Path | None,
    force: bool,
) -> None:
    """Make a case from machine, exciter, stabiliser and governor in UNIT.

    UNIT is a dynamics file of PSS/E (.dyr) or of PSLF (.dyd).

    The case is a step of 5 % on open circuit that `exfit simulate` runs as it stands. Where UNIT
    holds several units, --bus and --id choose one, and --all makes a case of each. With --records
    a case has the tests of its records, as `exfit new` makes it.
    """
    given = OfRecords(records, sizes, bases, clock, unit, sheet)
    if every:
        if bus is not None or machine_id is not None:
            raise click.UsageError("--bus and --id: not allowed with --all.")
        import_every_unit(dyr, given, output, force)
        return
    given.refuse_without_all()
    _import_one(dyr, bus, machine_id, output, force)


def _import_one(
    dyr: Path, bus: int | None, machine_id: str | None, output: Path | None, force: bool
) -> None:
    """Write the case of one unit."""
    from exfit.case.suggestion import relative
    from exfit.features.planner.fields import located
    from exfit.features.planner.import_case import import_unit, imported_case

    if output is not None:
        refuse_existing(output, force)
    imported = import_unit(dyr, bus, machine_id)
    file = relative(dyr, Path() if output is None else output.parent)
    write_text(imported_case(imported, file).text, output, located(imported.warnings, str(dyr)))
    if output is not None:
        echo(f"written to {output}; next: exfit simulate {output}")


@click.command(short_help="Write the result of a fit as records of a planner's file.")
@click.argument("result", type=GivenFile(Kind.RESULT))
@click.option(
    "--all", "every", is_flag=True, help="RESULT is the folder of a batch: all verified units."
)
@click.option(
    "--dyr",
    "--planner",
    type=GivenFile(Kind.DYNAMICS),
    metavar="FILE",
    help="With --all: the planner's file to change (default: that of the cases).",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["dyr", "dyd"]),
    help="Kind of file: dyr of PSS/E, dyd of PSLF (default: as FILE is named, else dyr).",
)
@click.option("--bus", type=BUSES, metavar="N", help="Bus of the unit (default: as found, else 1).")
@click.option(
    "--id",
    "machine_id",
    metavar="ID",
    callback=lambda _, __, value: _machine_id(value),
    help="Machine id of the unit (default: as found, else 1).",
)
@click.option(
    "--model", metavar="NAME", help="Another record of the exciter's model, such as ESAC8B."
)
@click.option(
    "--plb",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Of a fit of grid events: write what drove it as a play-in file of PSS/E instead.",
)
@file_option
@force_option
def export(
    result: Path,
    every: bool,
    dyr: Path | None,
    form: str | None,
    bus: int | None,
    machine_id: str | None,
    model: str | None,
    plb: Path | None,
    output: Path | None,
    force: bool,
) -> None:
    """Write machine, exciter, stabiliser and governor of RESULT as records of PSS/E or PSLF.

    RESULT is the result.json of a fit, or the folder that holds it. What a record cannot hold, and
    what is uncertain, is reported.

    With --all RESULT is the folder of a batch, and the planner's file is written with the values of
    the units whose fits hold; every other byte of it stays as it is.
    """
    if plb is not None:
        _refuse_beside_plb(every, dyr, form, bus, machine_id, model, output)
        export_play_in(result, plb, force)
        return
    if every:
        if bus is not None or machine_id is not None or model is not None:
            raise click.UsageError("--bus, --id and --model: not allowed with --all.")
        if form is not None:
            raise click.UsageError("--format: not allowed with --all, which keeps the file's own.")
        export_every_unit(result, dyr, output, force)
        return
    if dyr is not None:
        raise click.UsageError("--dyr: only with --all.")
    _export_one(result, form, bus, machine_id, model, output, force)


def _refuse_beside_plb(every: bool, *others: object) -> None:
    """Raise UsageError where options of records are given beside a play-in file."""
    if every or any(other is not None for other in others):
        raise click.UsageError("--plb: only --force is allowed with it.")


def _export_one(
    result: Path,
    form: str | None,
    bus: int | None,
    machine_id: str | None,
    model: str | None,
    output: Path | None,
    force: bool,
) -> None:
    """Write the records of one fit, at the bus that is given, or where they were found."""
    from exfit.features.planner.export import export as exported
    from exfit.features.planner.export import place_of
    from exfit.features.planner.formats import FORMATS, format_of
    from exfit.results.io import load_result, result_file

    if output is not None:
        refuse_existing(output, force)
    source = result_file(result)
    fit = load_result(source)
    try:
        if bus is None or machine_id is None:
            own_bus, own_id = place_of(fit)
            bus, machine_id = bus or own_bus, machine_id or own_id
        files = format_of(output or "") if form is None else FORMATS[form]
        records = exported(fit, bus, machine_id, model, files=files)
    except ExfitError as fault:
        texts = (f"{source}: {text}" for text in str(fault).splitlines())
        raise FileError(texts) from None
    write_text(records.text, output, [f"{source}: {text}" for text in records.warnings])
    if output is not None:
        echo(f"written to {output}")


def _machine_id(value: str | None) -> str | None:
    from exfit.features.planner.file_format import is_machine_id

    if value is not None and not is_machine_id(value):
        raise click.BadParameter(f"{value!r} is not one or two letters or digits.")
    return value
