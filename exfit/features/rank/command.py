"""The command rank."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli import completion
from exfit.cli.fitting import draw_each, refuse_files_of_cases, run_planned
from exfit.cli.options import (
    NOT_CONVERGED,
    Output,
    case_argument,
    load,
    output_options,
    print_json,
    progress_option,
)
from exfit.util.vocabulary import SEARCHES, SEARCHES_EXPLAINED

if TYPE_CHECKING:
    from exfit.output.figure_files import FigureFiles


@click.command(short_help="Fit the records of a case under several models, and compare these.")
@case_argument
@click.option(
    "--models",
    metavar="NAME[,NAME]",
    help="Exciters, or files of models; AC, DC, ST: all of a type; all: the whole catalogue "
    "(default: those of the type of CASE's), in the edition of IEEE Std 421.5 of CASE's.",
    shell_complete=completion.several_exciters,
)
@click.option(
    "--search",
    type=click.Choice([*SEARCHES]),
    default="global",
    help=f"Search for each model. {SEARCHES_EXPLAINED}.",
)
@progress_option
@output_options
def rank(case: Path, models: str | None, search: str, output: Output) -> None:
    """Fit the records of CASE under several exciters, and rank these.

    The exciter of CASE has the values of CASE. Every other one starts from the typical values of
    its data sheet, with bounds of a tenth and ten times of these. What its sheet does not mark as
    fitted, such as a limit, stays typical and is named. All else is as in CASE.

    The table is ordered by the error on records that were not fitted, or without any by BIC, the
    Bayesian information criterion; the lines below it say which models the records distinguish.

    Writes rank.csv, rank.json, a figure, and a folder for the fit of each model to runs/CASE-rank,
    or to DIR. Ctrl-C keeps the models that are finished. Exit code 0: all were fitted, and the
    first one matches; 1: bad input; 3: otherwise.
    """
    from exfit.features.rank.ranked_cases import planned_models, ranking_of
    from exfit.features.rank.ranking_output import FILES, ranking_blocks, write_ranking

    loaded = load(case)
    names = [] if models is None else [name.strip() for name in models.split(",")]
    plan = planned_models(loaded, names, search)
    folder = output.folder(f"{case.stem}-rank", FILES)
    refuse_files_of_cases(plan, folder, FILES)
    figures: dict[str, FigureFiles] = {}
    ranking = ranking_of(loaded, run_planned(plan, folder, figures, output))
    try:
        of_all = write_ranking(ranking, folder)
    finally:  # whatever becomes of the files
        if output.as_json:
            print_json(ranking.to_dict())
        elif output.shown:
            from exfit.output import terminal

            console = terminal.console()
            if output.live:
                console.print()
            terminal.show(console, ranking_blocks(ranking))
            console.print()
            terminal.written(console, folder)
    output.draw(of_all)
    draw_each(figures, output)
    if not ranking.complete:
        raise SystemExit(NOT_CONVERGED)
