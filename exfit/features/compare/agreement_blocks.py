"""Responses beside each other, as blocks."""

from collections.abc import Iterator

from exfit.dsp.features import LABELS, Features
from exfit.features.compare.agreement import Agreement
from exfit.features.compare.curves import RECORD
from exfit.show.blocks import Block, Table, columns, notes, number, paragraph, row
from exfit.show.series import rows_table, side_by_side
from exfit.util.text import percentage, rounded


def agreement(result: Agreement) -> Iterator[Block]:
    """Yield the differences of responses and a record, features of their step, fitted values."""
    yield _curves(result)
    yield _differences(result)
    yield _matches(result)
    if result.features and result.step_at is not None:
        rows = [
            (label, unit, tuple(_feature(features, key) for features in result.features.values()))
            for label, key, unit in LABELS
        ]
        title = f"{result.judged} after the step at {result.step_at:.4g} s"
        yield rows_table([*result.features], rows, title)
    if len(result.results) > 1:
        yield from side_by_side(result.results, models=True)
    yield from notes(result.notes)
    time = result.differences[0].time
    yield paragraph(f"compared over {time[0]:g} ... {time[-1]:g} s at {len(time)} instants")
    worst = max(result.differences, key=lambda difference: difference.interpolation)
    if worst.interpolation:
        yield paragraph(
            f"between samples: a cubic, up to {worst.interpolation:.1e} pu from a straight line "
            f"({worst.signal})"
        )


def _curves(result: Agreement) -> Table:
    rows = []
    for curve in result.curves:
        shifted = f", shifted by {curve.shift:.6g} s" if curve.shift else ""
        rows.append(row(curve.name, f"{curve.path}{shifted}"))
    return Table(columns("curve", "file"), tuple(rows))


def _differences(result: Agreement) -> Table:
    rows = []
    for difference in result.differences:
        value, at = difference.largest
        finals = ", ".join(number(value) for value in reversed(difference.finals))
        name = f"{difference.second} - {difference.first}"
        cells = (f"{difference.rms:.3e}", f"{value:+.3e}", f"{at:.4g} s")
        rows.append(row(difference.signal, name, *cells, finals))
    heads = ("rms", "largest", "at")
    return Table(columns("signal", "pu", *heads, "final values", numbers=heads), tuple(rows))


def _matches(result: Agreement) -> Table:
    """Make the table of how well each response matches the reference."""
    whose = "the record" if result.from_reference[0].first == RECORD else "A"
    rows = []
    for entry in result.from_reference:
        cells = (f"{entry.f:.4e}", f"{entry.rmse:.3e}", percentage(entry.fit_percent))
        rows.append(row(entry.second, entry.signal, *cells, str(entry.count)))
    heads = ("f, pu²", "rmse, pu", "fit, %", "samples")
    return Table(
        columns("", "signal", *heads, numbers=heads),
        tuple(rows),
        f"against {whose}: f, half the sum of squares over the samples",
    )


def _feature(features: Features, key: str) -> str:
    """Write a feature; of a record with half of its 95 % interval."""
    half = features.errors.get(key)
    text = rounded(getattr(features, key), half)
    return text if half is None else f"{text} +- {half:.2g}"
