"""The commands profile and identify."""

from pathlib import Path

import click

from exfit.cli import completion
from exfit.cli.options import (
    NOT_CONVERGED,
    Output,
    assignments,
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
    from exfit.output import run_folder

    loaded = load(case)
    folder = output.folder_of(loaded, "profile")
    if not output.shown:
        profiles = workflows.profile(loaded, parameters)
    else:
        from exfit.output import terminal

        console = terminal.console()
        with terminal.ProgressBar(console).running() as progress:
            profiles = workflows.profile(loaded, parameters, progress)
    figures = run_folder.write_profiles(profiles, folder)
    if output.as_json:
        print_json(profiles.as_json())
    elif output.shown:
        terminal.profiles(console, profiles)
        terminal.written(console, folder)
    output.draw(figures)
    if profiles.interrupted:
        raise SystemExit(NOT_CONVERGED)


@click.command(short_help="Predict how well a planned test determines the parameters.")
@case_argument
@click.option(
    "--noise",
    multiple=True,
    metavar="vt=1e-4",
    help="Noise of a signal, pu; may be repeated.",
    shell_complete=completion.noises,
)
@output_options
def identify(
    case: Path,
    noise: tuple[str, ...],
    output: Output,
) -> None:
    """Predict which free parameters of CASE a test determines, and how well; it needs no record.

    Compared at the start values are the test of CASE, steps of 2, 5 and 10 %, a test twice as long,
    and further channels; the parameters are ranked by what 1 % of each does to the response. Writes
    identify.json, sensitivities.csv and figures to runs/CASE-identify, or to DIR.
    """
    from exfit import workflows
    from exfit.output import run_folder

    loaded = load(case)
    folder = output.folder_of(loaded, "identify")
    design = workflows.identify(loaded, assignments(noise, "--noise"))
    figures = run_folder.write_design(design, folder)
    if output.as_json:
        print_json(design.as_json())
    elif output.shown:
        from exfit.output import terminal

        console = terminal.console()
        terminal.design(console, design)
        terminal.written(console, folder)
    output.draw(figures)
