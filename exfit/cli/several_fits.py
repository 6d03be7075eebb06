"""Fits of several cases with several strategies, one after the other."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from exfit.cli.options import (
    NOT_CONVERGED,
    Given,
    Interruption,
    Output,
    print_json,
    refuse_own_files,
    warn,
)
from exfit.errors import CaseError, ExfitError, FileError

if TYPE_CHECKING:
    from exfit.runs.fits import FitRun, FitSeries, PlannedFit
    from exfit.show.figure_files import FigureFiles

SERIES = "fits"  # the folder of a series by default


def fit_several(
    cases: Sequence[Path],
    given: Given,
    strategies: Sequence[str],
    search: str | None,
    output: Output,
) -> None:
    """Fit every case with every strategy, write the files of each fit and those of all.

    The figures come last: all results are written and shown before they are drawn.

    Raises ExfitError with the faults of all cases before the first fit begins, and with those of
    fits that failed when all else is done; SystemExit where not all fits are done and well.
    """
    from exfit.runs.fits import planned
    from exfit.show import run_folder

    folder = output.folder(SERIES, run_folder.OF_SERIES)
    plan = planned(cases, strategies, given.load, search)
    refuse_files_of_cases(plan, folder, run_folder.OF_SERIES)
    figures: dict[str, FigureFiles] = {}
    series = run_planned(plan, folder, figures, output)
    try:
        of_all = run_folder.write_series(series, folder)
    finally:  # whatever becomes of the files
        if output.as_json:
            print_json(series.to_dict())
        elif output.shown:
            from exfit.show import terminal
            from exfit.show.series import fit_series

            console = terminal.console()
            console.print()
            terminal.show(console, fit_series(series))
    if output.shown:
        terminal.written(console, folder)
    output.draw(of_all)
    if output.figures:
        draw_each(figures, output)
    if series.failed:
        raise FileError(f"{name}: {fault}" for name, fault in series.failed.items())
    if not series.all_hold:
        raise SystemExit(NOT_CONVERGED)


def run_planned(
    plan: "Sequence[PlannedFit]", folder: Path, figures: "dict[str, FigureFiles]", output: Output
) -> "FitSeries":
    """Run the fits, write their numbers and collect their figures; show how far they are.

    Raises Interruption where none is done.
    """
    from exfit.runs.fits import run_all
    from exfit.show import run_folder

    def written(run: "FitRun") -> None:
        figures[run.name] = run_folder.write_fit(run.result, folder / run.name)

    if not output.shown:
        series = run_all(plan, finished=written)
    else:
        from exfit.show import live, terminal

        with live.SeriesProgress(terminal.console(), plan).running() as progress:

            def finished(run: "FitRun") -> None:
                progress.finished(run)
                written(run)

            series = run_all(plan, progress, finished)
    if not series.runs and series.interrupted:
        raise Interruption("no fit is done")
    return series


def draw_each(figures: "Mapping[str, FigureFiles]", output: Output) -> None:
    """Draw the figures of each fit, with a line for each fit where results are shown."""
    left = [*figures]
    try:
        for name, of_fit in figures.items():
            warn(of_fit.draw())
            left.remove(name)
            if output.shown:
                from exfit.show import terminal

                terminal.figures_of_fit(terminal.console(), name)
    except KeyboardInterrupt as interruption:
        others = f", and those of {', '.join(left[1:])}" if left[1:] else ""
        raise KeyboardInterrupt(f"{interruption}{others}") from None


def refuse_files_of_cases(plan: "Sequence[PlannedFit]", folder: Path, files: Sequence[str]) -> None:
    """Raise CaseError where results would replace files of a case, or cannot be written.

    ``files`` are those that are written beside the folders of the fits.
    """
    from exfit.show import run_folder

    faults: dict[str, None] = {}
    for fit in plan:
        try:
            run_folder.refuse_unwritable(folder / fit.name, run_folder.OF_FIT)
            refuse_own_files(fit.case, folder / fit.name, run_folder.OF_FIT, True)
            refuse_own_files(fit.case, folder, files)
        except ExfitError as fault:
            faults[str(fault)] = None
    if faults:
        raise CaseError(faults)
