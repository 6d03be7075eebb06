"""The command translate, and what it shows."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from exfit.cli import completion
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import NOT_CONVERGED, Output, output_options
from exfit.errors import ExfitError
from exfit.output.blocks import (
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

if TYPE_CHECKING:
    from exfit.features.translate.result import Translation

LOOP_ROWS = (
    ("bandwidth", "bandwidth", "Hz"),
    ("peak", "peak", "dB"),
    ("gain margin", "gain_margin", "dB"),
    ("phase margin", "phase_margin", "deg"),
    ("least damping ratio", "damping", ""),
    ("at", "frequency", "Hz"),
)


@click.command(short_help="Find the parameters of another model for the same response.")
@click.argument("result", type=GivenFile(Kind.RESULT))
@click.option(
    "--model",
    required=True,
    metavar="NAME",
    help="The other exciter, or the file of a model.",
    shell_complete=completion.exciters,
)
@click.option(
    "--step",
    "steps",
    type=float,
    multiple=True,
    metavar="PU",
    help="Size of the steps compared, up and down; may be repeated (default: 0.01, 0.05, 0.1).",
)
@output_options
def translate(result: Path, model: str, steps: tuple[float, ...], output: Output) -> None:
    """Find the parameters of another exciter that responds like the fitted one of RESULT.

    RESULT is the result.json of a fit, or the folder that holds it. Both models are compared in
    steps with the breaker open, and on load where the fit has a network. What both have is copied;
    where the responses then differ, the other's parameters are fitted to them. Reports what is
    lost. Writes translation.json, translation.csv, a case and a PSS/E file of the other model, and
    a figure to runs/CASE-MODEL, or to DIR. Exit code 3: the response is another, by more than 5 %
    of a step.
    """
    from exfit.features.translate.files import FILES, write_translation
    from exfit.features.translate.translate import target_model
    from exfit.features.translate.translate import translate as translated
    from exfit.output import run_folder
    from exfit.results.io import load_result, result_file

    source = result_file(result)
    fit = load_result(source)
    target = target_model(model)
    folder = output.folder(f"{fit.name}-{target.name}", FILES)
    run_folder.refuse_inputs(FILES, [source], folder)
    try:
        if output.shown:
            from exfit.output import live, terminal

            with live.ProgressBar(terminal.console()).running() as progress:
                translation = translated(fit, target, steps, progress)
        else:
            translation = translated(fit, target, steps)
    except ExfitError as fault:
        raise ExfitError(f"{source}: {fault}") from None
    figures = write_translation(translation, fit, (model, target), folder)
    output.show(translation.to_dict(), blocks_of(translation), folder, figures)
    if translation.poor:
        raise SystemExit(NOT_CONVERGED)


def blocks_of(result: "Translation") -> Iterator[Block]:
    """Yield the verdict, the parameters with their origin, errors in each step, what is lost."""
    yield paragraph(result.verdict, "bad" if result.poor else "strong")
    rows = []
    for name, parameter in result.parameters.items():
        words = parameter.origin_in_words
        if parameter.undetermined:
            words += "; hardly shown by the steps"
        doubtful = parameter.undetermined or parameter.origin == "typical"
        value = number(parameter.value)
        texts = (name, value, parameter.unit, words)
        rows.append(row(*texts, mark="doubt" if doubtful else ""))
    heads = columns("parameter", "value", "unit", f"from {result.source}", numbers=("value",))
    yield Table(heads, tuple(rows))
    steps = []
    for step in result.steps:
        vt, efd = step.errors["vt"], step.errors["efd"]
        errors = (vt.rmse_percent, vt.largest_percent, efd.largest_percent)
        cells = (
            f"{100.0 * step.step:+g} %",
            step.plant,
            *(f"{value:.2g} %" if value < 100.0 else f"{value:.0f} %" for value in errors),
            " ".join(step.source_limits),
            " ".join(step.target_limits),
        )
        steps.append(row(*cells, mark="" if step.fitted else "faint"))
    numbers = ("step", "rms vt", "max vt", "max efd")
    heads = columns("step", "plant", *numbers[1:], numbers=numbers)
    limits = (TableColumn(f"{model} at", folds=True) for model in (result.source, result.target))
    yield Table((*heads, *limits), tuple(steps))
    if result.loops:
        yield _loops(result)
    if result.lost:
        lost = ", ".join(f"{name}{NO_BREAK}{value:g}" for name, value in result.lost.items())
        yield paragraph(f"no counterpart in {result.target}: {lost}")
    yield from notes(result.notes)


def _loops(result: "Translation") -> Table:
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
