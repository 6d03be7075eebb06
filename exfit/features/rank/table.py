"""The table of ranked models as CSV."""

import csv
import io
from collections.abc import Callable, Iterable, Mapping

from exfit.features.rank.ranking import RankedModel
from exfit.results.tables import DIGITS

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


def ranking_table(models: Iterable[RankedModel]) -> str:
    """Return ranked models, a line for each; what one does not have is blank."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([text(model) for text in COLUMNS.values()] for model in models)
    return out.getvalue()


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.{DIGITS}g}"
