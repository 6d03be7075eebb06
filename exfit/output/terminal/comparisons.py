"""Records beside simulations."""

from collections.abc import Iterable, Iterator, Sequence

from rich.console import Console
from rich.table import Table

from exfit.dsp.features import LABELS, Features
from exfit.output.terminal.terminal import number, plain_table, remarks
from exfit.results.comparisons import Comparison

BETWEEN_COLUMNS = 2  # characters
LABEL_WIDTH = 25  # characters that the names and units of the features take


def comparisons(console: Console, all_of_them: Sequence[Comparison]) -> None:
    """Show records side by side: how well each is met, and its step measured beside simulated."""
    for beside in _beside_each_other(console, all_of_them):
        console.print()
        console.print(_error_table(beside))
        if any(
            comparison.features.measured or comparison.features.simulated for comparison in beside
        ):
            console.print()
            console.print(_feature_table(beside))


def rejections(console: Console, all_of_them: Iterable[Comparison]) -> None:
    """Show which records that were not fitted the response does not hold on, and why."""
    remarks(console, "not accepted:", (match.reason for match in all_of_them), "bold red")


def validation(console: Console, all_of_them: Sequence[Comparison]) -> None:
    """Show a validation: what is not accepted, which records were fitted, and each match."""
    rejections(console, all_of_them)
    for role, chosen in (("fitted, not judged:", False), ("validated:", True)):
        records = [f"{m.name} ({m.record})" for m in all_of_them if m.validation is chosen]
        if records:
            console.print(f"{role} {', '.join(records)}", soft_wrap=True, markup=False)
    for match in all_of_them:
        remarks(console, "step:", (step.text for step in match.steps))
        remarks(console, "note:", match.notes)
    comparisons(console, all_of_them)


def _beside_each_other(
    console: Console, comparisons: Sequence[Comparison]
) -> Iterator[Sequence[Comparison]]:
    """Yield as many comparisons at a time as the terminal has room for."""
    widest = max(len(heading) for match in comparisons for heading in (match.name, "simulated"))
    count = max(1, (console.width - LABEL_WIDTH) // (2 * (widest + BETWEEN_COLUMNS)))
    for first in range(0, len(comparisons), count):
        yield comparisons[first : first + count]


def _folding(table: Table) -> Table:
    """Let the columns behind the unit fold: names of records may be long."""
    for column in table.columns[2:]:
        column.no_wrap, column.overflow = False, "fold"
    return table


def _error_table(comparisons: Sequence[Comparison]) -> Table:
    names = [comparison.name for comparison in comparisons]
    table = _folding(plain_table("", "unit", *names, numbers=names))
    table.add_row("cost", "pu²", *(f"{comparison.cost:.4e}" for comparison in comparisons))
    signals = list(dict.fromkeys(signal for match in comparisons for signal in match.channels))
    for signal in signals:
        label = "rmse" if len(signals) == 1 else f"rmse {signal}"
        table.add_row(label, "pu", *(_rmse(comparison, signal) for comparison in comparisons))
    table.add_row("maximum error", "pu", *(f"{match.max_error:.3e}" for match in comparisons))
    table.add_row("fit", "%", *(f"{comparison.fit_percent:.2f}" for comparison in comparisons))
    return table


def _rmse(comparison: Comparison, signal: str) -> str:
    match = comparison.channels.get(signal)
    return "-" if match is None else f"{match.rmse:.3e}"


def _feature_table(comparisons: Sequence[Comparison]) -> Table:
    names = [comparison.name for comparison in comparisons]
    headings = [f"{name}\n{kind}" for name in names for kind in ("measured", "simulated")]
    table = _folding(plain_table("step of vt", "unit", *headings, numbers=headings))
    for label, key, unit in LABELS:
        cells = [
            _feature(features, key)
            for comparison in comparisons
            for features in (comparison.features.measured, comparison.features.simulated)
        ]
        table.add_row(label, unit, *cells)
    return table


def _feature(features: Features | None, key: str) -> str:
    return "-" if features is None else number(getattr(features, key))
