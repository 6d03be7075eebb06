"""The files that a run leaves behind: its numbers, written together; its figures come after.

What draws them is imported only where they are drawn.
"""

import hashlib
import os
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from exfit.errors import ExfitError
from exfit.output.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.results.tables import DIGITS, whole_table
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
from exfit.util.files import read_json, write_together
from exfit.util.interrupts import deferred_interrupts
from exfit.util.text import to_json
from exfit.util.vocabulary import PHASES

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
                f"{path}: would be overwritten by the results; "
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
    from exfit.case.schema import SINGLE
    from exfit.output import figures as plots

    plan: dict[str, PlannedFigure] = {}
    title, several = f"{result.name}: {result.model} fitted to ", result.comparisons
    shows = "measured, start values and fitted"
    if result.comparison.name == SINGLE:
        several = ()
        draw = partial(plots.overlay, result.comparison, title + result.comparison.record)
    else:
        draw = partial(plots.overlays, several, f"{title}{len(several)} records")
    plan["overlay.png"] = PlannedFigure(shows, draw)
    for end in result.phase_ends:
        for match in end.comparisons:
            of = "overlay_" if match.name == SINGLE else f"{match.name}-"
            place = f"end of {end.phase} (iteration {end.iteration}), {match.record}"
            title, label = f"{result.name}: {place}", f"end of {end.phase}"
            draw = partial(plots.overlay, match, title, label)
            plan[f"{of}{end.phase}.png"] = PlannedFigure(f"measured and the {label}", draw)
    if any(match.iteration_responses is not None for match in result.comparisons):
        shows = "the response after each iteration"
        plan["iterations.png"] = PlannedFigure(shows, partial(plots.iterations, result))
    shows = "cost, gradient and damping after each iteration"
    plan["convergence.png"] = PlannedFigure(shows, partial(plots.convergence, result))
    shows = "the parameters after each iteration"
    plan["trajectories.png"] = PlannedFigure(shows, partial(plots.trajectories, result))
    if result.knowledge is not None:
        plan |= figures_of_uncertainty(result.knowledge, result.name)
    if result.minima is not None:
        shows = "the cost reached from each start"
        draw = partial(plots.waterfall, result.minima, result.name)
        plan["starts.png"] = PlannedFigure(shows, draw)
    return {**plan, **figures_of_comparisons([*several, *result.validation])}


def figures_of_uncertainty(uncertainty: "UncertaintyAnalysis", name: str) -> PlannedFigures:
    """Plan the figures of the sensitivities over time and of the correlations."""
    from exfit.output import figures as plots

    moves = partial(plots.sensitivity, uncertainty, name)
    together = partial(plots.correlation, uncertainty, name)
    return {
        "sensitivity.png": PlannedFigure("effect of 1 % of each parameter on the response", moves),
        "correlation.png": PlannedFigure("the correlation of the estimates", together),
    }


def figures_of_comparisons(comparisons: "Iterable[Comparison]") -> PlannedFigures:
    """Return the overlay of each comparison that has a response, under its name."""
    from exfit.output import figures as plots

    return {
        f"{match.name}.png": PlannedFigure(
            f"measured and simulated, {match.record}",
            partial(plots.overlay, match, f"{match.name}: simulated and {match.record}"),
        )
        for match in comparisons
        if match.overlays
    }


def write_series(series: "FitSeries", folder: Path) -> FigureFiles:
    """Write the table of a series of fits as CSV and JSON; return the figure of their overlays.

    Of each case the values of the fit with the lowest cost are remembered as those of its last fit.
    """
    from exfit.results.side_by_side import results_table
    from exfit.results.tables import parameter_file

    def planned() -> PlannedFigures:
        from exfit.output import figures as plots

        draw = PlannedFigure(
            "responses, errors and costs of all fits", partial(plots.fit_series, series)
        )
        return {"fits.png": draw} if series.runs else {}

    runs = {run.name: (run.case_name, run.result) for run in series.runs}
    numbers = {"fits.csv": results_table(runs), SERIES: to_json(series.to_dict())}
    with deferred_interrupts():
        write_together(folder, numbers, ["fits.png"])
        for fits in series.by_case.values():
            lowest = min((run.result for run in fits), key=lambda result: result.cost)
            _remember(lowest.case, parameter_file(lowest))
    return FigureFiles.beside(folder / SERIES, planned)


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

    def planned() -> PlannedFigures:
        from exfit.output import figures as plots

        draw = partial(plots.profiles, profiles)
        return {"profile.png": PlannedFigure("the cost along each parameter", draw)}

    rows = [
        f"{profile.name},{value:.{DIGITS}g},{cost:.{DIGITS}g}\n"
        for profile in profiles.profiles
        for at, costs in ((profile.at, profile.costs), *profile.others)
        for value, cost in zip(at, costs, strict=True)
    ]
    table = "".join(["parameter,value,cost\n", *rows])
    numbers = {"profile.csv": table, PROFILES: to_json(profiles.as_json())}
    write_together(folder, numbers, ["profile.png"])
    return FigureFiles.beside(folder / PROFILES, planned)


def write_inspection(inspection: "Inspection", folder: Path) -> FigureFiles:
    """Write what a recorder's file holds as JSON; return its figure."""

    def planned() -> PlannedFigures:
        from exfit.output import figures as plots

        draw = partial(plots.inspection, inspection, inspection.path.name)
        return {"inspect.png": PlannedFigure("the channels, with steps, gaps and spikes", draw)}

    write_together(folder, {INSPECTION: to_json(inspection.as_json())}, ["inspect.png"])
    return FigureFiles.beside(folder / INSPECTION, planned)


def write_simulation(simulation: "SimulationResult", name: str, folder: Path) -> FigureFiles:
    """Write a response; return its figures, beside its record where there is one."""

    def planned() -> PlannedFigures:
        from exfit.output import figures as plots

        draw, match = partial(plots.response, response, name), simulation.comparison
        plan = {"response.png": PlannedFigure("every signal and state", draw)}
        if match is not None:
            draw = partial(plots.overlay, match, f"{name}: simulated and {match.record}")
            plan["overlay.png"] = PlannedFigure("measured and simulated", draw)
        return plan

    response = simulation.response
    header = ["t", *response.signals]
    numbers = {RESPONSE: whole_table(header, [response.time, *response.signals.values()])}
    write_together(folder, numbers, ["response.png", "overlay.png"])
    return FigureFiles.beside(folder / RESPONSE, planned)


def _named_after(records: Iterable[str]) -> set[str]:
    return {file for name in records if name for file in files_named_after(name)}


def _of_records(main: Path) -> set[str]:
    """Return the names of the files that a former run wrote for its records, by its main file."""
    try:
        content = read_json(main)
        matches = [*content.get("records", ()), *content.get("validation", ())]
        return _named_after([Path(match["name"]).name for match in matches])
    except (ExfitError, LookupError, TypeError, AttributeError):
        return set()  # there is none, or it is not ours


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
