"""The folder of a programme: one folder for each test, their outcomes, and one report.

The result of a test lies there under a hash of all its inputs, and is not run again.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exfit.errors import ExfitError
from exfit.features.programme.programme import Programme
from exfit.features.programme.result import (
    EnteredValue,
    FinishedTest,
    GovernorCurve,
    KeptSummary,
    ProgrammeResult,
    ProgrammeStep,
    SaturationResult,
    StepResult,
    VCurve,
)
from exfit.output import run_folder
from exfit.output.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.results.io import load_result, result_text
from exfit.results.model import OF_PROGRAMME, FitResult
from exfit.results.tables import table
from exfit.runs import store
from exfit.runs.runner import AS_CASES_SAY, FitSettings
from exfit.signals import TERMINALS
from exfit.util.file_names import WHOLE_FIT, WHOLE_PROGRAMME
from exfit.util.files import read_json, within, write, write_together
from exfit.util.text import show_value, to_json
from exfit.util.typed import plain
from exfit.util.typed_reading import FormError, read

POINTS = "points.csv"
FIGURES_AT_REST = (
    "saturation.png",
    "v_curve.png",
    "governor.png",
)  # a test at rest has one of them
VERSION = 1  # of the file of a test that is no fit
RESULTS: Mapping[str, type[SaturationResult] | type[VCurve] | type[GovernorCurve]] = {
    "saturation": SaturationResult,
    "steady": VCurve,
    "governor": GovernorCurve,
}

Keep = Callable[[FinishedTest, Path], None]


def key_of(
    step: ProgrammeStep,
    programme: Programme,
    values: tuple[EnteredValue, ...],
    settings: FitSettings = AS_CASES_SAY,
) -> str:
    """Return the SHA-256 of all that goes into a test: its section, its files, values, exfit.

    ``values`` are those that the tests before gave.
    """
    entered = {
        value.name: [value.value, value.std_error, value.source]
        for value in values
        if value.entered
    }
    files = [store.digest_of(path) for path in programme.files_of(step.name)]
    given = {name: value for name, value in settings._asdict().items() if value is not None}
    content = programme.content_of(step.name)
    return store.key_of(files, content=content, values=entered, **given)


def result_kept(step: ProgrammeStep, key: str, folder: Path) -> StepResult | None:
    """Return the result of an earlier run of a test with the same key; None where there is none."""
    file = folder / step.name / WHOLE_FIT
    if step.kind in RESULTS:
        labels = {"version": VERSION, "key": key}
        result = store.read_kept(file, RESULTS[step.kind], under="result", **labels)
        return result if result is not None and result.consistent else None
    try:
        fit = load_result(file)
    except ExfitError:
        return None  # there is none, or it is not ours
    return fit if fit.inputs.get(OF_PROGRAMME) == key else None


def text_of(test: FinishedTest) -> str:
    """Return the text of the result.json of a test."""
    if isinstance(test.result, FitResult):
        return result_text(test.result)
    content: dict[str, Any] = {"version": VERSION, "kind": test.kind, "key": test.key}
    return to_json({**content, "result": plain(test.result, whole=True)})


def keep(test: FinishedTest, folder: Path) -> None:
    """Write the result of a test, and nothing else of it, into the folder of its programme."""
    write(folder / test.name / WHOLE_FIT, text_of(test))


def write_test(test: FinishedTest, folder: Path) -> None:
    """Write the numbers of a test into its folder, its result last; of one that is kept nothing.

    The result of one that is kept is written again where the programme says something else beside
    its tests. Raises ExfitError where the folder cannot be written.
    """
    own = folder / test.name
    if test.kept:
        main, text = own / WHOLE_FIT, text_of(test)
        if main.read_text(encoding="utf-8") != text:
            write(main, text)
    elif isinstance(test.result, FitResult):
        run_folder.write_fit(test.result, own)
    else:
        numbers = {POINTS: points_table(test.result), WHOLE_FIT: text_of(test)}
        write_together(own, numbers, FIGURES_AT_REST)


def points_table(result: SaturationResult | VCurve | GovernorCurve) -> str:
    """Return the points of a test at rest as CSV, beside what is simulated where it is."""
    if isinstance(result, SaturationResult):
        columns = {"vt": result.vt, f"ifd_{result.unit}": result.ifd, "direction": result.direction}
    elif isinstance(result, GovernorCurve):
        columns, reading = {result.over: result.x}, result.reading
        columns[f"{reading.signal}_measured"] = reading.measured
        columns[f"{reading.signal}_simulated"] = reading.simulated
    else:
        columns = dict(zip(TERMINALS, (result.p, result.q, result.vt), strict=True))
        for signal, reading in result.readings.items():
            columns |= {f"{signal}_measured": reading.measured}
            columns |= {f"{signal}_simulated": reading.simulated}
    return table([*columns], [np.asarray(column, np.float64) for column in columns.values()])


def figures_of(result: ProgrammeResult, folder: Path) -> dict[str, FigureFiles]:
    """Return the figures of each test that are not in its folder yet."""
    return {
        test.name: FigureFiles.beside(
            folder / test.name / WHOLE_FIT, partial(_missing_figures, test, folder / test.name)
        )
        for test in result.tests
    }


def _missing_figures(test: FinishedTest, folder: Path) -> PlannedFigures:
    from exfit.features.programme import programme_figures as figures

    result, planned = test.result, dict[str, PlannedFigure]()
    if isinstance(result, FitResult):
        planned |= run_folder.figures_of_fit(result)
    elif isinstance(result, VCurve):
        shows = "V-curves: the points beside the machine's model"
        planned["v_curve.png"] = PlannedFigure(shows, partial(figures.v_curve, result, test.name))
    elif isinstance(result, GovernorCurve):
        shows = f"the {result.reading.signal} over {result.over}, beside the governor's model"
        drawing = partial(figures.governor, result, test.name)
        planned["governor.png"] = PlannedFigure(shows, drawing)
    else:
        drawing = partial(figures.saturation, result, test.name)
        planned["saturation.png"] = PlannedFigure("the saturation curve with its points", drawing)
    return {name: figure for name, figure in planned.items() if not (folder / name).is_file()}


def refuse_inputs(files: Iterable[Path], names: Iterable[str], folder: Path) -> None:
    """Raise ExfitError where the tests of these names would write over a file of the programme."""
    for name in names:
        run_folder.refuse_unwritable(within(folder, name), run_folder.OF_FIT)
        stems = [path.stem for path in files]
        run_folder.refuse_inputs(run_folder.OF_FIT, files, folder / name, stems)


def write_programme(result: ProgrammeResult, folder: Path) -> None:
    """Write the summary of a programme; raises ExfitError where that is not possible."""
    write(folder / WHOLE_PROGRAMME, summary_text(result))


def summary_text(result: ProgrammeResult) -> str:
    """Return the text of programme.json: all of a programme but the results of its tests."""
    return to_json({"version": VERSION, **plain(result)})


def load_summary(folder: Path) -> ProgrammeResult:
    """Return the result of a programme, given its folder: of its summary and of each test.

    Raises ExfitError where it cannot be read, or has changed since.
    """
    source = folder / WHOLE_PROGRAMME
    content = read_json(source)
    try:
        if content.get("version") != VERSION:
            raise FormError(f"version: {show_value(content.get('version'))} is not {VERSION}")
        summary: KeptSummary = read(KeptSummary, content)
        for at, test in enumerate(summary.tests):
            if Path(test.name).name != test.name:
                raise FormError(f"tests[{at}].name: {show_value(test.name)} is not that of a test")
    except FormError as fault:
        raise ExfitError(f"{source}: not the result of a programme: {fault}; run again") from None
    tests = []
    for test in summary.tests:
        result = result_kept(test, test.key, folder)
        if result is None:
            raise ExfitError(f"{folder / test.name}: not the result of this programme; run again")
        tests.append(FinishedTest(**vars(test), result=result, kept=True))
    return ProgrammeResult(**{**vars(summary), "tests": tuple(tests)})
