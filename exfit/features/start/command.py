"""The command new: from a recorder's file to a case."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli import completion
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import file_option, force_option, refuse_existing, warn, write_text
from exfit.cli.records import (
    bases_option,
    memory_option,
    sheet_option,
    steps_option,
    time_option,
    unit_option,
)
from exfit.cli.streams import echo
from exfit.errors import ExfitError
from exfit.features.planner.commands import BUSES
from exfit.util.text import dotted, printable

if TYPE_CHECKING:
    from exfit.case.case_draft import CaseDraft, OpenValue
    from exfit.case.suggestion import Base, RecordSettings
    from exfit.features.start.starting_case import UnitData
    from exfit.features.start.starting_tests import StartingTest


RATING = click.FloatRange(min=0.0, min_open=True)


@click.command(short_help="Make a case from a record and a model or a planner's file.")
@click.option(
    "--model",
    metavar="NAME",
    help="Exciter, or the file of a model; default: that of --dyr.",
    shell_complete=completion.exciters,
)
@click.option(
    "--machine",
    metavar="NAME",
    help="Machine model (default: GENROU, or that of --dyr).",
    shell_complete=completion.machines,
)
@click.option(
    "--record",
    "file",
    type=GivenFile(Kind.RECORD),
    metavar="FILE",
    help="Record of bump tests, or of a grid event by a PMU.",
)
@steps_option
@click.option(
    "--tests",
    "table",
    type=click.Path(path_type=Path),
    metavar="CSV",
    help="Table of tests: file, at, step, base, validates.",
)
@bases_option
@click.option(
    "--kv", type=RATING, metavar="KV", help="Rated voltage of the unit: for --base vt=..kV."
)
@click.option(
    "--mva",
    type=RATING,
    metavar="MVA",
    help="Rated power of the unit: for --base p=..MW, q=..Mvar.",
)
@click.option(
    "--dyr",
    "--planner",
    type=GivenFile(Kind.DYNAMICS),
    metavar="FILE",
    help="Planner's file (.dyr or .dyd) with machine, exciter, stabiliser and governor.",
)
@click.option("--bus", type=BUSES, metavar="N", help="Bus of the unit in it.")
@click.option("--id", "machine_id", metavar="ID", help="Machine id of the unit, such as 1.")
@click.option(
    "--machine-from",
    type=GivenFile(Kind.CASE),
    metavar="CASE",
    help="Another case, whose machine is taken.",
)
@click.option(
    "--about", "facts", multiple=True, metavar="NAME=FACT", help="For the report: Unit=3."
)
@time_option
@unit_option
@sheet_option
@memory_option
@file_option
@force_option
def new(
    model: str | None,
    machine: str | None,
    file: Path | None,
    sizes: tuple[str, ...],
    table: Path | None,
    bases: tuple[str, ...],
    kv: float | None,
    mva: float | None,
    dyr: Path | None,
    bus: int | None,
    machine_id: str | None,
    machine_from: Path | None,
    facts: tuple[str, ...],
    clock: tuple[str, ...],
    unit: str | None,
    sheet: str | None,
    memory: float | None,
    output: Path | None,
    force: bool,
) -> None:
    """Make a commented case from a record: its tests, the data of the unit, what is free.

    The file of a phasor measurement unit is a grid event, which is played back into the unit.
    Of several tests in a record, each is a record of the case with a window; every other one
    validates. Values are typical, or those of a planner's file. What the record does not show is
    asked on a terminal, or left as "?", and the case is refused until it is filled in.
    """
    from exfit.case.suggestion import RecordSettings, bases_of, rated_bases
    from exfit.features.start.starting_case import starting_case
    from exfit.features.start.starting_tests import doubtful_bases

    if output is not None:
        refuse_existing(output, force)
    folder = Path() if output is None else output.parent
    data = _unit(model, machine, dyr, bus, machine_id, machine_from, folder)
    reading = RecordSettings(clock, unit, sheet, memory=memory)
    tests = _tests(file, table, sizes, rated_bases(bases_of(bases), kv, mva), reading)
    warn(doubtful_bases(tests))
    draft = starting_case(data, tests, folder, _facts(facts))
    if is_terminal():
        draft = _asked(draft)
    still_open = draft.open_values()  # refuses what no command would read, before it is written
    write_text(draft.text, output, ())
    if output is not None:
        echo(f"written to {output}; next: exfit check {output}")
        for value in still_open:
            echo(f"to be filled in: {_question(value)}, line {value.line}")


def is_terminal() -> bool:
    """Tell if someone sits at the keyboard who can be asked."""
    return sys.stdin is not None and sys.stdin.isatty()


def _tests(
    file: Path | None,
    table: Path | None,
    sizes: tuple[str, ...],
    bases: "dict[str, Base]",
    reading: "RecordSettings",
) -> "tuple[StartingTest, ...]":
    """Return the tests of a record, or those that a table names."""
    from exfit.features.start.starting_tests import starting_tests
    from exfit.features.start.tables import read_test_table, tests_of_table

    if table is None:
        if file is None:
            raise click.UsageError("Missing option '--record', or '--tests'.")
        return starting_tests([reading.inspect(file)], sizes, bases)
    if sizes:
        raise click.UsageError("--step: not allowed with --tests, which has a column step.")
    rows = [row if row.file else row._replace(file=file) for row in read_test_table(table)]
    for row in rows:
        if row.file is None:
            raise ExfitError(f"{row.place}: file: missing, and no --record is given")
    files = dict.fromkeys(row.file for row in rows if row.file is not None)
    return tests_of_table(rows, {path: reading.inspect(path) for path in files}, bases)


def _unit(
    model: str | None,
    machine: str | None,
    dyr: Path | None,
    bus: int | None,
    machine_id: str | None,
    machine_from: Path | None,
    folder: Path,
) -> "UnitData":
    """Return the data of the unit: typical, a planner's, with the machine of another case."""
    from exfit.case.suggestion import relative
    from exfit.features.planner.fields import located
    from exfit.features.planner.import_case import import_unit, unit_data
    from exfit.features.start.starting_case import machine_of_case, unit_with

    if model is None and dyr is None:
        raise click.UsageError("Missing option '--model', or '--dyr'.")
    if machine is not None and (dyr or machine_from):
        raise click.UsageError("--machine: not allowed with --dyr or --machine-from.")
    planner = None
    if dyr is not None:
        unit = import_unit(dyr, bus, machine_id)
        warn(located(unit.warnings, str(dyr)))
        planner = unit_data(unit, relative(dyr, folder))
    elif bus is not None or machine_id is not None:
        raise click.UsageError("--bus and --id: only with --dyr.")
    data = unit_with(model, machine, planner, folder)
    return replace(data, machine=machine_of_case(machine_from)) if machine_from else data


def _facts(texts: tuple[str, ...]) -> dict[str, str]:
    """Return facts by name; raises ExfitError for a text of another form."""
    facts = {}
    for text in texts:
        name, equals, fact = (part.strip() for part in text.partition("="))
        if not (name and equals and fact):
            raise ExfitError(f"--about {text}: not of the form Unit=3")
        facts[name] = fact
    return facts


def _asked(draft: "CaseDraft") -> "CaseDraft":
    """Fill in what the user gives for the open values of a case; Enter leaves one open."""
    given: dict[OpenValue, str | float] = {}
    for value in draft.open_values():
        text = click.prompt(printable(_question(value)), default="", show_default=False, err=True)
        answer = text.strip()
        if not answer:
            continue
        try:
            given[value] = answer if value.place[-1] in ("column", "unit") else float(answer)
        except ValueError:
            place = dotted(value.place)
            raise ExfitError(f"{place}: {answer!r} is not a number") from None
    return draft.filled(given)


def _question(value: "OpenValue") -> str:
    return f"{dotted(value.place)} ({value.hint})" if value.hint else dotted(value.place)
