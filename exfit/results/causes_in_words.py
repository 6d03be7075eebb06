"""The causes that a fit names in words, each with the command that tries its remedy."""

from collections.abc import Iterator
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
        names = ",".join((*result.freed, *cause.freed))
        options = f" --free {names}" if names else ""
        if not cause.freed:
            options += f" --apply {cause.word if alone else number}{output}"
        yield f"{cause.sentence}: `exfit fit {quote(case.as_posix())}{options}`"
