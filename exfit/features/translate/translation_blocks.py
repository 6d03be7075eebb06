"""A fitted exciter as another model, as blocks."""

from collections.abc import Iterator

from exfit.features.translate.result import Translation
from exfit.show.blocks import (
    NO_BREAK,
    Block,
    Table,
    TableColumn,
    columns,
    notes,
    number,
    paragraph,
    row,
)

LOOP_ROWS = (
    ("bandwidth", "bandwidth", "Hz"),
    ("peak", "peak", "dB"),
    ("gain margin", "gain_margin", "dB"),
    ("phase margin", "phase_margin", "deg"),
    ("least damping ratio", "damping", ""),
    ("at", "frequency", "Hz"),
)


def translation(result: Translation) -> Iterator[Block]:
    """Yield the verdict, the parameters with their origin, errors in each step, what is lost."""
    yield paragraph(result.verdict, "bad" if result.poor else "strong")
    yield _parameters(result)
    yield _steps(result)
    if result.loops:
        yield _loops(result)
    if result.lost:
        lost = ", ".join(f"{name}{NO_BREAK}{value:g}" for name, value in result.lost.items())
        yield paragraph(f"no counterpart in {result.target}: {lost}")
    yield from notes(result.notes)


def _parameters(result: Translation) -> Table:
    rows = []
    for name, parameter in result.parameters.items():
        words = parameter.origin_in_words
        if parameter.undetermined:
            words += "; hardly shown by the steps"
        doubtful = parameter.undetermined or parameter.origin == "typical"
        cells = (name, number(parameter.value), parameter.unit, words)
        rows.append(row(*cells, mark="doubt" if doubtful else ""))
    heads = columns("parameter", "value", "unit", f"from {result.source}", numbers=("value",))
    return Table(heads, tuple(rows))


def _steps(result: Translation) -> Table:
    """Make the table of errors: of vt in percent of the step, of efd in percent of its range."""
    rows = []
    for step in result.steps:
        vt, efd = step.errors["vt"], step.errors["efd"]
        errors = (vt.rmse_percent, vt.largest_percent, efd.largest_percent)
        rows.append(
            row(
                f"{100.0 * step.step:+g} %",
                step.plant,
                *(f"{value:.2g} %" if value < 100.0 else f"{value:.0f} %" for value in errors),
                " ".join(step.source_limits),
                " ".join(step.target_limits),
                mark="" if step.fitted else "faint",
            )
        )
    numbers = ("step", "rms vt", "max vt", "max efd")
    heads = columns("step", "plant", *numbers[1:], numbers=numbers)
    limits = (TableColumn(f"{model} at", folds=True) for model in (result.source, result.target))
    return Table((*heads, *limits), tuple(rows))


def _loops(result: Translation) -> Table:
    beside = (
        TableColumn(model, number=True, group=loop.plant)
        for loop in result.loops
        for model in (result.source, result.target)
    )
    rows = (
        row(
            label,
            unit,
            *(number(getattr(figures, key), 4) for loop in result.loops for figures in loop[1:]),
        )
        for label, key, unit in LOOP_ROWS
    )
    return Table((*columns("voltage loop", "unit"), *beside), tuple(rows), leading=2)
