"""The commands, and what one leaves when it is run as the shell does."""

from typing import NamedTuple

from exfit.cli import main

COMMANDS = {name: main.get_command(None, name) for name in main.list_commands(None)}
ENDING = COMMANDS.keys() - {"app"}  # of themselves: a page is served until someone ends it


class Ran(NamedTuple):
    """The exit code of a command, and what it printed."""

    code: int
    out: str
    err: str
