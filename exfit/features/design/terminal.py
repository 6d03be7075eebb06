"""A designed test: what each addition brings, and the sheet for the plant."""

from collections.abc import Sequence

from rich.console import Console

from exfit.features.design.designed_test import DesignedTest
from exfit.features.design.experiment_design import Design
from exfit.features.design.files import sheet_lines
from exfit.inference.sensitivity import ParameterEffect
from exfit.show.terminal.terminal import (
    NO_BREAK,
    error_of,
    notes,
    number,
    paragraph,
    percent,
    plain_table,
    show_table,
    unresolved,
)

CRITERIA = {
    "A": "root mean square of the standard errors",
    "D": "geometric mean over the axes of the confidence ellipsoid",
}
LOCAL = (
    "the standard errors are those of linear theory at the values of the case, for a model that "
    "is right; the size and the instant of each step count as known"
)


def show_designed_test(console: Console, design: DesignedTest) -> None:
    """Show what each addition brings, then the sheet of the best test."""
    noise = ", ".join(
        f"{signal}{NO_BREAK}{design.noise[signal]:.2g}" for signal in design.best.channels
    )
    paragraph(console, f"expected standard errors of tests, with noise (pu): {noise}")
    paragraph(console, f"mean: {CRITERIA[design.criterion]}")
    console.print()
    heads = ["mean", *design.of]
    table = plain_table("errors in %", *heads, numbers=heads)
    for stage in design.stages:
        shares = (stage.criterion, *(stage.errors[name] for name in design.of))
        table.add_row(stage.label, *(percent(share).removesuffix(" %") for share in shares))
    ratios = design.ratios
    table.add_row("share of best 1 step", "", *(f"{ratios[name]:.2f}" for name in design.of))
    worst = design.other_values.ratios
    spread = 100.0 * design.other_values.spread
    cells = ("-" if worst[name] is None else f"{worst[name]:.2f}" for name in design.of)
    table.add_row(f"the same, {spread:g} % off", "", *cells)
    show_table(console, table)
    console.print()
    for line in sheet_lines(design):
        console.print(line, markup=False, soft_wrap=True)
    console.print()
    channels = ", ".join(design.best.channels)
    notes(
        console,
        (
            f"'share of best 1 step': divided by those of the best single step, which "
            f"is {design.single.steps[0].step:+.5g} pu, with the same limits, duration and "
            f"channels ({channels}); '{spread:g} % off': the largest share with each parameter "
            f"{spread:g} % smaller or larger",
            LOCAL,
            *design.notes,
        ),
    )


def show_design(console: Console, result: Design) -> None:
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
