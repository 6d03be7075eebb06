"""The commands check, show and profile, which examine a case or the result of its fit."""

from pathlib import Path

import click

from exfit.cli import completion
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import NOT_CONVERGED, Output, case_argument, load, output_options
from exfit.errors import ExfitError
from exfit.registry import parts


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
    from exfit.show import models, terminal

    keys = keys_of(case)
    for key, checked in parts("CHECKS").items():
        if key in keys:
            if not checked.load()(case):
                raise SystemExit(NOT_CONVERGED)
            return
    result = workflows.check(case)
    terminal.show(terminal.console(), models.check(result))
    if not (result.agrees and result.flat):
        raise SystemExit(NOT_CONVERGED)


@click.command(short_help="Print a stored result again.")
@click.argument("result", type=GivenFile(Kind.RESULT))
@click.option(
    "-a",
    "--all",
    "everything",
    is_flag=True,
    help="Print everything: sensitivities, what moves together, steps, sources, figures.",
)
def show(result: Path, everything: bool) -> None:
    """Print the RESULT of a fit or a validation again, as the run printed it.

    RESULT is the result.json of a fit, the validation.json of a validation, or the folder that
    holds one of them.
    """
    from exfit.results.io import load_result, load_validation, result_file
    from exfit.show import fits, run_folder, terminal, validations
    from exfit.show.blocks import Table, columns, paragraph, row
    from exfit.util.file_names import VALIDATION, WHOLE_PROGRAMME

    console, source = terminal.console(), result_file(result)
    programme = result / WHOLE_PROGRAMME if result.is_dir() else result
    if programme.name == WHOLE_PROGRAMME and programme.is_file():
        raise ExfitError(f"{result}: a programme; `exfit report` makes a page of it")
    validated = source if source.name == VALIDATION else source.with_name(VALIDATION)
    if source == validated or (validated.is_file() and not source.exists()):
        validation = load_validation(validated)
        terminal.show(console, [paragraph(validation.origin)])
        terminal.show(console, validations.validation(validation.matches))
        return
    fit, folder = load_result(source), source.parent
    if not everything:
        terminal.show_shortest(console, fits.briefs(fit, folder))
        return
    figures = tuple(
        row(name, planned.shows)
        for name, planned in run_folder.figures_of_fit(fit).items()
        if (folder / name).is_file()
    )
    if figures:
        terminal.show(console, [Table(columns("figure", "shows"), figures)])
        console.print()
    terminal.show(console, fits.whole(fit, folder))


@click.command(short_help="Find the intervals of parameters by their profile likelihood.")
@case_argument
@click.argument(
    "parameters",
    nargs=-1,
    metavar="[PARAM]...",
    shell_complete=completion.free_parameters,
)
@output_options
def profile(case: Path, parameters: tuple[str, ...], output: Output) -> None:
    """Fit CASE, then find the 95 % interval of each PARAM from its profile likelihood.

    A parameter is moved away from its fitted value and the others are fitted again, until the cost
    shows that the record excludes it. Use it where the linear theory of `exfit fit` does not apply.
    Without PARAM all free parameters are profiled. Writes profile.json, profile.csv and profile.png
    to runs/CASE-profile, or to DIR. Ctrl-C keeps the profiles found so far.
    """
    from exfit import workflows
    from exfit.show import fits, run_folder

    loaded = load(case)
    folder = output.folder_of(loaded, "profile", run_folder.OF_PROFILES)
    if output.shown:
        from exfit.show import live, terminal

        console = terminal.console()
        with live.ProgressBar(console).running() as progress:
            profiles = workflows.profile(loaded, parameters, progress)
        console.print()
    else:
        profiles = workflows.profile(loaded, parameters)
    figures = run_folder.write_profiles(profiles, folder)
    output.show(profiles.as_json(), fits.profiles(profiles), folder, figures)
    if profiles.interrupted:
        raise SystemExit(NOT_CONVERGED)
