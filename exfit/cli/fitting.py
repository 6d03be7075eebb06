"""The commands fit and check."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.live_fit import fit_again_and_again, fit_live
from exfit.cli.options import (
    NOT_CONVERGED,
    Output,
    case_argument,
    load,
    output_options,
    print_json,
    warn,
)
from exfit.util.strategies import EXPLAINED, STRATEGIES

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.results.model import FitResult


@click.command()
@case_argument
@click.option(
    "--strategy",
    type=click.Choice([*STRATEGIES]),
    help=f"Strategy in place of that of the case. {EXPLAINED}.",
)
@click.option("--watch", is_flag=True, help="Fit again whenever the case or a file of it changes.")
@output_options
def fit(case: Path, strategy: str | None, watch: bool, output: Output) -> None:
    """Fit the free parameters of CASE to its records.

    Writes result.json, parameters.yaml, history.csv, response.csv, iterations.csv and figures to
    runs/CASE-fit, or to DIR. Ctrl-C keeps the best point so far. Exit code 0: converged; 1: bad
    input; 3: not converged, no match at all, or a validation beyond the limit that the case
    accepts.

    With --watch it fits again when CASE, its model file or one of its records changes, and shows
    the former values beside the new ones; a case with a fault waits for the next change. Ctrl-C
    ends that with exit code 0.
    """
    if watch:
        if not output.shown:
            raise click.UsageError("--watch shows every fit: not together with --quiet or --json.")
        fit_again_and_again(case, output.folder(f"{case.stem}-fit"), strategy, output.figures)
        return
    loaded = load(case)
    folder = output.folder_of(loaded, "fit")
    if output.shown:
        result = fit_live(loaded, folder, strategy, output.figures)
    else:
        result = _fit(loaded, folder, strategy, output)
    converged = result.success and not result.interrupted
    if not (converged and result.accepted and result.describes):
        raise SystemExit(NOT_CONVERGED)


def _fit(case: "Case", folder: Path, strategy: str | None, output: Output) -> "FitResult":
    """Fit a case, write its files, and print JSON or nothing."""
    from exfit import workflows
    from exfit.output import run_folder

    result = workflows.fit(case, strategy)
    try:
        warn(run_folder.write_fit(result, folder, output.figures))
    finally:  # whatever becomes of the files
        if output.as_json:
            print_json(result.to_dict())
    return result


@click.command(short_help="Check a case before its fit.")
@case_argument
def check(case: Path) -> None:
    """Check CASE before a fit: derivatives, bypassed blocks, sub-steps, a run without a step."""
    from exfit import workflows
    from exfit.output import terminal

    result = workflows.check(load(case))
    terminal.check(terminal.console(), result)
    if not (result.agrees and result.flat):
        raise SystemExit(NOT_CONVERGED)
