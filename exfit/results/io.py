"""The file of a fit, result.json: written and read by the description that its classes are."""

from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from exfit.errors import ExfitError
from exfit.results.consistency import contradictions, validation_contradictions
from exfit.results.description import PARTS, PartDescription
from exfit.results.model import FitResult
from exfit.results.thinning import thinned, thinned_validation
from exfit.results.validation_result import ValidationResult
from exfit.util.file_names import VALIDATION, WHOLE_FIT
from exfit.util.json_files import read_json
from exfit.util.sources import FITTED, TYPICAL
from exfit.util.text import show_value, to_json
from exfit.util.typed import FormError, Reader, plain

VERSION = 10  # of the file; a file without a version is of the first


def result_text(result: FitResult) -> str:
    """Return the text of result.json: all of a fit, long samples thinned to their extremes."""
    return to_json({"version": VERSION, **plain(thinned(result), whole=True)})


def validation_text(result: ValidationResult) -> str:
    """Return the text of validation.json: all of a validation, long samples thinned."""
    return to_json({"version": VERSION, **plain(thinned_validation(result), whole=True)})


def load_validation(source: Path) -> ValidationResult:
    """Return a validation, given its validation.json.

    Raises ExfitError where the file cannot be read, or does not hold all of a validation.
    """
    content = read_json(source)
    if "version" not in content:
        raise ExfitError(f"{source}: it lacks what a report shows; validate again")
    _refuse_later(source, content["version"])
    try:
        result: ValidationResult = Reader(complete=False).read(ValidationResult, content)
    except FormError as fault:
        raise ExfitError(f"{source}: {fault}; validate again") from None
    for text in validation_contradictions(result):
        raise ExfitError(f"{source}: {text}; validate again")
    return result


def load_result(path: str | PathLike[str]) -> FitResult:
    """Return a fit, given its result.json or the folder that holds it.

    A file of an earlier version is read as far as it goes. Raises ExfitError where the file cannot
    be read, or is no result of a fit: with the place in it, and what is wrong there.
    """
    source = result_file(Path(path))
    if not source.exists() and source.with_name(VALIDATION).is_file():
        raise ExfitError(f"{path}: holds a validation, no result of a fit")
    content = _content(source)
    version = content.get("version", 1)
    _refuse_later(source, version)
    whole = {**content, "parts": _parts_of(content)} if version == 1 else content
    if version < VERSION and "sources" not in whole:
        whole = {**whole, "sources": _sources_of(whole)}
    try:
        result: FitResult = Reader(complete=version == VERSION).read(FitResult, whole)
    except FormError as fault:
        raise ExfitError(f"{source}: {fault}; fit again") from None
    for text in contradictions(result):
        raise ExfitError(f"{source}: {text}; fit again")
    return result if version == VERSION else _without_false_intervals(result)


def _without_false_intervals(result: FitResult) -> FitResult:
    """Return a fit of an earlier version without intervals where its verdict leaves none."""
    why = "" if result.verdict is None else result.verdict.no_interval
    if not why:
        return result
    known = result.knowledge
    return replace(
        result,
        parameters={name: each.without_interval(why) for name, each in result.parameters.items()},
        knowledge=None if known is None else known.without_intervals(why),
    )


def _refuse_later(source: Path, version: Any) -> None:
    """Raise ExfitError for the version of a file that this exfit does not read."""
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise ExfitError(f"{source}: version: {show_value(version)} is not a version of results")
    if version > VERSION:
        raise ExfitError(
            f"{source}: version {show_value(version)}: written by a later exfit; "
            f"this one reads up to {VERSION}"
        )


def result_file(path: Path) -> Path:
    """Return the file of a fit, given it or the folder that holds it."""
    return path / WHOLE_FIT if path.is_dir() else path


def _content(source: Path) -> dict[str, Any]:
    content = read_json(source)
    if not {"model", "parameters", "fixed"} <= content.keys():
        raise ExfitError(f"{source}: not the result of a fit: model, parameters or fixed missing")
    return content


def _sources_of(content: Mapping[str, Any]) -> dict[str, str]:
    """Return where values come from, as far as a file of an earlier version says."""
    typical, fitted = content.get("typical"), content["parameters"]
    names = [name for name in typical if isinstance(name, str)] if isinstance(typical, list) else []
    found = fitted if isinstance(fitted, dict) else {}
    return {**dict.fromkeys(names, TYPICAL), **dict.fromkeys(found, FITTED)}


def _parts_of(content: Mapping[str, Any]) -> list[Any]:
    """Return the parts that a file of the first version names: without drawings and data sheets."""
    names = {kind: content.get(f"{kind}_model") for kind in PARTS}
    parts = [PartDescription(kind, str(name), f"{kind}.") for kind, name in names.items() if name]
    if content["model"] != names["machine"]:
        parts.insert(0, PartDescription("exciter", str(content["model"]), ""))
    return [plain(part, whole=True) for part in parts]
