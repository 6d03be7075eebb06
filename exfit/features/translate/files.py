"""The files of a translation: its responses as a table, a case and PSS/E records of the target."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from exfit.case.case_draft import CaseDraft, Noted, Section, with_sources
from exfit.case.other_model import BOUNDS, bounds_of, free_of
from exfit.case.stated_values import SOURCES as SOURCES_BY_NAME
from exfit.case.stated_values import STD_ERRORS, taken_apart
from exfit.case.suggestion import relative
from exfit.case.yaml import read_yaml
from exfit.errors import ExfitError
from exfit.features.planner.export import comment_lines, export
from exfit.features.planner.records import alternatives
from exfit.features.translate.result import TranslatedParameter, Translation
from exfit.features.translate.steps import network_of
from exfit.models.sheet import Model, Parameter
from exfit.output.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.plants import MACHINE, NETWORK
from exfit.plants.infinite_bus import INFINITE_BUS
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.results.model import FitResult
from exfit.results.tables import table
from exfit.util.files import write_together
from exfit.util.text import to_json
from exfit.util.vocabulary import FITTED, SOURCES

SAMPLES, TRANSLATION = FILES = ("translation.csv", "translation.json")
TEST: Mapping[str, Any] = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}], "duration": 10.0}
EXCITER = ("model", "parameters")  # the sections of a case that change


def write_translation(
    translation: Translation,
    result: FitResult,
    target: tuple[str, Model],
    folder: Path,
) -> FigureFiles:
    """Write a translation as JSON, its responses, a case and a PSS/E file; return its figure.

    ``target`` is the model, behind its name as it was given: of a user's own model its file.
    """
    given, model = target
    own = f"{result.name}-{model.name}"
    case = translated_case(
        result.case_text,
        result.case,
        folder,
        (relative(Path(given), folder) if given.endswith(".py") else model.name, model),
        translation.parameters,
        _plant(result),
        f"{translation.source} of {result.case.name} as {translation.target}.\n"
        f"{translation.verdict}",
    )
    files = {f"{own}.yaml": case, SAMPLES: responses_table(translation)}
    if alternatives(model):
        files[f"{own}.dyr"] = records_of_translation(translation, result)
    files[TRANSLATION] = to_json(translation.to_dict())
    write_together(folder, files, ["translation.png"])
    return FigureFiles.beside(folder / TRANSLATION, partial(_figure, translation))


def _figure(translation: Translation) -> PlannedFigures:
    from exfit.features.translate import figure

    title = f"{translation.name}: {translation.source} and {translation.target}"
    drawing = partial(figure.translation, translation, title)
    shows = "the responses of both models to the same steps"
    return {"translation.png": PlannedFigure(shows, drawing)}


def records_of_translation(translation: Translation, result: FitResult) -> str:
    """Return the PSS/E records of a translation, or a comment that says why there are none."""
    try:
        return export(result, translation=translation).text
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
                header.append(f"{signal} {model} {step.label}")  # both models may have one name
                columns.append(samples)
    return table(header, columns)


def _plant(result: FitResult) -> Section:
    network = network_of(result)
    sources = {
        symbol: word
        for prefix, symbols in ((MACHINE, result.machine), (NETWORK, network))
        for symbol in symbols
        if (word := result.sources.get(prefix + symbol)) in SOURCES
    }
    return {
        "type": INFINITE_BUS.name if network else OPEN_CIRCUIT.name,
        "machine": result.machine_model,
        "parameters": dict(result.machine),
        "sources": sources,
        **({"network": network} if network else {}),
    }


def translated_case(
    text: str,
    case: Path,
    folder: Path,
    target: tuple[str, Model],
    parameters: Mapping[str, TranslatedParameter],
    plant: Section,
    heading: str,
) -> str:
    """Return the text of a case of another model, to be written into ``folder``.

    ``target`` is behind the name that the case gives it, ``text`` that of the fitted ``case``.
    Where there is no such text, the case is one of ``plant``, without a record. What the fit found
    for the machine is where its parameters start.
    """
    name, model = target
    content = read_yaml(text, case)[0].value if text else {"plant": plant, "test": TEST}
    sections = {key: value for key, value in content.items() if key not in EXCITER}
    sections = _moved(sections, case.parent, folder)
    sections["plant"] = _with_values(sections.get("plant", {}), plant.get("parameters", {}))
    values = {symbol: entry.value for symbol, entry in parameters.items()}
    free = {row.symbol: row for row in free_of(model, values)}
    exciter: Section = {"fixed": {}}
    for symbol, entry in parameters.items():
        note = f"{entry.unit}, {entry.provenance}"
        if symbol not in free:
            exciter["fixed"][symbol] = Noted(entry.value, note)
            continue
        start = _start(free[symbol], entry.value)
        note = f"{entry.unit}, {entry.meaning}; {entry.provenance}"
        exciter.setdefault("free", {})[symbol] = Noted(start, above=note)
    sources = {symbol: entry.value_source for symbol, entry in parameters.items()}
    return CaseDraft(
        {"model": name, **sections, "parameters": with_sources(exciter, sources)},
        tuple(heading.splitlines()),
    ).text


def _moved(content: Any, before: Path, now: Path) -> Any:
    """Return content whose files are named from another folder."""
    if isinstance(content, list):
        return [_moved(entry, before, now) for entry in content]
    if not isinstance(content, Mapping):
        return content
    return {
        key: relative((before / value).absolute(), now.absolute())
        if key == "file" and isinstance(value, str)
        else _moved(value, before, now)
        for key, value in content.items()
    }


def _with_values(plant: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """Return a plant section with fitted values, and numbers for what followed the exciter."""
    apart = taken_apart({"plant": dict(plant)}).content["plant"]
    given = {
        symbol: values.get(symbol, value) if isinstance(value, str) else value
        for symbol, value in apart.get("parameters", {}).items()
    }
    free = {
        symbol: {**section, "start": values.get(symbol, section.get("start"))}
        for symbol, section in apart.get("free", {}).items()
    }
    sources = {**apart.pop(SOURCES_BY_NAME, {}), **dict.fromkeys(free, FITTED)}
    std_errors = apart.pop(STD_ERRORS, {})
    changed = {"parameters": given, "free": free}
    section = {**apart, **{key: section for key, section in changed.items() if section}}
    return with_sources(section, sources, std_errors)


def _start(row: Parameter, value: float) -> Section:
    """Make a start within the bounds of a fit, also where it is not physical."""
    low, high = bounds_of(row, value)
    if not row.low <= value <= row.high:
        low, high = sorted(share * value for share in BOUNDS)
    bounds = {"min": float(f"{min(low, value):.6g}"), "max": float(f"{max(high, value):.6g}")}
    return {"start": value, **bounds, **({} if value > 0.0 else {"scale": "linear"})}
