"""Two responses beside each other."""

from rich.console import Console
from rich.table import Table

from exfit.analysis.comparison import Agreement
from exfit.dsp.features import LABELS
from exfit.output.terminal.terminal import notes, number, plain_table


def agreement(console: Console, result: Agreement) -> None:
    """Show how two responses, and a record, differ, and the features of their step."""
    for curve in result.curves:
        shifted = f", shifted by {result.shift:g} s" if curve.name == "B" and result.shift else ""
        console.print(f"{curve.name:6}  {curve.path}{shifted}", soft_wrap=True, markup=False)
    console.print()
    console.print(_differences(result))
    if result.features and result.step_at is not None:
        console.print()
        console.print(f"{result.judged} after the step at {result.step_at:.4g} s")
        console.print(_features(result))
    console.print()
    notes(console, result.notes)
    between = result.between[0]
    console.print(
        f"compared over {between.time[0]:g} ... {between.time[-1]:g} s at {len(between.time)} "
        "instants"
    )
    worst = max(result.differences, key=lambda difference: difference.interpolation)
    if worst.interpolation:
        console.print(
            f"between samples: a cubic, up to {worst.interpolation:.1e} pu from a straight line "
            f"({worst.signal})"
        )


def _differences(result: Agreement) -> Table:
    numbers = ("rms", "largest", "at")
    table = plain_table("signal", "pu", *numbers, "final values", numbers=numbers)
    for difference in result.differences:
        value, at = difference.largest
        finals = ", ".join(number(value) for value in reversed(difference.finals))
        name = f"{difference.second} - {difference.first}"
        cells = (f"{difference.rms:.3e}", f"{value:+.3e}", f"{at:.4g} s")
        table.add_row(difference.signal, name, *cells, finals)
    return table


def _features(result: Agreement) -> Table:
    names = tuple(result.features)
    table = plain_table("", "unit", *names, numbers=names)
    for label, key, unit in LABELS:
        cells = [number(getattr(features, key)) for features in result.features.values()]
        table.add_row(label, unit, *cells)
    return table
