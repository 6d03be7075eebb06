"""The command compare."""

from pathlib import Path

import click

from exfit.cli.options import (
    Output,
    output_options,
    print_json,
    warn,
)
from exfit.errors import ExfitError


@click.command(short_help="Compare two responses, from any program.")
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
@output_options
def compare(
    a: Path,
    b: Path,
    record: Path | None,
    columns: tuple[str, ...],
    time: str | None,
    shift: float,
    step_at: float | None,
    output: Output,
) -> None:
    """Compare the responses A and B, and both with RECORD.

    Each is the folder or the result.json of a fit or a simulation, or a CSV file of any program.
    The signals that A and B have are compared over the time that both cover, on the finer of their
    clocks. Writes compare.json, compare.csv and compare.png to runs/compare, or
    to DIR.
    """
    from exfit.analysis.comparison import ColumnChoice
    from exfit.analysis.comparison import compare as compared
    from exfit.output import run_folder

    folder = output.folder("compare")
    run_folder.refuse_inputs("compare", [a, b, *([record] if record else ())], folder)
    agreement = compared(a, b, record, ColumnChoice(_columns(columns), time), shift, step_at)
    warn(run_folder.write_agreement(agreement, folder, output.figures))
    if output.as_json:
        print_json(agreement.as_json())
    elif output.shown:
        from exfit.output import terminal

        console = terminal.console()
        terminal.agreement(console, agreement)
        terminal.written(console, folder)


def _columns(texts: tuple[str, ...]) -> dict[str, str]:
    """Return the columns of --columns vt=VOLT by signal; raises ExfitError for other text."""
    columns = {}
    for text in texts:
        signal, given, column = (part.strip() for part in text.partition("="))
        if not (signal and given and column):
            raise ExfitError(f"--columns {text}: not of the form vt=VOLT")
        columns[signal] = column
    return columns
