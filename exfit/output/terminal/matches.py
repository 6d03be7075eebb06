"""Records beside simulations."""

from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.table import Table

from exfit.dsp.features import LABELS, Features
from exfit.output.terminal.terminal import number, plain_table
from exfit.results.model import Comparison

GAP = 2  # between columns
LABELLED = 25  # columns that the names and units of the features take


def comparisons(console: Console, found: Sequence[Comparison]) -> None:
    """Show records side by side: how well each is met, and its step measured beside simulated."""
    for some in _beside_each_other(console, found):
        console.print()
        console.print(_match_table(some))
        if any(one.measured or one.simulated for one in some):
            console.print()
            console.print(_feature_table(some))
    for one in found:
        if not one.accepted:
            console.print(
                f"[bold red]not accepted[/] {one.name}: rmse {one.rmse:.3e} exceeds "
                f"{one.rmse_limit:.3e}"
            )


def _beside_each_other(
    console: Console, found: Sequence[Comparison]
) -> Iterator[Sequence[Comparison]]:
    """Yield as many comparisons at a time as the terminal has room for."""
    widest = max(len(heading) for one in found for heading in (one.name, "simulated"))
    count = max(1, (console.width - LABELLED) // (2 * (widest + GAP)))
    for first in range(0, len(found), count):
        yield found[first : first + count]


def _folding(table: Table) -> Table:
    """Let the columns behind the unit fold: names of records may be long."""
    for column in table.columns[2:]:
        column.no_wrap, column.overflow = False, "fold"
    return table


def _match_table(found: Sequence[Comparison]) -> Table:
    names = [one.name for one in found]
    table = _folding(plain_table("", "unit", *names, numbers=names))
    table.add_row("f", "pu²", *(f"{one.cost:.4e}" for one in found))
    signals = list(dict.fromkeys(signal for one in found for signal in one.overlays))
    for signal in signals:
        label = "rmse" if len(signals) == 1 else f"rmse {signal}"
        errors = (one.overlays[signal].rmse if signal in one.overlays else None for one in found)
        table.add_row(label, "pu", *("-" if e is None else f"{e:.3e}" for e in errors))
    table.add_row("maximum error", "pu", *(f"{one.max_error:.3e}" for one in found))
    table.add_row("fit", "%", *(f"{one.fit_percent:.2f}" for one in found))
    return table


def _feature_table(found: Sequence[Comparison]) -> Table:
    headings = [f"{one.name}\n{kind}" for one in found for kind in ("measured", "simulated")]
    table = _folding(plain_table("step of vt", "unit", *headings, numbers=headings))
    for label, name, unit in LABELS:
        cells = [_feature(one, name) for pair in found for one in (pair.measured, pair.simulated)]
        table.add_row(label, unit, *cells)
    return table


def _feature(found: Features | None, name: str) -> str:
    return "-" if found is None else number(getattr(found, name))
