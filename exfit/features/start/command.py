"""The commands new and verify: from a recorder's file to a case, and to a report."""

import sys
from collections.abc import Mapping
from pathlib import Path
from shlex import join, quote
from typing import TYPE_CHECKING, Any

import click

from exfit.cli import completion
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import (
    ABOVE_ZERO,
    ANY_PATH,
    Interruption,
    Output,
    file_option,
    force_option,
    refuse_existing,
    warn,
    write_text,
)
from exfit.cli.records import (
    bases_option,
    memory_option,
    sheet_option,
    steps_option,
    time_option,
    unit_option,
)
from exfit.cli.streams import echo
from exfit.errors import ExfitError, FileError
from exfit.features.planner.commands import bus_option
from exfit.util.text import dotted

if TYPE_CHECKING:
    from exfit.features.start.answers import Given
    from exfit.features.start.making import Inspections, NewCase

ENDING = ".answers.yaml"
model_option = click.option(
    "--model",
    metavar="NAME",
    help="Exciter, or the file of a model; default: that of --dyr.",
    shell_complete=completion.exciters,
)
kv_option = click.option(
    "--kv", type=ABOVE_ZERO, metavar="KV", help="Rated voltage of the unit: for --base vt=..kV."
)
mva_option = click.option(
    "--mva",
    type=ABOVE_ZERO,
    metavar="MVA",
    help="Rated power of the unit: for --base p=..MW, q=..Mvar.",
)
dyr_option = click.option(
    "--dyr",
    "--planner",
    type=GivenFile(Kind.DYNAMICS),
    metavar="FILE",
    help="Planner's file (.dyr or .dyd) with machine, exciter, stabiliser and governor.",
)
id_option = click.option(
    "--id", "machine_id", metavar="ID", help="Machine id of the unit, such as 1."
)
answers_option = click.option(
    "--answers",
    "answers_file",
    type=ANY_PATH,
    metavar="FILE",
    help="Answers to all questions, in YAML; options count more.",
)


@click.command(short_help="Make a case from a record: asks what it needs.")
@model_option
@click.option(
    "--machine",
    metavar="NAME",
    help="Machine model (default: GENROU, or that of --dyr).",
    shell_complete=completion.machines,
)
@click.option(
    "--governor",
    metavar="NAME",
    help="Governor, of a record of one of its tests.",
    shell_complete=completion.governors,
)
@click.option(
    "--record",
    "file",
    type=GivenFile(Kind.RECORD),
    metavar="FILE",
    help="Record of bump tests, of a grid event by a PMU, or of a test of the governor.",
)
@steps_option
@click.option(
    "--tests",
    "table",
    type=ANY_PATH,
    metavar="CSV",
    help="Table of tests: file, at, step, base, validates.",
)
@bases_option
@kv_option
@mva_option
@dyr_option
@bus_option
@id_option
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
@answers_option
@file_option
@force_option
def new(
    model: str | None,
    machine: str | None,
    governor: str | None,
    file: Path | None,
    sizes: tuple[str, ...],
    table: Path | None,
    bases: tuple[str, ...],
    kv: float | None,
    mva: float | None,
    dyr: Path | None,
    bus: int | str | None,
    machine_id: str | None,
    machine_from: Path | None,
    facts: tuple[str, ...],
    clock: tuple[str, ...],
    unit: str | None,
    sheet: str | None,
    memory: float | None,
    answers_file: Path | None,
    output: Path | None,
    force: bool,
) -> None:
    """Make a commented case from a record: its tests, the data of the unit, what is free.

    On a terminal it asks for what it needs, unless --record (or --tests) and --model (or --dyr) are
    given: then only for what the case cannot do without. Each question says where the answer is
    found, and most propose one. Ctrl-C keeps the answers.

    The file of a phasor measurement unit is a grid event, which is played back into the unit.
    In a test of the governor, which inspect knows by the gate, the governor is fitted.
    Of several tests in a record, each is a record of the case with a window; the first is fitted,
    the second validates, and so on. Values are typical, or those of a planner's file. Without a
    terminal, what the record does not show is left as "?", and the case is refused until it is
    filled in; with --answers what is missing is named.
    """
    from exfit.features.start.answers import checked, contradictions
    from exfit.features.start.making import new_case
    from exfit.features.start.starting_tests import sizes_of

    options = {
        "model": model, "machine_model": machine, "governor": governor, "record": file,
        "step": sizes_of(sizes), "tests": table, "base": bases_by_signal(bases), "kv": kv,
        "mva": mva, "dyr": dyr, "bus": bus, "id": machine_id, "machine_from": machine_from,
        "about": facts_by_name(facts), "time": clock, "time_unit": unit, "sheet": sheet,
        "memory": memory, "output": output,
    }  # fmt: skip
    given, read = merged(answers_file, options), dict[Path, Any]()
    for text in contradictions(checked(given)):
        raise click.UsageError(text)
    if "output" in given:
        refuse_existing(Path(given["output"]), force)
    asks = is_terminal()
    converses = asks and (answers_file is not None or bool(lacking(given)))
    if asks:
        complete(given, read, "new", answers_file is None, converses)
    elif answers_file is not None:
        refuse_missing(given, read, answers_file)
    elif lacking(given):
        raise click.UsageError(f"Missing option {lacking(given)}.")
    output = Path(given["output"]) if "output" in given else None
    made = new_case(checked(given), (output or Path()).parent, read)
    warn(made.doubts)
    write_text(made.draft.text, output, ())
    if output is None:
        return
    if converses and answers_file is None and "record" in given:
        finish(given, read, made, output)
    else:
        list_open(made, output)


def list_open(made: "NewCase", output: Path) -> None:
    """Say where a case was written, and what is open in it."""
    echo(f"written to {output}; next: exfit check {quote(str(output))}")
    for value in made.open:
        hint = f" ({value.hint})" if value.hint else ""
        echo(f"to be filled in: {dotted(value.place)}{hint}, line {value.line}")


def lacking(given: "Given") -> str:
    """Name the options without which there is no record, or no unit."""
    if not {"record", "tests"} & given.keys():
        return "'--record', or '--tests'"
    return "" if {"model", "dyr"} & given.keys() else "'--model', or '--dyr'"


def is_terminal() -> bool:
    """Tell if someone sits at the keyboard who can be asked."""
    return sys.stdin is not None and sys.stdin.isatty()


def names_case(given: "Given") -> bool:
    """Tell if the case has a name that can be asked: it is not redirected to a file."""
    return "output" not in given and sys.stdout.isatty()


# ---- what new and verify share


def merged(answers_file: Path | None, options: Mapping[str, Any]) -> "Given":
    """Return the answers of a file with those of options, which count more."""
    from exfit.features.start.answers import read_answers

    given = {} if answers_file is None else read_answers(answers_file)
    for key, value in options.items():
        if value not in (None, (), {}):
            given[key] = str(value) if isinstance(value, Path) else value
    return given


def bases_by_signal(texts: tuple[str, ...]) -> dict[str, str]:
    """Return bases as texts by signal; raises ExfitError for a text of another form."""
    from exfit.case.suggestion import bases_of

    bases_of(texts)
    return {text.partition("=")[0]: text.partition("=")[2] for text in texts}


def facts_by_name(texts: tuple[str, ...]) -> dict[str, str]:
    """Return facts by name; raises ExfitError for a text of another form."""
    facts = {}
    for text in texts:
        name, equals, fact = (part.strip() for part in text.partition("="))
        if not (name and equals and fact):
            raise ExfitError(f"--about {text}: not of the form Unit=3")
        facts[name] = fact
    return facts


def complete(
    given: "Given", read: "Inspections", command: str, introduced: bool, converses: bool = True
) -> None:
    """Ask what is not given, or only what the case cannot do without.

    Raises Interruption at Ctrl-C, when the answers are in a file.
    """
    from exfit.features.start.conversation import converse, fill_in

    try:
        if converses:
            converse(given, read, introduced, command == "new" and names_case(given))
        else:
            fill_in(given, read)
    except (click.Abort, KeyboardInterrupt):
        if not given:
            raise Interruption("nothing was answered") from None
        stem = Path(str(given.get("record") or "exfit")).stem
        path = keep(given, Path(stem + ENDING))
        resume = ["exfit", command, "--answers", str(path)]
        if "output" in given:
            resume += ["-o", str(given["output"])]
        raise Interruption(f"the answers are kept; to go on:\n{join(resume)}") from None


def keep(given: "Given", path: Path) -> Path:
    """Write answers to a file, or beside it where another file has its name; return which."""
    from exfit.features.start.answers import HEADING, answers_text

    number, free, begin = 2, path, f"# {HEADING}".encode()
    while free.is_symlink() or (free.exists() and not free.read_bytes().startswith(begin)):
        free, number = path.with_name(f"{path.stem}-{number}{path.suffix}"), number + 1
    write_text(answers_text(given, free), free, ())
    return free


def refuse_missing(given: "Given", read: "Inspections", source: Path | None) -> None:
    """Raise ExfitError with all answers that are missing, where nobody can be asked."""
    from exfit.features.start.answers import checked, still_open
    from exfit.features.start.making import missing_in

    place = "" if source is None else f"{source}: "
    missing = missing_in(checked(given), Path(), read)
    missing |= dict.fromkeys(still_open(given), '"?" is to be filled in')
    if missing:
        lines = [f"{place}{key}: missing: {text}" for key, text in missing.items()]
        raise FileError([*lines, "give them as options, or under these keys in --answers FILE"])


def finish(given: "Given", read: "Inspections", made: "NewCase", output: Path) -> None:
    """Say what was written and what comes next; draw the record, as inspect does."""
    from exfit.case.load import load_case
    from exfit.features.start.making import typical_left
    from exfit.features.start.questions import say
    from exfit.output import run_folder

    answers = keep(given, output.with_suffix(ENDING))
    echo("")
    echo(f"written to {output}; the answers to {answers}")
    left = typical_left(made)
    if left:
        say(f"typical, not of this unit: {left}", err=False)
    if "record" in given:
        inspection = made.tests[0].inspection
        show = Output(None, figures=True, quiet=True, as_json=False)
        folder = show.folder(f"{inspection.path.name}-inspect", run_folder.OF_INSPECTION)
        show.draw(run_folder.write_inspection(inspection, folder))
        echo(f"look at {folder / 'inspect.png'}: is each step in its place?")
    load_case(output)  # refuses what no single question could show
    echo(f"next: exfit fit {quote(str(output))}")
