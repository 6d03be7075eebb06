"""The commands import and export."""

import os
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import (
    ABOVE_ZERO,
    ANY_PATH,
    file_option,
    force_option,
    output_option,
    refuse_existing,
    warn,
    write_text,
)
from exfit.cli.records import bases_option, sheet_option, steps_option, time_option, unit_option
from exfit.cli.streams import echo
from exfit.errors import DynamicsError, ExfitError, FileError
from exfit.util.text import first_texts

if TYPE_CHECKING:
    from exfit.features.fleet.folder import Fleet
    from exfit.features.planner.fitted_file import ChangedValue, FittedUnit, LeftUnit
    from exfit.features.planner.import_all import ImportedUnits

MOST_BUSES, DIGITS = 999_999, 20
CONNECTIONS, ANGLE_UNITS = ("phase-to-ground", "phase-to-phase"), ("deg", "rad")
BUSES = click.IntRange(1, MOST_BUSES)


def _number_or_name(
    context: click.Context, option: click.Parameter, value: str | None
) -> int | str | None:
    """Return the number of a bus where the text is one."""
    if value is not None and re.fullmatch("-?[0-9]+", value):
        begins = int(value[:DIGITS])  # of a longer one, out of the range too
        return int(BUSES.convert(begins, option, context))
    return value


bus_option = click.option(
    "--bus", callback=_number_or_name, metavar="N|NAME", help="Bus of the unit in the file."
)


@click.command("import", short_help="Make cases from a planner's dynamics file.")
@click.argument("dyr", type=GivenFile(Kind.DYNAMICS), metavar="UNIT")
@bus_option
@click.option("--id", "machine_id", metavar="ID", help="Machine id of the unit, such as 1.")
@click.option("--all", "every", is_flag=True, help="Make a case of every unit, in the folder -o.")
@click.option(
    "--records",
    type=click.Path(path_type=Path, exists=True),
    metavar="DIR|TABLE",
    help="With --all: folder of records named by bus and id, or a table.",
)
@steps_option
@bases_option
@time_option
@unit_option
@sheet_option
@click.option(
    "--raw",
    type=click.Path(path_type=Path, exists=True),
    metavar="FILE",
    help="Power flow file of PSS/E (.raw) with names of buses, kV and MVA of the units.",
)
@click.option("--kv", type=ABOVE_ZERO, metavar="KV", help="With --records: rated voltage.")
@click.option("--mva", type=ABOVE_ZERO, metavar="MVA", help="With --records: rated power.")
@click.option("--connection", type=click.Choice(CONNECTIONS), help="Of recorded phasors.")
@click.option("--angle-unit", type=click.Choice(ANGLE_UNITS), help="Of recorded angles.")
@click.option(
    "--channel",
    "channels",
    multiple=True,
    metavar="SIGNAL=COLUMN",
    help="Column of a signal, with its unit if not in the file: 'efd=Field [V]'.",
)
@output_option(help="File to write, with --all a folder; without it, to the terminal.")
@force_option
def import_(
    dyr: Path,
    bus: int | str | None,
    machine_id: str | None,
    every: bool,
    records: Path | None,
    sizes: tuple[str, ...],
    bases: tuple[str, ...],
    clock: tuple[str, ...],
    unit: str | None,
    sheet: str | None,
    raw: Path | None,
    kv: float | None,
    mva: float | None,
    connection: str | None,
    angle_unit: str | None,
    channels: tuple[str, ...],
    output: Path | None,
    force: bool,
) -> None:
    """Make a case from machine, exciter, stabiliser and governor in UNIT.

    UNIT is a dynamics file of PSS/E (.dyr) or of PSLF (.dyd).

    The case is a step of 5 % on open circuit, ready for `exfit simulate`. If UNIT has several
    units, --bus and --id select one, and --all makes a case of each. With --records a case has the
    tests of its records, as `exfit new` makes it.
    """
    from exfit.features.planner.import_all import columns_by_signal, import_units

    in_table = (sizes, clock, unit, sheet, channels)
    ratings = (kv, mva, connection, angle_unit)
    given = any((bases, *ratings, *in_table))
    if every:
        if bus is not None or machine_id is not None:
            raise click.UsageError("--bus and --id: not allowed with --all.")
        if output is None:
            raise click.UsageError("Missing option '-o': the folder of the cases.")
        if records is None and given:
            raise click.UsageError(
                "--step, --base, --time, --time-unit, --sheet, --channel and ratings: only with "
                "--records."
            )
        if records is not None and not records.is_dir() and any(in_table):
            raise click.UsageError(
                "--step, --time, --time-unit, --sheet and --channel: not allowed with a table, "
                "which has columns for them."
            )
        given_as = (records, sizes, bases, clock, unit, sheet, force)
        columns = columns_by_signal(channels)
        made = import_units(dyr, output, *given_as, *ratings, columns, raw)
        _report_import(made, output)
        return
    if records is not None or given:
        raise click.UsageError(
            "--records, its options and ratings: only with --all; "
            "exfit new makes a case of one record."
        )
    _import_one(dyr, bus, machine_id, raw, output, force)


def _import_one(
    dyr: Path,
    bus: int | str | None,
    machine_id: str | None,
    raw: Path | None,
    output: Path | None,
    force: bool,
) -> None:
    """Write the case of one unit."""
    from exfit.case.suggestion import relative
    from exfit.features.planner.buses import NO_BUSES
    from exfit.features.planner.fields import located
    from exfit.features.planner.import_all import key_of
    from exfit.features.planner.import_case import (
        case_of_machine,
        import_unit,
        imported_case,
        machine_without_exciter,
    )
    from exfit.features.planner.power_flow import read_buses, read_power_flow
    from exfit.features.planner.units import with_rating
    from exfit.features.start.ratings import NO_RATINGS

    if output is not None:
        refuse_existing(output, force)
    buses = NO_BUSES if raw is None else read_buses(raw)
    file = relative(dyr, Path() if output is None else output.parent)
    try:
        imported = import_unit(dyr, bus, machine_id, buses)
    except DynamicsError:
        unit = machine_without_exciter(dyr, bus, machine_id, buses)
        if unit is None or unit.alone is None:
            raise
        draft, warnings = case_of_machine(unit, unit.alone, file), unit.alone.warnings
    else:
        if raw is not None:
            mva = read_power_flow(raw).get(key_of(imported), NO_RATINGS).mva
            imported = with_rating(imported, mva)
        draft, warnings = imported_case(imported, file), imported.warnings
    write_text(draft.text, output, located(warnings, str(dyr)))
    if output is not None:
        echo(f"written to {output}; next: exfit simulate {output}")


def _report_import(imported: "ImportedUnits", folder: Path) -> None:
    """Report what was written and what was not; raises ExfitError where something was refused."""
    from exfit.features.planner.import_all import NO_MODEL, RECORDED, REFUSED, UNITS

    plan = imported.plan
    warn(first_texts(imported.doubts))
    lines: dict[str, list[str]] = {NO_MODEL: [], RECORDED: [], REFUSED: []}
    for unit in imported.units:
        line = f"bus {unit.bus}, machine {unit.id}: {unit.notes}"
        lines.setdefault(unit.status, []).append(line)
    cases = [unit.case for unit in imported.units if unit.case]
    counts = f"cases: {len(cases)}, with records: {len(lines[RECORDED])}"
    echo(f"written to {folder}; {counts}; all units: {UNITS}")
    for path in first_texts([str(path) for path in plan.others]):
        echo(f"no unit for {path}: its name does not begin with a bus", err=True)
    of_units = Counter(name for unit in plan.units.units for name in unit.unknown)
    for what, left_out in (("units", of_units), ("other devices", plan.units.devices)):
        if left_out:
            counts = ", ".join(f"{name} ({count})" for name, count in sorted(left_out.items()))
            echo(f"left out, no model of exfit ({what}): {counts}", err=True)
    for line in first_texts(lines[NO_MODEL]):
        echo(f"no model: {line}", err=True)
    if plan.units.classical:
        count = f"{plan.units.classical} GENCLS without an exciter"
        echo(f"not imported: {count}: constant voltages behind a reactance", err=True)
    refused = [*lines[REFUSED], *plan.faults]
    if refused:
        raise FileError(refused)
    if not cases:
        raise ExfitError(f"{plan.dyr}: no unit can be imported")


def _machine_id(_context: object, _option: object, value: str | None) -> str | None:
    from exfit.features.planner.records import is_machine_id

    if value is not None and not is_machine_id(value):
        raise click.BadParameter(f"{value!r} is not one or two letters or digits.")
    return value


@click.command(short_help="Write the result of a fit as records of a planner's file.")
@click.argument("result", type=GivenFile(Kind.RESULT))
@click.option(
    "--all",
    "every",
    is_flag=True,
    help="Write all verified units of the batch in the folder RESULT.",
)
@click.option(
    "--dyr",
    "--planner",
    type=GivenFile(Kind.DYNAMICS),
    metavar="FILE",
    help="With --all: the planner's file to change (default: that of the cases).",
)
@click.option(
    "--undetermined",
    is_flag=True,
    help="With --all: write fitted values that the records do not determine, too.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["dyr", "dyd"]),
    help="Format: dyr of PSS/E, dyd of PSLF (default: by the suffix of FILE, else dyr).",
)
@click.option("--bus", type=BUSES, metavar="N", help="Bus of the unit (default: as found, else 1).")
@click.option(
    "--id",
    "machine_id",
    metavar="ID",
    callback=_machine_id,
    help="Machine id of the unit (default: as found, else 1).",
)
@click.option(
    "--model", metavar="NAME", help="Another record of the exciter's model, such as ESAC8B."
)
@click.option(
    "--plb",
    type=ANY_PATH,
    metavar="FILE",
    help="Of a fit of grid events: write the played-in signals as a file of PSS/E instead.",
)
@file_option
@force_option
def export(
    result: Path,
    every: bool,
    dyr: Path | None,
    undetermined: bool,
    form: str | None,
    bus: int | None,
    machine_id: str | None,
    model: str | None,
    plb: Path | None,
    output: Path | None,
    force: bool,
) -> None:
    """Write machine, exciter, stabiliser and governor of RESULT as records of PSS/E or PSLF.

    RESULT is the result.json of a fit, or the folder that holds it. Values that a record cannot
    hold, and orders that are not confirmed, are reported.

    With --all RESULT is the folder of a batch, and the planner's file is written with the values of
    the units whose fits hold; every other byte of it stays as it is.
    """
    of_record = (bus, machine_id, model)
    if plb is not None:
        from exfit.features.planner.play_in import export_play_in

        others = (dyr, form, output, *of_record)
        if every or any(other is not None for other in others):
            raise click.UsageError("--plb: only --force is allowed with it.")
        export_play_in(result, plb, force)
    elif every:
        if any(other is not None for other in of_record):
            raise click.UsageError("--bus, --id and --model: not allowed with --all.")
        if form is not None:
            raise click.UsageError("--format: not allowed with --all, which keeps the format.")
        if output is None:
            raise click.UsageError("Missing option '-o': the file to write.")
        _export_every_unit(result, dyr, undetermined, output, force)
    elif dyr is not None or undetermined:
        raise click.UsageError("--dyr and --undetermined: only with --all.")
    else:
        _export_one(result, form, bus, machine_id, model, output, force)


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
    from exfit.features.planner.units import format_of
    from exfit.results.io import load_result, result_file

    if output is not None:
        refuse_existing(output, force)
    source = result_file(result)
    fit = load_result(source)
    try:
        form = form or format_of(output or "").suffix.removeprefix(".")
        records = exported(fit, bus, machine_id, model, form)
    except ExfitError as fault:
        texts = (f"{source}: {text}" for text in str(fault).splitlines())
        raise FileError(texts) from None
    write_text(records.text, output, [f"{source}: {text}" for text in records.warnings])
    if output is not None:
        echo(f"written to {output}")


def _export_every_unit(
    fleet: Path, dyr: Path | None, undetermined: bool, output: Path, force: bool
) -> None:
    """Write a planner's file with the values of all verified units of a batch."""
    from exfit.features.fleet.folder import read_fleet
    from exfit.features.planner.fitted_file import changes_table, fitted_file
    from exfit.features.planner.import_case import read_file
    from exfit.features.planner.units import format_of
    from exfit.util.files import write

    table = output.with_suffix(".csv")
    for path in (output, table):
        refuse_existing(path, force)
    fits, others = _fits_of(read_fleet(fleet))
    if not fits:
        reasons = first_texts([f"{unit.name}: {unit.reason}" for unit in others])
        raise ExfitError("\n".join([*reasons, f"{fleet}: no case has a finished fit"]))
    original = dyr or _original(fits)
    if output.exists() and original.exists() and output.samefile(original):
        raise ExfitError(f"{output}: is the planner's file itself: name another one with -o")
    suffix = format_of(original).suffix
    if format_of(output).suffix != suffix:
        raise ExfitError(f"{output}: must end with {suffix}, as {original} does")
    fitted = fitted_file(read_file(original), str(original), fits, undetermined)
    left = [*fitted.left, *others]
    told = "" if undetermined else ", as found (--undetermined writes them)"
    named = [
        f"{case}: no closed interval{told}: {', '.join(own)}"
        for case, own in fitted.undetermined.items()
    ]
    if not fitted.changes:
        reasons = first_texts([*named, *(f"{unit.name}: {unit.reason}" for unit in left)])
        raise ExfitError("\n".join([*reasons, f"{original}: no unit to change"]))
    write(output, fitted.data)
    write(table, changes_table(fitted.changes))
    warn(first_texts(named))
    _report_export(output, table, fitted.changes, left)


def _report_export(
    output: Path, table: Path, changes: "tuple[ChangedValue, ...]", left: "list[LeftUnit]"
) -> None:
    """Report what was changed and what not; raises ExfitError where a verified unit was left."""
    units = {(change.bus, change.id.upper()) for change in changes}
    echo(f"written to {output}; units changed: {len(units)}, values: {len(changes)}")
    echo(f"changes: {table}")
    for line in first_texts([f"{own.name}: {own.reason}" for own in left if not own.verified]):
        echo(f"not changed: {line}", err=True)
    refused = [f"{unit.name}: {unit.reason}" for unit in left if unit.verified]
    if refused:
        raise FileError(refused)


def _fits_of(fleet: "Fleet") -> "tuple[list[FittedUnit], list[LeftUnit]]":
    """Return the fits of a batch that are done, and why the other cases are not."""
    from exfit.features.planner.fitted_file import FittedUnit, LeftUnit
    from exfit.results.io import load_result

    fits, others = list[FittedUnit](), list[LeftUnit]()
    for case in fleet.cases:
        folder = fleet.fit_of(case)
        if folder is None:
            if case.status != "no record":
                why = f"{case.status}: {case.reason}"
                if case.status == "done":
                    why = "a programme without bump tests: nothing was fitted"
                others.append(LeftUnit(case.name, why, False))
            continue
        try:
            # a fit of equal content stands under one key: each case has its own path
            result = replace(load_result(folder), case=fleet.path_of(case))
            fits.append(FittedUnit(case.name, result))
        except ExfitError as fault:
            others.append(LeftUnit(case.name, str(fault), verified=True))
    return fits, others


def _original(fits: "list[FittedUnit]") -> Path:
    """Return the file that all cases were made of; raises ExfitError where it is not one alone."""
    files = {
        os.path.normpath(result.case.parent / found.file): None
        for _, result in fits
        if (found := result.as_found) is not None and found.file is not None
    }
    if not files:
        raise ExfitError("--dyr: required: no case names the planner's file that it was made of")
    if len(files) > 1:
        named = ", ".join(first_texts([*files]))
        raise ExfitError(f"--dyr: required: the cases were made of several files: {named}")
    return Path(next(iter(files)))
