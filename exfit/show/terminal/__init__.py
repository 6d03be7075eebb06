"""What the terminal shows: tables and lines, with rich.

Each name is imported from its module when it is first used: a command loads what it shows.
"""

from typing import TYPE_CHECKING

from exfit.util.lazy import names_of

if TYPE_CHECKING:
    from exfit.show.terminal.checks import check
    from exfit.show.terminal.fits import fit
    from exfit.show.terminal.model_tables import catalogue, model
    from exfit.show.terminal.progress import LiveIterations, ProgressBar, task
    from exfit.show.terminal.records import inspection
    from exfit.show.terminal.series import SeriesProgress, fit_series
    from exfit.show.terminal.terminal import (
        again,
        console,
        figure,
        figures_of_fit,
        notes,
        waiting,
        written,
    )
    from exfit.show.terminal.uncertainty import profiles
    from exfit.show.terminal.validations import comparisons, validation

__all__ = [
    "LiveIterations",
    "ProgressBar",
    "SeriesProgress",
    "again",
    "catalogue",
    "check",
    "comparisons",
    "console",
    "figure",
    "figures_of_fit",
    "fit",
    "fit_series",
    "inspection",
    "model",
    "notes",
    "profiles",
    "task",
    "validation",
    "waiting",
    "written",
]

_MODULES = {
    "check": "exfit.show.terminal.checks",
    "fit": "exfit.show.terminal.fits",
    "catalogue": "exfit.show.terminal.model_tables",
    "model": "exfit.show.terminal.model_tables",
    "LiveIterations": "exfit.show.terminal.progress",
    "ProgressBar": "exfit.show.terminal.progress",
    "task": "exfit.show.terminal.progress",
    "inspection": "exfit.show.terminal.records",
    "SeriesProgress": "exfit.show.terminal.series",
    "fit_series": "exfit.show.terminal.series",
    "profiles": "exfit.show.terminal.uncertainty",
    "comparisons": "exfit.show.terminal.validations",
    "validation": "exfit.show.terminal.validations",
    "again": "exfit.show.terminal.terminal",
    "console": "exfit.show.terminal.terminal",
    "figure": "exfit.show.terminal.terminal",
    "figures_of_fit": "exfit.show.terminal.terminal",
    "notes": "exfit.show.terminal.terminal",
    "waiting": "exfit.show.terminal.terminal",
    "written": "exfit.show.terminal.terminal",
}

__getattr__ = names_of(__name__, _MODULES)
