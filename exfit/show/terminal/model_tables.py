"""The models of the catalogue."""

import re
from collections.abc import Iterable, Mapping

from rich.console import Console
from rich.table import Table
from rich.text import Text

from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet
from exfit.show.terminal.terminal import notes, paragraph, plain_table, remarks, show_table

EDITION = re.compile(r"421\.5-(\d{4})")


def catalogue(
    console: Console,
    models: Iterable[Model],
    machines: Iterable[Machine],
    added: Mapping[str, Iterable[Model]],
) -> None:
    """Show the names of all models; those ``added`` to exciter and machine by what they are."""
    table = plain_table("exciter", "also", "of", "")
    for exciter in models:
        table.add_row(exciter.name, ", ".join(exciter.aliases), *_edition_and_words(exciter))
    show_table(console, table)
    console.print()
    table = plain_table("machine", "")
    for machine in machines:
        table.add_row(machine.name, machine.title)
    show_table(console, table)
    for kind, of_kind in added.items():
        console.print()
        rows = [(model.name, *_edition_and_words(model)) for model in of_kind]
        table = plain_table(kind, "of" if any(edition for _, edition, _ in rows) else "", "")
        for row in rows:
            table.add_row(*row)
        show_table(console, table)


def _edition_and_words(model: Model) -> tuple[str, str]:
    """Return the year of the standard's edition that a title names, "" for none, and its words."""
    words, _, source = model.title.partition(" (")
    edition = EDITION.search(source)
    return edition[1] if edition else "", words


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
    if described.doubt:
        notes(console, [f"{described.name} {described.doubt}"])


def data_sheet(rows: Sheet) -> Table:
    """Return a data sheet as a table."""
    table = plain_table("symbol", "typical", "unit", "range", "meaning", numbers=("typical",))
    for row in rows:
        limits = f"{row.low:g} ... {row.high:g}"
        cells = (row.symbol, f"{row.typical:g}", row.unit, limits, row.meaning)
        table.add_row(*(Text(cell) for cell in cells))
    return table
