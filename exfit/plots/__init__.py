"""Figures of results: functions that return one, and touch nothing else."""

from exfit.plots.agreement import agreement
from exfit.plots.iterations import iterations
from exfit.plots.knowledge import correlation, profiles, sensitivity
from exfit.plots.overlays import overlay
from exfit.plots.records import inspection
from exfit.plots.responses import overview, response
from exfit.plots.search import convergence, trajectories, waterfall
from exfit.plots.style import png

__all__ = [
    "agreement",
    "convergence",
    "correlation",
    "inspection",
    "iterations",
    "overlay",
    "overview",
    "png",
    "profiles",
    "response",
    "sensitivity",
    "trajectories",
    "waterfall",
]
