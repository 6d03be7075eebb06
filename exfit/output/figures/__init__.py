"""Figures of results: functions that return one, and touch nothing else."""

from exfit.output.figures.responses import (
    fit_series,
    inspection,
    overlay,
    overlays,
    overview,
    response,
)
from exfit.output.figures.search import (
    convergence,
    correlation,
    iterations,
    profiles,
    sensitivity,
    trajectories,
    waterfall,
)
from exfit.output.figures.style import drawn, encoded, png

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
