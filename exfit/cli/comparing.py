"""The command compare."""

from pathlib import Path

import click

from exfit.cli.options import (
    json_option,
    output_option,
    plots_option,
    print_json,
    quiet_option,
    warn,
)
from exfit.errors import ExfitError


@click.command(short_help="Compare two responses, whatever program they are from.")
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@click.argument("record", type=click.Path(path_type=Path), required=False)
@click.option(
    "--columns",
    multiple=True,
    metavar="vt=VOLT",
    help="Column of a signal, in the files that have it; may be repeated.",
)
@click.option("--time", metavar="COLUMN", help="Column of the time, s, in the files that have it.")
@click.option(
    "--shift", type=float, default=0.0, metavar="S", help="Seconds added to the time of B."
)
@click.option("--step", "step_at", type=float, metavar="S", help="Instant of the step, s.")
@output_option
@plots_option
@quiet_option
@json_option
def compare(
    a: Path,
    b: Path,
    record: Path | None,
    columns: tuple[str, ...],
    time: str | None,
    shift: float,
    step_at: float | None,
    output: Path | None,
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Compare the responses A and B, and both with RECORD.

    Each is the folder or the result.json of a fit or a simulation, or a CSV file of any program.
    Compared are vt, efd, ifd, p and q where A and B have them, over the time that both cover, on
    the finer of their clocks. Writes compare.json, compare.csv and compare.png to runs/compare, or
    to DIR.
    """
    from exfit.analysis.comparison import ColumnChoice
    from exfit.analysis.comparison import compare as compared
    from exfit.output import run_folder

    folder = output or Path("runs") / "compare"
    run_folder.refuse_unwritable(folder)
    found = compared(a, b, record, ColumnChoice(_columns(columns), time), shift, step_at)
    warn(run_folder.write_agreement(found, folder, plots))
    if as_json:
        print_json(found.as_json())
    elif not quiet:
        from exfit.output import terminal

        console = terminal.console()
        terminal.agreement(console, found)
        terminal.written(console, folder)


def _columns(texts: tuple[str, ...]) -> dict[str, str]:
    """Return the columns of --columns vt=VOLT by signal; raises ExfitError for other text."""
    found = {}
    for text in texts:
        signal, given, column = (part.strip() for part in text.partition("="))
        if not (signal and given and column):
            raise ExfitError(f"--columns {text}: not of the form vt=VOLT")
        found[signal] = column
    return found
