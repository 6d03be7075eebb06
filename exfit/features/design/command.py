"""The command identify, and what it shows."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli import completion
from exfit.cli.options import Output, assignments, case_argument, load, output_options
from exfit.output.blocks import (
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

if TYPE_CHECKING:
    from exfit.features.design.designed_test import DesignedTest
    from exfit.features.design.experiment_design import Design

CRITERIA = {
    "A": "root mean square of the standard errors",
    "D": "geometric mean over the axes of the confidence ellipsoid",
}
LOCAL = (
    "the standard errors are those of linear theory at the values of the case, for a correct "
    "model; given values, and size and time of each step, count as known"
)


@click.command(short_help="Predict how well a planned test determines the parameters.")
@case_argument
@click.option(
    "--noise",
    multiple=True,
    metavar="vt=1e-4",
    help="Noise of a signal, pu; may be repeated.",
    shell_complete=completion.noises,
)
@click.option(
    "--design",
    is_flag=True,
    help="Find the best test within limits; the options below set them.",
)
@click.option(
    "--of",
    metavar="KA[,TE]",
    help="Parameters to determine best (default: all that are free).",
)
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="vt=0.05",
    help="Limit, pu: deviation of vt (default 0.05) and vref (that of vt), efd, efd_min; may be "
    "repeated.",
)
@click.option("--duration", type=float, metavar="S", help="Length of the test, s (that of CASE).")
@click.option(
    "--channels",
    metavar="vt[,efd]",
    help="Signals that can be recorded; up to three are chosen (default: all signals).",
)
@click.option(
    "--criterion",
    type=click.Choice(["A", "D"]),
    help="A: mean square of the relative standard errors (default); D: volume of their ellipsoid.",
)
@output_options
def identify(
    case: Path,
    noise: tuple[str, ...],
    design: bool,
    of: str | None,
    limits: tuple[str, ...],
    duration: float | None,
    channels: str | None,
    criterion: str | None,
    output: Output,
) -> None:
    """Predict which free parameters of CASE a test determines, and how well; it needs no record.

    Compares, at the start values, the test of CASE, steps of 2, 5 and 10 %, a test twice as long,
    and further channels; ranks the parameters by the change of the response for 1 % of each. Writes
    identify.json, sensitivities.csv and figures to runs/CASE-identify, or to DIR.

    With --design it searches for up to four steps of the reference and up to three channels that
    determine the parameters best within limits, shows the gain of each addition, and prints the
    test sheet for the plant. Writes designed_test.json, test_sheet.txt, test_sheet.csv, a section
    for the case, test_section.yaml, and a figure.
    """
    of_design = {
        "of": of,
        "limit": limits,
        "duration": duration,
        "channels": channels,
        "criterion": criterion,
    }
    given = [option for option, value in of_design.items() if value not in (None, ())]
    if given and not design:
        raise click.UsageError(f"--{given[0]} is an option of --design, which is missing")
    from exfit.features.design.designed_test import design_test
    from exfit.features.design.experiment_design import identify as prediction
    from exfit.features.design.files import FILES, write_design, write_designed_test

    loaded = load(case)
    folder = output.folder_of(loaded, "identify", FILES)
    levels = assignments(noise, "--noise")
    if not design:
        planned = prediction(loaded, levels)
        figures = write_design(planned, folder)
        output.show(planned.as_json(), blocks_of_design(planned), folder, figures)
        return
    designed = design_test(
        loaded,
        _names(of),
        limits=assignments(limits, "--limit"),
        duration=duration,
        channels=_names(channels),
        criterion=criterion or "A",
        noise=levels,
    )
    figures = write_designed_test(designed, folder)
    output.show(designed.as_json(), blocks_of_designed_test(designed), folder, figures)


def _names(text: str | None) -> list[str]:
    return [] if text is None else [name.strip() for name in text.split(",")]


def blocks_of_designed_test(design: "DesignedTest") -> Iterator[Block]:
    """Yield the gain of each addition, then the sheet of the best test."""
    from exfit.features.design.files import sheet_lines

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
            f"'share of best 1 step': divided by those of the best single step, "
            f"{design.single.steps[0].step:+.5g} pu, with the same limits, duration and "
            f"channels ({channels}); '{spread:g} % off': the largest share with each parameter "
            f"{spread:g} % smaller or larger",
            LOCAL,
            *design.notes,
        )
    )


def blocks_of_design(result: "Design") -> Iterator[Block]:
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
    ranked = result.own.effects
    if ranked:
        heads = [*(f"{label} (pu)" for label in ranked[0].rms), "of noise"]
        yield Table(
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
    yield from unresolved(result.sentences)
    yield from notes(result.notes)
