"""Models of the same records, ranked: their table, and what the records say of them."""

from collections.abc import Iterator

from exfit.features.rank.ranked_cases import Ranking
from exfit.features.rank.ranking import RankedModel
from exfit.show.blocks import Block, Table, columns, notes, number, paragraph, remarks, row

NOT_REFUTED = "*"  # behind the name of a model
LEGEND = "rmse in pu; BIC above the lowest; *"
MEANING = {False: "not refuted by the records", True: "matches best with typical machine data"}


def ranking(ranked: Ranking) -> Iterator[Block]:
    """Yield models, the best first, and below them which the records tell apart."""
    if ranked.models:
        yield from _models(ranked.models)
    yield from notes(ranked.sentences)
    for model in ranked.models:
        if model.possible and model.typical:
            values = ", ".join(f"{name} {number(value)}" for name, value in model.typical.items())
            yield from notes([f"{model.name} has typical values of {values}"])
    for name, fault in ranked.series.failed.items():
        yield from remarks(f"{name}: failed:", [fault], "bad")
    if ranked.series.not_run:
        names = ", ".join(ranked.series.not_run)
        yield paragraph(f"not run, interrupted: {names}", "bad")


def _models(models: tuple[RankedModel, ...]) -> Iterator[Block]:
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
        yield paragraph("unseen: rmse of the records that no fit saw", "faint")
    typical = any(model.typical_machine for model in models)
    yield paragraph(f"{LEGEND} {MEANING[typical]}", "faint")


def _error(rmse: float | None) -> str:
    return "-" if rmse is None else f"{rmse:.2e}"
