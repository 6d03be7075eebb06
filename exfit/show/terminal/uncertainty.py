"""How well parameters are determined: profiles, and planned tests."""

from rich.console import Console

from exfit.show.terminal.terminal import (
    notes,
    plain_table,
    show_table,
    unresolved,
)
from exfit.workflows.profiles import Profiles


def profiles(console: Console, result: Profiles) -> None:
    """Show the intervals that profiles give, beside those of the linear theory."""
    numbers = ("fitted", "min 95 %", "max 95 %", "linear min", "linear max")
    table = plain_table("parameter", *numbers, "unit", numbers=numbers)
    for profile in result.profiles:
        linear = (None, None) if profile.linear is None else profile.linear
        low = result.verdict.in_place_of_interval or profile.rounded(profile.low)
        cells = map(profile.rounded, (profile.high, *linear))
        style = "yellow" if any(profile.ends) else ""
        value = profile.rounded(profile.value)
        table.add_row(profile.name, value, low, *cells, profile.unit, style=style)
    console.print()
    show_table(console, table)
    console.print()
    sides = ("no lower limit", "no upper limit")
    unresolved(
        console,
        (
            f"{profile.name} has {side}: {end}"
            for profile in result.profiles
            for side, end in zip(sides, profile.ends, strict=True)
            if end and not result.verdict.misfit
        ),
    )
    notes(console, result.notes)
