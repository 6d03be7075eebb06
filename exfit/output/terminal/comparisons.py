"""Records beside simulations."""

from collections.abc import Iterable, Iterator, Sequence

from rich.console import Console
from rich.table import Table

from exfit.dsp.features import LABELS
from exfit.output.terminal.terminal import paragraph, plain_table, remarks, show_table
from exfit.results.comparisons import Comparison
from exfit.results.feature_digits import feature_cells

BETWEEN_COLUMNS = 2  # characters
FEATURE_COLUMNS = ("measured", "+-", "simulated")  # +-: half of the 95 % interval
WIDEST_NUMBER = 8  # characters
LABEL_WIDTH = 25  # characters that the names and units of the features take


def comparisons(console: Console, all_of_them: Sequence[Comparison]) -> None:
    """Show records side by side: how well each is met, and its step measured beside simulated."""
    for beside in _beside_each_other(console, all_of_them, ("simulated",)):
        console.print()
        show_table(console, _error_table(beside))
    stepped = [
        match for match in all_of_them if match.features.measured or match.features.simulated
    ]
    for beside in _beside_each_other(console, stepped, FEATURE_COLUMNS):
        console.print()
        show_table(console, _feature_table(beside))
        remarks(console, "-", _hidden(beside), "dim")


def rejections(console: Console, all_of_them: Iterable[Comparison]) -> None:
    """Show which records that were not fitted the response does not hold on, and why."""
    remarks(console, "not accepted:", (match.reason for match in all_of_them), "bold red")


def validation(console: Console, all_of_them: Sequence[Comparison]) -> None:
    """Show a validation: what is not accepted, which records were fitted, and each match."""
    rejections(console, all_of_them)
    for role, chosen in (("fitted, not judged:", False), ("validated:", True)):
        records = [f"{m.name} ({m.record})" for m in all_of_them if m.validation is chosen]
        if records:
            paragraph(console, f"{role} {', '.join(records)}")
    for match in all_of_them:
        remarks(console, "step:", (step.text for step in match.steps))
        remarks(console, "note:", match.notes)
    comparisons(console, all_of_them)


def _beside_each_other(
    console: Console, comparisons: Sequence[Comparison], columns: Sequence[str]
) -> Iterator[Sequence[Comparison]]:
    """Yield as many comparisons at a time as there is room for, each with these columns."""
    names = [len(comparison.name) for comparison in comparisons]
    own = sum(max(WIDEST_NUMBER, len(column), *names) + BETWEEN_COLUMNS for column in columns)
    count = max(1, (console.width - LABEL_WIDTH) // own) if names else 1
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
    headings = [
        f"{comparison.name}\n{kind}" for comparison in comparisons for kind in FEATURE_COLUMNS
    ]
    table = _folding(plain_table("step of vt", "unit", *headings, numbers=headings))
    for label, key, unit in LABELS:
        cells = [
            cell for comparison in comparisons for cell in feature_cells(comparison.features, key)
        ]
        table.add_row(label, unit, *cells)
    return table


def _hidden(comparisons: Iterable[Comparison]) -> Iterator[str]:
    """Yield which features of the records are missing, and why."""
    for comparison in comparisons:
        measured = comparison.features.measured
        for label, key, _ in LABELS if measured is not None else ():
            if measured is not None and key in measured.why:
                yield f"{comparison.name}: {label}: {measured.why[key]}"
