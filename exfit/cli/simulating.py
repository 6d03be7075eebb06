"""The command simulate."""

from pathlib import Path

import click

from exfit.cli.options import (
    Output,
    assignments,
    case_argument,
    file_options,
    load,
    parameters_option,
    set_option,
)


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
    from exfit.output import run_folder

    code: tuple[str, ...] = ()
    if parameters is not None:
        from exfit.workflows.given_values import fitted_code, read_parameters

        code = fitted_code(parameters)
    loaded, values = load(case, *code), dict[str, float]()
    folder = output.folder_of(loaded, "simulate", run_folder.OF_SIMULATION)
    if parameters is not None:
        values = read_parameters(loaded, parameters)
    if changes:
        from exfit.workflows.given_values import changed_values

        values |= changed_values(loaded, assignments(changes, "--set"), "--set")
    simulation = workflows.simulate(loaded, values)
    figures = run_folder.write_simulation(simulation, case.stem, folder)
    if output.shown:
        from exfit.output import terminal, validations
        from exfit.output.blocks import notes, paragraph

        console, compared = terminal.console(), simulation.comparison
        if compared is not None:
            terminal.show(console, validations.comparisons([compared]))
        substeps = paragraph(f"sub-steps: {simulation.response.substeps}")
        terminal.show(console, [substeps, *notes(simulation.notes)])
        terminal.written(console, folder)
    output.draw(figures)
