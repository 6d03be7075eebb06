"""What profiles and planned tests tell of the parameters."""

from rich.console import Console

from exfit.analysis.experiment_design import Design
from exfit.analysis.profiles import Profiles
from exfit.output.terminal.terminal import error_of, number, plain_table, remarks


def profiles(console: Console, found: Profiles) -> None:
    """Show the intervals that profiles give, beside those of the linear theory."""
    numbers = ("fitted", "min 95 %", "max 95 %", "linear min", "linear max")
    table = plain_table("parameter", *numbers, "unit", numbers=numbers)
    for one in found.profiles:
        linear = (None, None) if one.linear is None else one.linear
        cells = (number(value) for value in (one.value, one.low, one.high, *linear))
        table.add_row(one.name, *cells, one.unit, style="yellow" if any(one.ends) else "")
    console.print()
    console.print(table)
    console.print()
    open_ = [
        f"{one.name} is open {side}: {end}"
        for one in found.profiles
        for side, end in zip(("below", "above"), one.ends, strict=True)
        if end
    ]
    remarks(console, "open", open_)
    remarks(console, "note", found.notes)


def design(console: Console, found: Design) -> None:
    """Show what planned tests would tell of each parameter: standard errors in percent."""
    listed = ", ".join(f"{signal} {level:.2g}" for signal, level in found.noise.items())
    console.print(f"standard errors, with noise (pu): {listed}")
    console.print("of this test; of steps of 2, 5, 10 %; twice as long; with further signals")
    console.print()
    heads = ["this test", *(plan.label for plan in found.plans)]
    table = plain_table("parameter", *heads, numbers=heads)
    known = [found.own.confidence, *(plan.confidence for plan in found.plans)]
    for name in found.own.linear.names:
        table.add_row(name, *(error_of(one.parameters[name]) for one in known))
    console.print(table)
    console.print()
    remarks(console, "open", found.sentences)
