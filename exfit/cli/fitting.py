"""The commands fit and check."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.options import (
    NOT_CONVERGED,
    Given,
    Output,
    case_argument,
    cases_argument,
    output_options,
    parameters_option,
    print_json,
    set_option,
)
from exfit.cli.streams import echo
from exfit.registry import parts
from exfit.util.strategies import EXPLAINED, SEARCHES, SEARCHES_EXPLAINED, STRATEGIES

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.results.model import FitResult


@click.command()
@cases_argument
@click.option(
    "--strategy",
    "strategies",
    type=click.Choice([*STRATEGIES]),
    multiple=True,
    help=f"Strategy in place of that of the case; may be repeated. {EXPLAINED}.",
)
@click.option(
    "--search",
    type=click.Choice([*SEARCHES]),
    help=f"How far to search, in place of what the case says. {SEARCHES_EXPLAINED}.",
)
@set_option
@parameters_option
@click.option("--watch", is_flag=True, help="Fit again whenever the case or a file of it changes.")
@click.option("-v", "--verbose", is_flag=True, help="Print all of the result, as exfit show --all.")
@output_options
def fit(
    cases: tuple[Path, ...],
    strategies: tuple[str, ...],
    search: str | None,
    changes: tuple[str, ...],
    parameters: Path | None,
    watch: bool,
    verbose: bool,
    output: Output,
) -> None:
    """Fit the free parameters of each CASE to its records.

    By default the search is global: further descents, from points distributed over the bounds,
    look for a lower minimum than the one that the start of CASE leads to.

    Writes result.json, parameters.yaml, history.csv, response.csv, iterations.csv and figures to
    runs/CASE-fit, or to DIR. Ctrl-C keeps the best point so far.

    The last line of the result is the verdict: good | matches, not all determined | misses the
    record | no match | not converged. The likeliest causes stand above it, at most five, each with
    what to do. What else the fit shows stands in the report, and is printed with --verbose or later
    by exfit show. Exit code 0: the first two verdicts; 1: bad input; 3: the others, or a validation
    that is not accepted: beyond the limit of accept in the case, without it no better than a
    constant or beyond 3 times the error of the fit.

    --set overrides --parameters, and both override the case: they give the start of a free
    parameter, and the value of another. The result says which values they changed.

    Several cases, or several strategies, are all checked first, then fitted one after the other,
    every case with every strategy: each fit has a folder CASE-STRATEGY in runs/fits, or in DIR,
    and fits.csv, fits.json and fits.png there show them side by side. Several strategies are
    compared by the descent from the start of each case alone, unless --search or the case says how
    far to search. Ctrl-C ends them and keeps what is done. Exit code 3: not all are done and well.

    With --watch it fits again when CASE, its model file, one of its records or the file of
    --parameters changes, and shows the former values beside the new ones; a case with a fault
    waits for the next change. Ctrl-C ends that with exit code 0.
    """
    from exfit.cli.live_fit import fit_again_and_again, fit_live
    from exfit.cli.several_fits import fit_several
    from exfit.show import run_folder

    given = Given(parameters, changes)
    several = len(cases) > 1 or len(strategies) > 1
    if verbose and (several or not output.shown):
        raise click.UsageError("--verbose shows one fit: not with several, --quiet or --json.")
    if watch and several:
        raise click.UsageError("--watch fits one case with one strategy.")
    if several:
        fit_several(cases, given, strategies, search, output)
        return
    (case,), strategy = cases, strategies[0] if strategies else None
    if watch:
        if not output.shown:
            raise click.UsageError("--watch shows every fit: not together with --quiet or --json.")
        folder = output.folder(f"{case.stem}-fit", run_folder.OF_FIT)
        fit_again_and_again(case, given, folder, strategy, search, output, verbose)
        return
    from exfit.verdict.causes.before_fit import case_warnings, event_warnings

    loaded = given.load(case)
    for warning in (*case_warnings(loaded), *event_warnings(loaded)):
        echo(f"warning: {warning}", err=True)
    folder = output.folder_of(loaded, "fit", run_folder.OF_FIT, after_records=True)
    if output.shown:
        result = fit_live(loaded, folder, strategy, search, output, verbose)
    else:
        result = _fit(loaded, folder, strategy, search, output)
    if not result.holds:
        raise SystemExit(NOT_CONVERGED)


def _fit(
    case: "Case", folder: Path, strategy: str | None, search: str | None, output: Output
) -> "FitResult":
    """Fit a case, write its files, and print JSON or nothing."""
    from exfit import workflows
    from exfit.show import run_folder

    result = workflows.fit(case, strategy, search=search)
    try:
        figures = run_folder.write_fit(result, folder)
    finally:  # whatever becomes of the files
        if output.as_json:
            print_json(result.to_dict())
    output.draw(figures)
    return result


@click.command(short_help="Check a case before its fit.")
@case_argument
def check(case: Path) -> None:
    """Check CASE before a fit: its record, derivatives, bypassed blocks, a run without a step.

    Warns of an inverted channel, another base, a step that no regulator is tested with, ripple, a
    start that is not at rest, and of a validation that sees what is fitted.

    Of a programme it runs the tests at rest, which takes no time, and checks each fit with what
    they give.
    """
    from exfit import workflows
    from exfit.case.peek import keys_of
    from exfit.show import checks, terminal

    keys = keys_of(case)
    for key, checked in parts("CHECKS").items():
        if key in keys:
            if not checked.load()(case):
                raise SystemExit(NOT_CONVERGED)
            return
    result = workflows.check(case)
    terminal.show(terminal.console(), checks.check(result))
    if not (result.agrees and result.flat):
        raise SystemExit(NOT_CONVERGED)
