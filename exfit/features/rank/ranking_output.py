"""A ranking as the terminal shows it, as tables in files, and as the figure of its best models."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from exfit.features.rank.ranked_cases import Ranking
from exfit.features.rank.ranking import RankedModel
from exfit.output.blocks import Block, Table, columns, notes, number, paragraph, remarks, row
from exfit.output.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.results.tables import DIGITS, csv_text
from exfit.util.files import write_together
from exfit.util.text import to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE, WHOLE = FILES = ("rank.csv", "rank.json")
COLUMNS = (
    "name", "outcome", "validation_rmse", "rmse", "bic", "determined", "free", "refuted_by",
    "judged", "at_bound", "typical",
)  # fmt: skip
MOST_MODELS = 4  # in one figure
FARTHEST = 10.0  # times the error of the best: beside a larger one no other is seen
RECORD_HEIGHT = 3.8  # inches
NOT_REFUTED = "*"  # behind the name of a model
MEANING = {False: "not rejected by the records", True: "matches best with typical machine data"}


def ranking_blocks(ranking: Ranking) -> Iterator[Block]:
    """Yield models, the best first, and below them which the records distinguish."""
    models = ranking.models
    if models:
        yield from _table(models)
    yield from notes(ranking.sentences)
    for model in models:
        if model.possible and model.typical:
            values = ", ".join(f"{name} {number(value)}" for name, value in model.typical.items())
            yield from notes([f"{model.name} has typical values of {values}"])
    for name, fault in ranking.series.failed.items():
        yield from remarks(f"{name}: failed:", [fault], "bad")
    if ranking.series.not_run:
        yield paragraph(f"not run, interrupted: {', '.join(ranking.series.not_run)}", "bad")


def _table(models: Sequence[RankedModel]) -> Iterator[Block]:
    unseen = any(model.validation_rmse is not None for model in models)
    heads = (*(["unseen"] if unseen else []), "rmse", "BIC", "determined")
    rows = (
        row(
            model.name + (NOT_REFUTED if model.possible else ""),
            *([_error(model.validation_rmse)] if unseen else []),
            _error(model.rmse),
            f"{model.bic:.1f}",
            f"{model.determined} of {model.free}",
            model.outcome,
            mark="" if model.possible else "faint",
        )
        for model in models
    )
    yield Table(columns("model", *heads, "verdict", numbers=heads), tuple(rows))
    if unseen:
        yield paragraph("unseen: rmse of the records that were not fitted", "faint")
    meaning = MEANING[any(model.typical_machine for model in models)]
    yield paragraph(f"rmse in pu; BIC above the lowest; {NOT_REFUTED} {meaning}", "faint")


def _error(rmse: float | None) -> str:
    return "-" if rmse is None else f"{rmse:.2e}"


def write_ranking(ranking: Ranking, folder: Path) -> FigureFiles:
    """Write the table of a ranking as CSV and JSON; return the figure of its best models."""
    numbers = {TABLE: ranking_table(ranking.models), WHOLE: to_json(ranking.to_dict())}
    write_together(folder, numbers, ["rank.png"])
    return FigureFiles.beside(folder / WHOLE, partial(_figures, ranking))


def ranking_table(models: Iterable[RankedModel]) -> str:
    """Return ranked models, a line for each; what one does not have is blank."""
    rows = []
    for model in models:
        values = {**vars(model), "judged": "no" if model.refuted_by is None else "yes"}
        rows.append([_cell(values[column]) for column in COLUMNS])
    return csv_text([COLUMNS, *rows])


def _cell(value: str | float | Iterable[str] | None) -> str:
    if isinstance(value, float | int):
        return f"{value:.{DIGITS}g}"
    return value if isinstance(value, str) else " ".join(value or ())


def _figures(ranking: Ranking) -> PlannedFigures:
    shows = "responses and errors of the best models"
    drawing = partial(ranking_figure, ranking)
    return {"rank.png": PlannedFigure(shows, drawing)} if ranking.models else {}


def ranking_figure(ranking: Ranking) -> "Figure":
    """Return the first fitted record and the first unseen one with the responses of the best."""
    from exfit.output.figures.responses import responses_beside
    from exfit.output.figures.style import new_figure

    least = min(result.rmse for result in ranking.results.values())
    near = {k: fit for k, fit in ranking.results.items() if fit.rmse <= FARTHEST * least}
    best = dict([*near.items()][:MOST_MODELS])
    fitted = {name: result.comparison for name, result in best.items()}
    unseen = {name: result.validation[0] for name, result in best.items() if result.validation}
    drawn = {"fitted": fitted, **({"not fitted": unseen} if unseen else {})}
    figure = new_figure(0.6 + RECORD_HEIGHT * len(drawn))
    grid = figure.add_gridspec(2 * len(drawn), 1, height_ratios=[2.6, 1.0] * len(drawn))
    for k, (kind, responses) in enumerate(drawn.items()):
        overlay = figure.add_subplot(grid[2 * k, 0])
        errors = figure.add_subplot(grid[2 * k + 1, 0], sharex=overlay)
        overlay.tick_params(labelbottom=False)
        record = next(iter(responses.values())).record
        overlay.set_title(f"{record}, {kind}", fontsize=10, loc="left")
        responses_beside(overlay, errors, responses)
    return figure
