"""The commands import and export."""

from pathlib import Path

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import file_option, force_option, refuse_existing, write_text
from exfit.cli.planner import OfRecords, import_every_unit
from exfit.cli.records import bases_option, sheet_option, steps_option, time_option, unit_option
from exfit.cli.streams import echo
from exfit.errors import ExfitError

BUSES = click.IntRange(1, 999_999)


@click.command("import", short_help="Make cases from a PSS/E dynamics file.")
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
    """Make a case from the machine, exciter and stabiliser in UNIT, a PSS/E .dyr file.

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
    from exfit.case.starting.suggestion import relative
    from exfit.exchange.psse.fields import located
    from exfit.exchange.psse.import_case import case_text, import_unit

    if output is not None:
        refuse_existing(output, force)
    imported = import_unit(dyr, bus, machine_id)
    file = relative(dyr, Path() if output is None else output.parent)
    write_text(case_text(imported, file), output, located(imported.warnings, str(dyr)))
    if output is not None:
        echo(f"written to {output}; next: exfit simulate {output}")


@click.command(short_help="Write the result of a fit as PSS/E records.")
@click.argument("result", type=GivenFile(Kind.RESULT))
@click.option(
    "--format",
    "_format",
    type=click.Choice(["dyr"]),
    default="dyr",
    help="Kind of file: dyr, a PSS/E dynamics file (default).",
)
@click.option("--bus", type=BUSES, metavar="N", default=1, help="Bus of the unit (default: 1).")
@click.option(
    "--id",
    "machine_id",
    metavar="ID",
    default="1",
    callback=lambda _, __, value: _machine_id(value),
    help="Machine id of the unit (default: 1).",
)
@click.option(
    "--model", metavar="NAME", help="Another record of the exciter's model, such as ESAC8B."
)
@file_option
@force_option
def export(
    result: Path,
    _format: str,
    bus: int,
    machine_id: str,
    model: str | None,
    output: Path | None,
    force: bool,
) -> None:
    """Write the machine, exciter and stabiliser of RESULT as PSS/E records.

    RESULT is the result.json of a fit, or the folder that holds it. What a PSS/E record cannot
    hold, and what is uncertain, is reported.
    """
    from exfit.exchange.psse.export import export as exported
    from exfit.results.io import load_result, result_file

    if output is not None:
        refuse_existing(output, force)
    source = result_file(result)
    fit = load_result(source)
    try:
        records = exported(fit, bus, machine_id, model)
    except ExfitError as fault:
        texts = (f"{source}: {text}" for text in str(fault).splitlines())
        raise ExfitError("\n".join(texts)) from None
    write_text(records.text, output, [f"{source}: {text}" for text in records.warnings])
    if output is not None:
        echo(f"written to {output}")


def _machine_id(value: str) -> str:
    if not (1 <= len(value) <= 2 and value.isascii() and value.isalnum()):
        raise click.BadParameter(f"{value!r} is not one or two letters or digits.")
    return value
