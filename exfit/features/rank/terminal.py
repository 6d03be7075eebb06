"""Models of the same records, ranked: their table, and what the records say of them."""

from rich.console import Console

from exfit.features.rank.ranked_cases import Ranking
from exfit.features.rank.ranking import RankedModel
from exfit.show.terminal.terminal import number, paragraph, plain_table, remarks, show_table

NOT_REFUTED = "*"  # behind the name of a model
LEGEND = "rmse in pu; BIC above the lowest; *"
MEANING = {False: "not refuted by the records", True: "matches best with typical machine data"}
COLUMNS = ("model", "unseen", "rmse", "BIC", "determined", "verdict")
NUMBERS = ("unseen", "rmse", "BIC", "determined")


def show_ranking(console: Console, ranked: Ranking) -> None:
    """Show models, the best first, and below them which the records tell apart."""
    console.print()
    if ranked.models:
        _table(console, ranked.models)
        console.print()
    for sentence in ranked.sentences:
        remarks(console, "note:", [sentence])
    for model in ranked.models:
        if model.possible and model.typical:
            values = ", ".join(f"{name} {number(value)}" for name, value in model.typical.items())
            remarks(console, "note:", [f"{model.name} has typical values of {values}"])
    for name, fault in ranked.series.failed.items():
        remarks(console, f"{name}: failed:", [fault], "bold red")
    if ranked.series.not_run:
        names = ", ".join(ranked.series.not_run)
        paragraph(console, f"not run, interrupted: {names}", "bold red")


def _table(console: Console, models: tuple[RankedModel, ...]) -> None:
    unseen = any(model.validation_rmse is not None for model in models)
    columns = [column for column in COLUMNS if unseen or column != "unseen"]
    table = plain_table(*columns, numbers=NUMBERS)
    for model in models:
        table.add_row(
            model.name + (NOT_REFUTED if model.possible else ""),
            *([_error(model.validation_rmse)] if unseen else []),
            _error(model.rmse),
            f"{model.bic:.1f}",
            f"{model.determined} of {model.free}",
            model.outcome,
            style="" if model.possible else "dim",
        )
    show_table(console, table)
    if unseen:
        paragraph(console, "unseen: rmse of the records that no fit saw", "dim")
    typical = any(model.typical_machine for model in models)
    paragraph(console, f"{LEGEND} {MEANING[typical]}", "dim")


def _error(rmse: float | None) -> str:
    return "-" if rmse is None else f"{rmse:.2e}"
