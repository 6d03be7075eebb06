"""The files that a run leaves behind: its numbers, written together; its figures come after."""

import hashlib
import os
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exfit.errors import ExfitError
from exfit.results.fit_files import (
    HISTORY,
    ITERATIONS,
    PARAMETERS,
    RESPONSE,
    SENSITIVITIES,
    comparison_files,
    files_of_fit,
)
from exfit.results.io import VALIDATION, WHOLE_FIT, validation_text
from exfit.results.model import FitResult
from exfit.results.tables import (
    DIGITS,
    effects_table,
    parameter_file,
    table,
    whole_table,
)
from exfit.show import run_figures
from exfit.show.figure_files import FigureFiles
from exfit.util.cache import keep_private, private_cache, read_private
from exfit.util.file_names import files_named_after
from exfit.util.files import write_together
from exfit.util.interrupts import deferred_interrupts
from exfit.util.json_files import read_json
from exfit.util.strategies import PHASES
from exfit.util.text import to_json

if TYPE_CHECKING:
    from exfit.features.compare.agreement import Agreement
    from exfit.features.design.designed_test import DesignedTest
    from exfit.features.design.experiment_design import Design
    from exfit.features.rank.ranked_cases import Ranking
    from exfit.features.translate.result import Translation
    from exfit.models.sheet import Model
    from exfit.records.inspection import Inspection
    from exfit.results.validation_result import ValidationResult
    from exfit.runs.fits import FitSeries
    from exfit.workflows.profiles import Profiles
    from exfit.workflows.simulation import SimulationResult

Array = NDArray[np.float64]

PROFILES, DESIGN = "profile.json", "identify.json"
DESIGNED_TEST = "designed_test.json"
INSPECTION, AGREEMENT = "inspect.json", "compare.json"
SERIES, AT_RECORD = "fits.json", "compare-record.csv"
TRANSLATION, RANKING = "translation.json", "rank.json"
MAIN_FILES = (
    WHOLE_FIT,
    VALIDATION,
    PROFILES,
    DESIGN,
    DESIGNED_TEST,
    INSPECTION,
    RESPONSE,
    AGREEMENT,
    SERIES,
    TRANSLATION,
    RANKING,
)
# what a command may write that could be an input too, beside files that are named after records
PHASE_PARAMETERS = tuple(f"parameters_{phase}.yaml" for phase in PHASES)
NUMBERS = {
    "fit": (
        PARAMETERS,
        *PHASE_PARAMETERS,
        HISTORY,
        RESPONSE,
        ITERATIONS,
        SENSITIVITIES,
        WHOLE_FIT,
    ),
    "simulate": (RESPONSE,),
    "validate": (VALIDATION,),
    "profile": ("profile.csv", PROFILES),
    "identify": (
        DESIGN,
        SENSITIVITIES,
        DESIGNED_TEST,
        "test_sheet.txt",
        "test_sheet.csv",
        "test_section.yaml",
    ),
    "compare": ("compare.csv", AT_RECORD, AGREEMENT),
    "fits": ("fits.csv", SERIES),
    "rank": ("rank.csv", RANKING),
    "translate": ("translation.csv", TRANSLATION),
}
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


def refuse_unwritable(folder: Path) -> None:
    """Raise ExfitError where a folder cannot take a run, before that is spent on it."""
    place = next(path for path in (folder, *folder.parents) if path.exists())
    if not place.is_dir():
        raise ExfitError(f"{folder}: cannot be written: {place} is not a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise ExfitError(f"{folder}: cannot be written: no permission in {place}")
    for name in MAIN_FILES:
        if (folder / name).is_dir():
            raise ExfitError(f"{folder / name}: cannot be written: it is a folder")


def refuse_inputs(
    command: str, inputs: Iterable[Path], folder: Path, records: Iterable[str] = ()
) -> None:
    """Raise ExfitError where a command would write over a file that it reads.

    ``records`` are the names after which it names files.
    """
    names = {*NUMBERS[command], *_named_after(records)}
    for path in inputs:
        if path.name in names and path.resolve().parent == folder.resolve():
            raise ExfitError(
                f"{path}: would be written over by the results of that name; "
                f"choose another folder than {folder} with -o"
            )


def write_fit(result: FitResult, folder: Path) -> FigureFiles:
    """Write a fit's numbers, and remember where they are; return its figures, still to be drawn.

    Raises ExfitError where the folder cannot be written, and KeyboardInterrupt at an interruption:
    the numbers are whole then.
    """
    with deferred_interrupts():
        numbers = dict(files_of_fit(result))
        write_together(folder, numbers, {*FILES_OF_FIT, *_of_records(folder / WHOLE_FIT)})
        _remember(result.case, numbers[PARAMETERS])
    return FigureFiles.beside(folder / WHOLE_FIT, partial(run_figures.of_fit, result))


def write_series(series: "FitSeries", folder: Path) -> FigureFiles:
    """Write the table of a series of fits as CSV and JSON; return the figure of their overlays.

    Of each case the values of the fit with the lowest cost are remembered as those of its last fit.
    """
    from exfit.results.side_by_side import results_table

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
    return FigureFiles.beside(folder / SERIES, partial(run_figures.of_series, series))


def write_ranking(ranking: "Ranking", folder: Path) -> FigureFiles:
    """Write the table of a ranking as CSV and JSON; return the figure of its best models."""
    from exfit.features.rank.table import ranking_table

    numbers = {"rank.csv": ranking_table(ranking.models), RANKING: to_json(ranking.to_dict())}
    write_together(folder, numbers, ["rank.png"])
    return FigureFiles.beside(folder / RANKING, partial(run_figures.of_ranking, ranking))


def _of_records(main: Path) -> set[str]:
    """Return the names of the files that a former run wrote for its records, by its main file."""
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
    main = folder / VALIDATION
    with deferred_interrupts():
        numbers = {**dict(comparison_files(result.matches)), VALIDATION: validation_text(result)}
        write_together(folder, numbers, _of_records(main))
    return FigureFiles.beside(main, partial(run_figures.of_comparisons, result.matches))


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
    return FigureFiles.beside(folder / PROFILES, partial(run_figures.of_profiles, profiles))


def write_design(design: "Design", folder: Path) -> FigureFiles:
    """Write what a planned test would show as JSON, its sensitivities as CSV; return figures."""
    numbers = {
        SENSITIVITIES: effects_table(design.own.effects),
        DESIGN: to_json(design.as_json()),
    }
    write_together(folder, numbers, ["sensitivity.png", "correlation.png"])
    return FigureFiles.beside(folder / DESIGN, partial(run_figures.of_design, design))


def write_designed_test(design: "DesignedTest", folder: Path) -> FigureFiles:
    """Write a designed test as JSON, its sheet and its section of a case; return its figure."""
    from exfit.features.design.test_sheet import case_section, sheet_table, sheet_text

    numbers = {
        "test_sheet.txt": sheet_text(design),
        "test_sheet.csv": sheet_table(design),
        "test_section.yaml": case_section(design),
        DESIGNED_TEST: to_json(design.as_json()),
    }
    write_together(folder, numbers, ["designed_test.png"])
    drawings = partial(run_figures.of_designed_test, design)
    return FigureFiles.beside(folder / DESIGNED_TEST, drawings)


def write_inspection(inspection: "Inspection", folder: Path) -> FigureFiles:
    """Write what a recorder's file holds as JSON; return its figure."""
    write_together(folder, {INSPECTION: to_json(inspection.as_json())}, ["inspect.png"])
    return FigureFiles.beside(folder / INSPECTION, partial(run_figures.of_inspection, inspection))


def write_simulation(simulation: "SimulationResult", name: str, folder: Path) -> FigureFiles:
    """Write a response; return its figures."""
    response = simulation.response
    header = ["t", *response.signals]
    numbers = {RESPONSE: whole_table(header, [response.time, *response.signals.values()])}
    write_together(folder, numbers, ["response.png", "overlay.png"])
    drawings = partial(run_figures.of_simulation, simulation, name)
    return FigureFiles.beside(folder / RESPONSE, drawings)


def write_agreement(agreement: "Agreement", folder: Path) -> FigureFiles:
    """Write how responses differ as JSON, and their samples on their clocks; return a figure."""
    record = record_table(agreement)
    numbers = {
        "compare.csv": agreement_table(agreement),
        **({} if record is None else {AT_RECORD: record}),
        AGREEMENT: to_json(agreement.as_json()),
    }
    write_together(folder, numbers, ["compare.png", AT_RECORD])
    return FigureFiles.beside(folder / AGREEMENT, partial(run_figures.of_agreement, agreement))


def write_translation(
    translation: "Translation",
    result: FitResult,
    target: "tuple[str, Model]",
    folder: Path,
) -> FigureFiles:
    """Write a translation as JSON, its responses, a case and a PSS/E file; return its figure.

    ``target`` is the model, behind its name as it was given.
    """
    from exfit.features.translate.files import files_of_translation

    numbers = files_of_translation(translation, result, target, folder)
    numbers[TRANSLATION] = to_json(translation.to_dict())
    write_together(folder, numbers, ["translation.png"])
    drawings = partial(run_figures.of_translation, translation)
    return FigureFiles.beside(folder / TRANSLATION, drawings)


def agreement_table(agreement: "Agreement") -> str:
    """Return the responses and their differences from the first on their common clock, as CSV."""
    columns = {"t": agreement.time}
    several = len({entry.second for entry in agreement.between}) > 1
    for signal in agreement.signals:
        own = [entry for entry in agreement.between if entry.signal == signal]
        if not agreement.between:
            columns[f"{signal}_A"] = agreement.curves[0].signals[signal]
        columns |= {f"{signal}_A": entry.values[0] for entry in own}
        columns |= {f"{signal}_{entry.second}": entry.values[1] for entry in own}
        for entry in own:
            name = f"{signal}_{entry.second}_difference" if several else f"{signal}_difference"
            columns[name] = entry.error
    return table([*columns], [*columns.values()])


def record_table(agreement: "Agreement") -> str | None:
    """Return the record and the responses at its instants, as CSV; None without a record."""
    from exfit.features.compare.curves import RECORD

    compared = [entry for entry in agreement.differences if entry.first == RECORD]
    if not compared:
        return None
    columns = {"t": compared[0].time}
    for signal in agreement.signals:
        own = [entry for entry in compared if entry.signal == signal]
        columns |= {f"{signal}_{RECORD}": entry.values[0] for entry in own}
        columns |= {f"{signal}_{entry.second}": entry.values[1] for entry in own}
    return table([*columns], [*columns.values()])


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
    """Return where the parameters of a case's last fit are kept; None where no place is.

    A copy beside the compiled code: a folder of results may be written over by another case.
    """
    folder = private_cache()
    name = hashlib.sha256(str(case.resolve()).encode()).hexdigest()[:32]
    return None if folder is None else folder / "last-fit" / f"{name}.yaml"
