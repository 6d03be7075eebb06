"""The models of the catalogue, and the check of the model of a case, as blocks."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.output.blocks import (
    Block,
    Note,
    Table,
    Verbatim,
    columns,
    notes,
    paragraph,
    remarks,
    row,
)

if TYPE_CHECKING:
    from exfit.workflows.model_check import Check

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


def check(result: "Check") -> Iterator[Block]:
    """Yield the result of a check: derivatives, a flat run, sub-steps, what must be known."""
    from exfit.workflows.model_check import STEPS

    if not result.has_equations:
        yield paragraph("an external program without a twin: no equations to check")
    elif result.deviations:
        heads = [*(f"{step:.0e}" for step in STEPS), "best"]
        rows = (
            row(name, *(f"{value:.0e}" for value in values), f"{min(values):.1e}")
            for name, values in result.deviations.items()
        )
        title = "relative difference of exact Jacobian and central differences, by step"
        yield Table(columns("parameter", *heads, numbers=heads), tuple(rows), title)
        agrees = "agree" if result.agrees else "DISAGREE"
        yield paragraph(f"derivatives {agrees}", "ok" if result.agrees else "bad")
    else:
        yield paragraph("no free parameter: no derivative to check")
    if result.has_equations:
        stays = "stays" if result.flat else "does NOT stay"
        text = f"a run without a step {stays} at rest: drift {result.drift:.1e} pu in 60 s"
        yield paragraph(text, "ok" if result.flat else "bad")
        yield paragraph(f"sub-steps: {result.substeps} in each step of {result.step:g} s")
        yield paragraph(f"halving the steps changes the response by {result.step_error:.1e} pu")
        yield paragraph(f"bypassed: {', '.join(result.bypassed) or 'none'}")
    other = "twin" if result.has_equations else "record"
    for record, differences in result.from_program.items():
        listed = ", ".join(f"{signal} {largest:.2g} pu" for signal, largest in differences.items())
        yield paragraph(
            f"largest difference between program and {other} at the start, {record}: {listed}"
        )
    yield from remarks("warning:", result.warnings, kind="warning")
    yield from notes(result.notes)
