"""The command translate."""

from pathlib import Path

import click

from exfit.cli import completion
from exfit.cli.given_files import GivenFile, Kind
from exfit.cli.options import NOT_CONVERGED, Output, output_options, print_json
from exfit.errors import ExfitError


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
    """Find the parameters of another exciter that responds as the fitted one of RESULT.

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
    from exfit.results.io import load_result, result_file
    from exfit.show import run_folder

    source = result_file(result)
    fit = load_result(source)
    target = target_model(model)
    folder = output.folder(f"{fit.name}-{target.name}", FILES)
    run_folder.refuse_inputs(FILES, [source], folder)
    try:
        if output.shown:
            from exfit.show import terminal

            console = terminal.console()
            with terminal.ProgressBar(console).running() as progress:
                translation = translated(fit, target, steps, progress)
        else:
            translation = translated(fit, target, steps)
    except ExfitError as fault:
        raise ExfitError(f"{source}: {fault}") from None
    figures = write_translation(translation, fit, (model, target), folder)
    if output.as_json:
        print_json(translation.to_dict())
    elif output.shown:
        from exfit.features.translate.translation_blocks import translation as blocks_of

        terminal.show(console, blocks_of(translation))
        terminal.written(console, folder)
    output.draw(figures)
    if translation.poor:
        raise SystemExit(NOT_CONVERGED)
