"""A stored result, printed again: exfit show."""

from os import PathLike
from pathlib import Path

from exfit.errors import ExfitError
from exfit.output import fits, run_folder, terminal, validations
from exfit.output.blocks import Cell, Table, columns, paragraph, row
from exfit.output.iterations import iterations
from exfit.results.io import load_result, load_validation, stored_file
from exfit.results.model import FitResult
from exfit.util.file_names import VALIDATION, WHOLE_PROGRAMME


def show(
    result: FitResult | str | PathLike[str], everything: bool = False, history: bool = False
) -> None:
    """Print the result of a fit or a validation, as the run printed it.

    Args:
        result: a fit, or a result.json, a validation.json, or the folder that holds one of them.
        everything: print also sensitivities, correlations, steps, sources and figures.
        history: print the iterations, and the result only with ``everything``.

    Raises ExfitError where the file cannot be read, holds a programme, or has no iterations.

    Example:
        >>> exfit.show("runs/ac1a_typical-fit", everything=True)
    """
    console, folder = terminal.console(), None
    if isinstance(result, FitResult):
        fit = result
    else:
        place = Path(result)
        source = stored_file(place)
        if source.name == WHOLE_PROGRAMME and source.is_file():
            raise ExfitError(f"{place}: the result of a programme: use exfit report {result}")
        validated = source.with_name(VALIDATION)
        if source == validated or (validated.is_file() and not source.exists()):
            if history:
                text = "a validation has no iterations: give the result of a fit"
                raise ExfitError(f"{place}: {text}")
            validation = load_validation(validated)
            terminal.show(console, [paragraph(validation.origin)])
            terminal.show(console, validations.validation(validation))
            return
        fit, folder = load_result(source), source.parent
    if history:
        terminal.show(console, iterations(fit.history))
        if not everything:
            return
        console.print()
    if not everything:
        terminal.show_shortest(console, fits.briefs(fit, folder))
        return
    if figures := _figures(fit, folder):
        terminal.show(console, [Table(columns("figure", "shows"), figures)])
        console.print()
    terminal.show(console, fits.whole(fit, folder))


def _figures(fit: FitResult, folder: Path | None) -> tuple[tuple[Cell, ...], ...]:
    """List the figures of a fit that are in its folder, and what they show."""
    return tuple(
        row(name, planned.shows)
        for name, planned in run_folder.figures_of_fit(fit).items()
        if folder is not None and (folder / name).is_file()
    )
