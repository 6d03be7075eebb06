"""Responses beside each other."""

from rich.console import Console
from rich.table import Table

from exfit.dsp.features import LABELS, Features
from exfit.features.compare.agreement import Agreement
from exfit.features.compare.curves import RECORD
from exfit.show.terminal.side_by_side import Row, side_by_side, tables
from exfit.show.terminal.terminal import notes, number, paragraph, plain_table, show_table
from exfit.util.text import percentage, rounded


def show_agreement(console: Console, result: Agreement) -> None:
    """Show how responses, and a record, differ, the features of their step, and what was fitted."""
    for curve in result.curves:
        shifted = f", shifted by {curve.shift:.6g} s" if curve.shift else ""
        console.print(f"{curve.name:6}  {curve.path}{shifted}", soft_wrap=True, markup=False)
    console.print()
    show_table(console, _differences(result))
    console.print()
    whose = "the record" if result.from_reference[0].first == RECORD else "A"
    paragraph(console, f"against {whose}: f, half the sum of squares over the samples")
    show_table(console, _matches(result))
    if result.features and result.step_at is not None:
        console.print()
        paragraph(console, f"{result.judged} after the step at {result.step_at:.4g} s")
        _features(console, result)
    if len(result.results) > 1:
        console.print()
        side_by_side(console, result.results, models=True)
    console.print()
    notes(console, result.notes)
    time = result.differences[0].time
    paragraph(console, f"compared over {time[0]:g} ... {time[-1]:g} s at {len(time)} instants")
    worst = max(result.differences, key=lambda difference: difference.interpolation)
    if worst.interpolation:
        paragraph(
            console,
            f"between samples: a cubic, up to {worst.interpolation:.1e} pu from a straight line "
            f"({worst.signal})",
        )


def _matches(result: Agreement) -> Table:
    """Return how well each response matches the reference."""
    numbers = ("f, pu²", "rmse, pu", "fit, %", "samples")
    table = plain_table("", "signal", *numbers, numbers=numbers)
    for entry in result.from_reference:
        cells = (f"{entry.f:.4e}", f"{entry.rmse:.3e}", percentage(entry.fit_percent))
        table.add_row(entry.second, entry.signal, *cells, str(entry.count))
    return table


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


def _features(console: Console, result: Agreement) -> None:
    rows = [
        Row(
            label,
            unit,
            tuple(_feature(features, key) for features in result.features.values()),
        )
        for label, key, unit in LABELS
    ]
    tables(console, [*result.features], rows)


def _feature(features: Features, key: str) -> str:
    """Return a feature; of a record with half of its 95 % interval."""
    half = features.errors.get(key)
    text = rounded(getattr(features, key), half)
    return text if half is None else f"{text} +- {half:.2g}"
