"""What the terminal shows: tables and lines, with rich.

Each name is imported from its module when it is first used: a command loads what it shows.
"""

from typing import TYPE_CHECKING

from exfit.util.lazy import names_of

if TYPE_CHECKING:
    from exfit.output.terminal.agreements import agreement
    from exfit.output.terminal.batches import BatchProgress, batch
    from exfit.output.terminal.checks import check
    from exfit.output.terminal.designed_tests import designed_test
    from exfit.output.terminal.fits import fit
    from exfit.output.terminal.model_tables import catalogue, model
    from exfit.output.terminal.programmes import ProgrammeProgress, checked_step, programme
    from exfit.output.terminal.progress import LiveIterations, ProgressBar, task
    from exfit.output.terminal.rankings import ranking
    from exfit.output.terminal.records import inspection
    from exfit.output.terminal.series import SeriesProgress, fit_series
    from exfit.output.terminal.terminal import (
        again,
        console,
        figure,
        figures_of_fit,
        notes,
        waiting,
        written,
    )
    from exfit.output.terminal.translations import translation
    from exfit.output.terminal.uncertainty import design, profiles
    from exfit.output.terminal.validations import comparisons, validation

__all__ = [
    "BatchProgress",
    "LiveIterations",
    "ProgrammeProgress",
    "ProgressBar",
    "SeriesProgress",
    "again",
    "agreement",
    "batch",
    "catalogue",
    "check",
    "checked_step",
    "comparisons",
    "console",
    "design",
    "designed_test",
    "figure",
    "figures_of_fit",
    "fit",
    "fit_series",
    "inspection",
    "model",
    "notes",
    "profiles",
    "programme",
    "ranking",
    "task",
    "translation",
    "validation",
    "waiting",
    "written",
]

_MODULES = {
    "agreements": "agreement",
    "batches": "BatchProgress batch",
    "model_tables": "catalogue model",
    "checks": "check",
    "validations": "comparisons validation",
    "designed_tests": "designed_test",
    "series": "SeriesProgress fit_series",
    "fits": "fit",
    "programmes": "ProgrammeProgress checked_step programme",
    "progress": "LiveIterations ProgressBar task",
    "rankings": "ranking",
    "records": "inspection",
    "terminal": "again console figure figures_of_fit notes waiting written",
    "translations": "translation",
    "uncertainty": "design profiles",
}

__getattr__ = names_of(
    __name__,
    {name: f"{__name__}.{module}" for module, names in _MODULES.items() for name in names.split()},
)
