"""The causes that a fit names in words, each with the command that tries its remedy."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from shlex import quote

from exfit.results.model import OF_PROGRAMME, FitResult


def causes_in_words(result: FitResult, folder: Path | None = None) -> Iterator[str]:
    """Word the causes of a fit, each with the command that tries its remedy on the case of a file.

    ``folder`` has the files of the fit, where it is known.
    """
    causes, case = result.verdict.causes, result.case
    of_file = bool(result.case_text) and OF_PROGRAMME not in result.inputs
    default = Path("runs") / f"{case.stem}-fit"
    output = f" -o {quote(folder.as_posix())}" if folder not in (None, default) else ""
    for number, cause in enumerate(causes, 1):
        if not (cause.changes and of_file):
            yield cause.sentence
            continue
        alone = sum(each.word == cause.word for each in causes) == 1
        options = "".join(f" {quote(each)}" for each in options_of(result, cause.freed))
        if not cause.freed:
            options += f" --apply {cause.word if alone else number}{output}"
        yield f"{cause.sentence}: `exfit fit {quote(case.as_posix())}{options}`"


def options_of(result: FitResult, freed: Sequence[str] = ()) -> list[str]:
    """List the options of the command by which a case was fitted; ``freed`` are fitted, too.

    Given values stand one by one: the file that they are from may be gone.
    """
    options = ["--strategy", result.strategy] if result.strategy_given else []
    options += ["--search", result.search_given] if result.search_given else []
    for name, given in result.given_values.items():
        options += ["--set", f"{name}={given.value!r}"]
    names = ",".join((*result.freed, *freed))
    return [*options, "--free", names] if names else options
