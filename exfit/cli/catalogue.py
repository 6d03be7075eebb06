"""The commands models and schema."""

from pathlib import Path

import click

from exfit.cli import completion
from exfit.cli.options import print_json


@click.command(short_help="List the models, or describe one.")
@click.argument("name", required=False, shell_complete=completion.models)
@click.option(
    "--plot",
    "folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write a page with a figure of every model.",
)
def models(name: str | None, folder: Path | None) -> None:
    """List the models, or print the drawing, data sheet and states of one."""
    from exfit.models import MODELS, STABILISERS, find
    from exfit.models.machines import MACHINES
    from exfit.output import terminal

    if folder is not None:
        from exfit.output import run_folder
        from exfit.output.catalogue_page import write_overview

        run_folder.refuse_unwritable(folder)
        write_overview(folder)
        terminal.written(terminal.console(), folder)
    elif name is None:
        terminal.catalogue(
            terminal.console(), MODELS.values(), MACHINES.values(), STABILISERS.values()
        )
    elif name.upper() in STABILISERS:
        terminal.model(terminal.console(), STABILISERS[name.upper()])
    elif name.upper() in MACHINES:
        terminal.machine(terminal.console(), MACHINES[name.upper()])
    else:
        terminal.model(terminal.console(), find(name, Path()))


@click.command(short_help="Print the JSON Schema of a case file.")
def schema() -> None:
    """Print the JSON Schema of a case file, for editors that complete and check."""
    from exfit.case.json_schema import json_schema

    print_json(json_schema())
