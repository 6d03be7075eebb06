"""A fit as a notebook shows it: a table of its parameters, a figure of its response."""

from matplotlib.figure import Figure

from exfit.errors import ExfitError
from exfit.output.blocks import Block, Cell, Note, Table, columns, interval, number, row
from exfit.output.figures import overlay
from exfit.output.html import html
from exfit.results.causes_in_words import causes_in_words
from exfit.results.model import FitResult, FittedParameter
from exfit.util.text import near, percentage

__all__ = ["Figure", "fit_figure", "fit_html"]

HEADS = ("start", "fitted", "standard error", "95 % interval")


def fit_html(result: FitResult) -> str:
    """Write the parameters of a fit and what it leaves unresolved as HTML."""
    unresolved = () if result.knowledge is None else result.knowledge.sentences
    remarks = (
        *causes_in_words(result),
        *(f"unresolved: {text}" for text in unresolved),
        *result.notes,
    )
    records = ", ".join(comparison.record for comparison in result.comparisons)
    match = f"rmse {result.rmse:.3g} pu, fit {percentage(result.comparison.fit_percent)} %"
    sentence = f"fitted to {records}: {result.verdict.sentence}, {match}"
    blocks: tuple[Block, ...] = (
        Note(sentence, label=result.model, mark="strong"),
        Table(
            columns("parameter", *HEADS, "unit", "meaning", numbers=HEADS),
            tuple(_row(result, name, each) for name, each in result.parameters.items()),
            "Fitted parameters",
        ),
        *(Note(text, "warning") for text in remarks),
    )
    return f"<div>\n{html(blocks)}\n</div>"


def _row(result: FitResult, name: str, parameter: FittedParameter) -> tuple[Cell, ...]:
    note = f" ({parameter.interval_note})" if parameter.interval_note else ""
    bound = f", on its {parameter.at_bound}" if parameter.at_bound else ""
    limits = f"{interval(parameter.interval, parameter.rounded)}{note}"
    return row(
        name,
        number(parameter.start),
        f"{parameter.rounded(parameter.value)}{bound}",
        number(parameter.linear_error, 2),
        result.verdict.in_place_of_interval or limits,
        parameter.unit,
        parameter.meaning,
    )


def fit_figure(result: FitResult, record: str | None = None) -> Figure:
    """Return the fitted response beside a record, one of the fit or of its validation by name.

    Raises ExfitError where there is no such record.
    """
    comparisons = {match.name: match for match in (*result.comparisons, *result.validation)}
    name = next(iter(comparisons)) if record is None else record
    if name not in comparisons:
        raise ExfitError(f"{name}: not a record of this fit; {near(name, comparisons)}")
    return overlay(comparisons[name], f"{result.name}: {result.model}, record {name}")
