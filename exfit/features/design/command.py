"""The command identify."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from exfit.cli import completion
from exfit.cli.options import (
    Output,
    assignments,
    case_argument,
    load,
    output_options,
    print_json,
)

if TYPE_CHECKING:
    from exfit.case.case import Case


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
    help="Find the best test within limits instead; the options below say which.",
)
@click.option(
    "--of",
    metavar="KA[,TE]",
    help="Parameters to be known best (default: all that are free).",
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
    help="What can be recorded; up to three are chosen (default: all signals).",
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
    output: Output,
    **of_design: Any,
) -> None:
    """Predict which free parameters of CASE a test determines, and how well; it needs no record.

    Compared at the start values are the test of CASE, steps of 2, 5 and 10 %, a test twice as long,
    and further channels; the parameters are ranked by what 1 % of each does to the response. Writes
    identify.json, sensitivities.csv and figures to runs/CASE-identify, or to DIR.

    With --design it searches for up to four steps of the reference and up to three channels that
    make the parameters best known within limits, shows what each addition brings, and prints the
    test sheet for the plant. Writes designed_test.json, test_sheet.txt, test_sheet.csv, a section
    for the case, test_section.yaml, and a figure.
    """
    from exfit.features.design.files import FILES

    given = [name for name, value in of_design.items() if value not in (None, ())]
    if given and not design:
        option = {"limits": "limit"}.get(given[0], given[0])
        raise click.UsageError(f"--{option} is an option of --design, which is missing")
    loaded = load(case)
    folder = output.folder_of(loaded, "identify", FILES)
    levels = assignments(noise, "--noise")
    if design:
        _design(loaded, folder, levels, output, **of_design)
    else:
        _identify(loaded, folder, levels, output)


def _identify(loaded: "Case", folder: Path, noise: Mapping[str, float], output: Output) -> None:
    """Show how well the test of a case, and others beside it, determine its parameters."""
    from exfit.features.design.design import identify
    from exfit.features.design.files import write_design

    design = identify(loaded, noise)
    figures = write_design(design, folder)
    if output.as_json:
        print_json(design.as_json())
    elif output.shown:
        from exfit.features.design import design_blocks
        from exfit.show import terminal

        console = terminal.console()
        terminal.show(console, design_blocks.design(design))
        console.print()
        terminal.written(console, folder)
    output.draw(figures)


def _design(
    loaded: "Case",
    folder: Path,
    noise: Mapping[str, float],
    output: Output,
    of: str | None,
    limits: tuple[str, ...],
    duration: float | None,
    channels: str | None,
    criterion: str | None,
) -> None:
    """Show the best test within limits."""
    from exfit.features.design.design import design_test
    from exfit.features.design.files import write_designed_test

    design = design_test(
        loaded,
        _names(of),
        limits=assignments(limits, "--limit"),
        duration=duration,
        channels=_names(channels),
        criterion=criterion or "A",
        noise=noise,
    )
    figures = write_designed_test(design, folder)
    if output.as_json:
        print_json(design.as_json())
    elif output.shown:
        from exfit.features.design import design_blocks
        from exfit.show import terminal

        console = terminal.console()
        terminal.show(console, design_blocks.designed_test(design))
        terminal.written(console, folder)
    output.draw(figures)


def _names(text: str | None) -> list[str]:
    """Return the names of a list with commas."""
    return [] if text is None else [name.strip() for name in text.split(",")]
