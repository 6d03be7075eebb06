"""The files that a run leaves behind: its numbers, written together; its figures come after.

What draws them is imported only where they are drawn.
"""

import hashlib
import os
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from exfit.case.schema import SINGLE
from exfit.errors import ExfitError
from exfit.results.tables import DIGITS, whole_table
from exfit.show.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.util.cache import keep_private, private_cache, read_private
from exfit.util.file_names import (
    HISTORY,
    ITERATIONS,
    PARAMETERS,
    RESPONSE,
    SENSITIVITIES,
    VALIDATION,
    WHOLE_FIT,
    files_named_after,
)
from exfit.util.files import write_together
from exfit.util.interrupts import deferred_interrupts
from exfit.util.strategies import PHASES
from exfit.util.text import to_json

if TYPE_CHECKING:
    from exfit.fitting.uncertainty import UncertaintyAnalysis
    from exfit.records.inspection import Inspection
    from exfit.results.comparisons import Comparison
    from exfit.results.model import FitResult
    from exfit.results.validation_result import ValidationResult
    from exfit.runs.fits import FitSeries
    from exfit.workflows.profiles import Profiles
    from exfit.workflows.simulation import SimulationResult

PROFILES, INSPECTION, SERIES = "profile.json", "inspect.json", "fits.json"
PHASE_PARAMETERS = tuple(f"parameters_{phase}.yaml" for phase in PHASES)
# what a command may write that could be an input too, beside files that are named after records
OF_FIT = (
    PARAMETERS,
    *PHASE_PARAMETERS,
    HISTORY,
    RESPONSE,
    ITERATIONS,
    SENSITIVITIES,
    WHOLE_FIT,
)
OF_SIMULATION = (RESPONSE,)
OF_VALIDATION = (VALIDATION,)
OF_PROFILES = ("profile.csv", PROFILES)
OF_INSPECTION = (INSPECTION,)
OF_SERIES = ("fits.csv", SERIES)
# what a fit may write, beside the files that are named after records
FILES_OF_FIT = (
    *PHASE_PARAMETERS,
    *(f"overlay_{phase}.png" for phase in PHASES),
    ITERATIONS,
    RESPONSE,
    SENSITIVITIES,
    "overlay.png",
    "iterations.png",
    "convergence.png",
    "trajectories.png",
    "sensitivity.png",
    "correlation.png",
    "starts.png",
)


def refuse_unwritable(folder: Path, names: Iterable[str] = ()) -> None:
    """Raise ExfitError where a folder cannot take files of these names, before a run is spent."""
    place = next(path for path in (folder, *folder.parents) if path.exists())
    if not place.is_dir():
        raise ExfitError(f"{folder}: cannot be written: {place} is not a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise ExfitError(f"{folder}: cannot be written: no permission in {place}")
    for name in names:
        if (folder / name).is_dir():
            raise ExfitError(f"{folder / name}: cannot be written: it is a folder")


def refuse_inputs(
    names: Iterable[str], inputs: Iterable[Path], folder: Path, records: Iterable[str] = ()
) -> None:
    """Raise ExfitError where files of these names would be written over an input.

    ``records`` are the names after which further files are named.
    """
    written = {*names, *_named_after(records)}
    for path in inputs:
        if path.name in written and path.resolve().parent == folder.resolve():
            raise ExfitError(
                f"{path}: would be written over by the results of that name; "
                f"choose another folder than {folder} with -o"
            )


def write_fit(result: "FitResult", folder: Path) -> FigureFiles:
    """Write a fit's numbers, and remember where they are; return its figures, still to be drawn.

    Raises ExfitError where the folder cannot be written, and KeyboardInterrupt at an interruption:
    the numbers are whole then.
    """
    from exfit.results.io import files_of_fit

    with deferred_interrupts():
        numbers = dict(files_of_fit(result))
        write_together(folder, numbers, {*FILES_OF_FIT, *_of_records(folder / WHOLE_FIT)})
        _remember(result.case, numbers[PARAMETERS])
    return FigureFiles.beside(folder / WHOLE_FIT, partial(figures_of_fit, result))


def figures_of_fit(result: "FitResult") -> PlannedFigures:
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
    drawings |= _phase_ends(result)
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
        drawings |= figures_of_uncertainty(result.knowledge, result.name)
    if result.minima is not None:
        waterfall = partial(plots.waterfall, result.minima, result.name)
        drawings["starts.png"] = PlannedFigure("the cost that each start led to", waterfall)
    drawings |= figures_of_comparisons(
        [*(() if single else result.comparisons), *result.validation]
    )
    return drawings


def _phase_ends(result: "FitResult") -> PlannedFigures:
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


def figures_of_uncertainty(uncertainty: "UncertaintyAnalysis", name: str) -> PlannedFigures:
    """Plan the figures of the sensitivities over time and of the correlations."""
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


def figures_of_comparisons(comparisons: "Sequence[Comparison]") -> PlannedFigures:
    """Return the overlay of each comparison under its name."""
    from exfit.show import figures as plots

    return {
        f"{match.name}.png": PlannedFigure(
            f"measured and simulated, {match.record}",
            partial(plots.overlay, match, f"{match.name}: simulated and {match.record}"),
        )
        for match in comparisons
    }


def write_series(series: "FitSeries", folder: Path) -> FigureFiles:
    """Write the table of a series of fits as CSV and JSON; return the figure of their overlays.

    Of each case the values of the fit with the lowest cost are remembered as those of its last fit.
    """
    from exfit.results.side_by_side import results_table
    from exfit.results.tables import parameter_file

    runs = {run.name: (run.case_name, run.result) for run in series.runs}
    with deferred_interrupts():
        write_together(
            folder,
            {"fits.csv": results_table(runs), SERIES: to_json(series.to_dict())},
            ["fits.png"],
        )
        for fits in series.by_case.values():
            lowest = min((run.result for run in fits), key=lambda result: result.cost)
            _remember(lowest.case, parameter_file(lowest))
    return FigureFiles.beside(folder / SERIES, partial(_figure_of_series, series))


def _figure_of_series(series: "FitSeries") -> PlannedFigures:
    """Return the figure of the fits of several cases with several strategies."""
    from exfit.show import figures as plots

    if not series.runs:
        return {}
    shows = "responses, errors and costs of all fits"
    return {"fits.png": PlannedFigure(shows, partial(plots.fit_series, series))}


def _of_records(main: Path) -> set[str]:
    """Return the names of the files that a former run wrote for its records, by its main file."""
    from exfit.util.files import read_json

    try:
        content = read_json(main)
        matches = [*content.get("records", ()), *content.get("validation", ())]
        names = [Path(match["name"]).name for match in matches]
    except (ExfitError, LookupError, TypeError, AttributeError):
        return set()  # there is none, or it is not ours
    return _named_after(names)


def _named_after(records: Iterable[str]) -> set[str]:
    """Return the names of the files that are named after records."""
    return {file for name in records if name for file in files_named_after(name)}


def write_validation(result: "ValidationResult", folder: Path) -> FigureFiles:
    """Write all of a validation as JSON, and its samples; return its overlays.

    As every function here: raises ExfitError where the folder cannot be written.
    """
    from exfit.results.io import comparison_files, validation_text

    main = folder / VALIDATION
    with deferred_interrupts():
        numbers = {**dict(comparison_files(result.matches)), VALIDATION: validation_text(result)}
        write_together(folder, numbers, _of_records(main))
    return FigureFiles.beside(main, partial(figures_of_comparisons, result.matches))


def write_profiles(profiles: "Profiles", folder: Path) -> FigureFiles:
    """Write the profiles of parameters as JSON and as a table; return their figure."""
    rows = [
        f"{profile.name},{value:.{DIGITS}g},{cost:.{DIGITS}g}\n"
        for profile in profiles.profiles
        for at, costs in ((profile.at, profile.costs), *profile.others)
        for value, cost in zip(at, costs, strict=True)
    ]
    numbers = {
        "profile.csv": "".join(["parameter,value,cost\n", *rows]),
        PROFILES: to_json(profiles.as_json()),
    }
    write_together(folder, numbers, ["profile.png"])
    return FigureFiles.beside(folder / PROFILES, partial(_figure_of_profiles, profiles))


def _figure_of_profiles(profiles: "Profiles") -> PlannedFigures:
    """Return the figure of the profiles of parameters."""
    from exfit.show import figures as plots

    shows = "the cost along each parameter"
    return {"profile.png": PlannedFigure(shows, partial(plots.profiles, profiles))}


def write_inspection(inspection: "Inspection", folder: Path) -> FigureFiles:
    """Write what a recorder's file holds as JSON; return its figure."""
    write_together(folder, {INSPECTION: to_json(inspection.as_json())}, ["inspect.png"])
    return FigureFiles.beside(folder / INSPECTION, partial(_figure_of_inspection, inspection))


def _figure_of_inspection(inspection: "Inspection") -> PlannedFigures:
    """Return the figure of what a recorder's file holds."""
    from exfit.show import figures as plots

    drawing = partial(plots.inspection, inspection, inspection.path.name)
    return {"inspect.png": PlannedFigure("the channels, with steps, gaps and spikes", drawing)}


def write_simulation(simulation: "SimulationResult", name: str, folder: Path) -> FigureFiles:
    """Write a response; return its figures."""
    response = simulation.response
    header = ["t", *response.signals]
    numbers = {RESPONSE: whole_table(header, [response.time, *response.signals.values()])}
    write_together(folder, numbers, ["response.png", "overlay.png"])
    drawings = partial(_figures_of_simulation, simulation, name)
    return FigureFiles.beside(folder / RESPONSE, drawings)


def _figures_of_simulation(simulation: "SimulationResult", name: str) -> PlannedFigures:
    """Return the figures of a response, beside its record where there is one."""
    from exfit.show import figures as plots

    response = partial(plots.response, simulation.response, name)
    drawings = {"response.png": PlannedFigure("every signal and state", response)}
    if simulation.comparison is not None:
        title = f"{name}: simulated and {simulation.comparison.record}"
        overlay = partial(plots.overlay, simulation.comparison, title)
        drawings["overlay.png"] = PlannedFigure("measured and simulated", overlay)
    return drawings


def last_fit(case: Path) -> Path | None:
    """Return the parameters of the last fit of a case; None where there was no fit."""
    parameters = _last_parameters(case)
    return None if parameters is None or read_private(parameters) is None else parameters


def _remember(case: Path, parameters: str) -> None:
    """Keep the parameters of a case's last fit; a cache that cannot be written keeps nothing."""
    place = _last_parameters(case)
    if place is not None:
        keep_private(place, parameters.encode())


def _last_parameters(case: Path) -> Path | None:
    """Find the file for the parameters of a case's last fit; None where no place is.

    A copy beside the compiled code: a folder of results may be written over by another case.
    """
    folder = private_cache()
    name = hashlib.sha256(str(case.resolve()).encode()).hexdigest()[:32]
    return None if folder is None else folder / "last-fit" / f"{name}.yaml"
