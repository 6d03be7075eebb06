"""A planned test as blocks: what it would show; of a designed one the sheet for the plant."""

from collections.abc import Iterator, Sequence

from exfit.features.design.designed_test import DesignedTest
from exfit.features.design.experiment_design import Design
from exfit.features.design.files import sheet_lines
from exfit.inference.sensitivity import ParameterEffect
from exfit.show.blocks import (
    NO_BREAK,
    Block,
    Table,
    Verbatim,
    columns,
    error_of,
    notes,
    number,
    paragraph,
    percent,
    row,
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


def designed_test(design: DesignedTest) -> Iterator[Block]:
    """Yield the gain of each addition, then the sheet of the best test."""
    noise = ", ".join(
        f"{signal}{NO_BREAK}{design.noise[signal]:.2g}" for signal in design.best.channels
    )
    yield paragraph(f"expected standard errors of tests, with noise (pu): {noise}")
    yield paragraph(f"mean: {CRITERIA[design.criterion]}")
    rows = []
    for stage in design.stages:
        shares = (stage.criterion, *(stage.errors[name] for name in design.of))
        rows.append(row(stage.label, *(percent(share).removesuffix(" %") for share in shares)))
    ratios, worst = design.ratios, design.other_values.ratios
    rows.append(row("share of best 1 step", "", *(f"{ratios[name]:.2f}" for name in design.of)))
    spread = 100.0 * design.other_values.spread
    cells = ("-" if worst[name] is None else f"{worst[name]:.2f}" for name in design.of)
    rows.append(row(f"the same, {spread:g} % off", "", *cells))
    heads = ["mean", *design.of]
    yield Table(columns("errors in %", *heads, numbers=heads), tuple(rows))
    yield Verbatim("\n".join(sheet_lines(design)))
    channels = ", ".join(design.best.channels)
    yield from notes(
        (
            f"'share of best 1 step': divided by those of the best single step, which "
            f"is {design.single.steps[0].step:+.5g} pu, with the same limits, duration and "
            f"channels ({channels}); '{spread:g} % off': the largest share with each parameter "
            f"{spread:g} % smaller or larger",
            LOCAL,
            *design.notes,
        )
    )


def design(result: Design) -> Iterator[Block]:
    """Yield the standard errors of each parameter in planned tests, in percent."""
    listed = ", ".join(f"{signal}{NO_BREAK}{level:.2g}" for signal, level in result.noise.items())
    yield paragraph(f"expected standard errors, with noise (pu): {listed}")
    others = "; of steps of 2, 5, 10 %; twice as long; with further signals"
    yield paragraph(f"of this test{others if result.plans else ''}")
    heads = ["this test", *(plan.label for plan in result.plans)]
    tests = [result.own.confidence, *(plan.confidence for plan in result.plans)]
    yield Table(
        columns("parameter", *heads, numbers=heads),
        tuple(
            row(name, *(error_of(confidence.parameters[name]) for confidence in tests))
            for name in result.own.confidence.names
        ),
    )
    if result.own.effects:
        yield _effects(result.own.effects)
    yield from unresolved(result.sentences)
    yield from notes(result.notes)


def _effects(ranked: Sequence[ParameterEffect]) -> Table:
    """Make the table of what 1 % of each parameter does to the records, the strongest first."""
    heads = [*(f"{label} (pu)" for label in ranked[0].rms), "of noise"]
    return Table(
        columns("parameter", *heads, numbers=heads),
        tuple(
            row(
                effect.label,
                *(f"{change:.2e}" for change in effect.rms.values()),
                number(effect.of_noise, 2),
            )
            for effect in ranked
        ),
        "change for 1 % of each parameter, rms over the test, the strongest first",
    )
