"""Figures of results: functions that return one, and touch nothing else."""

from exfit.show.figures.fit_series import fit_series
from exfit.show.figures.iterations import iterations
from exfit.show.figures.overlays import overlay, overlays
from exfit.show.figures.records import inspection
from exfit.show.figures.responses import overview, response
from exfit.show.figures.search import convergence, trajectories, waterfall
from exfit.show.figures.style import drawn, encoded, png
from exfit.show.figures.uncertainty import correlation, profiles, sensitivity

__all__ = [
    "convergence",
    "correlation",
    "drawn",
    "encoded",
    "fit_series",
    "inspection",
    "iterations",
    "overlay",
    "overlays",
    "overview",
    "png",
    "profiles",
    "response",
    "sensitivity",
    "trajectories",
    "waterfall",
]
