"""Fits shown while they run: one, or one after the other as the files of a case change."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from exfit.cli.options import Given, Output, Refusal, refuse_own_files
from exfit.cli.streams import output_is_lost
from exfit.errors import ExfitError

if TYPE_CHECKING:
    from exfit.case.case import Case
    from exfit.results.model import FitResult


def fit_live(
    case: "Case",
    folder: Path,
    strategy: str | None,
    search: str | None,
    output: Output,
    verbose: bool = False,
    before: "FitResult | None" = None,
) -> "FitResult":
    """Fit a case, show its iterations and its result beside a former one, write its files.

    The figures come last: the result is written and shown before they are drawn.
    """
    from exfit import workflows
    from exfit.show import fits, live, run_folder, terminal

    console, figures = terminal.console(), None
    title, most = live.task(case, strategy), case.estimate.most_iterations
    with live.LiveIterations(console, title, most).running() as shown:
        result = workflows.fit(case, strategy, shown, shown.starts, shown.live, search=search)
    try:
        figures = run_folder.write_fit(result, folder)
    finally:  # whatever becomes of the files
        place = None if figures is None else folder
        console.print()
        if verbose:
            terminal.show(console, fits.whole(result, place, before))
        else:
            terminal.show_shortest(console, fits.briefs(result, place, before))
    output.draw(figures, listed=verbose)
    return result


def fit_again_and_again(
    case: Path,
    given: Given,
    folder: Path,
    strategy: str | None,
    search: str | None,
    output: Output,
    verbose: bool = False,
) -> None:
    """Fit a case, and again whenever a file of it or of its given values changes, until Ctrl-C.

    Raises ExfitError where there is no such file, or no place for the results: a change of the
    case would not help.
    """
    from exfit.case.peek import changed, stamps_of
    from exfit.case.yaml import read_text
    from exfit.show import run_folder, terminal

    read_text(case)
    run_folder.refuse_unwritable(folder, run_folder.OF_FIT)
    console, before = terminal.console(), None
    with suppress(KeyboardInterrupt):
        while True:
            stamps = stamps_of(case, given.files)
            try:
                loaded = given.load(case)
                refuse_own_files(loaded, folder, run_folder.OF_FIT, True)
                before = fit_live(loaded, folder, strategy, search, output, verbose, before)
            except ExfitError as fault:
                Refusal(str(fault)).show()
            if before is not None and before.interrupted:
                return
            terminal.waiting(console, stamps)
            if output_is_lost():
                return
            terminal.again(console, changed(stamps))
