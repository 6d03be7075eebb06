"""How well parameters are determined: profiles, and planned tests."""

from collections.abc import Sequence

from rich.console import Console

from exfit.features.design.experiment_design import Design
from exfit.inference import ParameterEffect
from exfit.show.terminal.terminal import (
    NO_BREAK,
    error_of,
    notes,
    number,
    paragraph,
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


def design(console: Console, result: Design) -> None:
    """Show how well planned tests would determine each parameter: standard errors in percent."""
    listed = ", ".join(f"{signal}{NO_BREAK}{level:.2g}" for signal, level in result.noise.items())
    paragraph(console, f"expected standard errors, with noise (pu): {listed}")
    others = "; of steps of 2, 5, 10 %; twice as long; with further signals"
    paragraph(console, f"of this test{others if result.plans else ''}")
    console.print()
    heads = ["this test", *(plan.label for plan in result.plans)]
    table = plain_table("parameter", *heads, numbers=heads)
    tests = [result.own.confidence, *(plan.confidence for plan in result.plans)]
    for name in result.own.confidence.names:
        table.add_row(name, *(error_of(confidence.parameters[name]) for confidence in tests))
    show_table(console, table)
    console.print()
    if result.own.effects:
        effects(console, result.own.effects)
        console.print()
    unresolved(console, result.sentences)
    notes(console, result.notes)


def effects(console: Console, ranked: Sequence[ParameterEffect]) -> None:
    """Show what 1 % of each parameter does to the records, the strongest first."""
    heads = [*(f"{label} (pu)" for label in ranked[0].rms), "of noise"]
    table = plain_table("parameter", *heads, numbers=heads)
    for effect in ranked:
        changes = (f"{change:.2e}" for change in effect.rms.values())
        table.add_row(effect.label, *changes, number(effect.of_noise, 2))
    paragraph(console, "change for 1 % of each parameter, rms over the test, the strongest first")
    show_table(console, table)
