"""The files that a run leaves behind, each written whole or not at all."""

import hashlib
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exfit.analysis.comparison import Agreement
from exfit.analysis.experiment_design import Design
from exfit.analysis.profiles import Profiles
from exfit.case.schema import SINGLE
from exfit.errors import CaseError, ExfitError
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.records.inspection import Inspection
from exfit.results.model import Comparison, FitResult
from exfit.results.tables import (
    DIGITS,
    comparison_table,
    history_table,
    iteration_responses_table,
    parameter_file,
    table,
)
from exfit.util.cache import cache_folder
from exfit.util.files import write
from exfit.util.text import to_json
from exfit.workflows import SimulationResult

Array = NDArray[np.float64]

PARAMETERS = "parameters.yaml"
ITERATIONS = "iterations.csv"
FIGURES = (
    "overlay.png",
    "iterations.png",
    "convergence.png",
    "trajectories.png",
    "sensitivity.png",
    "correlation.png",
    "starts.png",
)


def refuse_unwritable(folder: Path) -> None:
    """Raise ExfitError where a folder cannot be written, before a run is spent on it."""
    place = next(one for one in (folder, *folder.parents) if one.exists())
    if not place.is_dir():
        raise ExfitError(f"{folder}: cannot be written: {place} is not a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise ExfitError(f"{folder}: cannot be written: no permission in {place}")


def write_fit(result: FitResult, folder: Path, figures: bool) -> None:
    """Write a fit's numbers, tables and figures, and remember where they are.

    Raises ExfitError where the folder cannot be written.
    """
    for old in ("result.json", *FIGURES):
        (folder / old).unlink(missing_ok=True)  # of a former fit: it would stand beside new numbers
    history = [asdict(line) for line in result.history]
    write(folder / PARAMETERS, parameter_file(result))
    write(folder / "history.csv", history_table(result))
    if result.comparison.name == SINGLE:
        write(folder / "response.csv", comparison_table(result.comparison))
    else:
        write_comparisons(result.comparisons, folder, figures)
    write_comparisons(result.validation, folder, figures)
    for one in result.comparisons:
        name = ITERATIONS if one.name == SINGLE else f"{one.name}-{ITERATIONS}"
        (folder / name).unlink(missing_ok=True)
        if one.iteration_responses is not None:
            write(folder / name, iteration_responses_table(one.time, one.iteration_responses))
    if figures:
        from exfit.output import plots

        if any(one.iteration_responses is not None for one in result.comparisons):
            write(folder / "iterations.png", plots.png(plots.iterations(result)))
        if result.comparison.name == SINGLE:
            title = f"{result.name}: {result.model} fitted to {result.comparison.record.name}"
            write(folder / "overlay.png", plots.png(plots.overlay(result.comparison, title)))
        write(folder / "convergence.png", plots.png(plots.convergence(result)))
        write(folder / "trajectories.png", plots.png(plots.trajectories(result)))
        if result.knowledge is not None:
            write_knowledge_figures(result.knowledge, result.name, folder)
        if result.minima is not None:
            write(folder / "starts.png", plots.png(plots.waterfall(result.minima, result.name)))
    # last: where it stands, everything else does
    write(folder / "result.json", to_json({**result.as_json(), "history": history}))
    with suppress(ExfitError):  # a cache that cannot be written keeps nothing
        write(_kept(result.case), parameter_file(result))


def write_knowledge_figures(known: UncertaintyAnalysis, name: str, folder: Path) -> None:
    """Write what each parameter does to each signal over time, and how they are correlated."""
    from exfit.output import plots

    write(folder / "sensitivity.png", plots.png(plots.sensitivity(known, name)))
    write(folder / "correlation.png", plots.png(plots.correlation(known, name)))


def write_comparisons(comparisons: Sequence[Comparison], folder: Path, figures: bool) -> None:
    """Write the samples and the overlay of each comparison under its name."""
    for one in comparisons:
        write(folder / f"{one.name}.csv", comparison_table(one))
        if figures:
            from exfit.output import plots

            title = f"{one.name}: simulated and {one.record.name}"
            write(folder / f"{one.name}.png", plots.png(plots.overlay(one, title)))


def write_validation(comparisons: Sequence[Comparison], folder: Path, figures: bool) -> None:
    """Write a validation's figures as JSON, its samples and its overlays."""
    write_comparisons(comparisons, folder, figures)
    content = {"validation": [one.as_json() for one in comparisons]}
    write(folder / "validation.json", to_json(content))


def write_profiles(found: Profiles, folder: Path, figures: bool) -> None:
    """Write the profiles of parameters as JSON, as a table and as a figure."""
    rows = [
        f"{one.name},{value:.{DIGITS}g},{cost:.{DIGITS}g}\n"
        for one in found.profiles
        for value, cost in zip(one.at, one.costs, strict=True)
    ]
    write(folder / "profile.csv", "".join(["parameter,value,cost\n", *rows]))
    if figures:
        from exfit.output import plots

        write(folder / "profile.png", plots.png(plots.profiles(found)))
    write(folder / "profile.json", to_json(found.as_json()))


def write_design(found: Design, folder: Path, figures: bool) -> None:
    """Write what a planned test would tell as JSON and as figures."""
    if figures:
        write_knowledge_figures(found.own, found.name, folder)
    write(folder / "identify.json", to_json(found.as_json()))


def write_inspection(found: Inspection, folder: Path, figures: bool) -> None:
    """Write what a recorder's file holds as JSON and as a figure."""
    if figures:
        from exfit.output import plots

        write(folder / "inspect.png", plots.png(plots.inspection(found, found.path.name)))
    write(folder / "inspect.json", to_json(found.as_json()))


def write_simulation(simulation: SimulationResult, name: str, folder: Path, figures: bool) -> None:
    """Write a response, and its figures."""
    response = simulation.response
    header = ["t", *response.signals]
    write(folder / "response.csv", table(header, [response.time, *response.signals.values()]))
    if figures:
        from exfit.output import plots

        write(folder / "response.png", plots.png(plots.response(response, name)))
        if simulation.comparison is not None:
            title = f"{name}: simulated and {simulation.comparison.record.name}"
            write(folder / "overlay.png", plots.png(plots.overlay(simulation.comparison, title)))


def write_agreement(found: Agreement, folder: Path, figures: bool) -> None:
    """Write how two responses differ as JSON, their samples on each clock, and a figure."""
    write(folder / "compare.csv", agreement_table(found))
    if figures:
        from exfit.output import plots

        write(folder / "compare.png", plots.png(plots.agreement(found)))
    write(folder / "compare.json", to_json(found.as_json()))


def agreement_table(found: Agreement) -> str:
    """Return both responses and their difference on their common clock, as CSV."""
    header, columns = ["t"], [found.between[0].time]
    for one in found.between:
        header += [f"{one.signal}_A", f"{one.signal}_B", f"{one.signal}_difference"]
        columns += [*one.values, one.error]
    return table(header, columns)


def last_fit(case: Path) -> Path:
    """Return the parameters of the last fit of a case; raises CaseError where none is known."""
    kept = _kept(case)
    if not kept.is_file():
        raise CaseError([f"{case}: no fit of this case is known; give --parameters FILE"])
    return kept


def _kept(case: Path) -> Path:
    """Return where the parameters of a case's last fit are kept.

    A copy beside the compiled code: a folder of results may be written over by another case.
    """
    name = hashlib.sha256(str(case.resolve()).encode()).hexdigest()[:32]
    return cache_folder() / "last-fit" / f"{name}.yaml"
