"""The files of a translation: its responses as a table, a case and PSS/E records of the target."""

from functools import partial
from pathlib import Path

from exfit.case.draft.suggestion import relative
from exfit.errors import ExfitError
from exfit.features.planner.export import comment_lines, export, place_of
from exfit.features.planner.records import alternatives
from exfit.features.translate.case import translated_case
from exfit.features.translate.result import Translation
from exfit.features.translate.steps import network_of
from exfit.models.sheet import Model
from exfit.plants import MACHINE, NETWORK
from exfit.plants.infinite_bus import INFINITE_BUS
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.results.model import FitResult
from exfit.results.tables import table
from exfit.show.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.util.files import write_together
from exfit.util.sources import SOURCES
from exfit.util.text import to_json

SAMPLES, TRANSLATION = FILES = ("translation.csv", "translation.json")


def write_translation(
    translation: Translation,
    result: FitResult,
    target: tuple[str, Model],
    folder: Path,
) -> FigureFiles:
    """Write a translation as JSON, its responses, a case and a PSS/E file; return its figure.

    ``target`` is the model, behind its name as it was given.
    """
    numbers = files_of_translation(translation, result, target, folder)
    numbers[TRANSLATION] = to_json(translation.to_dict())
    write_together(folder, numbers, ["translation.png"])
    return FigureFiles.beside(folder / TRANSLATION, partial(_figure, translation))


def _figure(translation: Translation) -> PlannedFigures:
    from exfit.features.translate import figure

    title = f"{translation.name}: {translation.source} and {translation.target}"
    drawing = partial(figure.translation, translation, title)
    shows = "the responses of both models to the same steps"
    return {"translation.png": PlannedFigure(shows, drawing)}


def files_of_translation(
    translation: Translation, result: FitResult, target: tuple[str, Model], folder: Path
) -> dict[str, str]:
    """Return the texts of the files, to be written into ``folder``, by their names.

    ``target`` is the model, behind its name as it was given: of a user's own model its file.
    """
    given, model = target
    own = f"{result.name}-{model.name}"
    name = relative(Path(given), folder) if given.endswith(".py") else model.name
    files = {
        f"{own}.yaml": case_of_translation(translation, result, (name, model), folder),
        SAMPLES: responses_table(translation),
    }
    if alternatives(model):
        files[f"{own}.dyr"] = records_of_translation(translation, result)
    return files


def records_of_translation(translation: Translation, result: FitResult) -> str:
    """Return the PSS/E records of a translation, or a comment that says why there are none."""
    try:
        return export(result, *place_of(result), translation=translation).text
    except ExfitError as fault:
        texts = [f"No record is written: {text}." for text in str(fault).splitlines()]
        return "\n".join([*(line for text in texts for line in comment_lines(text)), ""])


def responses_table(translation: Translation) -> str:
    """Return the responses of both models in every step, as CSV."""
    header, columns = ["t"], [translation.time]
    for step in translation.steps:
        for model, signals in (
            (translation.source, step.source),
            (translation.target, step.target),
        ):
            for signal, samples in signals.items():
                header.append(f"{signal} {model} {step.label}")
                columns.append(samples)
    return table(header, columns)


def case_of_translation(
    translation: Translation, result: FitResult, target: tuple[str, Model], folder: Path
) -> str:
    """Return the case of the fit with the target in place of its exciter."""
    network = network_of(result)
    machine = {
        "machine": result.machine_model,
        "parameters": dict(result.machine),
        "sources": {
            symbol: word
            for prefix, symbols in ((MACHINE, result.machine), (NETWORK, network))
            for symbol in symbols
            if (word := result.sources.get(prefix + symbol)) in SOURCES
        },
    }
    plant = (
        {"type": INFINITE_BUS.name, **machine, "network": network}
        if network
        else {"type": OPEN_CIRCUIT.name, **machine}
    )
    return translated_case(
        result.case_text,
        result.case,
        folder,
        target,
        translation.values,
        {symbol: entry.provenance for symbol, entry in translation.parameters.items()},
        {symbol: entry.value_source for symbol, entry in translation.parameters.items()},
        plant,
        f"{translation.source} of {result.case.name} as {translation.target}.\n"
        f"{translation.verdict}",
    )
