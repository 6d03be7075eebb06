"""What the terminal shows: tables and lines, with rich."""

from exfit.show.agreement import agreement
from exfit.show.checks import check
from exfit.show.fits import fit
from exfit.show.knowledge import design, profiles
from exfit.show.matches import comparisons
from exfit.show.progress import Bar, Watch, task
from exfit.show.records import inspection
from exfit.show.sheets import catalogue, machine, model
from exfit.show.terminal import again, console, notes, waiting, written

__all__ = [
    "Bar",
    "Watch",
    "again",
    "agreement",
    "catalogue",
    "check",
    "comparisons",
    "console",
    "design",
    "fit",
    "inspection",
    "machine",
    "model",
    "notes",
    "profiles",
    "task",
    "waiting",
    "written",
]
