"""Figures of results: functions that return one, and touch nothing else."""

from exfit.output.plots.agreement import agreement
from exfit.output.plots.designed_test import designed_test
from exfit.output.plots.fit_series import fit_series
from exfit.output.plots.iterations import iterations
from exfit.output.plots.overlays import overlay, overlays
from exfit.output.plots.ranking import ranking
from exfit.output.plots.records import inspection
from exfit.output.plots.responses import overview, response
from exfit.output.plots.saturation import saturation
from exfit.output.plots.search import convergence, trajectories, waterfall
from exfit.output.plots.style import drawn, encoded, png
from exfit.output.plots.translations import translation
from exfit.output.plots.uncertainty import correlation, profiles, sensitivity
from exfit.output.plots.v_curve import v_curve

__all__ = [
    "agreement",
    "convergence",
    "correlation",
    "designed_test",
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
    "ranking",
    "response",
    "saturation",
    "sensitivity",
    "trajectories",
    "translation",
    "v_curve",
    "waterfall",
]
