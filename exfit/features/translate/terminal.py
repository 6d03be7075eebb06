"""A fitted exciter as another model."""

from collections.abc import Iterator

from rich.console import Console
from rich.table import Table

from exfit.features.translate.result import LoopFigures, StepComparison, Translation
from exfit.show.terminal.terminal import NO_BREAK, notes, number, paragraph, plain_table, show_table

LOOP_ROWS = (
    ("bandwidth", "bandwidth", "Hz"),
    ("peak", "peak", "dB"),
    ("gain margin", "gain_margin", "dB"),
    ("phase margin", "phase_margin", "deg"),
    ("least damping ratio", "damping", ""),
    ("at", "frequency", "Hz"),
)


def show_translation(console: Console, result: Translation) -> None:
    """Show the verdict, the parameters with their origin, the errors in each step, what is lost."""
    style = "bold red" if result.poor else "bold"
    paragraph(console, result.verdict, style)
    console.print()
    show_table(console, _parameters(result))
    console.print()
    show_table(console, _steps(result))
    console.print()
    if result.loops:
        show_table(console, _loops(result))
        console.print()
    if result.lost:
        lost = ", ".join(f"{name}{NO_BREAK}{value:g}" for name, value in result.lost.items())
        paragraph(console, f"no counterpart in {result.target}: {lost}")
    notes(console, result.notes)


def _parameters(result: Translation) -> Table:
    table = plain_table("parameter", "value", "unit", f"from {result.source}", numbers=("value",))
    for name, parameter in result.parameters.items():
        words = parameter.origin_in_words
        if parameter.undetermined:
            words += "; hardly shown by the steps"
        style = "yellow" if parameter.undetermined or parameter.origin == "typical" else ""
        table.add_row(name, number(parameter.value), parameter.unit, words, style=style)
    return table


def _steps(result: Translation) -> Table:
    """Return the errors: of vt in percent of the step, of efd in percent of its range."""
    numbers = ("step", "rms vt", "max vt", "max efd")
    limits = (f"{result.source} at", f"{result.target} at")
    table = plain_table(*numbers[:1], "plant", *numbers[1:], *limits, numbers=numbers)
    for column in table.columns[5:]:
        column.no_wrap, column.overflow = False, "fold"
    for step in result.steps:
        table.add_row(*_step(step), style="" if step.fitted else "dim")
    return table


def _step(step: StepComparison) -> Iterator[str]:
    vt, efd = step.errors["vt"], step.errors["efd"]
    yield f"{100.0 * step.step:+g} %"
    yield step.plant
    yield from (
        _percent(value) for value in (vt.rmse_percent, vt.largest_percent, efd.largest_percent)
    )
    yield " ".join(step.source_limits)
    yield " ".join(step.target_limits)


def _percent(value: float) -> str:
    return f"{value:.2g} %" if value < 100.0 else f"{value:.0f} %"


def _loops(result: Translation) -> Table:
    headings = [
        f"{loop.plant}\n{model}"
        for loop in result.loops
        for model in (result.source, result.target)
    ]
    table = plain_table("voltage loop", "unit", *headings, numbers=headings)
    for label, key, unit in LOOP_ROWS:
        cells = [_cell(figures, key) for loop in result.loops for figures in loop[1:]]
        table.add_row(label, unit, *cells)
    return table


def _cell(figures: LoopFigures, key: str) -> str:
    value = getattr(figures, key)
    return number(value, 4)
