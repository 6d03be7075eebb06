"""The models of the catalogue."""

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table
from rich.text import Text

from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet
from exfit.output.terminal.terminal import plain_table


def catalogue(
    console: Console,
    models: Iterable[Model],
    machines: Iterable[Machine],
    stabilisers: Iterable[Model],
) -> None:
    """Show the names of all models."""
    table = plain_table("exciter", "also", "")
    for one in models:
        table.add_row(one.name, ", ".join(one.aliases), one.title.partition(" (")[0])
    console.print(table)
    console.print()
    table = plain_table("machine", "")
    for machine in machines:
        table.add_row(machine.name, machine.title)
    console.print(table)
    console.print()
    table = plain_table("stabiliser", "")
    for one in stabilisers:
        table.add_row(one.name, one.title.partition(" (")[0])
    console.print(table)


def model(console: Console, one: Model) -> None:
    """Show a model's drawing, data sheet and states."""
    _described(console, one, one.drawing)


def machine(console: Console, one: Machine) -> None:
    """Show a machine's data sheet and states."""
    _described(console, one)


def _described(console: Console, one: Model | Machine, *drawing: str) -> None:
    console.print(f"[bold]{one.name}[/]: {one.title}")
    for text in drawing:
        console.print()
        console.print(text, markup=False, soft_wrap=True)
    console.print()
    console.print(data_sheet(one.sheet))
    console.print()
    console.print(f"states: {', '.join(one.states)}")


def data_sheet(rows: Sheet) -> Table:
    """Return a data sheet as a table."""
    table = plain_table("symbol", "typical", "unit", "range", "meaning", numbers=("typical",))
    for row in rows:
        limits = f"{row.low:g} ... {row.high:g}"
        cells = (row.symbol, f"{row.typical:g}", row.unit, limits, row.meaning)
        table.add_row(*(Text(cell) for cell in cells))
    return table
