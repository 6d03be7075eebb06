"""The commands check, show, profile and validate, which examine a case or the result of its fit."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli import completion
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import (
    NOT_CONVERGED,
    Output,
    case_argument,
    load,
    output_options,
    parameters_option,
    progress_option,
)
from exfit.cli.streams import echo
from exfit.errors import CaseError, ExfitError
from exfit.registry import parts

if TYPE_CHECKING:
    from exfit.case.case import Case

OTHER_VALUES = "--parameters FILE, or --as-found for the model before any fit"


@click.command(short_help="Check a case before its fit.")
@case_argument
@click.option(
    "--write",
    is_flag=True,
    help="First write sources and std_errors of CASE beside their values; comments stay.",
)
def check(case: Path, write: bool) -> None:
    """Check CASE before a fit: its record, derivatives, bypassed blocks, a run without a step.

    Warns of an inverted channel, another base, a step above 0.2 pu, ripple, a start that is not at
    rest, and a validation window that overlaps a fitted one.

    For a programme it evaluates the steady tests, and checks each fit with their results.
    """
    from exfit import workflows
    from exfit.case.peek import keys_of
    from exfit.output import models, terminal

    if write:
        from exfit.case.rewriting import rewrite

        moved = rewrite(case)
        echo(
            f"{case}: "
            + (f"written beside the values: {'; '.join(moved)}" if moved else "as it was")
        )
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
    help="Print everything, also sensitivities, correlated parameters, step figures and sources.",
)
@click.option(
    "--history",
    is_flag=True,
    help="Print the iterations: cost f, gradient norm, step, damping, Armijo halvings.",
)
def show(result: Path, everything: bool, history: bool) -> None:
    """Print the RESULT of a fit or a validation again, as the run printed it.

    RESULT is the result.json of a fit, the validation.json of a validation, or the folder that
    holds one of them.
    """
    from exfit.output import stored

    stored.show(result, everything, history)


@click.command(short_help="Find the intervals of parameters by their profile likelihood.")
@case_argument
@click.argument(
    "parameters",
    nargs=-1,
    metavar="[PARAM]...",
    shell_complete=completion.free_parameters,
)
@progress_option
@output_options
def profile(case: Path, parameters: tuple[str, ...], output: Output) -> None:
    """Fit CASE, then find the 95 % interval of each PARAM from its profile likelihood.

    Each parameter is moved away from its fitted value, and the others are fitted again, until the
    cost shows that the record rejects the value. Use it where the linear theory of `exfit fit` does
    not apply. Without PARAM all free parameters are profiled. Writes profile.json, profile.csv and
    profile.png to runs/CASE-profile, or to DIR. Ctrl-C keeps the profiles completed.
    """
    from exfit import workflows
    from exfit.output import fits, run_folder

    loaded = load(case)
    folder = output.folder_of(loaded, "profile", run_folder.OF_PROFILES)
    watch = [] if output.events is None else [partial(output.events, case.stem)]
    if output.live:
        from exfit.output import live, terminal

        console = terminal.console()
        with live.ProgressBar(console).running() as progress:
            profiles = workflows.profile(loaded, parameters, progress)
        console.print()
    else:
        profiles = workflows.profile(loaded, parameters, *watch)
    figures = run_folder.write_profiles(profiles, folder)
    output.show(profiles.as_json(), fits.profiles(profiles), folder, figures)
    if profiles.interrupted:
        raise SystemExit(NOT_CONVERGED)


@click.command(short_help="Compare fitted values with records that were not fitted.")
@case_argument
@parameters_option
@click.option(
    "--as-found",
    is_flag=True,
    help="Use the values before any fit: those of the model as found, or else the start values.",
)
@click.option(
    "--record",
    type=GivenFile(Kind.RECORD),
    metavar="FILE",
    help="Record, instead of those under validate; its steps are detected.",
)
@click.option(
    "--step",
    "steps",
    type=float,
    multiple=True,
    metavar="SIZE",
    help="Size of the step of --record, pu, instead of the one detected.",
)
@click.option(
    "--at",
    "instants",
    type=float,
    multiple=True,
    metavar="TIME",
    help="Time of the step of --record, s, instead of the one detected.",
)
@output_options
def validate(
    case: Path,
    parameters: Path | None,
    as_found: bool,
    record: Path | None,
    steps: tuple[float, ...],
    instants: tuple[float, ...],
    output: Output,
) -> None:
    """Compare fitted values with the records of CASE that were not fitted.

    The values are those of the last fit of the case, or of --parameters. With --as-found they are
    those of the model before any fit, and all records of the case are validated; the same holds if
    CASE has no free parameter. The steps of --record are detected and shown; --step -0.05 and
    --at 1.0 replace the sizes and times detected, once for each step. Writes validation.json,
    samples and overlays to runs/CASE-validate, or to DIR; exfit report makes a report of that
    folder. Exit code 1: bad input, no step detected, or no record to validate on; 3: a record
    does not meet the criteria of the case, or a validation is not accepted.
    """
    from exfit import workflows
    from exfit.output import run_folder, validations
    from exfit.output.blocks import paragraph
    from exfit.records.reading import file_hash
    from exfit.util.typed import plain
    from exfit.workflows.given_values import read_parameters, sources_in

    if as_found and parameters is not None:
        raise ExfitError("--as-found and --parameters exclude each other: give one of them")
    loaded, source = (load(case), None) if as_found else _with_source(case, parameters)
    folder = output.folder_of(loaded, "validate", run_folder.OF_VALIDATION, after_records=True)
    if record is not None:
        run_folder.refuse_inputs(run_folder.OF_VALIDATION, [record], folder, [record.stem])
    by_hand = (record, steps, instants)
    if source is None:
        result = workflows.validation_result(loaded, None if as_found else {}, *by_hand)
    else:
        values, sources = read_parameters(loaded, source), sources_in(source)
        result = workflows.validation_result(loaded, values, *by_hand, sources)
        result = replace(
            result,
            origin=f"values of {parameters or 'the last fit'}",
            inputs={**result.inputs, "parameters": file_hash(source)},
            files={**result.files, "parameters": source.name},
        )
    result = replace(result, options=tuple(_options(as_found, parameters, *by_hand)))
    figures = run_folder.write_validation(result, folder)
    content = {"validation": [plain(match) for match in result.matches]}
    blocks = (paragraph(result.origin), *validations.validation(result))
    output.show(content, blocks, folder, figures)
    if not result.accepted:
        raise SystemExit(NOT_CONVERGED)


def _with_source(path: Path, parameters: Path | None) -> tuple["Case", Path | None]:
    """Return a case and the file with its values: its last fit's, None where nothing is free.

    Raises CaseError where it was not fitted.
    """
    from exfit.output import run_folder
    from exfit.workflows.given_values import fitted_code

    source = parameters or run_folder.last_fit(path)
    case = load(path, *(() if source is None else fitted_code(source)))
    if not case.free():
        return case, parameters
    if source is None:
        text = f"this case was not fitted yet: run exfit fit, or give {OTHER_VALUES}"
        raise CaseError(f"{path}: {text}")
    return case, source


def _options(
    as_found: bool,
    parameters: Path | None,
    record: Path | None,
    steps: Sequence[float],
    instants: Sequence[float],
) -> Iterator[str]:
    """Yield the options with which a validation is made again."""
    if as_found:
        yield "--as-found"
    files = (("--parameters", [parameters]), ("--record", [record]))
    for option, given in (*files, ("--step", steps), ("--at", instants)):
        for value in given:
            if value is not None:
                yield from (option, str(value))
