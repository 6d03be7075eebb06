"""The commands import and export for all units of a planner's file."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.options import refuse_existing, warn
from exfit.cli.streams import echo
from exfit.errors import ExfitError, FileError
from exfit.util.sources import FITTED
from exfit.util.text import first_texts

if TYPE_CHECKING:
    from exfit.features.fleet.folder import Fleet
    from exfit.features.planner.fitted_file import ChangedValue, FittedUnit, LeftUnit
    from exfit.features.planner.import_all import ImportedUnit, ImportPlan, RecordOptions

UNITS = "units.csv"


@dataclass(frozen=True)
class OfRecords:
    """The options of records, as they are given."""

    records: Path | None
    sizes: tuple[str, ...]
    bases: tuple[str, ...]
    clock: tuple[str, ...]
    unit: str | None
    sheet: str | None

    def refuse_without_all(self) -> None:
        """Raise UsageError where one is given: they need --all."""
        if any((self.records, self.sizes, self.bases, self.clock, self.unit, self.sheet)):
            raise click.UsageError(
                "--records, --step, --base, --time, --time-unit and --sheet: only with --all; "
                "exfit new makes a case of one record."
            )

    def parsed(self) -> "RecordOptions":
        """Return them as a case takes them; raises ExfitError, UsageError where they cannot be."""
        from exfit.case.suggestion import RecordSettings, bases_of
        from exfit.features.planner.import_all import RecordOptions

        others = (self.sizes, self.bases, self.clock, self.unit, self.sheet)
        if self.records is None and any(others):
            raise click.UsageError(
                "--step, --base, --time, --time-unit and --sheet: only with --records."
            )
        in_table = (self.sizes, self.clock, self.unit, self.sheet)
        if self.records is not None and not self.records.is_dir() and any(in_table):
            raise click.UsageError(
                "--step, --time, --time-unit and --sheet: not allowed with a table, which has "
                "columns for them."
            )
        settings = RecordSettings(self.clock, self.unit, self.sheet)
        return RecordOptions(self.sizes, bases_of(self.bases), settings)


def import_every_unit(dyr: Path, given: OfRecords, folder: Path | None, force: bool) -> None:
    """Write a case for every unit of a dynamics file, and a table of all units."""
    from exfit.features.planner.import_all import import_all, plan_import, units_table
    from exfit.util.files import write_each

    if folder is None:
        raise click.UsageError("Missing option '-o': the folder of the cases.")
    options = given.parsed()
    plan = plan_import(dyr, given.records)
    if not force:
        _refuse_existing(folder, [*plan.names, UNITS])
    imported = import_all(plan, folder, options)
    if imported.unused:
        raise ExfitError(f"--step {imported.unused[0]}: no test of that name in any record")
    write_each(folder, {**imported.texts, UNITS: units_table(imported.units)})
    warn(first_texts(imported.doubts))
    _report(plan, imported.units, folder)


def _refuse_existing(folder: Path, names: Sequence[str]) -> None:
    """Raise ExfitError where files would be lost."""
    existing = [str(folder / name) for name in names if (folder / name).exists()]
    if existing:
        listed = "\n".join(first_texts(existing))
        raise ExfitError(f"{listed}\nexist already; --force writes over them")


def _report(plan: "ImportPlan", units: "Sequence[ImportedUnit]", folder: Path) -> None:
    """Say what was written and what was not; raises ExfitError where something was refused."""
    from exfit.features.planner.import_all import NO_MODEL, RECORDED, REFUSED

    recorded = _lines_of(units, RECORDED)
    cases = [unit.case for unit in units if unit.case]
    counts = f"cases: {len(cases)}, with records: {len(recorded)}"
    echo(f"written to {folder}; {counts}; all units: {UNITS}")
    for path in first_texts([str(path) for path in plan.others]):
        echo(f"not joined to a unit: {path}: its name does not begin with a bus", err=True)
    for line in first_texts(_lines_of(units, NO_MODEL)):
        echo(f"no model: {line}", err=True)
    if plan.units.classical:
        count = f"{plan.units.classical} GENCLS without an exciter"
        echo(f"not units to verify: {count}, constant voltages behind a reactance", err=True)
    refused = [*_lines_of(units, REFUSED), *plan.faults]
    if refused:
        raise FileError(refused)
    if not cases:
        raise ExfitError(f"{plan.dyr}: no unit can be imported")


def _lines_of(units: "Sequence[ImportedUnit]", status: str) -> list[str]:
    """Return the units of a status, with what there is to know of each."""
    return [
        f"bus {unit.bus}, machine {unit.id}: {unit.notes}"
        for unit in units
        if unit.status == status
    ]


def export_every_unit(fleet: Path, dyr: Path | None, output: Path | None, force: bool) -> None:
    """Write a planner's file with the values of all verified units of a batch."""
    from exfit.features.fleet.folder import read_fleet
    from exfit.features.planner.fitted_file import changes_table, fitted_file
    from exfit.features.planner.import_case import read_file
    from exfit.util.files import write

    if output is None:
        raise click.UsageError("Missing option '-o': the file to write.")
    table = output.with_suffix(".csv")
    for path in (output, table):
        refuse_existing(path, force)
    fits, others = _fits_of(read_fleet(fleet))
    if not fits:
        raise ExfitError("\n".join([*_reasons(others), f"{fleet}: no case has a finished fit"]))
    original = dyr or _original(fits)
    if output.exists() and original.exists() and output.samefile(original):
        raise ExfitError(f"{output}: is the planner's own file: name another one with -o")
    _refuse_other_format(output, original)
    fitted = fitted_file(read_file(original), str(original), fits)
    left = [*fitted.left, *others]
    if not fitted.changes:
        raise ExfitError("\n".join([*_reasons(left), f"{original}: no unit to change"]))
    write(output, fitted.data)
    write(table, changes_table(fitted.changes))
    _report_export(output, table, fitted.changes, left)


def _refuse_other_format(output: Path, original: Path) -> None:
    """Raise ExfitError where the name of a file says another program than its content is of."""
    from exfit.features.planner.formats import format_of

    suffix = format_of(original).suffix
    if format_of(output).suffix != suffix:
        raise ExfitError(f"{output}: {original} is a {suffix} file: name it so with -o")


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


def _reasons(left: "Sequence[LeftUnit]") -> list[str]:
    """List the reasons for which units are left as they were."""
    return first_texts([f"{unit.name}: {unit.reason}" for unit in left])


def _original(fits: "Sequence[FittedUnit]") -> Path:
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


def _report_export(
    output: Path, table: Path, changes: "Sequence[ChangedValue]", left: "Sequence[LeftUnit]"
) -> None:
    """Say what was changed and what was not; raises ExfitError where a verified unit was left."""
    units = {(change.bus, change.id.upper()) for change in changes}
    echo(f"written to {output}; units changed: {len(units)}, values: {len(changes)}")
    echo(f"what was changed: {table}")
    warn(first_texts(_undetermined(changes)))
    for line in _reasons([unit for unit in left if not unit.verified]):
        echo(f"left as it was: {line}", err=True)
    refused = [f"{unit.name}: {unit.reason}" for unit in left if unit.verified]
    if refused:
        raise FileError(refused)


def _undetermined(changes: "Sequence[ChangedValue]") -> list[str]:
    """Return the cases with the values that they were written for without being determined."""
    names: dict[str, list[str]] = {}
    for change in changes:
        if change.source == FITTED and None in (change.low, change.high):
            names.setdefault(change.case, []).append(change.parameter)
    return [f"{case}: not determined: {', '.join(own)}" for case, own in names.items()]
