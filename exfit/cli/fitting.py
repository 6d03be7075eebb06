"""The commands fit, simulate, validate and check."""

from pathlib import Path

import click

from exfit.cli import completion
from exfit.cli.options import (
    NOT_CONVERGED,
    assignments,
    case_argument,
    folder_of,
    json_option,
    load,
    output_option,
    parameters_option,
    plots_option,
    print_json,
    quiet_option,
    warn,
)
from exfit.cli.watched import fit_again_and_again, fit_in_sight
from exfit.util.strategies import EXPLAINED, STRATEGIES


@click.command()
@case_argument
@output_option
@click.option(
    "--strategy",
    type=click.Choice([*STRATEGIES]),
    help=f"In place of the case's own. {EXPLAINED}.",
)
@plots_option
@click.option("--watch", is_flag=True, help="Fit again whenever the case or a file of it changes.")
@quiet_option
@json_option
def fit(
    case: Path,
    output: Path | None,
    strategy: str | None,
    plots: bool,
    watch: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Fit the free parameters of CASE to its record.

    Writes result.json, parameters.yaml, history.csv, response.csv, iterations.csv and figures to
    runs/CASE-fit, or to DIR. Ctrl-C keeps the best point so far. Exit code 0: converged; 1: bad
    input; 3: not converged, no match at all, or a validation beyond the limit that the case
    accepts.

    With --watch it fits again when CASE, its model file or one of its records changes, and shows
    the values of the fit before beside the new ones; a case with a fault waits for the next change.
    Ctrl-C ends that with exit code 0.
    """
    if watch:
        if quiet or as_json:
            raise click.UsageError("--watch shows every fit: not together with --quiet or --json.")
        fit_again_and_again(case, output or folder_of(case, "fit"), strategy, plots)
        return
    from exfit import workflows
    from exfit.output import run_folder

    loaded = load(case)
    folder = output or folder_of(case, "fit")
    run_folder.refuse_unwritable(folder)
    if quiet or as_json:
        result = workflows.fit(loaded, strategy)
        try:
            warn(run_folder.write_fit(result, folder, plots))
        finally:  # whatever becomes of the files
            if as_json:
                print_json(result.as_json())
    else:
        result = fit_in_sight(loaded, folder, strategy, plots)
    done = result.success and not result.interrupted
    if not (done and result.accepted and result.describes):
        raise SystemExit(NOT_CONVERGED)


@click.command()
@case_argument
@click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KA=400",
    help="Value of a parameter.",
    shell_complete=completion.assigned_parameters,
)
@parameters_option
@output_option
@plots_option
@quiet_option
def simulate(
    case: Path,
    changes: tuple[str, ...],
    parameters: Path | None,
    output: Path | None,
    plots: bool,
    quiet: bool,
) -> None:
    """Simulate CASE at its start values.

    Writes response.csv (t, vref, vt, efd, ifd and the states) and figures to runs/CASE-simulate, or
    to DIR. --set goes over --parameters, and both over the case; a parameter of the machine is
    named as in --set machine.Tpd0=6.
    """
    from exfit import workflows
    from exfit.fitting.overrides import changed_values, read_parameters
    from exfit.output import run_folder

    loaded = load(case)
    folder = output or folder_of(case, "simulate")
    run_folder.refuse_unwritable(folder)
    values = read_parameters(loaded, parameters) if parameters else {}
    values |= changed_values(loaded, assignments(changes, "--set"), "--set")
    simulation = workflows.simulate(loaded, values)
    warn(run_folder.write_simulation(simulation, case.stem, folder, plots))
    if not quiet:
        from exfit.output import terminal

        console = terminal.console()
        if simulation.comparison is not None:
            terminal.comparisons(console, [simulation.comparison])
        console.print(f"sub-steps {simulation.response.substeps}")
        terminal.notes(console, simulation.notes)
        terminal.written(console, folder)


@click.command(short_help="Compare fitted values with records that no fit saw.")
@case_argument
@parameters_option
@click.option(
    "--record",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Record in place of the first that the case validates on.",
)
@output_option
@plots_option
@quiet_option
@json_option
def validate(
    case: Path,
    parameters: Path | None,
    record: Path | None,
    output: Path | None,
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Compare fitted values with the records of CASE that the fit never saw.

    The values are those of the last fit of the case, or of --parameters. Writes validation.json,
    samples and overlays to runs/CASE-validate, or to DIR.
    """
    from exfit import workflows
    from exfit.fitting.overrides import read_parameters
    from exfit.output import run_folder

    loaded = load(case)
    folder = output or folder_of(case, "validate")
    run_folder.refuse_unwritable(folder)
    source = parameters or run_folder.last_fit(case)
    found = workflows.validate(loaded, read_parameters(loaded, source), record)
    warn(run_folder.write_validation(found, folder, plots))
    if as_json:
        print_json({"validation": [one.as_json() for one in found]})
    elif not quiet:
        from exfit.output import terminal

        console = terminal.console()
        console.print(f"values of {parameters or 'the last fit'}", soft_wrap=True, markup=False)
        terminal.comparisons(console, found)
        console.print()
        terminal.written(console, folder)
    if not all(one.accepted for one in found):
        raise SystemExit(NOT_CONVERGED)


@click.command(short_help="Check a case before its fit.")
@case_argument
def check(case: Path) -> None:
    """Check CASE before a fit: derivatives, bypasses, sub-steps, a flat run."""
    from exfit import workflows
    from exfit.output import terminal

    found = workflows.check(load(case))
    terminal.check(terminal.console(), found)
    if not (found.agrees and found.flat):
        raise SystemExit(NOT_CONVERGED)
