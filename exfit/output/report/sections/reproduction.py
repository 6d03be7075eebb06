"""How the report is made again: from which files, by what."""

from collections.abc import Mapping
from dataclasses import dataclass

from exfit import __version__
from exfit.results.model import FitResult


@dataclass(frozen=True)
class Reproduction:
    """How the report is made again; ``inputs`` has the file's name and hash by its label."""

    fit: tuple[str, ...]
    options: tuple[str, ...]
    versions: Mapping[str, str]
    inputs: Mapping[str, tuple[str, str]]
    case: str


def reproduction(result: FitResult) -> Reproduction:
    """Return how the report of a fit is made again; the folder of the result is not in it."""
    versions = dict(result.versions)
    if versions.get("exfit") != __version__:
        versions["exfit that made this report"] = __version__
    return Reproduction(
        fit=("exfit", "fit", str(result.case)),
        options=("--strategy", result.strategy) if result.strategy_given else (),
        versions=versions,
        inputs={
            label: (result.files.get(label, "–"), sha256) for label, sha256 in result.inputs.items()
        },
        case=result.case_text,
    )
