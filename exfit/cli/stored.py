"""The command show: results of former runs, printed again."""

from pathlib import Path

import click

from exfit.cli.given_files import GivenFile, Kind
from exfit.errors import ExfitError


@click.command(short_help="Print a stored result again.")
@click.argument("result", type=GivenFile(Kind.RESULT))
@click.option(
    "-a",
    "--all",
    "everything",
    is_flag=True,
    help="Print everything: sensitivities, what moves together, steps, sources, figures.",
)
def show(result: Path, everything: bool) -> None:
    """Print the RESULT of a fit or a validation again, as the run printed it.

    RESULT is the result.json of a fit, the validation.json of a validation, or the folder that
    holds one of them.
    """
    from exfit.results.io import load_result, load_validation, result_file
    from exfit.show import fits, run_folder, terminal, validations
    from exfit.show.blocks import Table, columns, paragraph, row
    from exfit.util.file_names import VALIDATION, WHOLE_PROGRAMME

    console, source = terminal.console(), result_file(result)
    programme = result / WHOLE_PROGRAMME if result.is_dir() else result
    if programme.name == WHOLE_PROGRAMME and programme.is_file():
        raise ExfitError(f"{result}: a programme; `exfit report` makes a page of it")
    validated = source if source.name == VALIDATION else source.with_name(VALIDATION)
    if source == validated or (validated.is_file() and not source.exists()):
        validation = load_validation(validated)
        terminal.show(console, [paragraph(validation.origin)])
        terminal.show(console, validations.validation(validation.matches))
        return
    fit, folder = load_result(source), source.parent
    if not everything:
        terminal.show_shortest(console, fits.briefs(fit, folder))
        return
    figures = tuple(
        row(name, planned.shows)
        for name, planned in run_folder.figures_of_fit(fit).items()
        if (folder / name).is_file()
    )
    if figures:
        terminal.show(console, [Table(columns("figure", "shows"), figures)])
        console.print()
    terminal.show(console, fits.whole(fit, folder))
