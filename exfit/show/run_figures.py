"""The figures that each kind of run leaves, by the names of their files.

What draws them is imported only where they are drawn.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from exfit.case.schema import SINGLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from exfit.features.compare.agreement import Agreement
    from exfit.features.design.designed_test import DesignedTest
    from exfit.features.design.experiment_design import Design
    from exfit.features.programme.steady.saturation_result import SaturationResult
    from exfit.features.programme.steady.v_curve_result import VCurve
    from exfit.features.rank.ranked_cases import Ranking
    from exfit.features.translate.result import Translation
    from exfit.fitting.uncertainty import UncertaintyAnalysis
    from exfit.records.inspection import Inspection
    from exfit.results.comparisons import Comparison
    from exfit.results.model import FitResult
    from exfit.runs.fits import FitSeries
    from exfit.workflows.profiles import Profiles
    from exfit.workflows.simulation import SimulationResult


@dataclass(frozen=True)
class PlannedFigure:
    """A figure to be drawn, and in a few words what it shows."""

    shows: str
    draw: Callable[[], "Figure"]


PlannedFigures = Mapping[str, PlannedFigure]


def of_fit(result: "FitResult") -> PlannedFigures:
    """Return the figures of a fit."""
    from exfit.show import figures as plots

    drawings: dict[str, PlannedFigure] = {}
    single = result.comparison.name == SINGLE
    title = f"{result.name}: {result.model} fitted to "
    if single:
        overlay = partial(plots.overlay, result.comparison, title + result.comparison.record)
    else:
        title += f"{len(result.comparisons)} records"
        overlay = partial(plots.overlays, result.comparisons, title)
    drawings["overlay.png"] = PlannedFigure("measured, start values and fitted", overlay)
    drawings |= of_phase_ends(result)
    if any(match.iteration_responses is not None for match in result.comparisons):
        iterations = partial(plots.iterations, result)
        drawings["iterations.png"] = PlannedFigure("the response after each iteration", iterations)
    drawings["convergence.png"] = PlannedFigure(
        "cost, gradient and damping after each iteration", partial(plots.convergence, result)
    )
    drawings["trajectories.png"] = PlannedFigure(
        "the parameters after each iteration", partial(plots.trajectories, result)
    )
    if result.knowledge is not None:
        drawings |= of_uncertainty(result.knowledge, result.name)
    if result.minima is not None:
        waterfall = partial(plots.waterfall, result.minima, result.name)
        drawings["starts.png"] = PlannedFigure("the cost that each start led to", waterfall)
    drawings |= of_comparisons([*(() if single else result.comparisons), *result.validation])
    return drawings


def of_phase_ends(result: "FitResult") -> PlannedFigures:
    """Return the overlays of the points where a phase of the search handed over to the next."""
    from exfit.show import figures as plots

    return {
        f"overlay_{end.phase}.png" if match.name == SINGLE else f"{match.name}-{end.phase}.png": (
            PlannedFigure(
                f"measured and the end of {end.phase}",
                partial(
                    plots.overlay,
                    match,
                    f"{result.name}: end of {end.phase} (iteration {end.iteration}), "
                    f"{match.record}",
                    f"end of {end.phase}",
                ),
            )
        )
        for end in result.phase_ends
        for match in end.comparisons
    }


def of_steady_test(result: "SaturationResult | VCurve", name: str) -> PlannedFigures:
    """Return the figure of a test at rest."""
    from exfit.features.programme.steady.v_curve_result import VCurve
    from exfit.show import figures as plots

    if isinstance(result, VCurve):
        shows = "V-curves: the points beside the machine's model"
        return {"v_curve.png": PlannedFigure(shows, partial(plots.v_curve, result, name))}
    shows = "the saturation curve with its points"
    return {"saturation.png": PlannedFigure(shows, partial(plots.saturation, result, name))}


def of_series(series: "FitSeries") -> PlannedFigures:
    """Return the figure of the fits of several cases with several strategies."""
    from exfit.show import figures as plots

    if not series.runs:
        return {}
    shows = "responses, errors and costs of all fits"
    return {"fits.png": PlannedFigure(shows, partial(plots.fit_series, series))}


def of_ranking(ranking: "Ranking") -> PlannedFigures:
    """Return the figure of the best models of a ranking."""
    from exfit.show import figures as plots

    if not ranking.models:
        return {}
    shows = "responses and errors of the best models"
    return {"rank.png": PlannedFigure(shows, partial(plots.ranking, ranking))}


def of_uncertainty(uncertainty: "UncertaintyAnalysis", name: str) -> PlannedFigures:
    """Return what each parameter does to each signal over time, and how they are correlated."""
    from exfit.show import figures as plots

    return {
        "sensitivity.png": PlannedFigure(
            "what 1 % of each parameter does to the response",
            partial(plots.sensitivity, uncertainty, name),
        ),
        "correlation.png": PlannedFigure(
            "the correlation of the estimates", partial(plots.correlation, uncertainty, name)
        ),
    }


def of_comparisons(comparisons: "Sequence[Comparison]") -> PlannedFigures:
    """Return the overlay of each comparison under its name."""
    from exfit.show import figures as plots

    return {
        f"{match.name}.png": PlannedFigure(
            f"measured and simulated, {match.record}",
            partial(plots.overlay, match, f"{match.name}: simulated and {match.record}"),
        )
        for match in comparisons
    }


def of_profiles(profiles: "Profiles") -> PlannedFigures:
    """Return the figure of the profiles of parameters."""
    from exfit.show import figures as plots

    shows = "the cost along each parameter"
    return {"profile.png": PlannedFigure(shows, partial(plots.profiles, profiles))}


def of_design(design: "Design") -> PlannedFigures:
    """Return the figures of a planned test."""
    return of_uncertainty(design.own, design.name)


def of_designed_test(design: "DesignedTest") -> PlannedFigures:
    """Return the figure of a designed test."""
    from exfit.show import figures as plots

    shows = "the reference, vt and efd of the designed test, with limits"
    return {"designed_test.png": PlannedFigure(shows, partial(plots.designed_test, design))}


def of_inspection(inspection: "Inspection") -> PlannedFigures:
    """Return the figure of what a recorder's file holds."""
    from exfit.show import figures as plots

    drawing = partial(plots.inspection, inspection, inspection.path.name)
    return {"inspect.png": PlannedFigure("the channels, with steps, gaps and spikes", drawing)}


def of_simulation(simulation: "SimulationResult", name: str) -> PlannedFigures:
    """Return the figures of a response, beside its record where there is one."""
    from exfit.show import figures as plots

    response = partial(plots.response, simulation.response, name)
    drawings = {"response.png": PlannedFigure("every signal and state", response)}
    if simulation.comparison is not None:
        title = f"{name}: simulated and {simulation.comparison.record}"
        overlay = partial(plots.overlay, simulation.comparison, title)
        drawings["overlay.png"] = PlannedFigure("measured and simulated", overlay)
    return drawings


def of_agreement(agreement: "Agreement") -> PlannedFigures:
    """Return the figure of how responses differ."""
    from exfit.show import figures as plots

    shows = "the responses and their differences"
    return {"compare.png": PlannedFigure(shows, partial(plots.agreement, agreement))}


def of_translation(translation: "Translation") -> PlannedFigures:
    """Return the figure of a fitted exciter as another model."""
    from exfit.show import figures as plots

    title = f"{translation.name}: {translation.source} and {translation.target}"
    drawing = partial(plots.translation, translation, title)
    return {
        "translation.png": PlannedFigure("the responses of both models to the same steps", drawing)
    }
