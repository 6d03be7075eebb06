"""How the report is made again: from which files, by what."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from exfit import __version__
from exfit.features.programme.kept import KEY
from exfit.results.description import GivenInPlace
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported, ValidationResult


@dataclass(frozen=True)
class Reproduction:
    """How the report is made again; ``inputs`` has the file's name and hash by its label.

    ``given`` are the values in place of those of ``case``, the text of the case file.
    """

    fit: tuple[str, ...]
    options: tuple[str, ...]
    versions: Mapping[str, str]
    inputs: Mapping[str, tuple[str, str]]
    case: str
    given: Mapping[str, GivenInPlace]


def reproduction(result: FitResult) -> Reproduction:
    """List what makes the report of a fit again; the folder of the result is not in it."""
    of_programme = KEY in result.inputs
    return Reproduction(
        fit=("exfit", "run" if of_programme else "fit", str(result.case)),
        options=() if of_programme else tuple(_options(result)),
        versions=_versions(result.versions),
        inputs=_inputs(result),
        case=result.case_text,
        given=result.given_values,
    )


def reproduction_of_validation(result: ValidationResult) -> Reproduction:
    """List what makes the report of a validation again."""
    return Reproduction(
        fit=("exfit", "validate", str(result.case)),
        options=result.options,
        versions=_versions(result.versions),
        inputs=_inputs(result),
        case=result.case_text,
        given={},
    )


def _versions(versions: Mapping[str, str]) -> dict[str, str]:
    if versions.get("exfit") == __version__:
        return dict(versions)
    return {**versions, "exfit that made this report": __version__}


def _inputs(result: Reported) -> dict[str, tuple[str, str]]:
    return {
        label: (result.files.get(label, "–"), sha256) for label, sha256 in result.inputs.items()
    }


def _options(result: FitResult) -> Iterator[str]:
    """Yield the options of the fit; each given value by itself: its file may be gone."""
    if result.strategy_given:
        yield from ("--strategy", result.strategy)
    for name, given in result.given_values.items():
        yield from ("--set", f"{name}={given.value!r}")
