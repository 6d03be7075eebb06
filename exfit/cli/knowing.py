"""The commands profile and identify."""

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
    plots_option,
    print_json,
    quiet_option,
    warn,
)


@click.command(short_help="Show how far each parameter can move with the others following.")
@case_argument
@click.argument(
    "parameters",
    nargs=-1,
    metavar="[PARAM]...",
    shell_complete=completion.free_parameters,
)
@output_option
@plots_option
@quiet_option
@json_option
def profile(
    case: Path,
    parameters: tuple[str, ...],
    output: Path | None,
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Fit CASE, then find the 95 % interval of each PARAM from its profile likelihood.

    A parameter moves away from its fitted value, and the others are fitted anew, until the cost
    shows that the record refutes it. This serves where the linear theory of `exfit fit` does not.
    Without PARAM all free parameters are profiled. Writes profile.json, profile.csv and profile.png
    to runs/CASE-profile, or to DIR. Ctrl-C keeps what is done.
    """
    from exfit import workflows
    from exfit.output import run_folder

    loaded = load(case)
    folder = output or folder_of(case, "profile")
    run_folder.refuse_unwritable(folder)
    if quiet or as_json:
        found = workflows.profile(loaded, parameters)
    else:
        from exfit.output import terminal

        console = terminal.console()
        with terminal.Bar(console).running() as watch:
            found = workflows.profile(loaded, parameters, watch)
    warn(run_folder.write_profiles(found, folder, plots))
    if as_json:
        print_json(found.as_json())
    elif not quiet:
        terminal.profiles(console, found)
        terminal.written(console, folder)
    if found.interrupted:
        raise SystemExit(NOT_CONVERGED)


@click.command(short_help="Show what a planned test would tell of the parameters.")
@case_argument
@click.option(
    "--noise",
    multiple=True,
    metavar="vt=1e-4",
    help="Noise of a signal, pu; may be repeated.",
    shell_complete=completion.noises,
)
@output_option
@plots_option
@quiet_option
@json_option
def identify(
    case: Path,
    noise: tuple[str, ...],
    output: Path | None,
    plots: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Show which free parameters of CASE a test would determine, and how well; no record is needed.

    At the start values: the test of CASE, steps of 2, 5 and 10 %, a test twice as long, further
    channels. Writes identify.json and figures to runs/CASE-identify, or to DIR.
    """
    from exfit import workflows
    from exfit.output import run_folder

    loaded = load(case)
    folder = output or folder_of(case, "identify")
    run_folder.refuse_unwritable(folder)
    found = workflows.identify(loaded, assignments(noise, "--noise"))
    warn(run_folder.write_design(found, folder, plots))
    if as_json:
        print_json(found.as_json())
    elif not quiet:
        from exfit.output import terminal

        console = terminal.console()
        terminal.design(console, found)
        terminal.written(console, folder)
