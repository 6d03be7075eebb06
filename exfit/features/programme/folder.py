"""The folder of a programme: one folder for each test, what all came to, and one report."""

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np

from exfit.features.programme.kept import summary_text, text_of
from exfit.features.programme.result import FinishedTest, ProgrammeResult
from exfit.features.programme.steady.saturation_result import SaturationResult
from exfit.features.programme.steady.v_curve_result import VCurve
from exfit.results.model import FitResult
from exfit.results.tables import table
from exfit.show import run_folder
from exfit.show.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.signals import TERMINALS
from exfit.util.file_names import WHOLE_FIT, WHOLE_PROGRAMME
from exfit.util.files import write, write_together

POINTS = "points.csv"
FIGURES_AT_REST = ("saturation.png", "v_curve.png")  # a test at rest has one of them


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


def write_programme(result: ProgrammeResult, folder: Path) -> None:
    """Write the summary of a programme; raises ExfitError where that is not possible."""
    write(folder / WHOLE_PROGRAMME, summary_text(result))


def figures_of(result: ProgrammeResult, folder: Path) -> dict[str, FigureFiles]:
    """Return the figures of each test that are not in its folder yet."""
    return {
        test.name: FigureFiles.beside(
            folder / test.name / WHOLE_FIT, partial(_missing, folder / test.name, _planned(test))
        )
        for test in result.tests
    }


def points_table(result: SaturationResult | VCurve) -> str:
    """Return the points of a test at rest as CSV, beside what is simulated where it is."""
    if isinstance(result, SaturationResult):
        columns = {"vt": result.vt, f"ifd_{result.unit}": result.ifd, "direction": result.direction}
    else:
        columns = dict(zip(TERMINALS, (result.p, result.q, result.vt), strict=True))
        for signal, reading in result.readings.items():
            columns |= {f"{signal}_measured": reading.measured}
            columns |= {f"{signal}_simulated": reading.simulated}
    return table([*columns], [np.asarray(column, np.float64) for column in columns.values()])


def _planned(test: FinishedTest) -> Callable[[], PlannedFigures]:
    if isinstance(test.result, FitResult):
        return partial(run_folder.figures_of_fit, test.result)
    return partial(_figure_at_rest, test.result, test.name)


def _figure_at_rest(result: SaturationResult | VCurve, name: str) -> PlannedFigures:
    from exfit.features.programme.show import programme_figures as figures

    if isinstance(result, VCurve):
        shows = "V-curves: the points beside the machine's model"
        return {"v_curve.png": PlannedFigure(shows, partial(figures.v_curve, result, name))}
    shows = "the saturation curve with its points"
    return {"saturation.png": PlannedFigure(shows, partial(figures.saturation, result, name))}


def _missing(folder: Path, planned: Callable[[], PlannedFigures]) -> PlannedFigures:
    return {name: figure for name, figure in planned().items() if not (folder / name).is_file()}


def refuse_inputs(files: Iterable[Path], names: Iterable[str], folder: Path) -> None:
    """Raise ExfitError where the tests of these names would write over a file of the programme."""
    for name in names:
        run_folder.refuse_unwritable(folder / name, run_folder.OF_FIT)
        run_folder.refuse_inputs(
            run_folder.OF_FIT, files, folder / name, [path.stem for path in files]
        )
