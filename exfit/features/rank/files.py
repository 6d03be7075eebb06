"""The files of a ranking: its table, and the figure of the best models."""

import csv
import io
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path

from exfit.features.rank.ranked_cases import Ranking
from exfit.features.rank.ranking import RankedModel
from exfit.results.tables import DIGITS
from exfit.show.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.util.files import write_together
from exfit.util.text import to_json

TABLE, WHOLE = FILES = ("rank.csv", "rank.json")

COLUMNS: Mapping[str, Callable[[RankedModel], str]] = {
    "name": lambda model: model.name,
    "outcome": lambda model: model.outcome,
    "validation_rmse": lambda model: _number(model.validation_rmse),
    "rmse": lambda model: _number(model.rmse),
    "bic": lambda model: _number(model.bic),
    "determined": lambda model: f"{model.determined}",
    "free": lambda model: f"{model.free}",
    "refuted_by": lambda model: " ".join(model.refuted_by or ()),
    "judged": lambda model: "no" if model.refuted_by is None else "yes",
    "at_bound": lambda model: " ".join(model.at_bound),
    "typical": lambda model: " ".join(model.typical),
}


def write_ranking(ranking: Ranking, folder: Path) -> FigureFiles:
    """Write the table of a ranking as CSV and JSON; return the figure of its best models."""
    numbers = {TABLE: ranking_table(ranking.models), WHOLE: to_json(ranking.to_dict())}
    write_together(folder, numbers, ["rank.png"])
    return FigureFiles.beside(folder / WHOLE, partial(_figure, ranking))


def _figure(ranking: Ranking) -> PlannedFigures:
    from exfit.features.rank import figure

    if not ranking.models:
        return {}
    shows = "responses and errors of the best models"
    return {"rank.png": PlannedFigure(shows, partial(figure.ranking, ranking))}


def ranking_table(models: Iterable[RankedModel]) -> str:
    """Return ranked models, a line for each; what one does not have is blank."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([text(model) for text in COLUMNS.values()] for model in models)
    return out.getvalue()


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.{DIGITS}g}"
