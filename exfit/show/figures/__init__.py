"""Figures of results: functions that return one, and touch nothing else."""

from typing import TYPE_CHECKING

from exfit.show.figures.fit_series import fit_series
from exfit.show.figures.iterations import iterations
from exfit.show.figures.overlays import overlay, overlays
from exfit.show.figures.records import inspection
from exfit.show.figures.responses import overview, response
from exfit.show.figures.search import convergence, trajectories, waterfall
from exfit.show.figures.style import drawn, encoded, png
from exfit.show.figures.uncertainty import correlation, profiles, sensitivity
from exfit.util.lazy import names_of

if TYPE_CHECKING:
    from exfit.features.compare.figure import agreement
    from exfit.features.design.figure import designed_test
    from exfit.features.programme.show.programme_figures import saturation, v_curve
    from exfit.features.rank.figure import ranking
    from exfit.features.translate.figure import translation

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

_MODULES = {
    "agreement": "exfit.features.compare.figure",
    "designed_test": "exfit.features.design.figure",
    "saturation": "exfit.features.programme.show.programme_figures",
    "v_curve": "exfit.features.programme.show.programme_figures",
    "ranking": "exfit.features.rank.figure",
    "translation": "exfit.features.translate.figure",
}

__getattr__ = names_of(__name__, _MODULES)
