"""The files of a fit: its tables, its parameters, and result.json, which is read back, too."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from exfit.errors import ExfitError
from exfit.fitting.nuisances import prefix_from
from exfit.results.comparisons import Comparison
from exfit.results.model import FitResult
from exfit.results.tables import (
    comparison_table,
    effects_table,
    history_table,
    iteration_responses_table,
    parameter_file,
    phase_end_file,
)
from exfit.results.thinning import thinned, thinned_validation
from exfit.util.file_names import (
    HISTORY,
    ITERATIONS,
    PARAMETERS,
    RESPONSE,
    SENSITIVITIES,
    VALIDATION,
    WHOLE_FIT,
    WHOLE_PROGRAMME,
)
from exfit.util.files import read_json
from exfit.util.text import show_value, to_json
from exfit.util.typed import plain

if TYPE_CHECKING:
    from exfit.results.validation_result import ValidationResult

Form = TypeVar("Form")
VERSION = 12  # of the files; others are refused


def files_of_fit(result: FitResult) -> Iterator[tuple[str, str]]:
    """Yield the names and contents of a fit's tables, and last of its result."""
    yield PARAMETERS, parameter_file(result)
    for end in result.phase_ends:
        yield f"parameters_{end.phase}.yaml", phase_end_file(result, end)
    yield HISTORY, history_table(result)
    if not prefix_from(result.comparison.name):  # the only record
        yield RESPONSE, comparison_table(result.comparison)
    else:
        yield from comparison_files(result.comparisons)
    yield from comparison_files(result.validation)
    for match in result.comparisons:
        if match.iteration_responses is not None:
            record = prefix_from(match.name).removesuffix(".")
            name = f"{record}-{ITERATIONS}" if record else ITERATIONS
            yield name, iteration_responses_table(match.iteration_responses)
    if result.knowledge is not None:
        yield SENSITIVITIES, effects_table(result.knowledge.effects)
    yield WHOLE_FIT, result_text(result)


def comparison_files(comparisons: Sequence[Comparison]) -> Iterator[tuple[str, str]]:
    """Yield the samples of each comparison that has some, under its name."""
    return ((f"{each.name}.csv", comparison_table(each)) for each in comparisons if each.overlays)


def result_text(result: FitResult) -> str:
    """Write result.json as a text: all of a fit, long samples thinned to their extremes."""
    return to_json({"version": VERSION, **plain(thinned(result), whole=True)})


def validation_text(result: "ValidationResult") -> str:
    """Write validation.json as a text: all of a validation, long samples thinned."""
    return to_json({"version": VERSION, **plain(thinned_validation(result), whole=True)})


def load_validation(source: Path) -> "ValidationResult":
    """Read a validation from its validation.json.

    Raises ExfitError where the file cannot be read, or does not hold all of a validation.
    """
    from exfit.results.consistency import validation_contradictions
    from exfit.results.validation_result import ValidationResult

    content = read_json(source)
    return _read(source, content, ValidationResult, validation_contradictions, "validate again")


def load_result(path: str | PathLike[str]) -> FitResult:
    """Read a fit from its result.json, given that or the folder that holds it.

    Raises ExfitError where the file cannot be read, is of another version, or is no result of a
    fit: with the place in it, and what is wrong there.
    """
    from exfit.results.consistency import contradictions

    source = result_file(Path(path))
    if not source.exists() and source.with_name(VALIDATION).is_file():
        raise ExfitError(f"{path}: a validation, not the result of a fit")
    content = read_json(source)
    if not {"model", "parameters", "fixed"} <= content.keys():
        raise ExfitError(f"{source}: not the result of a fit: model, parameters or fixed missing")
    return _read(source, content, FitResult, contradictions, "fit again")


def _read(
    source: Path,
    content: Mapping[str, Any],
    form: type[Form],
    contradictions: Callable[[Form], Iterator[str]],
    remedy: str,
) -> Form:
    """Read a result of this version without contradictions; a remedy ends what is wrong."""
    from exfit.util.typed_reading import FormError, read

    version = content.get("version", 1)  # the first version had none
    shown = f"{source}: version: {show_value(version)}"
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise ExfitError(f"{shown} is not a version of results")
    if version > VERSION:
        raise ExfitError(f"{shown}: written by a later exfit; this one reads {VERSION}")
    if version < VERSION:
        raise ExfitError(f"{shown}: of an earlier exfit; this one reads {VERSION}: {remedy}")
    try:
        result: Form = read(form, content)
    except FormError as fault:
        raise ExfitError(f"{source}: {fault}; {remedy}") from None
    for text in contradictions(result):
        raise ExfitError(f"{source}: {text}; {remedy}")
    return result


def result_file(path: Path) -> Path:
    """Name the file of a fit, given it or the folder that holds it."""
    return path / WHOLE_FIT if path.is_dir() else path


def stored_file(path: Path) -> Path:
    """Name the file of a programme, fit or validation, given it or the folder that holds it."""
    if not path.is_dir():
        return path
    names = (WHOLE_PROGRAMME, WHOLE_FIT, VALIDATION)
    return next((path / name for name in names if (path / name).is_file()), path / WHOLE_FIT)
