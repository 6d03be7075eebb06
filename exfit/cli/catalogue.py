"""The commands models and schema."""

from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli import completion
from exfit.cli.options import ANY_PATH, print_json
from exfit.errors import ExfitError

if TYPE_CHECKING:
    from exfit.models.machines import Machine
    from exfit.models.sheet import Model


@click.command(short_help="List the models, or describe one.")
@click.argument("name", required=False, shell_complete=completion.models)
@click.option(
    "--plot",
    "folder",
    type=ANY_PATH,
    metavar="DIR",
    help="Write a page with the block diagram and a figure of NAME, or of every model.",
)
def models(name: str | None, folder: Path | None) -> None:
    """List the models, or print the block diagram, data sheet and states of one."""
    from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, MODELS, STABILISERS
    from exfit.models.machines import MACHINES
    from exfit.output import models as shown
    from exfit.output import terminal

    exciters, machines = MODELS.values(), MACHINES.values()
    added = {
        "stabiliser": STABILISERS.values(),
        "governor": GOVERNORS.values(),
        "load controller": LOAD_CONTROLLERS.values(),
        "limiter": LIMITERS.values(),
    }
    every: Iterable[Model | Machine] = chain(exciters, machines, *added.values())
    if folder is not None:
        from exfit.output import run_folder
        from exfit.registry import parts

        overview = parts("PICTURES").get("overview")
        if overview is None:
            raise ExfitError("--plot: exfit has no feature here that draws models")
        run_folder.refuse_unwritable(folder)
        overview.load()(folder, [_model(name)] if name else every)
        terminal.written(terminal.console(), folder)
    elif name is None:
        terminal.show(terminal.console(), shown.catalogue(exciters, machines, added))
    else:
        terminal.show(terminal.console(), shown.model(_model(name)))


def _model(name: str) -> "Model | Machine":
    """Return a model of the catalogue by its name, else the exciter in a file."""
    from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, STABILISERS, find
    from exfit.models.machines import MACHINES

    added = (STABILISERS, GOVERNORS, LOAD_CONTROLLERS, LIMITERS)
    shelves: tuple[Mapping[str, Model | Machine], ...] = (*added, MACHINES)
    listed = (shelf[name.upper()] for shelf in shelves if name.upper() in shelf)
    return next(listed, None) or find(name, Path())


@click.command(short_help="Print the JSON Schema of a case file.")
def schema() -> None:
    """Print the JSON Schema of a case file, with which editors complete and check it."""
    from exfit.case.json_schema import json_schema

    print_json(json_schema())
