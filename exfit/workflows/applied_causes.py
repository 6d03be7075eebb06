"""The remedy of a cause that a fit has named, carried out: the changed case, beside the case."""

from pathlib import Path
from typing import NamedTuple

from exfit.case.load import parse_case
from exfit.case.rewriting import with_changes
from exfit.case.yaml import read_text
from exfit.errors import ExfitError
from exfit.records.reading import file_hash
from exfit.results.cause import Cause
from exfit.results.io import load_result
from exfit.results.model import FitResult
from exfit.util.files import write
from exfit.util.text import listed


class AppliedCause(NamedTuple):
    """The file of a changed case, the word for its change, and the change in a sentence."""

    path: Path
    word: str
    sentence: str


def write_applied(case: Path, name: str, folder: Path) -> AppliedCause:
    """Write a case with the remedy of a cause of its last fit, whose files are in a folder.

    ``name`` is the number of the cause, or its word. The file is beside the case; one that is there
    with another content stays.

    Raises ExfitError where there is no such fit or cause, where the case has changed since, and
    where the file is not written.
    """
    if not folder.exists():
        raise ExfitError(
            f"--apply: {folder}: not there: fit {case} first, or name its folder by -o"
        )
    result = load_result(folder)
    if result.case.resolve() != case.resolve():
        raise ExfitError(
            f"--apply: {folder}: of {result.case}, not of {case}: give its folder by -o"
        )
    if result.inputs.get("case") != file_hash(case):
        raise ExfitError(f"--apply: {case}: has changed since its fit in {folder}: fit it again")
    cause = _named(result, name)
    place = case.with_name(f"{case.stem}-{cause.word}{case.suffix}")
    text = with_changes(case, cause.changes)
    parse_case(text, place)
    if not place.exists():
        write(place, text)
    elif read_text(place) != text:
        raise ExfitError(f"{place}: exists with another content: rename or delete it")
    changes = {key: text for key, text in cause.changes.items() if text} or cause.changes
    words = listed([f"{key} {text or 'left out'}" for key, text in changes.items()])
    return AppliedCause(place, cause.word, f"{case.name} with {words}")


def _named(result: FitResult, name: str) -> Cause:
    """Return the cause of a number, or of a word that no other one has."""
    causes = dict(enumerate(result.verdict.causes, 1))
    able = {number: cause for number, cause in causes.items() if cause.changes}
    if not able:
        raise ExfitError(f"--apply {name}: the fit of {result.case} named no cause to apply")
    known = listed([f"{number} ({cause.word})" for number, cause in able.items()])
    found = [cause for number, cause in able.items() if name in (str(number), cause.word)]
    if len(found) != 1:
        what = "is no cause that can be applied" if not found else "may be several causes"
        raise ExfitError(f"--apply {name}: {what}; there are {known}")
    return found[0]
