"""The commands simulate and validate."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import (
    NOT_CONVERGED,
    Output,
    assignments,
    case_argument,
    file_options,
    load,
    output_options,
    parameters_option,
    set_option,
)
from exfit.errors import CaseError, ExfitError

if TYPE_CHECKING:
    from exfit.case.case import Case


OTHER_VALUES = "--parameters FILE, or --as-found for the model before any fit"


@click.command()
@case_argument
@set_option
@parameters_option
@file_options
def simulate(
    case: Path,
    changes: tuple[str, ...],
    parameters: Path | None,
    output: Output,
) -> None:
    """Simulate CASE at its start values.

    Writes response.csv (every sample of t, vref, vt, efd, ifd and the states) and figures to
    runs/CASE-simulate, or to DIR. --set overrides --parameters, and both override the case; a
    parameter of the machine is named as in --set machine.Tpd0=6.
    """
    from exfit import workflows
    from exfit.show import run_folder
    from exfit.workflows.given_values import changed_values, fitted_code, read_parameters

    loaded = load(case, *(fitted_code(parameters) if parameters else ()))
    folder = output.folder_of(loaded, "simulate", run_folder.OF_SIMULATION)
    values = read_parameters(loaded, parameters) if parameters else {}
    values |= changed_values(loaded, assignments(changes, "--set"), "--set")
    simulation = workflows.simulate(loaded, values)
    figures = run_folder.write_simulation(simulation, case.stem, folder)
    if output.shown:
        from exfit.show import terminal, validations
        from exfit.show.blocks import notes, paragraph

        console, compared = terminal.console(), simulation.comparison
        if compared is not None:
            terminal.show(console, validations.comparisons([compared]))
        substeps = paragraph(f"sub-steps: {simulation.response.substeps}")
        terminal.show(console, [substeps, *notes(simulation.notes)])
        terminal.written(console, folder)
    output.draw(figures)


@click.command(short_help="Compare fitted values with records that were not fitted.")
@case_argument
@parameters_option
@click.option(
    "--as-found",
    is_flag=True,
    help="Values before any fit: of the model as found, or else the start values.",
)
@click.option(
    "--record",
    type=GivenFile(Kind.RECORD),
    metavar="FILE",
    help="Record in place of those under validate; its steps are found in it.",
)
@click.option(
    "--step",
    "steps",
    type=float,
    multiple=True,
    metavar="SIZE",
    help="Size of the step of --record, pu, in place of the one found.",
)
@click.option(
    "--at",
    "instants",
    type=float,
    multiple=True,
    metavar="INSTANT",
    help="Instant of the step of --record, s, in place of the one found.",
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
    those of a planner's model as it is, and where nothing is free in CASE its own: all records of
    the case are validated then. The steps of --record are
    found in it and shown; --step -0.05 and --at 1.0 replace what is found, each of several steps
    has its own. Writes validation.json, samples and overlays to runs/CASE-validate, or to DIR;
    exfit report makes a report of that folder.
    Exit code 1: bad input, no step found, or no record to validate on; 3: a validation is not
    accepted.
    """
    from exfit import workflows
    from exfit.records.reading import file_hash
    from exfit.show import run_folder, validations
    from exfit.show.blocks import paragraph
    from exfit.util.typed import plain
    from exfit.workflows.given_values import read_parameters, sources_in

    if as_found and parameters is not None:
        raise ExfitError("--as-found and --parameters: only one of them says whose values they are")
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
    blocks = (paragraph(result.origin), *validations.validation(result.matches))
    output.show(content, blocks, folder, figures)
    if not result.accepted:
        raise SystemExit(NOT_CONVERGED)


def _with_source(path: Path, parameters: Path | None) -> tuple["Case", Path | None]:
    """Return a case and the file with its values: its last fit's, None where nothing is free.

    Raises CaseError where it was not fitted.
    """
    from exfit.show import run_folder
    from exfit.workflows.given_values import fitted_code

    source = parameters or run_folder.last_fit(path)
    case = load(path, *(() if source is None else fitted_code(source)))
    if not case.free():
        return case, parameters
    if source is None:
        text = f"no earlier fit of this case; run exfit fit, or give {OTHER_VALUES}"
        raise CaseError([f"{path}: {text}"])
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
        for value in filter(lambda one: one is not None, given):
            yield from (option, str(value))
