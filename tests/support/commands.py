"""What a command leaves when it is run as the shell does."""

from typing import NamedTuple


class Ran(NamedTuple):
    """The exit code of a command, and what it printed."""

    code: int
    out: str
    err: str
