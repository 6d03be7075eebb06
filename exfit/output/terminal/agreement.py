"""Two responses beside each other."""

from rich.console import Console
from rich.table import Table

from exfit.analysis.comparison import Agreement
from exfit.dsp.features import LABELS
from exfit.output.terminal.terminal import notes, number, plain_table


def agreement(console: Console, found: Agreement) -> None:
    """Show how two responses, and a record, differ, and the features of their step."""
    for one in found.curves:
        shifted = f", shifted by {found.shift:g} s" if one.name == "B" and found.shift else ""
        console.print(f"{one.name:6}  {one.path}{shifted}", soft_wrap=True, markup=False)
    console.print()
    console.print(_differences(found))
    if found.features and found.step_at is not None:
        console.print()
        console.print(f"{found.judged} after the step at {found.step_at:.4g} s")
        console.print(_features(found))
    console.print()
    notes(console, found.notes)
    between = found.between[0]
    console.print(
        f"compared over {between.time[0]:g} ... {between.time[-1]:g} s at {len(between.time)} "
        "instants"
    )
    worst = max(found.differences, key=lambda one: one.interpolation)
    if worst.interpolation:
        console.print(
            f"between samples: a cubic, up to {worst.interpolation:.1e} pu from a straight line "
            f"({worst.signal})"
        )


def _differences(found: Agreement) -> Table:
    numbers = ("rms", "largest", "at")
    table = plain_table("signal", "pu", *numbers, "final values", numbers=numbers)
    for one in found.differences:
        value, at = one.largest
        finals = ", ".join(number(value) for value in reversed(one.finals))
        name = f"{one.second} - {one.first}"
        cells = (f"{one.rms:.3e}", f"{value:+.3e}", f"{at:.4g} s")
        table.add_row(one.signal, name, *cells, finals)
    return table


def _features(found: Agreement) -> Table:
    names = tuple(found.features)
    table = plain_table("", "unit", *names, numbers=names)
    for label, name, unit in LABELS:
        cells = [number(getattr(one, name)) for one in found.features.values()]
        table.add_row(label, unit, *cells)
    return table
