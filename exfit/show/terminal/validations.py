"""Records beside simulations."""

from collections.abc import Iterable, Iterator, Sequence

from rich.console import Console
from rich.table import Table

from exfit.dsp.features import LABELS
from exfit.results.comparisons import Comparison
from exfit.results.feature_digits import feature_cells
from exfit.results.played_records import Excursion
from exfit.show.terminal.terminal import paragraph, plain_table, remarks, show_table
from exfit.util.text import percentage

BETWEEN_COLUMNS = 2  # characters
FEATURE_COLUMNS = ("measured", "+-", "simulated")  # +-: half of the 95 % interval
WIDEST_NUMBER = 8  # characters
LABEL_WIDTH = 25  # characters that the names and units of the features take


def comparisons(console: Console, all_of_them: Sequence[Comparison]) -> None:
    """Show records side by side: how well each is met, and its step measured beside simulated."""
    for beside in _beside_each_other(console, all_of_them, ("simulated",)):
        console.print()
        show_table(console, _error_table(beside))
    played(console, all_of_them)
    stepped = [
        match for match in all_of_them if match.features.measured or match.features.simulated
    ]
    for beside in _beside_each_other(console, stepped, FEATURE_COLUMNS):
        console.print()
        show_table(console, _feature_table(beside))
        remarks(console, "-", (*_removed(beside), *_hidden(beside)), "dim")


def played(console: Console, all_of_them: Sequence[Comparison]) -> None:
    """Show what of records was played in, and how the signals that are compared depart."""
    events = [match for match in all_of_them if match.played is not None]
    if not events:
        return
    console.print()
    for match in events:
        remarks(console, f"{match.name}: played in:", _driving(match), "")
    paragraph(console, "simulated less recorded, pu, and the peaks of both from rest:")
    show_table(console, _played_table(events), ("at rest", "at"))


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
    of_events = f" {comparisons[0].judged_by}" if comparisons[0].is_event else ""
    errors = (f"{match.max_error:.3e}" for match in comparisons)
    table.add_row(f"maximum error{of_events}", "pu", *errors)
    percentages = (percentage(comparison.fit_percent) for comparison in comparisons)
    table.add_row(f"fit{of_events}", "%", *percentages)
    return table


def _played_table(comparisons: Sequence[Comparison]) -> Table:
    """Return how the signals of records that were played in depart from them, pu and s."""
    numbers = ("rms", "largest", "at", "at rest", "peak rec.", "peak sim.")
    table = plain_table("record", "signal", *numbers, numbers=numbers)
    for match in comparisons:
        errors = {} if match.played is None else match.played.errors
        for signal, error in errors.items():
            peaks = (_peak(peak) for peak in (error.measured, error.simulated))
            cells = (f"{error.largest:+.2e}", f"{error.largest_at:.4g}", f"{error.at_rest:+.1e}")
            table.add_row(match.name, signal, f"{match.channels[signal].rmse:.2e}", *cells, *peaks)
    return table


def _driving(comparison: Comparison) -> Iterator[str]:
    """Yield in one sentence what of a record drove the simulation, and how far it went."""
    driving = {} if comparison.played is None else comparison.played.driving
    texts = (
        name if signal.excursion is None else f"{name} ({signal.excursion.text(signal.unit)})"
        for name, signal in driving.items()
    )
    yield ", ".join(texts)


def _peak(excursion: Excursion | None) -> str:
    return "-" if excursion is None else f"{excursion.value:+.4g}"


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


def _removed(comparisons: Iterable[Comparison]) -> Iterator[str]:
    """Yield which lines the features of records are read without."""
    for comparison in comparisons:
        measured = comparison.features.measured
        if measured is not None and measured.removed:
            yield f"{comparison.name}: measured without {measured.removed}"


def _hidden(comparisons: Iterable[Comparison]) -> Iterator[str]:
    """Yield which features of the records are missing, and why."""
    for comparison in comparisons:
        measured = comparison.features.measured
        for label, key, _ in LABELS if measured is not None else ():
            if measured is not None and key in measured.why:
                yield f"{comparison.name}: {label}: {measured.why[key]}"
