"""The models of the catalogue as blocks."""

import re
from collections.abc import Iterable, Iterator, Mapping

from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.show.blocks import Block, Note, Table, Verbatim, columns, notes, paragraph, row

EDITION = re.compile(r"421\.5-(\d{4})")


def catalogue(
    models: Iterable[Model],
    machines: Iterable[Machine],
    added: Mapping[str, Iterable[Model]],
) -> Iterator[Block]:
    """Yield the names of all models; those ``added`` to exciter and machine by what they are."""
    rows = (
        row(exciter.name, ", ".join(exciter.aliases), *_edition_and_words(exciter))
        for exciter in models
    )
    yield Table(columns("exciter", "also", "of", ""), tuple(rows))
    named = (row(machine.name, machine.title) for machine in machines)
    yield Table(columns("machine", ""), tuple(named))
    for kind, of_kind in added.items():
        texts = [(model.name, *_edition_and_words(model)) for model in of_kind]
        of = "of" if any(edition for _, edition, _ in texts) else ""
        yield Table(columns(kind, of, ""), tuple(row(*cells) for cells in texts))


def _edition_and_words(model: Model) -> tuple[str, str]:
    """Split a title into the year of the standard's edition, "" for none, and its words."""
    words, _, source = model.title.partition(" (")
    edition = EDITION.search(source)
    return edition[1] if edition else "", words


def model(described: Model | Machine) -> Iterator[Block]:
    """Yield a model's drawing, data sheet and states."""
    yield Note(described.title, label=f"{described.name}:", mark="strong")
    yield Verbatim(described.drawing)
    yield Table(
        columns("symbol", "typical", "unit", "range", "meaning", numbers=("typical",)),
        tuple(
            row(
                each.symbol,
                f"{each.typical:g}",
                each.unit,
                f"{each.low:g} ... {each.high:g}",
                each.meaning,
            )
            for each in described.sheet
        ),
    )
    yield paragraph(f"states: {', '.join(described.states)}")
    free = [each.symbol for each in described.sheet if each.free]
    if free:
        yield paragraph(f"free in the case of `exfit new`: {', '.join(free)}")
    if described.doubt:
        yield from notes([f"{described.name} {described.doubt}"])
