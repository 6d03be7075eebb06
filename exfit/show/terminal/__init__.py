"""What the terminal shows: blocks, and searches while they run, with rich.

Each name is imported from its module when it is first used: a command loads what it shows.
"""

from typing import TYPE_CHECKING

from exfit.util.lazy import names_of

if TYPE_CHECKING:
    from exfit.show.terminal.progress import LiveIterations, ProgressBar, task
    from exfit.show.terminal.render import show, show_shortest
    from exfit.show.terminal.series import SeriesProgress
    from exfit.show.terminal.terminal import (
        again,
        console,
        figure,
        figures_of_fit,
        waiting,
        written,
    )

__all__ = [
    "LiveIterations",
    "ProgressBar",
    "SeriesProgress",
    "again",
    "console",
    "figure",
    "figures_of_fit",
    "show",
    "show_shortest",
    "task",
    "waiting",
    "written",
]

_MODULES = {
    **dict.fromkeys(("LiveIterations", "ProgressBar", "task"), "exfit.show.terminal.progress"),
    **dict.fromkeys(("show", "show_shortest"), "exfit.show.terminal.render"),
    "SeriesProgress": "exfit.show.terminal.series",
    **dict.fromkeys(
        ("again", "console", "figure", "figures_of_fit", "waiting", "written"),
        "exfit.show.terminal.terminal",
    ),
}

__getattr__ = names_of(__name__, _MODULES)
