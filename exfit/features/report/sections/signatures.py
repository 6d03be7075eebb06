"""Who tested, wrote, checked and approved; which revision it is."""

from typing import NamedTuple

from exfit.features.programme.result import ProgrammeResult
from exfit.results.facts import (
    APPROVED,
    CHANGES,
    CHECKED,
    DATE,
    REPORTED,
    REVISION,
    TESTED,
    WRITTEN,
    answer,
    stated,
)
from exfit.results.validation_result import Reported


class Signature(NamedTuple):
    """A role, who has it, and the date that goes with it, empty where it is to be written."""

    role: str
    name: str
    date: str


class Signatures(NamedTuple):
    """The revision of the report, and who answers for it."""

    revision: str
    date: str
    note: str
    rows: tuple[Signature, ...]


def signatures(result: Reported | ProgrammeResult) -> Signatures:
    """Return the block of revision and signatures."""
    about = result.about
    return Signatures(
        answer(about, REVISION),
        answer(about, REPORTED),
        answer(about, CHANGES),
        (
            Signature(TESTED.key, answer(about, TESTED), stated(about, DATE) or ""),
            Signature(WRITTEN.key, answer(about, WRITTEN), stated(about, REPORTED) or ""),
            Signature(CHECKED.key, answer(about, CHECKED), ""),
            Signature(APPROVED.key, answer(about, APPROVED), ""),
        ),
    )
