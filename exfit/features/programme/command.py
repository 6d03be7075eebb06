"""The command run."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.fitting import draw_each
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import (
    NOT_CONVERGED,
    Interruption,
    Output,
    output_options,
    print_json,
    progress_option,
)
from exfit.errors import FileError

if TYPE_CHECKING:
    from exfit.output.events import Events


@click.command(short_help="Run all tests of a unit, each feeding the later ones.")
@click.argument("programme", type=GivenFile(Kind.CASE))
@click.option("--again", is_flag=True, help="Run every test again, even if its result is kept.")
@progress_option
@output_options
def run(programme: Path, again: bool, output: Output) -> None:
    """Run the tests of PROGRAMME in the order in which one feeds the next.

    Saturation tests come first, then points on load, then tests that determine data of the machine.
    Their results are passed on to the later tests, with their source. Last, all bump tests are
    fitted together. A case is a programme of one test.

    Writes a folder for each test, programme.json and one report.html to runs/PROGRAMME-run, or to
    DIR. A finished test is run again only if its section, its files, the values passed on to it or
    exfit have changed: after an interruption the next run continues with the rest.

    Exit code 0: every test is matched; 1: bad input, or a test failed; 3: a test is not matched, a
    validation is not accepted, or not all tests were run.
    """
    from exfit.features.programme import folder as programme_folder
    from exfit.features.programme import programme_terminal
    from exfit.features.programme.programme import load_programme, steps_of
    from exfit.features.programme.run import run as run_programme

    loaded = load_programme(programme)
    steps = steps_of(loaded)
    folder = output.folder(f"{loaded.path.stem}-run")
    names = [step.name for step in steps]
    inputs = [loaded.path, *(file for name in names for file in loaded.files_of(name))]
    programme_folder.refuse_inputs(inputs, names, folder)
    progress: programme_terminal.ProgrammeProgress | Events | None = output.events
    if output.live:
        from exfit.output import terminal

        progress = programme_terminal.ProgrammeProgress(terminal.console(), steps)
    if progress is not None:
        with progress.running() as shown:
            result = run_programme(
                loaded, folder, again, shown, shown.finished, keep=programme_folder.write_test
            )
    else:
        result = run_programme(loaded, folder, again, keep=programme_folder.write_test)
    if result.interrupted and not result.tests:
        raise Interruption("no test is finished")
    try:
        programme_folder.write_programme(result, folder)
        if not result.interrupted:
            from exfit.features.report.writing import write_report

            write_report(folder)
    finally:  # whatever becomes of the files
        if output.as_json:
            print_json(result.to_dict())
        elif output.shown:
            from exfit.features.programme import programme_blocks
            from exfit.output import terminal

            console = terminal.console()
            terminal.show(console, programme_blocks.programme(result))
            console.print()
            terminal.written(console, folder)
    if not result.interrupted:
        draw_each(programme_folder.figures_of(result, folder), output)
    if result.failed:
        raise FileError(f"{name}: {fault}" for name, fault in result.failed.items())
    if not result.holds:
        raise SystemExit(NOT_CONVERGED)


def check(path: Path) -> bool:
    """Check each test of a programme and show the result; False: a test has a fault."""
    from exfit.features.programme import programme_blocks
    from exfit.features.programme.programme import load_programme
    from exfit.features.programme.run import check_programme
    from exfit.output import terminal

    sound, console = True, terminal.console()
    for checked in check_programme(load_programme(path)):
        terminal.show(console, programme_blocks.checked_step(checked))
        console.print()
        sound = sound and checked.sound
    return sound
