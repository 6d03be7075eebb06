"""The command fit: of one case, again whenever it changes, or of several cases and strategies."""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli.options import (
    NOT_CONVERGED,
    Given,
    Interruption,
    Output,
    Refusal,
    cases_argument,
    completed,
    output_options,
    parameters_option,
    print_json,
    progress_option,
    refuse_own_files,
    set_option,
)
from exfit.cli.streams import output_is_lost
from exfit.errors import CaseError, ExfitError, FileError
from exfit.runs.runner import AS_CASES_SAY, FitSettings
from exfit.util.vocabulary import EXPLAINED, GIVEN_AS, SEARCHES, SEARCHES_EXPLAINED, STRATEGIES

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.case.schema.values import GivenAs
    from exfit.output.events import Events
    from exfit.output.figure_files import FigureFiles
    from exfit.output.live import SeriesProgress
    from exfit.results.model import FitResult
    from exfit.runs.fits import FitRun, FitSeries, PlannedFit

SERIES = "fits"  # the folder of a series by default


@click.command()
@cases_argument
@click.option(
    "--strategy",
    "strategies",
    type=click.Choice([*STRATEGIES]),
    multiple=True,
    help=f"Strategy, instead of that of the case; may be repeated. {EXPLAINED}.",
)
@click.option(
    "--search",
    type=click.Choice([*SEARCHES]),
    help=f"Search, instead of that of the case. {SEARCHES_EXPLAINED}.",
)
@click.option(
    "--given",
    type=click.Choice(GIVEN_AS),
    help="How given values count, instead of as the case says: uncertain, each with its standard "
    "error; or exact.",
)
@set_option
@click.option(
    "--free",
    "names",
    multiple=True,
    metavar="TE,KD",
    help="Given values that this fit finds, too.",
    shell_complete=completed("given_values"),
)
@click.option(
    "--apply",
    "cause",
    metavar="N",
    help="Fit CASE with a cause of its last fit, by number or word, as CASE-WORD.yaml beside it.",
)
@parameters_option
@click.option(
    "--watch", is_flag=True, help="Repeat the fit when the case or one of its files changes."
)
@click.option(
    "-v", "--verbose", is_flag=True, help="Print the complete result, as exfit show --all."
)
@progress_option
@output_options
def fit(
    cases: tuple[Path, ...],
    strategies: tuple[str, ...],
    search: str | None,
    given: "GivenAs | None",
    changes: tuple[str, ...],
    names: tuple[str, ...],
    cause: str | None,
    parameters: Path | None,
    watch: bool,
    verbose: bool,
    output: Output,
) -> None:
    """Fit the free parameters of each CASE to its records.

    By default the search is global: besides the run from the start of CASE, runs from points
    distributed over the bounds look for a lower minimum.

    Writes result.json, parameters.yaml, history.csv, response.csv, iterations.csv and figures to
    runs/CASE-fit, or to DIR. Ctrl-C keeps the best point so far.

    The last line of the result is the verdict: good | matches, not all determined | misses the
    record | no match | not converged. Above it stand up to five causes, the likeliest first, each
    with a remedy. --verbose prints everything else, as does exfit show later; exfit report writes a
    page of it. Exit code 0: the first two verdicts; 1: bad input; 3: the others, or a record
    that does not meet the criteria of the case; without them a validation must be better than a
    constant and within 3 times the error of the fit.

    --set overrides --parameters, and both override the case: they give the start of a free
    parameter, and the value of another. The result lists the values changed.

    --free fits given values within a factor of 4, such as machine.Tpd0. --apply carries out the
    remedy of a cause that the last fit of CASE named, in runs/CASE-fit or in DIR: it writes the
    changed case beside CASE, comments kept, and fits that one into a folder of its own.

    Several cases or strategies are checked first, then every case is fitted with every strategy.
    Each fit has a folder CASE-STRATEGY in runs/fits, or in DIR, where fits.csv, fits.json and
    fits.png compare them. Strategies are compared by one run from the start of each case, unless
    --search or the case asks for a global search. Ctrl-C ends the fits and keeps those completed.
    Exit code 3: not all completed with a good verdict.

    --watch repeats the fit when CASE, its model file, a record or the file of --parameters changes,
    and shows the previous values beside the new ones; after an error in the case it waits for the
    next change. Ctrl-C ends it with exit code 0.
    """
    from exfit.output import run_folder

    freed = tuple(name.strip() for each in names for name in each.split(","))
    beside = Given(parameters, changes, given, freed)
    several = len(cases) > 1 or len(strategies) > 1
    alone = {"--verbose": verbose, "--watch": watch, "--apply": cause is not None}
    refuse_mixed([name for name, asked in alone.items() if asked], several, output)
    if several:
        fit_several(cases, beside, strategies, search, output)
        return
    (case,), settings = cases, FitSettings(next(iter(strategies), None), search)
    if watch:
        folder = output.folder(f"{case.stem}-fit", run_folder.OF_FIT)
        fit_again_and_again(case, beside, folder, settings, output, verbose)
        return
    if cause is not None:
        from exfit.cli.applying import applied

        case, output = applied(case, cause, output)
    result, _ = fit_case(beside.load(case), output, settings, verbose)
    if not result.holds:
        raise SystemExit(NOT_CONVERGED)


def refuse_mixed(alone: Sequence[str], several: bool, output: Output) -> None:
    """Raise UsageError for options of one fit, with several fits or without what they show."""
    if "--verbose" in alone and (several or not output.shown):
        raise click.UsageError("--verbose is for one fit, without --quiet or --json.")
    if "--watch" in alone and several:
        raise click.UsageError("--watch takes one case and one strategy.")
    if "--watch" in alone and not output.shown:
        raise click.UsageError("--watch cannot be combined with --quiet or --json.")
    if "--apply" in alone and (several or "--watch" in alone):
        raise click.UsageError("--apply takes one case and one strategy, without --watch.")


def fit_case(
    case: "Case", output: Output, settings: FitSettings = AS_CASES_SAY, verbose: bool = False
) -> "tuple[FitResult, Path]":
    """Fit a case as `fit_one` does, after warnings of what is doubtful; return the folder, too."""
    from exfit.output import run_folder
    from exfit.verdict.diagnostics import case_warnings, event_warnings

    output.warn((*case_warnings(case), *event_warnings(case)), "warning")
    folder = output.folder_of(case, "fit", run_folder.OF_FIT, after_records=True)
    return fit_one(case, folder, settings, output, verbose), folder


def fit_one(
    case: "Case",
    folder: Path,
    settings: FitSettings,
    output: Output,
    verbose: bool = False,
    before: "FitResult | None" = None,
) -> "FitResult":
    """Fit a case, show its iterations and its result beside a former one, write its files.

    The figures come last: the result is written and shown before they are drawn.
    """
    from exfit import workflows
    from exfit.output import run_folder

    (strategy, search), events = settings, output.events
    if events is not None:
        watch = partial(events, case.path.stem)
        result = workflows.fit(case, strategy, watch, watch, search=search)
    elif output.live:
        from exfit.output import live, terminal

        console, most = terminal.console(), case.estimate.most_iterations
        title = live.task(case, strategy)
        with live.LiveIterations(console, title, most).running() as shown:
            result = workflows.fit(case, strategy, shown, shown.starts, shown.live, search=search)
        console.print()
    else:
        result = workflows.fit(case, strategy, search=search)
    place = None
    try:
        figures = run_folder.write_fit(result, folder)
        place = folder
    finally:  # whatever becomes of the files
        if output.as_json:
            print_json(result.to_dict())
        elif output.shown:
            from exfit.output import fits, terminal

            console = terminal.console()
            if verbose:
                terminal.show(console, fits.whole(result, place, before))
            else:
                terminal.show_shortest(console, fits.briefs(result, place, before))
    if events is not None:
        from exfit.results.side_by_side import outcome_of

        events.done(case.path.stem, outcome_of(result), result.holds)
    output.draw(figures, listed=verbose)
    return result


def fit_again_and_again(
    case: Path, given: Given, folder: Path, settings: FitSettings, output: Output, verbose: bool
) -> None:
    """Fit a case, and again whenever a file of it or of its given values changes, until Ctrl-C.

    Raises ExfitError where there is no such file, or no place for the results: a change of the
    case would not help.
    """
    from exfit.case.watching import changed, stamps_of
    from exfit.case.yaml import read_text
    from exfit.output import run_folder, terminal

    read_text(case)
    run_folder.refuse_unwritable(folder, run_folder.OF_FIT)
    console, before = terminal.console(), None
    with suppress(KeyboardInterrupt):
        while True:
            stamps = stamps_of(case, given.files)
            try:
                loaded = given.load(case)
                refuse_own_files(loaded, folder, run_folder.OF_FIT, True)
                before = fit_one(loaded, folder, settings, output, verbose, before)
            except ExfitError as fault:
                Refusal(str(fault)).show()
            if before is not None and before.interrupted:
                break
            terminal.waiting(console, stamps)
            if output_is_lost():
                return
            terminal.again(console, changed(stamps))
    click.get_current_context().find_root().obj.clear()  # Ctrl-C is how it ends


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
    from exfit.output import run_folder
    from exfit.runs.fits import planned

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
            from exfit.output import terminal
            from exfit.output.series import fit_series

            console = terminal.console()
            if output.live:
                console.print()
            terminal.show(console, fit_series(series))
    if output.shown:
        terminal.written(console, folder)
    output.draw(of_all)
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
    from exfit.output import run_folder
    from exfit.runs.fits import run_all

    progress: SeriesProgress | Events | None = output.events
    if output.live:
        from exfit.output import live, terminal

        progress = live.SeriesProgress(terminal.console(), plan)

    def finished(run: "FitRun") -> None:
        if progress is not None:
            progress.finished(run)
        figures[run.name] = run_folder.write_fit(run.result, folder / run.name)

    with nullcontext() if progress is None else progress.running():
        series = run_all(plan, progress or (lambda *_: None), finished)
    if not series.runs and series.interrupted:
        raise Interruption("no fit was completed")
    return series


def draw_each(figures: "Mapping[str, FigureFiles]", output: Output) -> None:
    """Draw the figures of each fit, with a line for each fit where results are shown."""
    if not output.figures:
        return
    left = [*figures]
    try:
        for name, of_fit in figures.items():
            output.warn(of_fit.draw())
            left.remove(name)
            if output.shown:
                from exfit.output import terminal

                terminal.figures_of_fit(terminal.console(), name)
    except KeyboardInterrupt as interruption:
        others = f", and those of {', '.join(left[1:])}" if left[1:] else ""
        raise KeyboardInterrupt(f"{interruption}{others}") from None


def refuse_files_of_cases(plan: "Sequence[PlannedFit]", folder: Path, files: Sequence[str]) -> None:
    """Raise CaseError where results would replace files of a case, or cannot be written.

    ``files`` are those that are written beside the folders of the fits.
    """
    from exfit.output import run_folder
    from exfit.util.files import within

    faults: dict[str, None] = {}
    for fit in plan:
        try:
            run_folder.refuse_unwritable(within(folder, fit.name), run_folder.OF_FIT)
            refuse_own_files(fit.case, folder / fit.name, run_folder.OF_FIT, True)
            refuse_own_files(fit.case, folder, files)
        except ExfitError as fault:
            faults[str(fault)] = None
    if faults:
        raise CaseError(faults)
