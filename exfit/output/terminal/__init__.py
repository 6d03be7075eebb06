"""What the terminal shows: tables and lines, with rich."""

from exfit.output.terminal.agreement import agreement
from exfit.output.terminal.batch import BatchProgress, batch
from exfit.output.terminal.catalogue import catalogue, model
from exfit.output.terminal.checks import check
from exfit.output.terminal.comparisons import comparisons, validation
from exfit.output.terminal.designed_test import designed_test
from exfit.output.terminal.fit_series import SeriesProgress, fit_series
from exfit.output.terminal.fits import fit
from exfit.output.terminal.programme import ProgrammeProgress, checked_step, programme
from exfit.output.terminal.progress import LiveIterations, ProgressBar, task
from exfit.output.terminal.ranking import ranking
from exfit.output.terminal.records import inspection
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
