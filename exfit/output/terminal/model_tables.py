"""The models of the catalogue."""

from collections.abc import Iterable, Mapping

from rich.console import Console
from rich.table import Table
from rich.text import Text

from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet
from exfit.output.terminal.terminal import paragraph, plain_table, remarks, show_table


def catalogue(
    console: Console,
    models: Iterable[Model],
    machines: Iterable[Machine],
    added: Mapping[str, Iterable[Model]],
) -> None:
    """Show the names of all models; those ``added`` to exciter and machine by what they are."""
    table = plain_table("exciter", "also", "")
    for exciter in models:
        table.add_row(exciter.name, ", ".join(exciter.aliases), exciter.title.partition(" (")[0])
    show_table(console, table)
    console.print()
    table = plain_table("machine", "")
    for machine in machines:
        table.add_row(machine.name, machine.title)
    show_table(console, table)
    for kind, of_kind in added.items():
        console.print()
        table = plain_table(kind, "")
        for model in of_kind:
            table.add_row(model.name, model.title.partition(" (")[0])
        show_table(console, table)


def model(console: Console, described: Model | Machine) -> None:
    """Show a model's drawing, data sheet and states."""
    remarks(console, f"{described.name}:", [described.title], "bold")
    console.print()
    console.print(described.drawing, markup=False, soft_wrap=True)
    console.print()
    show_table(console, data_sheet(described.sheet))
    console.print()
    paragraph(console, f"states: {', '.join(described.states)}")
    free = [row.symbol for row in described.sheet if row.free]
    if free:
        paragraph(console, f"free in the case of `exfit new`: {', '.join(free)}")


def data_sheet(rows: Sheet) -> Table:
    """Return a data sheet as a table."""
    table = plain_table("symbol", "typical", "unit", "range", "meaning", numbers=("typical",))
    for row in rows:
        limits = f"{row.low:g} ... {row.high:g}"
        cells = (row.symbol, f"{row.typical:g}", row.unit, limits, row.meaning)
        table.add_row(*(Text(cell) for cell in cells))
    return table
