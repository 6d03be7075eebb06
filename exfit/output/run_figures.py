"""The figures that each kind of run leaves, by the names of their files.

What draws them is imported only where they are drawn.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from exfit.case.schema import SINGLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from exfit.analysis.comparison import Agreement
    from exfit.analysis.experiment_design import Design
    from exfit.analysis.profiles import Profiles
    from exfit.fitting.uncertainty import UncertaintyAnalysis
    from exfit.fleet.fits import FitSeries
    from exfit.records.inspection import Inspection
    from exfit.results.comparisons import Comparison
    from exfit.results.model import FitResult
    from exfit.results.translation import Translation
    from exfit.workflows import SimulationResult

Drawings = Mapping[str, Callable[[], "Figure"]]


def of_fit(result: "FitResult") -> Drawings:
    """Return the figures of a fit."""
    from exfit.output import plots

    drawings: dict[str, Callable[[], Figure]] = {}
    single = result.comparison.name == SINGLE
    if single:
        title = f"{result.name}: {result.model} fitted to {result.comparison.record}"
        drawings["overlay.png"] = partial(plots.overlay, result.comparison, title)
    drawings |= of_phase_ends(result)
    if any(match.iteration_responses is not None for match in result.comparisons):
        drawings["iterations.png"] = partial(plots.iterations, result)
    drawings["convergence.png"] = partial(plots.convergence, result)
    drawings["trajectories.png"] = partial(plots.trajectories, result)
    if result.knowledge is not None:
        drawings |= of_uncertainty(result.knowledge, result.name)
    if result.minima is not None:
        drawings["starts.png"] = partial(plots.waterfall, result.minima, result.name)
    drawings |= of_comparisons([*(() if single else result.comparisons), *result.validation])
    return drawings


def of_phase_ends(result: "FitResult") -> Drawings:
    """Return the overlays of the points where a phase of the search handed over to the next."""
    from exfit.output import plots

    return {
        f"overlay_{end.phase}.png"
        if match.name == SINGLE
        else f"{match.name}-{end.phase}.png": partial(
            plots.overlay,
            match,
            f"{result.name}: end of {end.phase} (iteration {end.iteration}), {match.record}",
            f"end of {end.phase}",
        )
        for end in result.phase_ends
        for match in end.comparisons
    }


def of_series(series: "FitSeries") -> Drawings:
    """Return the figure of the fits of several cases with several strategies."""
    from exfit.output import plots

    return {"fits.png": partial(plots.fit_series, series)}


def of_uncertainty(uncertainty: "UncertaintyAnalysis", name: str) -> Drawings:
    """Return what each parameter does to each signal over time, and how they are correlated."""
    from exfit.output import plots

    return {
        "sensitivity.png": partial(plots.sensitivity, uncertainty, name),
        "correlation.png": partial(plots.correlation, uncertainty, name),
    }


def of_comparisons(comparisons: "Sequence[Comparison]") -> Drawings:
    """Return the overlay of each comparison under its name."""
    from exfit.output import plots

    return {
        f"{match.name}.png": partial(
            plots.overlay, match, f"{match.name}: simulated and {match.record}"
        )
        for match in comparisons
    }


def of_profiles(profiles: "Profiles") -> Drawings:
    """Return the figure of the profiles of parameters."""
    from exfit.output import plots

    return {"profile.png": partial(plots.profiles, profiles)}


def of_design(design: "Design") -> Drawings:
    """Return the figures of a planned test."""
    return of_uncertainty(design.own, design.name)


def of_inspection(inspection: "Inspection") -> Drawings:
    """Return the figure of what a recorder's file holds."""
    from exfit.output import plots

    return {"inspect.png": partial(plots.inspection, inspection, inspection.path.name)}


def of_simulation(simulation: "SimulationResult", name: str) -> Drawings:
    """Return the figures of a response, beside its record where there is one."""
    from exfit.output import plots

    drawings = {"response.png": partial(plots.response, simulation.response, name)}
    if simulation.comparison is not None:
        title = f"{name}: simulated and {simulation.comparison.record}"
        drawings["overlay.png"] = partial(plots.overlay, simulation.comparison, title)
    return drawings


def of_agreement(agreement: "Agreement") -> Drawings:
    """Return the figure of how responses differ."""
    from exfit.output import plots

    return {"compare.png": partial(plots.agreement, agreement)}


def of_translation(translation: "Translation") -> Drawings:
    """Return the figure of a fitted exciter as another model."""
    from exfit.output import plots

    title = f"{translation.name}: {translation.source} and {translation.target}"
    return {"translation.png": partial(plots.translation, translation, title)}
