"""The command profile."""

from pathlib import Path

import click

from exfit.cli import completion
from exfit.cli.options import (
    NOT_CONVERGED,
    Output,
    case_argument,
    load,
    output_options,
    print_json,
)


@click.command(short_help="Find the intervals of parameters by their profile likelihood.")
@case_argument
@click.argument(
    "parameters",
    nargs=-1,
    metavar="[PARAM]...",
    shell_complete=completion.free_parameters,
)
@output_options
def profile(
    case: Path,
    parameters: tuple[str, ...],
    output: Output,
) -> None:
    """Fit CASE, then find the 95 % interval of each PARAM from its profile likelihood.

    A parameter is moved away from its fitted value and the others are fitted again, until the cost
    shows that the record excludes it. Use it where the linear theory of `exfit fit` does not apply.
    Without PARAM all free parameters are profiled. Writes profile.json, profile.csv and profile.png
    to runs/CASE-profile, or to DIR. Ctrl-C keeps the profiles found so far.
    """
    from exfit import workflows
    from exfit.show import run_folder

    loaded = load(case)
    folder = output.folder_of(loaded, "profile", run_folder.OF_PROFILES)
    if not output.shown:
        profiles = workflows.profile(loaded, parameters)
    else:
        from exfit.show import live, terminal

        console = terminal.console()
        with live.ProgressBar(console).running() as progress:
            profiles = workflows.profile(loaded, parameters, progress)
    figures = run_folder.write_profiles(profiles, folder)
    if output.as_json:
        print_json(profiles.as_json())
    elif output.shown:
        from exfit.show import fits

        console.print()
        terminal.show(console, fits.profiles(profiles))
        terminal.written(console, folder)
    output.draw(figures)
    if profiles.interrupted:
        raise SystemExit(NOT_CONVERGED)
